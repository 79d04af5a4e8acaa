"""The findings of fmpy: on the schema, on names and, in FMI 2.0, on causality, variability and start values."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from lag2fmu.checking.findings import Finding
from lag2fmu.checking.rulebook import Rulebook
from lag2fmu.fmu.pack import DESCRIPTION
from lag2fmu.verify.instances import problems


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
