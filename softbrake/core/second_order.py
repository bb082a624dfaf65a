"""A second-order section of a recursive filter."""

from softbrake.core.jit import kernel


@kernel
def filter_samples(section, delays, samples):
    """Filter even samples, (k,), in place, in the transposed direct form II.

    section: b0, b1, b2, a1, a2 of (b0 + b1/z + b2/z^2) / (1 + a1/z + a2/z^2). delays: (2,), what the samples before have left;
    written.
    """
    b0, b1, b2, a1, a2 = section[0], section[1], section[2], section[3], section[4]
    first, second = delays[0], delays[1]
    for k in range(samples.size):
        taken = samples[k]
        given = b0 * taken + first
        first = b1 * taken - a1 * given + second
        second = b2 * taken - a2 * given
        samples[k] = given
    delays[0], delays[1] = first, second
