"""What planning gains: the planned maneuver, the paper's pulses and a PRBS on the truth simulator, same seconds and limits.

python tests/benchmarks/plan_gain.py [--seeds N] [--speed 1.36] [--disturbance 0.01]
Prints, for each, the standard errors that were predicted and those that many fits show, and how far the heading went.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parents[1]), str(Path(__file__).resolve().parents[2])]

from plan_flights import believed, exact, flown, paper_day, scatter  # noqa: E402

from fieldsid.maneuvers import pick_maneuver  # noqa: E402
from fieldsid.planning.design.best_leg import best_leg, pulses  # noqa: E402
from fieldsid.planning.design.objective import Setting, make_objective  # noqa: E402
from fieldsid.planning.flight.excitation import Excitation, Window  # noqa: E402
from fieldsid.planning.safety.envelope import Envelope  # noqa: E402

WINDOW = Window(33.0)
FIN = 0.26


def entrants(day, heading: float) -> dict[str, Excitation]:
    """The paper's pulses, a PRBS as long and as large, and what is planned within the pulses' heading and within 60 deg."""
    prbs = pick_maneuver("prbs")
    judge = make_objective(Setting(exact(day), Envelope(FIN), WINDOW, {}), day.speed)
    made = {
        "pulses": pulses(judge),
        "prbs": Excitation("prbs", prbs.checked({"amplitude": FIN, "bit": 1.0, "duration": 21.0})),
    }
    for name, limit in (("planned, pulses' heading", heading), ("planned, 60 deg", float(np.radians(60)))):
        envelope = Envelope(FIN, heading=limit)
        made[name] = best_leg(Setting(believed(day), envelope, WINDOW, {}), day.speed).candidate
    return made


def compare(day, seeds: range, method: str) -> list[tuple[str, dict[str, float], dict[str, float], float]]:
    """Rows of (name, predicted standard errors, those of many fits, largest heading in rad)."""
    judge = make_objective(Setting(exact(day), Envelope(FIN), WINDOW, {}), day.speed)
    reach = float(np.max(np.abs(flown(day, pulses(judge), WINDOW, 0)["yaw_rad"])))
    rows = []
    # The prior is off and wide: its draws need some room above what the pulses reach on the truth.
    for name, candidate in entrants(day, 1.5 * reach).items():
        run = flown(day, candidate, WINDOW, 0)
        seen = scatter(day, candidate, WINDOW, seeds, method)
        rows.append((name, judge.expected(candidate).std_errors(), seen, float(np.max(np.abs(run["yaw_rad"])))))
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=300)
    parser.add_argument("--speed", type=float, default=1.36)
    parser.add_argument("--disturbance", type=float, default=0.0)
    options = parser.parse_args()
    day = paper_day(options.speed, options.disturbance)
    method = "pem" if options.disturbance > 0 else "output_error"
    began = time.perf_counter()
    rows = compare(day, range(1, options.seeds + 1), method)
    base = rows[0][2]
    head = f"{day.axis.value} at {day.speed} m/s, 33 s at 20 Hz, {options.seeds} fits by {method}"
    print(f"{head}, disturbance {day.disturbance} rad/s^2")
    print(f"{'maneuver':26}{'parameter':>10}{'predicted':>11}{'seen':>11}{'seen/pred':>11}{'vs pulses':>11}{'heading':>9}")
    for name, predicted, seen, heading in rows:
        for i, n in enumerate(predicted):
            line = f"{'' if i else name:26}{n:>10}{predicted[n]:11.5f}{seen[n]:11.5f}{seen[n] / predicted[n]:11.2f}"
            print(line + f"{seen[n] / base[n]:11.2f}{np.degrees(heading):8.0f}d")
    print(f"{time.perf_counter() - began:.1f} s")


if __name__ == "__main__":
    main()
