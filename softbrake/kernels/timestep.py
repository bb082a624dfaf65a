"""Largest stable step of the current state: Eq. (3.3) with the wave speeds of the stretched shell, belts and viscosity."""

from math import sqrt

from numba import uint64

from softbrake.kernels.geometry import update_edges
from softbrake.kernels.jit import kernel
from softbrake.state import PAD

ONE = uint64(1)
FIRST = uint64(PAD)


@kernel
def stable_step(model, nodes, sweep):
    """Return the step (s) at Courant coefficient 1: the least of (2/w)(sqrt(1 + xi^2) - xi) over the free nodes.

    For the fastest wave at a node, w^2 = 4 (k1 + k2)/m with the stiffness k of its edges to the forces along them, of the
    stretched membrane, belt and shear, and to the tension across them; in a uniform unstretched sheet without Poisson coupling
    and shear this is h/c of (3.3). Viscous forces at n-1/2 with the damping D = 4 c/m of edge dampers c shorten it: xi = D/2w; so
    does the gas of (2.11), whose 2 nu^n p for small velocities damps a node by its area.
    Slack edges count with their stiffness when taut. The pressure's own stiffness, p h/E of the fabric's, is left out.
    Reads model, nodes. Writes scratch in sweep.generatrix, hoop, by_column.rate.
    """
    n1, n2 = model.n1, model.n2
    stride = uint64(model.stride)
    fabric = model.fabric
    gas_damping = 2.0 * model.pressure.damping * model.pressure.most * fabric.h1 * fabric.h2
    fastest = sweep.by_column.rate
    fastest[:] = 0.0
    update_edges(nodes, sweep.generatrix, FIRST, stride, FIRST, n2, fabric.h1)
    for i in range(1, n1):
        node = uint64(i) * stride + FIRST
        below = uint64((i - 1) % 2) * stride + FIRST
        above = uint64(i % 2) * stride + FIRST
        update_edges(nodes, sweep.generatrix, node, stride, above, n2, fabric.h1)
        update_edges(nodes, sweep.hoop, node - ONE, ONE, FIRST - ONE, n2 + 1, fabric.h2)
        mass = model.mass[i]
        belt = model.belts.stiffness[i]
        belt_viscosity = model.belts.viscosity[i]
        for j in range(uint64(n2)):
            e1 = max(sweep.generatrix.e[below + j], sweep.generatrix.e[above + j], 0.0)
            e2 = max(sweep.hoop.e[FIRST + j - ONE], sweep.hoop.e[FIRST + j], 0.0)
            rate = fastest_rate(fabric, e1, e2, mass, belt, belt_viscosity, gas_damping)
            fastest[j] = max(fastest[j], rate)
    return 4.0 / largest(fastest)


@kernel
def fastest_rate(fabric, e1, e2, mass, belt, belt_viscosity, gas_damping):
    """Return D + sqrt(D^2 + 4 w^2) (1/s) of the faster direction at a node: see stable_step.

    e1, e2: elongations, 0 where slack; mass (kg) of the node; belt: stiffness (N) and viscosity (N s); gas_damping: 2 nu^n p
    h1 h2 (N s/m).
    """
    aspect = fabric.h2 / fabric.h1
    per_mass = 4.0 / mass
    wide_1 = 1.0 + fabric.true_tension * e1
    wide_2 = 1.0 + fabric.true_tension * e2
    along_1 = fabric.c11 * wide_2 * aspect
    along_2 = (fabric.c22 * wide_1 * fabric.h1 + belt) / fabric.h2
    across_1 = max(fabric.c11 * e1 + fabric.c12 * e2, 0.0) * wide_2 * aspect / (1.0 + e1)
    across_2 = (max(fabric.c22 * e2 + fabric.c21 * e1, 0.0) * wide_1 * fabric.h1 + belt * e2) / (fabric.h2 * (1.0 + e2))
    square_1 = per_mass * (along_1 + across_2 + fabric.g12 * (1.0 + e1) ** 2 / aspect)
    square_2 = per_mass * (along_2 + across_1 + fabric.g12 * (1.0 + e2) ** 2 * aspect)
    damping_1 = per_mass * fabric.viscosity * wide_2 * aspect
    damping_2 = per_mass * (fabric.viscosity * wide_1 * fabric.h1 + belt_viscosity) / fabric.h2
    gas = gas_damping * (1.0 + e1) * (1.0 + e2) / mass
    damping_1 += gas
    damping_2 += gas
    rate_1 = damping_1 + sqrt(damping_1 * damping_1 + 4.0 * square_1)
    rate_2 = damping_2 + sqrt(damping_2 * damping_2 + 4.0 * square_2)
    return max(rate_1, rate_2)


@kernel
def largest(by_column):
    """Return the largest over the columns."""
    result = by_column[0]
    for value in by_column:
        result = max(result, value)
    return result
