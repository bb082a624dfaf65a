"""Case -> Model, State, Workspace: the one place that allocates their arrays."""

from collections.abc import Sequence
from dataclasses import replace
from math import cos, inf, pi, sin

import numpy as np

from softbrake.case.case import Case
from softbrake.case.sections.numerics import LUMPED_STEPS, ONE_COLUMN
from softbrake.case.sections.vents import Vent
from softbrake.core.arrays import (
    PAD,
    ActivePairs,
    After,
    BeforeContact,
    BeltContact,
    BeltRow,
    Belts,
    Box,
    ByColumn,
    ByRow,
    Cells,
    ContactCount,
    Edges,
    Floats,
    Gas,
    GasPressure,
    GasState,
    Hoop,
    Law,
    Membrane,
    Meridian,
    Model,
    Motion,
    NearPairs,
    Nodes,
    Obstacles,
    Peak,
    PressureLaw,
    Records,
    RunningMaximum,
    Scheme,
    SelfContact,
    Shape,
    Source,
    Speed,
    State,
    StateColumn,
    Vectors,
    VentConstant,
    VentState,
    WorkByColumn,
    Workspace,
)
from softbrake.core.columns import History
from softbrake.core.contact.constants import BATCH, BLOCK

OVERSHOOT = 0.9  # of the shell's height: below 0.913 a static wall touches the covers, and contact decides what it bears
WEIGHINGS = 4
PAIRS_PER_NODE = 0.25  # near one another, to begin with
ACTIVE_PART = 0.25  # of them, likewise
ROOM = 1.25  # times what was too much
PLEATS = 64  # the same of a meridian, all of whose segments may lie on one another
FREE = 1  # first free node of a meridian
SLIVER = 1e-3  # least part of a belt that a row carries, of what the row with most of it does


def build_model(case: Case) -> Model:
    """Return the constants of a case on its grid.

    Hoop edges are chords of arcs on which cloth and gas are reckoned, so that a round shell is one of circles.
    """
    n1, hoop, one_column = case.grid.generatrix, case.grid.hoop, case.model.fidelity in ONE_COLUMN
    n2, pressure = 1 if one_column else hoop, _pressure(case)
    shape = _shape(case)
    lower, upper = 0.5 * case.shell.lower_diameter, 0.5 * case.shell.upper_diameter
    membrane = _membrane(case, float(shape.h1[0]), float(shape.h2[0]))
    whole = 2.0 * pi * shape.radius[0] / (n2 * membrane.h2)  # with the cloth of arcs
    belts, line_mass = _belts(case, shape)
    per_mass = np.concatenate(([0.0], 1.0 / (line_mass[1:-1] * shape.h2[1:-1]), [0.0]))
    below, above = _pulls(per_mass, np.zeros_like(per_mass))
    shared = 4.0 * per_mass
    if case.model.scheme == "cell":
        shared = np.add(*_pulls(per_mass, shared * belts.stiffness / (membrane.c22 * shape.h1)))
    return Model(
        n1=n1,
        n2=n2,
        stride=1 if one_column else PAD + _lanes(n2) + PAD,
        scheme=int(Scheme[case.model.scheme.upper()]),
        courant=case.time.courant,
        end=case.time.end,
        gravity=case.gravity,
        height=case.shell.height,
        after=int(_after(case)),
        crushing=OVERSHOOT * case.shell.height,
        cargo_mass=case.cargo.mass / whole,
        cover_area=pi * upper * upper / whole,
        base_area=pi * lower * lower / whole,
        piston_area=0.25 * pi * case.shell.mean_diameter**2 / whole,
        most_gas_work=_most_gas_work(case, pressure),
        mass=0.0 * line_mass if case.model.fidelity == "lumped" else line_mass * shape.h2,
        per_mass=per_mass,
        below=below,
        above=above,
        shared=shared,
        shape=shape,
        fabric=membrane,
        belts=belts,
        belt_contact=_belt_contact(belts.width if "belts" in case.contact else np.zeros(n1 + 1)),
        pressure=pressure,
        gas=_gas(case),
        obstacles=_obstacles(case),
        hoop=Hoop(whole=whole, gas=1.0 if one_column else 1.0 / cos(pi / hoop), cos=cos(2.0 * pi / hoop)),
    )


def without_viscosity(model: Model) -> Model:
    """Return a model whose fabric and belts are not viscous."""
    belts = model.belts._replace(viscosity=0.0 * model.belts.viscosity)
    return model._replace(fabric=model.fabric._replace(viscosity=0.0), belts=belts)


def _membrane(case: Case, h1: float, h2: float) -> Membrane:
    """Constants of the tension law on cells of these edges (m)."""
    cloth = case.fabric
    contraction = cloth.contraction
    return Membrane(
        law=int(Law[cloth.law.upper()]),
        h1=h1,
        h2=h2,
        e11=cloth.E11,
        e22=cloth.E22,
        c11=cloth.E11 / contraction,
        c22=cloth.E22 / contraction,
        c12=cloth.nu12 * cloth.E11 / contraction,
        g12=cloth.G12,
        viscosity=cloth.viscosity,
        floor=-inf if cloth.slack == "compression" else 0.0,
        true_tension=float(cloth.law == "true_tension"),
    )


def places(case: Case) -> tuple[Floats, Floats]:
    """Height and radius (m) at first of each row, (n1+1,), evenly along the cloth."""
    z, r = np.array([case.shell.at(along) for along in _rows_along(case)]).T
    return z, r


def _rows_along(case: Case) -> list[float]:
    """How far (m of cloth) each row is from the lower cover."""
    along: list[float] = np.linspace(0.0, case.shell.wall, case.grid.generatrix + 1).tolist()
    return along


def _shape(case: Case) -> Shape:
    """Unloaded lengths (m): chords from row to row of an arc; of other profiles the cloth between them, kinks or not."""
    n1, hoop, shell = case.grid.generatrix, case.grid.hoop, case.shell
    radius = np.array([shell.hoop(along) for along in _rows_along(case)])
    h1 = np.full(n1 + 1, shell.wall / n1)
    if shell.profile in ("barrel", "sphere"):  # chords
        z, _ = places(case)
        h1[:-1] = np.hypot(np.diff(z), np.diff(radius))
        h1[-1] = h1[-2]
    side = 2.0 * sin(pi / hoop)
    h2 = side * radius
    return Shape(
        h1,
        h2,
        radius,
        side=float(h2[0] / radius[0]),
        least_1=float(h1.min()),
        least_2=float(h2.min()),
        widest=float(radius.max()),
    )


def _belts(case: Case, shape: Shape) -> tuple[Belts, Floats]:
    """Belts and mass per length of hoop (kg/m) of each row of nodes.

    A node has the mass of the cloth halfway to its neighbours, and of the belts there; a belt is shared by the rows in proportion
    to the part of its width that lies in each one's half cells.
    """
    cloth, h1, n1 = case.fabric, shape.h1, case.grid.generatrix
    true_tension, contraction = cloth.law == "true_tension", cloth.contraction
    share = 0.5 * np.concatenate(([h1[0]], h1[:-2] + h1[1:-1], [h1[-2]]))
    line_mass = cloth.areal_density * share
    belts = Belts(*(np.zeros(n1 + 1) for _ in Belts._fields))
    # By (2.3) N22 feels e11, but T11 nothing of the belt: no potential allows that, so other laws make it a plain filament.
    coupling = cloth.nu12 * cloth.E11 / contraction if true_tension else 0.0
    shell = case.shell
    cell = shell.wall / n1
    for belt in case.belts:
        width = _overlap(shell.along(belt.height), belt.width, n1, cell)
        part = width / belt.width
        line_mass += belt.line_density * part
        belts.width[:] += width
        belts.stiffness[:] += belt.stiffness / (contraction if true_tension else 1.0) * part
        belts.coupling[:] += coupling * width
        belts.viscosity[:] += cloth.viscosity * width
    return belts, line_mass


def _after(case: Case) -> After:
    """What follows where the cargo stands still."""
    if case.time.after == "stop":
        return After.STOP
    return After.REBOUND if case.gas is None or _is_open(case) else After.TOP


def _is_open(case: Case) -> bool:
    """Whether gas can get in or out."""
    return bool(case.vents) or case.leakage > 0.0 or case.permeability is not None or case.inflator is not None


def _most_gas_work(case: Case, pressure: GasPressure) -> float:
    """More than gas can give (J), of a shell of twice its diameter."""
    # Neither cloth nor gas of twice the widest hoop and all the wall's length has more room.
    gas, inflator, volume = case.gas, case.inflator, pi * case.shell.diameter**2 * case.shell.wall
    if gas is None:
        return pressure.most * volume
    inner = (case.ambient.pressure + pressure.most) * volume / (gas.gamma - 1.0)
    if inflator is None:
        return inner
    enthalpy = gas.gamma / (gas.gamma - 1.0) * gas.gas_constant * inflator.temperature
    return inner + enthalpy * float(np.trapezoid(inflator.mass_flow, inflator.times))


def _gas(case: Case) -> Gas:
    """A gas with a state; of exponent 0 none."""
    gas, vents, wall, inflator = case.gas, case.vents, case.permeability, case.inflator
    gamma = 1.4 if gas is None else gas.gamma
    choking = (2.0 / (gamma + 1.0)) ** (gamma / (gamma - 1.0))
    most = max((len(vent.discharge) for vent in vents), default=1)
    return Gas(
        exponent=0.0 if gas is None else gas.exponent,
        gamma=gamma,
        gas_constant=0.0 if gas is None else gas.gas_constant,
        choking=choking,
        choked_root=choking ** (1.0 / gamma),
        ambient_pressure=case.ambient.pressure,
        ambient_temperature=case.ambient.temperature,
        closed=int(not _is_open(case)),
        leaks=int(case.leakage > 0.0 or wall is not None),
        leakage=case.leakage,
        linear=0.0 if wall is None else wall.linear,
        quadratic=0.0 if wall is None else wall.quadratic,
        viscous=0.0 if wall is None else wall.viscous,
        inertial=0.0 if wall is None else wall.inertial,
        inflow_temperature=0.0 if inflator is None else inflator.temperature,
        inflow=np.array(((), ()) if inflator is None else (inflator.times, inflator.mass_flow), float),
        vents=np.array(
            [[*_vent(vent), *_padded(vent.pressure_ratio, most), *_padded(vent.discharge, most)] for vent in vents]
        ).reshape(-1, len(VentConstant) + 2 * most),
    )


def _vent(vent: Vent) -> list[float]:
    """Constants of a row of `Gas.vents`."""
    events = (vent.opens_at_pressure, vent.opens_at_time, vent.opens_at_height)
    always = -inf if all(event is None for event in events) else inf
    given = {
        VentConstant.AREA: vent.area,
        VentConstant.OPENS_AT_PRESSURE: inf if vent.opens_at_pressure is None else vent.opens_at_pressure,
        VentConstant.OPENS_AT_TIME: always if vent.opens_at_time is None else vent.opens_at_time,
        VentConstant.OPENS_AT_HEIGHT: -inf if vent.opens_at_height is None else vent.opens_at_height,
        VentConstant.CLOSES_AT_PRESSURE: -inf if vent.closes_at_pressure is None else vent.closes_at_pressure,
        VentConstant.CLOSES_AT_HEIGHT: -inf if vent.closes_at_height is None else vent.closes_at_height,
        VentConstant.INFLOW: float(vent.inflow),
    }
    return [given[column] for column in VentConstant]


def _padded(values: Sequence[float], count: int) -> list[float]:
    """Values with the last one repeated."""
    return [*values, *[values[-1]] * (count - len(values))]


def _pressure(case: Case) -> GasPressure:
    """Pressure in time; of a gas with a state that of the shell as it hangs."""
    law = case.filling
    return GasPressure(
        law=int(PressureLaw[law.law.upper()]),
        value=law.value,
        peak_time=law.peak_time,
        end_time=law.end_time,
        times=np.array(law.times, float),
        values=np.array(law.values, float),
        damping=law.damping,
        most=law.largest,
    )


def _obstacles(case: Case) -> Obstacles:
    """What stops the fabric."""
    return Obstacles(
        ground=0.0 if "ground" in case.contact else -inf,
        friction=case.friction,
        cover=int("cover" in case.contact),
        cover_radius=0.5 * case.shell.upper_diameter,
        cargo=int("cargo" in case.contact),
        cargo_radius=0.5 * case.cargo.diameter,
        cargo_height=inf if case.cargo.height is None else case.cargo.height,
        axis=int("axis" in case.contact and case.model.fidelity in ONE_COLUMN),
    )


def _pulls(per_mass: Floats, own: Floats) -> tuple[Floats, Floats]:
    """Return `Model.below` and `Model.above` for a chain of rows: Gershgorin's theorem with a weight for each row.

    It holds for any weights. Those of a power iteration never raise the bound (Collatz, Wielandt); a few light rows between
    heavy ones cannot move as freely as many, which even weights do not know.
    own: likewise (1/kg), of what holds a row besides, in parts of the chain's stiffness.
    """
    weight, below, above = np.ones_like(per_mass), np.zeros_like(per_mass), np.zeros_like(per_mass)
    for _ in range(WEIGHINGS):
        below[1:-1] = per_mass[1:-1] + weight[:-2] / weight[1:-1] * per_mass[:-2]
        above[1:-1] = per_mass[1:-1] + weight[2:] / weight[1:-1] * per_mass[2:]
        rate = (below + above + own)[1:-1]
        weight[1:-1] *= rate / rate.max(initial=0.0)
    return below, above


def build_state(case: Case, model: Model) -> State:
    """Return the state at first contact: unloaded shell, all of it falling with the cargo but the row on the ground."""
    one_column, stride = case.model.fidelity in ONE_COLUMN, model.stride
    angle = np.zeros(1) if one_column else 2.0 * pi * (np.arange(stride) - PAD) / case.grid.hoop
    rows = model.n1 + 1
    nodes = Nodes(*(_rows(1, rows + PAD, Nodes._fields, FREE) if one_column else _rows(rows, stride, Nodes._fields)))
    x, y, z, _, _, w = (part[: rows * stride].reshape(rows, stride) for part in nodes)
    height, radius = (part[:, None] for part in places(case))
    x[:], y[:], z[:] = radius * np.cos(angle), radius * np.sin(angle), height
    w[:] = np.where(height > 0.0, -case.cargo.velocity, 0.0)
    now = np.zeros(len(History))
    now[History.HEIGHT] = case.shell.height
    now[History.VELOCITY] = -case.cargo.velocity
    moving = model.hoop.whole * (model.cargo_mass + model.n2 * model.mass[1:].sum())
    now[History.KINETIC_ENERGY] = 0.5 * moving * case.cargo.velocity**2
    longest = case.shell.height / case.cargo.velocity / LUMPED_STEPS
    return State(
        nodes=nodes,
        now=now,
        steps=np.zeros(1, np.int64),
        choice=np.array([0, 1], np.int64),
        stable_step=np.array([longest, longest if case.model.fidelity == "lumped" else 0.0]),  # others choose theirs
        last_step=np.zeros(1),
        kinetic_start=np.array([now[History.KINETIC_ENERGY]]),
        stored=np.zeros(2),
        made=np.zeros(len(Source)),
        peaks=np.zeros((len(Peak), 3)),
        overshoot=np.zeros((len(Peak), 3)),
        filtered_deceleration=np.zeros(1),
        motion=np.full(len(Motion), inf),
        gas=np.zeros(len(GasState)),
        vents=np.zeros((len(model.gas.vents), len(VentState))),
        work=WorkByColumn(
            *(
                _rows(1, rows + PAD, WorkByColumn._fields, FREE)
                if one_column
                else _rows(1, _lanes(model.n2), WorkByColumn._fields)
            )
        ),
        self_contact=build_self_contact(rows * stride, model.n1, model.n2, PLEATS if one_column else PAIRS_PER_NODE)
        if "folds" in case.contact and case.model.fidelity != "lumped"
        else None,
    )


def build_self_contact(nodes: int, rows: int, columns: int, pairs: float) -> SelfContact:
    """Return the arrays of self-contact, for so many nodes with so many pairs each, rows and columns of cells.

    nodes: size of their arrays.
    """
    active = pairs if columns == 1 else ACTIVE_PART * pairs  # all of a meridian may be active
    blocks, cells = -(-rows // BLOCK) * -(-columns // BLOCK), 2 * (BLOCK + 1) * BLOCK
    home = np.arange(nodes, dtype=np.uint32)
    if columns > 1:
        behind = home.reshape(rows + 1, -1)[:, PAD + columns]
        behind -= columns
    return SelfContact(
        record=Records(np.zeros((nodes, 4)), np.zeros((nodes, len(Speed))), np.zeros(nodes, np.uint32)),
        pairs=build_near_pairs(int(pairs * nodes)),
        active=build_active_pairs(int(active * nodes)),
        path=np.zeros(nodes, np.float32),
        reached=np.zeros(2 * nodes, np.float32),
        travel=np.zeros(2 * nodes, np.float32),
        margin=np.full(nodes, -1.0, np.float32),  # used up
        home=home,
        since=np.zeros(3),
        scale=np.ones(1),
        normal=np.zeros((nodes, 3), np.float32),
        cell_box=np.zeros((7, nodes)),
        zone=np.zeros(nodes, np.uint32),
        blocks=np.zeros((blocks, len(Box))),
        order=np.arange(blocks),
        cells=np.zeros(cells, np.int64),
        boxes=np.zeros((8, cells)),
        given=np.zeros((12, BATCH)),
        found=np.zeros((9, BATCH)),
        due=np.zeros((2, BATCH + 1), np.uint32),
        counts=np.zeros(len(ContactCount), np.int64),
        penetration=np.zeros(1),
    )


def build_near_pairs(capacity: int) -> NearPairs:
    """Return the arrays of so many near pairs."""
    first, second = np.zeros((2, capacity), np.uint32)
    return NearPairs(first, second, np.zeros(capacity, np.float32))


def build_active_pairs(capacity: int) -> ActivePairs:
    """Return the arrays of so many active pairs."""
    return ActivePairs(np.zeros((capacity, 5), np.uint32), np.zeros((capacity, len(StateColumn)), np.float32))


def lacks_room(self_contact: SelfContact) -> bool:
    """Return whether there were more pairs than the arrays of self-contact hold."""
    counts = self_contact.counts
    listed = counts[ContactCount.FACES] + counts[ContactCount.EDGES]
    return bool(listed > self_contact.pairs.first.size or counts[ContactCount.ACTIVE] > len(self_contact.active.nodes))


def with_room(self_contact: SelfContact) -> SelfContact:
    """Return the arrays of self-contact with room for the pairs there were, and some more."""
    counts = self_contact.counts
    listed, active = int(counts[ContactCount.FACES] + counts[ContactCount.EDGES]), int(counts[ContactCount.ACTIVE])
    counts[ContactCount.STALE] = 1  # pairs are found anew
    counts[[ContactCount.FACES, ContactCount.EDGES, ContactCount.ACTIVE]] = 0
    return self_contact._replace(
        pairs=build_near_pairs(max(int(ROOM * listed), self_contact.pairs.first.size)),
        active=build_active_pairs(max(int(ROOM * active), len(self_contact.active.nodes))),
    )


def build_workspace(model: Model, self_contact: bool = False) -> Workspace:
    """Return the scratch arrays of a step; self_contact: whether that is asked for."""
    lanes, stride = _lanes(model.n2), model.stride
    return Workspace(
        generatrix=Edges(*_rows(2, stride, Edges._fields)),
        hoop=Edges(*_rows(3, stride, Edges._fields)),
        belt=BeltRow(*_rows(1, stride, BeltRow._fields)),
        tension_1=_rows(1, stride, ("tension_1",))[0],
        tension_2=_rows(1, stride, ("tension_2",))[0],
        cells=Cells(*_rows(2, stride, Cells._fields)),
        force=Vectors(*_rows(1, stride, Vectors._fields)),
        force_above=Vectors(*_rows(1, stride, Vectors._fields)),
        area=Vectors(*_rows(1, stride, Vectors._fields)),
        mean=Vectors(*_rows(2, stride, Vectors._fields)),
        pressure=_rows(1, lanes, ("pressure",))[0],
        maximum_generatrix=RunningMaximum(*_rows(1, lanes, RunningMaximum._fields)),
        maximum_hoop=RunningMaximum(*_rows(1, lanes, RunningMaximum._fields)),
        maximum_belt=RunningMaximum(*_rows(1, lanes, RunningMaximum._fields)),
        by_column=ByColumn(*_rows(1, lanes, ByColumn._fields)),
        by_row=_by_row(model),
        before_contact=_before_contact(model, self_contact),
    )


def _before_contact(model: Model, self_contact: bool) -> BeforeContact:
    count, size = (model.n1 + 1, model.stride) if self_contact or model.belt_contact.below.size > 0 else (1, 1)
    before, jump = (_rows(count, size, fields) for fields in (Nodes._fields, Vectors._fields))
    return BeforeContact(Nodes(*before), Vectors(*jump), np.zeros(2))


def build_meridian(model: Model) -> Meridian:
    """Return the scratch arrays of a step of the axisymmetric shell."""
    nodes = model.n1 + 1 + PAD
    edges = ("x", "z", "e", "tension_1", "force", "elastic", "per_1", "width_1")
    others = [name for name in Meridian._fields if name not in (*edges, "area", "belts", "belt_rows", "by_row", "impulse")]
    scratch = dict(zip(edges, _rows(1, nodes, edges), strict=True))
    scratch |= dict(zip(others, _rows(1, nodes, others, FREE), strict=True))
    area = Vectors(*_rows(1, PAD + nodes, Vectors._fields, FREE))
    rows = np.flatnonzero(model.belts.width)
    belts = Belts(*_rows(1, nodes, Belts._fields, FREE))
    constants = ((scratch["mass"], model.mass), (scratch["per_mass"], model.per_mass), *zip(belts, model.belts, strict=True))
    for part, values in constants:
        part[1 : model.n1] = values[1:-1]
    _fill_lengths(scratch, model.shape)
    return Meridian(**scratch, belts=belts, impulse=np.zeros(2), area=area, belt_rows=rows, by_row=_by_row(model))


def _fill_lengths(scratch: dict[str, Floats], shape: Shape) -> None:
    """Fill those of a Meridian, beyond the cover as at it."""
    between, across = 0.5 * (shape.h2[:-1] + shape.h2[1:]), 0.5 * (shape.h1[:-2] + shape.h1[1:-1])
    values = {
        "per_1": 1.0 / shape.h1[:-1],
        "per_2": shape.side / shape.h2,
        "width_1": between,
        "width_2": np.concatenate(([shape.h1[0]], across, [shape.h1[-1]])),
    }
    for name, part in values.items():
        scratch[name][:] = part[-1]
        scratch[name][: part.size] = part


def whole_model(case: Case) -> Model:
    """Return the model of the whole shell, whatever part of it is computed."""
    return build_model(replace(case, model=replace(case.model, fidelity="full")))


def whole_nodes(whole: Model, model: Model, column: Nodes) -> Nodes:
    """Return the nodes of the whole shell by turning the one column that was computed."""
    nodes = Nodes(*_rows(whole.n1 + 1, whole.stride, Nodes._fields))
    angle = 2.0 * pi * (np.arange(whole.stride) - PAD) / whole.n2
    parts = [values[:, None] for values in meridian_view(column, model)]
    x, y, z, u, v, w = (values.reshape(whole.n1 + 1, whole.stride) for values in nodes)
    for (a, b), (old_a, old_b) in zip(((x, y), (u, v)), (parts[0:2], parts[3:5]), strict=True):
        a[:] = np.cos(angle) * old_a - np.sin(angle) * old_b
        b[:] = np.sin(angle) * old_a + np.cos(angle) * old_b
    z[:], w[:] = parts[2], parts[5]
    return nodes


def grid_view(flat: Floats, model: Model) -> Floats:
    """Return a flat array of the nodes as a view of shape (n1+1, n2), without the copied columns; not of the axisymmetric."""
    return flat.reshape(model.n1 + 1, model.stride)[:, PAD : PAD + model.n2]


def meridian_view(nodes: Nodes, model: Model) -> Nodes:
    """Return the nodes of the axisymmetric shell as views of shape (n1+1,), without what fills the last vector."""
    return Nodes(*(part[: model.n1 + 1] for part in nodes))


def initial_energy(case: Case, model: Model) -> float:
    """Return kinetic plus potential energy (J) at the start, heights counted from the ground."""
    heights, _ = places(case)
    mass = model.n2 * model.mass
    mass[-1] += model.cargo_mass
    return float(model.hoop.whole * (0.5 * mass[1:].sum() * case.cargo.velocity**2 + case.gravity * (mass @ heights)))


def _by_row(model: Model) -> ByRow:
    return ByRow(*(np.zeros(model.n1 + 1) for _ in ByRow._fields))


def _lanes(columns: int) -> int:
    """Columns rounded up to whole cache lines, over which the kernels loop."""
    return -(-columns // PAD) * PAD


def _rows(count: int, stride: int, fields: Sequence[str], first: int = 0) -> list[Floats]:
    """An array of zeros for each field, of which the value at `first` starts a cache line; all of one block, which is cheaper."""
    size = count * stride
    pitch = PAD * (2 + size // PAD)  # a line between two, else long arrays might share their places in the cache
    block = np.zeros((len(fields) + 1) * pitch)
    start = (-block.ctypes.data // block.itemsize - first) % PAD
    return [block[at : at + size] for at in range(start, start + len(fields) * pitch, pitch)]


def _overlap(along: float, width: float, n1: int, cell: float) -> Floats:
    """Width (m) of a belt within each row's share of the generatrix; slivers, as of a rounded width, go to the other rows.

    along: middle of the belt, m of cloth from the lower cover; cell: m of cloth from row to row.
    """
    middle = np.arange(n1 + 1) * cell
    lower = np.maximum(middle - 0.5 * cell, along - 0.5 * width)
    upper = np.minimum(middle + 0.5 * cell, along + 0.5 * width)
    shared: Floats = np.maximum(upper - lower, 0.0)
    shared[shared < SLIVER * shared.max()] = 0.0
    return shared * (width / float(shared.sum()))


def _belt_contact(belt_width: Floats) -> BeltContact:
    """Rows next to each belt, below and above; a belt next to a held row has no free rows on that side: left out."""
    carries = np.diff((belt_width > 0.0).astype(np.int64))
    below, above = np.flatnonzero(carries == 1), np.flatnonzero(carries == -1) + 1
    free = (below > 0) & (above < len(belt_width) - 1)
    return BeltContact(below[free], above[free])
