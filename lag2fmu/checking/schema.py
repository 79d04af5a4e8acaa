"""What fmpy finds: the schema, names, combinations of causality and variability, start values."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from lag2fmu.checking.findings import Finding
from lag2fmu.fmu.pack import DESCRIPTION
from lag2fmu.verify.simulate import problems

_RULES = (
    (r"^ERROR \(line", "schema", "follow the schema fmi2ModelDescription.xsd"),
    (r"The combination causality", "combination", "see the table in section 2.2.7 of the standard"),
    (r"has no start value", "start-missing", "give it a start value"),
    (r"must have variability != \"continuous\"", "variability", "only Reals are continuous; say 'discrete'"),
    (r"but provides a start value", "start-forbidden", "remove the start value"),
    (r"variable name .* is not unique", "name-duplicate", "give each variable a name of its own"),
    (r"not a legal variable name|contains an illegal", "name-grammar", "rename it, or use the convention 'flat'"),
)
"""What a sentence of fmpy contains, the rule it tells of, the remedy."""


def schema_findings(path: Path, *, found: bool) -> Iterator[Finding]:
    """What fmpy finds in the FMU ``path``.

    ``found`` says that our rules found errors in modelDescription.xml: then sentences of fmpy on what these rules
    cover too, and its stumbling over the same faults, are left out.
    """
    for problem in problems(path):
        line = re.search(r"\(line (\d+)", problem)
        place = f"{DESCRIPTION}:{line[1]}" if line else DESCRIPTION
        sentence = problem.strip().splitlines()[0].rstrip(".") if problem.strip() else "no reason given"
        for pattern, rule, remedy in _RULES:
            if re.search(pattern, problem):
                yield Finding(rule, place, sentence, remedy)
                break
        else:
            if not found:
                yield Finding("fmpy", place, f"fmpy says: {sentence}", "correct what it names")
