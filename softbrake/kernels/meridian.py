"""One step of the axisymmetric shell, and its loop over steps: the limit of step.py's rows for columns that are all alike.

Node i = 0 … n1 stands at radius x and height z, edge i between nodes i and i+1; all loops run along the generatrix. The hoop
stays a polygon: its edges, `side` long per radius, pull a node inwards by `side` times their force. Equations as in step.py.
"""

from math import inf, sqrt

from numba import uint64

from softbrake.kernels.contact import GAP, allowed_place, foresee, shift, slowed
from softbrake.kernels.course import begin_step, choose_step, end_step, raise_peak, ran_away, record
from softbrake.kernels.folds import part_meridian, watch_meridian, window_of
from softbrake.kernels.geometry import SMALLEST_SQUARE
from softbrake.kernels.jit import kernel
from softbrake.kernels.lobes import part_meridian_lobes
from softbrake.kernels.motion import push_cargo
from softbrake.kernels.pressure import pressure_at, update_damped_pressure
from softbrake.kernels.timestep import along, joined, largest, rate_of
from softbrake.state import PAD, FoldCount, History, Outcome, Peak

ONE = uint64(1)
FIRST = uint64(PAD)


@kernel
def sweep_meridian(model, state, meridian, dt, length):
    """Advance fabric and cargo by one step. Returns the cover's new height (m) and whether tensions are higher than ever.

    dt: from n-1/2 to n+1/2; length: from n to n+1 (s). The one column moves its share of the cargo; state.now has the whole
    shell's forces.
    """
    n1, fabric, contact, columns = model.n1, model.fabric, model.contact, model.sector.copies
    nodes, now, work, mass = state.nodes, state.now, state.work, model.mass
    side = fabric.h2 / model.radius
    pressure = pressure_at(model.pressure, now[History.TIME])  # (2.10)
    now[History.PRESSURE] = pressure
    gas_on_cover = pressure * model.cover_area
    top = uint64(n1)
    old = nodes.w[top]
    step = foresee(now, old, model.gravity, model.sector, dt, length)

    update_generatrix(fabric, nodes, meridian, side, n1)  # (2.6), (2.9)
    update_areas(nodes, meridian, model.sector.sin, n1)  # (2.7)
    pull_belts(model.belts, fabric, nodes, meridian, side)  # (2.3)
    if model.pressure.damping > 0.0:
        update_damped_pressure(model.pressure, pressure, nodes, meridian.area, meridian.pressure, uint64(0), n1 + 1)  # (2.11)
    else:
        for i in range(uint64(n1 + 1)):
            meridian.pressure[i] = pressure
    near = push_meridian(fabric, nodes, meridian, work, contact, step, mass, side, n1)  # (2.8), (2.9), (3.4)
    moved = near
    if contact.friction > 0.0:
        rub_meridian(nodes, meridian, contact, mass, length, n1)
        moved = 1
    impulse = 0.0
    if near != 0:
        impulse = press_meridian(nodes, meridian, contact, step, mass, n1)
    moved |= part_meridian_lobes(model, nodes, meridian, state.folds, step)  # (2.5)
    impulse += state.folds.impulse[0]
    lift = state.folds.impulse[1]
    if contact.folds == 1 and state.folds.counts[FoldCount.DUE] == 1:
        part_meridian(model, nodes, meridian, state.folds, step)
        impulse += state.folds.impulse[0]
        lift += state.folds.impulse[1]
        moved = 1
    if moved != 0:
        add_contact_work(nodes, meridian, work, step, mass, n1)

    below = uint64(n1 - 1)
    pull = meridian.force[below] * meridian.z[below]
    gas = meridian.pressure[top] * meridian.area.z[FIRST + top]
    now[History.CONTACT_FORCE] = columns * (impulse / dt)
    now[History.COVER_FORCE] = columns * (gas_on_cover + gas - pull + impulse / dt)
    moving = model.cargo_mass + mass[top]
    velocity, height = push_cargo(now, old, step, columns * moving)  # (2.4)
    mean = 0.5 * (old + velocity)
    nodes.z[top] = height
    nodes.w[top] = velocity
    meridian.mean_w[top] = mean
    work.pressure[top] += dt * (gas_on_cover + gas) * mean
    work.gravity[top] -= dt * model.gravity * moving * mean
    work.contact[top] += impulse * mean

    add_meridian_work(meridian, work, dt, n1)
    add_belt_work(meridian, work, dt)
    on_ground = gas_on_cover - meridian.pressure[0] * meridian.area.z[FIRST] - meridian.force[0] * meridian.z[0]
    now[History.GROUND_FORCE] = columns * (on_ground + mass[0] * model.gravity + lift / dt)
    now[History.GROUND_AREA] = columns * model.cover_area
    return height, raise_peaks(now, state.peaks, meridian, n1)


@kernel
def update_generatrix(fabric, nodes, meridian, side, n1):
    """Update edges and T11 along the generatrix, the hoop's elongation the mean of the two nodes. Eqs. (2.6), (2.9).

    Reads nodes; side: hoop edge per radius. Writes meridian.x, z (m, edge vector), e, tension_1 (N/m), force and elastic (N/m:
    edge force over edge length).
    """
    x, z, u, w = nodes.x, nodes.z, nodes.u, nodes.w
    per_1 = 1.0 / fabric.h1
    half = 0.5 * side / fabric.h2
    for i in range(uint64(n1)):
        j = i + ONE
        dx = x[j] - x[i]
        dz = z[j] - z[i]
        square = max(dx * dx + dz * dz, SMALLEST_SQUARE)
        inverse = 1.0 / sqrt(square)
        e = square * inverse * per_1 - 1.0
        rate = (dx * (u[j] - u[i]) + dz * (w[j] - w[i])) * inverse * per_1
        across = half * (abs(x[i]) + abs(x[j])) - 1.0
        across = max(across, -fabric.relax_1 * e - fabric.kept)
        hooke = fabric.c11 * e + fabric.c12 * across
        elastic = max(hooke, fabric.residual * hooke)
        tension = max(hooke + fabric.viscosity * rate, min(elastic, 0.0) + fabric.floor)
        per_length = fabric.h2 * (1.0 + fabric.true_tension * across) * inverse
        meridian.x[i] = dx
        meridian.z[i] = dz
        meridian.e[i] = e
        meridian.tension_1[i] = tension
        meridian.force[i] = tension * per_length
        meridian.elastic[i] = elastic * per_length


@kernel
def update_areas(nodes, meridian, sin, n1):
    """Update the area vectors of the nodes. F of section 3, (2.7) for a wedge of the polygon.

    The gradient of the wedge's volume, sin dz (r0² + r0 r1 + r1²)/6 for each edge, sin of the angle between two columns: it gives
    the lower node of an edge (2 r0 + r1) and the upper one (r0 + 2 r1) times (dz, -dr) sin/6. Writes meridian.area (m^2).
    """
    sixth = sin / 6.0
    top = uint64(n1)
    x, dx, dz, area_x, area_z = nodes.x, meridian.x, meridian.z, meridian.area.x, meridian.area.z
    for i in range(ONE, top):
        lower = sixth * (3.0 * x[i] - dx[i - ONE])
        upper = sixth * (3.0 * x[i] + dx[i])
        area_x[FIRST + i] = lower * dz[i - ONE] + upper * dz[i]
        area_z[FIRST + i] = -(lower * dx[i - ONE] + upper * dx[i])
    first = sixth * (3.0 * x[0] + dx[0])
    area_x[FIRST] = first * dz[0]
    area_z[FIRST] = -first * dx[0]
    last = sixth * (3.0 * x[top] - dx[top - ONE])
    area_x[FIRST + top] = last * dz[top - ONE]
    area_z[FIRST + top] = -last * dx[top - ONE]


@kernel
def pull_belts(belts, fabric, nodes, meridian, side):
    """Update the belts' pull inwards on their nodes. Eq. (2.3).

    Reads meridian.belt_rows, e. Writes meridian.belt_tension (N/m), belt_force (N, its elastic part belt_elastic).
    """
    for k in range(meridian.belt_rows.size):
        i = meridian.belt_rows[k]
        sign = 1.0 if nodes.x[i] >= 0.0 else -1.0
        e = abs(nodes.x[i]) * side / fabric.h2 - 1.0
        across = 0.5 * (meridian.e[i - 1] + meridian.e[i])
        hooke = belts.stiffness[i] * e + belts.coupling[i] * across
        force = max(hooke + belts.viscosity[i] * sign * nodes.u[i] * side / fabric.h2, 0.0)
        meridian.belt_tension[i] = force / belts.width[i]
        meridian.belt_force[i] = side * sign * force
        meridian.belt_elastic[i] = side * sign * max(hooke, 0.0)


@kernel
def push_meridian(fabric, nodes, meridian, work, contact, step, mass, side, n1):
    """Push the free nodes from n to n+1, the ground stopping them. Eqs. (2.9), (2.8), (3.2), (3.4).

    T22 stands at the nodes, e11 the mean of the two edges; of a node that has passed the axis the hoop is turned inside out.
    Reads edges, areas, pressure and belts of meridian; mass (kg). Writes nodes; what gas, weight, ground and hoops work over the
    means of the velocities, as if no other contact followed; meridian.tension_2 (N/m), hoop and hoop_elastic (N), mean_u, mean_w,
    free_u, free_w (m/s), lift (N s). Returns whether some node came near to cover, cargo or axis.
    """
    x, z, u, w = nodes.x, nodes.z, nodes.u, nodes.w
    dx, dz, e, force, on_node, belt = meridian.x, meridian.z, meridian.e, meridian.force, meridian.pressure, meridian.belt_force
    area_x, area_z = meridian.area.x, meridian.area.z
    dt, length, ground = step.dt, step.length, contact.ground
    weight = dt * step.gravity
    per_length = 1.0 / length
    per_2 = side / fabric.h2
    touching = (contact.cover == 1 or contact.cargo == 1) and step.next_cover > 0.0  # else on the ground before that
    highest = step.next_cover - step.gap if touching else inf
    highest_before = step.cover - step.gap if touching else inf
    least = GAP if contact.axis == 1 else -inf
    near = 0
    for i in range(ONE, uint64(n1)):
        b = i - ONE
        sign = 1.0 if x[i] >= 0.0 else -1.0
        across = 0.5 * (e[b] + e[i])
        hoop = abs(x[i]) * per_2 - 1.0
        across = max(across, -fabric.relax_2 * hoop - fabric.kept)
        hooke = fabric.c22 * hoop + fabric.c21 * across
        elastic = max(hooke, fabric.residual * hooke)
        tension = max(hooke + fabric.viscosity * sign * u[i] * per_2, min(elastic, 0.0) + fabric.floor)
        inwards = side * fabric.h1 * (1.0 + fabric.true_tension * across) * sign
        force_x = force[i] * dx[i] - force[b] * dx[b] - tension * inwards - belt[i] + on_node[i] * area_x[FIRST + i]
        force_z = force[i] * dz[i] - force[b] * dz[b] + on_node[i] * area_z[FIRST + i]
        per_mass = dt / mass[i]
        new_u = u[i] + per_mass * force_x
        free = w[i] + per_mass * force_z - weight
        new_w = max(free, (ground - z[i]) * per_length)
        mean_u = 0.5 * (u[i] + new_u)
        mean_w = 0.5 * (w[i] + new_w)
        lift = mass[i] * (new_w - free)
        hoop_elastic = elastic * inwards
        work.pressure[i] += dt * (on_node[i] * (area_x[FIRST + i] * mean_u + area_z[FIRST + i] * mean_w))
        work.gravity[i] -= weight * mass[i] * mean_w
        work.ground[i] += lift * mean_w
        work.elastic[i] -= dt * hoop_elastic * mean_u
        work.viscous[i] -= dt * (tension * inwards - hoop_elastic) * mean_u
        meridian.tension_2[i] = tension
        meridian.hoop[i] = tension * inwards
        meridian.hoop_elastic[i] = hoop_elastic
        meridian.lift[i] = lift
        meridian.mean_u[i] = mean_u
        meridian.mean_w[i] = mean_w
        meridian.free_u[i] = new_u
        meridian.free_w[i] = new_w
        new_x = x[i] + length * new_u
        new_z = max(z[i] + length * new_w, ground)
        near |= int(new_z > highest) | int(z[i] > highest_before) | int(new_x < least)
        x[i] = new_x
        z[i] = new_z
        u[i] = new_u
        w[i] = new_w
    return near


@kernel
def rub_meridian(nodes, meridian, contact, mass, length, n1):
    """Slow what the ground stopped in the push, by Coulomb's law. Writes nodes."""
    for i in range(ONE, uint64(n1)):
        lost = slowed(nodes.u[i], 0.0, contact.friction * meridian.lift[i] / mass[i]) - 1.0
        shift(nodes, i, length, lost * nodes.u[i], 0.0, 0.0)


@kernel
def press_meridian(nodes, meridian, contact, step, mass, n1):
    """Hold the pushed nodes off cover, cargo and axis.

    Writes nodes. Returns the impulse (N s) on cover and cargo, upwards; the axis takes that
    which holds a slack hoop at a radius of GAP, where the cloth would meet itself.
    """
    touching = (contact.cover == 1 or contact.cargo == 1) and step.next_cover > 0.0
    least = GAP if contact.axis == 1 else -inf
    length, impulse, per_length = step.length, 0.0, 1.0 / step.length
    x, z, u, w = nodes.x, nodes.z, nodes.u, nodes.w
    for i in range(ONE, uint64(n1)):
        new_x, pushed_z = x[i], z[i] - step.next_cover
        new_z = pushed_z
        old_z = z[i] - length * w[i] - step.cover
        if touching and (new_z > -step.gap or old_z > -step.gap):
            new_x, _, new_z = allowed_place(contact, step.gap, new_x - length * u[i], 0.0, old_z, new_x, 0.0, new_z)
        new_x = max(new_x, least)
        if new_x == x[i] and new_z == pushed_z:
            continue
        jump_u = (new_x - x[i]) * per_length
        jump_w = (new_z - pushed_z) * per_length
        if contact.friction > 0.0 and abs(new_z) == step.gap:  # on the cover
            jump_u = slowed(u[i] + jump_u, 0.0, contact.friction * abs(jump_w)) * (u[i] + jump_u) - u[i]
        impulse -= mass[i] * jump_w
        shift(nodes, i, length, jump_u, 0.0, jump_w)
    return impulse


@kernel
def add_contact_work(nodes, meridian, work, step, mass, n1):
    """Add the work of what changed the pushed velocities (free_u, free_w), and what the other forces work by it.

    The change belongs to the step: half of it is in the means of the velocities. Writes work, meridian.mean_u, mean_w (m/s).
    """
    dt, weight = step.dt, step.dt * step.gravity
    for i in range(ONE, uint64(n1)):
        jump_u, jump_w = nodes.u[i] - meridian.free_u[i], nodes.w[i] - meridian.free_w[i]
        half_u, half_w = 0.5 * jump_u, 0.5 * jump_w
        mean_u = meridian.mean_u[i] + half_u
        mean_w = meridian.mean_w[i] + half_w
        gas = meridian.pressure[i] * (meridian.area.x[FIRST + i] * half_u + meridian.area.z[FIRST + i] * half_w)
        work.pressure[i] += dt * gas
        work.gravity[i] -= weight * mass[i] * half_w
        work.ground[i] += meridian.lift[i] * half_w
        work.elastic[i] -= dt * meridian.hoop_elastic[i] * half_u
        work.viscous[i] -= dt * (meridian.hoop[i] - meridian.hoop_elastic[i]) * half_u
        work.contact[i] += mass[i] * (jump_u * mean_u + jump_w * mean_w)
        meridian.mean_u[i] = mean_u
        meridian.mean_w[i] = mean_w


@kernel
def add_meridian_work(meridian, work, dt, n1):
    """Add the work of the generatrix edges on the nodes at their ends, as add_edge_work does. Reads meridian. Writes work."""
    dx, dz, mean_u, mean_w = meridian.x, meridian.z, meridian.mean_u, meridian.mean_w
    for i in range(uint64(n1)):
        j = i + ONE
        closing = dt * (dx[i] * (mean_u[i] - mean_u[j]) + dz[i] * (mean_w[i] - mean_w[j]))
        work.elastic[i] += meridian.elastic[i] * closing
        work.viscous[i] += (meridian.force[i] - meridian.elastic[i]) * closing


@kernel
def add_belt_work(meridian, work, dt):
    """Add the work of the belts on their nodes. Reads meridian. Writes work.belts, viscous."""
    for k in range(meridian.belt_rows.size):
        i = meridian.belt_rows[k]
        closing = -dt * meridian.mean_u[i]
        work.belts[i] += meridian.belt_elastic[i] * closing
        work.viscous[i] += (meridian.belt_force[i] - meridian.belt_elastic[i]) * closing


@kernel
def raise_peaks(now, peaks, meridian, n1):
    """Raise the peaks to those of the step. Reads now, meridian's tensions. Returns whether the fabric's are raised.

    Whether one is higher than all before it is asked of all nodes at once; its row is looked for in the few steps in which it is.
    """
    time, most_1, most_2 = now[History.TIME], peaks[Peak.TENSION_GENERATRIX, 0], peaks[Peak.TENSION_HOOP, 0]
    tension_1, tension_2 = meridian.tension_1, meridian.tension_2
    higher_1, higher_2 = 0, 0
    for i in range(uint64(n1)):
        higher_1 |= int(tension_1[i] > most_1)
        higher_2 |= int(tension_2[i] > most_2)
    if higher_1 != 0:
        raise_peak_of(peaks, Peak.TENSION_GENERATRIX, tension_1, n1, time, 0.5)
    if higher_2 != 0:
        raise_peak_of(peaks, Peak.TENSION_HOOP, tension_2, n1, time, 0.0)
    for k in range(meridian.belt_rows.size):
        row = meridian.belt_rows[k]
        raise_peak(peaks, Peak.TENSION_BELT, meridian.belt_tension[row], time, float(row))
    return higher_1 | higher_2


@kernel
def raise_peak_of(peaks, which, tension, count, time, shift):
    """Keep the largest of some tensions (N/m), the first of equal ones, with its time (s) and row, shift above its index."""
    for i in range(count):
        raise_peak(peaks, which, tension[i], time, i + shift)


@kernel
def book_forces(now, meridian, columns, dt, n1):
    """Write the largest tensions of the step to now, and add the ground's impulse on the fabric and its area there."""
    largest_1, largest_2, largest_belt, lift, area = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(uint64(n1)):
        largest_1 = max(largest_1, meridian.tension_1[i])
        largest_2 = max(largest_2, meridian.tension_2[i])
        lift += meridian.lift[i]
        area -= min(meridian.area.z[FIRST + i], 0.0) if meridian.lift[i] > 0.0 else 0.0
    for k in range(meridian.belt_rows.size):
        largest_belt = max(largest_belt, meridian.belt_tension[meridian.belt_rows[k]])
    now[History.GROUND_FORCE] += columns * (lift / dt)
    now[History.GROUND_AREA] += columns * area
    now[History.TENSION_GENERATRIX] = largest_1
    now[History.TENSION_HOOP] = largest_2
    now[History.TENSION_BELT] = largest_belt


@kernel
def book_energies(model, nodes, work, now):
    """Write kinetic energy and works of all columns at n+1/2 to now, for the row of time n+1."""
    n1, columns, mass, top = model.n1, model.sector.copies, model.mass, uint64(model.n1)
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
    n1, fabric, by_row = model.n1, model.fabric, meridian.by_row
    e1, e2, skew = by_row.e1, by_row.e2, by_row.skew
    per_1, per_2 = 1.0 / fabric.h1, 1.0 / model.radius
    breathing = fabric.h2 * per_2 * per_2  # side²/h2
    coupling = 0.5 * sqrt(fabric.c12 * fabric.c21 / (fabric.c11 * fabric.c22))
    for i in range(uint64(n1)):
        dx = nodes.x[i + ONE] - nodes.x[i]
        dz = nodes.z[i + ONE] - nodes.z[i]
        square = max(dx * dx + dz * dz, SMALLEST_SQUARE)
        e1[i] = max(sqrt(square) * per_1 - 1.0, 0.0)
        e2[i] = max(abs(nodes.x[i]) * per_2 - 1.0, 0.0)
        meridian.e[i] = dx * dx / square
    for i in range(ONE, uint64(n1)):
        k1, t1, damping_1, wide_2, _ = along(model, by_row, i)
        per_mass = breathing * model.per_mass[i]
        k2 = per_mass * (fabric.c22 * fabric.h1 * wide_2 + model.belts.stiffness[i])
        damping_2 = per_mass * (fabric.viscosity * fabric.h1 * wide_2 + model.belts.viscosity[i])
        lean = max(meridian.e[i - ONE], meridian.e[i])
        square = t1 + joined(max(k1 - t1, 0.0), k2, (sqrt(lean) + coupling) ** 2)
        skew[i] = lean
        rate = rate_of(model, by_row, i, square, joined(damping_1, damping_2, lean))
        by_row.rate[i] = rate
        meridian.force[i] = rate
    return 2.0 / largest(meridian.force, ONE, n1 - 1)


@kernel
def advance_meridian(model, state, meridian, history, interval, most, until):
    """Advance the axisymmetric shell as advance does the rows. Returns the rows of history and the Outcome.

    Sums over the nodes are taken where they are needed only: for a row of the history, at the end, and for end_step to see a
    divergence, when a step is chosen and when tensions are higher than ever, as in a divergence they are.
    """
    now, n1, columns = state.now, model.n1, model.sector.copies
    rows, done, recorded, dt, outcome = 0, 0, False, 1.0, Outcome.RUNNING
    while outcome == Outcome.RUNNING and done < most and now[History.TIME] < until and rows + 1 < history.shape[0]:
        recorded = state.steps[0] % interval == 0
        chosen = state.steps[0] >= state.choice[0]
        if chosen:
            choose_step(state, stable_step_of_meridian(model, state.nodes, meridian))  # (3.3)
            if model.contact.folds == 1:
                window = window_of(model, state)
                longest = watch_meridian(state.nodes, state.folds, n1, model.fabric.h1, window)
                state.stable_step[0] = min(state.stable_step[0], longest / model.courant)
        length, dt = begin_step(model, state)
        height, raised = sweep_meridian(model, state, meridian, dt, length)
        if recorded:
            book_forces(now, meridian, columns, dt, n1)
            record(history, rows, now)
            rows += 1
        if chosen or raised != 0 or (state.steps[0] + 1) % interval == 0:
            book_energies(model, state.nodes, state.work, now)
        outcome = end_step(model, state, length, height)
        done += 1
        if state.folds.counts[FoldCount.CRAMPED] == 1:
            break
    if done > 0:
        if not recorded:
            book_forces(now, meridian, columns, dt, n1)
        book_energies(model, state.nodes, state.work, now)
    if outcome != Outcome.RUNNING:
        if ran_away(model, state):
            outcome = Outcome.DIVERGED
        record(history, rows, now)
        rows += 1
    return rows, outcome
