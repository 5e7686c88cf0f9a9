"""The shape of each excitation against what its literature says, worked by hand."""

from __future__ import annotations

import numpy as np
import pytest

from fieldsid.errors import UsageError
from fieldsid.maneuvers import Autopilot, Limits, Schedule, fly, parse_spec, pick_maneuver, steer
from fieldsid.maneuvers.multisine import harmonics
from fieldsid.maneuvers.prbs import TAPS, bits


def command(spec, time):
    maneuver, values = parse_spec(spec)
    return maneuver.command(values, np.asarray(time, dtype=float))


def test_square_pulses_are_the_papers():
    fins = command("square_pulses", [-0.1, 0.0, 1.99, 2.0, 3.99, 4.0, 16.9, 17.0, 19.0, 20.99, 21.0])
    np.testing.assert_allclose(fins, [0, 0.26, 0.26, -0.26, -0.26, np.nan, np.nan, 0.15, -0.15, -0.15, np.nan])


def test_a_doublet_goes_to_both_sides_and_pauses():
    fins = command("doublet:amplitude=0.1,width=1,pause=3,repeats=2", [0.5, 1.5, 2.5, 4.5, 5.5, 6.5, 7.5])
    np.testing.assert_allclose(fins, [0.1, -0.1, 0, 0, 0.1, -0.1, np.nan])


def test_three_two_one_one_holds_each_side_for_its_units_and_is_mirrored_the_second_time():
    fins = command("three_two_one_one:amplitude=0.2,unit=1,repeats=2", np.arange(15) + 0.5)
    first = [1, 1, 1, -1, -1, 1, -1]
    np.testing.assert_allclose(fins[:14], 0.2 * np.array(first + [-s for s in first]))
    assert np.isnan(fins[14])
    assert abs(np.nansum(fins)) < 1e-12


@pytest.mark.parametrize("order", TAPS)
def test_a_prbs_has_the_longest_period_and_nearly_no_mean(order):
    period = 2**order - 1
    sequence = bits(order, 2 * period, 3)
    np.testing.assert_array_equal(sequence[:period], sequence[period:])
    assert abs(sequence[:period].sum()) == 1
    product = [float(sequence[:period] @ np.roll(sequence[:period], k)) for k in range(1, period)]
    np.testing.assert_allclose(product, -1.0)  # the autocorrelation only a maximum-length sequence has


def test_a_chirps_frequency_grows_evenly_per_octave_to_its_high_end():
    time = np.arange(0, 30, 0.001)
    fins = command("chirp:low_hz=0.1,high_hz=1,duration=30", time)
    crossings = time[:-1][np.diff(np.signbit(fins))]
    halves, middles = np.diff(crossings), 0.5 * (crossings[1:] + crossings[:-1])
    np.testing.assert_allclose(0.5 / halves, 0.1 * 10 ** (middles / 30), rtol=0.02)
    assert 0.5 / halves[-1] == pytest.approx(1.0, rel=0.05)


def test_rudder_and_elevator_multisines_are_orthogonal_over_a_period():
    time = np.arange(400) * 0.05
    rudder, elevator = (command(f"multisine:channel={c}", time) for c in (0, 1))
    assert abs(rudder @ elevator) < 1e-9 * (rudder @ rudder)


@pytest.mark.parametrize("spec", ["multisine", "multisine:channel=1", "multisine:low_hz=0.05,high_hz=1.5,period=40"])
def test_a_multisine_has_a_low_crest_factor_and_reaches_its_amplitude(spec):
    maneuver, values = parse_spec(spec)
    one = maneuver.command(values, np.arange(4096) / 4096 * values["period"])
    crest = np.max(np.abs(one)) / np.sqrt(np.mean(one**2))
    assert crest < 1.66  # Schroeder's phases alone give about 1.7, equal phases 3 and more
    wave = maneuver.command(values, np.arange(0, values["period"], 0.01))
    assert np.max(np.abs(wave)) == pytest.approx(values["amplitude"], rel=0.02)


def test_a_multisine_holds_energy_at_its_own_harmonics_only():
    maneuver, values = parse_spec("multisine:period=20")
    wave = maneuver.command(values, np.arange(400) * 0.05)
    power = np.abs(np.fft.rfft(wave)) ** 2
    inside = list(harmonics(values))
    assert power[inside].sum() > 0.999 * power.sum()


def test_stairs_grow_from_pair_to_pair():
    fins = command("stairs:amplitude=0.4,lowest=0.1,steps=4,hold=1", np.arange(8) + 0.5)
    np.testing.assert_allclose(np.abs(fins), [0.1, 0.1, 0.2, 0.2, 0.3, 0.3, 0.4, 0.4])
    assert fins.sum() == pytest.approx(0.0)


def test_a_switched_signal_holds_each_side_for_its_own_time():
    fins = command("switched:amplitude=0.2,t1=1,t2=2,t3=0.5,t4=0,t5=0,t6=0", [0.5, 1.5, 2.5, 3.2, 3.6])
    np.testing.assert_allclose(fins, [0.2, -0.2, -0.2, 0.2, np.nan])


class Turner:
    """A vehicle whose heading turns at a rate in proportion to the fin, without lag."""

    size = 1

    def __init__(self, gain, trim=0.0):
        self.gain, self.angle, self.trim = gain, np.zeros(1), np.array([trim])

    def advance(self, fin, step):
        rate = self.gain * fin
        self.angle = self.angle + rate * step
        return self.angle.copy(), rate


@pytest.mark.parametrize(("trim", "low", "high"), [(0.1, -0.3, 0.2), (-0.1, -0.2, 0.3), (0.0, -0.3, 0.3)])
def test_a_fin_that_straight_flight_takes_is_part_of_its_limit(trim, low, high):
    """A fin of 0.3 rad at most that is held at 0.1 moves 0.2 further to that side."""
    maneuver, values = parse_spec("zigzag:amplitude=0.3,turn=0.3,reversals=3")
    flight = fly(maneuver, values, Turner(1.0, trim), limits=Limits(0.3), autopilot=Autopilot(1.0, 0.0))
    assert (flight.fin.min(), flight.fin.max()) == (pytest.approx(low), pytest.approx(high))


@pytest.mark.parametrize("gain", [1.0, -1.0])
def test_a_zigzag_puts_the_fin_over_each_time_the_heading_is_reached_whichever_way_the_fin_turns(gain):
    maneuver, values = parse_spec("zigzag:amplitude=0.2,turn=0.3,reversals=3")
    flight = fly(
        maneuver, values, Turner(gain), limits=Limits(0.3), autopilot=Autopilot(gain, 0.0), schedule=Schedule(run_up=1.0)
    )
    fin, angle = flight.fin[:, 0], flight.angle[:, 0]
    excited = ~flight.recovering[:, 0]
    turns = np.flatnonzero(np.diff(np.sign(fin[excited])))
    assert len(turns) == 3
    np.testing.assert_allclose(np.abs(angle[excited][turns + 1]), 0.3, atol=0.02)
    assert fin[excited][0] == 0.2
    assert abs(angle[-1]) < 0.01


def test_a_turning_circle_turns_as_far_as_asked_then_pulls_out():
    maneuver, values = parse_spec("turning_circle:amplitude=0.2,turn=7,pull_out=3,mirrored=1")
    flight = fly(maneuver, values, Turner(1.0), limits=Limits(0.3), autopilot=Autopilot(1.0, 0.0), schedule=Schedule(run_up=1.0))
    fin = flight.fin[~flight.recovering[:, 0], 0]
    assert fin[0] == -0.2
    assert fin[-1] == 0.0
    assert np.sum(fin == 0.0) == pytest.approx(3.0 * 20, abs=1)
    assert np.sum(fin != 0.0) * 0.2 / 20 == pytest.approx(7.0, abs=0.02)


def test_the_autopilot_comes_back_the_shorter_way_round():
    after_a_circle = 2 * np.pi + 0.1
    assert steer(np.nan, after_a_circle, 0.0, 0.0, Autopilot(1.0, 0.0).gains, np.inf, -0.3, 0.3) == pytest.approx(-0.1)


@pytest.mark.parametrize(
    ("spec", "says"),
    [
        ("zigzg", "did you mean `zigzag`"),
        ("zigzag:ampltude=0.1", "did you mean `amplitude`"),
        ("zigzag:amplitude", "amplitude=0.17"),
        ("zigzag:amplitude=big", "15deg"),
        ("zigzag:amplitude=3", "3deg"),
        ("prbs:order=4.5", "default"),
    ],
)
def test_a_wrong_text_form_is_answered_with_what_was_meant(spec, says):
    with pytest.raises(UsageError) as caught:
        parse_spec(spec)
    assert says in caught.value.hint


def test_degrees_are_read_as_such():
    assert parse_spec("zigzag:amplitude=20deg")[1]["amplitude"] == pytest.approx(np.radians(20))


@pytest.mark.parametrize(("fin", "rate"), [(0.0, 1.0), (-0.1, 1.0), (0.2, 0.0), (float("nan"), 1.0)])
def test_limits_of_nothing_are_refused(fin, rate):
    with pytest.raises(UsageError, match="above zero"):
        Limits(fin, rate)


def test_registered_names_can_be_picked():
    assert pick_maneuver("prbs").name == "prbs"
