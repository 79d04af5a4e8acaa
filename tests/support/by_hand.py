"""FMUs that lag2fmu has not made: written by hand in C, to be spoiled, each with its own Euler steps."""

from __future__ import annotations

import zipfile
from pathlib import Path

from lag2fmu.fmu.backends.native import fmi_headers
from lag2fmu.fmu.compilers import compile_library
from lag2fmu.fmu.platforms import host_platform
from lag2fmu.fmu.versions import VERSIONS

SOURCES = Path(__file__).parents[1] / "checking"
SOURCE = (SOURCES / "faulty_fmu.c").read_text("utf-8")
TOKEN = "{a7b1c4de-0123-4567-89ab-cdef01234567}"
XML = f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="faulty" guid="{TOKEN}">
  <CoSimulation modelIdentifier="faulty" canGetAndSetFMUstate="true" canSerializeFMUstate="true"
    providesDirectionalDerivative="true"/>
  <UnitDefinitions><Unit name="m"><BaseUnit m="1"/></Unit></UnitDefinitions>
  <LogCategories><Category name="logStatusError"/></LogCategories>
  <DefaultExperiment startTime="0" stopTime="1" stepSize="0.125"/>
  <ModelVariables>
    <ScalarVariable name="x" valueReference="0" causality="output" initial="calculated"><Real unit="m"/>
    </ScalarVariable>
    <ScalarVariable name="u" valueReference="1" causality="input"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="k" valueReference="2" causality="parameter" variability="tunable"><Real start="2"/>
    </ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs><Unknown index="1"/></Outputs>
    <InitialUnknowns><Unknown index="1"/></InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>
"""
"""What belongs to SOURCE: x(t + h) = x + h (u + k) from 1."""


def by_hand(path: Path, source: str = SOURCE, description: str = XML, version: str = "2.0") -> Path:
    """The FMU ``path`` of the C text ``source``, whose identifier is "faulty", for this machine."""
    platform = host_platform()
    library = compile_library({"faulty.c": source}, fmi_headers(), "faulty", platform)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", description)
        archive.writestr("documentation/index.html", "<p>")
        for folder in VERSIONS[version].folders(platform):
            archive.writestr(f"binaries/{folder}/faulty{platform.suffix}", library)
    return path
