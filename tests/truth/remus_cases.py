"""Cases flown by the six-degree-of-freedom REMUS, whose equations contain effects that were not added by hand."""

from __future__ import annotations

import numpy as np

from truth import maneuvers
from truth.bank import LEARNABLE, VISIBLE, Case, pooled
from truth.basefit import Sample, fit_base, left_over
from truth.hull import REMUS, with_fins
from truth.pilots import Autopilot, excited, zigzagging
from truth.vehicle import Fins, Sea, Sensors, fly_vehicle

RUN_S = 60.0
OWN = {
    "yaw": {"sway_coupling", "quadratic_damping", "crossflow_drag"},
    "pitch": {"heave_coupling", "quadratic_damping", "crossflow_drag"},
}
"""Effects that the equations of motion contain in addition to the base model; a lagging fin comes on top."""
COLUMNS = {"yaw": ("yaw_rad", "yaw_rate_rad_s", "rudder_rad"), "pitch": ("pitch_rad", "pitch_rate_rad_s", "elevator_rad")}


def remus_case(index: int, seed: int) -> Case:
    """Return one case by seed and index: yaw or pitch, 1.0 to 1.8 m/s, with or without servo lag.

    Pulses and a 3-2-1-1 are the training runs, a zig-zag and a long maneuver the validation runs.
    """
    rng = np.random.default_rng([seed, index, 100])
    axis, lag = str(rng.choice(["yaw", "pitch"], p=[0.6, 0.4])), float(rng.choice([0.0, 0.1, 0.2]))
    hull, fins = with_fins(REMUS, rng.uniform(2.2, 3.0)), Fins(lag=lag, limit=0.35)
    sensors = Sensors(angle=rng.uniform(0.1, 0.4) * np.pi / 180, rate=rng.uniform(0.1, 0.4) * np.pi / 180)
    speeds = np.array([1.0, 1.4, 1.8])[rng.permutation(3)]
    legs = [("pulses", 0), ("3211", 1), ("pulses", 2), ("zigzag", int(rng.integers(3))), ("long", int(rng.integers(3)))]
    flights = [
        fly_vehicle(
            pilot_for(rng, kind, axis), RUN_S, speed=speeds[g], hull=hull, fins=fins, sensors=sensors,
            sea=Sea(gust=(0.0, 0.0)), seed=int(rng.integers(2**31)), run_up=Autopilot(), run_up_s=30.0,
        )
        for kind, g in legs
    ]  # fmt: skip
    samples = [sample_of(axis, f, speeds[g], g) for (_, g), f in zip(legs, flights, strict=True)]
    floors = [noise_of(axis, part) for part in (flights[:3], flights[3:])]
    start = (1.0,) if axis == "yaw" else (1.0, 0.7)
    fit = min((fit_base(samples[:3], start, floors[1], exponent=e) for e in (0.0, 1.0)), key=lambda f: f.cost)
    left = [np.sqrt(np.mean(left_over(fit, s, floors[1]) ** 2, axis=0)) for s in samples]
    train, judged = (np.sqrt(np.mean(np.square(part), axis=0)) for part in (left[:3], left[3:]))
    ratio, ratio_training = pooled(judged, floors[1]), pooled(train, floors[0])
    accepts = OWN[axis] | ({"servo_lag"} if lag > 0 else set())
    return Case(
        name=f"remus-{seed}-{index}", axis=axis, kind="remus", effects=tuple(sorted(accepts)), accepts=frozenset(accepts),
        expected=frozenset({"effect"}), training=[f.log for f in flights[:3]], validation=[f.log for f in flights[3:]],
        floor=_named(floors[1]), floor_training=_named(floors[0]), base=_named(judged), ratio=ratio,
        ratio_training=ratio_training, visible=ratio > VISIBLE and ratio_training > LEARNABLE,
        details={"causes": {"servo_lag": lag} if lag else {"hull": 1.0}, "speeds": speeds.tolist(), "damping": fit.damping},
    )  # fmt: skip


def pilot_for(rng, kind, axis):
    """Return the pilot of one leg; `long`: a circle in yaw, stairs in pitch."""
    time, pilot = np.arange(0.0, RUN_S, 0.05), Autopilot(depth=None if axis == "pitch" else 5.0)
    if kind == "zigzag":
        return zigzagging(pilot, axis, fin=rng.uniform(0.12, 0.22), angle=rng.uniform(0.15, 0.35))
    if kind == "long":
        plan = maneuvers.circle(time, rng.uniform(0.1, 0.25)) if axis == "yaw" else maneuvers.stairs(time, rng.uniform(0.1, 0.2))
    elif kind == "3211":
        plan = maneuvers.three_two_one_one(time, rng.uniform(0.1, 0.2))
    else:
        plan = maneuvers.pulses(time)
    return excited(pilot, axis, time, np.where(plan.mode == 0, plan.command, np.nan), keep_course=kind == "long")


def sample_of(axis, flight, speed, group):
    """Return a flight as the sample that the base fit takes."""
    angle, rate, fin = (flight.log[name] for name in COLUMNS[axis])
    return Sample(fin, angle, rate, 0.05, speed / 1.4, group)


def noise_of(axis, flights):
    """Return the rms (2,) of measured less true angle and rate over some flights."""
    return np.array([np.sqrt(np.mean([np.mean((f.log[n] - f.truth[n]) ** 2) for f in flights])) for n in COLUMNS[axis][:2]])


def _named(values):
    return {"angle_rad": float(values[0]), "rate_rad_s": float(values[1])}
