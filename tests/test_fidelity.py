"""The whole shell and the axisymmetric shell are one computation for as long as the shell keeps its symmetry."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from exact import piston
from test_belt_contact import groove

import softbrake
from softbrake.case.case_file import CaseError, load_case
from softbrake.core.arrays import PAD, Floats, Outcome, Peak, State, Step
from softbrake.core.columns import WORKS, History
from softbrake.core.contact.constants import GAP
from softbrake.core.loop.meridian import advance_meridian, press_meridian, rub_meridian, stable_step_of_meridian
from softbrake.core.loop.step import advance
from softbrake.sim.build import grid_view, meridian_view
from softbrake.sim.result_file import read_history, read_snapshots
from softbrake.sim.simulation import Simulation

pytestmark = pytest.mark.kernels

CONFIGS = Path(__file__).resolve().parents[1] / "configs"
SIZE = 0.6  # m, of the shell
PARTS = {"axisymmetric": ("model.fidelity=axisymmetric",)}  # of the whole shell
COARSE = ("grid.generatrix=12", "grid.hoop=36")
# Configuration, overrides and a time (s) up to which round-off has not grown past 1e-10 of the shell: slack hoops let it grow.
SCENES = {
    "belts, viscosity, damping": ("paper", ("pressure.damping=0.002",), 0.06),
    "belts between rows, tension field": ("belts-list", (), 0.03),
    "belts between rows, nominal tension": ("belts-list", ("fabric.law=nominal_tension",), 0.03),
    "no belts": ("no-belts", ("fabric.E22=15 kN/m", "fabric.nu12=0.3"), 0.04),
    "lobes at the belts, friction": ("paper", ("contact=paper", "friction=0.3"), 0.03),
    "sine pressure": ("sine", ("pressure.damping=0.02",), 0.04),
    "tension field": ("paper", ("fabric.law=tension_field", "fabric.G12=1 kN/m", "pressure.damping=0.01"), 0.04),
    "compression": ("no-belts", ("fabric.slack=compression", "pressure.damping=0.01"), 0.01),
}
SOLID = "contact=[ground, cover, cargo]"
EXACT = 1e-10


def drop(config: str, *overrides: str) -> Simulation:
    return Simulation(load_case(CONFIGS / f"{config}.yaml", overrides))


def advance_to(falling: Simulation, until: float) -> Floats:
    """Advance to a time (s); return the history."""
    rows, outcome = [], Outcome.RUNNING
    while outcome == Outcome.RUNNING and falling.now(History.TIME) < until:
        new, outcome = falling.advance(until)
        rows.append(new.copy())
    return np.concatenate(rows)


def follow(falling: Simulation, history: Floats) -> Floats:
    """Advance by the steps of another shell's history; return the own. The axisymmetric one would take longer ones of its own."""
    if falling.case.model.fidelity != "axisymmetric":
        last = history[-1, History.TIME_STEP]
        return advance_to(falling, history[-1, History.TIME] + 0.5 * last if last > 0.0 else np.inf)
    rows = []
    for length in history[history[:, History.TIME_STEP] > 0.0, History.TIME_STEP]:
        chosen, limit = falling.state.stable_step
        if falling.state.steps[0] >= falling.state.choice[0]:
            safe = stable_step_of_meridian(falling.model, falling.state.nodes, falling.workspace)
            safe *= min(safe / limit, 1.0) if limit > 0.0 else 1.0
            chosen = safe if limit == 0.0 or safe < chosen or safe > 1.2 * chosen else chosen
        falling.model = falling.model._replace(courant=length / chosen)
        new, outcome = falling.advance(most=1)
        rows.append(new.copy())
    assert outcome == Outcome.RUNNING or history[-1, History.TIME_STEP] == 0.0
    return np.concatenate(rows)


def whole(falling: Simulation) -> Floats:
    """Places (m) and velocities (m/s) of all nodes of the whole shell, (6, n1+1, columns of the hoop)."""
    model, nodes = falling.whole_shell()
    return np.stack([grid_view(part, model) for part in nodes])


def distance(falling: Simulation, other: Simulation) -> float:
    """Largest difference between places of two shells, over the size of a shell."""
    return float(np.abs(whole(falling)[:3] - whole(other)[:3]).max()) / SIZE


def lopsided(falling: Simulation) -> float:
    """How far a shell is from its symmetry: largest spread of radius or height along a hoop, over the size of a shell."""
    x, y, z = whole(falling)[:3]
    return float(max(np.ptp(np.hypot(x, y), axis=1).max(), np.ptp(z, axis=1).max())) / SIZE


def set_whole(falling: Simulation, nodes: Floats) -> None:
    """Write places and velocities (6, n1+1, n2) of a full shell."""
    for flat, values in zip(falling.state.nodes, nodes, strict=True):
        flat.reshape(len(values), -1)[:, PAD - 1 : PAD + falling.model.n2 + 1] = np.pad(values, ((0, 0), (1, 1)), mode="wrap")


# --- one state, one history ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scene", SCENES)
def test_fidelities_agree_to_round_off(scene: str) -> None:
    """Places, velocities, peaks, and every column of the history: forces and works of a part stand for the whole shell."""
    config, overrides, end = SCENES[scene]
    overrides = (*COARSE, "contact=ground", *overrides)
    full = drop(config, *overrides)
    history = advance_to(full, end)
    scale = np.abs(history).max(axis=0)
    scale[[History.WORK_VISCOUS, History.WORK_GROUND, History.WORK_BELTS]] = scale[History.WORK_PRESSURE]
    assert np.abs(whole(full)[0] - whole(drop(config, *overrides))[0]).max() > 0.02
    for name, fidelity in PARTS.items():
        part = drop(config, *overrides, *fidelity)
        other = follow(part, history)
        assert distance(full, part) < EXACT, name
        assert np.abs(whole(part)[3:] - whole(full)[3:]).max() < 1e-6, name  # m/s
        assert other.shape == history.shape
        difference = np.abs(other - history).max(axis=0) / np.maximum(scale, 1e-12)
        assert difference.max() < 1e-8, (name, History(int(difference.argmax())).name)
        assert part.state.peaks == pytest.approx(full.state.peaks, rel=1e-8)
        assert part.state.overshoot == pytest.approx(full.state.overshoot, rel=1e-8)
        assert part.state.steps[0] == full.state.steps[0]


@pytest.mark.parametrize("law", ["true_tension", "tension_field"])
def test_axisymmetric_shell_is_one_of_circles(law: str) -> None:
    """Its column stands for the whole hoop, however wide: no answer hangs on the cells around it, step by step."""
    overrides = ("grid.generatrix=12", *PARTS["axisymmetric"], f"fabric.law={law}", "contact=ground")
    many = advance_to(drop("paper", *overrides, "grid.hoop=1000"), 0.04)
    few = follow(drop("paper", *overrides, "grid.hoop=12"), many)
    assert len(few) == len(many)
    scale = np.maximum(np.abs(few).max(axis=0), 1e-12)
    scale[[History.WORK_VISCOUS, History.WORK_GROUND, History.WORK_BELTS]] = scale[History.WORK_PRESSURE]
    assert (np.abs(few - many).max(axis=0) / scale).max() < 1e-9


@pytest.mark.parametrize("config", ["paper", "no-belts"])
def test_ground_force_counts_all_columns(config: str) -> None:
    """The wall swings down to the ground while the shell is still symmetric."""
    full = advance_to(drop(config, *COARSE, "contact=ground"), 0.03)
    for fidelity in PARTS.values():
        falling = drop(config, *COARSE, "contact=ground", *fidelity)
        force = follow(falling, full)[:, History.GROUND_FORCE]
        assert falling.now(History.WORK_GROUND) < -0.1
        assert np.abs(force - full[:, History.GROUND_FORCE]).max() < 1e-7 * np.abs(force).max()


CRUSHED = {  # configuration, overrides, end (s)
    "along the cargo's side": ("no-belts", ("pressure.damping=0.01",), 1.0),
    "belts, along the cargo's side": ("paper", ("pressure.damping=0.01",), 1.0),
    "between cover and narrow cargo": ("paper", ("pressure.damping=0.01", "cargo.diameter=0.2"), 0.105),
    "friction on cover": ("paper", ("pressure.damping=0.01", "cargo.diameter=0.2", "friction=0.3"), 0.105),
    "friction on ground": ("paper", ("friction=0.3",), 0.045),
}


@pytest.mark.parametrize("scene", CRUSHED)
def test_contact_agrees_to_round_off(scene: str) -> None:
    """Where the gas's damping keeps folds from amplifying round-off: to impact, or well into contact."""
    config, overrides, end = CRUSHED[scene]
    full = drop(config, *COARSE, SOLID, *overrides)
    history = advance_to(full, end)
    narrow = full.model.obstacles.cargo_radius < full.model.obstacles.cover_radius
    assert (np.abs(history[:, History.CONTACT_FORCE]).max() > 100.0) == narrow  # N; the cargo's side is smooth
    assert full.now(History.WORK_CONTACT) < -0.001
    for name, fidelity in PARTS.items():
        part = drop(config, *COARSE, SOLID, *overrides, *fidelity)
        other = follow(part, history)
        assert distance(full, part) < EXACT, name
        assert other[-1, :7] == pytest.approx(history[-1, :7], rel=1e-9, abs=1e-6)  # up to the cover force
        assert other[:, History.CONTACT_FORCE] == pytest.approx(history[:, History.CONTACT_FORCE], abs=1e-6)


@pytest.mark.parametrize("contact", ["paper", "ground"])
def test_lobes_at_a_belt_agree_to_round_off(contact: str) -> None:
    """Condition (2.5) in the plane of the generatrix: the lobes of test_belt_contact.py closing on each other."""
    full = groove(contact)
    case = replace(full.case, model=replace(full.case.model, fidelity="axisymmetric"))
    part = Simulation(case)
    for values, all_columns in zip(meridian_view(part.state.nodes, part.model), full.state.nodes, strict=True):
        values[:] = grid_view(all_columns, full.model)[:, 0]
    part.state.now[:] = full.state.now
    part.state.kinetic_start[:] = full.state.kinetic_start
    follow(part, advance_to(full, 1e-3))
    assert (full.now(History.WORK_CONTACT) < -0.1) == (contact == "paper")  # J
    assert part.now(History.KINETIC_ENERGY) == pytest.approx(full.now(History.KINETIC_ENERGY), rel=1e-9)
    assert distance(full, part) < EXACT
    assert abs(part.energy_error()) < 1e-13


@pytest.mark.parametrize("config", ["paper", "no-belts"])
def test_fidelities_differ_no_more_than_the_full_shell_is_out_of_round(config: str) -> None:
    """Undamped folds amplify round-off: the columns of the full shell drift apart as the models do."""
    full = drop(config, *COARSE, SOLID)
    parts = [drop(config, *COARSE, SOLID, *fidelity) for fidelity in PARTS.values()]
    for end in np.arange(0.01, 0.13, 0.01):
        history = advance_to(full, end)
        for part in parts:
            follow(part, history)
            assert distance(full, part) < 30.0 * lopsided(full) + 1e-12
    assert lopsided(full) > 1e-11


# --- books -----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("contact", ["contact=ground", "contact=[ground, cover, cargo]"])
@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("config", ["paper", "sine", "belts-list"])
def test_ledger_closes_to_round_off(config: str, part: str, contact: str) -> None:
    falling = drop(config, *COARSE, *PARTS[part], contact)
    rows = advance_to(falling, np.inf)
    assert abs(falling.energy_error()) < 1e-11
    works = rows[:, WORKS]
    residual = rows[:, History.KINETIC_ENERGY] - falling.state.kinetic_start[0] - works.sum(axis=1)
    assert np.abs(residual).max() < 1e-11 * falling.state.kinetic_start[0]
    assert np.abs(works).max() > 100.0


def test_what_fills_the_last_vector_of_a_meridian_is_not_felt() -> None:
    falling, filled = (drop("paper", *COARSE, *PARTS["axisymmetric"], "contact=full") for _ in range(2))
    for part in filled.state.nodes:
        part[filled.model.n1 + 1 :] = 7.0
    assert np.array_equal(advance_to(falling, 0.1), advance_to(filled, 0.1))
    assert falling.now(History.WORK_CONTACT) < 0.0


@pytest.mark.parametrize("contact", ["contact=ground", "contact=[ground, cover, cargo, axis]"])
def test_momentum_changes_by_gravity_and_ground_only(contact: str) -> None:
    """Of the axisymmetric shell, over a whole drop."""
    falling = drop("paper", *COARSE, *PARTS["axisymmetric"], contact, "time.end=0.1")
    model, nodes = falling.model, meridian_view(falling.state.nodes, falling.model)

    def momentum() -> float:
        return model.hoop.whole * float(model.mass @ nodes.w + model.cargo_mass * nodes.w[-1])

    before = momentum()
    rows = advance_to(falling, np.inf)
    steps = rows[:-1, History.TIME_STEP]
    dt = 0.5 * (np.concatenate(([0.0], steps[:-1])) + steps)
    weight = model.hoop.whole * (model.mass.sum() + model.cargo_mass) * model.gravity
    impulse = np.sum(dt * (rows[:-1, History.GROUND_FORCE] - weight))
    assert falling.now(History.WORK_GROUND) < 0.0
    assert momentum() - before == pytest.approx(impulse, abs=1e-11 * abs(before))
    assert abs(impulse) > 10.0


# --- friction --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("friction", [0.1, 0.5])
def test_friction_on_the_meridian_is_coulomb_s(friction: float) -> None:
    """On the ground and under the cover a node loses µ times the impulse that stops it over its mass, at most all it has."""
    length = 1e-4
    for parts, place in (("[ground]", 0.0), ("[cover]", 0.6)):
        falling = drop("no-belts", *COARSE, *PARTS["axisymmetric"], f"contact={parts}", f"friction={friction}")
        model, nodes, meridian = falling.model, meridian_view(falling.state.nodes, falling.model), falling.workspace
        step = Step(length, length, 0.0, 0.6, 0.6, GAP)
        speed = np.full(model.n1 - 1, 2.0)
        speed[::2] = -0.01  # stops
        nodes.x[:], nodes.u[1:-1], nodes.w[1:-1] = 0.2, speed, 0.0
        if place:  # flown a millimetre past it
            nodes.z[1:-1], nodes.w[1:-1] = 0.6 + 1e-3, 20.0
            press_meridian(nodes, model.obstacles, step, model.mass, model.n1)
            stopped = (1e-3 + GAP) / length
        else:
            stopped = 3.0
            meridian.ground_impulse[1 : model.n1] = stopped * model.mass[1:-1]
            rub_meridian(nodes, meridian, model.obstacles, model.mass, length, model.n1)
        expected = np.sign(speed) * np.maximum(np.abs(speed) - friction * stopped, 0.0)
        assert nodes.u[1:-1] == pytest.approx(expected, rel=1e-9, abs=1e-12)
        assert nodes.x[1:-1] == pytest.approx(0.2 + length * (expected - speed), rel=1e-12)


# --- the axis --------------------------------------------------------------------------------------------------------------


def thrown_inwards(*overrides: str) -> Simulation:
    """A slack shell whose middle flies at the axis at 100 m/s, without gas and gravity."""
    still = ("pressure.value=0", "gravity=0", "fabric.E=0.5 kN/m", "cargo.velocity=0.1")
    falling = drop("no-belts", *COARSE, *still, *overrides)
    model, nodes = falling.model, falling.state.nodes
    if falling.case.model.fidelity == "axisymmetric":
        nodes.u[4:9] = -100.0
    else:
        for name, place in (("u", "x"), ("v", "y")):
            values = getattr(nodes, place).reshape(model.n1 + 1, -1)
            getattr(nodes, name).reshape(model.n1 + 1, -1)[4:9] = -100.0 * values[4:9] / 0.25
    added = 0.5 * 100.0**2 * model.mass[4:9].sum() * model.n2 * model.hoop.whole
    falling.state.now[History.KINETIC_ENERGY] = falling.state.kinetic_start[0] = falling.state.kinetic_start[0] + added
    return falling


def least_radius(falling: Simulation, until: float) -> float:
    least = np.inf
    while falling.now(History.TIME) < until:
        falling.advance(most=1)
        least = min(least, falling.state.nodes.x[: falling.model.n1 + 1].min())
    return float(least)


def test_axis_holds_slack_hoops() -> None:
    """Nothing passes it, it takes energy, and it pushes neither cargo nor ground."""
    falling = thrown_inwards(*PARTS["axisymmetric"], "contact=axis")
    least = least_radius(falling, 0.01)
    assert least == pytest.approx(GAP, rel=1e-9)
    assert falling.now(History.WORK_CONTACT) < -0.1 * falling.state.kinetic_start[0]
    assert abs(falling.energy_error()) < 1e-12
    rows = advance_to(falling, 0.012)
    assert (rows[:, History.CONTACT_FORCE] == 0.0).all()


def test_without_the_axis_hoops_turn_inside_out_as_those_of_the_full_shell() -> None:
    axisymmetric, full = thrown_inwards(*PARTS["axisymmetric"], "contact=[]"), thrown_inwards("contact=[]")
    follow(axisymmetric, advance_to(full, 0.01))
    assert axisymmetric.state.nodes.x.min() < -0.01
    assert distance(axisymmetric, full) < EXACT


# --- around the kernels ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("part", PARTS)
def test_result_file_holds_the_whole_shell(part: str, tmp_path: Path) -> None:
    overrides = [*COARSE, "contact=ground", "time.end=5 ms", "output.snapshot_interval=1 ms"]
    names = ("velocity", "tension_generatrix", "tension_hoop", "stretch_generatrix", "stretch_hoop")
    shots = []
    for name, fidelity in (("full", ()), ("part", PARTS[part])):
        file = tmp_path / f"{name}.vtkhdf"
        summary = softbrake.run(load_case(CONFIGS / "paper.yaml", [*overrides, *fidelity]), file)
        shots.append(read_snapshots(file, *names))
        assert len(read_history(file)) == summary.steps + 1
    assert summary.model.fidelity == part.split()[0]
    full, other = shots
    bound = 1e-6  # single precision
    if part == "axisymmetric":  # longer steps of its own
        assert np.ptp(np.hypot(other.xyz[..., 0], other.xyz[..., 1]), axis=2).max() < 1e-6
        bound = 1.5e-2
    else:
        assert full.times == pytest.approx(other.times, rel=1e-12)
    assert full.times[[0, -1]] == pytest.approx(other.times[[0, -1]], rel=1e-12)
    assert np.abs(full.xyz - other.xyz)[[0, -1]].max() < bound
    for name in names[1:]:
        assert np.abs(full.fields[name] - other.fields[name])[-1].max() < bound * np.abs(full.fields[name]).max()


def test_each_driver_is_compiled_once() -> None:
    """Without contact of folds, and once more with it; for any case."""
    for config in ("paper", "sine", "belts-list"):
        for contact in ("paper", "full"):
            drop(config, *COARSE, *PARTS["axisymmetric"], f"contact={contact}").advance(most=2)
            drop(config, *COARSE, f"contact={contact}").advance(until=1e-3)
    for driver in (advance_meridian, advance):
        kinds = [(signature[1][State._fields.index("self_contact")], signature[2]) for signature in driver.entry.signatures]
        assert len(kinds) == len(set(kinds)) == 2


def test_chunks_of_steps_change_nothing() -> None:
    one, other = (drop("paper", *COARSE, *PARTS["axisymmetric"]) for _ in range(2))
    history, _ = one.advance(most=30)
    rows = [other.advance(most=most)[0].copy() for most in (1, 7, 22)]
    assert np.array_equal(np.concatenate(rows), history)
    assert other.state.peaks[Peak.TENSION_HOOP, 0] == one.state.peaks[Peak.TENSION_HOOP, 0] > 0.0


def test_axisymmetric_shell_that_bursts() -> None:
    overrides = (*COARSE, *PARTS["axisymmetric"], "fabric.E=1 kN/m")
    with pytest.raises(softbrake.Diverged, match=r"the fabric bursts") as caught:
        softbrake.run(load_case(CONFIGS / "no-belts.yaml", overrides))
    assert "of 12, column" in str(caught.value)


@pytest.mark.parametrize(
    ("overrides", "fault"),
    [
        (
            ["model.fidelity=axisymmetric", "model.scheme=cell"],
            "model.scheme: the axisymmetric shell does not know the cell scheme; scheme: edge or fidelity: full is expected",
        ),
        (["contact=axis"], "contact: the full shell does not know 'axis'; fidelity: axisymmetric, or no 'axis' is expected"),
        (
            ["model.fidelity=round"],
            "model.fidelity: unknown value 'round'; full or axisymmetric or lumped or auto is expected",
        ),
    ],
)
def test_faults(overrides: list[str], fault: str) -> None:
    with pytest.raises(CaseError) as caught:
        load_case(CONFIGS / "paper.yaml", overrides)
    assert fault in str(caught.value)


def test_everything_stops_the_fabric_by_default(tmp_path: Path) -> None:
    file = tmp_path / "case.yaml"
    text = (CONFIGS / "paper.yaml").read_text(encoding="utf-8").split("\n")
    file.write_text("\n".join(line for line in text if not line.startswith("contact")), encoding="utf-8")
    assert load_case(file).contact == ("ground", "cover", "cargo", "folds")
    assert load_case(file, PARTS["axisymmetric"]).contact == ("ground", "cover", "cargo", "axis", "folds")


# --- gas alone -------------------------------------------------------------------------------------------------------------


def test_lumped_model_is_a_piston() -> None:
    """Exact for constant pressure; with (2.10) of second order, against the energy that the gas has by then."""
    area = np.pi * 0.25**2
    found = softbrake.run(load_case(CONFIGS / "paper.yaml", ["model.fidelity=lumped"]))
    assert found.impact_velocity == pytest.approx(piston(0.6, 6.0, 9.80665, 100.0, area, 15696.0), rel=1e-12)
    assert found.peak_deceleration == pytest.approx(area * 156.96 - 9.80665, rel=1e-12)
    assert abs(found.energy_error) < 1e-12
    assert found.peak_tension_hoop is None and "peak_tension_hoop" not in found.peaks
    free = softbrake.run(load_case(CONFIGS / "free-fall.yaml", ["model.fidelity=lumped"]))
    assert free.impact_velocity == pytest.approx(np.sqrt(36.0 + 2 * 9.80665 * 0.6), rel=1e-12)


def test_lumped_model_stops_at_the_full_stop_pressure() -> None:
    """Section 2.2: the sine's mean pressure takes all energy on the way down."""
    falling = drop("sine", "model.fidelity=lumped")
    rows = advance_to(falling, np.inf)
    force = rows[:, History.PRESSURE] * np.pi * 0.25**2
    expected = 100.0 * (np.gradient(rows[:, History.VELOCITY], rows[:, History.TIME])[1:-2] + 9.80665)
    assert expected == pytest.approx(force[1:-2], rel=1e-4, abs=1e-2 * force.max())
    assert abs(falling.energy_error()) < 1e-11
