"""The live page: a mechanism that is drawn and moves in a browser, computed by the C sources of its FMU."""
