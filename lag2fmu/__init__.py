"""lag2fmu: from the Lagrangian of a mechanism to a validated FMU, FMI 2.0 or 3.0.

>>> import lag2fmu
>>> fmu = lag2fmu.export("double_pendulum")
>>> lag2fmu.validate(fmu).passed
True
"""

from typing import TYPE_CHECKING

from lag2fmu.lazy import offered
from lag2fmu.version import VERSION

if TYPE_CHECKING:
    from lag2fmu.analysis.at_rest import equilibria as equilibria
    from lag2fmu.analysis.at_rest import modes as modes
    from lag2fmu.dynamics import derive as derive
    from lag2fmu.ensemble import Ensemble as Ensemble
    from lag2fmu.ensemble.function import function as function
    from lag2fmu.errors import Lag2FmuError as Lag2FmuError
    from lag2fmu.fmu import export as export
    from lag2fmu.fmu.live.paging import page as page
    from lag2fmu.formats.loading import load as load
    from lag2fmu.mechanism import Mechanism as Mechanism
    from lag2fmu.studies.calibration import calibrate as calibrate
    from lag2fmu.studies.gradients import gradient as gradient
    from lag2fmu.studies.observer import observe as observe
    from lag2fmu.studies.sensitivities import sensitivities as sensitivities
    from lag2fmu.studies.sweeping import sweep as sweep
    from lag2fmu.systems.simulating import simulate as simulate
    from lag2fmu.systems.ssp import ssp as ssp
    from lag2fmu.verify.entry_points import linearize as linearize
    from lag2fmu.verify.entry_points import start as start
    from lag2fmu.verify.validate import validate as validate

_MOVED = {
    **dict.fromkeys(("Contact", "Friction", "State", "Stop", "Table"), "lag2fmu.mechanism"),
    "Fmu": "lag2fmu.fmu",
    "Calibration": "lag2fmu.studies.calibrated",
    "Report": "lag2fmu.verify",
    "Runs": "lag2fmu.ensemble",
    "Sensitivities": "lag2fmu.studies.sensitivities",
    "Trajectory": "lag2fmu.reference",
    "animate": "lag2fmu.verify.plots.animation",
}
"""Names that the package had before: parts of a mechanism, and records that verbs return."""

__version__ = VERSION

__getattr__, __all__ = offered(__name__, __file__, _MOVED)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
