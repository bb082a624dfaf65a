"""The meridian at rest between its covers: dynamic relaxation, without what else a step of the axisymmetric shell does.

The places are those from which `sim.relax` starts, whose steps and residual count.
"""

from math import inf, sqrt

from numba import uint64

from softbrake.core.jit import kernel
from softbrake.core.lanes import ONE
from softbrake.core.loop.meridian import (
    copy_top,
    gas_at,
    pull_hoops,
    stable_step_of_meridian,
    tensions_at,
    update_areas,
    update_generatrix,
)

PART_OF_STEP = 0.5  # of the longest stable one
STEPS_PER_LOOK = 10
UNDAMPED = 2  # of them, before the frequency is measured
LARGEST_CUT = 0.5  # of the frequency times the step, for one that is none yet


@kernel
def relax_meridian(model, nodes, meridian, pressure, tolerance, most):
    """Bring the free nodes to rest under a pressure (Pa), the ground holding them up. Returns the residual, and the steps done.

    Velocities are cut and the residual is measured as in `sim.relax`. Those of nodes stay zero, so that no tension is viscous;
    the bound of the step is longest for a model without viscosity.
    Writes places of nodes; scratch in meridian.
    """
    n1, fabric, gravity, ground, top = model.n1, model.fabric, model.gravity, model.obstacles.ground, uint64(model.n1)
    x, z, u, w, old_x, old_z = nodes.x, nodes.z, meridian.mean_u, meridian.mean_w, meridian.free_u, meridian.free_w
    load = pressure * model.shape.least_1 * model.shape.least_2
    nodes.u[:] = 0.0
    nodes.w[:] = 0.0
    u[:] = 0.0
    w[:] = 0.0
    meridian.pressure[:] = pressure
    done, residual, kept, length, frequency = 0, inf, 1.0, 0.0, 0.0
    while done < most:
        if done % STEPS_PER_LOOK == 0:
            length = PART_OF_STEP * stable_step_of_meridian(model, nodes, meridian)
        copy_top(nodes, top)
        update_generatrix(fabric, nodes, meridian, n1)
        pull_hoops(fabric, nodes, meridian, model.shape.side, n1)
        update_areas(nodes, meridian, model.shape.side, n1)
        looking = done % STEPS_PER_LOOK < UNDAMPED  # what is damped moves as its forces, not as its slowest mode
        cut = 1.0 if looking else kept
        moving, change, unbalanced, speed = 0.0, 0.0, 0.0, 0.0
        for i in range(ONE, top):
            mass, (pull_x, pull_z, _, _), (gas_x, gas_z) = meridian.mass[i], tensions_at(meridian, i), gas_at(meridian, i)
            force_x, force_z = pull_x + gas_x, pull_z + gas_z - gravity * mass
            if z[i] <= ground:
                force_z = max(force_z, 0.0)
            moving += mass * (u[i] * u[i] + w[i] * w[i])
            change += u[i] * (force_x - old_x[i]) + w[i] * (force_z - old_z[i])
            unbalanced += force_x * force_x + force_z * force_z
            speed += u[i] * u[i] + w[i] * w[i]
            old_x[i], old_z[i] = force_x, force_z
            u[i] = cut * u[i] + length * force_x / mass
            w[i] = max(cut * w[i] + length * force_z / mass, (ground - z[i]) / length)
            x[i] += length * u[i]
            z[i] = max(z[i] + length * w[i], ground)
        done += 1
        if done % STEPS_PER_LOOK == UNDAMPED and moving > 0.0:
            frequency = sqrt(max(-change / (length * moving), 0.0))
            free = float(n1 - 1)
            left = sqrt(speed / free) / (max(frequency, 1e-30) * model.shape.widest)
            residual = max(sqrt(unbalanced / free) / load, left)
            if not residual > tolerance:
                return residual, done
            decay = min(frequency * length, LARGEST_CUT)
            kept = (1.0 - decay) / (1.0 + decay)
    return residual, done
