"""PX4 parameters of `uuv_att_control`: one set of gains, a line of MAV id, component, name, value and type for each.

PX4 commands a torque of -1 .. 1 by P sin(reference - angle) - D rate, positive to starboard and nose up. Where its allocation
maps a torque of one to the full fin, fin_limit, P = |kp| / fin_limit (1/rad) and D = |kd| / fin_limit (s/rad); the sign of the
fin is part of the allocation. PX4 has no integral, no feed-forward and no table over speed: the row of the highest speed is
active, at which the fin is strongest, and the others are comments.
"""

from __future__ import annotations

from pathlib import Path

from fieldsid.exports._target import Target, decimal, notes_of
from fieldsid.records.keys import body_of
from fieldsid.schedule.record import Row, Schedule

LEFT_OUT = (
    "UUV_TORQUE_SAT has to be 1.0, and a torque of one the fin at fin_limit_rad, the fin's sense in the allocation (CA_SV_CS*)",
    "PX4 has no place for ki and reference_gain; feed_forward_rad / fin_limit_rad is the surface's trim (CA_SV_CS*_TRIM)",
    "one set is in force, that of the highest speed: take another row's by `param set` where the vehicle goes slower for long",
)


def render(schedule: Schedule, node: str, template: Path | None) -> str:
    """Return the parameter file, each name beginning with `node`."""
    lines = [f"# {line}" for line in (*notes_of(schedule), *LEFT_OUT)]
    last = len(schedule.rows) - 1
    for i, row in enumerate(schedule.rows):
        body = body_of(row)
        lines.append("# row: " + ", ".join(f"{name} = {decimal(float(body[name]))}" for name in schedule.columns))
        lines += [("" if i == last else "# ") + line for line in _parameters(schedule, row, node)]
    return "\n".join(lines) + "\n"


def _parameters(schedule: Schedule, row: Row, node: str) -> list[str]:
    """Return the lines of a row, of MAV 1, component 1 and type 9, a 32-bit float.

    Both gains of a loop have the sign of the authority; those of PX4 are positive.
    """
    sign = -1.0 if row.gains.kp < 0.0 else 1.0
    gains = {"P": row.gains.kp, "D": row.gains.kd}
    name = f"{node}_{schedule.axis.value.upper()}"
    return [f"1\t1\t{name}_{k}\t{decimal(sign * v / row.fin_limit)}\t9" for k, v in gains.items()]


EXPORT = Target(name="px4", says="PX4 .params of uuv_att_control, one set of gains", suffix=".params", render=render, node="UUV")
