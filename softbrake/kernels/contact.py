"""Contact of the fabric with ground, cover and cargo, node by node: unilateral, without rebound."""

from math import sqrt

from numba import uint64

from softbrake.kernels.jit import kernel
from softbrake.kernels.motion import close_nodes
from softbrake.state import PAD

FIRST = uint64(PAD)
GAP = 1e-6  # m, least distance kept from the cover, so that the side on which cloth lies shows


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
def jolt(nodes, work, by_column, a, j, mass, length, change_u, change_v, change_w):
    """Give node a of column j a jump of velocity (m/s), and its place what that changes by n+1.

    All contact but the ground's own acts so, at n+1/2 after the push: an impulse in no time, on which no other force does work.
    Writes nodes; work.contact, by_column.kinetic (J).
    """
    nodes.x[a] += length * change_u
    nodes.y[a] += length * change_v
    nodes.z[a] += length * change_w
    power = change_u * (nodes.u[a] + 0.5 * change_u) + change_v * (nodes.v[a] + 0.5 * change_v)
    gain = mass * (power + change_w * (nodes.w[a] + 0.5 * change_w))
    work.contact[j] += gain
    by_column.kinetic[j] += gain
    nodes.u[a] += change_u
    nodes.v[a] += change_v
    nodes.w[a] += change_w


@kernel
def rub(nodes, work, by_column, a, j, mass, length, impulse):
    """Slow a node along a level face by at most an impulse (N s). Coulomb's law: friction times the one that presses it on."""
    speed = sqrt(nodes.u[a] * nodes.u[a] + nodes.v[a] * nodes.v[a])
    if speed > 0.0:
        part = min(impulse / (mass * speed), 1.0)
        jolt(nodes, work, by_column, a, j, mass, length, -part * nodes.u[a], -part * nodes.v[a], 0.0)


@kernel
def rub_row(nodes, work, by_column, contact, step, mass, node, columns):
    """Slow what the ground stopped in the push of a row. Reads by_column.lift (N s)."""
    for j in range(uint64(columns)):
        if by_column.lift[j] > 0.0:
            rub(nodes, work, by_column, node + j, j, mass, step.length, contact.friction * by_column.lift[j])
    close_nodes(nodes, node, columns)


@kernel
def press_row(nodes, work, by_column, contact, step, mass, node, columns):
    """Hold a row of pushed nodes off cover and cargo.

    Reads step: a Step; mass (kg) of a node. Writes nodes at offset node; by_column.on_cargo (N s, of the nodes on cover and
    cargo, upwards); work.contact.
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
        u, v, w = nodes.u[a], nodes.v[a], nodes.w[a]
        x, y, z = nodes.x[a], nodes.y[a], nodes.z[a] - step.next_cover
        old_z = nodes.z[a] - length * w - step.cover
        new_x, new_y, new_z = allowed_place(contact, step.gap, x - length * u, y - length * v, old_z, x, y, z)
        if new_x != x or new_y != y or new_z != z:
            change_w = (new_z - z) / length
            jolt(nodes, work, by_column, a, j, mass, length, (new_x - x) / length, (new_y - y) / length, change_w)
            by_column.on_cargo[j] -= mass * change_w
            if contact.friction > 0.0 and abs(new_z) == step.gap:  # on the cover
                rub(nodes, work, by_column, a, j, mass, length, contact.friction * mass * abs(change_w))
    close_nodes(nodes, node, columns)
