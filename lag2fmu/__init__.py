"""lag2fmu: from the Lagrangian of a mechanism to a validated FMU, FMI 2.0 or 3.0.

>>> import lag2fmu
>>> fmu = lag2fmu.export("double_pendulum")
>>> lag2fmu.validate(fmu).passed
True
"""

from typing import TYPE_CHECKING

from lag2fmu.lazy import offered
from lag2fmu.version import VERSION as __version__

if TYPE_CHECKING:
    from lag2fmu.analysis.entry_points import equilibria, modes
    from lag2fmu.description.events import Contact, Friction, State, Stop, Table
    from lag2fmu.dynamics import derive
    from lag2fmu.ensemble import Ensemble, Runs
    from lag2fmu.ensemble.function import function
    from lag2fmu.errors import Lag2FmuError
    from lag2fmu.fmu import Fmu, export
    from lag2fmu.fmu.paging import page
    from lag2fmu.formats.loading import load
    from lag2fmu.mechanism import Mechanism
    from lag2fmu.reference import Trajectory
    from lag2fmu.studies.calibrated import Calibration
    from lag2fmu.studies.calibration import calibrate
    from lag2fmu.studies.sensitivities import Sensitivities, sensitivities
    from lag2fmu.studies.sweeping import sweep
    from lag2fmu.systems.entry_points import ssp
    from lag2fmu.verify import Report, linearize, simulate, validate
    from lag2fmu.verify.plots.animation import animate

_HOME = {
    "Calibration": "lag2fmu.studies.calibrated",
    "Contact": "lag2fmu.description.events",
    "Ensemble": "lag2fmu.ensemble",
    "Fmu": "lag2fmu.fmu",
    "Friction": "lag2fmu.description.events",
    "Lag2FmuError": "lag2fmu.errors",
    "Mechanism": "lag2fmu.mechanism",
    "Report": "lag2fmu.verify",
    "Runs": "lag2fmu.ensemble",
    "Sensitivities": "lag2fmu.studies.sensitivities",
    "State": "lag2fmu.description.events",
    "Stop": "lag2fmu.description.events",
    "Table": "lag2fmu.description.events",
    "Trajectory": "lag2fmu.reference",
    "animate": "lag2fmu.verify.plots.animation",
    "calibrate": "lag2fmu.studies.calibration",
    "derive": "lag2fmu.dynamics",
    "equilibria": "lag2fmu.analysis.entry_points",
    "export": "lag2fmu.fmu",
    "function": "lag2fmu.ensemble.function",
    "linearize": "lag2fmu.verify",
    "load": "lag2fmu.formats.loading",
    "modes": "lag2fmu.analysis.entry_points",
    "page": "lag2fmu.fmu.paging",
    "sensitivities": "lag2fmu.studies.sensitivities",
    "simulate": "lag2fmu.verify",
    "sweep": "lag2fmu.studies.sweeping",
    "ssp": "lag2fmu.systems.entry_points",
    "validate": "lag2fmu.verify",
}

__all__ = [
    "Calibration",
    "Contact",
    "Ensemble",
    "Fmu",
    "Friction",
    "Lag2FmuError",
    "Mechanism",
    "Report",
    "Runs",
    "Sensitivities",
    "State",
    "Stop",
    "Table",
    "Trajectory",
    "__version__",
    "animate",
    "calibrate",
    "derive",
    "equilibria",
    "export",
    "function",
    "linearize",
    "load",
    "modes",
    "page",
    "sensitivities",
    "simulate",
    "ssp",
    "sweep",
    "validate",
]


__getattr__ = offered(__name__, _HOME)


def __dir__() -> list[str]:
    return list(__all__)
