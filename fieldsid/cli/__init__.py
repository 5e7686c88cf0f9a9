"""One thin file per command: parse, call, print.

A file is a command when its first line is a docstring of the form `sysid NAME: one line.` and it defines `command`,
a function or a `typer.Typer`. That is the whole registration; `day.py` only places it on the page of help.
"""
