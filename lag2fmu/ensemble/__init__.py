"""Many runs at once: the equations of a mechanism compiled for batches, in lanes of vector registers and on all cores.

>>> from lag2fmu import Ensemble
>>> runs = Ensemble("double_pendulum").run(starts={"theta1": [0.1, 0.2, 0.3]}, stop_time=5.0)
>>> runs.final["theta1"].shape
(3,)
"""

from typing import TYPE_CHECKING

from lag2fmu.lazy import offered

if TYPE_CHECKING:
    from lag2fmu.ensemble.compiled import Ensemble as Ensemble
    from lag2fmu.ensemble.function import StateFunction as StateFunction
    from lag2fmu.ensemble.results import Runs as Runs

__getattr__, __all__ = offered(__name__, __file__)
