"""The command line: one file a command. Typer reads the options of a command from its parameters, so these are many."""
