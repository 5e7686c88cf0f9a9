"""The blind bank of simulated cases: one hidden effect, two, none, one in another form, or a cause that is in no catalogue."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from truth import kernel
from truth.basefit import Sample, fit_base, left_over, responses, start_removed
from truth.logbook import write_log
from truth.scene import GUSTY, TRAINING, calibrated, draw_scene
from truth.simple import fly, replay
from truth.strengths import LARGEST, PITCH, RESHAPED, YAW, reshaped
from truth.uncatalogued import CAUSES

KINDS = ("single", "imperfect", "none", "pair", "uncatalogued")
SHARES = (0.5, 0.13, 0.13, 0.12, 0.12)
VISIBLE = 1.35
LEARNABLE = 1.2
"""Least error of the base model over the noise floor, on the validation runs (VISIBLE) and on the training runs (LEARNABLE)."""
TRIES = 4
BENT = 0.7
"""Share of the yaw cases whose trim comes from a bent fin; that of the others is a moment independent of speed."""
WANTS = {
    "current": ("circle", "zigzag"), "compass_deviation": ("circle", "zigzag"), "sway_coupling": ("zigzag",),
    "crossflow_drag": ("circle", "zigzag"), "quadratic_damping": ("circle", "zigzag"), "large_angle_righting": ("stairs",),
    "heave_coupling": ("stairs", "zigzag"), "stall": ("pulses",), "speed_varying": ("zigzag",),
}  # fmt: skip
APART = (
    {"delay", "servo_lag", "rate_limit", "clock_offset"}, {"deadband", "backlash", "stall", "asymmetric_fin"},
    {"quadratic_damping", "crossflow_drag", "stall", "sway_coupling", "heave_coupling", "speed_varying", "gyro_scale"},
    {"trim_drift", "step_change", "prop_moment", "speed_moment", "depth_buoyancy", "wave", "roll_coupling", "gyro_bias"},
    {"current", "compass_deviation", "trim_drift"}, {"large_angle_righting", "step_change", "depth_buoyancy"},
)  # fmt: skip
"""Sets of look-alike effects: a pair has at most one member of each; the cases with one effect test telling them apart."""


EXPECTED = {"none": frozenset({"sufficient", "disturbed"}), "uncatalogued": frozenset({"unexplained", "disturbed"})}
"""Correct verdicts where no effect of the catalogue is hidden; waves, or a moment like theirs, count as a disturbance."""


@dataclass(frozen=True, slots=True)
class Case:
    """One blind case. `training` and `validation` are logs with canonical columns.

    `floor`: rms, per channel over the validation runs, of the measurement less the response of the truth without noise and
    disturbance, its initial state refitted. `ratio`: error of the base model over that, both channels pooled, on the
    validation runs; `ratio_training`: on the training runs. `visible`: whether they exceed VISIBLE and LEARNABLE. `effects`:
    names of the hidden effects in the catalogue; `accepts`: names that count as correct.
    """

    name: str
    axis: str
    kind: str
    effects: tuple[str, ...]
    accepts: frozenset[str]
    expected: frozenset[str]
    training: list[dict[str, np.ndarray]]
    validation: list[dict[str, np.ndarray]]
    floor: dict[str, float]
    floor_training: dict[str, float]
    base: dict[str, float]
    ratio: float
    ratio_training: float
    visible: bool
    details: dict[str, object] = field(default_factory=dict)


@dataclass(slots=True)
class Hidden:
    """Hidden causes of a case, each a list of name, apply, events and strength."""

    causes: list[list]

    def updates(self, ratio, run, index=None):
        """Return the fields of Physics and of the scene that one cause, or all of them, set in one run."""
        out: dict[str, float] = {}
        for _, apply, _, strength in self.causes if index is None else [self.causes[index]]:
            new = apply(strength, ratio, run)
            out |= {k: out.get(k, 0.0) + v if k == "trim" else v for k, v in new.items()}
        return out


def cases(n: int, seed: int, *, kind: str | None = None, first: int = 0) -> Iterator[Case]:
    """Yield cases first .. first + n - 1 of a bank; each depends on the seed and its index only."""
    for index in range(first, first + n):
        yield make_case(index, seed, kind=kind)


def make_case(
    index: int, seed: int, *, kind: str | None = None, colour: str | None = None, sensors: float = 1.0
) -> Case:  # fmt: skip
    """Return one case by seed and index; kind and colour (of the noise) replace what the bank would draw.

    The logs have the share `sensors` of the noise of angle and rate for which the hidden effect was sized.
    """
    rng = np.random.default_rng([seed, index])
    drawn = str(rng.choice(KINDS, p=SHARES))
    kind = drawn if kind is None else kind
    pitching = bool(rng.random() < 0.4)
    names = draw_names(rng, kind, pitching)
    scene = draw_scene(rng, pitching, WANTS.get(names[0], ()) if names else (), colour)
    scene.notes["bent_fin"] = not pitching and bool(np.random.default_rng([seed, index, 1]).random() < BENT)
    scene = calibrated(scene)
    hidden = draw_hidden(rng, kind, names, scene)
    goal = np.exp(rng.uniform(np.log(1.45), np.log(8.0))) if kind in ("single", "imperfect") else rng.uniform(2.0, 6.0)
    scene.notes["alone"] = [tune(scene, hidden, i, goal) for i in range(len(hidden.causes))]
    scene.notes["sensors"] = sensors
    return assemble(f"{kind}-{seed}-{index}", kind, names, scene, hidden, rng)


def draw_names(rng, kind, pitching):
    """Return the names of the hidden causes."""
    catalogue = sorted(PITCH if pitching else YAW)
    if kind == "none":
        return ()
    if kind == "single":
        return (str(rng.choice(catalogue)),)
    if kind == "imperfect":
        yaw = ["sway_coupling", "compass_deviation", "roll_coupling", "current"]
        own = ["heave_coupling", "depth_buoyancy"] if pitching else yaw
        return (str(rng.choice([*RESHAPED, *own])),)
    if kind == "uncatalogued":
        return (str(rng.choice(sorted(CAUSES))),)
    while True:
        pair = tuple(map(str, rng.choice(catalogue, 2, replace=False)))
        if not any(set(pair) <= group for group in APART):
            return pair


def draw_hidden(rng, kind, names, scene):
    """Return the causes with random shapes; `tune` sets their strengths."""
    catalogue = PITCH if scene.pitching else YAW
    causes = []
    for name in names:
        if kind == "uncatalogued":
            apply, events = CAUSES[name](rng, scene.setting)
        else:
            apply, events = catalogue[name](rng, scene.setting), None
            apply = reshaped(name, apply, scene.setting, rng) if kind == "imperfect" else apply
        causes.append([name, apply, events, 0.3])
    return Hidden(causes)


def inputs_of(scene, physics, hidden, leg, i, updates, *, noisy, only=None):
    """Return the kernel's inputs (9, total) for one leg: noise, disturbance, thrust, roll and events."""
    inputs = leg.inputs.copy()
    swing = updates.get("thrust_swing", scene.notes["swing"])
    inputs[kernel.THRUST] = physics.nominal_thrust * (1.0 + swing * inputs[kernel.THRUST])
    inputs[kernel.ROLL_PUSH] *= updates.get("roll_push", 0.01)
    scale = 1.0 if noisy else 0.0
    inputs[kernel.ANGLE_NOISE] *= scene.sigma[0] * scale
    inputs[kernel.RATE_NOISE] *= scene.sigma[1] * scale
    inputs[kernel.DISTURBANCE] *= scale
    for k, (_, _, events, strength) in enumerate(hidden.causes):
        if events is not None and only in (None, k):
            events(inputs, scene.clock, strength, i)
    return inputs


def fly_leg(scene, hidden, i, *, noisy, only=None, step=0.002):
    """Fly leg i with all causes or one, and return the physics, the inputs, the motion and the depth at the start."""
    leg = scene.legs[i]
    updates = hidden.updates(leg.speed / scene.base.nominal_speed, i, only)
    physics = scene.physics(leg, updates)
    inputs = inputs_of(scene, physics, hidden, leg, i, updates, noisy=noisy, only=only)
    depth = 6.0 + updates.get("depth_spread", 0.3) * (leg.depth - 6.0)
    flight = {"pitching": scene.pitching, "angle": leg.angle, "depth": depth}
    if updates.get("thrust_swing", scene.notes["swing"]) > 0.0 or physics.surge_loss > 0.0:
        # authority and damping are given at the speed of the leg, so the run's median speed must equal it
        median = np.median(fly(physics, scene.clock, leg.maneuver, inputs, step=0.01, **flight).surge)
        inputs[kernel.THRUST] *= (leg.speed / median) ** 2
    motion = fly(physics, scene.clock, leg.maneuver, inputs, step=step, **flight)
    return physics, inputs, motion, depth


def sample_of(scene, i, motion, noise=(0.0, 0.0)):
    """Return a run as the sample that the base fit takes."""
    leg = scene.legs[i]
    ratio = leg.speed / scene.base.nominal_speed
    angle, rate = motion.angle + noise[0], motion.rate + noise[1]
    return Sample(motion.command, angle, rate, scene.clock.sample, ratio, leg.group, scene.trim_factor(leg))


def base_errors(scene, samples, floor):
    """Fit the base model to the training runs; return its pooled error over `floor` on training and validation runs.

    The third value is the rms per channel on the validation runs.
    """
    start = (scene.setting.damping, scene.setting.stiffness)[: 2 if scene.pitching else 1]
    laws = (scene.law,) if len({s.ratio for s in samples}) == 1 else (0.0, 1.0)
    fit = min((fit_base(samples[:TRAINING], start, floor, exponent=e) for e in laws), key=lambda f: f.cost)
    left = [np.sqrt(np.mean(left_over(fit, s, floor) ** 2, axis=0)) for s in samples]
    train, valid = (np.sqrt(np.mean(np.square(part), axis=0)) for part in (left[:TRAINING], left[TRAINING:]))
    return pooled(train, floor), pooled(valid, floor), valid


def pooled(rms, floor):
    """Return the root of the mean of the squared ratios of rms and floor, one number for both channels."""
    return float(np.sqrt(np.mean((np.asarray(rms) / np.asarray(floor)) ** 2)))


def tune(scene, hidden, i, goal):
    """Set the strength of cause i so that the base error is about `goal` times the floor, and return that ratio as reached."""
    name = hidden.causes[i][0]
    largest, seen, floor = LARGEST.get(name, 3.0), [], expected_floor(scene)
    wanted, strength = np.sqrt(goal**2 - 1.0), 0.3
    for _ in range(TRIES):
        hidden.causes[i][3] = strength
        flown = [fly_leg(scene, hidden, k, noisy=False, only=i, step=0.01)[2] for k in range(len(scene.legs))]
        _, got, _ = base_errors(scene, [sample_of(scene, k, m) for k, m in enumerate(flown)], floor)
        seen.append((abs(np.log(max(got, 1e-6) / wanted)), strength, np.sqrt(1.0 + got**2)))
        following = float(np.clip(strength * np.clip(wanted / max(got, 1e-6), 0.1, 8.0), 0.01, largest))
        if seen[-1][0] < 0.15 or following == strength:
            break
        strength = following
    _, hidden.causes[i][3], alone = min(seen)
    return float(alone)


def expected_floor(scene):
    """Return an estimate of the floor: the sensor noise, and the motion that the disturbance causes."""
    gust = scene.notes["gust"] if scene.notes["colour"] in GUSTY else 0.0
    return scene.sigma[0] * np.sqrt(1.0 + gust**2), scene.sigma[1] * (1.0 + 0.3 * min(gust, 1.0))


def assemble(name, kind, names, scene, hidden, rng):
    """Fly every leg with its noise and disturbance, measure floor and base error, and return the case with its logs."""
    logs, noise_left, samples = [], [], []
    if "crossflow_drag" in names:  # without measured sway it cannot be told from quadratic damping
        scene.notes["cross_measured"] = True
    for i, leg in enumerate(scene.legs):
        physics, inputs, motion, depth = fly_leg(scene, hidden, i, noisy=True)
        noise = scene.clock.logged(inputs[kernel.ANGLE_NOISE]), scene.clock.logged(inputs[kernel.RATE_NOISE])
        ideal = replay(physics, scene.clock, motion, inputs, pitching=scene.pitching, angle=leg.angle, depth=depth)
        error = np.stack([motion.angle + noise[0] - ideal.angle, motion.rate + noise[1] - ideal.rate], axis=1)
        start = responses(physics.damping, physics.stiffness, motion.command, scene.clock.sample)[:, :, 2:]
        noise_left.append(np.sqrt(np.mean(start_removed(error, start, scene.sigma) ** 2, axis=0)))
        samples.append(sample_of(scene, i, motion, noise))
        measured = sample_of(scene, i, motion, [scene.notes.get("sensors", 1.0) * e for e in noise])
        logs.append(write_log(rng, scene, motion, measured, inputs))
    floors = [np.sqrt(np.mean(np.square(part), axis=0)) for part in (noise_left[:TRAINING], noise_left[TRAINING:])]
    trained, _, _ = base_errors(scene, samples, floors[0])
    _, judged, base = base_errors(scene, samples, floors[1])
    return Case(
        name=name, axis="pitch" if scene.pitching else "yaw", kind=kind,
        effects=() if kind in ("none", "uncatalogued") else names,
        accepts=frozenset() if kind in ("none", "uncatalogued") else accepted(names, hidden),
        expected=EXPECTED.get(kind, frozenset({"effect"})),
        training=logs[:TRAINING], validation=logs[TRAINING:], floor=_named(floors[1]), floor_training=_named(floors[0]),
        base=_named(base), ratio=judged, ratio_training=trained, visible=seen(judged, trained, scene),
        details=_details(scene, hidden),
    )  # fmt: skip


def seen(judged, trained, scene):
    """Whether the base error clearly exceeds the floor, also with each of the causes alone."""
    return judged > VISIBLE and trained > LEARNABLE and min(scene.notes["alone"], default=VISIBLE + 1) > VISIBLE


def accepted(names, hidden):
    """Return the names that count as correct: to a linear hull, late sensors and a delayed fin are the same."""
    late = hidden.updates(1.0, 0).get("clock_offset", 0.0) < 0.0
    return frozenset(names) | ({"delay"} if late else set())


def _named(values):
    return {"angle_rad": float(values[0]), "rate_rad_s": float(values[1])}


def _details(scene, hidden):
    s = scene.setting
    return {
        "causes": {name: strength for name, _, _, strength in hidden.causes},
        "speeds": [round(leg.speed, 3) for leg in scene.legs],
        "rate_hz": round(1.0 / scene.clock.sample),
        "damping": s.damping, "stiffness": s.stiffness, "authority": s.authority, "law": scene.law, **scene.notes,
        "fields": hidden.updates(1.0, 0), "nominal_speed": s.speed, "trim": scene.base.trim, "run_s": scene.clock.time[-1],
        "per_run": [hidden.updates(1.0, i) for i in range(TRAINING)],
    }  # fmt: skip
