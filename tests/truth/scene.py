"""Random base vehicles and their runs: speeds, headings, maneuvers, noise and disturbance. A case without its hidden cause."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from truth import kernel, maneuvers
from truth.basefit import responses
from truth.noise import Clock, ar1, calm, white
from truth.physics import Physics
from truth.simple import fly
from truth.strengths import Setting

RUN_S = 60.0
TRAINING, VALIDATION = 3, 2
DEG = np.pi / 180.0
GUSTY, BOTH = ("disturbance", "both"), 0.5
"""Colours with a disturbance moment, and the share of cases with coloured sensor noise that have one too."""
SCATTER = 0.02
"""Largest relative difference of a run's speed from that of its group, in half of the scenes."""


@dataclass(frozen=True, slots=True)
class Leg:
    """One run before it is flown: speed, group, maneuver, initial angle and depth, inputs (9, total) of unit variance."""

    speed: float
    group: int
    maneuver: maneuvers.Maneuver
    angle: float
    depth: float
    inputs: np.ndarray


@dataclass(frozen=True, slots=True)
class Scene:
    """A base vehicle and five legs; `sigma` is the sensor noise of angle and rate."""

    pitching: bool
    clock: Clock
    base: Physics
    setting: Setting
    law: float
    scatter: np.ndarray
    legs: tuple[Leg, ...]
    sigma: tuple[float, float]
    notes: dict[str, object]

    def trim_factor(self, leg):
        """Return the trim moment of a leg over the nominal one; that of a bent fin is proportional to the authority."""
        return (leg.speed / self.base.nominal_speed) ** 2 * self.scatter[leg.group] if self.notes.get("bent_fin") else 1.0

    def physics(self, leg, updates):
        """Return the coefficients of a leg: authority ~ u^2 with scatter, damping ~ u^law, thrust ~ u^2, pilot's gains."""
        ratio = leg.speed / self.base.nominal_speed
        updates = {k: v for k, v in updates.items() if k not in ("thrust_swing", "roll_push", "depth_spread")}
        times = updates.pop("authority_times", 1.0)
        trim, bend = (0.0, self.base.trim / self.base.authority) if self.notes.get("bent_fin") else (self.base.trim, 0.0)
        trim += updates.pop("trim", 0.0) + updates.pop("fin_trim", 0.0) * self.scatter[leg.group]
        authority = self.base.authority * ratio**2 * self.scatter[leg.group] * times
        damping = self.base.damping * ratio**self.law
        kp, kd = gains(damping, self.base.stiffness, authority, self.base.kp)
        return self.base._replace(
            authority=authority, damping=damping, trim=trim, fin_bend=bend, kp=kp, kd=kd,
            nominal_speed=leg.speed, median_speed=leg.speed, nominal_thrust=self.base.nominal_thrust * ratio**2,
        )._replace(**updates)  # fmt: skip


def gains(damping, stiffness, authority, omega):
    """Return the gains of a pilot who places the natural frequency at `omega` rad/s with a damping ratio of 0.8."""
    b = abs(authority)
    kp = max(omega**2 - stiffness, 0.3 * stiffness) / b
    return min(kp, 4.0), min(max((1.6 * np.sqrt(stiffness + min(kp, 4.0) * b) - damping) / b, 0.0), 3.0)


def draw_scene(rng, pitching, wants=(), colour=None):
    """Return a random vehicle with five legs; wants: maneuvers that should be among them, colour: that of the noise."""
    clock = Clock(1.0 / rng.choice([20.0, 10.0, 50.0], p=[0.76, 0.12, 0.12]), 0)
    clock = Clock(clock.sample, round(RUN_S / clock.sample))
    base, setting = draw_vehicle(rng, pitching)
    speeds = base.nominal_speed * (np.ones(1) if rng.random() < 0.25 else np.array([0.8, 1.0, 1.3])[: rng.integers(2, 4)])
    scatter = np.ones(len(speeds)) if rng.random() < 0.5 else 1.0 + rng.uniform(-0.1, 0.1, len(speeds))
    groups = [*(i % len(speeds) for i in range(TRAINING)), *rng.integers(0, len(speeds), VALIDATION)]
    sigma = tuple(np.exp(rng.uniform(np.log(0.1), np.log(0.5), 2)) * DEG)
    kinds = pick_maneuvers(rng, pitching, wants)
    weather = {"colour": str(rng.choice(["white", "disturbance", "ar1"], p=[0.5, 0.38, 0.12])), "gust": rng.uniform(0.3, 1.5)}
    weather |= {"gust_s": rng.uniform(0.3, 2.0), "swing": rng.uniform(0.1, 0.3) if rng.random() < 0.35 else 0.0}
    legs, (own, sky) = [], rng.spawn(2)
    weather |= {"wander": sky.uniform(0.3, 1.0), "wander_s": np.exp(sky.uniform(np.log(0.3), np.log(3.0)))}
    if weather["colour"] == "ar1" and sky.random() < BOTH:
        weather["colour"] = "both"
    weather["colour"] = colour or weather["colour"]
    spread = SCATTER * float(own.integers(0, 2))
    for kind, group in zip(kinds, groups, strict=True):
        maneuver = draw_maneuver(rng, kind, clock.time, pitching=pitching)
        angle = 0.0 if pitching else rng.uniform(-np.pi, np.pi)
        speed = speeds[group] * (1.0 + own.uniform(-spread, spread))
        legs.append(Leg(speed, int(group), maneuver, angle, 6.0 + rng.uniform(-1, 1), unit_weather(rng, clock, weather)))
    law = float(rng.choice([0.0, 1.0]))
    notes = {"kinds": kinds, **weather}
    return Scene(pitching, clock, base, setting, law, scatter, tuple(legs), sigma, notes)


def draw_vehicle(rng, pitching):
    """Return a random base model at its reference speed, and the setting that scales the effects."""
    damping = np.exp(rng.uniform(np.log(0.3), np.log(3.0)))
    stiffness = np.exp(rng.uniform(np.log(0.15), np.log(1.5))) if pitching else 0.0
    pulse = responses(damping, stiffness, np.full(41, 0.26), 0.05)[:, 0 if pitching else 1, 0]
    size = 0.26 * (rng.uniform(0.10, 0.35) if pitching else rng.uniform(0.06, 0.25)) / pulse.max()
    authority = rng.choice([-1.0, 1.0]) * size / 0.26
    speed, thrust = rng.uniform(1.0, 1.9), float(np.exp(rng.uniform(np.log(10.0), np.log(90.0))))
    base = Physics(
        damping=damping, stiffness=stiffness, authority=authority, trim=authority * rng.uniform(-0.03, 0.03),
        nominal_speed=speed, nominal_thrust=thrust, reference_thrust=thrust,
        surge_tau=rng.uniform(2.0, 6.0), kp=rng.uniform(0.6, 1.1),
        roll_omega=rng.uniform(0.6, 1.6), roll_zeta=rng.uniform(0.15, 0.5), roll_by_turn=rng.uniform(0.0, 0.1),
        cross_damping=rng.uniform(0.5, 2.0), cross_rate=rng.uniform(0.2, 0.8),
    )  # fmt: skip
    rate = size / (damping + np.sqrt(stiffness)) if pitching else size / damping
    return base, Setting(pitching, damping, stiffness, authority, speed, thrust, rate, TRAINING + VALIDATION)


def pick_maneuvers(rng, pitching, wants):
    """Return the names of five maneuvers: three for training, two for validation, of other kinds where possible."""
    every = ["pulses", "3211", "prbs", "multisine", "zigzag", "stairs" if pitching else "circle"]
    names = [w for w in wants if w in every]
    rest = [k for k in every if k not in names]
    rng.shuffle(rest)
    training = (names + (["pulses"] if "pulses" in rest and rng.random() < 0.5 else []) + rest)[:TRAINING]
    training = list(dict.fromkeys(training + rest))[:TRAINING]
    others = [k for k in every if k not in training]
    judged = list(rng.permutation(others)[:VALIDATION])
    if names:
        judged[0] = names[0]
    return [*training, *map(str, judged)]


def draw_maneuver(rng, kind, time, *, pitching):
    """Return a maneuver of a kind with random settings."""
    fin = rng.uniform(0.14, 0.28)
    kinds = {
        "pulses": lambda: maneuvers.pulses(time, 0.26, 0.15, polarity=rng.choice([-1.0, 1.0]), recovery=rng.uniform(6.0, 12.0)),
        "3211": lambda: maneuvers.three_two_one_one(time, fin, step=rng.uniform(0.8, 1.6)),
        "prbs": lambda: maneuvers.prbs(time, rng, fin, hold=rng.uniform(0.5, 1.5)),
        "multisine": lambda: maneuvers.multisine(time, rng, fin),
        "zigzag": lambda: maneuvers.zigzag(time, fin, rng.uniform(0.08, 0.2) if pitching else rng.uniform(0.1, 0.5)),
        "stairs": lambda: maneuvers.stairs(time, fin),
        "circle": lambda: maneuvers.circle(time, fin, length=rng.uniform(15.0, 24.0)),
    }
    return kinds[kind]()


def unit_weather(rng, clock, weather):
    """Return inputs (9, total) with disturbance and sensor noise of standard deviation one, and a thrust between -1 and 1."""
    out, n, h = calm(clock), clock.total, clock.sample
    wander = weather["wander"] if weather["colour"] in ("ar1", "both") else 0.0
    for row in (kernel.ANGLE_NOISE, kernel.RATE_NOISE):
        slow = ar1(rng, n, np.sqrt(wander), weather["wander_s"], h) if wander else 0.0
        out[row] = white(rng, n, np.sqrt(1.0 - wander)) + slow
    gust = ar1(rng, n, 1.0, weather["gust_s"], h)
    out[kernel.DISTURBANCE] = gust if weather["colour"] in GUSTY else 0.0
    out[kernel.ROLL_PUSH] = ar1(rng, n, 1.0, 1.0, h)
    steps = rng.uniform(-1.0, 1.0, 8)
    out[kernel.THRUST] = np.interp(clock.whole, np.linspace(clock.whole[0], clock.whole[-1], 8), steps)
    return out


def calibrated(scene):
    """Return the scene with the disturbance scaled so that it moves the angle by `gust` times the sensor noise (rms)."""
    if scene.notes["colour"] not in GUSTY:
        return scene
    moved = []
    for leg in scene.legs:
        quiet = maneuvers.Maneuver("drift", np.zeros(scene.clock.samples), np.full(scene.clock.samples, kernel.OPEN))
        free = scene.physics(leg, {"trim": -scene.base.trim * scene.trim_factor(leg)})._replace(kp=0.0, kd=0.0)
        inputs = calm(scene.clock, free.nominal_thrust)
        inputs[kernel.DISTURBANCE] = leg.inputs[kernel.DISTURBANCE]
        drift = fly(free, scene.clock, quiet, inputs, pitching=scene.pitching, step=0.02).angle
        slope = np.polyfit(scene.clock.time, drift, 1)
        moved.append(np.sqrt(np.mean((drift - np.polyval(slope, scene.clock.time)) ** 2)))
    size = scene.notes["gust"] * scene.sigma[0] / np.sqrt(np.mean(np.square(moved)))
    for leg in scene.legs:
        leg.inputs[kernel.DISTURBANCE] *= size
    return scene
