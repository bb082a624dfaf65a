"""Arguments and options of several commands."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

CasePath = Annotated[Path, typer.Argument(metavar="CASE", help="Case file (YAML); - for stdin.")]
ResultPath = Annotated[Path, typer.Argument(metavar="RESULT", help="Result file of a run (*.vtkhdf).")]
Overrides = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="PATH=VALUE", help="Replace a value of the case, as fabric.E=18.75kN/m. Repeatable."),
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]
JsonLines = Annotated[bool, typer.Option("--json", help="Print a JSON object a run, one a line.")]
Dimensionless = Annotated[bool, typer.Option("--dimensionless", help="Tensions also in the paper's dimensionless form.")]
NoResults = Annotated[bool, typer.Option("--no-results", help="Write no result file.")]
Force = Annotated[bool, typer.Option("--force", help="Replace the answer of another case.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress.")]
