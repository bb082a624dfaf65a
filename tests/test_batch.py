"""Many drops at once: the answers of single runs, in order, whatever else fails or is broken off."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import count, islice
from pathlib import Path

import numpy as np
import pytest

import softbrake
from softbrake.case.case import Case
from softbrake.case.case_file import load_case
from softbrake.core.columns import History
from softbrake.sim.result_file import read_history
from softbrake.sim.summary import Summary
from softbrake.studies import batch
from softbrake.studies.batch import Dropped, run_batch, run_one
from softbrake.studies.error_control import Refined

COARSE = ("model.fidelity=axisymmetric", "grid.generatrix=12", "contact=full")
SMALL = ("grid.generatrix=8", "grid.hoop=12")
BURSTING = ("fabric.E11=1kN/m", "fabric.E22=1kN/m")  # as in test_simulation.py


def timeless(summary: Summary | None) -> Summary | None:
    """A summary without what differs from run to run of the same drop."""
    return None if summary is None else replace(summary, kernel_seconds=0.0, wall_seconds=0.0)


def mixed(paper: Path) -> list[Case]:
    """Drops of several lengths, fidelities and ends."""
    cases = [load_case(paper, [*COARSE, f"pressure.value={value} kPa"]) for value in (0, 5, 15, 16, 30)]
    cases += [load_case(paper, [*SMALL, f"cargo.mass={mass} kg"]) for mass in (80, 100)]
    cases.append(load_case(paper, [*SMALL, "model.fidelity=axisymmetric"]))
    return cases


def test_a_batch_answers_as_single_runs_do_to_the_last_bit(paper: Path) -> None:
    cases = mixed(paper)
    together = [timeless(answer.summary) for answer in run_batch(cases, threads=3)]
    alone = [timeless(softbrake.run(case)) for case in cases]
    assert together == alone
    assert len({summary.outcome for summary in alone if summary}) > 1
    assert len({summary.impact_velocity for summary in alone if summary}) > 4


def test_a_fault_costs_only_itself(paper: Path) -> None:
    sound = load_case(paper, COARSE)
    bursting = load_case(paper, [*COARSE, *BURSTING])
    first, fault, third = run_batch([sound, bursting, sound])
    assert first.summary is not None and first.fault is None
    assert timeless(first.summary) == timeless(third.summary)
    assert fault.fault is not None and "the fabric bursts" in fault.fault
    assert fault.summary is not None and fault.summary.outcome == "diverged"
    with pytest.raises(softbrake.Diverged) as alone:
        softbrake.run(bursting)
    assert fault.fault == str(alone.value)


def test_a_shell_that_is_not_inflated_costs_only_itself(paper: Path) -> None:
    sound = load_case(paper, COARSE)
    first, fault, third = run_batch([sound, load_case(paper, [*COARSE, *BURSTING, "initial=inflated"]), sound])
    assert first.summary is not None and timeless(first.summary) == timeless(third.summary)
    assert fault.summary is None and fault.fault is not None and fault.fault.startswith("not inflated: ")


def test_a_case_with_a_tolerance_is_climbed(paper: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    summary = softbrake.run(load_case(paper, COARSE))
    monkeypatch.setattr(batch, "refine", lambda case, tolerance: Refined(case, replace(summary, impact_velocity_error=tolerance)))
    asked = load_case(paper, [*COARSE, "tolerance=3%"])
    (answer,) = run_batch([asked])
    assert answer.summary is not None and answer.fault is None
    assert answer.summary.impact_velocity_error == 0.03
    (refused,) = run_batch([asked], histories=True)
    assert refused.summary is None and "has no history" in str(refused.fault)


def test_a_tolerance_that_is_not_reached_is_a_fault(paper: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    summary = softbrake.run(load_case(paper, COARSE))
    far = replace(summary, impact_velocity_error=0.5, fidelity_reason="the budget")
    monkeypatch.setattr(batch, "refine", lambda case, tolerance: Refined(case, far))
    (answer,) = run_batch([load_case(paper, [*COARSE, "tolerance=3%"])])
    assert answer.summary is far
    assert answer.fault == "the tolerance of 0.03 was not reached: the budget"


def test_histories_are_those_of_the_result_file(paper: Path, tmp_path: Path) -> None:
    case = load_case(paper, [*COARSE, "output.history_interval=7"])
    (answer,) = run_batch([case], histories=True)
    softbrake.run(case, tmp_path / "drop.vtkhdf")
    assert answer.history is not None
    kept = read_history(tmp_path / "drop.vtkhdf")
    columns = [History[name.upper()] for name in kept.dtype.names or ()]
    assert np.array_equal(answer.history[:, columns], kept.view(np.float64).reshape(len(kept), -1))
    assert timeless(answer.summary) == timeless(run_one(case).summary)


def test_cases_are_taken_as_they_are_needed_and_dropped_when_nobody_waits(paper: Path) -> None:
    taken = count()

    def without_end() -> Iterator[Case]:
        while True:
            next(taken)
            yield load_case(paper, COARSE)

    answering = run_batch(without_end(), threads=2)
    answers: list[Dropped] = list(islice(answering, 3))
    answering.close()  # type: ignore[attr-defined]
    assert all(answer.fault is None for answer in answers)
    assert next(taken) < 30
