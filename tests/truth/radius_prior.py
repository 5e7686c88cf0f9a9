"""The prior of the maneuvering model from an ensemble of hulls: writes `fieldsid/turning/maneuvering/prior_table.py`.

python tests/truth/radius_prior.py [--draws 1400] [--write]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from truth.maneuvering.hulls import Coefficients, draw_hull

SEED = 1
TABLE = Path(__file__).resolve().parents[2] / "fieldsid" / "turning" / "maneuvering" / "prior_table.py"
OFFSET_SD = 0.02
"""Standard deviation of the rudder offset in rad, larger than in the ensemble: real fins are mounted less precisely."""


def reduced(h: Coefficients) -> np.ndarray:
    """Return the model's parameters without the length: D, M, t, R, a, k, Yv, Yr, Nv, Nr, C, c, d0, lag, X, rate limit."""
    mass, size = h.mass_sway, h.length
    return np.array(
        [
            np.log(h.drag * size / h.mass_surge),
            h.centripetal_surge / h.mass_surge,
            h.thrust_slope,
            np.log(h.rudder * size / mass),
            h.fin_arm / size,
            np.log(h.inertia_yaw / (mass * size**2)),
            size * (h.lift + h.fixed_fin + h.tail_mass) / mass,
            (h.centripetal_sway + h.fixed_fin * h.fin_arm + h.tail_mass * h.tail_arm) / mass,
            (h.munk + h.lift * h.lift_arm + h.fixed_fin * h.fin_arm + h.tail_mass * h.tail_arm) / mass,
            (h.centripetal_yaw + h.fixed_fin * h.fin_arm**2 + h.tail_mass * h.tail_arm**2) / (mass * size),
            np.log(h.section_drag * size**2 / mass),
            np.log(h.stall),
            h.rudder_offset,
            np.log(h.servo_lag),
            h.coupling / (h.mass_surge * size),
            np.log(h.rate_limit),
        ]
    )


def table(draws: int) -> str:
    """Return the text of the module with the table."""
    sample = np.array([reduced(draw_hull(i, SEED).of) for i in range(draws)])
    spread = sample.std(axis=0)
    spread[12] = OFFSET_SD
    correlation = np.corrcoef(sample.T)
    rows = "\n".join(f"    ({', '.join(f'{v:.3f}' for v in row)})," for row in correlation)

    def numbers(values: np.ndarray) -> str:
        return ",\n    ".join(", ".join(f"{v:.4f}" for v in part) for part in np.array_split(values, 2))

    return (
        f'"""Moments of the coefficients over {draws} hulls, seed {SEED}: written by `tests/truth/radius_prior.py`."""\n\n'
        f"# fmt: off\nMEAN = (\n    {numbers(sample.mean(axis=0))},\n)\n"
        f"STANDARD_DEVIATION = (\n    {numbers(spread)},\n)\nCORRELATION = (\n{rows}\n)\n"
    )


def main() -> None:
    """Print the table, or write it."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--draws", type=int, default=1400)
    asked.add_argument("--write", action="store_true")
    given = asked.parse_args()
    text = table(given.draws)
    if given.write:
        TABLE.write_text(text)
    else:
        print(text)


if __name__ == "__main__":
    main()
