"""Interfaces in WIT, as far as the draft fmi-ls-wasm uses it: a text in, records out.

Source: the Component Model, design/mvp/WIT.md. A type is a tuple of a word and its parts; others are named by strings.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

Type: TypeAlias = "str | tuple[Type, ...]"
"""A name, of a primitive type or another one; or (word, parts), e.g. ("result", ("list", "f64"), "status").

("record", label, type, label, type, ...) and ("enum", label, ...) have labels; ("borrow", resource) is the handle of a
call, and the name of a resource one that owns it.
"""

_TOKEN = re.compile(r"[a-z][\w-]*|->|[^\s\w]")


@dataclass(frozen=True)
class WitFunction:
    """A function: its name as components export it, its parameters {name: type}, and its result, None without one."""

    name: str
    parameters: Mapping[str, Type]
    result: Type | None


@dataclass(frozen=True)
class WitInterface:
    """An interface by its full ``name``: types {name: type} in their order, functions, and the resource if it has one.

    ``used`` are the names of types of other interfaces.
    """

    name: str
    types: Mapping[str, Type]
    functions: Sequence[WitFunction]
    used: Sequence[str]
    resource: str | None


def parse_wit(text: str) -> dict[str, WitInterface]:
    """The interfaces {short name: interface} of a package in WIT."""
    text = re.sub("//.*", "", text)
    found = re.search(r"package\s+([\w:-]+)@([\d.]+);", text)
    assert found is not None, "a package has a name with a version"
    tokens = iter(_TOKEN.findall(text[found.end() :]))
    interfaces = {}
    for word in tokens:
        assert word == "interface", word
        short = next(tokens)
        interfaces[short] = _interface(f"{found[1]}/{short}@{found[2]}", tokens)
    return interfaces


def _interface(name: str, tokens: Iterator[str]) -> WitInterface:
    types: dict[str, Type] = {}
    functions: list[WitFunction] = []
    used: list[str] = []
    resource = None
    for word in _within(tokens):
        if word == "use":
            _ = next(tokens), next(tokens)  # types.
            used += [label for label in _within(tokens) if label != ","]
            next(tokens)
        elif word == "type":
            label, _ = next(tokens), next(tokens)
            types[label], _ = _type(tokens)
        elif word == "enum":
            label = next(tokens)
            types[label] = ("enum", *(case for case in _within(tokens) if case != ","))
        elif word == "record":
            label = next(tokens)
            next(tokens)
            types[label] = ("record", *(part for field in _fields(tokens, "}").items() for part in field))
        elif word == "resource":
            resource = next(tokens)
            functions += [_function(label, tokens, resource) for label in _within(tokens)]
        else:
            functions.append(_function(word, tokens, None))
    return WitInterface(name, types, functions, used, resource)


def _within(tokens: Iterator[str]) -> Iterator[str]:
    """The tokens up to the brace that closes, without the one that opens."""
    word = next(tokens)
    word = next(tokens) if word == "{" else word
    while word != "}":
        yield word
        word = next(tokens)


def _fields(tokens: Iterator[str], end: str) -> dict[str, Type]:
    """{label: type} up to the token ``end``."""
    fields: dict[str, Type] = {}
    word = next(tokens)
    while word != end:
        next(tokens)  # :
        fields[word], after = _type(tokens)
        word = next(tokens) if after == "," else after
    return fields


def _function(label: str, tokens: Iterator[str], resource: str | None) -> WitFunction:
    """A function behind its ``label``; a method of a ``resource`` has an instance of it as its first parameter."""
    next(tokens)  # :
    static = next(tokens) == "static" and next(tokens) == "func"
    next(tokens)  # (
    parameters = _fields(tokens, ")")
    result = _type(tokens)[0] if next(tokens) == "->" else None
    if resource is None:
        return WitFunction(label, parameters, result)
    if static:
        return WitFunction(f"[static]{resource}.{label}", parameters, result)
    return WitFunction(f"[method]{resource}.{label}", {"self": ("borrow", resource), **parameters}, result)


def _type(tokens: Iterator[str]) -> tuple[Type, str]:
    """A type and the token behind it."""
    word, after = next(tokens), next(tokens)
    if after != "<":
        return word, after
    parts: list[Type] = []
    while after != ">":
        part, after = _type(tokens)
        parts.append(part)
    return (word, *parts), next(tokens)
