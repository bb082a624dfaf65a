"""Contact of the fabric on both sides of a belt with itself: condition (2.5)."""

from math import sqrt

from numba import uint64

from softbrake.core.arrays import Impulses
from softbrake.core.contact.constants import GAP, NEARLY_SQUARE, OPPOSED
from softbrake.core.contact.impulses import add_velocity_jump, hold_node
from softbrake.core.contact.scene import scene_of_meridian, scene_of_shell
from softbrake.core.jit import kernel
from softbrake.core.lanes import FIRST, ONE, close_nodes


@kernel
def inward_normal(nodes, node, stride):
    """Return the unit normal m towards the gas at a node, as (2.5) and Fig. 3 have it, by central differences.

    Zero where the cloth has no area.
    """
    x1 = nodes.x[node + stride] - nodes.x[node - stride]
    y1 = nodes.y[node + stride] - nodes.y[node - stride]
    z1 = nodes.z[node + stride] - nodes.z[node - stride]
    x2 = nodes.x[node + ONE] - nodes.x[node - ONE]
    y2 = nodes.y[node + ONE] - nodes.y[node - ONE]
    z2 = nodes.z[node + ONE] - nodes.z[node - ONE]
    x, y, z = y1 * z2 - z1 * y2, z1 * x2 - x1 * z2, x1 * y2 - y1 * x2
    length = sqrt(x * x + y * y + z * z)
    scale = 1.0 / length if length > 0.0 else 0.0
    return x * scale, y * scale, z * scale


@kernel
def deviation(nodes, node, stride, rows, columns):
    """Return delta = I2/2 (m): how far the cloth rises from its tangent plane at M towards the gas, at N. (2.5), Fig. 3.

    I2 = b11 da1^2 + 2 b12 da1 da2 + b22 da2^2 with b_ik = m r_ik by central differences; N is so many rows up, columns around.

                    m
                    ↑     N      P: foot of N on the tangent plane
             ───────M─────P──    delta = PN > 0: the cloth bulges away from what touches it at M
    """
    mx, my, mz = inward_normal(nodes, node, stride)
    b11 = bend(nodes, node, stride, mx, my, mz)
    b22 = bend(nodes, node, ONE, mx, my, mz)
    rising = component(nodes, node + stride + ONE, mx, my, mz) + component(nodes, node - stride - ONE, mx, my, mz)
    falling = component(nodes, node + stride - ONE, mx, my, mz) + component(nodes, node - stride + ONE, mx, my, mz)
    b12 = 0.25 * (rising - falling)
    return 0.5 * (b11 * rows * rows + 2.0 * b12 * rows * columns + b22 * columns * columns)


@kernel
def bend(nodes, node, stride, mx, my, mz):
    """Return m r_ii da_i^2 (m) along the line to the neighbours a stride away."""
    outer = component(nodes, node + stride, mx, my, mz) + component(nodes, node - stride, mx, my, mz)
    return outer - 2.0 * component(nodes, node, mx, my, mz)


@kernel
def component(nodes, node, mx, my, mz):
    """Return a node's place (m) along a unit vector."""
    return mx * nodes.x[node] + my * nodes.y[node] + mz * nodes.z[node]


@kernel
def separate_nodes(nodes, impulses, scene, lower, upper, slot, way):
    """Keep two nodes apart along a unit vector, the way from the lower to the upper one. Returns 1 if they touch, else 0.

    What was a gap apart stays so, what was nearer comes no nearer: resting is always allowed, so no energy arises. Obstacles
    have the last word. Reads scene. Writes nodes, impulses, works to its slot.
    """
    length, mass, sheet = scene.step.length, scene.mass, scene.sheet
    cx, cy, cz = way
    mass_lower, mass_upper = mass[int(lower) // sheet.stride], mass[int(upper) // sheet.stride]
    apart = component(nodes, upper, cx, cy, cz) - component(nodes, lower, cx, cy, cz)
    closing = length * (
        cx * (nodes.u[lower] - nodes.u[upper]) + cy * (nodes.v[lower] - nodes.v[upper]) + cz * (nodes.w[lower] - nodes.w[upper])
    )
    missing = min(GAP, apart + closing) - apart
    if missing < 0.0:
        return 0
    impulse = missing / (length * (1.0 / mass_lower + 1.0 / mass_upper))
    for node, m, side in ((lower, mass_lower, -1.0), (upper, mass_upper, 1.0)):
        change = side * impulse / m
        add_velocity_jump(nodes, impulses, node, slot, m, length, change * cx, change * cy, change * cz)
        hold_node(nodes, impulses, scene, node, slot)
    return 1


@kernel
def between(nodes, a, b, stride):
    """Return the product (m^2) of the edges from the belt to M1 and M2, nodes a and b, and their squared lengths."""
    belt_1, belt_2 = a + stride, b - stride
    x1, y1, z1 = nodes.x[a] - nodes.x[belt_1], nodes.y[a] - nodes.y[belt_1], nodes.z[a] - nodes.z[belt_1]
    x2, y2, z2 = nodes.x[b] - nodes.x[belt_2], nodes.y[b] - nodes.y[belt_2], nodes.z[b] - nodes.z[belt_2]
    return x1 * x2 + y1 * y2 + z1 * z2, x1 * x1 + y1 * y1 + z1 * z1, x2 * x2 + y2 * y2 + z2 * z2


@kernel
def folded(nodes, a, b, stride):
    """Return whether the cloth at M1 and M2, nodes a and b, leaves the belt in directions less than a right angle apart."""
    return between(nodes, a, b, stride)[0] > 0.0


@kernel
def may_fold(nodes, belt_contact, stride, columns):
    """Return whether cloth may be folded over a belt after the step: where it leaves one in directions less than 96° apart.

    To get there from more it would have to move by a tenth of a cell in a step, at hundreds of m/s beside the belt.
    """
    some = 0
    for k in range(belt_contact.below.size):
        a, b = uint64(belt_contact.below[k]) * stride + FIRST, uint64(belt_contact.above[k]) * stride + FIRST
        for j in range(uint64(columns)):
            product, square_1, square_2 = between(nodes, a + j, b + j, stride)
            some |= int(product > 0.0) | int(NEARLY_SQUARE * product * product < square_1 * square_2)
    return some > 0


@kernel
def any_folded(nodes, a, b, stride, columns):
    """Return whether the cloth folds over the belt anywhere between two rows next to it: see folded."""
    some = 0
    for j in range(uint64(columns)):
        some |= int(folded(nodes, a + j, b + j, stride))
    return some > 0


@kernel
def resolve_belt_contact(model, nodes, work, by_column, before_contact, step, touching):
    """Keep the sub-regions G1 below and G2 above each belt out of one another. Condition (2.5).

    Where the lobes fold over the belt, their normals m1, m2 are opposed, and the rows M1, M2 next to the belt may touch: they are
    kept apart along m2 - m1. Where they do, N1 and N2 beyond them, on the same generatrix and on those beside it, must deviate
    to their own sides, delta1 > 0 and delta2 > 0; where one does not, N1 and N2 are kept apart as well. Lobes that touch further
    out are not seen: that is self-contact.

           N1 ── M1 ┐      gas below, m1 downwards
                    B      belt
           N2 ── M2 ┘      gas above, m2 upwards

    Reads model, step; touching: whether cover and cargo are in the way. Writes nodes, work.contact; by_column.kinetic;
    before_contact.impulse; scratch in the places of before_contact.before.
    """
    stride, columns, belt_contact = uint64(model.stride), model.n2, model.belt_contact
    scene = scene_of_shell(model, step, touching)
    impulses, ways = Impulses(work.contact, by_column.kinetic, before_contact.impulse), before_contact.before
    half = 0.5 * model.shape.side  # sine of half the angle between two generatrices
    cos, sin = 1.0 - 2.0 * half * half, 2.0 * half * sqrt(1.0 - half * half)
    for k in range(belt_contact.below.size):
        row_1, row_2 = belt_contact.below[k], belt_contact.above[k]
        start_1, start_2 = uint64(row_1) * stride + FIRST, uint64(row_2) * stride + FIRST
        if not any_folded(nodes, start_1, start_2, stride, columns):
            continue
        find_ways(nodes, ways, start_1, start_2, stride, columns)
        moved = 0
        for j in range(columns):
            a, b = start_1 + uint64(j), start_2 + uint64(j)
            cx, cy, cz = ways.x[a], ways.y[a], ways.z[a]
            if cx == 0.0 and cy == 0.0 and cz == 0.0:
                continue
            touch = separate_nodes(nodes, impulses, scene, a, b, j, (cx, cy, cz))
            moved += touch
            if touch == 0:
                ways.x[a], ways.y[a], ways.z[a] = 0.0, 0.0, 0.0
        if moved == 0:
            continue
        close_nodes(nodes, start_1, columns)
        close_nodes(nodes, start_2, columns)
        if row_1 == 1 or row_2 == model.n1 - 1:  # N1 or N2 is held
            continue
        for j in range(columns):
            a, b = start_1 + uint64(j), start_2 + uint64(j)
            cx, cy, cz = ways.x[a], ways.y[a], ways.z[a]
            if cx == 0.0 and cy == 0.0 and cz == 0.0:
                continue
            for around in range(-1, 2):
                if min(deviation(nodes, a, stride, -1.0, around), deviation(nodes, b, stride, 1.0, around)) <= 0.0:
                    side = around * sin
                    turn = 1.0 + around * around * (cos - 1.0)  # the way apart turns with the generatrix
                    nx, ny, column = turn * cx - side * cy, turn * cy + side * cx, (j + around + columns) % columns
                    c, d = start_1 - stride + uint64(column), start_2 + stride + uint64(column)
                    separate_nodes(nodes, impulses, scene, c, d, column, (nx, ny, cz))
        close_nodes(nodes, start_1 - stride, columns)
        close_nodes(nodes, start_2 + stride, columns)


@kernel
def find_ways(nodes, ways, start_1, start_2, stride, columns):
    """Write the unit vectors m2 - m1 over its length to ways at the nodes M1; zero where lobes are not folded onto each other."""
    for j in range(uint64(columns)):
        a, b = start_1 + j, start_2 + j
        x1, y1, z1 = inward_normal(nodes, a, stride)
        x2, y2, z2 = inward_normal(nodes, b, stride)
        square = (x2 - x1) ** 2 + (y2 - y1) ** 2 + (z2 - z1) ** 2
        opposed = folded(nodes, a, b, stride) and square > OPPOSED
        scale = 1.0 / sqrt(square) if opposed else 0.0
        ways.x[a] = scale * (x2 - x1)
        ways.y[a] = scale * (y2 - y1)
        ways.z[a] = scale * (z2 - z1)


@kernel
def resolve_belt_contact_of_meridian(model, nodes, meridian, step):
    """Keep the lobes of the axisymmetric shell apart at each belt, as resolve_belt_contact does. Condition (2.5).

    Where all columns are alike b12 is zero; N on the generatrices beside M deviates by b22 more. Reads model, step. Writes nodes,
    meridian.impulse; add_contact_work_of_meridian records them. Returns whether any were kept.
    """
    belt_contact, moved, scene = model.belt_contact, 0, scene_of_meridian(model, step)
    impulses = Impulses(meridian.contact, meridian.kinetic, meridian.impulse)
    for k in range(belt_contact.below.size):
        a, b = uint64(belt_contact.below[k]), uint64(belt_contact.above[k])
        if not folded(nodes, a, b, ONE):
            continue
        x1, z1 = inward_normal_of_meridian(nodes, a)
        x2, z2 = inward_normal_of_meridian(nodes, b)
        square = (x2 - x1) ** 2 + (z2 - z1) ** 2
        if square <= OPPOSED:
            continue
        cx, cz = (x2 - x1) / sqrt(square), (z2 - z1) / sqrt(square)
        touch = separate_nodes(nodes, impulses, scene, a, b, a, (cx, 0.0, cz))
        moved |= touch
        if touch > 0 and a > 1 and b < model.n1 - 1:
            rise = 2.0 * (model.hoop.cos - 1.0)
            least_1 = bend(nodes, a, ONE, x1, 0.0, z1) + min(rise * x1 * nodes.x[a], 0.0)
            least_2 = bend(nodes, b, ONE, x2, 0.0, z2) + min(rise * x2 * nodes.x[b], 0.0)
            if min(least_1, least_2) <= 0.0:
                a, b = a - ONE, b + ONE
                separate_nodes(nodes, impulses, scene, a, b, a, (cx, 0.0, cz))
    return moved


@kernel
def inward_normal_of_meridian(nodes, node):
    """Return radial and upward part of inward_normal where all columns are alike."""
    x = nodes.x[node + ONE] - nodes.x[node - ONE]
    z = nodes.z[node + ONE] - nodes.z[node - ONE]
    length = sqrt(x * x + z * z)
    scale = 1.0 / length if length > 0.0 else 0.0
    return -z * scale, x * scale
