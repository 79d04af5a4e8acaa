"""Every run ends: where its time is over, it says what was compared until when."""

from __future__ import annotations

import logging
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from lag2fmu.analysis.equilibria import equilibria
from lag2fmu.analysis.report import analysis_sections
from lag2fmu.cli import main
from lag2fmu.deadline import Budget, OutOfTimeError, check_time, paced, within
from lag2fmu.dynamics.lagrange import derive
from lag2fmu.errors import LoadError, SimulationError
from lag2fmu.formats.loading import load
from lag2fmu.formats.text import read
from lag2fmu.mechanism.record import Mechanism
from lag2fmu.verify.page_samples import page_samples
from lag2fmu.verify.reference_files import reference_files, reference_of
from lag2fmu.verify.report import Report
from lag2fmu.verify.validate import validate, validate_fmu
from tests.reference.hybrid_mechanisms import wedge

GEAR = """
[mechanism]
name = "gear"
title = "Gear with play and stiff teeth"

[parameters]
J1 = { value = 0.01, unit = "kg.m2", doc = "inertia of the motor" }
J2 = { value = 0.02, unit = "kg.m2", doc = "inertia of the load" }
k = { value = 1e6, unit = "N.m/rad", doc = "stiffness of the teeth" }
b = { value = 0.001, unit = "rad", doc = "play to either side" }
T = { value = 1.0, unit = "N.m", doc = "amplitude of the torque" }

[coordinates]
p = { unit = "rad", start = 0.0, velocity = 0.0, doc = "angle of the motor" }
q = { unit = "rad", start = 0.0, velocity = 0.0, doc = "angle of the load" }

[definitions]
d = "max(p - q - b, 0) + min(p - q + b, 0)"

[energy]
kinetic = "J1*p_dot**2/2 + J2*q_dot**2/2"
potential = "k*d**2/2"

[forces]
p = "T*sin(10*t)"

[experiment]
stop_time = 0.06
step = 0.002
"""


def share_left_out(report: Report) -> float:
    """The greatest share that a row of ``report`` says is not compared."""
    return max((check.value for check in report.checks if check.extent), default=0.0)


def spend() -> None:
    """Work without an end of its own."""
    while True:
        check_time()


def test_a_budget_counts_its_own_work_only() -> None:
    budget = Budget(1e-3)
    with pytest.raises(OutOfTimeError), budget.spent():
        spend()
    assert budget.left < 0
    check_time()  # outside there is no bound


def test_an_inner_bound_is_no_longer_than_the_outer_one() -> None:
    with within(0.0), within(100.0), pytest.raises(OutOfTimeError):
        spend()


@pytest.mark.slow
def test_stiff_play_is_compared_at_the_tolerance_that_it_asks_for() -> None:
    """An impact of stiff teeth lets errors grow by 200 within one step."""
    report = validate(read(GEAR, "gear.toml"))
    assert report.outcome == "ok", str(report)
    assert share_left_out(report) < 0.1
    (sharper,) = [check for check in report.checks if "at tolerance" in check.name]
    assert sharper.value < 0.1 * sharper.bar


@pytest.mark.slow
def test_a_sharper_tolerance_finds_a_fault_in_stiff_play(exported) -> None:
    path = exported(read(GEAR, "gear.toml")).path
    report = validate_fmu(read(GEAR.replace("{ value = 1.0,", "{ value = 1.01,"), "gear.toml"), path)
    (sharper,) = [check for check in report.checks if "at tolerance" in check.name]
    assert sharper.outcome == "FAILED"


@pytest.mark.slow
def test_a_billiard_is_compared_farther_at_a_sharper_tolerance() -> None:
    """Errors grow by 3e4 in 8 s: at a tolerance of 1e-6 a right run may be anywhere after 4.4 s."""
    report = validate(wedge(), stop_time=8.0)
    assert report.outcome == "ok", str(report)
    assert share_left_out(report) < 0.05
    (sharper,) = [check for check in report.checks if "at tolerance" in check.name]
    assert 1e-9 <= sharper.bar / 100 < 5e-9


@pytest.mark.slow
def test_a_validation_whose_time_is_over_says_until_when_it_compared(exported) -> None:
    mechanism = load("double_pendulum")
    report = validate_fmu(mechanism, exported("double_pendulum").path, stop_time=60.0, limit=0.5)
    assert report.outcome == "not judged"
    (row,) = [check for check in report.checks if check.extent]
    assert 0.2 < row.value < 1.0, row.detail
    assert "in its 0.5 s of CPU time; give a longer --limit or a shorter --stop-time" in row.detail
    assert any("reached t = " in note and "compared until" in note for note in report.notes)


@pytest.mark.slow
@pytest.mark.parametrize("model", ["pendulum", "bouncing_ball"])
def test_a_validation_without_any_time_still_runs_the_fmu(exported, model: str) -> None:
    report = validate_fmu(load(model), exported(model).path, limit=1e-9)
    assert report.outcome == "not judged"
    assert share_left_out(report) == 1.0
    (run,) = report.trajectories.values()
    assert run.time[-1] == pytest.approx(load(model).experiment.stop_time)
    assert any(check.evidence == "laws" for check in report.checks) == (model == "bouncing_ball")
    assert any("does not get to" in check.detail for check in report.checks)
    report.plot()


@pytest.mark.parametrize(("limit", "fits"), [(0.2, False), (20.0, True)])
def test_work_that_is_too_long_ends_after_a_tenth_of_its_time(limit: float, fits: bool) -> None:
    done, begin = 0, time.thread_time()
    with within(limit):
        try:
            for _ in paced(range(1000)):
                until = time.thread_time() + 1e-3
                while time.thread_time() < until:
                    pass
                done += 1
        except OutOfTimeError:
            assert not fits
            assert 0.1 * limit <= time.thread_time() - begin < 0.5 * limit
        else:
            assert fits
            assert done == 1000
    assert list(paced("without any bound")) == list("without any bound")


@pytest.mark.parametrize("limit", [0.0, -1.0, float("nan")])
def test_a_limit_is_positive(exported, limit: float) -> None:
    with pytest.raises(LoadError, match=r"the limit .* s is no time"):
        validate_fmu(load("pendulum"), exported("pendulum").path, limit=limit)


def test_the_command_line_says_that_nothing_is_judged(exported, tmp_path: Path) -> None:
    path = tmp_path / "p.fmu"
    path.write_bytes(exported("pendulum").path.read_bytes())
    done = CliRunner().invoke(main, ["validate", str(path), "--limit", "1e-9"])
    assert done.exit_code == 3, done.output
    assert "not judged" in done.output


def long(model: str) -> Mechanism:
    """``model`` with an experiment that takes more than a moment to integrate."""

    mechanism = load(model)
    return replace(mechanism, experiment=replace(mechanism.experiment, stop_time=400.0))


@pytest.mark.slow
def test_a_page_says_until_when_it_was_integrated() -> None:
    mechanism = long("double_pendulum")
    reference = reference_of(mechanism, limit=0.3)
    samples = page_samples(mechanism, reference)
    assert samples.until == reference.trajectory.time[-1] < 400.0
    assert (samples.data() or {})["until"] == samples.until
    assert page_samples(load("pendulum"), reference_of(load("pendulum"))).until is None
    remarks = reference_files(mechanism, reference)["documentation/fmi-ls-ref.txt"].decode()
    assert "where the time for the integration was over" in remarks


def test_a_reference_that_does_not_leave_its_start_says_so() -> None:
    with pytest.raises(SimulationError, match=r"did not leave its start in 1e-09 s of CPU time; give a longer --limit"):
        reference_of(load("bouncing_ball"), limit=1e-9)


def test_a_search_for_equilibria_ends(caplog: pytest.LogCaptureFixture) -> None:
    equations = derive(load("double_pendulum"))
    with caplog.at_level(logging.WARNING, logger="lag2fmu"):
        found = equilibria(equations, limit=1e-9)
    assert found == ()
    assert "took all its time" in caplog.text
    assert len(equilibria(equations)) == 4
    assert np.isfinite(equilibria(equations)[0].q).all()


def test_sections_of_an_analysis_say_that_their_time_was_over() -> None:
    sections = analysis_sections(derive(load("double_pendulum")), limit=1e-9)
    assert sections
    assert all("The time was over" in str(section.lines[0]) for section in sections)


def test_where_the_direct_integration_fails_the_laws_judge_alone(exported, monkeypatch) -> None:
    """Where there are none, the failure is that of the validation."""

    def fail(*_: object, **__: object) -> None:
        raise SimulationError("at time 0.3 s: no modes")

    monkeypatch.setattr("lag2fmu.verify.references.integrate", fail)
    report = validate_fmu(load("coulomb_oscillator"), exported("coulomb_oscillator").path, stop_time=1.0)
    (unjudged,) = (check for check in report.checks if check.outcome != "ok")
    fails = "the direct integration fails (at time 0.3 s: no modes): the laws along the run judge alone"
    assert unjudged.detail == fails
    assert report.outcome == "not judged"
    assert any(check.evidence == "laws" for check in report.checks)
    with pytest.raises(SimulationError, match="no modes"):
        validate_fmu(load("pendulum"), exported("pendulum").path, stop_time=1.0)


def test_model_exchange_without_end_is_not_judged(exported, monkeypatch) -> None:
    """As of a ball that jumped on by 1e-9 m/s; the time is over at its third step here."""
    turns = iter([False, False])

    def check_time() -> None:
        if next(turns, True):
            raise OutOfTimeError

    monkeypatch.setattr("lag2fmu.verify.by_fmpy.check_time", check_time)
    report = validate_fmu(load("pendulum"), exported("pendulum").path, stop_time=1.0)
    (unjudged,) = (check for check in report.checks if check.outcome != "ok")
    assert unjudged.name == "model exchange, CVode of fmpy, share not compared"
    assert unjudged.detail == "the run does not end in 60 s of CPU time; give a longer --limit"
    assert report.outcome == "not judged"
