"""New velocities and places of fabric and cargo: Eqs. (2.4), (3.2), (3.4)."""

from numba import uint64

from softbrake.kernels.jit import kernel
from softbrake.state import History

ONE = uint64(1)


@kernel
def push_row(model, nodes, sweep, work, mass, dt, step, node, row):
    """Push a row of free nodes from n to n+1, the ground stopping them. Eqs. (3.2), (3.4); first line of (3.2) with P F.

    V^{n+1/2} = V^{n-1/2} + dt (T + p S)/mass - dt g;  x^{n+1} = x^n + step V^{n+1/2}; where z^{n+1} would be negative the
    ground's impulse leaves z^{n+1} = 0.
    Reads sweep.force, area at offset row, sweep.pressure; dt (s): from n-1/2 to n+1/2; step (s): from n to n+1.
    Writes nodes at offset node with the copies at both ends of the row; sweep.mean, kinetic, impulse; work.
    """
    per_mass = dt / mass
    weight = dt * model.gravity
    per_step = 1.0 / step
    for j in range(uint64(model.n2)):
        a = node + j
        b = row + j
        pressure = sweep.pressure[j]
        u = nodes.u[a] + per_mass * (sweep.force.x[b] + pressure * sweep.area.x[b])
        v = nodes.v[a] + per_mass * (sweep.force.y[b] + pressure * sweep.area.y[b])
        free = nodes.w[a] + per_mass * (sweep.force.z[b] + pressure * sweep.area.z[b]) - weight
        w = max(free, -nodes.z[a] * per_step)
        mean_u = 0.5 * (nodes.u[a] + u)
        mean_v = 0.5 * (nodes.v[a] + v)
        mean_w = 0.5 * (nodes.w[a] + w)
        work.pressure[j] += (
            dt * pressure * (sweep.area.x[b] * mean_u + sweep.area.y[b] * mean_v + sweep.area.z[b] * mean_w)
        )
        work.gravity[j] -= weight * mass * mean_w
        work.ground[j] += mass * (w - free) * mean_w
        sweep.impulse[j] += mass * (w - free)
        sweep.kinetic[j] += 0.5 * mass * (u * u + v * v + w * w)
        sweep.mean.x[b] = mean_u
        sweep.mean.y[b] = mean_v
        sweep.mean.z[b] = mean_w
        nodes.u[a] = u
        nodes.v[a] = v
        nodes.w[a] = w
        nodes.x[a] += step * u
        nodes.y[a] += step * v
        nodes.z[a] = max(nodes.z[a] + step * w, 0.0)
    close_row(nodes.x, node, model.n2)
    close_row(nodes.y, node, model.n2)
    close_row(nodes.z, node, model.n2)
    close_row(nodes.u, node, model.n2)
    close_row(nodes.v, node, model.n2)
    close_row(nodes.w, node, model.n2)
    close_row(sweep.mean.x, row, model.n2)
    close_row(sweep.mean.y, row, model.n2)
    close_row(sweep.mean.z, row, model.n2)


@kernel
def close_row(values, first, columns):
    """Copy the last column in front of a row and the first one behind it."""
    values[first - ONE] = values[first + uint64(columns) - ONE]
    values[first + uint64(columns)] = values[first]


@kernel
def hold_row(sweep, row, columns, velocity):
    """Set the mean velocity of a row on a cover: it moves with the cover. Writes sweep.mean (m/s) at offset row."""
    for j in range(uint64(columns + 2)):
        a = row - ONE + j
        sweep.mean.x[a] = 0.0
        sweep.mean.y[a] = 0.0
        sweep.mean.z[a] = velocity


@kernel
def vertical_force(sweep, row, columns):
    """Return the vertical force (N) of tensions and pressure on the nodes of a row on a cover."""
    total = 0.0
    for j in range(uint64(columns)):
        total += sweep.force.z[row + j] + sweep.pressure[j] * sweep.area.z[row + j]
    return total


@kernel
def push_cargo(model, state, sweep, mass, pressure, dt, step, node, row):
    """Push cargo, upper cover and the row of fabric on it from n to n+1. Eq. (2.4), (3.4).

    (2.4) with the pull of the fabric, and the pressure on the half cell below the cover, from the row's forces.
    Reads mass (kg) of a node of the row; pressure (Pa): p~. Writes state.now: height, velocity, acceleration, cover force;
    nodes at offset node; sweep.mean, kinetic; work. Returns the new height (m).
    """
    now = state.now
    columns = model.n2
    total = model.cargo_mass + columns * mass
    gas = pressure * model.cover_area
    by_area = 0.0
    for j in range(uint64(columns)):
        by_area += sweep.pressure[j] * sweep.area.z[row + j]
    now[History.COVER_FORCE] = gas + vertical_force(sweep, row, columns)
    now[History.ACCELERATION] = now[History.COVER_FORCE] / total - model.gravity
    old = state.nodes.w[node]
    new = old + dt * now[History.ACCELERATION]
    now[History.VELOCITY] = new - 0.5 * step * now[History.ACCELERATION]
    height = now[History.HEIGHT] + step * new
    mean = 0.5 * (old + new)
    hold_row(sweep, row, columns, mean)
    state.work.pressure[0] += dt * (gas + by_area) * mean
    state.work.gravity[0] -= dt * model.gravity * total * mean
    sweep.kinetic[0] += 0.5 * total * new * new
    for j in range(uint64(columns + 2)):
        state.nodes.z[node - ONE + j] = height
        state.nodes.w[node - ONE + j] = new
    return height
