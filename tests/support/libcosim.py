"""Co-simulations in libcosim; importing this needs libcosimpy."""

from __future__ import annotations

from pathlib import Path

from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
from libcosimpy.CosimManipulator import CosimManipulator
from libcosimpy.CosimObserver import CosimObserver
from libcosimpy.CosimSlave import CosimLocalSlave

SECOND = 1_000_000_000  # libcosim counts in nanoseconds
STEP = 0.01


class Simulation:
    """A simulation with a fixed communication step of 0.01 s; variables by instance and name."""

    def __init__(self, **slaves: Path) -> None:
        log_output_level(CosimLogLevel.FATAL)
        self.execution = CosimExecution.from_step_size(step_size=round(STEP * SECOND))
        self.numbers, self.references = {}, {}
        for name, path in slaves.items():
            slave = CosimLocalSlave(fmu_path=str(path), instance_name=name)
            self.numbers[name] = self.execution.add_local_slave(local_slave=slave)
            variables = self.execution.slave_variables(self.numbers[name])
            self.references[name] = {v.name.decode(): v.reference for v in variables}
        self.observer = CosimObserver.create_last_value()
        self.execution.add_observer(observer=self.observer)
        self.manipulator = CosimManipulator.create_override()
        self.execution.add_manipulator(manipulator=self.manipulator)

    def set(self, slave: str, name: str, value: float) -> None:
        """Override a variable from the next step on."""
        done = self.manipulator.slave_real_values(self.numbers[slave], [self.references[slave][name]], [value])
        assert done

    def initially(self, slave: str, name: str, value: float) -> None:
        """A start value."""
        assert self.execution.real_initial_value(self.numbers[slave], self.references[slave][name], value)

    def connect(self, source: tuple[str, str], target: tuple[str, str]) -> None:
        """Connect an output with an input."""
        (from_, output), (to, input_) = source, target
        self.execution.connect_real_variables(
            output_slave_index=self.numbers[from_],
            output_variable_reference=self.references[from_][output],
            input_slave_index=self.numbers[to],
            input_variable_reference=self.references[to][input_],
        )

    def get(self, slave: str, names: list[str]) -> list[float]:
        """The last values."""
        references = [self.references[slave][name] for name in names]
        return list(self.observer.last_real_values(self.numbers[slave], references))

    def run(self, until: float) -> None:
        """Simulate until a time in s."""
        assert self.execution.simulate_until(target_time=round(until * SECOND))
