"""What each step of the tour came to, in a few words with its numbers: a line of the short tour."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fieldsid.comparison.sufficient import over_noise
from fieldsid.planning.design.leg import error_in_words
from fieldsid.rounding import number

Result = Mapping[str, Any]


def relative(parameter: Result) -> float:
    """Return a parameter's error as a share of it."""
    return abs(float(parameter["std_error"]) / float(parameter["value"]))


def settled(check: Result) -> float:
    """Return how long a step takes to settle, s."""
    return float(check["settling_s"])


def planned(result: Result) -> str:
    """Return what the step came to."""
    leg = result["legs"][0]
    bought = {name: e for name, e in leg["expected"].items() if e["relative"] and e["baseline"]}
    errors = ", ".join(f"{n} to {error_in_words(e['value'], e['std_error'], e['relative'])}" for n, e in bought.items())
    return f"{leg['window']['length_s']:.0f} s at {leg['speed_m_s']:.1f} m/s will buy {errors}"


def inspected(_result: Result) -> str:
    """Return what the step came to."""
    return "degrees under the logger's own names; a mapping is proposed"


def imported(result: Result) -> str:
    """Return what the step came to."""
    return f"{len(result['runs'])} runs: SI and radians, one clock"


def fitted(result: Result) -> str:
    """Return what the step came to."""
    fits = result["fits"]
    left = max(over_noise(f, f["noise_floor"]) for f in fits)
    return f"{len(fits)} model{'s' * (len(fits) > 1)}, what is left is {left:.1f} x the sensors' noise"


def compared(result: Result) -> str:
    """Return what the step came to."""
    run = max(result["runs"], key=lambda r: float(r["over_noise"]))
    said = f"{run['run']}: error {run['over_noise']:.2f} x the noise"
    return f"{said}, most of it at `{run['where'][0]['condition']}`" if run["failing"] else f"{said}: nothing is left"


def diagnosed(result: Result) -> str:
    """Return what the step came to."""
    first = result["candidates"][0]
    if not result["effects"]:
        return f"{result['verdict']}: no effect is named"
    return f"{' and '.join(result['effects'])}, probability {number(first['probability'], 3)}"


def extended(result: Result) -> str:
    """Return what the step came to."""
    before, after = (result["over_floor"][when] for when in ("before", "after"))
    return f"error on unseen runs {before:.2f} -> {after:.2f} x the noise, {'kept' if result['kept'] else 'not kept'}"


def remembered(result: Result) -> str:
    """Return what the step came to."""
    return f"parent, data and error of each step; drawn in {result['figure']}"


def refitted(result: Result) -> str:
    """Return what the step came to."""
    name = next(iter(result["fits"][0]["parameters"]))
    worst = max(relative(f["parameters"][name]) for f in result["fits"])
    return f"{len(result['fits'])} speeds, {name} to {100 * worst:.1f} % or better"


def lawful(result: Result) -> str:
    """Return what the step came to."""
    laws = {name: law for name, law in result["laws"].items() if law.get("exponent")}
    powers = ", ".join(f"|{name}| as u^{law['exponent']['value']:.2f}" for name, law in laws.items())
    return powers or "a law for each parameter"


def turned(result: Result) -> str:
    """Return what the step came to."""
    tightest = min(result["rows"], key=lambda row: float(row["radius_m"]))
    low, high = tightest["interval95"]
    at = f"{number(tightest['radius_m'], 3)} m at {number(tightest['speed_m_s'], 2)} m/s"
    return f"{at}, 95 % {number(low, 3)} .. {number(high, 3)} m, {tightest['trust']}"


def scheduled(result: Result) -> str:
    """Return what the step came to."""
    first, last = result["rows"][0], result["rows"][-1]
    return (
        f"kp {number(first['kp'], 2)} at {number(first['speed_m_s'], 2)} m/s to "
        f"{number(last['kp'], 2)} at {number(last['speed_m_s'], 2)} m/s"
    )


def verified(result: Result) -> str:
    """Return what the step came to."""
    longest = max(settled(c) for c in result["scheduled"])
    return f"least phase margin {result['worst']['phase_margin_deg']:.0f} deg, a heading step settles within {longest:.0f} s"


def exported(_result: Result) -> str:
    """Return what the step came to."""
    return "ROS 2 parameters"


def reported(result: Result) -> str:
    """Return what the step came to."""
    return f"{result['file']}: open it in a browser"
