"""The common part of all mechanisms that run as PythonFMU slaves: solver, state machine, saved states.

The equations are in the module that slavemodule.txt names. Nothing here depends on them.
"""

# All modules are imported at once. FMUs in one process share the runtime, and the folder of the first FMU may be
# deleted before a later FMU needs a module that the first one did not use.
from . import functions as functions
from . import tables as tables
