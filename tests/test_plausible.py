"""Whether a case can be meant: derived figures, usual ranges, memory."""

import math
import subprocess
import sys
from pathlib import Path

import pytest
from conftest import ROOT
from typer.testing import CliRunner

from softbrake.case.case import key_at
from softbrake.case.case_file import load_case, open_case
from softbrake.case.plausible import DECELERATION, FILLED, RANGES, figures, foreseen, implausible, shown, warnings_of, wave_speed
from softbrake.case.schema import starter
from softbrake.cli.app import app
from softbrake.sim import cores, simulation
from softbrake.sim.simulation import Simulation, simulate

PAPER = ROOT / "configs" / "paper.yaml"
BAG = (
    "gas.pressure=15.7 kPa",
    "vents=[{area: 10 cm^2, discharge: 0.6}]",
    "inflator={times: [0 s, 10 ms], mass_flow: [1 kg/s, 0 kg/s], temperature: 600 K}",
)
ABSURD = ("shell.diameter=1500 m", "fabric.E=300e6 kN/m", "fabric.areal_density=400")


def invoke(command: str, *overrides: str, case: Path = PAPER, words: tuple[str, ...] = ()) -> tuple[int, str, str]:
    sets = [word for override in overrides for word in ("--set", override)]
    done = CliRunner().invoke(app, [command, str(case), *sets, *words])
    return done.exit_code, done.stdout, done.stderr


def test_figures_of_the_paper() -> None:
    case = load_case(PAPER)
    found = figures(case)
    assert found["pressure times radius over E"] == pytest.approx(15696 * 0.25 / 20e3)
    assert found["shell mass over cargo mass"] == pytest.approx(math.pi * 0.5 * 0.05 * (0.6 + 3 * 5 * 0.016667) / 100)
    assert found["damping ratio"] == pytest.approx(0.2 / (0.5 * math.sqrt(0.05 * 20e3 / (1 - 0.25**2))))
    assert found[DECELERATION] == pytest.approx(15696 * math.pi * 0.25**2 / 100 - 9.80665)
    assert wave_speed(case) == pytest.approx(math.sqrt(20e3 / (1 - 0.25**2) / 0.05))


@pytest.mark.parametrize("path", sorted(ROOT.glob("configs/*.yaml")), ids=lambda path: path.stem)
def test_nothing_is_unusual_about_shipped_cases(path: Path) -> None:
    assert warnings_of([load_case(path)]) == []


def test_nothing_is_unusual_about_the_starter(tmp_path: Path) -> None:
    (tmp_path / "case.yaml").write_text(starter())
    assert invoke("check", case=tmp_path / "case.yaml")[::2] == (0, "")


def test_every_range_is_of_a_key_or_a_figure_and_can_be_left() -> None:
    case, bag = load_case(PAPER), load_case(PAPER, BAG)
    names = {*figures(case), *figures(bag), "CPU time"}
    assert {name for name in RANGES if key_at(name) is None} == names
    tables = {"pressure.values": "pressure={law: table, times: [0, 1], values: [0, 1e7]}"}
    tables |= {"inflator.mass_flow": "inflator.mass_flow=[0, 100]"}
    others = {"fabric.nu12": ("fabric.E11=100",), "fabric.nu21": ("fabric.E22=100",)}
    others |= {"gas.gamma": ("gas.gas_constant=287",), "gas.gas_constant": ("gas.gamma=1.4",)}
    law = ("pressure.", "fabric.")
    for name, usual in RANGES.items():
        assert usual.low < usual.high and usual.reason
        if name in names:
            continue
        value = tables.get(name, f"{name}={2.0 * usual.high}")
        besides = others.get(name, ("fabric.nu12=0",))
        found = dict(implausible(load_case(PAPER, [*(() if name.startswith(law) else BAG), *besides, value])))
        assert name in found and usual.reason in found[name], name


def test_warnings_are_in_the_units_of_the_file() -> None:
    file = open_case(PAPER, ["fabric.E=300e6 kN/m", "cargo.mass=900 t"])
    told = warnings_of([file.case], file.unit_of)
    assert any(line.startswith("fabric.E11: 3e+08 kN/m is above 10000 kN/m; ") for line in told)
    assert any(line.startswith("cargo.mass: 900 t is above 50 t; ") for line in told)
    assert shown("gravity", 19.6133, lambda _: "g") == "2 g"


def test_check_says_the_case_in_its_units_and_what_follows() -> None:
    code, told, errors = invoke("check", "shell.diameter=50 cm", "pressure.value=0.2 bar")
    assert (code, errors) == (0, "")
    for line in (
        "  shell               diameter 50 cm, height 0.6 m\n",
        "  gas                 constant, value 0.2 bar\n",
        "  p R / E             0.25, stretch of the hoop at full pressure\n",
        "  wave speed          653.2 m/s along the generatrix\n",
        "  shell mass          0.000668 of the cargo's\n",
        "  full stop           at 20.27 kPa (section 2.2); the case has 0.987 of it\n",
        "  full pressure       3.004 g of deceleration, net of gravity\n",
    ):
        assert line in told
    assert "  run                 up to 15677 steps, about 0.78 s of CPU, 1.73 MB\n" in told
    table = "pressure={law: table, times: [0, 100 ms], values: [0, 15 kPa]}"
    assert "  gas                 table, 2 rows, at most 15 kPa\n" in invoke("check", table)[1]


def test_check_says_gas_in_the_units_of_the_file_and_what_follows() -> None:
    code, told, errors = invoke("check", *BAG, "gas.temperature=20 degC", "leakage=0.4 %", "ambient.pressure=1 bar")
    assert (code, errors) == (0, "")
    for line in (
        "  gas                 adiabatic, pressure 15.7 kPa, temperature 293.15 K\n",
        "                      gamma 1.4, gas_constant 287.053 J/kg/K\n",
        "                      115700 Pa absolute, 0.162 kg in the unloaded shell\n",  # p V/(R T)
        "                      speed of sound 343.2 m/s, choked below a ratio of 0.5283\n",
        "  ambient             pressure 1 bar, temperature 288.15 K\n",
        "  vents               area 10 cm^2, discharge 0.6\n",
        "  leakage             0.4 %\n",
        "  inflator            0.005 kg by 0.01 s, temperature 600 K\n",
        "  p R / E             0.196, stretch of the hoop at filling pressure\n",
        "  filling pressure    2.143 g of deceleration, net of gravity\n",
    ):
        assert line in told, line
    table = "vents.0.discharge={pressure_ratio: [0, 1], coefficient: [1, 0.5]}"
    events = ("vents.0.opens.height=40 cm", "vents.0.closes.pressure=2 psi", "vents.0.inflow=allowed")
    told = invoke("check", *BAG, table, *events)[1]
    assert "area 10 cm^2, discharge 0.5 to 1, opens at 40 cm, closes at 2 psi, lets ambient gas in\n" in told
    told = invoke("check", "gas={pressure: 1 kPa, process: polytropic, exponent: 1.2, name: helium}")[1]
    assert "polytropic, pressure 1 kPa, temperature 288.15 K\n" in told
    assert "gamma 1.66667, gas_constant 2077.26 J/kg/K, exponent 1.2\n" in told
    cloth = ("permeability={linear: 2e-5 m/s/Pa, quadratic: -1e-10}",)
    assert "  permeability        linear 2e-05 m/s/Pa, quadratic -1e-10 m/s/Pa^2\n" in invoke("check", *BAG, *cloth)[1]
    assert "  without effect      ambient\n" in invoke("check", "ambient.altitude=3 km")[1]


def test_figures_of_a_bag() -> None:
    """The law's, at the gauge pressure of filling; vents together over the cover."""
    two = "vents=[{area: 10 cm^2, discharge: 1}, {area: 20 cm^2, discharge: 1}]"
    law, bag = load_case(PAPER, ["pressure.value=15.7 kPa"]), load_case(PAPER, [*BAG, two])
    expected = figures(law)
    expected[FILLED] = expected.pop(DECELERATION)
    assert figures(bag) == pytest.approx(expected | {"vent area over cover": 0.003 / (math.pi * 0.25**2)})
    limp = load_case(PAPER, ["gas.pressure=-1 kPa"])
    assert figures(limp)[FILLED] == -limp.gravity
    there, back = (foreseen(load_case(PAPER, [*changes, "time.end=1 s"])) for changes in ((), BAG))
    assert there is not None and back is not None
    assert back.steps == pytest.approx(there.steps * 1.0 / 0.2, abs=5)  # to time.end, for a stroke of 0.6 m at 3 m/s


def test_absurd_values_are_named_by_every_command_that_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    lumped = ("model.fidelity=lumped", "time.end=1 ms", *ABSURD)
    names = [name for name, _ in implausible(load_case(PAPER, lumped))]
    assert {"shell.diameter", "fabric.E11", "fabric.E22", "fabric.areal_density", DECELERATION} <= set(names)
    for command, words in (
        ("check", ()),
        ("run", ("-q", "--no-results")),
        ("design", ("-q", "--find", "cargo.mass", "--range", "1:2")),
    ):
        told = [line for line in invoke(command, *lumped, words=words)[2].splitlines() if line.startswith("unusual: ")]
        assert [line.split(": ")[1] for line in told] == names, command
    told = invoke("sweep", *lumped, words=("-q", "--vary", "cargo.mass=1,2,3"))[2].splitlines()
    (diameter,) = (line for line in told if line.startswith("unusual: shell.diameter: 1500 m is above 30 m; "))
    assert diameter.endswith("(and 2 more runs)")


@pytest.mark.parametrize("command", ["check", "run", "sweep", "design", "inflate"])
def test_a_grid_beyond_the_memory_is_refused_before_it_is_allocated(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(cores, "memory", lambda: 4e9)
    words = ("--vary", "cargo.mass=1,2") if command == "sweep" else ()
    code, _, told = invoke(command, "grid={generatrix: 10000, hoop: 10000}", words=words)
    assert code == 2
    assert "10000 x 10000 cells" in told and "GB of memory, and there are 4 GB; a coarser grid is expected" in told
    assert list(tmp_path.iterdir()) == []


def test_from_python_it_is_a_memory_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(simulation, "memory", lambda: 4e9)
    with pytest.raises(MemoryError, match="10000 x 10000 cells need about 17 GB, and there are 4 GB"):
        simulate(load_case(PAPER, ["grid={generatrix: 10000, hoop: 10000}"]))


def test_memory_that_is_lacking_after_all_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    def lack(*_: object) -> None:
        raise MemoryError("Unable to allocate 4 GiB")

    monkeypatch.setattr(Simulation, "__init__", lack)
    code, _, told = invoke("run", words=("--no-results", "-q"))
    assert (code, told.splitlines()[-1]) == (1, "not enough memory: Unable to allocate 4 GiB")


def test_foreseen_steps_are_those_of_a_run_within_a_factor_of_two() -> None:
    for changes in (["model.fidelity=axisymmetric"], ["model.fidelity=axisymmetric", "grid.generatrix=80"]):
        case = load_case(PAPER, [*changes, "contact=ground"])
        run, answer = foreseen(case), simulate(case)
        assert run is not None
        assert 0.5 < answer.steps / run.steps < 2.0
    assert foreseen(load_case(PAPER, ["tolerance=1%"])) is None


@pytest.mark.parametrize(
    ("groups", "files", "expected"),
    [
        ("0::/a/b\n", {"a/b/memory.max": "max\n", "a/memory.max": "3000000\n"}, 3e6),
        ("4:cpu:/a\n3:memory:/b\n", {"memory/b/memory.limit_in_bytes": "2000000\n"}, 2e6),
        ("0::/a\n", {"a/memory.max": "max\n"}, None),
    ],
)
def test_memory_of_a_container_counts(
    groups: str, files: dict[str, str], expected: float | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cores, "GROUPS", tmp_path / "groups")
    monkeypatch.setattr(cores, "MOUNTED", tmp_path / "mounted")
    (tmp_path / "groups").write_text(groups)
    for name, text in files.items():
        file = tmp_path / "mounted" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    there = cores.memory.__wrapped__()
    assert there == expected if expected else there > 3e6


def test_check_loads_nothing_slow() -> None:
    code = f"""
import sys
from typer.testing import CliRunner
from softbrake.cli.app import app
assert CliRunner().invoke(app, ["check", {str(PAPER)!r}]).exit_code == 0
sys.exit(bool({{"numpy", "numba", "h5py"}} & set(sys.modules)))
"""
    assert subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=False).returncode == 0
