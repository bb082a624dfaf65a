"""New velocities and places of the fabric: Eqs. (3.2), (3.4)."""

from softbrake.core.contact.obstacles import any_below, land_row
from softbrake.core.jit import kernel
from softbrake.core.lanes import FIRST, ONE, close_nodes, close_vectors, lanes


# Kernels of a row have long parameter lists; softbrake/core/__init__.py says why.
@kernel
def push_row(nodes, force, area, pressure, mean, work, by_column, obstacles, step, mass, node, row, columns):
    """Push a row of free nodes from n to n+1, the ground stopping them. Eqs. (3.2), (3.4).

    V^{n+1/2} = V^{n-1/2} + dt (force + pressure area)/mass - dt g;  x^{n+1} = x^n + length V^{n+1/2}.
    Reads force (N), area (m^2), pressure (Pa) of the row; step: a Step; mass (kg) of a node.
    Writes nodes at offset node with the copies at both ends of the row; mean at offset row; by_column; work.
    """
    dt, length = step.dt, step.length
    per_mass, half = dt / mass, 0.5 * dt / mass
    weight = step.gravity * mass
    for j in range(lanes(columns)):
        a = node + j
        b = FIRST + j
        c = row + j
        gas_x, gas_y, gas_z = pressure[j] * area.x[b], pressure[j] * area.y[b], pressure[j] * area.z[b]
        force_x, force_y, force_z = force.x[b] + gas_x, force.y[b] + gas_y, force.z[b] + gas_z - weight
        mean_u, u = nodes.u[a] + half * force_x, nodes.u[a] + per_mass * force_x
        mean_v, v = nodes.v[a] + half * force_y, nodes.v[a] + per_mass * force_y
        mean_w, w = nodes.w[a] + half * force_z, nodes.w[a] + per_mass * force_z
        work.pressure[j] += dt * (gas_x * mean_u + gas_y * mean_v + gas_z * mean_w)
        work.gravity[j] -= dt * weight * mean_w
        by_column.kinetic[j] += 0.5 * mass * (u * u + v * v + w * w)
        by_column.ground_impulse[j] = 0.0
        mean.x[c] = mean_u
        mean.y[c] = mean_v
        mean.z[c] = mean_w
        nodes.u[a] = u
        nodes.v[a] = v
        nodes.w[a] = w
        nodes.x[a] += length * u
        nodes.y[a] += length * v
        nodes.z[a] += length * w
    if any_below(nodes.z, obstacles.ground, node, columns):
        land_row(nodes, area, pressure, mean, work, by_column, obstacles.ground, step, mass, node, row, columns)
    close_nodes(nodes, node, columns)
    close_vectors(mean, row, columns)


@kernel
def hold_row(mean, row, columns, velocity):
    """Set the mean velocity (m/s) of a row that moves with its cover. Writes mean at offset row."""
    for j in range(lanes(columns + 2)):
        a = row - ONE + j
        mean.x[a] = 0.0
        mean.y[a] = 0.0
        mean.z[a] = velocity


@kernel
def move_cover_row(nodes, node, columns, velocity, height):
    """Move the row of fabric on the cover to a height (m) at a velocity (m/s). Writes nodes at offset node."""
    for j in range(lanes(columns + 2)):
        nodes.z[node - ONE + j] = height
        nodes.w[node - ONE + j] = velocity
