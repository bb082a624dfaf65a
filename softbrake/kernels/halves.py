"""A step of a large shell in two halves of its rows: the lower one goes to a thread that helps, where one stands ready.

Where none does, the thread that takes the steps sweeps the lower half and then the upper one, by the same code. So no digit hangs
on the number of threads, and a step waits for another thread only where that is at work on its half. Both halves read the rows at
the seam from a copy; each takes the other's row there as held, so the edges across the seam work on either side in turn.
"""

import sys

from numba import types, uint64
from numba.extending import intrinsic

from softbrake.kernels.jit import kernel
from softbrake.kernels.rows import lanes
from softbrake.state import PAD, Turn

FIRST = uint64(PAD)
LOWER, UPPER = 0, 1
HELP = -1  # steps of a thread that helps
READY = 1000  # looks, of some ns each, within which a thread that stands ready takes what is on offer
BUSY = 20_000  # looks from which on a thread that waits lets others have its core in between

yield_core = types.ExternalFunction("SwitchToThread" if sys.platform == "win32" else "sched_yield", types.int32())


@intrinsic
def turned(_, turn, old, new):
    """Set turn[0] to new if it is old; return whether it was. Whoever finds it so sees all that was written before it was set."""

    def lower(context, builder, signature, arguments):
        array = context.make_array(signature.args[0])(context, builder, arguments[0])
        return builder.extract_value(builder.cmpxchg(array.data, *arguments[1:], "acq_rel", "acquire"), 1)

    return types.boolean(turn, types.int64, types.int64), lower


@kernel
def first_half(nodes, halves, n1, stride, helps):
    """Begin a step; return the half with which this thread is to begin, UPPER where there are none."""
    if halves is None:
        return UPPER
    if helps:
        return LOWER
    copy_seam(nodes, halves.seam, n1, stride)
    return UPPER if hand_over(halves.turn) else LOWER


@kernel
def next_half(halves, half, helps):
    """End a half; return the one with which this thread is to go on, beyond UPPER where there is none in this step."""
    if helps:
        turned(halves.turn, Turn.TAKEN, Turn.FREE)
        return UPPER + 1
    return half + 1


@kernel
def hand_over(turn):
    """Offer the lower half; return whether another thread has taken it."""
    if not turned(turn, Turn.FREE, Turn.OPEN):
        return False
    for _ in range(READY):
        if not turned(turn, Turn.OPEN, Turn.OPEN):
            return True
    return not turned(turn, Turn.OPEN, Turn.FREE)


@kernel
def take_over(halves):
    """Wait for a lower half and take it; return False where there will be none."""
    if halves is None:
        return False
    turn, looks = halves.turn, 0
    while not turned(turn, Turn.OPEN, Turn.TAKEN):
        if turned(turn, Turn.ALONE, Turn.ALONE):
            return False
        looks += 1
        if looks > BUSY:
            yield_core()
    return True


@kernel
def await_lower(turn, patience):
    """Wait until no other thread sweeps the lower half. One that takes so many looks longer has no core of its own: it may go."""
    looks = 0
    while turned(turn, Turn.TAKEN, Turn.TAKEN):
        looks += 1
        if looks > patience:
            yield_core()
    if looks > patience:
        turned(turn, Turn.FREE, Turn.ALONE)


@kernel
def copy_seam(nodes, seam, n1, stride):
    """Copy the rows on both sides of the seam, before one of them is pushed."""
    start = uint64((n1 // 2 - 1) * stride)
    for which in range(len(seam)):
        for a in range(uint64(2 * stride)):
            seam[which][a] = nodes[which][start + a]


@kernel
def add_lower(whole, halves, n1, columns):
    """Add the lower half's works and sums to those of the upper one, when it is swept, and raise the largest tensions."""
    lower = halves.books
    await_lower(halves.turn, n1 * columns)
    for which in range(len(whole.work)):
        add_columns(whole.work[which], lower.work[which], columns)
    for which in range(len(whole.by_column)):
        add_columns(whole.by_column[which], lower.by_column[which], columns)
    raise_top(whole.top_generatrix, lower.top_generatrix, columns)
    raise_top(whole.top_hoop, lower.top_hoop, columns)
    raise_top(whole.top_belt, lower.top_belt, columns)


@kernel
def add_columns(whole, part, columns):
    """Add a row of sums to another, and empty it."""
    for j in range(lanes(columns)):
        whole[j] += part[j]
        part[j] = 0.0


@kernel
def raise_top(top, other, columns):
    """Take the largest tensions of another half where they are larger."""
    for j in range(lanes(columns)):
        larger = other.tension[j] >= top.tension[j]
        top.tension[j] = other.tension[j] if larger else top.tension[j]
        top.row[j] = other.row[j] if larger else top.row[j]
