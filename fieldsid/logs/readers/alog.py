"""Read MOOS logs, .alog: a line for each posting, `time VARIABLE source value`; each numeric variable is a topic."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from fieldsid.logs.reader import MOST_CHANNELS, ReadOptions
from fieldsid.logs.readers._topics import DATA, Means, Topics, topic_of, topic_reader
from fieldsid.logs.run import Note
from fieldsid.logs.unknown_file import head_of

_ENU = {"frame": "ENU/FRD"}
MEANS: Means = {
    f"NAV_HEADING.{DATA}": ("yaw_rad", {"unit": "deg"}),
    f"NAV_PITCH.{DATA}": ("pitch_rad", {"unit": "rad"}),
    f"NAV_DEPTH.{DATA}": ("depth_m", {"unit": "m"}),
    f"NAV_SPEED.{DATA}": ("surge_m_s", {"unit": "m/s"}),
    f"NAV_X.{DATA}": ("x_m", {"unit": "m", **_ENU}),
    f"NAV_Y.{DATA}": ("y_m", {"unit": "m", **_ENU}),
    f"DESIRED_HEADING.{DATA}": ("yaw_goal_rad", {"unit": "deg"}),
    f"DESIRED_RUDDER.{DATA}": ("rudder_rad", {"unit": "deg"}),
    f"DESIRED_ELEVATOR.{DATA}": ("elevator_rad", {"unit": "deg"}),
    f"DESIRED_THRUST.{DATA}": ("thrust", {}),
}
"""Signals by the variables of the helm: heading from north, X east and Y north, fins in degrees."""


def sniff(path: Path) -> bool:
    """Whether a file has the head that the MOOS logger writes."""
    head = head_of(path)
    return head.startswith(b"%%") and b"%% LOGSTART" in head


def _topics(path: Path, options: ReadOptions, wanted: frozenset[str]) -> Topics:
    """Return the numeric variables: at most MOST_CHANNELS, and in addition those that are wanted."""
    times: dict[str, list[float]] = {}
    values: dict[str, list[float]] = {}
    odd = 0
    with path.open(encoding="utf-8", errors="replace") as lines:
        for line in lines:
            parts = line.split(None, 3)
            if line.startswith("%") or len(parts) < 4:
                odd += bool(parts) and not line.startswith("%")
                continue
            if not line.endswith("\n"):
                odd += 1
                continue
            time, value = _number(parts[0]), _number(parts[3].strip())
            if time is not None and value is not None:
                times.setdefault(parts[1], []).append(time)
                values.setdefault(parts[1], []).append(value)
    taken = {*sorted(times)[:MOST_CHANNELS], *(n for n in wanted if n in times)}
    found = {name: topic_of(np.array(times[name]), {DATA: np.array(values[name])}) for name in taken}
    message = f"lines of the log that are cut off or no posting, left out: {odd}"
    notes = (Note("truncated", message, {"count": odd}),) if odd else ()
    return Topics(found, MEANS, notes, len(times) - len(taken))


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:  # most variables are words
        return None
    return value if math.isfinite(value) else None


READER = topic_reader("alog", "MOOS log: .alog", (".alog",), "MOOS log", sniff, _topics, "variable")
