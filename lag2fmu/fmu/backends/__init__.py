"""The backends: what turns a program into the contents of an FMU, each in a module of its own."""
