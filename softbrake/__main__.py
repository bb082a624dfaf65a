"""`python -m softbrake`."""

from softbrake.cli import app

app(prog_name="softbrake")
