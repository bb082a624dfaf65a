"""A pair of a node and a face, or of two edges: which nodes it has, what it travels, how it stands.

Both kinds are written the same way, by a node and four corners. Of two edges the first starts at the node and ends at the first
of the corners, the second joins the next two; the last corner repeats the third and has no weight. The weights of the corners
then say how fast the two near each other, and their sum is the weight of the node: 1 for a face. A face is named by its lower
left node; an edge by twice the node it starts from, and 1 more for that of the generatrix.

    3 ── 2
    │    │      columns to the right, rows upwards; the one column of a meridian is its own neighbour
    0 ── 1
"""

from typing import NamedTuple

from numba import float64, uint64

from softbrake.core.arrays import StateColumn
from softbrake.core.jit import kernel
from softbrake.core.lanes import ONE


class PairState(NamedTuple):
    """How an active pair stands: a row of `ActivePairs.state`."""

    normal: tuple[float, float, float]  # unit vector to the node from the face, or to the first edge from the second
    weights: tuple[float, float, float, float]  # of the corners
    allowed: float  # m/s, speed of closing that the thickness allows
    reach: float  # m, how far face or edge reach along the normal, negative; inf where the two touch


@kernel
def store_state(states, slot, state):
    """Write a PairState to its slot of states."""
    a = uint64(slot)
    states[a, StateColumn.NORMAL_X], states[a, StateColumn.NORMAL_Y], states[a, StateColumn.NORMAL_Z] = state.normal
    states[a, StateColumn.WEIGHT_0], states[a, StateColumn.WEIGHT_1] = state.weights[0], state.weights[1]
    states[a, StateColumn.WEIGHT_2], states[a, StateColumn.WEIGHT_3] = state.weights[2], state.weights[3]
    states[a, StateColumn.ALLOWED] = state.allowed
    states[a, StateColumn.REACH] = state.reach


@kernel
def load_state(states, slot):
    """Return the PairState in a slot of states."""
    a = uint64(slot)
    normal = (
        float64(states[a, StateColumn.NORMAL_X]),
        float64(states[a, StateColumn.NORMAL_Y]),
        float64(states[a, StateColumn.NORMAL_Z]),
    )
    weights = (
        float64(states[a, StateColumn.WEIGHT_0]),
        float64(states[a, StateColumn.WEIGHT_1]),
        float64(states[a, StateColumn.WEIGHT_2]),
        float64(states[a, StateColumn.WEIGHT_3]),
    )
    return PairState(normal, weights, float64(states[a, StateColumn.ALLOWED]), float64(states[a, StateColumn.REACH]))


@kernel
def corners_of(face, sheet):
    """Return the nodes at the corners of a face; beyond the last column stands the copy of the first."""
    right = uint64(sheet.columns > 1)
    above = uint64(sheet.stride)
    return face, face + right, face + right + above, face + above


@kernel
def end_of(edge, sheet):
    """Return the nodes at both ends of an edge, the second perhaps a copy."""
    node = edge >> ONE
    return node, node + (uint64(sheet.stride) if edge & ONE else ONE)


@kernel
def nodes_of(edges, first, second, sheet):
    """Return the five nodes of a pair, of two edges or of a node and a face; beyond the last column stands a copy."""
    if edges:
        node, a = end_of(first, sheet)
        b, c = end_of(second, sheet)
        return node, a, b, c, c
    a, b, c, d = corners_of(second, sheet)
    return first, a, b, c, d


@kernel
def nodes_in(slot, active):
    """Return the five nodes of an active pair."""
    nodes, a = active.nodes, uint64(slot)
    return uint64(nodes[a, 0]), uint64(nodes[a, 1]), uint64(nodes[a, 2]), uint64(nodes[a, 3]), uint64(nodes[a, 4])
