"""One step of the axisymmetric shell, and its loop over steps: the limit of step.py's rows for columns that are all alike.

Node i = 0 … n1 stands at radius x and height z, edge i between nodes i and i+1; all loops run along the generatrix. The column
stands for a wedge of circles of the angle `side`, whose hoops pull a node inwards by `side` times their force. Equations as in
step.py. Loops of a step take whole vectors, see core.lanes. Beyond the free nodes they reach the row on the cover, which has no
mass there and moves on its own, and then copies of that row, whose edges have no length and are slack.
"""

from math import inf, sqrt

from numba import uint64

from softbrake.core.arrays import GasState, Law, Outcome, Peak
from softbrake.core.cargo import push_cargo
from softbrake.core.columns import History
from softbrake.core.contact.belt_contact import resolve_belt_contact_of_meridian
from softbrake.core.contact.obstacles import (
    add_free_area,
    allowed_place,
    change_velocity,
    foresee,
    heights_below,
    least_radius,
    lying_area,
    may_touch,
    reaches_up,
    slowed,
)
from softbrake.core.contact.self_contact import overflown, resolve_self_contact_of_meridian, watch_meridian, window_of
from softbrake.core.gas import limit_with_gas
from softbrake.core.jit import kernel
from softbrake.core.lanes import FIRST, ONE, lanes, sum_of
from softbrake.core.loop.ledger import record_history
from softbrake.core.loop.step_size import fold_largest, joined, rate_of, waves_along
from softbrake.core.loop.time_loop import begin_step, choose_step, end_step, ran_away
from softbrake.core.membrane.edges import SMALLEST_SQUARE
from softbrake.core.membrane.tension import hooke, mean_of_corners, unilateral
from softbrake.core.peaks import raise_peak
from softbrake.core.pressure import update_damped_pressure
from softbrake.core.shape import cloth_around


@kernel
def take_step_of_meridian(model, state, meridian, dt, length):
    """Advance fabric and cargo by one step. Returns the cover's new height (m) and whether tensions are higher than ever.

    dt: from n-1/2 to n+1/2; length: from n to n+1 (s). The one column moves its share of the cargo; state.now has the whole
    shell's forces.
    """
    n1, fabric, columns = model.n1, model.fabric, model.hoop.whole
    nodes, now, work, mass = state.nodes, state.now, state.work, model.mass
    side = model.shape.side
    pressure = now[History.PRESSURE]
    gas_on_cover = pressure * model.cover_area
    top = uint64(n1)
    old_height, old = nodes.z[top], nodes.w[top]
    step = foresee(now, old, model.gravity, dt, length)

    copy_top(nodes, top)
    update_generatrix(fabric, nodes, meridian, n1)  # (2.6), (2.9)
    pull_hoops(fabric, nodes, meridian, side, n1)  # (2.3), (2.9)
    update_areas(nodes, meridian, side, n1)  # (2.7)
    if model.pressure.damping > 0.0:
        at, count = uint64(0), lanes(n1 + 1)
        update_damped_pressure(model.pressure, pressure, nodes, meridian.area, meridian.pressure, at, count)  # (2.11)
    elif meridian.pressure[0] != pressure:
        for i in range(lanes(n1 + 1)):
            meridian.pressure[i] = pressure
    near = push_meridian(nodes, meridian, work, model.obstacles, step, n1)  # (2.8), (3.2), (3.4)
    nodes.z[top] = old_height  # the push carries it along
    impulse, ground_impulse = resolve_contact_of_meridian(model, state, meridian, step, near)

    below = uint64(n1 - 1)
    pull, elastic = meridian.force[below] * meridian.z[below], meridian.elastic[below] * meridian.z[below]
    gas = meridian.pressure[top] * meridian.area.z[FIRST + top]
    now[History.CONTACT_FORCE] = columns * (impulse / dt)
    now[History.COVER_FORCE] = columns * (gas_on_cover + gas - pull + impulse / dt)
    moving = model.cargo_mass + mass[top]
    velocity, height = push_cargo(now, old, step, columns * moving)  # (2.4)
    mean = 0.5 * (old + velocity)
    nodes.z[top] = height
    nodes.w[top] = velocity
    work.pressure[top] += dt * (gas_on_cover + gas) * mean
    work.elastic[top] -= dt * elastic * mean
    work.viscous[top] -= dt * (pull - elastic) * mean
    work.gravity[top] -= dt * model.gravity * moving * mean
    work.contact[top] += impulse * mean
    on_ground = pressure * model.base_area - meridian.pressure[0] * meridian.area.z[FIRST] - meridian.force[0] * meridian.z[0]
    now[History.GROUND_FORCE] = columns * (on_ground + mass[0] * model.gravity + ground_impulse / dt)
    now[History.GROUND_AREA] = columns * model.base_area
    if model.gas.exponent > 0.0:
        state.gas[GasState.NEXT_VOLUME] = volume_of_meridian(model, nodes, meridian.volume)
    if model.gas.leaks == 1:
        meridian.free[:] = 0.0
        add_free_area(nodes, meridian.area, meridian.free, model.obstacles, step, uint64(1), FIRST + ONE, n1 - 1, 1.0)
        halves = 0.5 * (meridian.free[0] + meridian.free[uint64(n1 - 2)])  # of the cells next to the covers
        state.gas[GasState.FREE_AREA] = columns * (sum_of(meridian.free, n1 - 1) + halves)
    return height, raise_peaks(now, state.peaks, meridian, n1)


@kernel
def copy_top(nodes, top):
    """Copy the places of the row on the cover to what fills the last vector of nodes. Writes nodes."""
    x, z = nodes.x[top], nodes.z[top]
    for i in range(top, top + FIRST):
        nodes.x[i + ONE] = x
        nodes.z[i + ONE] = z


@kernel
def update_generatrix(fabric, nodes, meridian, n1):
    """Update edges and T11 along the generatrix. Eq. (2.6), the tension field at both corners with a hoop, or (2.9).

    By (2.9) the hoop's elongation is the mean of the two nodes'.
    Reads nodes, meridian's lengths. Writes meridian.x, z (m, edge vector), e, tension_1 (N/m), force and elastic (N/m:
    edge force over edge length).
    """
    x, z, u, w = nodes.x, nodes.z, nodes.u, nodes.w
    per_2 = meridian.per_2
    field = fabric.law == Law.TENSION_FIELD
    for i in range(lanes(n1)):
        j = i + ONE
        dx = x[j] - x[i]
        dz = z[j] - z[i]
        square = max(dx * dx + dz * dz, SMALLEST_SQUARE)
        inverse, per_1 = 1.0 / sqrt(square), meridian.per_1[i]
        e = square * inverse * per_1 - 1.0
        viscous = fabric.viscosity * (dx * (u[j] - u[i]) + dz * (w[j] - w[i])) * inverse * per_1
        lower, upper = abs(x[i]) * per_2[i] - 1.0, abs(x[j]) * per_2[j] - 1.0
        per_length = meridian.width_1[i] * inverse
        if field:
            tension, elastic = mean_of_corners(fabric.e11 * e, fabric.c11 * e, fabric.c12 * lower, fabric.c12 * upper, viscous)
        else:
            across = 0.5 * (lower + upper)
            tension, elastic = unilateral(hooke(fabric.c11, e, fabric.c12, across), viscous, fabric.floor)
            per_length *= 1.0 + fabric.true_tension * across
        meridian.x[i] = dx
        meridian.z[i] = dz
        meridian.e[i] = e
        meridian.tension_1[i] = tension
        meridian.force[i] = tension * per_length
        meridian.elastic[i] = elastic * per_length


@kernel
def pull_hoops(fabric, nodes, meridian, side, n1):
    """Update T22 at the nodes and the belts: the tension field at both corners with an edge, or (2.9), and (2.3).

    By (2.9) e11 is the mean of the two edges'. Of a node that has passed the axis the hoop is turned inside out. Reads nodes,
    meridian.e, lengths and belts. Writes meridian.tension_2 (N/m), belt_force, hoop, hoop_elastic and belt_elastic (N).
    """
    x, u, e, belts = nodes.x, nodes.u, meridian.e, meridian.belts
    field = fabric.law == Law.TENSION_FIELD
    for i in range(ONE, ONE + lanes(n1 - 1)):
        sign, per_2 = 1.0 if x[i] >= 0.0 else -1.0, meridian.per_2[i]
        hoop = abs(x[i]) * per_2 - 1.0
        rate = sign * u[i] * per_2
        viscous = fabric.viscosity * rate
        lower, upper, width = e[i - ONE], e[i], meridian.width_2[i]
        e1 = 0.5 * (lower + upper)
        if field:
            c12, own = fabric.c12, fabric.c22 * hoop
            tension, elastic = mean_of_corners(fabric.e22 * hoop, own, c12 * lower, c12 * upper, viscous)
        else:
            tension, elastic = unilateral(hooke(fabric.c22, hoop, fabric.c12, e1), viscous, fabric.floor)
            width *= 1.0 + fabric.true_tension * e1
        stretched = hooke(belts.stiffness[i], hoop, belts.coupling[i], e1)
        belt, belt_elastic = unilateral(stretched, belts.viscosity[i] * rate, 0.0)  # (2.3)
        inwards = side * sign
        meridian.tension_2[i] = tension
        meridian.belt_force[i] = belt
        meridian.hoop[i] = inwards * (tension * width + belt)
        meridian.hoop_elastic[i] = inwards * (elastic * width)
        meridian.belt_elastic[i] = inwards * belt_elastic


@kernel
def update_areas(nodes, meridian, side, n1):
    """Update the area vectors of the nodes. F of section 3, (2.7) for a wedge of circles; side: its angle.

    The gradient of the wedge's volume, side dz (r0² + r0 r1 + r1²)/6 for each edge, which gives the lower node of an edge
    (2 r0 + r1) and the upper one (r0 + 2 r1) times (dz, -dr) side/6. Writes meridian.area (m^2).
    """
    sixth = side / 6.0
    x, dx, dz, area_x, area_z = nodes.x, meridian.x, meridian.z, meridian.area.x, meridian.area.z
    for i in range(ONE, ONE + lanes(n1)):
        lower = sixth * (3.0 * x[i] - dx[i - ONE])
        upper = sixth * (3.0 * x[i] + dx[i])
        area_x[FIRST + i] = lower * dz[i - ONE] + upper * dz[i]
        area_z[FIRST + i] = -(lower * dx[i - ONE] + upper * dx[i])
    first = sixth * (3.0 * x[0] + dx[0])
    area_x[FIRST] = first * dz[0]
    area_z[FIRST] = -first * dx[0]


@kernel
def volume_of_meridian(model, nodes, volume):
    """Return the volume (m^3) of the shell: see update_areas. Writes volume, scratch."""
    sixth, x, z = model.hoop.whole * model.shape.side / 6.0, nodes.x, nodes.z
    for i in range(lanes(model.n1)):
        r, s = x[i], x[i + ONE]
        volume[i] = sixth * (z[i + ONE] - z[i]) * (r * r + r * s + s * s)
    return sum_of(volume, model.n1)


@kernel
def push_meridian(nodes, meridian, work, obstacles, step, n1):
    """Push the free nodes from n to n+1, the ground stopping them. Eqs. (2.8), (3.2), (3.4).

    Reads mass, edges, hoops, areas and pressure of meridian. Writes nodes; what tensions, gas, weight and ground work over the
    means of the velocities, as if no other contact followed; meridian.mean_u, mean_w, free_u, free_w (m/s), ground_impulse (N s).
    Returns whether some node came near to cover, cargo or axis.
    """
    x, z, u, w = nodes.x, nodes.z, nodes.u, nodes.w
    dt, length, ground, least = step.dt, step.length, obstacles.ground, least_radius(obstacles)
    per_length = 1.0 / length
    highest_before, highest = heights_below(step) if may_touch(obstacles) else (inf, inf)
    near = 0
    for i in range(ONE, ONE + lanes(n1 - 1)):
        pull_x, pull_z, _, _ = tensions_at(meridian, i)
        gas_x, gas_z = gas_at(meridian, i)
        mass, per_mass = meridian.mass[i], dt * meridian.per_mass[i]
        free = mass > 0.0  # the row on the cover moves, but not by this push
        new_u = u[i] + per_mass * (pull_x + gas_x)
        falling = w[i] + per_mass * (pull_z + gas_z - step.gravity * mass)
        new_w = max(falling, (ground - z[i]) * per_length)
        mean_u = 0.5 * (u[i] + new_u)
        mean_w = 0.5 * (w[i] + new_w) if free else 0.0
        meridian.ground_impulse[i] = mass * (new_w - falling)
        add_works(meridian, work, step, i, mean_u, mean_w)
        meridian.mean_u[i] = mean_u
        meridian.mean_w[i] = mean_w
        meridian.free_u[i] = new_u
        meridian.free_w[i] = new_w
        new_x = x[i] + length * new_u
        new_z = max(z[i] + length * new_w, ground)
        near |= int(free) & (int(new_z > highest) | int(z[i] > highest_before) | int(new_x < least))
        x[i] = new_x
        z[i] = new_z
        u[i] = new_u
        w[i] = new_w
    return near


@kernel
def tensions_at(meridian, i):
    """Return the forces (N) of edges, hoops and belts on node i, outwards and up, and the elastic parts of the fabric's."""
    b, dx, dz, force, elastic = i - ONE, meridian.x, meridian.z, meridian.force, meridian.elastic
    pull_x = force[i] * dx[i] - force[b] * dx[b] - meridian.hoop[i]
    pull_z = force[i] * dz[i] - force[b] * dz[b]
    elastic_x = elastic[i] * dx[i] - elastic[b] * dx[b] - meridian.hoop_elastic[i]
    elastic_z = elastic[i] * dz[i] - elastic[b] * dz[b]
    return pull_x, pull_z, elastic_x, elastic_z


@kernel
def gas_at(meridian, i):
    """Return the force (N) of the gas on node i, outwards and up."""
    return meridian.pressure[i] * meridian.area.x[FIRST + i], meridian.pressure[i] * meridian.area.z[FIRST + i]


@kernel
def add_works(meridian, work, step, i, u, w):
    """Add what all but contact works on node i where it moves at u, w (m/s) during the step. Reads meridian. Writes work."""
    pull_x, pull_z, elastic_x, elastic_z = tensions_at(meridian, i)
    gas_x, gas_z = gas_at(meridian, i)
    elastic, belt = elastic_x * u + elastic_z * w, -meridian.belt_elastic[i] * u
    work.pressure[i] += step.dt * (gas_x * u + gas_z * w)
    work.gravity[i] -= step.dt * step.gravity * (meridian.mass[i] * w)
    work.ground[i] += meridian.ground_impulse[i] * w
    work.elastic[i] += step.dt * elastic
    work.belts[i] += step.dt * belt
    work.viscous[i] += step.dt * (pull_x * u + pull_z * w - elastic - belt)


@kernel
def resolve_contact_of_meridian(model, state, meridian, step, near):
    """Hold the pushed nodes off obstacles and off one another, and add what that changes of the works.

    Reads model, step; near: whether some node came near to cover, cargo or axis. Writes state.nodes, work, self_contact;
    meridian.impulse. Returns the impulses (N s, upwards) on the cargo, and of the ground on the fabric since the push.
    """
    nodes, obstacles, mass, n1 = state.nodes, model.obstacles, model.mass, model.n1
    moved = near
    if obstacles.friction > 0.0:
        rub_meridian(nodes, meridian, obstacles, mass, step.length, n1)
        moved = 1
    impulse = 0.0
    if near != 0:
        impulse = press_meridian(nodes, obstacles, step, mass, n1)
    meridian.impulse[0] = 0.0
    meridian.impulse[1] = 0.0
    moved |= resolve_belt_contact_of_meridian(model, nodes, meridian, step)  # (2.5)
    moved |= resolve_self_contact_of_meridian(model, nodes, meridian, state.self_contact, step)
    if moved != 0:
        add_contact_work_of_meridian(nodes, meridian, state.work, step, n1)
    return impulse + meridian.impulse[0], meridian.impulse[1]


@kernel
def rub_meridian(nodes, meridian, obstacles, mass, length, n1):
    """Slow what the ground stopped in the push, by Coulomb's law. Reads meridian.ground_impulse. Writes nodes."""
    for i in range(ONE, uint64(n1)):
        lost = slowed(nodes.u[i], 0.0, obstacles.friction * meridian.ground_impulse[i] / mass[i]) - 1.0
        change_velocity(nodes, i, length, lost * nodes.u[i], 0.0, 0.0)


@kernel
def press_meridian(nodes, obstacles, step, mass, n1):
    """Hold the pushed nodes off cover, cargo and axis.

    Reads mass (kg, by row). Writes nodes. Returns the impulse (N s) on cover and cargo, upwards; the axis takes that which holds
    a slack hoop at least_radius, where the cloth would touch itself.
    """
    touching, least = may_touch(obstacles), least_radius(obstacles)
    length, impulse, per_length = step.length, 0.0, 1.0 / step.length
    x, z, u, w = nodes.x, nodes.z, nodes.u, nodes.w
    for i in range(ONE, uint64(n1)):
        new_x, pushed_z = x[i], z[i] - step.next_cover
        new_z = pushed_z
        old_z = z[i] - length * w[i] - step.cover
        if touching and reaches_up(step, z[i], w[i]):
            new_x, _, new_z = allowed_place(obstacles, step.gap, new_x - length * u[i], 0.0, old_z, new_x, 0.0, new_z)
        new_x = max(new_x, least)
        if new_x == x[i] and new_z == pushed_z:
            continue
        jump_u = (new_x - x[i]) * per_length
        jump_w = (new_z - pushed_z) * per_length
        if obstacles.friction > 0.0 and abs(new_z) == step.gap:  # on the cover
            jump_u = slowed(u[i] + jump_u, 0.0, obstacles.friction * abs(jump_w)) * (u[i] + jump_u) - u[i]
        impulse -= mass[i] * jump_w
        change_velocity(nodes, i, length, jump_u, 0.0, jump_w)
    return impulse


@kernel
def add_contact_work_of_meridian(nodes, meridian, work, step, n1):
    """Add the work of what changed the pushed velocities (free_u, free_w), and what the other forces work by it.

    The change belongs to the step: half of it is in the means of the velocities. Writes work.
    """
    for i in range(ONE, uint64(n1)):
        jump_u, jump_w = nodes.u[i] - meridian.free_u[i], nodes.w[i] - meridian.free_w[i]
        half_u, half_w = 0.5 * jump_u, 0.5 * jump_w
        add_works(meridian, work, step, i, half_u, half_w)
        gained = jump_u * (meridian.mean_u[i] + half_u) + jump_w * (meridian.mean_w[i] + half_w)
        work.contact[i] += meridian.mass[i] * gained


@kernel
def raise_peaks(now, peaks, meridian, n1):
    """Raise the peaks to those of the step. Reads now, meridian's tensions. Returns whether the fabric's are raised.

    Whether one is higher than all before it is asked of all nodes at once; its row is looked for in the few steps in which it is.
    """
    time, most_1, most_2 = now[History.TIME], peaks[Peak.TENSION_GENERATRIX, 0], peaks[Peak.TENSION_HOOP, 0]
    tension_1, tension_2 = meridian.tension_1, meridian.tension_2
    higher_1, higher_2 = 0, 0
    for i in range(lanes(n1)):
        higher_1 |= int(tension_1[i] > most_1)
        higher_2 |= int(tension_2[i] > most_2)
    if higher_1 != 0:
        raise_peak_of(peaks, Peak.TENSION_GENERATRIX, tension_1, n1, time, 0.5)
    if higher_2 != 0:
        raise_peak_of(peaks, Peak.TENSION_HOOP, tension_2, n1, time, 0.0)
    for k in range(meridian.belt_rows.size):
        row = uint64(meridian.belt_rows[uint64(k)])
        raise_peak(peaks, Peak.TENSION_BELT, meridian.belt_force[row] / meridian.belts.width[row], time, float(row))
    return higher_1 | higher_2


@kernel
def raise_peak_of(peaks, which, tension, count, time, offset):
    """Keep the largest of some tensions (N/m), the first of equal ones, with its time (s) and row, offset above its index."""
    for i in range(count):
        raise_peak(peaks, which, tension[i], time, i + offset)


@kernel
def record_forces_of_meridian(now, meridian, gravity, columns, dt, n1):
    """Write the largest tensions of the step to now, and add the ground's impulse on the fabric and its area there."""
    largest_1, largest_2, largest_belt, ground_impulse, area = 0.0, 0.0, 0.0, 0.0, -min(meridian.area.z[FIRST], 0.0)
    for i in range(uint64(n1)):
        largest_1 = max(largest_1, meridian.tension_1[i])
        largest_2 = max(largest_2, meridian.tension_2[i])
        ground_impulse += meridian.ground_impulse[i]
        lying = -min(meridian.area.z[FIRST + i], 0.0)
        area += lying_area(lying, meridian.pressure[i], gravity * meridian.mass[i], meridian.ground_impulse[i] / dt)
    for k in range(meridian.belt_rows.size):
        row = uint64(meridian.belt_rows[k])
        largest_belt = max(largest_belt, meridian.belt_force[row] / meridian.belts.width[row])
    now[History.GROUND_FORCE] += columns * (ground_impulse / dt)
    now[History.GROUND_AREA] += columns * area
    now[History.TENSION_GENERATRIX] = largest_1
    now[History.TENSION_HOOP] = largest_2
    now[History.TENSION_BELT] = largest_belt


@kernel
def record_energies_of_meridian(model, nodes, work, now):
    """Write kinetic energy and works of all columns at n+1/2 to now, for the row of time n+1."""
    n1, columns, mass, top = model.n1, model.hoop.whole, model.mass, uint64(model.n1)
    kinetic = 0.5 * (model.cargo_mass + mass[top]) * nodes.w[top] * nodes.w[top]
    pressure, elastic, viscous, belts, gravity, ground, contact = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(ONE, top):
        kinetic += 0.5 * mass[i] * (nodes.u[i] * nodes.u[i] + nodes.w[i] * nodes.w[i])
    for i in range(uint64(n1 + 1)):
        pressure += work.pressure[i]
        elastic += work.elastic[i]
        viscous += work.viscous[i]
        belts += work.belts[i]
        gravity += work.gravity[i]
        ground += work.ground[i]
        contact += work.contact[i]
    now[History.KINETIC_ENERGY] = columns * kinetic
    now[History.WORK_PRESSURE] = columns * pressure
    now[History.WORK_ELASTIC] = columns * elastic
    now[History.WORK_VISCOUS] = columns * viscous
    now[History.WORK_BELTS] = columns * belts
    now[History.WORK_GRAVITY] = columns * gravity
    now[History.WORK_GROUND] = columns * ground
    now[History.WORK_CONTACT] = columns * contact


@kernel
def stable_step_of_meridian(model, nodes, meridian):
    """Return the step (s) at Courant coefficient 1: as stable_step, but no wave runs around the hoop.

    The breathing hoop has the stiffness k2 of side² times that of its polygon's edges, along the radius; to waves along the
    generatrix that adds where the generatrix leans, and by Poisson's effect.
    Reads model, nodes. Writes meridian.by_row, scratch in e, force.
    """
    n1, shape, by_row = model.n1, model.shape, meridian.by_row
    e1, e2, skew = by_row.e1, by_row.e2, by_row.skew
    coupling = 0.5 * model.fabric.c12 / sqrt(model.fabric.c11 * model.fabric.c22)
    for i in range(uint64(n1)):
        dx = nodes.x[i + ONE] - nodes.x[i]
        dz = nodes.z[i + ONE] - nodes.z[i]
        square = max(dx * dx + dz * dz, SMALLEST_SQUARE)
        e1[i] = max(sqrt(square) * (1.0 / shape.h1[i]) - 1.0, 0.0)
        e2[i] = max(abs(nodes.x[i]) * (1.0 / shape.radius[i]) - 1.0, 0.0)
        meridian.e[i] = dx * dx / square
    for i in range(ONE, uint64(n1)):
        k1, t1, damping_1, wide_2, _ = waves_along(model, by_row, i)
        fabric, per_2 = cloth_around(model, i), 1.0 / shape.radius[i]
        breathing = fabric.h2 * per_2 * per_2  # side²/h2
        per_mass = breathing * model.per_mass[i]
        k2 = per_mass * (fabric.c22 * fabric.h1 * wide_2 + model.belts.stiffness[i])
        damping_2 = per_mass * (fabric.viscosity * fabric.h1 * wide_2 + model.belts.viscosity[i])
        lean = max(meridian.e[i - ONE], meridian.e[i])
        square = t1 + joined(max(k1 - t1, 0.0), k2, (sqrt(lean) + coupling) ** 2)
        skew[i] = lean
        rate = rate_of(model, by_row, i, square, joined(damping_1, damping_2, lean), fabric.h2 * per_2)
        by_row.rate[i] = rate
        meridian.force[i] = rate
    return 2.0 / fold_largest(meridian.force, ONE, n1 - 1)


@kernel
def advance_meridian(model, state, meridian, history, interval, most, until):
    """Advance the axisymmetric shell as advance does the rows. Returns the rows of history and the Outcome.

    Sums over the nodes are taken where they are needed only: for a row of the history, at the end, and for end_step to see a
    divergence, when a step is chosen and when tensions are higher than ever, as in a divergence they are.
    """
    now, n1, columns = state.now, model.n1, model.hoop.whole
    rows, done, recorded, dt, outcome = 0, 0, False, 1.0, Outcome.RUNNING
    while outcome == Outcome.RUNNING and done < most and now[History.TIME] < until and rows + 1 < history.shape[0]:
        recorded = state.steps[0] % interval == 0
        chosen = state.steps[0] >= state.choice[0]
        if chosen:
            limit = stable_step_of_meridian(model, state.nodes, meridian)
            choose_step(state, limit_with_gas(model, state, meridian.by_row, limit))  # (3.3)
            longest = watch_meridian(model, state.nodes, state.self_contact, window_of(model, state))
            state.stable_step[0] = min(state.stable_step[0], longest / model.courant)
        length, dt = begin_step(model, state)
        height, raised = take_step_of_meridian(model, state, meridian, dt, length)
        if recorded:
            record_forces_of_meridian(now, meridian, model.gravity, columns, dt, n1)
            record_history(history, rows, now)
            rows += 1
        if chosen or raised != 0 or (state.steps[0] + 1) % interval == 0:
            record_energies_of_meridian(model, state.nodes, state.work, now)
        outcome = end_step(model, state, length, height)
        done += 1
        if overflown(state.self_contact):
            break
    if done > 0:
        if not recorded:
            record_forces_of_meridian(now, meridian, model.gravity, columns, dt, n1)
        record_energies_of_meridian(model, state.nodes, state.work, now)
    if outcome != Outcome.RUNNING:
        if ran_away(model, state):
            outcome = Outcome.DIVERGED
        record_history(history, rows, now)
        rows += 1
    return rows, outcome
