"""The telltale of every effect: a vehicle that has it, the textbook's model fitted to its log, and what that leaves.

The vehicle is the tour's. An effect that is not in STRENGTHS is as strong as the tour makes it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fieldsid.demo.vehicle import BASE, LIMITS, NOISE, SPEED, UNITS, helpers, hidden_vehicle, training_maneuver
from fieldsid.effects import pick_effect
from fieldsid.figures import canvas, motion
from fieldsid.figures.drawn import draw
from fieldsid.fitting.identify import identify
from fieldsid.fitting.predict.predict import Prediction
from fieldsid.logs.run import Run
from fieldsid.maneuvers import pick_maneuver
from fieldsid.models.model import Model
from fieldsid.models.record import record_of
from fieldsid.models.speed_law import TRIM_OF_FIN, SpeedLaw
from fieldsid.planning.flight.dry_run import dry_run, with_noise

SEED = 3
STRENGTHS: Mapping[str, tuple[str, Mapping[str, float]]] = {
    "asymmetric_fin": ("square_pulses", {"asymmetry": 0.25}),
    "backlash": ("stairs", {"gap": 0.08}),
    "clock_offset": ("square_pulses", {"offset": -0.25}),
    "compass_deviation": ("turning_circle", {"deviation_sin": 0.05, "deviation_cos": 0.0}),
    "crossflow_drag": ("zigzag", {"crossflow": 3.0, "flow_damping": 0.8, "flow_rate": 0.5, "flow_fin": 0.0}),
    "current": ("turning_circle", {"current_sin": 0.02, "current_cos": 0.0}),
    "deadband": ("stairs", {"width": 0.05}),
    "delay": ("square_pulses", {"delay": 0.3}),
    "depth_buoyancy": ("square_pulses", {"depth_moment": 0.02}),
    "gyro_bias": ("square_pulses", {"bias": 0.015}),
    "gyro_scale": ("square_pulses", {"scale_error": 0.3}),
    "heave_coupling": ("square_pulses", {"cross_damping": 1.0, "cross_rate": -0.6}),
    "large_angle_righting": ("stairs", {"righting_sin": 0.35, "righting_cos": 1.0}),
    "prop_moment": ("square_pulses", {"prop_moment": 0.001}),
    "quadratic_damping": ("stairs", {"quadratic": 5.0}),
    "rate_limit": ("square_pulses", {"max_rate": 0.25}),
    "roll_coupling": ("square_pulses", {"roll_moment": 0.2}),
    "servo_lag": ("square_pulses", {"lag": 0.35}),
    "speed_moment": ("square_pulses", {"speed_moment": 0.05}),
    "speed_varying": ("zigzag", {"speed_share": 1.0}),
    "stall": ("stairs", {"stall_angle": 0.18, "slope_after": 0.0}),
    "step_change": ("square_pulses", {"loss": 0.3, "moment_step": 0.01}),
    "sway_coupling": ("square_pulses", {"cross_damping": 1.0, "cross_rate": -0.6}),
    "trim_drift": ("square_pulses", {"drift": 0.06}),
    "wave": ("square_pulses", {"period": 6.0, "amplitude": 0.03}),
}
HELPER = {
    "surge": ("speed [m/s]", 1.0), "thrust": ("thrust [%]", 1.0), "roll": ("roll [deg]", np.degrees(1.0)),
    "depth": ("depth [m]", 1.0),
}  # fmt: skip


@dataclass(frozen=True)
class Telltale:
    """A vehicle with an effect, and the maneuver it flies."""

    model: Model
    maneuver: str

    @cached_property
    def shown(self) -> Prediction:
        """Its motion without noise, and that of the textbook's model fitted to its log."""
        run = _flown(self.model, self.maneuver)
        log = with_noise(run, self.model, SEED)
        fit = identify([log], self.model.axis, method="output_error", whole=True)[0].predictions[0]
        return replace(fit, record=record_of(run, self.model.axis))

    @property
    def strength(self) -> dict[str, float]:
        """The effect's coefficients."""
        return {n: v for n, v in self.model.values.items() if n not in BASE[self.model.axis]}


def telltale_of(name: str) -> Telltale:
    """Return the telltale of an effect."""
    return Telltale(*_vehicle(name))


def _vehicle(name: str) -> tuple[Model, str]:
    if name not in STRENGTHS:
        model = hidden_vehicle(name)
        return model, training_maneuver(model).name
    maneuver, values = STRENGTHS[name]
    axis = pick_effect(name).axes[0]
    law = SpeedLaw(SPEED, trim_of_fin=TRIM_OF_FIN[axis])
    return Model(axis, (name,), BASE[axis] | dict(values), UNITS, (), np.zeros((0, 0)), law, NOISE), maneuver


def _flown(model: Model, maneuver: str) -> Run:
    effects = tuple(pick_effect(n) for n in model.effects)
    known = pick_maneuver(maneuver)
    return dry_run(model, known, known.checked({}), speed=SPEED, limits=LIMITS, helpers=lambda t: helpers(effects, t, SPEED))


def figure(told: Telltale) -> Figure:
    """Return the figure: the rate with the effect and the textbook's model, the fin, what the effect needs, and the residual."""
    roles = pick_effect(told.model.effects[0]).needs
    rows = 3 + len(roles)
    sheet = canvas.sheet(6.6, 1.15 * rows + 0.9)
    axes = sheet.subplots(rows, 1, sharex=True, height_ratios=(1.5, *(0.9 for _ in range(rows - 2)), 1.4))
    view, time = told.shown, told.shown.record.time
    symbol = motion.SYMBOLS[told.model.axis][1]
    canvas.dress(axes[0], y=f"{symbol} [deg/s]")
    axes[0].plot(time, motion.measured(view.record, 1), color="0.25", linewidth=1.5, label="with the effect")
    axes[0].plot(time, np.degrees(view.rate), color=canvas.SIMULATED, linewidth=1.1, label="textbook's model, fitted to it")
    canvas.legend_above(axes[0], 80)
    draw(motion.fin(replace(view, fin=view.record.fin)), axes[1], 80)
    for ax, role in zip(axes[2:], roles, strict=False):
        label, factor = HELPER[role]
        canvas.dress(ax, y=label)
        ax.plot(time, factor * view.record[role], color=canvas.THIRD, linewidth=1.1)
    _draw_residual(view, axes[-1])
    axes[-1].set_xlim(time[0], time[-1])
    axes[-1].set_xlabel("time [s]")
    sheet.align_ylabels(list(axes))
    return sheet


def _draw_residual(view: Prediction, ax: Axes) -> None:
    """Draw what the textbook's model leaves of rate and angle, over the sensors' noise."""
    canvas.dress(ax, y="residual / noise")
    ax.axhspan(-2, 2, color="0.9", linewidth=0, label="two sigma of the noise")
    angle, rate = (motion.measured(view.record, i) - np.degrees((view.angle, view.rate)[i]) for i in (0, 1))
    ax.plot(view.record.time, rate / np.degrees(NOISE.rate), color=canvas.SECOND, linewidth=1.4, label="rate")
    ax.plot(view.record.time, angle / np.degrees(NOISE.angle), color=canvas.WARM, linewidth=1.4, label="angle")
    canvas.legend_above(ax, 80)


def noise_in_words() -> str:
    """Return the sensors' noise that residuals are shown over."""
    return f"{np.degrees(NOISE.angle):.1f} deg and {np.degrees(NOISE.rate):.1f} deg/s"
