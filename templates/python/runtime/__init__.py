"""What every mechanism has in common when it runs as a PythonFMU slave: solver, state machine, saved states.

The equations are in the module that slavemodule.txt names. Nothing here depends on them.
"""

# All of it is loaded at once: FMUs in one process share the runtime, and the folder it came from may be gone when a
# later FMU needs a part that the first one did not.
from . import functions as functions
from . import tables as tables
