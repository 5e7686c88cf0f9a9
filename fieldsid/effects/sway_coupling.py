"""Sway takes part in yaw through the Munk moment: an extra state x, the yaw moment of the sway speed (rad/s^2).

    r' += x,   x' = -cross_damping f x - cross_rate f^2 r,   f = (speed / reference speed)^p
It follows from v' = -a11 v - a12 r + b1 delta and r' = -a21 v - a22 r + b2 delta, where all terms are lift, so that
a11, a12, a21 ~ u and b1 ~ u^2. The side force b1 of the fin is not identifiable from yaw: in terms of
x = -a21 v + (a21 b1 / b2) r it drops out, and the transfer function keeps its form, a zero at -cross_damping and two poles.
No sway sensor is needed.
Source: Fossen 2011, section 7.2 (second-order Nomoto: K, T1, T2, T3 are the same four numbers); the paper's full form.
"""

from __future__ import annotations

from fieldsid.effects._cross_state import FORMS, coefficients, core, measured_starts
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Effect, Stage

EFFECT = Effect(
    name="sway_coupling",
    says="the vehicle drifts sideways in a turn, and the drift has a moment that turns it on or back",
    stage=Stage.HYDRODYNAMICS,
    axes=(Axis.YAW,),
    equation="r' += x; x' = -cross_damping f x - cross_rate f^2 r, f = (speed/reference)^p, p the damping's exponent",
    coefficients=coefficients("sway", "the turn rate builds up; minus turns on"),
    telltale="the rate overshoots or creeps on after a command where a first-order yaw would have settled",
    excited_by=("multisine", "zigzag", "three_two_one_one", "turning_circle", "square_pulses"),
    mistaken_for=("servo_lag", "delay", "quadratic_damping", "crossflow_drag", "roll_coupling"),
    source="Fossen 2011, section 7.2: the yaw model before sway is dropped",
    extra_states=("sway",),
    core=core,
    initial_guesses=measured_starts,
    variants=FORMS,
)
