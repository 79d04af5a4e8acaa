"""``python -m lag2fmu`` is the command lag2fmu."""

from lag2fmu.cli import main

if __name__ == "__main__":
    main()
