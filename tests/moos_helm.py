"""A helm that knows no more than conditions and flags: enough to fly what is written for a MOOS vehicle.

Behaviors of a file are stepped by their published rules: a behavior runs while all its conditions hold, run flags are posted
as it begins to, end flags when its duration is over, breach flags of the region when a point or a depth is outside.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field


@dataclass
class Behavior:
    kind: str
    parameters: dict[str, list[str]] = field(default_factory=dict)
    running: bool = False
    clock: float = 0.0

    def all(self, name):
        return self.parameters.get(name, [])

    def one(self, name):
        (value,) = self.all(name)
        return value


class Helm:
    """The behaviors of a .bhv file and the variables they see."""

    def __init__(self, text):
        self.variables = {}
        self.behaviors = []
        for line in (raw.split("//")[0].strip() for raw in text.splitlines()):
            if line.startswith("initialize "):
                self.post(line.removeprefix("initialize "))
            elif line.startswith("Behavior"):
                self.behaviors.append(Behavior(line.split("=")[1].strip()))
            elif "=" in line:
                name, _, value = line.partition("=")
                self.behaviors[-1].parameters.setdefault(name.strip(), []).append(value.strip())

    def post(self, flag):
        name, _, value = flag.partition("=")
        self.variables[name.strip()] = value.strip()

    def step(self, seconds, **variables):
        """Post variables and run every behavior once."""
        self.variables |= variables
        for b in self.behaviors:
            runs = all(holds(c, self.variables) for c in b.all("condition"))
            if runs and not b.running:
                self._flags(b, "runflag")
            b.running = runs
            for reset in b.all("duration_reset"):
                name, _, value = reset.partition("=")
                if self.variables.pop(name, None) == value:
                    b.clock = 0.0
            if runs:
                b.clock += seconds
                self._breaches(b)
                if b.all("duration") and b.clock > float(b.one("duration")):
                    self._flags(b, "endflag")

    def _breaches(self, b):
        if b.kind != "BHV_OpRegion":
            return
        if b.all("max_depth") and self.variables["NAV_DEPTH"] > float(b.one("max_depth")):
            self._flags(b, "breached_depth_flag")
        if b.all("polygon") and not inside(corners(b.one("polygon")), self.variables["NAV_X"], self.variables["NAV_Y"]):
            self._flags(b, "breached_poly_flag")

    def _flags(self, b, kind):
        for flag in b.all(kind):
            self.post(flag)


def holds(text, variables):
    """Whether a logic expression holds; one about a variable that nobody has published does not."""
    parts = re.findall(r"\(([^()]*)\)", text) or [text]
    each = [_relation(p, variables) for p in parts]
    return any(each) if ") or (" in text else all(each)


def _relation(text, variables):
    name, relation, literal = re.fullmatch(r"(\w+)\s*(<=|>=|!=|=|<|>)\s*(\S+)", text.strip()).groups()
    if name not in variables:
        return False
    value = variables[name]
    if relation in ("=", "!="):
        return (str(value) == literal) is (relation == "=")
    return {
        "<": value < float(literal),
        ">": value > float(literal),
        ">=": value >= float(literal),
        "<=": value <= float(literal),
    }[relation]


def corners(text):
    """The corners of `pts={x,y : x,y : ...}`."""
    return [tuple(float(n) for n in pair.split(",")) for pair in re.search(r"\{(.*)\}", text)[1].split(":")]


def inside(points, x, y):
    """Whether a point is inside a convex polygon."""
    sides = [
        (bx - ax) * (y - ay) - (by - ay) * (x - ax) for (ax, ay), (bx, by) in zip(points, [*points[1:], points[0]], strict=True)
    ]
    return all(s >= 0 for s in sides) or all(s <= 0 for s in sides)


def script(text):
    """The events (time s, variable, value) of a uTimerScript block, and the conditions it starts under."""
    events = re.findall(r"event = var=(\w+), val=(\S+), time=(\S+)", text)
    return [(float(t), n, v) for n, v, t in events], re.findall(r"^  condition = (.+)$", text, re.MULTILINE)
