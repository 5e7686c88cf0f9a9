"""A wrapped heading that was interpolated comes back; an honest one is left alone."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from fieldsid.logs import load_run
from fieldsid.logs.convert.clock import Track
from fieldsid.logs.convert.heading_unwrap import unwrapped_over

TURN = 2 * math.pi
DEG = math.pi / 180
RATES_HZ = st.sampled_from([10.0, 20.0, 50.0])
LOWEST = st.sampled_from([-math.pi, 0.0, -math.pi / 2])


def wrap(heading, lowest=-math.pi):
    return lowest + np.mod(heading - lowest, TURN)


def turning(time, fast, slow, start):
    """A heading whose rate swings up to fast + slow rad/s, and that rate."""
    heading = start + slow * time + fast * (1 - np.cos(0.7 * time)) / 0.7
    return heading, slow + fast * np.sin(0.7 * time)


def recovered(time, values, rate=None):
    track, notes = unwrapped_over(Track(time, values), None if rate is None else Track(time, rate))
    assert track.time is time
    return track.values, notes


def off(found, truth):
    """What a heading is off by, whole turns of most of it left out."""
    difference = found - truth
    return difference - TURN * np.round(np.nanmedian(difference) / TURN)


@settings(max_examples=100)
@given(
    log_hz=RATES_HZ,
    source_hz=st.floats(4.0, 60.0),
    shift=st.floats(0.0, 1.0),
    fast=st.floats(-0.5, 0.5),
    slow=st.floats(-0.5, 0.5),
    start=st.floats(-7.0, 7.0),
    noise=st.sampled_from([0.0, 0.1 * DEG, 0.5 * DEG]),
    lowest=LOWEST,
    measured=st.booleans(),
    seed=st.integers(0, 2**31),
)
def test_a_heading_interpolated_across_its_wrap_comes_back(
    log_hz, source_hz, shift, fast, slow, start, noise, lowest, measured, seed
):
    rng = np.random.default_rng(seed)
    source = np.arange(-1.0, 41.0, 1 / source_hz)
    heading = turning(source, fast, slow, start)[0] + noise * rng.normal(size=source.size)
    # Held at the seam within its own noise a heading goes round and back at every other sample: what is left tells no course.
    at_seam = np.abs(wrap(heading - lowest)) < 3.0 * noise
    assume(np.mean(at_seam) < 0.2)
    time = np.arange(shift / log_hz, 40.0, 1 / log_hz)
    _, rate = turning(time, fast, slow, start)
    found, _ = recovered(time, np.interp(time, source, wrap(heading, lowest)), rate if measured else None)
    error = off(found, np.interp(time, source, heading))
    # A line that the log begins or ends in, and a stretch at the seam there, has neighbours on one side only.
    away = source[~at_seam & (source >= time[0]) & (source <= time[-1])]
    seen = np.isfinite(error) & (time > away[0] + 1 / source_hz) & (time < away[-1] - 1 / source_hz)
    # A share of the way round that does not stand out of noise and motion stays.
    assert np.abs(error[seen]).max() < 0.05 + 20 * noise + 3.0 / log_hz
    assert np.percentile(np.abs(error[seen]), 98) < 0.03 + 10 * noise
    assert np.median(np.abs(error[seen])) < 1e-9


@given(
    log_hz=RATES_HZ,
    fast=st.floats(-0.5, 0.5),
    slow=st.floats(-0.5, 0.5),
    start=st.floats(-7.0, 7.0),
    noise=st.sampled_from([0.0, 0.3 * DEG, 0.5 * DEG]),
    lowest=LOWEST,
    holes=st.lists(st.tuples(st.floats(0, 40), st.floats(0, 1.5)), max_size=3),
    measured=st.booleans(),
    seed=st.integers(0, 2**31),
)
def test_an_honest_heading_is_left_alone(log_hz, fast, slow, start, noise, lowest, holes, measured, seed):
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 40.0, 1 / log_hz)
    heading, rate = turning(time, fast, slow, start)
    heading = heading + noise * rng.normal(size=time.size)
    for at, length in holes:
        heading[(time >= at) & (time < at + length)] = np.nan
    found, notes = recovered(time, wrap(heading, lowest), rate if measured else None)
    assert notes == []
    np.testing.assert_allclose(off(found, heading), np.where(np.isfinite(heading), 0.0, np.nan), atol=1e-9)


@pytest.mark.parametrize("share", [1.0, 0.0])
@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("lowest", [-math.pi, 0.0])
def test_one_sample_between_both_ends_lies_between_its_neighbours(side, lowest, share):
    time = 0.05 * np.arange(200)
    heading = lowest + side * 0.5 * (time - 5.0)
    values = wrap(heading, lowest)
    values[100] = 0.5 * (values[99] + values[101])
    found, notes = recovered(time, values, np.full(200, side * 0.5 * share))
    np.testing.assert_allclose(off(found, heading), 0.0, atol=1e-9)
    assert [n.code for n in notes] == ["wrap_interpolated"]
    assert notes[0].data["times_s"] == pytest.approx([5.0])
    assert notes[0].data["value"] == 1
    assert "1 sample was" in notes[0].message
    assert "at 5.00 s (now between their neighbours)" in notes[0].message


def test_many_samples_between_both_ends_are_missing_and_the_heading_goes_on():
    time, source = 0.05 * np.arange(600), 1.0 * np.arange(31) + 0.02
    found, notes = recovered(time, np.interp(time, source, wrap(0.3 * source + 1.0)))
    lost = np.isnan(found)
    assert lost.sum() == notes[0].data["missing"] == pytest.approx(40, abs=4)
    assert "of them missing" not in notes[0].message
    assert "now missing" in notes[0].message
    np.testing.assert_allclose(off(found, 0.3 * np.maximum(time, 0.02) + 1.0)[~lost], 0.0, atol=0.06)


def test_a_heading_held_at_the_wrap_comes_back():
    rng = np.random.default_rng(4)
    source = 0.1 * np.arange(400)
    heading = math.pi + 1.5 * np.sin(0.2 * source) ** 5 + 0.3 * DEG * rng.normal(size=400)
    time = source[:-1] + 0.04
    values = np.interp(time, source, wrap(heading))
    assert (np.abs(values) < 2.5).sum() > 50
    found, notes = recovered(time, values)
    error = off(found, np.interp(time, source, heading))
    assert np.nanmax(np.abs(error)) < 0.1
    assert notes[0].data["value"] > 50
    assert "..." in notes[0].message


@pytest.mark.parametrize("k", [0, 1, -1, -2])
def test_a_line_that_begins_or_ends_the_log_turns_nothing_round(k):
    values = np.concatenate([np.full(50, 3.1), np.full(50, -3.1)])
    values[k] = 0.0
    found, _ = recovered(0.05 * np.arange(100), values)
    assert found[60] - found[40] == pytest.approx(TURN - 6.2)


@pytest.mark.parametrize("step", [0.5, -1.0, 3.0, 5.0, TURN - 0.7])
def test_a_heading_that_is_set_off_stays_so(step):
    rng = np.random.default_rng(1)
    time = 0.05 * np.arange(400)
    heading = 0.3 * np.sin(0.5 * time) + 0.3 * DEG * rng.normal(size=400)
    heading[200:] += step
    found, notes = recovered(time, wrap(heading))
    assert notes == []
    np.testing.assert_allclose(wrap(found - heading), 0.0, atol=1e-9)


def test_a_flip_by_half_a_turn_away_from_the_wrap_is_no_line_across_it():
    time = 0.05 * np.arange(400)
    heading = 0.3 * np.sin(0.5 * time)
    heading[200:203] += 2.5
    found, notes = recovered(time, wrap(heading))
    assert notes == []
    np.testing.assert_allclose(found, heading)


def test_a_spin_that_the_rate_confirms_is_kept():
    time = 0.1 * np.arange(300)
    rate = np.where((time > 10) & (time < 12), math.pi, 0.0) + 0.1 * np.sin(time)
    heading = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * 0.1)])
    found, notes = recovered(time, heading, rate)
    assert notes == []
    np.testing.assert_array_equal(found, heading)


@pytest.mark.parametrize("wrong", [-1.0, 180 / math.pi, 0.0])
def test_a_rate_that_does_not_agree_is_not_believed(wrong):
    time = 0.05 * np.arange(400)
    heading, rate = turning(time, 0.4, 0.3, 0.0)
    values = wrap(heading)
    at = np.flatnonzero(np.abs(np.diff(values)) > 6)
    values[at] = 0.1
    found, notes = recovered(time, values, wrong * rate)
    assert notes[0].data["value"] == at.size > 0
    np.testing.assert_allclose(off(found, heading), 0.0, atol=0.01)


@given(
    st.lists(st.one_of(st.floats(-1e3, 1e3), st.floats(), st.just(math.nan), st.sampled_from([3.14, 0.0, -3.14])), max_size=40),
    st.booleans(),
)
def test_anything_is_taken_without_a_crash(values, measured):
    heading = np.array([v if abs(v) < 1e150 or math.isnan(v) else math.nan for v in values], dtype=float)
    time = 0.1 * np.arange(heading.size)
    found, _ = recovered(time, heading, heading[::-1].copy() if measured else None)
    assert found.shape == heading.shape
    assert not np.isfinite(found[~np.isfinite(heading)]).any()


def test_a_constant_heading_and_one_without_samples_stay():
    time = 0.1 * np.arange(50)
    for values in (np.full(50, 3.1), np.full(50, np.nan), np.zeros(50)):
        found, notes = recovered(time, values, np.zeros(50))
        np.testing.assert_array_equal(found, values)
        assert notes == []


def test_a_log_in_degrees_says_what_was_mended(tmp_path):
    time = 0.1 * np.arange(300)
    heading = 300.0 + 20.0 * time
    values = np.mod(heading, 360.0)
    values[30] = 180.0
    rows = "\n".join(f"{t:.1f},{h:.3f},{0.1 * (t > 3)}" for t, h in zip(time, values, strict=True))
    log = tmp_path / "turn.csv"
    log.write_text("time_s,yaw_deg,rudder_rad\n" + rows + "\n")
    run = load_run(log)
    np.testing.assert_allclose(run["yaw_rad"], np.radians(heading), atol=1e-6)
    note = next(n for n in run.notes if n.code == "wrap_interpolated")
    assert note.data["times_s"] == pytest.approx([3.0])
