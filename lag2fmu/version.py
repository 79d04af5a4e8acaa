"""The version of lag2fmu, once."""

VERSION = "0.1.0"
