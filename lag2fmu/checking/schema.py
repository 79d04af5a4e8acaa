"""The findings of fmpy: on the schema, on names and, in FMI 2.0, on causality, variability and start values."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from lag2fmu.archives import DESCRIPTION
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.rulebook import Rulebook


def schema_findings(path: Path, rules: Rulebook, *, found: bool) -> Iterator[Finding]:
    """What fmpy finds in the FMU ``path``.

    ``found`` says that our rules found errors in modelDescription.xml: then sentences of fmpy on what these rules
    cover too, and its stumbling over the same faults, are left out.
    """
    for problem in problems(path):
        line = re.search(r"\(line (\d+)", problem)
        place = f"{DESCRIPTION}:{line[1]}" if line else DESCRIPTION
        sentence = problem.strip().splitlines()[0].rstrip(".") if problem.strip() else "no reason given"
        for pattern, rule, remedy in rules.sentences:
            if re.search(pattern, problem):
                yield Finding(rule, place, sentence, remedy)
                break
        else:
            if not found:
                yield Finding("fmpy", place, f"fmpy says: {sentence}", "correct what it names", rules.other_sentences)


def problems(path: Path) -> list[str]:
    """The problems that fmpy's own validation finds in the FMU ``path``, a sentence for each."""
    from fmpy.validation import validate_fmu

    return [str(problem) for problem in validate_fmu(str(path))]


def broken_schema(content: bytes, schema: str) -> list[tuple[int, str]]:
    """(line, sentence) for what the XML ``content``, which is well formed, breaks of a ``schema`` of FMI 3.0.

    ``schema`` is the name of the file of fmpy's, without ending.
    """
    from importlib.resources import files

    from lxml import etree

    parser = etree.XMLParser(resolve_entities=False, no_network=True)
    found = etree.XMLSchema(etree.parse(str(files("fmpy") / "schema" / "fmi3" / f"{schema}.xsd")))
    try:
        found.validate(etree.fromstring(content, parser))
    except etree.XMLSyntaxError as error:  # of names, which our own parser does not look into
        return [(error.lineno or 1, error.msg or "no well-formed XML")]
    return [(error.line, error.message) for error in found.error_log]
