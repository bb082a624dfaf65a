"""Largest stable step of the current state: Eq. (3.3) with the stiffness of the stretched shell, belts, shear, gas and viscosity.

The leapfrog with damping forces at n-1/2 is stable while 4/dt² M - 2/dt C - K is positive: while rate = 2/dt has
rate² >= w² + rate D, with w² and D the largest eigenvalues of M^-1 K and M^-1 C. For one mode that is
dt <= (2/w)(sqrt(1 + xi²) - xi), xi = D/2w. Gershgorin's theorem in blocks of a node bounds both row by row: an edge has
k (x1 - x2)² <= k (1 + s) x1² + k (1 + 1/s) x2² for every s; with s = (m1/m2)(q2/q1), q a weight of each row, that is
k (1/m1 + (q2/q1)/m2) at node 1 and k (1/m2 + (q1/q2)/m1) at node 2, see build.py. What the theorem would count too high is taken
from waves in a uniform sheet. Slack edges count with their stiffness when taut.
"""

from math import sqrt

from numba import uint64

from softbrake.core.arrays import Scheme
from softbrake.core.jit import kernel
from softbrake.core.lanes import FIRST, ONE
from softbrake.core.membrane.edges import SMALLEST_SQUARE
from softbrake.core.pressure import pressure_bound
from softbrake.core.shape import cloth_above, cloth_around

SOON = 0.98  # stretch from which an edge may be taut before the next choice


@kernel
def stable_step(model, nodes, workspace):
    """Return the step (s) at Courant coefficient 1. Eq. (3.3), by the bound above.

    Reads model, nodes. Writes workspace.by_row, scratch in generatrix, hoop, by_column.rate.
    """
    n1, n2, shape, by_row = model.n1, model.n2, model.shape, workspace.by_row
    generatrix, hoop, skew = workspace.generatrix, workspace.hoop, workspace.by_column.rate
    stride = uint64(model.stride)
    by_row.e1[0] = longest(nodes, generatrix, FIRST, stride, FIRST, n2, shape.h1[0])
    fastest = 0.0
    for i in range(1, n1):
        node = uint64(i) * stride + FIRST
        below = uint64((i - 1) % 2) * stride + FIRST
        above = uint64(i % 2) * stride + FIRST
        by_row.e1[i] = longest(nodes, generatrix, node, stride, above, n2, shape.h1[i])
        by_row.e2[i] = longest(nodes, hoop, node - ONE, ONE, FIRST - ONE, n2 + 1, shape.h2[i])
        update_skew(generatrix, hoop, skew, below, above, n2)
        by_row.skew[i] = fold_largest(skew, uint64(0), n2)
    for i in range(ONE, uint64(n1)):
        by_row.rate[i] = fastest_rate(model, by_row, i)
        fastest = max(fastest, by_row.rate[i])
    return 2.0 / fastest


@kernel
def longest(nodes, edges, node, step, edge, count, spacing):
    """Return the largest elongation of a row of edges, not below 0; see update_edges.

    Writes edges.x, y, z (directions, zero where slack), e (squared stretch; the row is used up).
    """
    x, y, z = nodes.x, nodes.y, nodes.z
    per_square = 1.0 / (spacing * spacing)
    for j in range(uint64(count)):
        a = node + j
        b = a + step
        c = edge + j
        dx = x[b] - x[a]
        dy = y[b] - y[a]
        dz = z[b] - z[a]
        square = max(dx * dx + dy * dy + dz * dz, SMALLEST_SQUARE)
        stretch = square * per_square
        per_length = 1.0 / sqrt(square) if stretch > SOON * SOON else 0.0
        edges.x[c] = dx * per_length
        edges.y[c] = dy * per_length
        edges.z[c] = dz * per_length
        edges.e[c] = stretch
    return max(sqrt(fold_largest(edges.e, edge, count)) - 1.0, 0.0)


@kernel
def update_skew(generatrix, hoop, skew, below, above, columns):
    """Update the largest squared cosine between a generatrix and a hoop edge at each node of a row. Writes skew, (n2,)."""
    for j in range(uint64(columns)):
        a = FIRST + j
        b = a - ONE
        k = below + j
        m = above + j
        lower_right = generatrix.x[k] * hoop.x[a] + generatrix.y[k] * hoop.y[a] + generatrix.z[k] * hoop.z[a]
        lower_left = generatrix.x[k] * hoop.x[b] + generatrix.y[k] * hoop.y[b] + generatrix.z[k] * hoop.z[b]
        upper_right = generatrix.x[m] * hoop.x[a] + generatrix.y[m] * hoop.y[a] + generatrix.z[m] * hoop.z[a]
        upper_left = generatrix.x[m] * hoop.x[b] + generatrix.y[m] * hoop.y[b] + generatrix.z[m] * hoop.z[b]
        lower = max(lower_right * lower_right, lower_left * lower_left)
        upper = max(upper_right * upper_right, upper_left * upper_left)
        skew[j] = max(lower, upper)


@kernel
def fold_largest(values, first, count):
    """Return the largest of some values, which are used up: the row is folded in halves, since a running maximum is no SIMD."""
    while count > 1:
        half = (count + 1) // 2
        for j in range(uint64(count - half)):
            values[first + j] = max(values[first + j], values[first + uint64(half) + j])
        count = half
    return values[first]


@kernel
def fastest_rate(model, by_row, i):
    """Return 2/dt (1/s) of the fastest wave that row i of nodes takes part in: w² and D as in the header.

    A wave along the generatrix moves along it, held by its edges (k1) and by the tension of the hoops across (t2); one around
    the hoop likewise (k2, t1). In the printed scheme, averaged, no wave feels both, and rows share their hoops' stiffness, as
    they share that of shear. Corners that are not right couple the two, as does Poisson's effect, together with shear where its
    modulus is large: see coupled. A few light rows between heavy ones cannot alternate wholly, so they feel these at once.
    """
    fabric, e1, e2 = cloth_around(model, i), by_row.e1, by_row.e2
    k1, t1, damping_1, wide_2, between = waves_along(model, by_row, i)
    per_mass = 4.0 * model.per_mass[i]
    shared = model.shared[i]
    longer = max(e1[i - ONE], e1[i])
    belt, wide = model.belts.stiffness[i], fabric.h1 * wide_2
    k2 = (shared * fabric.c22 * wide + per_mass * belt) / fabric.h2
    load = max(fabric.c22 * e2[i] + fabric.c12 * longer, 0.0) * wide + belt * e2[i]
    t2 = per_mass * load / (fabric.h2 * (1.0 + e2[i]))
    damping_2 = (shared * fabric.viscosity * wide + per_mass * model.belts.viscosity[i]) / fabric.h2
    skew = by_row.skew[i]
    shear_1 = between * fabric.g12 * (1.0 + longer) ** 2 * fabric.h1 / fabric.h2
    shear_2 = between * fabric.g12 * (1.0 + e2[i]) ** 2 * fabric.h2 / fabric.h1
    if model.scheme == Scheme.EDGE:
        crossed = max(k1, k2) * sqrt(poisson(fabric, longer, e2[i]))
        coupled = shear_1 + shear_2 + crossed
        k1 += max(per_mass / between - 1.0, 0.0) * (shear_1 + crossed)
        fast = max(k1, k2)
        square = t1 + t2 + joined(max(k1 - t1, 0.0), max(k2 - t2, 0.0), skew)
        square += max(coupled - fast, 0.0) ** 2 / (4.0 * max(coupled, fast))
        square = max(square, shear_1 + t2, shear_2 + t1)
    else:
        square = max(joined(k1, k2, skew), t1 + t2, shear_1, shear_2)
    return rate_of(model, by_row, i, square, joined(damping_1, damping_2, skew), 1.0)


@kernel
def waves_along(model, by_row, i):
    """Return k1 and t1 (1/s^2), D1 (1/s) of row i, the hoop's width per unloaded width, and the 1/m (1/kg) in k1.

    Held rows have no 1/m.
    """
    fabric, per_mass, e1, e2 = model.fabric, model.per_mass, by_row.e1, by_row.e2
    b, a = i - ONE, i + ONE
    lower, upper = cloth_above(model, b), cloth_above(model, i)
    below, above = model.below[i], model.above[i]
    across_below = 0.5 * (e2[b] + e2[i])
    across_above = 0.5 * (e2[i] + e2[a])
    wide_below = lower.h2 / lower.h1 * (1.0 + fabric.true_tension * across_below)
    wide_above = upper.h2 / upper.h1 * (1.0 + fabric.true_tension * across_above)
    load_below = max(fabric.c11 * e1[b] + fabric.c12 * across_below, 0.0) * wide_below / (1.0 + e1[b])
    load_above = max(fabric.c11 * e1[i] + fabric.c12 * across_above, 0.0) * wide_above / (1.0 + e1[i])
    both = wide_below * below + wide_above * above
    tension = 2.0 * per_mass[i] * (load_below + load_above)
    return fabric.c11 * both, tension, fabric.viscosity * both, 1.0 + fabric.true_tension * 0.5 * (e1[b] + e1[i]), below + above


@kernel
def joined(one, other, skew):
    """Return the larger eigenvalue of one n n' + other m m', where n and m are unit vectors of squared cosine skew."""
    return 0.5 * (one + other + sqrt((one - other) ** 2 + 4.0 * one * other * skew))


@kernel
def poisson(fabric, e1, e2):
    """Return the product of the effects of either stretch on the other tension, of that of the stretches on their own."""
    wide_1 = 1.0 + fabric.true_tension * e1
    wide_2 = 1.0 + fabric.true_tension * e2
    by_e2 = fabric.c12 * wide_2 + fabric.true_tension * (fabric.c11 * e1 + fabric.c12 * e2)
    by_e1 = fabric.c12 * wide_1 + fabric.true_tension * (fabric.c22 * e2 + fabric.c12 * e1)
    return by_e2 * by_e1 / (fabric.c11 * wide_2 * fabric.c22 * wide_1)


@kernel
def rate_of(model, by_row, i, square, damping, around):
    """Return 2/dt (1/s) of w² (1/s^2) and D (1/s) with what the gas adds to them; around: see pressure_bound."""
    e1, h1 = by_row.e1, model.shape.h1
    length_1 = max(h1[i - ONE] * (1.0 + e1[i - ONE]), h1[i] * (1.0 + e1[i]))
    length_2 = model.shape.h2[i] * (1.0 + by_row.e2[i])
    turned, damped = pressure_bound(model, i, around, length_1, length_2)
    square += turned
    damping += damped
    return 0.5 * (damping + sqrt(damping * damping + 4.0 * square))
