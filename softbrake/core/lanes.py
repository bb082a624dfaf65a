"""Rows of columns: how many entries a loop over a row takes, copies at both ends of a row, sums over it."""

from numba import uint64

from softbrake.core.arrays import PAD
from softbrake.core.jit import kernel

ONE = uint64(1)
FIRST = uint64(PAD)  # column 0 in a row
LANES = uint64(PAD)


@kernel
def lanes(columns):
    """Return the columns of a row rounded up to whole cache lines: a loop over them has no remainder to be done one by one.

    What comes out beyond the columns is never read; arrays.Model.stride leaves room for it.
    """
    return (uint64(columns) + LANES - uint64(1)) & ~(LANES - uint64(1))


@kernel
def close_nodes(nodes, node, columns):
    """Close a row of nodes."""
    close_vectors(nodes, node, columns)
    close_row(nodes.u, node, columns)
    close_row(nodes.v, node, columns)
    close_row(nodes.w, node, columns)


@kernel
def close_row(values, first, columns):
    """Copy the last column in front of a row and the first one behind it."""
    values[first - ONE] = values[first + uint64(columns) - ONE]
    values[first + uint64(columns)] = values[first]


@kernel
def close_vectors(rows, row, columns):
    """Close a row of vectors."""
    close_row(rows.x, row, columns)
    close_row(rows.y, row, columns)
    close_row(rows.z, row, columns)


@kernel
def close_edges(edges, edge, columns):
    """Close a row of edges: their vectors, and what tensions read of them."""
    close_vectors(edges, edge, columns)
    close_row(edges.inverse, edge, columns)
    close_row(edges.e, edge, columns)
    close_row(edges.rate, edge, columns)


@kernel
def clear_row(rows):
    """Set a row of node vectors to zero."""
    rows.x[:] = 0.0
    rows.y[:] = 0.0
    rows.z[:] = 0.0


@kernel
def take_row(rows, above):
    """Add to a row of node vectors what the cells below it gave, and start the next one from zero."""
    for j in range(uint64(rows.x.size)):
        rows.x[j] += above.x[j]
        rows.y[j] += above.y[j]
        rows.z[j] += above.z[j]
        above.x[j] = 0.0
        above.y[j] = 0.0
        above.z[j] = 0.0


@kernel
def sum_of(values, count):
    """Return the sum of the first values, four at a time: one after the other each would wait for the last."""
    a, b, c, d, k = 0.0, 0.0, 0.0, 0.0, 0
    while k + 4 <= count:
        i = uint64(k)
        a += values[i]
        b += values[i + ONE]
        c += values[i + uint64(2)]
        d += values[i + uint64(3)]
        k += 4
    for i in range(uint64(k), uint64(count)):
        a += values[i]
    return (a + b) + (c + d)


@kernel
def total(by_column, columns):
    """Return the sum over the columns; written out, since compiling NumPy's sum costs a second."""
    result = 0.0
    for j in range(uint64(columns)):
        result += by_column[j]
    return result
