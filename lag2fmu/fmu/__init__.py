"""FMUs: variables and model description, compilers, packing."""

from typing import TYPE_CHECKING

from lag2fmu.lazy import offered

if TYPE_CHECKING:
    from lag2fmu.fmu.advice import suited_solver
    from lag2fmu.fmu.carried import MECHANISM_ENTRY, read_mechanism
    from lag2fmu.fmu.exporting import export
    from lag2fmu.fmu.model_description import ModelDescription
    from lag2fmu.fmu.record import Fmu

__all__ = ["MECHANISM_ENTRY", "Fmu", "ModelDescription", "export", "read_mechanism", "suited_solver"]

_HOMES = dict.fromkeys(("Fmu", "export"), "lag2fmu.fmu.exporting")
_HOMES |= dict.fromkeys(("MECHANISM_ENTRY", "read_mechanism"), "lag2fmu.fmu.carried")
__getattr__ = offered(
    __name__,
    {
        **_HOMES,
        "ModelDescription": "lag2fmu.fmu.model_description",
        "suited_solver": "lag2fmu.fmu.advice",
    },
)
