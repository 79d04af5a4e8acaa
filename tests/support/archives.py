"""What several tests of FMU archives share: their XML, the functions of FMI, and a mechanism of awkward names."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET
import zipfile
from pathlib import Path

import fmpy
from sympy import Symbol, cos, sin

from lag2fmu.fmu import Fmu
from lag2fmu.mechanism import Body, Damper, Energy, Mechanism, Output, Spring, coordinate, parameter, signal


def xml(fmu: Fmu) -> ET.Element:
    with zipfile.ZipFile(fmu.path) as archive:
        return ET.fromstring(archive.read("modelDescription.xml"))


def functions_of_fmi() -> set[str]:
    """The functions of FMI 2.0, from the header that fmpy ships."""
    header = (Path(fmpy.__file__).parent / "c-code" / "fmi2Functions.h").read_text()
    return set(re.findall(r"^#define (fmi2\w+)\s+fmi2FullName\(", header, re.M))


def awkward_names() -> Mechanism:
    """A mechanism whose names are keywords of C and Python and names of the C library and of the runtime."""
    int_, double = coordinate("int", "m", start=0.3), coordinate("M_PI", "rad", start=0.2)
    lambda_, return_ = parameter("lambda", 2.0, "kg"), parameter("double", 30.0, "N/m")
    malloc, x = parameter("malloc", lambda_ * return_ / 40), signal("x", "N")
    long_name = "n" * 120
    length = parameter(long_name, 1.5, "m")
    return Mechanism(
        "static",
        title='Title with "quotes", <tags> & ampersands, \u00e4\u00f6\u00fc, \u03b8\u0308, \u732b, \U0001f600',
        source="back\\slash ??/ */ /* {{ jinja }} {% raw %} %s %n",
        coordinates=[int_, double],
        parameters=[lambda_, return_, malloc, length],
        inputs=[x],
        bodies=[Body("for", lambda_, (int_ + length * sin(double), -length * cos(double)))],
        gravity=9.81,
        springs=[Spring("while", return_, elongation=int_)],
        dampers=[Damper("if", malloc / 10, rate=int_.dot)],
        forces={int_: x},
        energy=Energy(kinetic=int_.dot**2 / 2),
        outputs=[Output("instance", int_ * Symbol("lambda"), doc="\u00b5 & <b> */")],
    )


def library(fmu: Fmu) -> bytes:
    """The first library in the archive."""
    with zipfile.ZipFile(fmu.path) as archive:
        name, *_ = (name for name in archive.namelist() if name.startswith("binaries/"))
        return archive.read(name)
