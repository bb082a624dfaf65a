"""Threads, sides that stand through faces: the same pairs as the IPC Toolkit finds, in drops and where they are known."""

import io
import json
from dataclasses import replace
from math import cos, pi, sin
from pathlib import Path

import h5py
import numpy as np
import pytest
import synthetic_drop
from naive_self_contact import meridian_crossings
from rich.console import Console

import softbrake
from benchmarks.ipc import Pair, passes, threads_and_hinges
from softbrake.case.case_file import parse_case
from softbrake.case.schema import starter
from softbrake.core.arrays import PAD, Floats, Model, Nodes, Outcome
from softbrake.core.columns import History
from softbrake.report.console.summary import print_summary
from softbrake.report.words import thread_rows
from softbrake.sim.build import build_model, grid_view
from softbrake.sim.result_file import ResultFile, read_snapshots
from softbrake.sim.simulation import Simulation
from softbrake.sim.threads import ThreadSearch, crossings_of_meridian

CONFIGS = Path(__file__).resolve().parents[1] / "configs"
ROWS, COLUMNS, FINE = 6, 12, 48
MANY = 10_000  # pairs
Pairs = set[Pair]


def model_of(rows: int, columns: int) -> Model:
    return build_model(synthetic_drop.case(rows, columns))


def pairs_of(model: Model, nodes: Nodes) -> tuple[Pairs, Pairs]:
    """Return threads and hinges, nodes counted by rows without copies."""
    found = ThreadSearch(model).find(nodes, MANY)
    row, column = np.divmod(found.pairs, model.stride)
    a, b, face = (row * model.n2 + column - PAD).T
    corners = np.stack((face, face // model.n2 * model.n2 + (face + 1) % model.n2))
    corners = np.concatenate((corners, corners + model.n2))
    shared = ((a == corners) | (b == corners)).any(axis=0)
    pairs = [((i, j), k) for i, j, k in zip(a.tolist(), b.tolist(), face.tolist(), strict=True)]
    threads, hinges = ({pair for pair, at in zip(pairs, shared, strict=True) if at == kind} for kind in (False, True))
    assert (found.threads, found.hinges) == (len(threads), len(hinges))
    return threads, hinges


def found_in(places: Floats) -> tuple[Pairs, Pairs]:
    """Return threads and hinges of places (m+1, n, 3), after comparing them with the IPC Toolkit's."""
    model = model_of(places.shape[0] - 1, places.shape[1])
    flat = [np.full((model.n1 + 1) * model.stride, np.nan) for _ in Nodes._fields]  # padding is read by nobody
    for part, values in zip(flat, np.moveaxis(places, -1, 0), strict=False):
        grid_view(part, model)[:] = values
    pairs = pairs_of(model, Nodes(*flat))
    assert pairs == threads_and_hinges(places)
    return pairs


def cylinder(rows: int = ROWS, columns: int = COLUMNS) -> Floats:
    """Return the nodes of a cylinder of radius 1 and cells of height 1; the middle of face 0 of each row is at angle 0."""
    angle = 2.0 * pi * (np.arange(columns) - 0.5) / columns
    z, angle = np.meshgrid(np.arange(rows + 1.0), angle, indexing="ij")
    return np.stack((np.cos(angle), np.sin(angle), z), axis=-1)


def pierced() -> Floats:
    """Return a cylinder of which a node of the rim is across the axis outside, and its generatrix passes the wall there."""
    places = cylinder()
    places[0, COLUMNS // 2] = 1.2, 0.0, -0.05
    return places


def dipping(depth: float) -> Floats:
    """Return a cylinder with a saddle for face 0 of row 2, over which a side of the wall across dips, both ends on their side.

    depth: of the second end on that side.
    """
    places, warp = cylinder(), 0.2
    for (i, j), sign in {(2, 0): -1.0, (2, 1): 1.0, (3, 1): -1.0, (3, 0): 1.0}.items():
        places[i, j, 0] += sign * warp
    middle = places[2:4, 0:2].mean(axis=(0, 1))
    along = places[2, 1] - middle  # of the diagonal that is bent outwards
    for node, share, inwards in ((6, 0.8, 0.1), (7, -0.8, depth)):
        places[2, node] = middle + share * along * [0.0, 1.0, 1.0] + [0.0, 0.0, 0.05]  # beside the diagonal, where triangles meet
        places[2, node, 0] = middle[0] + warp * abs(share) - inwards
    return places


def folded(clearance: float) -> Floats:
    """Return a cylinder folded down over its lowest row, half a column aside, whose face 0 is warped; outside of it.

    clearance: of the end, in front of face 0, of the side that starts from a corner of that face.
    """
    radius, warp = FINE / (2.0 * pi), 0.2

    def place(height: float, column: float, outwards: float) -> tuple[float, float, float]:
        angle, r = 2.0 * pi * (column - 0.5) / FINE, radius + outwards
        return r * cos(angle), r * sin(angle), height

    inside = [[place(height, column, 0.0) for column in range(FINE)] for height in (0.0, 1.0)]
    outside = [[place(height, column + 0.5, 0.3) for column in range(FINE)] for height in (0.3, 1.3, 2.3)]
    places = np.array(inside + outside)
    for row, column, sign in ((0, 0, 1.0), (0, 1, -1.0), (1, 1, 1.0), (1, 0, -1.0)):
        places[row, column] = place(row, column, sign * warp)
    places[2, 0] = place(0.3, 0.5, clearance)
    return places


@pytest.mark.kernels
def test_smooth_cylinder_has_none() -> None:
    assert found_in(cylinder()) == (set(), set())


@pytest.mark.kernels
@pytest.mark.parametrize("shift", range(COLUMNS))
def test_side_through_a_face(shift: int) -> None:
    """Wherever the grid has its seam. The rim of the wall passes the faces beside that side: so the cut ends."""
    node, before = (COLUMNS // 2 + shift) % COLUMNS, (COLUMNS // 2 + shift - 1) % COLUMNS
    rim = shift, (shift + 1) % COLUMNS
    threads = {((node, COLUMNS + node), shift), (rim, before), (rim, node)}
    assert found_in(np.roll(pierced(), shift, axis=1)) == (threads, set())


@pytest.mark.kernels
def test_node_through_a_face_takes_its_four_sides_along() -> None:
    places = cylinder()
    places[2, 6] = 1.2, 0.0, 2.5
    node, face = 2 * COLUMNS + 6, 2 * COLUMNS
    sides = {(node - 1, node), (node, node + 1), (node - COLUMNS, node), (node, node + COLUMNS)}
    assert found_in(places) == ({(side, face) for side in sides}, set())


@pytest.mark.kernels
def test_row_on_the_cover_is_looked_at() -> None:
    """Sides around the hoop of the uppermost row belong to no face above them."""
    places = np.flip(pierced(), axis=0) * [1.0, 1.0, -1.0]
    last, node = ROWS * COLUMNS, COLUMNS // 2
    assert ((last, last + 1), last - COLUMNS + node) in found_in(places)[0]


@pytest.mark.kernels
def test_side_that_dips_is_no_thread() -> None:
    """Two passes of a warped face are in and out; one is a thread."""
    side, face = (2 * COLUMNS + 6, 2 * COLUMNS + 7), 2 * COLUMNS
    assert passes(dipping(0.1))[side, face] == 2
    assert found_in(dipping(0.1)) == (set(), set())
    assert (side, face) in found_in(dipping(-0.1))[0]


@pytest.mark.kernels
def test_side_that_dips_from_a_corner_is_no_thread() -> None:
    """It starts below a warped face, and comes out to its end, which is outside: a hinge. Where the end is inside, it is none."""
    side, face = (FINE, 2 * FINE), 0
    end = side[1]
    assert found_in(folded(0.1)) == (set(), set())
    assert found_in(folded(0.02)) == (set(), {(side, face)})
    threads, hinges = found_in(folded(-0.1))
    assert {((end, end + 1), face), ((end, end + FINE), face)} <= threads
    assert (side, face) not in hinges


@pytest.mark.kernels
@pytest.mark.parametrize("seed", range(6))
def test_crumpled_by_chance(seed: int) -> None:
    """Hundreds of pairs of both kinds, on an odd grid."""
    places = cylinder(9, 19) * [1.0, 1.0, 0.2]
    threads, hinges = found_in(places + np.random.default_rng(seed).normal(scale=0.3, size=places.shape))
    assert len(threads) > 200 and len(hinges) > 20


@pytest.mark.kernels
def test_meridian() -> None:
    model = model_of(60, 8)
    for seed in range(20):
        places = np.random.default_rng(seed).normal(size=(model.n1 + 1, 2)).cumsum(axis=0)
        empty = np.zeros(model.n1 + 1)
        nodes = Nodes(places[:, 0].copy(), empty, places[:, 1].copy(), empty, empty, empty)
        crossings = meridian_crossings(places)
        assert crossings and crossings_of_meridian(model, nodes) == len(crossings)
    assert crossings_of_meridian(model, nodes._replace(x=np.ones(model.n1 + 1), z=np.linspace(0.0, 1.0, model.n1 + 1))) == 0


def small_drop(name: str, *overrides: str) -> Simulation:
    if name == "starter":
        return Simulation(parse_case(starter(), name, ["grid.generatrix=18", "grid.hoop=45"]))
    grid = ["grid.generatrix=12", "grid.hoop=30", "time.courant=auto", *overrides]
    return Simulation(softbrake.load_case(CONFIGS / "paper-contact.yaml", grid))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["undamped", "damped", "starter"])
def test_drop(name: str) -> None:
    """Every 5 ms and at the end, on the ground, where fabric of the paper's case has passed in the last 1e-5 m."""
    damping = ("pressure.damping=0.0005",) if name == "damped" else ()
    falling, outcome, hinged = small_drop(name, *damping), Outcome.RUNNING, 0
    falling.advance(most=0)
    falling.disturb(1e-3 * 0.5 * falling.case.shell.diameter, 0)
    while outcome == Outcome.RUNNING:
        until = falling.now(History.TIME) + 5e-3
        while outcome == Outcome.RUNNING and falling.now(History.TIME) < until:
            _, outcome = falling.advance(until)
        places = np.stack([grid_view(part, falling.model) for part in falling.state.nodes[:3]], axis=-1)
        threads, hinges = pairs_of(falling.model, falling.state.nodes)
        assert (threads, hinges) == threads_and_hinges(places)
        hinged += len(hinges)
    assert (hinged > 0) == (name != "starter")
    assert outcome == Outcome.IMPACT and falling.finish(outcome).threads == len(threads)
    assert (len(threads) > 0) == (name != "starter")


@pytest.mark.slow
@pytest.mark.parametrize("overrides", [(), ("contact=solid",), ("model.fidelity=axisymmetric",)], ids=str)
def test_answer_and_file_tell(overrides: tuple[str, ...], tmp_path: Path) -> None:
    """The file at each snapshot; the answer at the end, and when they were first seen. None without contact of folds."""
    falling = small_drop("undamped", *overrides)
    falling.advance(most=0)
    falling.disturb(1e-3 * 0.5 * falling.case.shell.diameter, 0)
    with ResultFile.create(tmp_path / "drop.vtkhdf", falling.case, version="1", source_hash="a") as file:
        summary = falling.to_end(file)
    result = softbrake.read_result(tmp_path / "drop.vtkhdf")
    shots = result.snapshots()
    assert result.summary == replace(summary, peaks=result.summary.peaks) if result.summary else False
    if overrides == ("contact=solid",):
        assert shots.threads is summary.threads is summary.thread_time is None
        return
    assert shots.threads is not None and shots.threads[0] == 0 and shots.threads[-1] == summary.threads == falling.threads()
    some = shots.times[shots.threads > 0]
    assert summary.thread_time == (some[0] if len(some) else None)
    assert len(some) > 0 or overrides
    rows = thread_rows(summary)
    assert [row[:2] for row in rows] == ([("threads", str(summary.threads))] if len(some) else [])


def test_older_file_has_none(tmp_path: Path) -> None:
    """Its answer lacks the fields, and its snapshots the array."""
    path = tmp_path / "drop.vtkhdf"
    synthetic_drop.write(path, synthetic_drop.case(6, 8))
    with h5py.File(path, "r+") as file:
        text = json.loads(file["softbrake/summary"][()])
        del text["threads"], text["thread_time"], file["softbrake/summary"]
        file["softbrake/summary"] = json.dumps(text)
    summary = softbrake.read_result(path).summary
    assert summary is not None and summary.threads is summary.thread_time is read_snapshots(path).threads is None
    assert thread_rows(summary) == []


def test_when_threads_were_seen_is_said() -> None:
    summary = replace(synthetic_drop.summary(), threads=7)
    assert thread_rows(summary) == [("threads", "7", "sides through faces, at the end")]
    assert thread_rows(replace(summary, thread_time=summary.end_time))[0][2] == "sides through faces, at the end only"
    seen = replace(summary, thread_time=0.05, threads=0)
    assert thread_rows(seen) == [("threads", "0", "sides through faces, at the end, first seen at 0.05 s")]
    lines = io.StringIO()
    print_summary(seen, console=Console(file=lines, width=80))
    assert "threads" in lines.getvalue() and "0.05 s" in lines.getvalue()
