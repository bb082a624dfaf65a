"""Slow, obvious twins of the kernels, written from the equations of the paper.

A field of vectors at the nodes has shape (n1+1, n2, 3), rows from the ground up; the hoop closes on itself. A force that
several parts of the model share is kept apart by part, so that the work of each is force times displacement.
"""

from math import cos, pi, sin, sqrt
from typing import NamedTuple

import numpy as np

from softbrake.core.arrays import Floats, GasPressure, Law, Membrane, Model, PressureLaw, Scheme
from softbrake.core.columns import History

Forces = dict[History, Floats]  # N, on the nodes, by the work they do


def right(values: Floats) -> Floats:
    """At column j, the value of column j + 1."""
    return values[:, (np.arange(values.shape[1]) + 1) % values.shape[1]]


def left(values: Floats) -> Floats:
    """At column j, the value of column j - 1."""
    return values[:, (np.arange(values.shape[1]) - 1) % values.shape[1]]


def dot(a: Floats, b: Floats) -> Floats:
    return np.sum(a * b, axis=-1)


def length(vectors: Floats) -> Floats:
    return np.sqrt(dot(vectors, vectors))


# Geometry: section 3


class Grid(NamedTuple):
    """Differences of a field along the edges."""

    along_1: Floats  # (n1, n2, 3), from row i to i + 1
    along_2: Floats  # (n1+1, n2, 3), from column j to j + 1


def differences(field: Floats) -> Grid:
    return Grid(field[1:] - field[:-1], right(field) - field)


class Stretches(NamedTuple):
    """Elongations and their rates (1/s) of the edges of both directions."""

    e1: Floats
    e2: Floats
    rate_1: Floats
    rate_2: Floats


def stretches(fabric: Membrane, x: Floats, v: Floats) -> Stretches:
    """λ - 1 of the first lines of section 3, and its rate: the relative velocity along the edge over the unloaded length."""
    edge, change = differences(x), differences(v)
    return Stretches(
        e1=length(edge.along_1) / fabric.h1 - 1.0,
        e2=length(edge.along_2) / fabric.h2 - 1.0,
        rate_1=dot(edge.along_1, change.along_1) / length(edge.along_1) / fabric.h1,
        rate_2=dot(edge.along_2, change.along_2) / length(edge.along_2) / fabric.h2,
    )


def patch(x: Floats, s: float, t: float) -> tuple[Floats, Floats, list[tuple[Floats, tuple[slice, bool]]]]:
    """Points and normals (per ds dt) of the bilinear patch over each cell, s around the hoop, t upwards.

    The third value holds for each corner its shape function, its rows and whether it stands on the right.
    """
    corners = [
        (x[:-1], (1 - s) * (1 - t), -(1 - t), -(1 - s)),
        (right(x)[:-1], s * (1 - t), 1 - t, -s),
        (x[1:], (1 - s) * t, -t, 1 - s),
        (right(x)[1:], s * t, t, s),
    ]
    point = sum(weight * corner for corner, weight, _, _ in corners)
    along_s = sum(slope * corner for corner, _, slope, _ in corners)
    along_t = sum(slope * corner for corner, _, _, slope in corners)
    places = [(slice(None, -1), False), (slice(None, -1), True), (slice(1, None), False), (slice(1, None), True)]
    shapes = [(corner[1], place) for corner, place in zip(corners, places, strict=True)]
    return point, np.cross(along_s, along_t), shapes


GAUSS = (0.5 - sqrt(1.0 / 12.0), 0.5 + sqrt(1.0 / 12.0))  # exact for cubics: more than a patch needs


def area_vectors(x: Floats) -> Floats:
    """Integral over the wall of a node's bilinear shape function times the outward normal, m^2."""
    area = np.zeros_like(x)
    for s in GAUSS:
        for t in GAUSS:
            _, normal, shapes = patch(x, s, t)
            for weight, (rows, on_the_right) in shapes:
                share = 0.25 * weight * normal
                area[rows] += left(share) if on_the_right else share
    return area


def wall_volume(x: Floats) -> float:
    """Integral of x·n/3 over the wall, m^3: the enclosed volume but for what the covers add."""
    volume = 0.0
    for s in GAUSS:
        for t in GAUSS:
            point, normal, _ = patch(x, s, t)
            volume += 0.25 * float(dot(point, normal).sum()) / 3.0
    return volume


# Fabric and belts: (2.9), (2.3), (2.2), (3.2)


class Tensions(NamedTuple):
    """Tensions (N/m) of one direction: elastic and viscous together, and elastic alone; each as it is after the cut."""

    whole: Floats
    elastic: Floats


def tensions(fabric: Membrane, hooke: Floats, viscous: Floats) -> Tensions:
    least = fabric.floor
    return Tensions(np.maximum(hooke + viscous, least), np.maximum(hooke, least))


def fabric_tensions(fabric: Membrane, e1: Floats, e2: Floats, rate_1: Floats, rate_2: Floats) -> tuple[Tensions, Tensions]:
    """(2.9), or the tension field, of elongations that stand at one place."""
    hooke_1, hooke_2 = fabric.c11 * e1 + fabric.c12 * e2, fabric.c22 * e2 + fabric.c12 * e1
    if fabric.law == Law.TENSION_FIELD:  # wrinkles give way across: the stiffness is that of a strip
        hooke_1 = np.where(hooke_2 < 0.0, fabric.e11 * e1, hooke_1)
        hooke_2 = np.where(fabric.c11 * e1 + fabric.c12 * e2 < 0.0, fabric.e22 * e2, hooke_2)
    return tensions(fabric, hooke_1, fabric.viscosity * rate_1), tensions(fabric, hooke_2, fabric.viscosity * rate_2)


def corner_means(corners: list[Tensions]) -> Tensions:
    return Tensions(sum(one.whole for one in corners) / len(corners), sum(one.elastic for one in corners) / len(corners))


def around_1(e2: Floats) -> Floats:
    """Mean of the four hoop edges around each generatrix edge, (n1, n2)."""
    return (e2[:-1] + left(e2)[:-1] + e2[1:] + left(e2)[1:]) / 4.0


def around_2(e1: Floats) -> Floats:
    """Mean of the four generatrix edges around each hoop edge of the free rows, (n1-1, n2)."""
    return (e1[:-1] + right(e1)[:-1] + e1[1:] + right(e1)[1:]) / 4.0


def edge_tensions(fabric: Membrane, x: Floats, v: Floats) -> tuple[Tensions, Tensions]:
    """T11 of the generatrix edges, T22 of the hoop edges of the free rows; the covers hold the other hoop edges.

    By (2.9) of the mean elongation of the four edges across, in a tension field the mean of the tensions with each of them.
    """
    s = stretches(fabric, x, v)
    none_1, none_2 = 0.0 * s.rate_1, 0.0 * s.rate_2[1:-1]
    if fabric.law == Law.TENSION_FIELD:
        hoops = (s.e2[:-1], left(s.e2)[:-1], s.e2[1:], left(s.e2)[1:])
        generatrices = (s.e1[:-1], right(s.e1)[:-1], s.e1[1:], right(s.e1)[1:])
        return (
            corner_means([fabric_tensions(fabric, s.e1, e2, s.rate_1, none_1)[0] for e2 in hoops]),
            corner_means([fabric_tensions(fabric, e1, s.e2[1:-1], none_2, s.rate_2[1:-1])[1] for e1 in generatrices]),
        )
    generatrix, _ = fabric_tensions(fabric, s.e1, around_1(s.e2), s.rate_1, none_1)
    _, hoop = fabric_tensions(fabric, around_2(s.e1), s.e2[1:-1], none_2, s.rate_2[1:-1])
    return generatrix, hoop


def cell_means(x: Floats, v: Floats, fabric: Membrane) -> Stretches:
    """Stretches and rates at the cell centres, (n1, n2): means of two edges. Section 3."""
    s = stretches(fabric, x, v)
    return Stretches(
        e1=(s.e1 + right(s.e1)) / 2.0,
        e2=(s.e2[:-1] + s.e2[1:]) / 2.0,
        rate_1=(s.rate_1 + right(s.rate_1)) / 2.0,
        rate_2=(s.rate_2[:-1] + s.rate_2[1:]) / 2.0,
    )


def cell_tensions(fabric: Membrane, x: Floats, v: Floats) -> tuple[Tensions, Tensions]:
    """T11 and T22 at the cell centres, as (3.2) is printed."""
    return fabric_tensions(fabric, *cell_means(x, v, fabric))


BELOW, ABOVE = slice(None, -1), slice(1, None)  # the rows at the lower and upper ends of edges or cells
FREE = slice(1, -1)


def edge_forces(fabric: Membrane, x: Floats, v: Floats) -> tuple[Floats, Floats]:
    """Forces of the fabric on the nodes, N: of generatrix and hoop edges, whole tensions; second value: elastic ones."""
    edge, s = differences(x), stretches(fabric, x, v)
    generatrix, hoop = edge_tensions(fabric, x, v)
    width_1 = fabric.h2 * (1.0 + fabric.true_tension * around_1(s.e2))
    width_2 = fabric.h1 * (1.0 + fabric.true_tension * around_2(s.e1))
    direction_1 = edge.along_1 / length(edge.along_1)[..., None]
    direction_2 = (edge.along_2 / length(edge.along_2)[..., None])[FREE]
    results = []
    for t1, t2 in ((generatrix.whole, hoop.whole), (generatrix.elastic, hoop.elastic)):
        forces = np.zeros_like(x)
        upwards = (t1 * width_1)[..., None] * direction_1
        forces[BELOW] += upwards
        forces[ABOVE] -= upwards
        along = (t2 * width_2)[..., None] * direction_2
        forces[FREE] += along - left(along)
        results.append(forces)
    return results[0], results[1]


def cell_directions(fabric: Membrane, x: Floats) -> tuple[Floats, Floats]:
    """Mean edge vectors over unloaded length at the cell centres: λ l of (3.2), r1 and r2 of (2.6)."""
    edge = differences(x)
    r1 = (edge.along_1 + right(edge.along_1)) / 2.0 / fabric.h1
    r2 = (edge.along_2[BELOW] + edge.along_2[ABOVE]) / 2.0 / fabric.h2
    return r1, r2


def difference_on_corners(across_1: Floats, across_2: Floats, fabric: Membrane, shape: tuple[int, ...]) -> Floats:
    """h1 h2 times the differences over cell centres of (3.2) of resultants (N/m) across both directions, N."""
    forces = np.zeros(shape)
    half_1, half_2 = across_1 * fabric.h2 / 2.0, across_2 * fabric.h1 / 2.0
    forces[BELOW] += half_1 + left(half_1)
    forces[ABOVE] -= half_1 + left(half_1)
    forces[BELOW] += half_2 - left(half_2)
    forces[ABOVE] += half_2 - left(half_2)
    return forces


def cell_forces(fabric: Membrane, x: Floats, v: Floats) -> tuple[Floats, Floats]:
    """As edge_forces, by (3.2) as printed: (T11 λ2) l1 and (T22 λ1) l2 at the cell centres."""
    s = cell_means(x, v, fabric)
    r1, r2 = cell_directions(fabric, x)
    l1, l2 = r1 / (1.0 + s.e1)[..., None], r2 / (1.0 + s.e2)[..., None]
    wide_1, wide_2 = 1.0 + fabric.true_tension * s.e1, 1.0 + fabric.true_tension * s.e2
    generatrix, hoop = cell_tensions(fabric, x, v)
    results = []
    for t1, t2 in ((generatrix.whole, hoop.whole), (generatrix.elastic, hoop.elastic)):
        resultants = (t1 * wide_2)[..., None] * l1, (t2 * wide_1)[..., None] * l2
        results.append(difference_on_corners(*resultants, fabric, x.shape))
    return results[0], results[1]


def field_tensions(fabric: Membrane, e1: Floats, e2: Floats) -> tuple[Floats, Floats]:
    """Elastic tensions of the tension field."""
    generatrix, hoop = fabric_tensions(fabric, e1, e2, 0.0 * e1, 0.0 * e2)
    return generatrix.elastic, hoop.elastic


def diagonal_wrinkle(fabric: Membrane, E1: Floats, E2: Floats, sine: Floats) -> Floats:
    """Amplitude b of wrinkles along the shortened diagonal, where T1 + T2 rise to twice T12, by bisection; 0 where above."""
    low, high = 0.0 * sine, 0.5 * sine
    for _ in range(80):
        b = 0.5 * (low + high)
        short = sum(field_tensions(fabric, E1 + b, E2 + b)) < 2.0 * fabric.g12 * (sine - 2.0 * b)
        low, high = np.where(short, b, low), np.where(short, high, b)
    return high


def shear_forces(fabric: Membrane, x: Floats) -> Floats:
    """Forces of T12 = T21 with the energy 1/2 G12 (r1 r2)^2 per unloaded area: resultants G12 (r1 r2) r2 and … r1.

    In a tension field that of r1 r2 less 2 b, and what b adds to both strains: resultants (T1(E + b) - T1(E)) r1 and so on.
    """
    r1, r2 = cell_directions(fabric, x)
    sine = dot(r1, r2)
    along_1, along_2 = 0.0 * r1, 0.0 * r2
    if fabric.law == Law.TENSION_FIELD:
        E1, E2 = 0.5 * (dot(r1, r1) - 1.0), 0.5 * (dot(r2, r2) - 1.0)
        b = diagonal_wrinkle(fabric, E1, E2, np.abs(sine))
        sine = sine - 2.0 * b * np.sign(sine)
        raised, plain = field_tensions(fabric, E1 + b, E2 + b), field_tensions(fabric, E1, E2)
        along_1, along_2 = (raised[0] - plain[0])[..., None] * r1, (raised[1] - plain[1])[..., None] * r2
    shear = fabric.g12 * sine[..., None]
    return difference_on_corners(shear * r2 + along_1, shear * r1 + along_2, fabric, x.shape)


def belt_loads(model: Model, x: Floats, v: Floats) -> Tensions:
    """Loads (N) of the belts on the hoop edges of the free rows, (n1-1, n2); zero where a row has no belt. (2.3)"""
    s = stretches(model.fabric, x, v)
    stiffness, coupling, viscosity = (part[FREE, None] for part in model.belts[1:])
    hooke = stiffness * s.e2[FREE] + coupling * around_2(s.e1)
    return Tensions(np.maximum(hooke + viscosity * s.rate_2[FREE], 0.0), np.maximum(hooke, 0.0))


def belt_forces(model: Model, x: Floats, v: Floats) -> tuple[Floats, Floats]:
    """As edge_forces."""
    edge = differences(x).along_2[FREE]
    results = []
    for load in belt_loads(model, x, v):
        forces = np.zeros_like(x)
        along = load[..., None] * edge / length(edge)[..., None]
        forces[FREE] = along - left(along)
        results.append(forces)
    return results[0], results[1]


# Pressure: (2.10), (2.11)


def pressure_at(law: GasPressure, time: float) -> float:
    """p~ in Pa."""
    if law.law == PressureLaw.CONSTANT:
        return law.value
    if law.law == PressureLaw.TABLE:
        return float(np.interp(time, law.times, law.values))
    if time > law.end_time:
        return 0.0
    if time > law.peak_time:
        return law.value * cos(pi / 2.0 * (time - law.peak_time) / (law.end_time - law.peak_time))
    return law.value * sin(pi / 2.0 * time / law.peak_time)


def pressure_of_step(law: GasPressure, time: float, start: float, end: float) -> float:
    """p~ in Pa that acts at a time: of a table its mean from start to end, by trapezia between its knots."""
    if law.law != PressureLaw.TABLE:
        return pressure_at(law, time)
    knots = np.array([start, *(t for t in law.times if start < t < end), end])
    values = [pressure_at(law, t) for t in knots]
    return float(np.trapezoid(values, knots)) / (end - start)


def damped_pressure(law: GasPressure, uniform: float, v: Floats, area: Floats) -> Floats:
    """p of (2.11) at the nodes, Pa: V^n is the velocity along the outward normal."""
    relative = 1.0 - law.damping * dot(v, area) / length(area)
    return uniform * relative**2 * np.sign(relative)


# The step: (2.4), (3.2), (3.4)


class Step(NamedTuple):
    """What a step gives: new fields, `now` as recorded for its start, works (J), peaks as (value, row)."""

    x: Floats
    v: Floats
    now: dict[History, float]
    work: dict[History, float]
    top: dict[History, tuple[float, float]]


def node_mass(model: Model) -> Floats:
    """(n1+1, 1), kg; without the cargo"""
    return model.mass[:, None]


def kinetic_energy(model: Model, v: Floats) -> float:
    """Of shell and cargo, J."""
    return model.hoop.whole * float((0.5 * node_mass(model) * dot(v, v)).sum() + 0.5 * model.cargo_mass * v[-1, 0, 2] ** 2)


def top_tensions(model: Model, x: Floats, v: Floats) -> dict[History, tuple[float, float]]:
    """Largest tension (N/m) and its row, of the fabric and of the belts over their width; 0 where all is slack."""
    rows = np.arange(model.n1 + 1.0)
    centres = rows[:-1] + 0.5
    belted = model.belts.width[FREE] > 0.0
    over_width = belt_loads(model, x, v).whole[belted] / model.belts.width[FREE][belted, None]
    if model.scheme == Scheme.EDGE:
        (generatrix, hoop), hoop_rows = edge_tensions(model.fabric, x, v), rows[FREE]
    else:
        (generatrix, hoop), hoop_rows = cell_tensions(model.fabric, x, v), centres
    found = {}
    sheared = sheared_tensions(model.fabric, x)
    for which, tension, where in (
        (History.TENSION_GENERATRIX, generatrix.whole, centres),
        (History.TENSION_HOOP, hoop.whole, hoop_rows),
        (History.TENSION_BELT, over_width, rows[FREE][belted]),
    ):
        value = tension.max(initial=0.0)
        found[which] = (float(value), float(where[tension.max(axis=1).argmax()]) if value > 0.0 else 0.0)
    for which, tension in zip((History.TENSION_GENERATRIX, History.TENSION_HOOP), sheared, strict=True):
        if tension.max() > found[which][0]:
            found[which] = (float(tension.max()), float(centres[tension.max(axis=1).argmax()]))
    return found


def sheared_tensions(fabric: Membrane, x: Floats) -> tuple[Floats, Floats]:
    """Tensions of the cells whose diagonal wrinkles shear straightens, 0 of others."""
    r1, r2 = cell_directions(fabric, x)
    E1, E2, sine = 0.5 * (dot(r1, r1) - 1.0), 0.5 * (dot(r2, r2) - 1.0), np.abs(dot(r1, r2))
    if fabric.law != Law.TENSION_FIELD or fabric.g12 == 0.0:
        return 0.0 * sine, 0.0 * sine
    b = diagonal_wrinkle(fabric, E1, E2, sine)
    some = sum(field_tensions(fabric, E1, E2)) < 2.0 * fabric.g12 * sine
    one, two = field_tensions(fabric, E1 + b, E2 + b)
    return np.where(some, one, 0.0), np.where(some, two, 0.0)


def forces_of(model: Model, x: Floats, v: Floats, uniform: float) -> Forces:
    """Forces on the nodes, N, without those of the covers; uniform: p~, Pa."""
    area = area_vectors(x)
    pressure = damped_pressure(model.pressure, uniform, v, area)
    whole, elastic = (edge_forces if model.scheme == Scheme.EDGE else cell_forces)(model.fabric, x, v)
    belt_whole, belt_elastic = belt_forces(model, x, v)
    weight = np.zeros_like(x)
    weight[..., 2] = -node_mass(model) * model.gravity
    return {
        History.WORK_PRESSURE: model.hoop.gas * pressure[..., None] * area,
        History.WORK_ELASTIC: elastic + shear_forces(model.fabric, x),
        History.WORK_VISCOUS: (whole - elastic) + (belt_whole - belt_elastic),
        History.WORK_BELTS: belt_elastic,
        History.WORK_GRAVITY: weight,
    }


def lying_area(model: Model, x: Floats, forces: Forces) -> float:
    """Area of cloth on the ground, m^2: of each free node the part of its load that the ground bears."""
    facing = -model.hoop.gas * np.minimum(area_vectors(x)[..., 2], 0.0)
    load = np.where(facing > 0.0, -forces[History.WORK_PRESSURE][..., 2], 0.0) - forces[History.WORK_GRAVITY][..., 2]
    share = np.minimum(forces[History.WORK_GROUND][..., 2] / np.maximum(load, 1e-30), 1.0)
    return float(facing[0].sum() + (facing * share)[FREE].sum())


def step(model: Model, x: Floats, v: Floats, time: float, dt: float, step: float) -> Step:
    """x: places at n, v: velocities at n-1/2; dt: from n-1/2 to n+1/2; step: from n to n+1."""
    uniform = pressure_of_step(model.pressure, time, time - (dt - 0.5 * step), time + 0.5 * step)
    forces = forces_of(model, x, v, uniform)
    on_cover = uniform * model.cover_area
    total = sum(forces.values())

    new = v + dt * total / node_mass(model)[..., None]
    new[0] = 0.0
    moving, copies = model.cargo_mass + model.n2 * model.mass[-1], model.hoop.whole
    ground_impulse = on_cover + float((total - forces[History.WORK_GRAVITY])[-1, :, 2].sum())
    acceleration = ground_impulse / moving - model.gravity  # (2.4)
    new[-1] = v[-1] + dt * np.array([0.0, 0.0, acceleration])

    free = new.copy()
    through = x[FREE, :, 2] + step * new[FREE, :, 2] < 0.0
    new[FREE, :, 2] = np.where(through, -x[FREE, :, 2] / step, new[FREE, :, 2])
    forces[History.WORK_GROUND] = node_mass(model)[..., None] * (new - free) / dt
    places = x + step * new
    places[FREE, :, 2] = np.where(through, 0.0, places[FREE, :, 2])

    mean = (v + new) / 2.0
    work = {name: dt * float(dot(force, mean).sum()) for name, force in forces.items()}
    work[History.WORK_PRESSURE] += dt * on_cover * mean[-1, 0, 2]
    work[History.WORK_GRAVITY] -= dt * model.cargo_mass * model.gravity * mean[-1, 0, 2]
    work = {name: copies * value for name, value in work.items()}
    top = top_tensions(model, x, v)
    now = {
        History.TIME: time,
        History.TIME_STEP: step,
        History.HEIGHT: float(x[-1, 0, 2]),
        History.VELOCITY: float(v[-1, 0, 2]) + (dt - 0.5 * step) * acceleration,
        History.ACCELERATION: acceleration,
        History.PRESSURE: uniform,
        History.COVER_FORCE: copies * ground_impulse,
        History.GROUND_AREA: copies * (model.cover_area + lying_area(model, x, forces)),
        History.GROUND_FORCE: copies
        * (on_cover - float(total[0, :, 2].sum()) + float(forces[History.WORK_GROUND][..., 2].sum())),
        **{which: value for which, (value, _) in top.items()},
    }
    return Step(places, new, now, work, top)


# Stable step: (3.3)


def weights(model: Model, belts: float = 0.0) -> Floats:
    """Of the rows: one after three power iterations of a chain whose edges are all as stiff, signs dropped; 0 where held.

    belts: stiffness (N) of those edges, four times, where belts hold the rows as well."""
    inverse = 1.0 / model.mass[1:-1]
    held = 4.0 * inverse * model.belts.stiffness[1:-1] / belts if belts else 0.0 * inverse
    chain = np.diag(2.0 * inverse + held) + np.diag(inverse[1:], 1) + np.diag(inverse[:-1], -1)
    found = np.linalg.matrix_power(chain / inverse.max(), 3) @ np.ones(len(inverse))
    return np.concatenate(([0.0], found, [0.0]))


def shares(model: Model, weight: Floats, i: int) -> float:
    """Sum (1/kg) of 1/m of row i and of that of each row next to it, weighed; nothing of held rows."""
    return sum(1.0 / model.mass[i] + weight[k] / (weight[i] * model.mass[k]) for k in (i - 1, i + 1))


def stable_step(model: Model, x: Floats) -> float:
    """The bound of kernels/timestep.py, s: each wave by the edges that hold it, by the largest stretches of its row."""
    fabric, belts, n1 = model.fabric, model.belts, model.n1
    s, edge = stretches(fabric, x, np.zeros_like(x)), differences(x)
    e1 = np.maximum(s.e1.max(axis=1), 0.0)  # of the edges above each row
    e2 = np.maximum(s.e2.max(axis=1), 0.0)
    e2[[0, n1]] = 0.0
    unit_1, unit_2 = (
        np.where(taut[..., None], vectors / length(vectors)[..., None], 0.0)
        for vectors, taut in ((edge.along_1, s.e1 > -0.02), (edge.along_2, s.e2 > -0.02))
    )
    true, least, p = fabric.true_tension, np.inf, model.hoop.gas * model.pressure.most
    weight, by_belts = weights(model), weights(model, fabric.c22 * fabric.h1)
    for i in range(1, n1):
        corners = [dot(g[k], h) for k in (i - 1, i) for g in (unit_1,) for h in (unit_2[i], left(unit_2)[i])]
        skew = float(np.max(np.square(corners)))
        mass = model.mass[i]
        around, across = 4.0 / mass, {}
        stiff_1 = damper_1 = pull_1 = 0.0
        both, shared = shares(model, weight, i), around if model.scheme == Scheme.EDGE else shares(model, by_belts, i)
        for k, other in ((i - 1, i - 1), (i, i + 1)):  # edge below, edge above, and the row at its other end
            between = 1.0 / mass + weight[other] / (weight[i] * model.mass[other])
            across[k] = 0.5 * (e2[k] + e2[k + 1])
            width = fabric.h2 * (1.0 + true * across[k])
            stiff_1 += between * fabric.c11 * width / fabric.h1
            damper_1 += between * fabric.viscosity * width / fabric.h1
            pull_1 += 2.0 / mass * max(fabric.c11 * e1[k] + fabric.c12 * across[k], 0.0) * width / (fabric.h1 * (1.0 + e1[k]))
        longer = max(e1[i - 1], e1[i])
        width = fabric.h1 * (1.0 + true * 0.5 * (e1[i - 1] + e1[i]))
        load = max(fabric.c22 * e2[i] + fabric.c12 * longer, 0.0) * width + belts.stiffness[i] * e2[i]
        stiff_2 = (shared * fabric.c22 * width + around * belts.stiffness[i]) / fabric.h2
        damper_2 = (shared * fabric.viscosity * width + around * belts.viscosity[i]) / fabric.h2
        pull_2 = around * load / (fabric.h2 * (1.0 + e2[i]))

        def joined(one: float, other: float, cosine: float = sqrt(skew)) -> float:
            n, m = np.array([1.0, 0.0]), np.array([cosine, sqrt(1.0 - min(cosine**2, 1.0))])
            return float(np.linalg.eigvalsh(one * np.outer(n, n) + other * np.outer(m, m)).max())

        shear_1 = both * fabric.g12 * (1.0 + longer) ** 2 * fabric.h1 / fabric.h2
        shear_2 = both * fabric.g12 * (1.0 + e2[i]) ** 2 * fabric.h2 / fabric.h1
        if model.scheme == Scheme.EDGE:
            wide_1, wide_2 = 1.0 + true * longer, 1.0 + true * e2[i]
            by_e2 = fabric.c12 * wide_2 + true * (fabric.c11 * longer + fabric.c12 * e2[i])
            by_e1 = fabric.c12 * wide_1 + true * (fabric.c22 * e2[i] + fabric.c12 * longer)
            crossed = max(stiff_1, stiff_2) * sqrt(by_e2 * by_e1 / (fabric.c11 * wide_2 * fabric.c22 * wide_1))
            coupled = shear_1 + shear_2 + crossed
            stiff_1 += max(around / both - 1.0, 0.0) * (shear_1 + crossed)
            fast = max(stiff_1, stiff_2)
            square = pull_1 + pull_2 + joined(max(stiff_1 - pull_1, 0.0), max(stiff_2 - pull_2, 0.0))
            square += max(coupled - fast, 0.0) ** 2 / (4.0 * max(coupled, fast))
            square = max(square, shear_1 + pull_2, shear_2 + pull_1)
        else:
            square = max(joined(stiff_1, stiff_2), pull_1 + pull_2, shear_1, shear_2)
        length_1, length_2 = fabric.h1 * (1.0 + longer), fabric.h2 * (1.0 + e2[i])
        frequency = sqrt(square + p * (length_1 + length_2) / mass)
        damping = joined(damper_1, damper_2) + 2.0 * model.pressure.damping * p * length_1 * length_2 / mass
        xi = damping / (2.0 * frequency)
        least = min(least, 2.0 / frequency * (sqrt(1.0 + xi * xi) - xi))
    return least


# Fields for pictures


def sampled_fields(model: Model, x: Floats, v: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """λ1, λ2, T11, T22 at the nodes, each (n1+1, n2)."""
    n1, fabric = model.n1, model.fabric
    s = stretches(fabric, x, v)
    around = [[k for k in (i - 1, i) if 0 <= k < n1] for i in range(n1 + 1)]  # the rows of edges or cells next to row i

    def at_nodes(values: Floats) -> Floats:
        return np.array([values[rows].mean(axis=0) for rows in around])

    stretch_1 = 1.0 + at_nodes(s.e1)
    stretch_2 = 1.0 + (left(s.e2) + s.e2) / 2.0
    if model.scheme == Scheme.CELL:
        generatrix, hoop = (tension.whole for tension in cell_tensions(fabric, x, v))
        return stretch_1, stretch_2, at_nodes((left(generatrix) + generatrix) / 2), at_nodes((left(hoop) + hoop) / 2)
    generatrix, hoop = (tension.whole for tension in edge_tensions(fabric, x, v))
    tension_2 = np.zeros_like(stretch_2)
    tension_2[FREE] = (left(hoop) + hoop) / 2.0
    return stretch_1, stretch_2, at_nodes(generatrix), tension_2
