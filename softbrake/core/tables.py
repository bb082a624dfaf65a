"""Tables over time, linear between their rows."""

from softbrake.core.jit import kernel


@kernel
def integral_of_table(times, values, start, end):
    """Return the integral of a table over a time (s), exact, as far as it lies between the first and the last row."""
    total = 0.0
    for k in range(1, times.size):
        lower, upper = max(start, times[k - 1]), min(end, times[k])
        if upper > lower:
            slope = (values[k] - values[k - 1]) / (times[k] - times[k - 1])
            total += (upper - lower) * (values[k - 1] + slope * (0.5 * (lower + upper) - times[k - 1]))
    return total
