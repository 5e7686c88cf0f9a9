"""The exit codes of the program."""

from __future__ import annotations

DONE, GATE_FAILED, BAD_INPUT, OUR_BUG, INTERRUPTED = 0, 1, 2, 3, 130
