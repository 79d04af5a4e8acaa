"""The one Jinja environment: templates loop and print, Python decides."""

from __future__ import annotations

import marshal
from functools import lru_cache
from importlib.util import MAGIC_NUMBER
from typing import Any

import jinja2
from jinja2 import Environment, FileSystemLoader, StrictUndefined, Template

from lag2fmu.building.build_cache import kept
from lag2fmu.codegen.c import c_combination, c_function, c_number, c_prototype, c_string, c_table
from lag2fmu.codegen.python import python_text
from lag2fmu.resources import resource_folder


class _Loader(FileSystemLoader):
    """Reads templates from files, and keeps their bytecode as libraries are kept: to compile them takes longer."""

    def load(self, environment: Environment, name: str, globals: Any = None) -> Template:
        """The template called ``name``; raises TemplateNotFound."""
        text, path, _ = self.get_source(environment, name)
        made_of = ("template", jinja2.__version__, MAGIC_NUMBER, path, text)
        code = kept(made_of, lambda: marshal.dumps(environment.compile(text, name, path)))
        return Template.from_code(environment, marshal.loads(code), globals or {})  # noqa: S302 (of this user alone)


@lru_cache(maxsize=1)
def _environment() -> Environment:
    environment = Environment(
        loader=_Loader(resource_folder("templates")),
        optimized=False,  # filters that are folded into a template would be kept with it
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,  # noqa: S701  # the result is C or Python; XML is written by an XML library
    )
    environment.filters |= {
        "c_combination": c_combination,
        "c_number": c_number,
        "c_string": c_string,
        "c_prototype": c_prototype,
        "c_table": c_table,
        "c_bound": _c_bound,
        "c_comment": _c_comment,
        "python_text": python_text,
    }
    environment.globals["c_function"] = c_function
    return environment


def render(template: str, context: dict[str, object]) -> str:
    """The text of ``template`` (a path below templates/) with ``context``; an undefined name raises UndefinedError."""
    return _environment().get_template(template).render(context)


def _c_bound(value: float | None, sign: int) -> str:
    """A bound as C, HUGE_VAL of ``sign`` if there is none."""
    if value is None:
        return "-HUGE_VAL" if sign < 0 else "HUGE_VAL"
    return c_number(value)


def _c_comment(text: str) -> str:
    """``text`` such that it cannot end a comment."""
    return text.replace("*/", "* /")
