"""`python -m softbrake`."""

from softbrake.cli.app import app

app(prog_name="softbrake")
