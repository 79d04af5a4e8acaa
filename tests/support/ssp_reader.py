"""A reader of SSP archives that shares nothing with what writes them: the standard library's XML and zip alone."""

from __future__ import annotations

import xml.etree.ElementTree as ET
import zipfile
from dataclasses import dataclass
from pathlib import Path

_NS = {x: f"http://ssp-standard.org/SSP1/SystemStructure{x}" for x in ("Description", "Common", "ParameterValues")}


@dataclass(frozen=True)
class Read:
    """What stands in an archive.

    ``components`` {name: source}, ``connectors`` {(component, name): (kind, type, unit)}, ``connections`` as pairs with
    their ``factors``, ``units`` {name: attributes}, ``values`` {name: (value, unit)}, ``texts`` {file: its XML}.
    """

    components: dict[str, str]
    connectors: dict[tuple[str, str], tuple[str, str, str]]
    connections: list[tuple[tuple[str, str], tuple[str, str]]]
    factors: dict[tuple[tuple[str, str], tuple[str, str]], float]
    units: dict[str, dict[str, str]]
    values: dict[str, tuple[float, str]]
    stop_time: float
    texts: dict[str, bytes]


def read_ssp(path: Path) -> Read:
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
        texts = {name: archive.read(name) for name in names if name.endswith((".ssd", ".ssv"))}
    root = ET.fromstring(texts["SystemStructure.ssd"])
    system = root.find("Description:System", _NS)
    assert system is not None
    elements = system.findall("Description:Elements/Description:Component", _NS)
    assert {e.get("source") for e in elements} <= {*names}
    connectors = {}
    for e in elements:
        for c in e.findall("Description:Connectors/Description:Connector", _NS):
            kind = next(child for child in c if child.tag.startswith(f"{{{_NS['Common']}}}"))
            tag = kind.tag.rpartition("}")[2]
            connectors[e.get("name", ""), c.get("name", "")] = (c.get("kind", ""), tag, kind.get("unit", ""))
    values = {}
    for binding in system.findall("Description:ParameterBindings/Description:ParameterBinding", _NS):
        parameters = ET.fromstring(texts[binding.get("source", "")])
        for p in parameters.findall("ParameterValues:Parameters/ParameterValues:Parameter", _NS):
            values[p.get("name", "")] = (float(p[0].get("value", "")), p[0].get("unit", ""))
    factors = {}
    for c in system.findall("Description:Connections/Description:Connection", _NS):
        start = (c.get("startElement", ""), c.get("startConnector", ""))
        end = (c.get("endElement", ""), c.get("endConnector", ""))
        transformation = c.find("Common:LinearTransformation", _NS)
        factors[start, end] = 1.0 if transformation is None else float(transformation.get("factor", ""))
    experiment = root.find("Description:DefaultExperiment", _NS)
    assert experiment is not None
    return Read(
        {e.get("name", ""): e.get("source", "") for e in elements},
        connectors,
        [*factors],
        factors,
        {
            u.get("name", ""): dict(base.attrib)
            for u in root.findall("Description:Units/Common:Unit", _NS)
            for base in u.findall("Common:BaseUnit", _NS)
        },
        values,
        float(experiment.get("stopTime", "")),
        texts,
    )
