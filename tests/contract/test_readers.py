"""What every reader must keep to: one suite over all members of the registry, each on a log of its own kind."""

from __future__ import annotations

from operator import attrgetter

import numpy as np
import pytest
from bags import MAPPING, write_bag
from binary_logs import write_alog, write_dataflash, write_dbd, write_lsf, write_mat, write_ulog
from look_alikes import write_key_value

from fieldsid.errors import LogError, MappingError
from fieldsid.logs import Run, load_run, save_run
from fieldsid.logs.channels import ChannelMap, Source, TableForm
from fieldsid.logs.mapping.mapping_file import mapping_of
from fieldsid.logs.reader import PACKAGE, RawLog, ReadOptions, reader_of
from fieldsid.records.named_inputs import sha256_of
from fieldsid.registry import members

READERS = tuple(members(PACKAGE, "READER").values())
TIME = 0.05 * np.arange(200)
SIGNALS = {
    "yaw_rad": 3.0 + 0.05 * np.arange(200),
    "yaw_rate_rad_s": np.cos(0.5 * TIME),
    "surge_m_s": 1.5 + 0.1 * np.sin(TIME),
    "rudder_rad": 0.2 * np.sign(np.sin(0.5 * TIME + 0.01)),
}
RUN = Run("log", TIME, SIGNALS)


def as_csv(folder):
    return save_run(RUN, folder / "log.csv"), None


def as_parquet(folder):
    return save_run(RUN, folder / "log.parquet"), None


def as_bag(folder):
    return write_bag(folder / "log", "mcap", {"time_s": TIME, **SIGNALS}), mapping_of(MAPPING)


def as_mat(folder):
    return write_mat(folder / "log.mat", TIME, SIGNALS), None


def by_topic(topics):
    signals = {name: {"topic": topic, "field": field, "unit": SI[name]} for name, (topic, field) in topics.items()}
    return mapping_of({"signals": signals})


SI = {"yaw_rad": "rad", "yaw_rate_rad_s": "rad/s", "surge_m_s": "m/s", "rudder_rad": "rad"}


def as_alog(folder):
    return write_alog(folder / "log.alog", TIME, SIGNALS), by_topic({n: (n, "data") for n in SIGNALS})


def as_ulog(folder):
    return write_ulog(folder / "log.ulg", TIME, SIGNALS), by_topic({n: ("trial", n) for n in SIGNALS})


def as_ardupilot(folder):
    return write_dataflash(folder / "log.bin", TIME, SIGNALS), by_topic({n: ("TRI", f"S{k}") for k, n in enumerate(SIGNALS)})


def as_slocum(folder):
    return write_dbd(folder / "log.dbd", TIME, SIGNALS), by_topic({n: (n, "data") for n in SIGNALS})


def as_lsf(folder):
    return write_lsf(folder / "log.lsf", TIME, SIGNALS, servo=None, start=0.0), by_topic(
        {n: ("EstimatedState", n) for n in SIGNALS}
    )


def as_tables(folder):
    """The motion in one table, the command in another."""
    place = folder / "log"
    place.mkdir()
    for name, kept in (("fins", ["rudder_rad"]), ("motion", [s for s in SIGNALS if s != "rudder_rad"])):
        save_run(Run(name, TIME, {s: SIGNALS[s] for s in kept}), place / f"{name}.csv")
    return place, by_topic({n: ("fins" if n == "rudder_rad" else "motion", n) for n in SIGNALS})


def as_key_value(folder):
    return write_key_value(folder / "log.csv", TIME, SIGNALS), by_topic({n: (n, "data") for n in SIGNALS})


MADE = {
    "key_value": as_key_value,
    "csv_table": as_csv,
    "parquet": as_parquet,
    "rosbag": as_bag,
    "mat": as_mat,
    "alog": as_alog,
    "ulog": as_ulog,
    "ardupilot": as_ardupilot,
    "slocum": as_slocum,
    "lsf": as_lsf,
    "several_tables": as_tables,
}


TEXT = ("csv_table", "key_value")
MISSPELT = {
    "rosbag": Source(topic="/rudder_cm", path="data"),
    "alog": Source(topic="rudder_rd", path="data"),
    "ulog": Source(topic="trial", path="rudder_rd"),
    "ardupilot": Source(topic="TRI", path="S33"),
    "slocum": Source(topic="rudder_rd", path="data"),
    "lsf": Source(topic="EstimatedState", path="rudder_rd"),
    "several_tables": Source(topic="fins", path="rudder_rd"),
    "key_value": Source(topic="rudder_rd", path="data"),
}
"""Sources of logs of topics that are not there; all others are tables."""


def test_every_reader_has_a_log_of_its_kind_in_this_suite():
    assert {r.name for r in READERS} == set(MADE)


@pytest.fixture(params=READERS, ids=attrgetter("name"))
def reader(request):
    return request.param


@pytest.fixture
def log(reader, tmp_path):
    return MADE[reader.name](tmp_path)


def test_it_says_what_it_reads_and_lists_suffixes(reader):
    assert reader.says
    assert all(s.startswith(".") for s in reader.suffixes)


def test_it_alone_recognises_its_log(reader, log):
    assert reader.sniff(log[0])
    assert reader_of(log[0]).name == reader.name


def test_it_does_not_take_the_logs_of_others(reader, tmp_path):
    for name, make in MADE.items():
        folder = tmp_path / name
        folder.mkdir()
        assert reader_of(make(folder)[0]).name == name


def test_the_signals_come_back(reader, log):
    path, mapping = log
    run = load_run(path, mapping)
    np.testing.assert_allclose(run.time, TIME, atol=1e-12)
    for name, values in SIGNALS.items():
        off = run[name] - values
        np.testing.assert_allclose(
            off - (2 * np.pi * np.round(off / (2 * np.pi)) if name == "yaw_rad" else 0.0), 0.0, atol=1e-12, err_msg=name
        )
    assert np.ptp(run["yaw_rad"] - SIGNALS["yaw_rad"]) < 1e-9


def test_it_hands_on_a_raw_log_of_the_mapped_signals_only(reader, log):
    path, mapping = log
    chosen = mapping or reader.own_map(path, ReadOptions())
    raw = reader.read(path, chosen, ReadOptions())
    assert isinstance(raw, RawLog)
    assert set(raw.series) == set(chosen.sources)
    assert all(len(s.time) == len(s.values) for s in raw.series.values())


def test_the_inventory_names_every_channel_with_its_count(reader, log):
    found = reader.inventory(log[0], ReadOptions(), TableForm())
    assert found.channels
    assert all(c.count == 200 and c.fields for c in found.channels)


def test_the_log_is_left_as_it_was(reader, log):
    path, mapping = log
    before, listing = sha256_of(path), sorted(p.name for p in path.parent.iterdir())
    load_run(path, mapping)
    reader.inventory(path, ReadOptions(), TableForm())
    assert sha256_of(path) == before
    assert sorted(p.name for p in path.parent.iterdir()) == listing


def test_a_channel_that_is_not_there_is_an_error_with_near_names(reader, log):
    path, _ = log
    source = MISSPELT.get(reader.name, Source(column="rudder_rd"))
    mapping = ChannelMap({"rudder_rad": source}, time=Source(column="time_s"), origin=path)
    with pytest.raises(MappingError) as error:
        load_run(path, mapping)
    assert ("S3" if reader.name == "ardupilot" else "rudder") in error.value.hint
    assert error.value.found


def test_a_mapping_of_the_other_kind_is_an_error(reader, log):
    path, _ = log
    other = Source(column="a") if reader.name in MISSPELT else Source(topic="/a")
    with pytest.raises(MappingError):
        load_run(path, ChannelMap({"yaw_rad": other}, time=Source(column="time_s"), origin=path))


def test_a_log_cut_in_half_is_an_error_or_what_is_left_with_a_note(reader, log):
    path, mapping = log
    if path.is_dir():
        path = next(p for p in path.iterdir() if p.suffix in (".mcap", ".csv"))
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    try:
        run = load_run(log[0], mapping)
    except LogError as error:
        parts = (error.what, error.found, error.hint)
    else:
        # Text cut at the end of a line cannot be told from a whole file; every other cut is noted.
        parts = (10 < len(run) < 200, reader.name in TEXT or "truncated" in {n.code for n in run.notes})
    assert all(parts)


def test_an_empty_file_a_folder_and_a_missing_file_are_errors(reader, tmp_path):
    suffix = next(iter(reader.suffixes), "")  # a folder has none
    empty = tmp_path / f"a{suffix}"
    empty.write_bytes(b"")
    for path in (empty, tmp_path / f"missing{suffix}", tmp_path):
        with pytest.raises(LogError) as error:
            load_run(path)
        assert error.value.found
        assert error.value.hint


def test_a_file_that_cannot_be_opened_is_an_error(reader, log, monkeypatch):
    from pathlib import Path

    path, mapping = log
    if path.is_dir():
        path = next(p for p in path.iterdir() if p.suffix in (".mcap", ".csv"))
    opened = Path.open

    def refuse(self, *args, **kwargs):
        if self == path:
            raise PermissionError(13, "Permission denied")
        return opened(self, *args, **kwargs)

    monkeypatch.setattr(Path, "open", refuse)
    with pytest.raises(LogError, match="cannot be read: Permission denied"):
        load_run(path, mapping)
