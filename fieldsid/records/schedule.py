"""The shape of a gain schedule file."""

from __future__ import annotations

from fieldsid.records.check import (
    AXES,
    HEAD,
    LARGEST_FIN_RAD,
    LARGEST_SPEED_M_S,
    SOURCE,
    Shape,
    above_zero,
    at_least_one,
    flag,
    maybe,
    number,
    one_of,
    text,
    whole_number,
)

CONTROLLERS = ("p", "pd", "pi", "pid", "lqr")
LARGEST_GAIN = 1000.0
"""Largest kp (rad/rad), ki (1/s), kd (s) and reference gain: with it, an error of 1 mrad would need the full fin."""
_GAIN = number(-LARGEST_GAIN, LARGEST_GAIN)
_SECONDS = maybe(number(0.0))
_FIN = {"lag_s?": _SECONDS, "delay_s?": _SECONDS, "fin_rate_rad_s?": maybe(above_zero()), "latency_s?": _SECONDS}
ROW: Shape = {
    "speed_m_s": above_zero(LARGEST_SPEED_M_S),
    **dict.fromkeys(("kp", "ki", "kd", "reference_gain", "depth_gain"), _GAIN),
    "feed_forward_rad": number(-LARGEST_FIN_RAD, LARGEST_FIN_RAD),
    "fin_limit_rad": above_zero(LARGEST_FIN_RAD),
    "supported": flag,
    "slowed": number(0.0, 1.0),
    **dict.fromkeys(("phase_margin_deg", "gain_margin_db", "delay_margin_s"), maybe(number())),
    "draws_held": number(0.0, 1.0),
    "settling_s": _SECONDS,
    "binds?": text,
    "fin_use?": maybe(number(0.0)),
}
ANSWER: Shape = {
    "settling_s?": _SECONDS,
    "step_rad?": maybe(above_zero()),
    "asked_settling_s?": maybe(above_zero()),
    **dict.fromkeys(("asked_bandwidth_rad_s?", "asked_overshoot?", "asked_fin_use?"), maybe(number(0.0))),
}
"""The requirements that the loop was designed for."""
FINS: Shape = {"names": [text], "shares": [number()], "limits": [above_zero()], "unit": text}
"""The fins that the gains of the plane move."""
PROVENANCE: Shape = {
    "fins?": FINS,
    "models?": [SOURCE],
    "runs?": [text],
    "supported_m_s?": (number(0.0), number(0.0)),
    "draws?": whole_number,
    "draws_rejected?": number(0.0, 1.0),
    "belief_refused?": flag,
    "length_m?": maybe(above_zero()),
    **dict.fromkeys(("tool?", "draws_of?", "speed_lost?", "schedule_variable?", "between_rows?", "outside_rows?"), text),
    **dict.fromkeys(("sign_convention?", "law?"), text),
}
SCHEDULE: Shape = {
    **HEAD,
    "axis": one_of(AXES),
    "controller": one_of(CONTROLLERS),
    "damping_ratio": above_zero(10.0),
    "phase_margin_wanted_deg": number(0.0, 180.0),
    "depth": flag,
    "actuator": _FIN,
    "stated": _FIN,
    "rows": at_least_one(ROW),
    "provenance": PROVENANCE,
    "answer?": ANSWER,
    "warnings?": [{"code": text, "message": text}],
}
