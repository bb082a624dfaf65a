"""Contact of the fabric with ground, cover, cargo and axis, node by node: unilateral, without rebound.

All that is known of arrays.Obstacles: where a node may be, what it lies on, which direction that blocks; and the rows that are
held off them.
"""

from math import inf, sqrt

from numba import uint64

from softbrake.core.arrays import Obstacles, Step
from softbrake.core.columns import History
from softbrake.core.contact.constants import ACCELERATION_JUMP, GAP, LAST_GAP, LAST_SPACE, LYING
from softbrake.core.jit import kernel
from softbrake.core.lanes import FIRST, close_nodes, close_vectors, lanes

SMALLEST_FORCE = 1e-30  # N


@kernel
def foresee(now, velocity, gravity, dt, length):
    """Return the Step from n to n+1: dt from n-1/2 to n+1/2 (s), length (s); velocity (m/s) of the cover at n-1/2.

    The cover moves last, by what presses on it; until then its next place is foreseen by its last acceleration. To the fabric it
    ends on the ground, where nothing is left between the two.
    """
    cover = now[History.HEIGHT]
    next_cover = max(cover + length * (velocity + dt * now[History.ACCELERATION]), LAST_SPACE)
    return Step(dt, length, gravity, cover, next_cover, min(GAP + ACCELERATION_JUMP * dt * length, LAST_GAP * next_cover))


@kernel
def may_touch(obstacles):
    """Return whether the fabric may touch cover or cargo."""
    return obstacles.cover == 1 or obstacles.cargo == 1


@kernel
def end_on_ground(nodes, obstacles, before, within):
    """Put the nodes where cover and ground leave them at an impact: on the ground if they were below the cover, else above it.

    They go evenly through the step, the cover does not stop at the ground in it. before: height of the cover at n (m); within:
    time since then (s). Writes nodes, as they are at the impact.
    """
    for a in range(nodes.z.size):
        if nodes.x[a] ** 2 + nodes.y[a] ** 2 < obstacles.cover_radius**2:
            below = nodes.z[a] - within * nodes.w[a] < before
            nodes.z[a] = min(nodes.z[a], 0.0) if below else max(nodes.z[a], 0.0)


@kernel
def in_the_way(obstacles, touching):
    """Return the Obstacles without cover and cargo, unless these may be touched."""
    there = int(touching)
    cover, cargo = obstacles.cover * there, obstacles.cargo * there
    ground, radius, axis = obstacles.ground, obstacles.cargo_radius, obstacles.axis
    return Obstacles(ground, obstacles.friction, cover, obstacles.cover_radius, cargo, radius, obstacles.cargo_height, axis)


@kernel
def least_radius(obstacles):
    """Return the least radius (m) that the axis leaves a node of a meridian: -inf without it."""
    return GAP if obstacles.axis == 1 else -inf


@kernel
def heights_below(step):
    """Return the heights (m) at n and n+1 up to which a node is below the cover, less the gap."""
    return step.cover - step.gap, step.next_cover - step.gap


@kernel
def reaches_up(step, z, w):
    """Return whether a pushed node at z (m) with w (m/s) is above the cover (less the gap), or was before the step."""
    return max(z - step.next_cover, z - step.length * w - step.cover) > -step.gap


@kernel
def allowed_place(obstacles, gap, x, y, z, new_x, new_y, new_z):
    """Return the place nearest to a node's new one that cover and cargo leave it (m), heights counted from the cover.

    The cover is a disc with two sides; the cargo a cylinder standing on it, with a side and a top. A node is held at the face
    that it crosses on its way from its old place, so what was outside stays outside.

                    ┌───────┐           top: held a gap above
                    │ cargo │           side: moved out along the radius
             z = 0 ─┴───────┴─ cover    cover: held a gap above or below
    """
    side = 1.0 if z > 0.0 else -1.0
    top, from_above = obstacles.cargo_height, z > obstacles.cargo_height
    if obstacles.cargo and x * x + y * y < (obstacles.cargo_radius - gap) ** 2 and not from_above:
        # The cover moved a little otherwise than foreseen: nothing between it and the top is here, but what lies on them.
        from_above = z >= 0.5 * top
        side = 1.0 if from_above else -1.0
    along_side = False  # from above past the rim of a cargo as wide as the cover
    if obstacles.cover and side * new_z < gap:
        share = (z - side * gap) / (z - new_z) if side * z > gap else 0.0
        across_x = x + share * (new_x - x)
        across_y = y + share * (new_y - y)
        if across_x * across_x + across_y * across_y < obstacles.cover_radius**2:
            along_side = side > 0.0 and obstacles.cargo == 1 and obstacles.cargo_radius >= obstacles.cover_radius
            new_z = new_z if along_side else side * gap
    if along_side or (obstacles.cargo and 0.0 < new_z < top + gap):
        radius = sqrt(new_x * new_x + new_y * new_y)
        if radius < obstacles.cargo_radius:
            share = (z - top - gap) / (z - new_z) if z > top + gap else 0.0
            across_x = x + share * (new_x - x)
            across_y = y + share * (new_y - y)
            if new_z > top or (from_above and across_x * across_x + across_y * across_y < obstacles.cargo_radius**2):
                new_z = top + gap
            else:
                outwards = obstacles.cargo_radius / max(radius, gap)
                new_x *= outwards
                new_y *= outwards
    return new_x, new_y, new_z


@kernel
def place_left(obstacles, step, start, end):
    """Return what obstacles add to a node's way (m) from start to end, in x, y, z; and of z what cover and cargo, and the ground.

    Nothing where they leave it its place. Reads step: a Step between start and end.
    """
    x, y, z = end
    new_x, new_y, new_z, least = x, y, z - step.next_cover, least_radius(obstacles)
    if max(z - step.next_cover, start[2] - step.cover) > -step.gap:
        new_x, new_y, new_z = allowed_place(obstacles, step.gap, start[0], start[1], start[2] - step.cover, x, y, new_z)
    on_cargo = new_z - (z - step.next_cover)
    new_x = max(new_x, least)
    on_ground = max(obstacles.ground - (z + on_cargo), 0.0)
    return new_x - x, new_y - y, on_cargo + on_ground, on_cargo, on_ground


@kernel
def on_ground(obstacles, z):
    """Return whether a node at the height z (m) lies on the ground."""
    return z <= obstacles.ground


@kernel
def on_cover(obstacles, step, x, y, above):
    """Return whether a node at x, y, and so much above the cover (m), lies on it."""
    return obstacles.cover == 1 and abs(above) <= (1.0 + LYING) * step.gap and x * x + y * y < obstacles.cover_radius**2


@kernel
def on_cargo(obstacles, step, x, y, above):
    """Return whether a node at x, y, and so much above the cover (m), lies at the cargo's side, or on it."""
    beside = x * x + y * y <= ((1.0 + LYING) * obstacles.cargo_radius) ** 2
    return obstacles.cargo == 1 and beside and 0.0 < above <= obstacles.cargo_height + step.gap


@kernel
def on_cover_or_cargo(obstacles, step, x, y, z):
    """Return whether a node at x, y, z (m) lies on the cover, or on the cargo or at its side."""
    above = z - step.next_cover
    return on_cover(obstacles, step, x, y, above) or on_cargo(obstacles, step, x, y, above)


@kernel
def add_free_area(nodes, area, free, obstacles, step, node, place, count, part):
    """Add a part of the areas (m^2) of pushed nodes that lie on nothing to free: gas may leak there.

    Reads nodes from node on, area from place on. A crease counts by its area vector, shorter than the cloth in it.
    """
    for j in range(uint64(count)):
        a, b = node + j, place + j
        x, y, z = nodes.x[a], nodes.y[a], nodes.z[a]
        if not (on_ground(obstacles, z) or on_cover_or_cargo(obstacles, step, x, y, z)):
            free[j] += part * sqrt(area.x[b] * area.x[b] + area.y[b] * area.y[b] + area.z[b] * area.z[b])


@kernel
def blocked_part(obstacles, step, x, y, z, direction):
    """Return the part of a unit vector along the outward normal of what a node at x, y, z (m) lies on: blocked if negative.

    One face only, looked for in this order: ground, cover, cargo, axis. 0 where it lies on none.
    """
    nx, ny, nz = direction
    above = z - step.next_cover
    part = 0.0
    if on_ground(obstacles, z):
        part = nz
    elif on_cover(obstacles, step, x, y, above):
        part = nz if above > 0.0 else -nz
    elif on_cargo(obstacles, step, x, y, above):
        part = nz if above > obstacles.cargo_height else (x * nx + y * ny) / obstacles.cargo_radius
    elif x <= (1.0 + LYING) * least_radius(obstacles):
        part = nx
    return part


@kernel
def any_above(z, w, step, node, columns):
    """Return whether a node of a pushed row is above the cover (less the gap), or was before the step. Reads z (m), w (m/s)."""
    length, (before, now) = step.length, heights_below(step)
    above = 0
    for j in range(uint64(columns)):
        above |= int(z[node + j] > now) | int(z[node + j] - length * w[node + j] > before)
    return above > 0


@kernel
def any_below(z, ground, node, columns):
    """Return whether a node of a row is below the ground (m)."""
    below = 0
    for j in range(uint64(columns)):
        below |= int(z[node + j] < ground)
    return below > 0


# Kernels of a row take as many arrays as push_row, whose order they keep: a tuple of them would be of one use only.


@kernel
def land_row(nodes, area, pressure, mean, work, by_column, ground, step, mass, node, row, columns):
    """Stop a row of pushed nodes at the ground (m): where z^{n+1} would be below it, its impulse leaves it there. Eq. (3.4).

    Reads and writes as push_row, at offsets node, row; by_column.ground_impulse (N s).
    """
    dt, per_length, weight = step.dt, 1.0 / step.length, step.gravity * mass
    for j in range(lanes(columns)):
        a = node + j
        c = row + j
        rise = max((ground - nodes.z[a]) * per_length, 0.0)
        half = 0.5 * rise
        area_z = area.z[FIRST + j]
        mean.z[c] += half
        work.pressure[j] += dt * pressure[j] * area_z * half
        work.gravity[j] -= dt * weight * half
        work.ground[j] += mass * rise * mean.z[c]
        by_column.kinetic[j] += mass * rise * (nodes.w[a] + half)
        by_column.ground_impulse[j] = mass * rise
        by_column.impulse[j] += mass * rise
        by_column.on_ground[j] += lying_area(-min(area_z, 0.0), pressure[j], weight, mass * rise / dt)
        nodes.w[a] += rise
        nodes.z[a] = max(nodes.z[a], ground)


@kernel
def lying_area(area, pressure, weight, force):
    """Return how much of a node's area (m^2) lies on the ground, by the part of gas and weight (N) that the ground bears there.

    Cloth lies under its own load; where it lifts off within a cell, tension bears the rest.
    """
    return area * min(force / max(pressure * area + weight, SMALLEST_FORCE), 1.0)


@kernel
def press_row(nodes, jump, area, pressure, mean, work, by_column, obstacles, step, mass, node, row, columns):
    """Hold a row of pushed nodes off cover and cargo, and rub it on the cover.

    Reads step: a Step; mass (kg) of a node. Writes nodes at offset node; by_column.on_cargo (N s, of the nodes on cover and
    cargo, upwards); work.contact; jump: scratch.
    """
    xs, ys, zs, us, vs, ws = nodes.x, nodes.y, nodes.z, nodes.u, nodes.v, nodes.w
    jump_x, jump_y, jump_z, on_cargo = jump.x, jump.y, jump.z, by_column.on_cargo
    length, cover, next_cover, gap, friction = step.length, step.cover, step.next_cover, step.gap, obstacles.friction
    per_length = 1.0 / length
    for j in range(uint64(columns)):
        u, v, w = us[node + j], vs[node + j], ws[node + j]
        x, y, z = xs[node + j], ys[node + j], zs[node + j] - next_cover
        old_z = zs[node + j] - length * w - cover
        new_x, new_y, new_z = allowed_place(obstacles, gap, x - length * u, y - length * v, old_z, x, y, z)
        jump_u, jump_v, jump_w = (new_x - x) * per_length, (new_y - y) * per_length, (new_z - z) * per_length
        if friction > 0.0 and abs(new_z) == gap:  # on the cover
            left = slowed(u + jump_u, v + jump_v, friction * abs(jump_w))
            jump_u = left * (u + jump_u) - u
            jump_v = left * (v + jump_v) - v
        jump_x[FIRST + j] = jump_u
        jump_y[FIRST + j] = jump_v
        jump_z[FIRST + j] = jump_w
        on_cargo[j] -= mass * jump_w
    stop_row(nodes, jump, area, pressure, mean, work, by_column, step, mass, node, row, columns)


@kernel
def slowed(u, v, most):
    """Return what friction leaves of a velocity along a level face, of one, where it takes off at most so much (m/s)."""
    speed = sqrt(u * u + v * v)
    return 1.0 - min(most / speed, 1.0) if speed > 0.0 else 1.0


@kernel
def rub_row(nodes, jump, area, pressure, mean, work, by_column, obstacles, step, mass, node, row, columns):
    """Slow what the ground stopped in the push of a row, by Coulomb's law.

    Reads by_column.ground_impulse (N s); jump: scratch.
    """
    u, v, jump_x, jump_y, jump_z, ground_impulse = nodes.u, nodes.v, jump.x, jump.y, jump.z, by_column.ground_impulse
    most = obstacles.friction / mass
    for j in range(uint64(columns)):
        lost = slowed(u[node + j], v[node + j], most * ground_impulse[j]) - 1.0
        jump_x[FIRST + j] = lost * u[node + j]
        jump_y[FIRST + j] = lost * v[node + j]
        jump_z[FIRST + j] = 0.0
    stop_row(nodes, jump, area, pressure, mean, work, by_column, step, mass, node, row, columns)


@kernel
def stop_row(nodes, jump, area, pressure, mean, work, by_column, step, mass, node, row, columns):
    """Give a row of nodes jumps of velocity (m/s) within the step that pushed them: half of each is in the means of the step.

    Books what that changes of the works of gas, weight and ground; those of the tensions follow from the means.
    Writes nodes, mean, work, by_column.kinetic.
    """
    length, dt, weight = step.length, step.dt, step.dt * step.gravity * mass
    for j in range(uint64(columns)):
        a = node + j
        b = FIRST + j
        c = row + j
        u, v, w = jump.x[b], jump.y[b], jump.z[b]
        half_u, half_v, half_w = 0.5 * u, 0.5 * v, 0.5 * w
        work.pressure[j] += dt * pressure[j] * (area.x[b] * half_u + area.y[b] * half_v + area.z[b] * half_w)
        work.gravity[j] -= weight * half_w
        work.ground[j] += by_column.ground_impulse[j] * half_w
        by_column.kinetic[j] += mass * (u * (nodes.u[a] + half_u) + v * (nodes.v[a] + half_v) + w * (nodes.w[a] + half_w))
        mean.x[c] += half_u
        mean.y[c] += half_v
        mean.z[c] += half_w
        work.contact[j] += mass * (u * mean.x[c] + v * mean.y[c] + w * mean.z[c])
        change_velocity(nodes, a, length, u, v, w)
    close_nodes(nodes, node, columns)
    close_vectors(mean, row, columns)


@kernel
def change_velocity(nodes, a, length, u, v, w):
    """Change the velocity of node a by u, v, w (m/s) and its place by what that makes in a step (s)."""
    nodes.x[a] += length * u
    nodes.y[a] += length * v
    nodes.z[a] += length * w
    nodes.u[a] += u
    nodes.v[a] += v
    nodes.w[a] += w
