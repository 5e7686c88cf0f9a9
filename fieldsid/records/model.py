"""The shape of a model file; `info`, where estimators store remarks, may have further keys."""

from __future__ import annotations

from fieldsid.records.check import (
    AXES,
    BOTH_SIDES,
    FLOOR,
    HEAD,
    LARGEST,
    LARGEST_SPEED_M_S,
    Shape,
    above_zero,
    each,
    flag,
    maybe,
    number,
    one_of,
    text,
)

SPEED = above_zero(LARGEST_SPEED_M_S)
EXPONENT = number(-20.0, 20.0)
"""An exponent of the speed: those of a fit are between 0 and 3; within these bounds no power of a speed overflows."""
EXTENSION = {
    "added": [text],
    "before": BOTH_SIDES,
    "after": BOTH_SIDES,
    "noise_floor": FLOOR,
    "unseen": flag,
    "learned_on": [text],
    "judged_on": [text],
    "kept_by": text,
    "data": [{"path": text, "sha256": text}],
}
"""How a model was extended; a history needs all of it."""
MODEL: Shape = {
    **HEAD,
    "axis": one_of(AXES),
    "effects": [text],
    "method": text,
    "runs": [text],
    "parameters": each({"value": number(), "std_error?": maybe(number(0.0)), "unit": text}),
    "free": [text],
    # what could not be estimated is not a number in it, and written as nothing
    "covariance": [[maybe(number(-(LARGEST**2), LARGEST**2))]],
    "speed_law": {
        "reference_m_s": maybe(SPEED),
        "damping_exponent": EXPONENT,
        "authority_exponent": EXPONENT,
        "points": [(SPEED, number())],
        "snap": number(0.0, 10.0),
        "trim_of_fin?": flag,
    },
    "noise": {
        **dict.fromkeys(("angle", "rate"), number(0.0)),
        **dict.fromkeys(("disturbance_time?", "coloured_time?"), above_zero()),
        **dict.fromkeys(("disturbance?", "coloured_angle?", "coloured_rate?", "own_moment?"), number(0.0)),
    },
    "trained": each(maybe(number())),
    "info": {
        "whiteness_p?": maybe(number(0.0, 1.0)),
        "law_parameters?": each({"std_error": maybe(number(0.0))}),
        "extension?": {f"{key}?": shape for key, shape in EXTENSION.items()},
    },
    "own_effects?": [{"name": text, "file": text, "sha256": text, "text?": text, "package?": text}],
}
