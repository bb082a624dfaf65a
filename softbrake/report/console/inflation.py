"""The static inflation."""

from __future__ import annotations

from softbrake.report.console.tables import plain, quantities
from softbrake.sim.summary import Inflation


def print_inflation(inflation: Inflation) -> None:
    """Print the static inflation in at most 80 columns."""
    console = plain()
    console.print(inflation.title, style="bold", soft_wrap=True)
    console.print(f"Inflated: at rest to a residual of {inflation.residual:.1e} after {inflation.steps} steps.")
    table = quantities()
    late = "the largest; the law starts without" if inflation.pressure_late else ""
    for name, value, unit, note in (
        ("pressure", f"{inflation.pressure / 1e3:.4g}", "kPa", late),
        ("height", f"{inflation.height:.5g}", "m", "held"),
        ("largest radius", f"{inflation.largest_radius:.5f}", "m", f"{inflation.largest_radius_height:.3f} m up"),
        ("volume", f"{inflation.volume:.5g}", "m^3", ""),
        ("force on the cover", f"{inflation.cover_force:.2f}", "N", ""),
        ("pull of the wall on it", f"{inflation.wall_pull:.2f}", "N", ""),
        *(
            (f"tension, {part}", f"{tension / 1e3:.4f}", "kN/m", note)
            for part, tension, note in (
                (
                    "generatrix",
                    inflation.tension_generatrix,
                    f"largest; {inflation.middle_tension_generatrix / 1e3:.4f} at mid-height",
                ),
                ("hoop", inflation.tension_hoop, f"largest; {inflation.middle_tension_hoop / 1e3:.4f} at mid-height"),
                ("belt", inflation.tension_belt, "largest"),
            )
            if tension is not None
        ),
    ):
        table.add_row(name, value, unit, note)
    console.print()
    console.print(table)
    if inflation.results:
        console.print(f"\nresults in {inflation.results}", soft_wrap=True)
