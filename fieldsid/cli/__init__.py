"""The command line: a thin file for each command in `commands/`, which parses, calls the package and prints.

A file is a command when its first line is a docstring of the form `sysid NAME: one line.` and it defines `command`,
a function or a `typer.Typer`. That is the whole registration; `help/command_order.py` only places it on the page of help.
"""
