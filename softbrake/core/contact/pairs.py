"""A pair of a node and a face, or of two edges: how it is packed into an integer, which nodes it has, how it stands at n.

Both kinds are written the same way, by a node and four corners. Of two edges the first starts at the node and ends at the first
of the corners, the second joins the next two; the last corner repeats the third and has no weight. The weights of the corners
then say how fast the two near each other, and their sum is the weight of the node: 1 for a face.
"""

from typing import NamedTuple

from softbrake.core.arrays import StateColumn
from softbrake.core.jit import kernel

SECOND = 2**32 - 1  # bits of a key that name its face, or its second edge
EDGES = 2**62  # bit of the key of a pair of edges


class Pair(NamedTuple):
    """The nodes of a pair."""

    edges: bool  # else a node and a face
    node: int
    corners: tuple[int, int, int, int]


class PairState(NamedTuple):
    """How an active pair stands at n: a row of `NearPairs.state`."""

    normal: tuple[float, float, float]  # unit vector to the node from the face, or to the first edge from the second
    weights: tuple[float, float, float, float]  # of the corners
    allowed: float  # m/s, speed of closing that the thickness allows
    reach: float  # m, how far face or edge reach along the normal, negative; inf where the two touch


@kernel
def store_state(states, slot, state):
    """Write a PairState to its slot of states."""
    row = states[slot]
    row[StateColumn.NORMAL_X], row[StateColumn.NORMAL_Y], row[StateColumn.NORMAL_Z] = state.normal
    row[StateColumn.WEIGHT_0], row[StateColumn.WEIGHT_1], row[StateColumn.WEIGHT_2], row[StateColumn.WEIGHT_3] = state.weights
    row[StateColumn.ALLOWED] = state.allowed
    row[StateColumn.REACH] = state.reach


@kernel
def load_state(states, slot):
    """Return the PairState in a slot of states."""
    row = states[slot]
    normal = row[StateColumn.NORMAL_X], row[StateColumn.NORMAL_Y], row[StateColumn.NORMAL_Z]
    weights = row[StateColumn.WEIGHT_0], row[StateColumn.WEIGHT_1], row[StateColumn.WEIGHT_2], row[StateColumn.WEIGHT_3]
    return PairState(normal, weights, row[StateColumn.ALLOWED], row[StateColumn.REACH])


@kernel
def key_of_edges(edge, second):
    """Return the key of a pair of edges; that of a node and a face is node times 2^32 plus face."""
    return EDGES | (edge << 32) | second


@kernel
def corners_of(face, sheet):
    """Return the nodes at the corners of a face, by that of its lower left one.

    3 ── 2
    │    │      columns to the right, rows upwards; the one column of a meridian is its own neighbour
    0 ── 1
    """
    column = face % sheet.stride - sheet.first
    right = face + (1 if column + 1 < sheet.columns else 1 - sheet.columns)
    return face, right, right + sheet.stride, face + sheet.stride


@kernel
def end_of(edge, sheet):
    """Return the nodes at the ends of an edge: twice the node it starts from, and 1 more for that of the generatrix."""
    node = edge >> 1
    return node, corners_of(node, sheet)[3 if edge & 1 else 1]


@kernel
def pair_of(key, sheet):
    """Return the Pair of a key; beyond the last column stands the copy of the first."""
    right = int(sheet.columns > 1)
    second = key & SECOND
    if key & EDGES == 0:
        return Pair(False, key >> 32, (second, second + right, second + right + sheet.stride, second + sheet.stride))
    first = (key ^ EDGES) >> 32
    node, b = first >> 1, second >> 1
    a = node + (sheet.stride if first & 1 else 1)
    c = b + (sheet.stride if second & 1 else 1)
    return Pair(True, node, (a, b, c, c))


@kernel
def travel_of(nodes, faces, key):
    """Return what node and face, or two edges, travel together (m), by the ways of nodes and those of faces."""
    if key & EDGES == 0:
        return nodes[key >> 32] + faces[key & SECOND]
    return faces[(key ^ EDGES) >> 33] + faces[(key & SECOND) >> 1]
