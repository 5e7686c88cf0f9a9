"""The doctor finds each fault that is put into a healthy log, and nothing in the healthy one."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldsid.errors import DataError
from fieldsid.logs import load_run, save_run
from fieldsid.logs.doctor.examine import examine
from fieldsid.logs.doctor.stated import Stated
from fieldsid.logs.mapping.mapping_file import mapping_of
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.record import record_of
from fieldsid.numerics.trapezoid import trapezoid_integral
from fieldsid.online.samples import samples_of


def healthy(seed=1, n=1200):
    """Slow turns with noise, all signals agreeing with each other."""
    rng = np.random.default_rng(seed)
    time = 0.05 * np.arange(n)
    yaw, pitch = 0.6 * np.sin(0.5 * time), 0.2 * np.sin(0.7 * time + 1)
    surge = 1.5 + 0.05 * np.sin(0.3 * time)
    signals = {
        "yaw_rad": yaw + 0.002 * rng.normal(size=n),
        "yaw_rate_rad_s": 0.3 * np.cos(0.5 * time) + 0.003 * rng.normal(size=n),
        "pitch_rad": pitch + 0.002 * rng.normal(size=n),
        "pitch_rate_rad_s": 0.14 * np.cos(0.7 * time + 1) + 0.003 * rng.normal(size=n),
        "surge_m_s": surge + 0.01 * rng.normal(size=n),
        "x_m": np.cumsum(surge * np.cos(yaw)) * 0.05,
        "y_m": np.cumsum(surge * np.sin(yaw)) * 0.05,
        "rudder_rad": 0.25 * np.sign(np.sin(0.5 * time)),
    }
    return Run("healthy", time, signals)


def changed(run, **signals):
    return Run(run.name, run.time, {**run.signals, **signals})


def codes(run, **more):
    return {(n.code, n.data.get("signal")) for n in examine(run, **more)}


@pytest.mark.parametrize("seed", range(5))
def test_a_healthy_log_has_no_findings(seed):
    assert codes(healthy(seed)) == set()


def with_value(values, where, value):
    values = values.copy()
    values[where] = value
    return values


FAULTS = {
    "rate_sign": lambda r: (("rate_sign", "yaw_rate_rad_s"), {"yaw_rate_rad_s": -r["yaw_rate_rad_s"]}),
    "angle in degrees": lambda r: (("unit", "yaw_rad"), {"yaw_rad": np.degrees(r["yaw_rad"])}),
    "rate in degrees": lambda r: (("unit", "pitch_rate_rad_s"), {"pitch_rate_rad_s": np.degrees(r["pitch_rate_rad_s"])}),
    "rate in degrees a minute": lambda r: (
        ("unit", "yaw_rate_rad_s"),
        {"yaw_rate_rad_s": 60.0 * np.degrees(r["yaw_rate_rad_s"])},
    ),
    "rate scale": lambda r: (("rate_scale", "yaw_rate_rad_s"), {"yaw_rate_rad_s": 0.5 * r["yaw_rate_rad_s"]}),
    "late angle": lambda r: (("clock_offset", "yaw_rad"), {"yaw_rad": np.interp(r.time - 0.3, r.time, r["yaw_rad"])}),
    "knots": lambda r: (("speed_unit", "surge_m_s"), {"surge_m_s": r["surge_m_s"] / 0.5144}),
    "astern": lambda r: (("speed_sign", "surge_m_s"), {"surge_m_s": -r["surge_m_s"]}),
    "frozen": lambda r: (
        ("frozen", "yaw_rate_rad_s"),
        {"yaw_rate_rad_s": with_value(r["yaw_rate_rad_s"], slice(300, 360), 0.01)},
    ),
    "constant": lambda r: (("constant", "pitch_rad"), {"pitch_rad": np.full(len(r), 0.1)}),
    "empty": lambda r: (("empty", "pitch_rad"), {"pitch_rad": np.full(len(r), np.nan)}),
    "missing": lambda r: (("missing", "yaw_rad"), {"yaw_rad": with_value(r["yaw_rad"], slice(None, None, 3), np.nan)}),
    "coarse": lambda r: (("coarse", "yaw_rad"), {"yaw_rad": np.round(r["yaw_rad"] / 0.05) * 0.05}),
    "spikes": lambda r: (("spikes", "yaw_rate_rad_s"), {"yaw_rate_rad_s": with_value(r["yaw_rate_rad_s"], [400, 700], 3.0)}),
    "fin in degrees": lambda r: (("unit", "rudder_rad"), {"rudder_rad": np.degrees(r["rudder_rad"])}),
    "swapped": lambda r: (("swapped", "pitch_rad"), {"pitch_rad": r["yaw_rad"], "yaw_rad": r["pitch_rad"]}),
    "fin sign": lambda r: (
        ("fin_sign", "rudder_measured_rad"),
        {"rudder_measured_rad": -np.interp(r.time - 0.1, r.time, r["rudder_rad"])},
    ),
    "fin before command": lambda r: (
        ("clock_offset", "rudder_measured_rad"),
        {"rudder_measured_rad": np.interp(r.time + 0.4, r.time, r["rudder_rad"])},
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_found_and_named(fault):
    run = healthy()
    expected, signals = FAULTS[fault](run)
    assert expected in codes(changed(run, **signals))


SWAPS = {
    "angle and fin": ("yaw_rad", "rudder_rad", "rudder_rad changes as yaw_rate_rad_s says, and yaw_rad does not"),
    "rate and fin": ("yaw_rate_rad_s", "rudder_rad", "yaw_rad changes as rudder_rad says, and not as yaw_rate_rad_s"),
    "angle and rate": ("yaw_rad", "yaw_rate_rad_s", "yaw_rate_rad_s changes as yaw_rad says, in place of the other way round"),
    "two angles": ("yaw_rad", "pitch_rad", "yaw_rad changes as pitch_rate_rad_s says, and not as yaw_rate_rad_s"),
    "two rates": ("yaw_rate_rad_s", "pitch_rate_rad_s", "yaw_rad changes as pitch_rate_rad_s says, and not as yaw_rate_rad_s"),
}


def swapped(run, one, other):
    return changed(run, **{one: run[other], other: run[one]})


@pytest.mark.parametrize("swap", SWAPS)
def test_two_columns_that_are_swapped_are_named(swap):
    one, other, said = SWAPS[swap]
    note = next(n for n in examine(swapped(healthy(), one, other)) if n.code == "swapped")
    assert note.message.startswith(said)
    assert {one, other} & set(note.data["signals"])


@pytest.mark.parametrize("signal", ["yaw_rad", "yaw_rate_rad_s"])
def test_an_angle_and_a_rate_of_two_motions_are_told(signal):
    run, rng = healthy(), np.random.default_rng(3)
    wander = np.cumsum(np.convolve(rng.normal(size=len(run) + 39), np.full(40, 0.025), "valid")) * 0.05
    codes_of = codes(changed(run, **{signal: wander}))
    assert ("unrelated", "yaw_rad") in codes_of
    assert not {code for code, _ in codes_of} & {"swapped", "rate_sign", "unit"}


def test_a_rate_of_the_wrong_sign_jumps_nowhere():
    run, rng = healthy(), np.random.default_rng(5)
    pulses = np.interp(run.time % 20.0, [0.0, 10.0, 10.1, 12.0, 12.1, 20.0], [0.0, 0.0, 0.8, 0.8, 0.0, 0.0])
    noise = 0.003 * rng.normal(size=(2, len(run)))
    against = changed(run, yaw_rate_rad_s=noise[0] - pulses, yaw_rad=np.cumsum(pulses) * 0.05 + noise[1])
    assert codes(against) == {("rate_sign", "yaw_rate_rad_s")}


def test_a_heading_that_stands_still_in_its_last_digit_is_of_no_other_motion():
    run, rng = healthy(), np.random.default_rng(4)
    still = np.round(0.001 * np.cumsum(rng.normal(size=len(run))) / 0.0175) * 0.0175
    assert "unrelated" not in {c for c, _ in codes(changed(run, yaw_rad=still, yaw_rate_rad_s=0.003 * rng.normal(size=len(run))))}


@pytest.mark.parametrize("damage", [*SWAPS, "rate's sign", "rate in degrees", "angle in degrees"])
def test_a_run_whose_angle_contradicts_its_rate_is_refused(damage):
    run = healthy()
    if damage in SWAPS:
        run = swapped(run, *SWAPS[damage][:2])
    elif damage == "rate's sign":
        run = changed(run, yaw_rate_rad_s=-run["yaw_rate_rad_s"])
    else:
        wrong = "yaw_rate_rad_s" if damage.startswith("rate") else "yaw_rad"
        run = changed(run, **{wrong: np.degrees(run[wrong])})
    notes = examine(run)
    with pytest.raises(DataError, match="no model follows `yaw_rad` and `yaw_rate_rad_s`") as caught:
        record_of(Run(run.name, run.time, run.signals, notes=notes), Axis.YAW)
    assert caught.value.found in {n.message for n in notes}
    with pytest.raises(DataError, match="no model follows"):
        list(samples_of(Run(run.name, run.time, run.signals, notes=notes), Axis.YAW))
    alone = {k: v for k, v in run.signals.items() if k != "yaw_rate_rad_s"}
    assert record_of(Run(run.name, run.time, alone, notes=notes), Axis.YAW).angle_ok.all()


def test_a_finding_carries_its_number_its_limit_and_what_to_change():
    run = healthy()
    note = next(n for n in examine(changed(run, yaw_rate_rad_s=-run["yaw_rate_rad_s"])) if n.code == "rate_sign")
    assert note.data["value"] == pytest.approx(-1.0, abs=0.05)
    assert "sign: -1" in note.message


def test_the_lag_between_two_clocks_is_measured():
    run = healthy()
    late = changed(run, yaw_rad=np.interp(run.time - 0.3, run.time, run["yaw_rad"]))
    note = next(n for n in examine(late) if n.code == "clock_offset")
    assert note.data["value"] == pytest.approx(0.3, abs=0.03)


def test_gaps_and_jitter_of_the_clock_are_found():
    run = healthy()
    rng = np.random.default_rng(0)
    shaky = Run("shaky", run.time + rng.uniform(-0.02, 0.02, len(run)), run.signals)
    assert ("jitter", None) in codes(shaky)
    holed = np.delete(np.arange(len(run)), slice(500, 540))
    gap = Run("gap", run.time[holed], {k: v[holed] for k, v in run.signals.items()})
    found = {n.code: n for n in examine(gap)}
    assert found["time_gap"].data["value"] == pytest.approx(41 * 0.05)


def test_saturation_is_judged_by_the_limit_that_is_given():
    assert ("saturated", "rudder_rad") in codes(healthy(), fin_max_rad={"rudder_rad": 0.2})
    assert ("saturated", "rudder_rad") not in codes(healthy(), fin_max_rad={"rudder_rad": 0.25})  # there, and not beyond
    seen = changed(healthy(), rudder_measured_rad=np.clip(healthy()["rudder_rad"], -0.2, 0.2))
    assert ("saturated", "rudder_rad") not in codes(seen, fin_max_rad={"rudder_rad": 0.2})


def test_a_fin_beyond_its_limit_says_how_far_it_went_and_which_line_is_wrong_then():
    (told,) = (n for n in examine(healthy(), {"rudder_rad": 0.2}) if n.code == "saturated")
    reach = float(np.max(np.abs(healthy()["rudder_rad"])))
    assert told.message.startswith(f"rudder_rad goes to {reach:.3g} rad, beyond the fin's limit of 0.2 rad")
    assert "`rudder_max_rad` of vehicle.yaml" in told.message
    seen = changed(healthy(), rudder_measured_rad=healthy()["rudder_rad"])
    (told,) = (n for n in examine(seen, {"rudder_rad": 0.2}) if n.code == "fin_limit")
    assert (told.data["signal"], told.data["reach_rad"]) == ("rudder_measured_rad", reach)
    assert "fin_limit" not in {n.code for n in examine(seen, {"rudder_rad": reach})}


def test_a_log_without_fin_or_motion_is_said_to_be_of_no_use():
    time = np.arange(100.0)
    assert ("no_fin", None) in codes(Run("a", time, {"yaw_rad": np.sin(time)}))
    assert ("no_motion", None) in codes(Run("a", time, {"rudder_rad": np.sin(time)}))


def test_a_constant_propeller_is_no_finding():
    run = healthy()
    assert codes(changed(run, thrust=np.full(len(run), 9.0))) == set()


@given(st.integers(0, 40), st.integers(0, 2**31), st.floats(0.0, 1.0))
def test_any_run_is_examined_without_a_crash(n, seed, share):
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.uniform(1e-3, 1.0, n))
    names = (
        "yaw_rad",
        "yaw_rate_rad_s",
        "pitch_rad",
        "pitch_rate_rad_s",
        "surge_m_s",
        "x_m",
        "y_m",
        "rudder_rad",
        "rudder_measured_rad",
    )
    signals = {s: np.where(rng.random(n) < share, np.nan, rng.normal(size=n)) for s in names}
    for note in examine(Run("any", time, signals), {"rudder_rad": 0.3}):
        assert note.code
        assert note.message


def message(run, code, **stated):
    *_, note = (n for n in examine(run, stated=Stated(**stated)) if n.code == code)
    return note


@pytest.mark.parametrize(
    ("reach", "units", "advice", "unit"),
    [
        (15.0, {}, "set its unit, probably `unit: deg`", "deg"),
        (15.0, {"rudder_rad": "rad"}, "set its unit, probably `unit: deg`", "deg"),
        (2.147, {"rudder_rad": "deg"}, "taken as `deg` already: check which one it is", None),
        (1500.0, {}, "check its unit, and which one it is", None),
    ],
)
def test_a_unit_is_advised_only_where_it_is_not_set_and_makes_the_signal_possible(reach, units, advice, unit):
    run = healthy()
    note = message(changed(run, rudder_rad=reach * np.sign(run["rudder_rad"])), "unit", units=units)
    assert note.message == f"rudder_rad reaches {reach:.4g} rad (limit 1.6): {advice}"
    assert note.data.get("unit") == unit


@pytest.mark.parametrize(
    ("signal", "units", "advice"),
    [
        ("yaw_rad", {}, "yaw_rad is probably in deg: set `unit: deg`"),
        ("yaw_rad", {"yaw_rad": "deg"}, "taken as `deg` already: check which ones they are"),
        ("yaw_rad", {"yaw_rate_rad_s": "deg/s"}, "set `unit: deg` or yaw_rate_rad_s is not in `deg/s`"),
        ("yaw_rad", {"yaw_rad": "deg", "yaw_rate_rad_s": "deg/s"}, "yaw_rate_rad_s is not in `deg/s`"),
        ("yaw_rate_rad_s", {"yaw_rad": "deg", "yaw_rate_rad_s": "deg/s"}, "yaw_rad is not in `deg`"),
    ],
)
def test_degrees_of_one_of_a_pair_are_told_by_what_is_set(signal, units, advice):
    run = healthy()
    assert message(changed(run, **{signal: np.degrees(run[signal])}), "unit", units=units).message.endswith(advice)


@pytest.mark.parametrize(
    ("where", "ways"), [(slice(0, 60), ["--from"]), (slice(300, 360), ["--to", "--from"]), (slice(-60, None), ["--to"])]
)
def test_a_frozen_stretch_at_an_end_is_left_out_at_that_end(where, ways):
    run = healthy()
    said = message(changed(run, yaw_rate_rad_s=with_value(run["yaw_rate_rad_s"], where, 0.01)), "frozen").message
    assert [w for w in ("--to", "--from") if w in said] == ways


def flown(digits, *, rest=4.0):
    """A yaw model at rest, in pulses, and in a settled turn, without noise."""
    time = 0.05 * np.arange(1200)
    fin = np.where(time < rest, 0.0, np.where(time < 50.0, 0.2 * np.sign(np.sin(time)), 0.2))
    yaw, rate = np.full(1200, 0.3), np.zeros(1200)
    for k in range(1199):
        yaw[k + 1], rate[k + 1] = yaw[k] + 0.05 * rate[k], rate[k] + 0.05 * (0.7 * fin[k] - 2.0 * rate[k])
    signals = {"yaw_rad": yaw, "yaw_rate_rad_s": rate, "surge_m_s": np.full(1200, 1.4), "rudder_rad": fin}
    return Run("sim", time, {s: np.round(v, digits) for s, v in signals.items()})


@pytest.mark.parametrize("digits", [4, 6, 16])
def test_a_simulator_at_rest_or_in_a_settled_turn_has_no_frozen_sensor(digits):
    assert not {c for c in codes(flown(digits)) if c[0] == "frozen"}


def test_what_a_simulation_leaves_by_rounding_is_constant():
    run = healthy()
    dust = 1e-18 * np.round(np.sin(0.1 * run.time), 1)
    assert {c for c in codes(changed(run, pitch_rate_rad_s=dust)) if c[1] == "pitch_rate_rad_s"} == {
        ("constant", "pitch_rate_rad_s")
    }


def test_a_speed_that_was_steady_and_goes_on_by_its_last_digit_is_not_frozen():
    run = healthy()
    slow = np.round(1.4 - 1e-3 * np.maximum(run.time - 5.0, 0.0), 5)
    assert ("frozen", "surge_m_s") not in codes(changed(run, surge_m_s=slow))
    stopped = np.where((run.time > 10.0) & (run.time < 13.0), slow[200], slow)
    assert ("frozen", "surge_m_s") in codes(changed(run, surge_m_s=stopped))


@pytest.mark.parametrize("part", [slice(160, 220), slice(800, 1000)])
def test_a_sensor_that_freezes_without_noise_is_found(part):
    run = flown(16)
    for name in ("yaw_rad", "yaw_rate_rad_s"):
        stopped = changed(run, **{name: with_value(run[name], part, run[name][170])})
        assert ("frozen", name) in codes(stopped)


@pytest.mark.parametrize("digits", [5, 16])
@pytest.mark.parametrize("late", [True, False])
def test_a_log_that_euler_steps_made_says_what_they_do_to_a_time_constant(late, digits):
    run = flown(digits)
    summed = run if late else changed(run, yaw_rad=np.round(0.3 + 0.05 * np.cumsum(run["yaw_rate_rad_s"]), digits))
    assert "a time constant of 1 s in its equations shows as 0.9748 s" in message(summed, "euler").message


def test_a_log_that_was_measured_or_integrated_well_is_not_said_to_be_of_euler_steps():
    run = flown(16)
    exact = 0.3 + trapezoid_integral(run.time, run["yaw_rate_rad_s"])
    noise = 1e-3 * np.random.default_rng(3).standard_normal((2, len(run)))
    for signals in (
        {"yaw_rad": exact},
        {"yaw_rad": run["yaw_rad"] + noise[0], "yaw_rate_rad_s": run["yaw_rate_rad_s"] + noise[1]},
    ):
        assert "euler" not in {c for c, _ in codes(changed(run, **signals))}


def test_a_place_is_frozen_where_both_of_its_coordinates_are():
    run = healthy()
    east = changed(run, x_m=with_value(run["x_m"], slice(300, 360), run["x_m"][300]))
    assert not {c for c in codes(east) if c[0] == "frozen"}
    stopped = changed(east, y_m=with_value(run["y_m"], slice(300, 360), run["y_m"][300]))
    assert {("frozen", "x_m"), ("frozen", "y_m")} <= codes(stopped)


def test_a_slow_sensor_brought_to_a_fast_clock_has_no_faults_of_the_lines_between_its_measurements():
    rng, run = np.random.default_rng(8), healthy()
    slow = np.arange(0.03, run.time[-1] + 1.0, 1.0)
    depth = np.interp(run.time, slow, np.round(3.0 + rng.normal(0.0, 0.01, slow.size), 2))
    surge = np.interp(run.time, slow, 1.2 + rng.normal(0.0, 0.01, slow.size))
    assert not {c for c in codes(changed(run, depth_m=depth, surge_m_s=surge)) if c[0] in ("frozen", "spikes", "coarse")}
    stopped = np.interp(run.time, slow, with_value(np.interp(slow, run.time, surge), slice(10, 20), 1.2))
    assert ("frozen", "surge_m_s") in codes(changed(run, surge_m_s=stopped))


def test_a_sign_that_is_set_is_taken_back_and_stamps_are_named_where_they_were_chosen():
    run = healthy()
    against, astern = changed(run, yaw_rate_rad_s=-run["yaw_rate_rad_s"]), changed(run, surge_m_s=-run["surge_m_s"])
    assert "set `sign: -1` at yaw_rad or yaw_rate_rad_s" in message(against, "rate_sign").message
    turned = frozenset({"yaw_rate_rad_s", "surge_m_s"})
    assert "take `sign: -1` away from yaw_rate_rad_s" in message(against, "rate_sign", turned=turned).message
    assert "take `sign: -1` away from surge_m_s" in message(astern, "speed_sign", turned=turned).message
    late = changed(run, yaw_rad=np.interp(run.time - 0.3, run.time, run["yaw_rad"]))
    assert "stamp" not in message(late, "clock_offset").message
    assert "use `stamp: header`" in message(late, "clock_offset", received=frozenset({"yaw_rad"})).message


def test_what_a_mapping_states_reaches_the_doctor(tmp_path):
    run = healthy()
    log = save_run(changed(run, rudder_rad=123.0 * np.sign(run["rudder_rad"])), tmp_path / "a.csv")
    mapping = mapping_of(
        {"time": {"column": "time_s"}, "signals": {"yaw_rad": "yaw_rad", "rudder_rad": {"column": "rudder_rad", "unit": "deg"}}}
    )
    notes = {n.code: n.message for n in load_run(log, mapping).notes}
    assert notes["unit"] == "rudder_rad reaches 2.147 rad (limit 1.6): taken as `deg` already: check which one it is"


def turning(rate_hz=5.0, size=0.6):
    """A heading that turns by more than 180 a step where its degrees are taken for rad, and its rate, both with noise."""
    random = np.random.default_rng(4)
    time = np.arange(600) / rate_hz
    yaw, rate = size * 2.0 * np.sin(0.5 * time), size * np.cos(0.5 * time)
    return time, yaw + 0.005 * random.standard_normal(600), rate + 0.004 * random.standard_normal(600)


def test_a_heading_in_degrees_is_known_where_unwrapping_it_as_rad_lost_whole_turns():
    time, yaw, rate = turning()
    lost = np.unwrap(np.degrees(yaw))
    assert np.abs(lost - np.degrees(yaw)).max() > 6.0
    found = {n.data.get("unit") for n in examine(Run("r", time, {"yaw_rad": lost, "yaw_rate_rad_s": rate})) if n.code == "unit"}
    assert found == {"deg"}
    assert not [n for n in examine(Run("r", time, {"yaw_rad": yaw, "yaw_rate_rad_s": rate})) if n.code == "unit"]


def test_a_rate_that_is_off_for_three_samples_shows_in_no_step_and_over_a_few():
    time, yaw, rate = turning(20.0)
    assert not [n for n in examine(Run("r", time, {"yaw_rad": yaw, "yaw_rate_rad_s": rate})) if n.code == "disagree"]
    for start in (100, 300, 480):
        rate[start : start + 3] += 0.8
    (note,) = [n for n in examine(Run("r", time, {"yaw_rad": yaw, "yaw_rate_rad_s": rate})) if n.code == "disagree"]
    assert note.data["count"] == 3


def test_a_dive_of_centimetres_tells_the_sign_of_depth_where_pitch_explains_it():
    time = np.arange(0.0, 120.0, 0.1)
    pitch = 0.02 * np.sin(0.4 * time)
    depth = 5.0 + 0.01 * np.random.default_rng(1).standard_normal(time.size) - 0.02 / 0.4 * (1.0 - np.cos(0.4 * time))
    signals = {"pitch_rad": pitch, "surge_m_s": np.ones_like(time), "depth_m": depth}
    assert "dive_sign" not in {n.code for n in examine(Run("r", time, signals))}
    assert "dive_sign" in {n.code for n in examine(Run("r", time, {**signals, "depth_m": 10.0 - depth}))}


@pytest.mark.parametrize("is_enu", [True, False])
def test_a_vehicle_that_hovers_for_most_of_the_log_still_tells_the_frame_of_its_heading(is_enu):
    random, time = np.random.default_rng(4), 0.1 * np.arange(4000)
    speed = np.where((time // 40.0) % 3 == 0, 1.0, 0.05)
    yaw = np.cumsum(0.1 * 0.15 * np.sin(0.05 * time))
    x, y = (np.cumsum(0.1 * speed * f(yaw)) + 0.15 * random.standard_normal(time.size) for f in (np.cos, np.sin))
    run = Run("hover", time, {"yaw_rad": 0.5 * np.pi - yaw if is_enu else yaw, "x_m": x, "y_m": y})
    assert ("course_against" in {n.code for n in examine(run)}) == is_enu


@pytest.mark.parametrize("pause_s", [2.0, 1.7e9])
def test_angle_and_rate_are_not_compared_over_gaps_of_the_log(pause_s):
    """A clock that is set in the dive jumps by years: in that gap neither is known to change."""
    run = healthy()
    kept = (run.time % 15.0) < 13.0
    time = run.time[kept] + (pause_s - 2.0) * np.floor(run.time[kept] / 15.0)
    later = Run(run.name, time, {s: v[kept] for s, v in run.signals.items()})
    assert not {n.code for n in examine(later)} & {"unrelated", "disagree", "swapped", "rate_scale"}


def test_a_gyro_at_the_end_of_its_range_does_not_put_its_scale_in_doubt():
    run = healthy()
    clipped = changed(run, yaw_rate_rad_s=np.clip(run["yaw_rate_rad_s"], -0.2, 0.2))
    assert "rate_scale" not in {n.code for n in examine(clipped)}
