"""What every mechanism has in common when it runs as a PythonFMU slave: solver, state machine, saved states.

The equations are in the module that slavemodule.txt names. Nothing here depends on them.
"""
