"""Heave takes part in pitch through the Munk moment: an extra state x, the pitch moment of the heave speed (rad/s^2).

    q' += x,   x' = -cross_damping f x - cross_rate f^2 q,   f = (speed / reference speed)^p
It follows from w' = -c11 w - c12 q + d1 delta and q' = -c21 w + ..., where all terms are lift, so that c11, c12, c21 ~ u and
d1 ~ u^2. The heave force d1 of the fin is not identifiable from pitch: the other coefficients absorb it
(effects/sway_coupling.py). No heave sensor is needed. Source: Prestero 2001, chapter 6 (vertical plane); the paper's full form.
"""

from __future__ import annotations

from fieldsid.effects._cross_state import FORMS, coefficients, core, measured_starts
from fieldsid.models.axis import Axis
from fieldsid.models.effect import Effect, Stage

EFFECT = Effect(
    name="heave_coupling",
    says="the vehicle heaves while it pitches, and the heave has a moment that pitches it on or back",
    stage=Stage.HYDRODYNAMICS,
    axes=(Axis.PITCH,),
    equation="q' += x; x' = -cross_damping f x - cross_rate f^2 q, f = (speed/reference)^p, p the damping's exponent",
    coefficients=coefficients("heave", "the pitch rate builds up; minus pitches on"),
    telltale="the pitch creeps on or overshoots after a command where a second-order pitch would have settled",
    excited_by=("multisine", "three_two_one_one", "square_pulses", "chirp"),
    mistaken_for=("servo_lag", "delay", "large_angle_righting", "depth_buoyancy", "quadratic_damping"),
    source="Prestero 2001, chapter 6: the pitch model before heave is dropped",
    extra_states=("heave",),
    core=core,
    initial_guesses=measured_starts,
    variants=FORMS,
)
