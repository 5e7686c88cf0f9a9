"""A command that is given between two samples of the angle keeps its own times: what is put in comes back from every phase."""

from __future__ import annotations

from math import nan

import numpy as np
import pytest
from bags import EPOCH_NS, BagWriter, write_mcap
from binary_logs import write_alog, write_dataflash, write_lsf, write_ulog
from truth.commanded import Commanded, pulses

from fieldsid import diagnose
from fieldsid.fitting.fit import fit
from fieldsid.logs import load_run, save_run
from fieldsid.logs.channels import ChannelMap, Source
from fieldsid.logs.convert.assemble import assemble
from fieldsid.logs.mapping.mapping_file import mapping_of
from fieldsid.logs.reader import RawLog, Series
from fieldsid.models.axis import Axis
from fieldsid.models.record import record_of
from fieldsid.online.identifier import OnlineIdentifier
from fieldsid.online.samples import samples_of

DAMPING, AUTHORITY, TRIM = 1.0, 0.85, 0.01
WITHIN = 5e-3
"""Share of the truth within which a22 comes back."""
NOISE = 3e-4
PHASES = np.arange(0.05, 1.0, 0.1)
FEW = PHASES[::3]
SLOW = [pytest.param(rate, PHASES, marks=pytest.mark.slow) for rate in (5, 10, 20, 50)]
TOPICS = {"yaw_rad": "h", "yaw_rate_rad_s": "r", "rudder_rad": "c"}


def flown(rate, phase, *, noise=NOISE, every=0.8):
    """Commands (times, angles) given at a share of the step behind the samples, and the samples: time, angle and rate."""
    commands = pulses(phase / rate, every=every)
    time = np.arange(0.0, 82.0, 1.0 / rate)
    motion = Commanded(*commands, DAMPING, AUTHORITY, TRIM).motion(time)
    return commands, time, motion + np.random.default_rng(1).normal(0.0, noise, motion.shape)


def joined(commands, time, motion):
    """The run of three topics, each on a clock of its own."""
    tracks = ((time, motion[0]), (time, motion[1]), commands)
    series = {name: Series(t, v, TOPICS[name]) for name, (t, v) in zip(TOPICS, tracks, strict=True)}
    return assemble(RawLog("flown", series, one_clock=False), ChannelMap({n: Source(topic=t) for n, t in TOPICS.items()}), None)


def damping_of(run, method="output_error"):
    return fit([record_of(run, Axis.YAW)], Axis.YAW, method=method).model.values["a22"]


@pytest.fixture(scope="module")
def runs(rate, phases):
    return [joined(*flown(rate, phase)) for phase in phases]


AT_EACH_PHASE = pytest.mark.parametrize(("rate", "phases"), [(5, FEW), *SLOW], scope="module")


@AT_EACH_PHASE
@pytest.mark.parametrize("method", ["output_error", "pem", "svf_ls", "svf_rls", "srivc"])
def test_the_damping_does_not_depend_on_the_phase(runs, method):
    found = np.array([damping_of(run, method) for run in runs])
    np.testing.assert_allclose(found, DAMPING, rtol=WITHIN)


def online(samples):
    known = OnlineIdentifier("yaw")
    for time, fin, angle, rate, line in samples:
        known.update(time, fin, angle, rate, fin_line=line)
    return known.estimate()


@AT_EACH_PHASE
def test_the_damping_does_not_depend_on_the_phase_sample_by_sample(runs):
    found = [online((s.time, s.fin, s.angle, s.rate, s.fin_line) for s in samples_of(run, Axis.YAW)) for run in runs]
    np.testing.assert_allclose([e.values["a22"] for e in found], DAMPING, rtol=WITHIN)


@pytest.mark.parametrize(("rate", "phases"), [(5, FEW), (20, FEW[1:2]), *SLOW])
def test_nor_where_commands_and_measurements_come_as_messages_of_their_own(rate, phases):
    for phase in phases:
        commands, time, motion = flown(rate, phase)
        told = [(t, 0, fin, nan, nan) for t, fin in zip(*commands, strict=True)]
        seen = [(t, 1, nan, *values) for t, *values in zip(time, *motion, strict=True)]
        now = online((t, *rest, None) for t, _, *rest in sorted(told + seen))
        assert now.values["a22"] == pytest.approx(DAMPING, rel=WITHIN)
        assert now.counts["missing"] <= 1.1 * rate + 1  # before the second command


@pytest.mark.parametrize(
    ("rate", "phase"),
    [(5, 0.55), *(pytest.param(*of, marks=pytest.mark.slow) for of in ((5, 0.05), (10, 0.15), (20, 0.45), (50, 0.95)))],
)
def test_no_clock_is_off_and_nothing_is_delayed_where_nothing_is(rate, phase):
    found = diagnose([joined(*flown(rate, phase))], axis="yaw")
    assert (found.verdict, found.effects) == ("sufficient", ())


def test_a_command_faster_than_the_angle_counts_whole():
    run = joined(*flown(5, 0.3, every=0.07))
    assert damping_of(run) == pytest.approx(DAMPING, rel=2 * WITHIN)


def test_a_measured_fin_faster_than_the_angle_counts_whole():
    """The fin goes to each command at 0.4 rad/s: a finely stepped command, logged at 100 Hz."""
    (times, angles), time, _ = flown(5, 0.3)
    fine = np.arange(0.0, 82.0, 0.01)
    fin = np.zeros(fine.size)
    for k in range(1, fine.size):
        wanted = angles[np.searchsorted(times, fine[k], side="right") - 1]
        fin[k] = fin[k - 1] + np.clip(wanted - fin[k - 1], -0.004, 0.004)
    motion = Commanded(fine[:-1], 0.5 * (fin[1:] + fin[:-1]), DAMPING, AUTHORITY, TRIM).motion(time)
    tracks = {"yaw_rad": (time, motion[0]), "yaw_rate_rad_s": (time, motion[1]), "rudder_measured_rad": (fine, fin)}
    raw = RawLog("flown", {n: Series(t, v, n) for n, (t, v) in tracks.items()}, one_clock=False)
    run = assemble(raw, ChannelMap({n: Source(topic=n) for n in tracks}), None)
    assert damping_of(run) == pytest.approx(DAMPING, rel=WITHIN)


def lagged(times, angles, lag):
    """The fin behind a first-order lag of the commands: its mean over each hundredth of a second, as commands of their own."""
    fine = np.arange(0.0, 82.0, 0.01)
    told = angles[np.searchsorted(times, fine + 1e-9, side="right") - 1]
    fin, mean, kept = 0.0, np.empty(fine.size), np.exp(-0.01 / lag)
    for k, wanted in enumerate(told):
        mean[k] = wanted + (fin - wanted) * lag / 0.01 * (1.0 - kept)
        fin = wanted + (fin - wanted) * kept
    return fine, mean


@pytest.mark.parametrize("phase", [0.15, 0.55, 0.95])
@pytest.mark.parametrize("effect", ["delay", "servo_lag"])
def test_the_gear_behind_a_command_between_samples_comes_back(effect, phase):
    """At 5 Hz, commands on whole hundredths of a second: the gear sees the jump where it was made."""
    (times, angles), time, _ = flown(5, phase)
    times, late = np.round(times, 2), 0.3
    moved = (np.append(0.0, times[1:] + late), angles) if effect == "delay" else lagged(times, angles, late)
    motion = Commanded(*moved, DAMPING, AUTHORITY, TRIM).motion(time) + np.random.default_rng(2).normal(
        0.0, NOISE, (2, time.size)
    )
    run = joined((times, angles), time, motion)
    values = fit([record_of(run, Axis.YAW)], Axis.YAW, method="output_error", effects=(effect,)).model.values
    assert values["a22"] == pytest.approx(DAMPING, rel=WITHIN)
    assert values["delay" if effect == "delay" else "lag"] == pytest.approx(late, rel=0.02)


def as_alog(folder, commands, time, signals):
    return write_alog(folder / "log.alog", time, signals, commands), {n: (n, "data") for n in TOPICS}


def as_ulog(folder, commands, time, signals):
    topics = {"yaw_rad": "trial", "yaw_rate_rad_s": "trial", "rudder_rad": "command"}
    return write_ulog(folder / "log.ulg", time, signals, commands), {n: (t, n) for n, t in topics.items()}


def as_dataflash(folder, commands, time, signals):
    places = {"yaw_rad": ("TRI", "S0"), "yaw_rate_rad_s": ("TRI", "S1"), "rudder_rad": ("CMD", "Rud")}
    return write_dataflash(folder / "log.bin", time, signals, commands), places


def as_tlog(folder, commands, time, signals):
    """Packets of the protocol's second version, each behind its time in microseconds."""
    from pymavlink.dialects.v20 import common

    link = common.MAVLink(None, srcSystem=1, srcComponent=1)
    rows = [(t, common.MAVLink_named_value_float_message(0, b"rudder", v)) for t, v in zip(*commands, strict=True)]
    for t, yaw, rate in zip(time, *signals.values(), strict=True):
        rows.append((t, common.MAVLink_attitude_message(0, 0.0, 0.0, yaw, 0.0, 0.0, rate)))
    rows.sort(key=lambda row: row[0])
    path = folder / "log.tlog"
    path.write_bytes(b"".join(round(1e6 * (1.7e9 + t)).to_bytes(8, "big") + m.pack(link) for t, m in rows))
    places = {"yaw_rad": ("ATTITUDE", "yaw"), "yaw_rate_rad_s": ("ATTITUDE", "yawspeed")}
    return path, places | {"rudder_rad": ("NAMED_VALUE_FLOAT", "value")}


def as_lsf(folder, commands, time, signals):
    places = {n: ("EstimatedState", n) for n in signals} | {"rudder_rad": ("SetServomotorPosition", "value")}
    return write_lsf(folder / "Data.lsf", time, signals, commands), places


def rows_of(commands, time, signals):
    told = {"rudder_rad": commands} | {n: (time, v) for n, v in signals.items()}
    return sorted(
        (EPOCH_NS + round(t * 1e9), f"/{n}", float(v)) for n, (ts, vs) in told.items() for t, v in zip(ts, vs, strict=True)
    )


def as_mcap(folder, commands, time, signals):
    rows = [(name, stamp, b"\x00\x01\x00\x00" + np.float64(v).tobytes()) for stamp, name, v in rows_of(commands, time, signals)]
    return write_mcap(folder / "log.mcap", rows), {n: (f"/{n}", "data") for n in TOPICS}


def as_bag(kind):
    def made(folder, commands, time, signals):
        with BagWriter(folder / "log", kind) as bag:
            for stamp, name, v in rows_of(commands, time, signals):
                bag.write(name, "std_msgs/msg/Float64", bag.make("std_msgs/Float64", v), stamp)
        return bag.path, {n: (f"/{n}", "data") for n in TOPICS}

    return made


READ = {
    "alog": as_alog, "ulog": as_ulog, "dataflash": as_dataflash, "tlog": as_tlog, "lsf": as_lsf, "mcap": as_mcap,
    "ros1": as_bag("ros1"), "sqlite3": as_bag("sqlite3"),
}  # fmt: skip


@pytest.mark.parametrize("kind", READ)
def test_the_times_come_through_every_reader_and_through_the_saved_run(kind, tmp_path):
    commands, time, motion = flown(10, 0.35)
    signals = dict(zip(("yaw_rad", "yaw_rate_rad_s"), motion, strict=True))
    path, places = READ[kind](tmp_path, commands, time, signals)
    units = {"yaw_rad": "rad", "yaw_rate_rad_s": "rad/s", "rudder_rad": "rad"}
    mapping = mapping_of({"signals": {n: {"topic": t, "field": f, "unit": units[n]} for n, (t, f) in places.items()}})
    run = load_run(path, mapping)
    assert damping_of(run) == pytest.approx(DAMPING, rel=WITHIN)
    for name in ("run.parquet", "run.csv"):
        again = load_run(save_run(run, tmp_path / name))
        np.testing.assert_array_equal(record_of(again, Axis.YAW).commanded.start, record_of(run, Axis.YAW).commanded.start)


def test_a_command_on_the_clock_of_the_angle_adds_nothing_to_the_run():
    commands, time, motion = flown(10, 0.0)
    assert set(joined(commands, time, motion).signals) == set(TOPICS)
