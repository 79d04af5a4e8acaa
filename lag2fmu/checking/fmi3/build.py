"""Rules on sources/buildDescription.xml (FMI 3.0.2, section 2.4.10)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from posixpath import normpath

from lag2fmu.checking.archive import Archive
from lag2fmu.checking.findings import Finding
from lag2fmu.checking.fmi3.description import Description3
from lag2fmu.errors import LoadError
from lag2fmu.xml_tree import XmlElement, parse

_NAME = "sources/buildDescription.xml"
_UNITS = (".c", ".cpp", ".cc")


def build_findings(archive: Archive, description: Description3) -> Iterator[Finding]:
    """The broken rules on the description of how to build the sources.

    Source: FMI 3.0.2 specification, section 2.4.10 (build configurations).
    """
    sources = archive.below("sources")
    if _NAME not in archive.files:
        if any(name.endswith(_UNITS) for name in sources):
            problem = "nothing lists the sources, so that nobody knows what to compile"
            yield Finding("sources-unlisted", "sources/", problem, f"add {_NAME}")
        return
    try:
        root = parse(archive.read(_NAME), _NAME).root
    except LoadError:  # said by the rule on XML in general
        return
    yield from _head(root, description)
    for configuration in root.all("BuildConfiguration"):
        yield from _configuration(configuration, archive, description)


def _at(element: XmlElement) -> str:
    return f"{_NAME}:{element.line} <{element.tag}>"


def _head(root: XmlElement, description: Description3) -> Iterator[Finding]:
    if root.tag != "fmiBuildDescription":
        yield Finding("build-root", _at(root), f"begins with <{root.tag}>", "begin with <fmiBuildDescription>")
        return
    own = description.root.get("fmiVersion")
    if root.get("fmiVersion") != own:
        problem = f"fmiVersion='{root.get('fmiVersion')}', but modelDescription.xml says '{own}'"
        yield Finding("build-version", _at(root), problem, "write the same in both")
    configurations = list(root.all("BuildConfiguration"))
    if not configurations:
        yield Finding("build-empty", _at(root), "there is no BuildConfiguration", "add one for each modelIdentifier")
    fallbacks = Counter(c.get("modelIdentifier") for c in configurations if not c.get("platform"))
    for identifier in (name for name, count in fallbacks.items() if count > 1):
        problem = f"{fallbacks[identifier]} configurations of '{identifier}' without a platform"
        yield Finding("build-platform", _at(root), problem, "keep one as the fallback")
    built = {c.get("modelIdentifier") for c in configurations}
    for identifier in sorted(set(description.identifiers.values()) - built) if configurations else ():
        problem = f"no BuildConfiguration has modelIdentifier='{identifier}'"
        yield Finding("build-identifier", _at(root), problem, "add one", "warning")


def _configuration(element: XmlElement, archive: Archive, description: Description3) -> Iterator[Finding]:
    identifier = element.get("modelIdentifier")
    if identifier not in description.identifiers.values():
        problem = f"modelIdentifier='{identifier}' is that of no kind in modelDescription.xml"
        yield Finding("build-identifier", _at(element), problem, "name one of them")
    sets = list(element.all("SourceFileSet"))
    if not any(list(s.all("SourceFile")) for s in sets):
        yield Finding("build-empty", _at(element), "there is no SourceFile", "list what is to be compiled")
    for each in sets:
        yield from _source_files(each, archive)
        yield from _definitions(each)


def _source_files(element: XmlElement, archive: Archive) -> Iterator[Finding]:
    seen: set[str] = set()
    for file in element.all("SourceFile"):
        name = file.get("name")
        if normpath(f"sources/{name}") not in archive.files:
            problem = f"the source file '{name}' is not there"
            yield Finding("source-missing", _at(file), problem, "put it in or take it off the list")
        if name in seen:
            yield Finding("source-duplicate", _at(file), f"the source file '{name}' is listed twice", "list it once")
        seen.add(name)
    for folder in element.all("IncludeDirectory"):
        if not archive.below(normpath(f"sources/{folder.get('name')}")):
            problem = f"the include directory '{folder.get('name')}' is not there"
            yield Finding("include-missing", _at(folder), problem, "put it in or take it off the list")


def _definitions(element: XmlElement) -> Iterator[Finding]:
    for definition in element.all("PreprocessorDefinition"):
        options = [option.get("value") for option in definition.all("Option")]
        value = definition.attributes.get("value")
        if options and value is not None and value not in options:
            problem = f"the value '{value}' of '{definition.get('name')}' is none of its options"
            yield Finding("build-option", _at(definition), problem, "list it among the options")
