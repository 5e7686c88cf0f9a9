"""Every kind of bag by the readers of this room and by rosbags: the same packets, and the way over."""

import re
import sqlite3

import numpy as np
import pytest
from bags import FORMS, KINDS, MAPPING, write_bag, write_mixed_bag

from fieldsid.errors import LogError
from fieldsid.logs import load_run
from fieldsid.logs.mapping.mapping_file import mapping_of
from fieldsid.logs.readers.bags import stores
from fieldsid.logs.readers.bags.containers import db3, mcap, ros1
from fieldsid.logs.readers.bags.messages import by_rosbags, message_layout
from fieldsid.logs.readers.bags.packets import Collector, UnknownFormError


@pytest.fixture(scope="module", params=FORMS, ids="-".join)
def mixed(request, tmp_path_factory):
    kind, compression = request.param
    return write_mixed_bag(tmp_path_factory.mktemp(kind) / "mixed", kind, compression)


def rosbags_collector(path, wanted=None):
    collector = Collector(wanted)
    by_rosbags.collect(path, collector, UnknownFormError("asked for"))
    return collector


def by_stamp(packets):
    return sorted(zip(packets.stamps, packets.payloads, strict=True))


def test_both_find_the_same_connections_stamps_and_bytes(mixed):
    ours, theirs = stores.collected(mixed, None), rosbags_collector(mixed)
    assert set(ours.connections) == set(theirs.connections) == {"/state", "/depth", "/off"}
    for topic, connection in theirs.connections.items():
        mine = ours.connections[topic]
        assert (mine.type_name, mine.serialization) == (connection.type_name, connection.serialization)
        assert mine.definition.strip() == connection.definition.strip()
        assert by_stamp(ours.packets[topic]) == by_stamp(theirs.packets[topic])
    assert ours.notes == []


def test_both_leave_out_the_topics_that_nobody_wants(mixed):
    ours, theirs = stores.collected(mixed, {"/depth"}), rosbags_collector(mixed, {"/depth"})
    assert set(ours.packets) == set(theirs.packets) == {"/depth"}
    assert by_stamp(ours.packets["/depth"]) == by_stamp(theirs.packets["/depth"])


TIME = np.arange(60) / 20
RUN = {"time_s": TIME, "yaw_rad": 0.1 * TIME, "yaw_rate_rad_s": np.full(60, 0.1), "rudder_rad": 0.2 * np.sign(np.sin(TIME + 0.1))}


@pytest.mark.parametrize("kind", KINDS)
def test_a_file_in_a_form_that_is_unknown_is_read_by_rosbags(tmp_path, monkeypatch, kind):
    log = write_bag(tmp_path / "log", kind, RUN)
    known = load_run(log, mapping_of(MAPPING))

    def refuse(path, collector):
        raise UnknownFormError("a form of next year", found="version 3")

    monkeypatch.setattr(stores, "SCANS", dict.fromkeys(stores.SCANS, refuse))
    run = load_run(log, mapping_of(MAPPING))
    np.testing.assert_array_equal(run.time, known.time)
    for signal in known.signals:
        np.testing.assert_array_equal(run[signal], known[signal])


@pytest.mark.parametrize("module", [ros1, mcap, db3, message_layout], ids=lambda m: m.__name__.rpartition(".")[2])
def test_a_reader_of_bytes_states_what_it_buys(module):
    stated = re.search(
        r"Over rosbags: \w+(?: \w+)? (\d+)(?: to \d+)? times as fast \(tests/benchmarks/bag_reading\.py", module.__doc__
    )
    assert stated
    assert int(stated[1]) >= 2


def test_a_database_with_other_tables_is_refused_with_both_reasons(tmp_path):
    log = tmp_path / "log.db3"
    with sqlite3.connect(log) as base:
        base.execute("CREATE TABLE other (id INTEGER)")
    base.close()
    with pytest.raises(LogError, match="has no table of topics") as error:
        load_run(log, mapping_of(MAPPING))
    assert "rosbags: Cannot open database" in error.value.found


def test_what_neither_can_read_is_refused_with_both_reasons(tmp_path):
    log = tmp_path / "log.bag"
    log.write_bytes(b"#ROSBAG V1.2\n" + bytes(5000))
    with pytest.raises(LogError, match="a bag of another version") as error:
        load_run(log, mapping_of(MAPPING))
    assert "#ROSBAG V1.2" in error.value.found
    assert "rosbags: Bag version 102 is not supported" in error.value.found
    assert "rosbag migrate" in error.value.hint
