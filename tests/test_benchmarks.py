"""The comparison of rates with the baseline, by which CI tells a slower kernel from a slower machine."""

import json
from pathlib import Path

import pytest
from rich.console import Console

import benchmarks.__main__ as bench


@pytest.fixture
def baseline(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "baseline.json"
    rate = {"grid": "36 x 90", "case": "as it is", "at": "10 ms", "ratio_to_calibration": 10.0}
    path.write_text(json.dumps({"about": {"processor": "z80"}, "kernel_rate": [rate]}))
    monkeypatch.setattr(bench, "BASELINE", path)


@pytest.mark.parametrize(
    ("processor", "first", "again", "stands", "tries"),
    [
        ("z80", 14.0, [], True, 1),
        ("z80", 16.0, [14.0], True, 2),
        ("z80", 16.0, [17.0, 16.0], False, 3),
        ("8086", 19.0, [], True, 1),  # another processor proves less
        ("8086", 21.0, [21.0, 22.0], False, 3),
    ],
)
def test_a_rate_has_fallen_where_no_attempt_reaches_it(
    baseline: None, monkeypatch: pytest.MonkeyPatch, processor: str, first: float, again: list[float], stands: bool, tries: int
) -> None:
    left = list(again)
    monkeypatch.setattr(bench, "get_host_cpu_name", lambda: processor)
    monkeypatch.setattr(bench, "kernel_rate", lambda *_, **__: {"ratio_to_calibration": left.pop(0)})
    row = {"grid": "36 x 90", "case": "as it is", "at": "10 ms", "ratio_to_calibration": first}
    assert bench.compare(Console(quiet=True), [row], True, calibration=None) == stands  # type: ignore[arg-type]
    assert len(again) - len(left) == tries - 1
    assert not left


def test_a_rate_that_the_baseline_lacks_is_no_success(baseline: None) -> None:
    new = {"grid": "8 x 8", "case": "as it is", "at": "10 ms", "ratio_to_calibration": 1.0}
    with pytest.raises(KeyError, match="8 x 8"):
        bench.compare(Console(quiet=True), [new], True, calibration=None)  # type: ignore[arg-type]


def test_the_stored_baseline_has_the_rates_of_the_short_form() -> None:
    rates = {(row["grid"], row["case"], row["at"]) for row in json.loads(bench.BASELINE.read_text())["kernel_rate"]}
    assert {("36 x 90", "as it is", "10 ms"), ("36 x 90", "contact=solid", "90 ms")} <= rates
