"""Output in the code page of any terminal: the same exit code, with replacements for what the page has not."""

import io
import sys
from pathlib import Path

import pytest
import synthetic_drop

from softbrake.cli.app import COMMANDS, app

PAGES = ["cp1252", "cp1251", "cp932", "latin-1", "ascii", "cp437", "utf-8"]
TITLE = "Fall – 0.2 kg/m², ±1 %, Прыжок"
CASE = f"""
title: {TITLE}
shell: {{diameter: 0.5 m, height: 0.6 m}}
fabric: {{E: 20 kN/m, areal_density: 0.05 kg/m^2, viscosity: 0.2 N*s/m}}
cargo: {{mass: 100 kg, velocity: 6 m/s}}
pressure: {{law: constant, value: 15696 Pa}}
grid: {{generatrix: 12, hoop: 24}}
"""
LUMPED = ("--set", "model.fidelity=lumped")
QUICK: dict[str, tuple[str, ...]] = {
    "run": ("case.yaml", *LUMPED, "--no-results"),
    "check": ("case.yaml",),
    "schema": (),
    "init": ("-",),
    "info": ("drop.vtkhdf",),
    "inflate": ("case.yaml", "--no-results", "--residual", "0.1"),
    "sweep": ("case.yaml", *LUMPED, "--vary", "cargo.mass=90 kg,100 kg", "-o", "sweep–²"),
    "design": ("case.yaml", *LUMPED, "--target", "impact_velocity=3m/s"),
    "plot": ("drop.vtkhdf", "-o", "²–.png"),
    "report": ("drop.vtkhdf", "-o", "²–.html"),
}
TITLED = {"run": TITLE, "check": TITLE, "inflate": TITLE, "sweep": "sweep–²", "plot": "²–.png", "report": "²–.html"}  # in all
FAULTY = {"check": ("no – ².yaml",), "run": ("case.yaml", "--set", "fabric.²–=1"), "plot": ("²–.yaml",), "nothing ²–": ()}


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("case.yaml").write_text(CASE, encoding="utf-8")
    synthetic_drop.write(Path("drop.vtkhdf"), synthetic_drop.case())


def printed(page: str, *words: str) -> tuple[object, str]:
    """Exit code and all that a command prints on streams of a page, which refuse what it has not, as Python's do."""
    buffer = io.BytesIO()
    with pytest.MonkeyPatch.context() as patch:
        for name in ("stdout", "stderr"):
            patch.setattr(sys, name, io.TextIOWrapper(buffer, page, errors="strict"))
        with pytest.raises(SystemExit) as end:
            app(list(words))
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
            stream.detach()
        return end.value.code, buffer.getvalue().decode(page)


@pytest.mark.parametrize(
    "command", [pytest.param(name, marks=pytest.mark.slow if name in ("sweep", "plot", "report") else ()) for name in QUICK]
)
def test_no_answer_is_lost_to_a_code_page(command: str) -> None:
    for page in PAGES:
        code, text = printed(page, command, *QUICK[command])
        assert code == 0, text
        assert TITLED.get(command, "").encode(page, "replace").decode(page) in text


@pytest.mark.parametrize("page", PAGES)
def test_help_and_faults_in_a_code_page(page: str) -> None:
    for command in COMMANDS:
        assert printed(page, command.__name__, "--help")[0] == 0
    for name, words in FAULTY.items():
        code, text = printed(page, name, *words)
        assert code == 2
        assert "–".encode(page, "replace").decode(page) in text


@pytest.mark.slow
@pytest.mark.parametrize("page", ["cp932", "ascii"])
@pytest.mark.parametrize(
    "words",
    [
        ("run", "case.yaml", "--tolerance", "40%", "--no-results"),
        ("chart", "case.yaml", "--budget", "0"),
        ("stability", "case.yaml", "--set", "model.fidelity=full"),
    ],
    ids=lambda words: words[0],
)
def test_long_studies_in_a_code_page(page: str, words: tuple[str, ...]) -> None:
    code, text = printed(page, *words)
    assert code == 0, text


@pytest.mark.slow
@pytest.mark.parametrize("page", ["cp932", "ascii"])
def test_merge_and_warmup_in_a_code_page(page: str) -> None:
    assert printed("utf-8", "sweep", *QUICK["sweep"])[0] == 0
    assert printed(page, "merge", "sweep–²")[0] == 0
    assert printed(page, "warmup")[0] == 0


def test_json_is_plain_ascii() -> None:
    """Nothing of it is replaced."""
    assert printed("ascii", "run", "case.yaml", *LUMPED, "--no-results", "--json", "-q")[1].isascii()
    assert '"title": "Fall \\u2013' in printed("ascii", "run", "case.yaml", *LUMPED, "--no-results", "--json", "-q")[1]
