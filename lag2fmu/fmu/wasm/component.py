"""Components for WebAssembly: a module of C code, wrapped so that it has the interfaces of the draft fmi-ls-wasm.

Sources: the Component Model, design/mvp/Binary.md (the format) and CanonicalABI.md (how calls get in and out).

In a component the module of the FMU stands between two small ones. The first one is its memory, which has to be there
before the importer's logger can be lowered, which the module imports. The last one turns instances into handles: the
type of a handle names the destructor in the module, so that the module cannot make handles by itself.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from lag2fmu.fmu.wasm.binary import EQUAL, RESOURCE, Definitions, InstanceType, name, signed, unsigned, vector
from lag2fmu.fmu.wasm.draft import EXPORTED, LOGGER, interfaces
from lag2fmu.fmu.wasm.modules import handle_module, imported_pages, memory_module
from lag2fmu.fmu.wasm.wit import Type, WitFunction, WitInterface

ABI = ("wasm_realloc", "wasm_post_return", "wasm_free_instance")
"""The functions in C that take memory for arguments, give it back after a call, and end an instance."""

_PRIMITIVE = "string char f64 f32 u64 s64 u32 s32 u16 s16 u8 s8 bool"
_CODES = {word: bytes([code]) for code, word in enumerate(_PRIMITIVE.split(), 0x73)}
_CODES |= {"borrow": b"\x68", "result": b"\x6a", "option": b"\x6b", "enum": b"\x6d", "tuple": b"\x6f"}
_CODES |= {"list": b"\x70", "record": b"\x72"}
_OWN, _UTF8 = b"\x69", b"\0"


class _Types:
    """Types by their indices: each is defined where it is first needed.

    ``named`` are {name: type}, ``known`` those that have an index, and ``resources`` {name: index} those of handles.
    """

    def __init__(
        self,
        define: Callable[[bytes], int],
        named: Mapping[str, Type],
        known: Mapping[str, int],
        resources: Mapping[str, int],
    ) -> None:
        self._define, self._named, self._resources = define, named, resources
        self.known: dict[Type, int] = dict(known.items())
        self._functions: dict[bytes, int] = {}

    def index(self, kind: Type) -> int:
        """The index of a type that is not primitive."""
        if kind not in self.known:
            self.known[kind] = self._define(self._definition(kind))
        return self.known[kind]

    def function(self, function: WitFunction) -> int:
        """The index of the type of a ``function``."""
        parameters = vector(name(label) + self._use(kind) for label, kind in function.parameters.items())
        body = b"\x40" + parameters + (b"\1\0" if function.result is None else b"\0" + self._use(function.result))
        if body not in self._functions:
            self._functions[body] = self._define(body)
        return self._functions[body]

    def _use(self, kind: Type) -> bytes:
        return _CODES[kind] if isinstance(kind, str) and kind in _CODES else signed(self.index(kind))

    def _definition(self, kind: Type) -> bytes:
        if isinstance(kind, str):
            if kind in self._resources:
                return _OWN + unsigned(self._resources[kind])
            return _CODES[kind] if kind in _CODES else self._definition(self._named[kind])
        return self._composed(str(kind[0]), kind[1:])

    def _composed(self, word: str, parts: tuple[Type, ...]) -> bytes:
        code = _CODES[word]
        if word == "borrow":
            return code + unsigned(self._resources[str(parts[0])])
        if word == "enum":
            return code + vector(name(str(label)) for label in parts)
        if word == "record":
            fields = zip(parts[::2], parts[1::2], strict=True)
            return code + vector(name(str(label)) + self._use(part) for label, part in fields)
        if word == "result":
            return code + b"".join(b"\1" + self._use(part) for part in parts)
        uses = [self._use(part) for part in parts]
        return code + (vector(uses) if word == "tuple" else uses[0])


def c_name(function: WitFunction) -> str:
    """The name in C of a ``function`` of the interfaces."""
    return "wasm_" + function.name.rpartition(".")[2].replace("-", "_")


def c_names() -> list[str]:
    """The functions in C that a module offers, sorted."""
    return sorted({*ABI, *(c_name(function) for short in EXPORTED for function in interfaces()[short].functions)})


def component(module: bytes) -> bytes:
    """The component of a ``module`` that offers ``c_names`` and imports a memory and the logger in C.

    Raises BuildError if it imports more.
    """
    made, logger = Definitions(), c_name(WitFunction(LOGGER, {}, None))
    pages = imported_pages(module, logger)
    shared = interfaces()["types"]
    common = made.bring("instance", shared.name, b"\5" + unsigned(made.type(_types_only(shared))))
    known = {label: made.alias("type", common, label) for label in shared.types}
    callbacks = made.bring("instance", interfaces()["callbacks"].name, b"\5" + unsigned(made.type(_logger_only())))
    memory = made.alias("core memory", made.core_instance(made.module(memory_module(pages))), "memory")
    options = [_UTF8, b"\3" + unsigned(memory)]
    lowered = b"\1\0" + unsigned(made.alias("func", callbacks, LOGGER)) + vector(options)
    needed = {"memory": ("core memory", memory), logger: ("core func", made.canonical("core func", lowered))}
    fmu = made.core_instance(made.module(module), env=made.core_bundle(needed))
    realloc, post_return, destructor = (made.alias("core func", fmu, function) for function in ABI)
    options += [b"\4" + unsigned(realloc), b"\5" + unsigned(post_return)]
    offered = [interfaces()[short] for short in EXPORTED]
    resources = {i.resource: made.type(b"\x3f\x7f\1" + unsigned(destructor)) for i in offered if i.resource}
    handles = _handles(made, offered, resources, memory, fmu)
    named = {label: kind for i in (shared, *offered) for label, kind in i.types.items()}
    types = _Types(made.type, named, known, resources)
    for interface in offered:
        imports: dict[str, tuple[str, int]] = {}
        for i, function in enumerate(interface.functions):
            core = made.alias("core func", handles if _makes(function, interface) else fmu, c_name(function))
            lifted = b"\0\0" + unsigned(core) + vector(options) + unsigned(types.function(function))
            imports[f"function-{i}"] = ("func", made.canonical("func", lifted))
        imports |= {f"type-{label}": ("type", types.index(label)) for label in _taken(interface)}
        if interface.resource:
            imports["resource"] = ("type", resources[interface.resource])
        instance = made.instance(made.component(_offering(interface, named)), imports)
        made.export("instance", interface.name, instance)
    return bytes(made.content)


def _types_only(interface: WitInterface) -> bytes:
    """The type of an instance that has the types of an ``interface``."""
    made = InstanceType()
    types = _Types(made.type, interface.types, {}, {})
    for label in interface.types:
        types.known[label] = made.export_type(label, types.index(label))
    return made.body


def _logger_only() -> bytes:
    """The type of an instance that has the importer's logger."""
    made = InstanceType()
    types = _Types(made.type, interfaces()["types"].types, {}, {})
    types.known["status"] = made.export_type("status", types.index("status"))
    logger = next(function for function in interfaces()["callbacks"].functions if function.name == LOGGER)
    made.export_function(LOGGER, types.function(logger))
    return made.body


def _makes(function: WitFunction, interface: WitInterface) -> bool:
    return interface.resource is not None and function.result == ("option", interface.resource)


def _handles(
    made: Definitions, offered: list[WitInterface], resources: Mapping[str, int], memory: int, fmu: int
) -> int:
    """The instance of the module that turns instances into handles."""
    makers = {c_name(f): (_flat(f), i.resource) for i in offered for f in i.functions if i.resource and _makes(f, i)}
    new = {maker: made.canonical("core func", b"\2" + unsigned(resources[kind])) for maker, (_, kind) in makers.items()}
    module = made.module(handle_module({maker: count for maker, (count, _) in makers.items()}))
    bundle = made.core_bundle({maker: ("core func", index) for maker, index in new.items()})
    memories = made.core_bundle({"memory": ("core memory", memory)})
    return made.core_instance(module, memory=memories, fmu=fmu, handles=bundle)


def _flat(function: WitFunction) -> int:
    """The number of core parameters of a ``function`` of strings, lists and numbers: two for the first ones."""
    return sum(2 if kind == "string" or not isinstance(kind, str) else 1 for kind in function.parameters.values())


def _taken(interface: WitInterface) -> list[str]:
    """The names of the types that the functions of an ``interface`` need, each behind those that it refers to."""
    return [*(interfaces()["types"].types if interface.used else ()), *interface.types]


def _offering(interface: WitInterface, named: Mapping[str, Type]) -> bytes:
    """A component that exports what it imports as an ``interface``.

    That gives names to the types of the functions, without which no function is exported.
    """
    made = Definitions()
    inner = {interface.resource: made.bring("type", "resource", RESOURCE)} if interface.resource else {}
    types = _Types(made.type, named, {}, inner)
    for label in _taken(interface):
        types.known[label] = made.bring("type", f"type-{label}", EQUAL + unsigned(types.index(label)))
    functions = [
        made.bring("func", f"function-{i}", b"\1" + unsigned(types.function(function)))
        for i, function in enumerate(interface.functions)
    ]
    shown = {label: made.export("type", label, types.known[label]) for label in (*interface.used, *interface.types)}
    outer = {label: made.export("type", label, index) for label, index in inner.items()}
    types = _Types(made.type, named, shown, outer)
    for function, index in zip(interface.functions, functions, strict=True):
        made.export("func", function.name, index, b"\1\1" + unsigned(types.function(function)))
    return bytes(made.content)
