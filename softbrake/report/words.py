"""An answer in words, and numbers that all reports share."""

from __future__ import annotations

from softbrake.sim.summary import Ensemble, Summary

STANDARD_GRAVITY = 9.80665  # m/s^2
SHOWN = 1e-5  # of the initial energy: less than that is what steps of finite length leave
TENSIONS = ("generatrix", "hoop", "belt")


def outcome_in_words(summary: Summary) -> str:
    """One sentence: how the run ended and when."""
    end = f"{summary.end_time:.5g} s"
    lowest = f"the cover came down to {summary.minimum_height:.4g} m"
    match summary.outcome:
        case "impact":
            return f"Impact: the cover reached the ground at {end}."
        case "stopped":
            return f"Stopped: the cargo came to rest at {end}; {lowest}."
        case "time_limit":
            return f"End of time: no impact by {end}; {lowest}."
        case "diverged":
            return f"Diverged at {end}: the numbers below are not an answer."
        case "interrupted":
            return f"Interrupted at {end}; {lowest}."


def made_in_words(summary: Summary) -> str:
    """What made energy that no force gave, and how much of the initial energy."""
    makers = [f"{name} {100 * made:.2g} %" for name, made in summary.energy_made.items() if made >= SHOWN]
    return ", ".join(makers) or "none"


def disturbed_in_words(found: Ensemble) -> str:
    """How little the shells of an ensemble are out of round at the start."""
    sizes = f"{found.smallest:g}" if found.smallest == found.largest else f"{found.smallest:g} to {found.largest:g}"
    return f"disturbed by {sizes} R"
