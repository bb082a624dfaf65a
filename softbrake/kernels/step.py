"""The order of one step, and the loop over steps. Start reading here."""

from math import sqrt

from numba import uint64

from softbrake.kernels.fabric import (
    add_cell_forces,
    add_generatrix_forces,
    add_hoop_forces,
    add_shear_forces,
    update_belt_tension,
    update_cell_tension,
    update_generatrix_tension,
    update_hoop_tension,
    update_shear,
)
from softbrake.kernels.geometry import add_area_vectors, update_edges
from softbrake.kernels.jit import kernel
from softbrake.kernels.ledger import add_cell_work, add_edge_work, add_shear_work, update_top
from softbrake.kernels.motion import hold_row, push_cargo, push_row, vertical_force
from softbrake.kernels.pressure import pressure_at, update_damped_pressure
from softbrake.kernels.timestep import stable_step
from softbrake.state import History, Outcome, Peak, Scheme

ONE = uint64(1)
STEPS_PER_STEP_CHOICE = 16  # a choice costs about a step; at 650 m/s waves pass eight cells meanwhile
RUNAWAY = 4.0  # kinetic energy above this many times what start, gravity and pressure gave: it came from nowhere


@kernel
def sweep_rows(model, state, sweep, dt, step):
    """Advance fabric and cargo by one step, row by row from the ground up. Returns the cover's new height (m).

    Row i needs its cells above and below, so the sweep keeps two rows of cells and three of hoop edges. Rows are pushed in
    place as soon as their forces are whole: their old places live on in the edges.
    """
    n1, n2 = model.n1, model.n2
    stride = uint64(model.stride)
    fabric, belts = model.fabric, model.belts
    nodes, work, tops = state.nodes, state.work, sweep.tops
    g, h, force, area, mean = sweep.generatrix, sweep.hoop, sweep.force, sweep.area, sweep.mean
    edge_scheme = model.scheme == Scheme.EDGE
    shear = fabric.g12 > 0.0
    pressure = pressure_at(model.pressure, state.now[History.TIME])  # (2.10)
    state.now[History.PRESSURE] = pressure
    height = 0.0
    sweep.pressure[:] = pressure
    force.x[:] = 0.0
    force.y[:] = 0.0
    force.z[:] = 0.0
    area.x[:] = 0.0
    area.y[:] = 0.0
    area.z[:] = 0.0

    update_edges(nodes, h, uint64(0), ONE, uint64(0), n2 + 1, fabric.h2)  # (2.6)
    for i in range(n1 + 1):
        node = uint64(i) * stride + ONE
        row = uint64(i % 2) * stride + ONE  # of node vectors, and of the cells and generatrix edges above them
        above = uint64((i + 1) % 2) * stride + ONE  # of the next row of nodes, and of the cells below row i
        hoop = uint64(i % 3) * stride + ONE
        hoop_above = uint64((i + 1) % 3) * stride + ONE
        hoop_below = uint64((i + 2) % 3) * stride + ONE

        if i < n1:
            update_edges(nodes, g, node - ONE, stride, row - ONE, n2 + 2, fabric.h1)  # (2.6)
            update_edges(nodes, h, node + stride - ONE, ONE, hoop_above - ONE, n2 + 1, fabric.h2)
            add_area_vectors(nodes, area, node, stride, row, above, n2)  # (2.7)
            if edge_scheme:
                update_generatrix_tension(fabric, g, h, row, hoop, hoop_above, n2)  # (2.9)
                add_generatrix_forces(g, force, row, row, above, n2)  # (2.8)
            else:
                update_cell_tension(fabric, g, h, sweep.cells, row, hoop, hoop_above, row, n2)  # (2.9)
                add_cell_forces(
                    g, h, sweep.cells.force_1, sweep.cells.force_2, force, row, hoop, hoop_above, row, row, above, n2
                )  # (3.2)
                update_top(h.tension, hoop, tops.hoop, tops.hoop_row, i + 0.5, n2)
            update_top(g.tension, row, tops.generatrix, tops.generatrix_row, i + 0.5, n2)
            if shear:
                update_shear(fabric, g, h, sweep.cells, row, hoop, hoop_above, row, n2)
                add_shear_forces(g, h, sweep.cells.shear, force, row, hoop, hoop_above, row, row, above, n2)  # (2.2)

        belt = belts.width[i] > 0.0
        if 0 < i < n1:
            if edge_scheme:
                update_hoop_tension(fabric, h, g, hoop, above, row, n2)  # (2.9)
                add_hoop_forces(h, h.force, force, hoop, hoop, row, n2)  # (2.8)
                update_top(h.tension, hoop, tops.hoop, tops.hoop_row, float(i), n2)
            if belt:
                update_belt_tension(belts, i, h, g, sweep.belt, hoop, above, row, n2)  # (2.3)
                add_hoop_forces(h, sweep.belt.force, force, hoop, ONE, row, n2)
                update_top(sweep.belt.tension, ONE, tops.belt, tops.belt_row, float(i), n2)

        if model.pressure.damping > 0.0:
            update_damped_pressure(model.pressure, pressure, nodes, area, sweep.pressure, node, row, n2)  # (2.11)
        if i == 0:
            state.now[History.GROUND_FORCE] = (
                pressure * model.cover_area - vertical_force(sweep, row, n2) + n2 * model.mass[0] * model.gravity
            )
            hold_row(sweep, row, n2, 0.0)
        elif i < n1:
            push_row(model, nodes, sweep, work, model.mass[i], dt, step, node, row)  # (3.2), (3.4)
        else:
            height = push_cargo(model, state, sweep, model.mass[i], pressure, dt, step, node, row)  # (2.4)

        if i > 0:
            if edge_scheme:
                add_edge_work(g, g.force, g.elastic, mean, work.elastic, work.viscous, above, above, above, row, dt, n2)
            else:
                add_cell_work(g, h, sweep.cells, mean, work, above, hoop_below, hoop, above, above, row, dt, n2)
            if shear:
                add_shear_work(g, h, sweep.cells, mean, work, above, hoop_below, hoop, above, above, row, dt, n2)
        if 0 < i < n1:
            if edge_scheme:
                add_edge_work(h, h.force, h.elastic, mean, work.elastic, work.viscous, hoop, hoop, row, row + ONE, dt, n2)
            if belt:
                add_edge_work(
                    h, sweep.belt.force, sweep.belt.elastic, mean, work.belts, work.viscous, hoop, ONE, row, row + ONE, dt, n2
                )
        clear_row(force, row, n2)
        clear_row(area, row, n2)
    return height


@kernel
def clear_row(rows, first, columns):
    """Set a row of node vectors to zero, ready for the row after next."""
    for j in range(uint64(columns)):
        rows.x[first + j] = 0.0
        rows.y[first + j] = 0.0
        rows.z[first + j] = 0.0


@kernel
def clear_tops(sweep):
    """Forget the last step's largest tensions, kinetic energy and ground impulse."""
    sweep.tops.generatrix[:] = 0.0
    sweep.tops.hoop[:] = 0.0
    sweep.tops.belt[:] = 0.0
    sweep.kinetic[:] = 0.0
    sweep.impulse[:] = 0.0


@kernel
def raise_peak(peaks, which, value, time, row):
    """Keep a value with its time (s) and row if it is the largest so far."""
    if value > peaks[which, 0]:
        peaks[which, 0] = value
        peaks[which, 1] = time
        peaks[which, 2] = row


@kernel
def book_tops(model, state, sweep, dt):
    """Write the largest tensions and the ground force of the step to state.now, and raise state.peaks."""
    now, tops, peaks = state.now, sweep.tops, state.peaks
    time = now[History.TIME]
    j, k, m = 0, 0, 0
    impulse = 0.0
    for column in range(model.n2):
        impulse += sweep.impulse[column]
        if tops.generatrix[column] > tops.generatrix[j]:
            j = column
        if tops.hoop[column] > tops.hoop[k]:
            k = column
        if tops.belt[column] > tops.belt[m]:
            m = column
    now[History.GROUND_FORCE] += impulse / dt
    now[History.TENSION_GENERATRIX] = tops.generatrix[j]
    now[History.TENSION_HOOP] = tops.hoop[k]
    now[History.TENSION_BELT] = tops.belt[m]
    raise_peak(peaks, Peak.DECELERATION, now[History.ACCELERATION], time, float(model.n1))
    raise_peak(peaks, Peak.TENSION_GENERATRIX, tops.generatrix[j], time, tops.generatrix_row[j])
    raise_peak(peaks, Peak.TENSION_HOOP, tops.hoop[k], time, tops.hoop_row[k])
    raise_peak(peaks, Peak.TENSION_BELT, tops.belt[m], time, tops.belt_row[m])


@kernel
def book_energies(model, state, sweep):
    """Write kinetic energy and works at n+1/2 to state.now, for the row of time n+1."""
    now, work = state.now, state.work
    kinetic, pressure, elastic, viscous, belts, gravity, ground = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(model.n2):
        kinetic += sweep.kinetic[j]
        pressure += work.pressure[j]
        elastic += work.elastic[j]
        viscous += work.viscous[j]
        belts += work.belts[j]
        gravity += work.gravity[j]
        ground += work.ground[j]
    now[History.KINETIC_ENERGY] = kinetic
    now[History.WORK_PRESSURE] = pressure
    now[History.WORK_ELASTIC] = elastic
    now[History.WORK_VISCOUS] = viscous
    now[History.WORK_BELTS] = belts
    now[History.WORK_GRAVITY] = gravity
    now[History.WORK_GROUND] = ground


@kernel
def event_time(height, velocity, acceleration, step):
    """Return when within a step the cover first reaches the ground or stands still (s), and which: an Outcome.

    The motion of the leapfrog within a step: uniform acceleration from the place and velocity at its start.
    """
    if height + step * (velocity + 0.5 * step * acceleration) <= 0.0:
        discriminant = max(velocity * velocity - 2.0 * acceleration * height, 0.0)
        return 2.0 * height / (sqrt(discriminant) - velocity), Outcome.IMPACT
    if velocity <= 0.0 and velocity + step * acceleration > 0.0:
        return -velocity / acceleration, Outcome.STOPPED
    return step, Outcome.RUNNING


@kernel
def advance(model, state, sweep, history, interval, most, until):
    """Advance by steps until an event, the time until (s), most steps, or a full history. Returns its rows and the Outcome.

    Every interval-th step writes a row of state.now at its time n to history, shape (rows, len(History)), and an event one
    for its own time. The staggered start: the first half-step has no velocity at -1/2 to start from, but that at 0.
    """
    now = state.now
    rows = 0
    done = 0
    while done < most and now[History.TIME] < until and rows + 1 < history.shape[0]:
        if state.steps[0] % STEPS_PER_STEP_CHOICE == 0:
            state.stable_step[0] = stable_step(model, state.nodes, sweep)  # (3.3)
        left = model.end - now[History.TIME]
        step = min(model.courant * state.stable_step[0], left)
        dt = 0.5 * (state.last_step[0] + step)
        now[History.TIME_STEP] = step
        clear_tops(sweep)
        height = sweep_rows(model, state, sweep, dt, step)
        book_tops(model, state, sweep, dt)
        if state.steps[0] % interval == 0:
            history[rows] = now
            rows += 1
        book_energies(model, state, sweep)
        state.steps[0] += 1
        state.last_step[0] = step
        done += 1

        velocity, acceleration = now[History.VELOCITY], now[History.ACCELERATION]
        within, outcome = event_time(now[History.HEIGHT], velocity, acceleration, step)
        if outcome == Outcome.RUNNING and step == left:
            outcome = Outcome.TIME_LIMIT
        given = state.kinetic_start[0] + max(now[History.WORK_GRAVITY], 0.0) + max(now[History.WORK_PRESSURE], 0.0)
        if not now[History.KINETIC_ENERGY] <= RUNAWAY * given:
            outcome = Outcome.DIVERGED
        if outcome == Outcome.RUNNING:
            now[History.HEIGHT] = height
        else:
            now[History.HEIGHT] = max(now[History.HEIGHT] + within * (velocity + 0.5 * within * acceleration), 0.0)
        now[History.TIME] += within
        now[History.VELOCITY] = velocity + within * acceleration
        if outcome != Outcome.RUNNING:
            now[History.TIME_STEP] = 0.0
            history[rows] = now
            return rows + 1, outcome
    return rows, Outcome.RUNNING
