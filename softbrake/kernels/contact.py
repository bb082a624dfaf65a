"""Contact of the fabric with cover and cargo, node by node: unilateral, without friction or rebound."""

from math import sqrt

from numba import uint64

from softbrake.kernels.jit import kernel
from softbrake.kernels.motion import close_rows
from softbrake.state import PAD, History, Step

FIRST = uint64(PAD)
GAP = 1e-6  # m, least distance kept from the cover, so that the side on which cloth lies shows
BLOW = 100.0  # m/s^2, change of the cargo's acceleration from step to step that the gap allows for


@kernel
def foresee(now, velocity, gravity, sector, dt, length):
    """Return the Step from n to n+1: dt from n-1/2 to n+1/2 (s), length (s); velocity (m/s) of the cover at n-1/2.

    The cover moves last, by what presses on it; until then its next place is foreseen by its last acceleration.
    """
    cover = now[History.HEIGHT]
    next_cover = cover + length * (velocity + dt * now[History.ACCELERATION])
    return Step(dt, length, gravity, cover, next_cover, GAP + BLOW * dt * length, sector)


@kernel
def allowed_place(contact, gap, x, y, z, new_x, new_y, new_z):
    """Return the place nearest to a node's new one that cover and cargo leave it, heights counted from the cover.

    The cover is a disc, met from both sides; the cargo a cylinder standing on it, met at its side and top. Which face a node
    meets is the one it crosses on its way from its old place, so what was outside stays outside.

                    │ cargo │           side: moved out along the radius
             z = 0 ─┴───────┴─ cover    cover: held a gap above or below
    """
    side = 1.0 if z > 0.0 else -1.0
    if contact.cargo and x * x + y * y < (contact.cargo_radius - gap) ** 2 and z < 0.5 * contact.cargo_height:
        side = -1.0  # the cover moved a little otherwise than foreseen: nothing above it is here
    along_side = False  # from above past the rim of a cargo as wide as the cover
    if contact.cover and side * new_z < gap:
        share = (z - side * gap) / (z - new_z) if side * z > gap else 0.0
        across_x = x + share * (new_x - x)
        across_y = y + share * (new_y - y)
        if across_x * across_x + across_y * across_y < contact.cover_radius**2:
            along_side = side > 0.0 and contact.cargo == 1 and contact.cargo_radius >= contact.cover_radius
            new_z = new_z if along_side else side * gap
    if along_side or (contact.cargo and 0.0 < new_z < contact.cargo_height):
        radius = sqrt(new_x * new_x + new_y * new_y)
        if radius < contact.cargo_radius:
            if z >= contact.cargo_height:
                new_z = contact.cargo_height
            else:
                outwards = contact.cargo_radius / max(radius, gap)
                new_x *= outwards
                new_y *= outwards
    return new_x, new_y, new_z


@kernel
def press_row(nodes, area, pressure, mean, work, by_column, contact, step, mass, node, row, columns):
    """Hold a row of pushed nodes off cover and cargo, and mend velocities, means and works for the impulses that this takes.

    Reads area, pressure, step, mass as push_row. Writes nodes at offset node, mean at offset row; by_column.on_cargo (N s, of
    the nodes on cover and cargo, upwards), kinetic; work.
    """
    length = step.length
    near = 0
    for j in range(uint64(columns)):
        z = nodes.z[node + j]
        near |= int(z > step.next_cover - step.gap) | int(z - length * nodes.w[node + j] > step.cover - step.gap)
    if near == 0:
        return
    for j in range(uint64(columns)):
        a = node + j
        b = FIRST + j
        c = row + j
        u, v, w = nodes.u[a], nodes.v[a], nodes.w[a]
        x, y, z = nodes.x[a], nodes.y[a], nodes.z[a] - step.next_cover
        old_z = nodes.z[a] - length * w - step.cover
        new_x, new_y, new_z = allowed_place(contact, step.gap, x - length * u, y - length * v, old_z, x, y, z)
        change_u = (new_x - x) / length
        change_v = (new_y - y) / length
        change_w = (new_z - z) / length
        if change_u == 0.0 and change_v == 0.0 and change_w == 0.0:
            continue
        nodes.x[a] = new_x
        nodes.y[a] = new_y
        nodes.z[a] = new_z + step.next_cover
        nodes.u[a] = u + change_u
        nodes.v[a] = v + change_v
        nodes.w[a] = w + change_w
        mean.x[c] += 0.5 * change_u
        mean.y[c] += 0.5 * change_v
        mean.z[c] += 0.5 * change_w
        work.pressure[j] += 0.5 * step.dt * pressure[j] * (area.x[b] * change_u + area.y[b] * change_v + area.z[b] * change_w)
        work.gravity[j] -= 0.5 * step.dt * step.gravity * mass * change_w
        work.ground[j] += 0.5 * by_column.lift[j] * change_w
        work.contact[j] += mass * (change_u * mean.x[c] + change_v * mean.y[c] + change_w * mean.z[c])
        by_column.kinetic[j] += mass * (
            change_u * (u + 0.5 * change_u) + change_v * (v + 0.5 * change_v) + change_w * (w + 0.5 * change_w)
        )
        by_column.on_cargo[j] -= mass * change_w
    close_rows(nodes, mean, step.sector, node, row, columns)
