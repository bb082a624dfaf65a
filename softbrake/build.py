"""Case -> Model, State, Sweep: the one place that allocates their arrays."""

from math import inf, pi, sin

import numpy as np

from softbrake.case import Case
from softbrake.state import (
    PAD,
    Belts,
    ByColumn,
    Cells,
    Contact,
    Edges,
    Fabric,
    Floats,
    FoldCount,
    Folds,
    FoldTravel,
    History,
    Ints,
    Model,
    Nodes,
    Peak,
    Pressure,
    PressureLaw,
    Rows,
    Scheme,
    State,
    Sweep,
    Top,
    Work,
)

PAIRS_PER_NODE = 5  # near one another, of folds
SLIVER = 1e-3  # least part of a belt that a row carries, of what the row with most of it does


def build_model(case: Case) -> Model:
    """Return the constants of a case on its grid.

    The unloaded shell is the prism through n2 columns of the cylinder, so its cloth is unstretched at the start. A node has
    the mass of the cloth halfway to its neighbours, and of the belts there; a belt is shared by the rows in proportion to the
    part of its width that lies in each one's half cells.
    """
    n1, n2 = case.grid.generatrix, case.grid.hoop
    radius = 0.5 * case.shell.diameter
    h1 = case.shell.height / n1
    h2 = 2.0 * radius * sin(pi / n2)
    cloth = case.fabric
    contraction = 1.0 - cloth.nu12 * cloth.nu21
    true_tension = cloth.law == "true_tension"
    fabric = Fabric(
        h1=h1,
        h2=h2,
        c11=cloth.E11 / contraction,
        c22=cloth.E22 / contraction,
        c12=cloth.nu21 * cloth.E22 / contraction,
        c21=cloth.nu12 * cloth.E11 / contraction,
        g12=cloth.G12,
        viscosity=cloth.viscosity,
        floor=0.0 if cloth.slack == "cut" else -inf,
        true_tension=float(true_tension),
    )
    share = np.full(n1 + 1, h1)
    share[[0, -1]] *= 0.5
    line_mass = cloth.areal_density * share
    belts = Belts(*(np.zeros(n1 + 1) for _ in Belts._fields))
    # N22 feels e11, but T11 nothing of the belt: a potential does not allow that, so the nominal law makes it a plain filament.
    coupling = fabric.c21 if true_tension else 0.0
    for belt in case.belts:
        width = _overlap(belt.height, belt.width, n1, h1)
        part = width / belt.width
        line_mass += belt.line_density * part
        belts.width[:] += width
        belts.stiffness[:] += belt.stiffness / (contraction if true_tension else 1.0) * part
        belts.coupling[:] += coupling * width
        belts.viscosity[:] += cloth.viscosity * width
    grooves = _grooves(belts.width) if "belts" in case.contact else np.zeros((0, 2), np.int64)
    law = case.pressure
    most_pressure = max(law.value, *law.values, 0.0)
    return Model(
        n1=n1,
        n2=n2,
        stride=PAD + -(-(n2 + 1) // PAD) * PAD,
        scheme=int(Scheme[case.model.scheme.upper()]),
        courant=case.time.courant,
        end=case.time.end,
        gravity=case.gravity,
        cargo_mass=case.cargo.mass,
        cover_area=0.5 * n2 * radius * radius * sin(2.0 * pi / n2),
        most_gas_work=most_pressure * pi * case.shell.diameter**2 * case.shell.height,
        mass=line_mass * h2,
        fabric=fabric,
        belts=belts,
        pressure=Pressure(
            law=int(PressureLaw[law.law.upper()]),
            value=law.value,
            peak_time=law.peak_time,
            end_time=law.end_time,
            times=np.array(law.times, float),
            values=np.array(law.values, float),
            damping=law.damping,
            most=most_pressure,
        ),
        contact=Contact(
            ground=0.0 if "ground" in case.contact else -inf,
            friction=case.friction,
            below=grooves[:, 0].copy(),
            above=grooves[:, 1].copy(),
            cover=int("cover" in case.contact),
            cover_radius=radius,
            cargo=int("cargo" in case.contact),
            cargo_radius=0.5 * case.cargo.diameter,
            cargo_height=inf if case.cargo.height is None else case.cargo.height,
            folds=int("folds" in case.contact),
        ),
    )


def build_state(case: Case, model: Model) -> State:
    """Return the state at first contact: unloaded shell, all of it falling with the cargo but the row on the ground."""
    angle = 2.0 * pi * (np.arange(model.stride) - PAD) / model.n2
    radius = 0.5 * case.shell.diameter
    nodes = Nodes(*_rows(model.n1 + 1, model.stride, Nodes._fields))
    height = np.linspace(0.0, case.shell.height, model.n1 + 1)[:, None]
    nodes.x.reshape(-1, model.stride)[:] = radius * np.cos(angle)
    nodes.y.reshape(-1, model.stride)[:] = radius * np.sin(angle)
    nodes.z.reshape(-1, model.stride)[:] = height
    nodes.w.reshape(-1, model.stride)[:] = np.where(height > 0.0, -case.cargo.velocity, 0.0)
    now = np.zeros(len(History))
    now[History.HEIGHT] = case.shell.height
    now[History.VELOCITY] = -case.cargo.velocity
    moving = model.cargo_mass + model.n2 * model.mass[1:].sum()
    now[History.KINETIC_ENERGY] = 0.5 * moving * case.cargo.velocity**2
    return State(
        nodes=nodes,
        now=now,
        steps=np.zeros(1, np.int64),
        stable_step=np.zeros(1),
        last_step=np.zeros(1),
        kinetic_start=np.array([now[History.KINETIC_ENERGY]]),
        peaks=np.zeros((len(Peak), 3)),
        work=Work(*(np.zeros(model.n2) for _ in Work._fields)),
        folds=build_folds(nodes.x.size if model.contact.folds else 1, min(model.fabric.h1, model.fabric.h2)),
    )


def build_folds(nodes: int, edge: float) -> Folds:
    """Return the arrays of the contact of folds, for so many nodes, of cells with an edge (m)."""
    travel = np.zeros(len(FoldTravel))
    travel[FoldTravel.SEARCHED], travel[FoldTravel.MARGIN] = -inf, edge
    return Folds(
        pairs=np.zeros(PAIRS_PER_NODE * nodes, np.int64),
        wake=np.zeros(PAIRS_PER_NODE * nodes),
        head=np.zeros(1 << (nodes - 1).bit_length(), np.int64),
        following=np.zeros(nodes, np.int64),
        stamp=np.zeros(nodes, np.int64),
        counts=np.zeros(len(FoldCount), np.int64),
        travel=travel,
        penetration=np.zeros(1),
        impulse=np.zeros(2),
    )


def build_sweep(model: Model) -> Sweep:
    """Return the scratch arrays of a step."""
    n2, stride = model.n2, model.stride
    return Sweep(
        generatrix=Edges(*_rows(2, stride, Edges._fields)),
        hoop=Edges(*_rows(3, stride, Edges._fields)),
        belt=Edges(*_rows(1, stride, Edges._fields)),
        cells=Cells(*_rows(2, stride, Cells._fields)),
        force=Rows(*_rows(1, stride, Rows._fields)),
        force_above=Rows(*_rows(1, stride, Rows._fields)),
        area=Rows(*_rows(1, stride, Rows._fields)),
        area_above=Rows(*_rows(1, stride, Rows._fields)),
        mean=Rows(*_rows(2, stride, Rows._fields)),
        pressure=np.zeros(n2),
        top_generatrix=Top(np.zeros(n2), np.zeros(n2)),
        top_hoop=Top(np.zeros(n2), np.zeros(n2)),
        top_belt=Top(np.zeros(n2), np.zeros(n2)),
        by_column=ByColumn(*(np.zeros(n2) for _ in ByColumn._fields)),
    )


def grid_view(flat: Floats, model: Model) -> Floats:
    """Return a flat array of the nodes as a view of shape (n1+1, n2), without the copied columns."""
    return flat.reshape(model.n1 + 1, model.stride)[:, PAD : PAD + model.n2]


def initial_energy(case: Case, model: Model) -> float:
    """Return kinetic plus potential energy (J) at the start, heights counted from the ground."""
    heights = np.linspace(0.0, case.shell.height, model.n1 + 1)
    mass = model.n2 * model.mass
    mass[-1] += model.cargo_mass
    return float(0.5 * mass[1:].sum() * case.cargo.velocity**2 + case.gravity * (mass @ heights))


def _rows(count: int, stride: int, fields: tuple[str, ...]) -> list[Floats]:
    return [_aligned(count * stride) for _ in fields]


def _aligned(size: int) -> Floats:
    """Zeros that start on a cache line."""
    block = np.zeros(size + PAD)
    start = -block.ctypes.data // block.itemsize % PAD
    zeros: Floats = block[start : start + size]
    return zeros


def _overlap(height: float, width: float, n1: int, h1: float) -> Floats:
    """Width (m) of a belt within each row's share of the generatrix; slivers, as of a rounded width, go to the other rows."""
    middle = np.arange(n1 + 1) * h1
    lower = np.maximum(middle - 0.5 * h1, height - 0.5 * width)
    upper = np.minimum(middle + 0.5 * h1, height + 0.5 * width)
    shared: Floats = np.maximum(upper - lower, 0.0)
    shared[shared < SLIVER * shared.max()] = 0.0
    return shared * (width / float(shared.sum()))


def _grooves(belt_width: Floats) -> Ints:
    """Rows next to each belt, below and above, (belts, 2); belts next to a held row have no free rows on that side: left out."""
    carries = np.diff((belt_width > 0.0).astype(np.int64))
    rows = np.stack((np.flatnonzero(carries == 1), np.flatnonzero(carries == -1) + 1), axis=1)
    grooves: Ints = rows[(rows[:, 0] > 0) & (rows[:, 1] < len(belt_width) - 1)]
    return grooves
