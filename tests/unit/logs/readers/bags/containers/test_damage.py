"""Damage inside a bag: no wrong number comes in, little is lost beside it, and both the place and the share are said."""

import sqlite3
from contextlib import closing

import numpy as np
import pytest
from bags import EPOCH_NS, KINDS, MAPPING, BagWriter, float64_rows, write_bag, write_mcap

from fieldsid.errors import LogError
from fieldsid.logs import load_run
from fieldsid.logs.mapping.mapping_file import mapping_of
from fieldsid.logs.reader import ReadOptions
from fieldsid.logs.readers.bags.containers.damage import resumed
from fieldsid.logs.readers.bags.stores import collected
from fieldsid.logs.readers.rosbag import read

TIME = np.arange(1200) / 20
RUN = {
    "time_s": TIME,
    "yaw_rad": 0.05 * np.sin(TIME),
    "yaw_rate_rad_s": 0.05 * np.cos(TIME),
    "surge_m_s": 1.5 + 0.1 * np.sin(0.3 * TIME),
    "depth_m": 10.0 + np.cos(0.7 * TIME),
    "rudder_rad": 0.2 * np.sign(np.sin(TIME + 0.01)),
}
FILLS = {"zeros": bytes(4096), "ones": b"\xff" * 4096, "noise": np.random.default_rng(3).bytes(4096)}


def file_of(bag):
    return bag if bag.is_file() else next(p for p in bag.iterdir() if p.suffix in (".mcap", ".db3"))


def overwritten(file, place, fill):
    raw = bytearray(file.read_bytes())
    raw[place : place + len(fill)] = fill
    file.write_bytes(bytes(raw))


def salvaged(log):
    """The mapped series as they are in the bag, before they come to one clock."""
    return read(log, mapping_of(MAPPING), ReadOptions(salvage=True))


def rows_of(notes, time, rate_hz):
    """Which samples of the log are left, by the clock of the bag."""
    origin = next(n.data["origin_ns"] for n in notes if n.code == "time_origin")
    return np.rint((time + (origin - EPOCH_NS) / 1e9) * rate_hz).astype(int)


LOGGED = {
    "surge_m_s": RUN["surge_m_s"],
    "yaw_rate_rad_s": -RUN["yaw_rate_rad_s"],
    "depth_m": -RUN["depth_m"],
    "rudder_rad": RUN["rudder_rad"],
}
"""Numbers in the bag, in its frames."""


def wrong_numbers(raw):
    """Count the samples that are there and are not what was logged."""
    found = {s: raw.series[s].values - v[rows_of(raw.notes, raw.series[s].time, 20)] for s, v in LOGGED.items()}
    return {s: int((off != 0.0).sum()) for s, off in found.items() if off.any()}


def count(raw):
    return raw.series["surge_m_s"].values.size


@pytest.fixture(scope="module", params=KINDS)
def whole(request, tmp_path_factory):
    bag = write_bag(tmp_path_factory.mktemp(request.param) / "log", request.param, RUN)
    return bag, file_of(bag).read_bytes()


@pytest.mark.parametrize("fill", FILLS)
@pytest.mark.parametrize("share", [0.11, 0.3, 0.5, 0.62, 0.83])
def test_four_kilobytes_of_damage_cost_a_few_samples_and_import_no_wrong_number(whole, share, fill):
    bag, raw = whole
    file = file_of(bag)
    try:
        overwritten(file, int(share * len(raw)), FILLS[fill])
        raw_log = salvaged(bag)
    finally:
        file.write_bytes(raw)
    assert wrong_numbers(raw_log) == {}
    assert all(s.time.size >= TIME.size - 12 for s in raw_log.series.values())
    if count(raw_log) < TIME.size:
        notes = {n.code: n for n in raw_log.notes}
        assert any(word in notes["damaged"].message for word in (f"of {file.name}", "of the table of messages"))
        assert f"{count(raw_log)} of {TIME.size} on /odom" in notes["incomplete"].message
        assert notes["incomplete"].data["/odom"] == {"read": count(raw_log), "of": TIME.size}


@pytest.mark.parametrize(("kind", "compression"), [("ros1", "lz4"), ("ros1", "bz2"), ("mcap", "storage")])
def test_a_damaged_compressed_chunk_is_left_out_whole_and_said(tmp_path, kind, compression):
    bag = write_bag(tmp_path / "log", kind, RUN, compression=compression)
    file = file_of(bag)
    overwritten(file, int(0.2 * file.stat().st_size), FILLS["noise"][:512])
    run = salvaged(bag)
    assert wrong_numbers(run) == {}
    assert count(run) < TIME.size
    notes = {n.code: n.message for n in run.notes}
    assert "a compressed chunk of" in notes["damaged"]
    assert f"{count(run)} of {TIME.size} on /odom" in notes["incomplete"]


@pytest.mark.parametrize("kind", ["ros1", "mcap"])
def test_a_chunk_whose_head_is_gone_is_read_by_its_records(tmp_path, kind):
    bag = write_bag(tmp_path / "log", kind, RUN)
    file = file_of(bag)
    raw = file.read_bytes()
    head = raw.index(b"compression=none") - 20 if kind == "ros1" else raw.index(b"\x06", 8 + 9 + 8)
    second = raw.index(b"compression=none", head + 1000) - 20 if kind == "ros1" else head
    overwritten(file, second, bytes(60))
    run = salvaged(bag)
    assert wrong_numbers(run) == {}
    assert count(run) >= TIME.size - 2
    assert "damaged" in {n.code for n in run.notes}


VALUES = np.sin(np.arange(600.0))
HEADINGS = mapping_of({"signals": {"yaw_rate_rad_s": {"topic": "/h"}}})


@pytest.mark.parametrize("form", [{}, {"compression": "lz4"}, {"chunk_rows": 0}, {"crc": False}], ids=str)
def test_files_of_another_writer_are_read(tmp_path, form):
    run = load_run(write_mcap(tmp_path / "a.mcap", float64_rows("/h", VALUES), **form), HEADINGS)
    np.testing.assert_array_equal(run["yaw_rate_rad_s"], VALUES)
    assert not {n.code for n in run.notes} & {"damaged", "truncated", "incomplete"}


@pytest.mark.parametrize("form", [{}, {"chunk_rows": 0}, {"crc": False}], ids=str)
def test_damage_without_chunks_or_checksums_is_read_around(tmp_path, form):
    log = write_mcap(tmp_path / "a.mcap", float64_rows("/h", VALUES), **form)
    overwritten(log, log.stat().st_size // 2, bytes(400))
    run = load_run(log, HEADINGS, salvage=True, max_gap_s=float("inf"))
    np.testing.assert_array_equal(run["yaw_rate_rad_s"], VALUES[rows_of(run.notes, run.time, 10)])
    assert 580 <= len(run) < 600
    assert [n.message.startswith("3") and " bytes at byte " in n.message for n in run.notes if n.code == "damaged"] == [True]


def test_a_chunk_with_one_wrong_byte_in_sound_records_is_left_out_by_its_checksum(tmp_path):
    rows = float64_rows("/h", VALUES)
    log = write_mcap(tmp_path / "a.mcap", rows)
    overwritten(log, log.read_bytes().index(rows[320][2]) + 8, b"\x41")
    run = load_run(log, HEADINGS, salvage=True, max_gap_s=float("inf"))
    left = rows_of(run.notes, run.time, 10)
    np.testing.assert_array_equal(run["yaw_rate_rad_s"], VALUES[left])
    assert sorted(set(range(600)) - set(left.tolist())) == list(range(300, 350))
    assert any("a chunk of 4.90 s whose checksum does not hold" in n.message for n in run.notes)


def test_many_damaged_places_are_counted(tmp_path):
    log = write_mcap(tmp_path / "a.mcap", float64_rows("/h", VALUES), chunk_rows=0)
    for share in np.linspace(0.1, 0.9, 9):
        overwritten(log, int(share * log.stat().st_size), bytes(60))
    run = load_run(log, HEADINGS, salvage=True, max_gap_s=float("inf"))
    np.testing.assert_array_equal(run["yaw_rate_rad_s"], VALUES[rows_of(run.notes, run.time, 10)])
    damaged = [n.message for n in run.notes if n.code == "damaged"]
    assert len(damaged) == 6
    assert damaged[-1] == "4 more places are damaged and were left out"


def test_a_cut_file_without_chunks_is_cut_and_not_damaged(tmp_path):
    log = write_mcap(tmp_path / "a.mcap", float64_rows("/h", VALUES), chunk_rows=0)
    log.write_bytes(log.read_bytes()[: log.stat().st_size // 2])
    run = load_run(log, HEADINGS)
    np.testing.assert_array_equal(run["yaw_rate_rad_s"], VALUES[: len(run)])
    assert len(run) > 290
    assert [n.code for n in run.notes if n.code in ("damaged", "truncated")] == ["truncated"]


def numbers(path, kind, count=60, **more):
    with BagWriter(path, kind, **more) as bag:
        for k in range(count):
            bag.write("/h", "std_msgs/msg/Float64", bag.make("std_msgs/Float64", float(k)), EPOCH_NS + k * 10**8)
    return bag.path


def test_a_connection_that_is_lost_in_a_chunk_is_taken_from_the_index(tmp_path):
    log = numbers(tmp_path / "a", "ros1")
    log.write_bytes(log.read_bytes().replace(b"message_definition=", b"message_dofinition=", 1))
    collector = collected(log, None)
    assert len(collector.packets["/h"].stamps) == 60


def test_a_bag_whose_connections_are_all_lost_is_refused_with_the_place(tmp_path):
    log = numbers(tmp_path / "a", "ros1")
    log.write_bytes(log.read_bytes().replace(b"message_definition=", b"message_dofinition="))
    with pytest.raises(LogError, match="has no messages") as error:
        load_run(log, HEADINGS)
    assert "the connection of /h at byte" in error.value.found


def test_a_row_of_a_db3_bag_with_a_damaged_length_costs_itself_and_its_neighbours(tmp_path):
    log = file_of(numbers(tmp_path / "a", "db3"))
    row = (EPOCH_NS + 2_000_000_000).to_bytes(8, "big") + b"\x00\x01\x00\x00"  # the stamp, then the message
    at = log.read_bytes().index(row) - 12
    overwritten(log, at, b"\xff" * 12)
    collector = collected(log, None)
    kept = [(s - EPOCH_NS) // 10**8 for s in collector.packets["/h"].stamps]
    assert set(range(60)) - set(kept) <= {18, 19, 20, 21, 22}
    assert 20 not in kept
    assert [n.code for n in collector.notes] == ["damaged", "incomplete"]


@pytest.mark.parametrize("plugin", ["db3", "mcap"])
@pytest.mark.parametrize("share", [0.4, 0.8])
def test_a_file_that_was_compressed_whole_and_cut_gives_what_is_left(tmp_path, plugin, share):
    bag = write_bag(tmp_path / "log", plugin, RUN, compression="file")
    packed = next(p for p in bag.iterdir() if p.name.endswith(".zstd"))
    packed.write_bytes(packed.read_bytes()[: int(share * packed.stat().st_size)])
    run = salvaged(bag)
    assert wrong_numbers(run) == {}
    assert 0.3 * share * TIME.size < count(run) < TIME.size
    assert any(n.message.startswith(f"{packed.name} is cut off: ") for n in run.notes if n.code == "truncated")


def test_messages_that_were_compressed_one_by_one_are_left_out_one_by_one(tmp_path):
    log = file_of(numbers(tmp_path / "a", "mcap", compression="message"))
    raw = bytearray(log.read_bytes())
    tenth = [i for i in range(len(raw)) if raw.startswith(b"\x28\xb5\x2f\xfd", i)][10]
    raw[tenth + 4 : tenth + 9] = b"\xff" * 5
    log.write_bytes(bytes(raw))
    run = load_run(log, HEADINGS, salvage=True)
    assert run["yaw_rate_rad_s"].tolist() == [float(k) for k in range(60) if k != 10]
    messages = [n.message for n in run.notes if n.code == "damaged"]
    assert messages[0].startswith("1 compressed messages on /h")
    assert "/h: 1 of 60 messages do not fit their definition and were left out, the first 1.000 s after" in messages[1]


def test_records_must_follow_each_other_behind_damage():
    ends = {5: 9, 9: 12, 12: None, 20: 24, 24: 30, 30: 41, 41: 50, 47: 50}
    assert resumed([5, 20], ends.get, 50) == 20
    assert resumed([5, 47], ends.get, 50) == 47
    assert resumed([5], ends.get, 50) is None


def test_a_db3_bag_whose_tree_is_cut_off_is_not_said_to_be_empty(tmp_path):
    log = file_of(numbers(tmp_path / "a", "db3"))
    with closing(sqlite3.connect(log)) as base, base:
        many = [(i, 1, EPOCH_NS + i * 10**8, bytes(2500)) for i in range(100, 3000)]
        base.executemany("INSERT INTO messages (id, topic_id, timestamp, data) VALUES (?, ?, ?, ?)", many)
    whole = log.read_bytes()
    cut = tmp_path / "cut.db3"
    cut.write_bytes(whole[: int(0.12 * len(whole))])  # the page that names those before it comes behind
    with pytest.raises(LogError, match="holds no message that can be read") as error:
        load_run(cut, HEADINGS)
    assert "cut off at byte" in error.value.found
    assert "recorder" not in error.value.hint
