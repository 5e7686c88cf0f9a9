"""Every kind of bag by the readers of this room and by rosbags: the same packets."""

import re
import sqlite3

import pytest
from bags import FORMS, MAPPING, write_mixed_bag
from rosbags.rosbag1 import Reader as Ros1Reader
from rosbags.rosbag2 import Reader as Ros2Reader

from fieldsid.errors import LogError
from fieldsid.logs import load_run
from fieldsid.logs.mapping.mapping_file import mapping_of
from fieldsid.logs.readers.bags import stores
from fieldsid.logs.readers.bags.containers import db3, mcap, ros1
from fieldsid.logs.readers.bags.messages import message_layout
from fieldsid.logs.readers.bags.packets import ROS1, Collector, Connection


@pytest.fixture(scope="module", params=FORMS, ids="-".join)
def mixed(request, tmp_path_factory):
    kind, compression = request.param
    return write_mixed_bag(tmp_path_factory.mktemp(kind) / "mixed", kind, compression)


def rosbags_collector(path, wanted=None):
    collector, is_ros1 = Collector(wanted), path.suffix == ".bag"
    with (Ros1Reader if is_ros1 else Ros2Reader)(path) as reader:
        told = [
            Connection(c.topic, c.msgtype, ROS1 if is_ros1 else c.ext.serialization_format, c.msgdef.data)
            for c in reader.connections
        ]
        packets = {c.id: collector.connect(said) for c, said in zip(reader.connections, told, strict=True)}
        for connection, stamp, payload in reader.messages([c for c in reader.connections if packets[c.id] is not None]):
            packets[connection.id].stamps.append(stamp)
            packets[connection.id].payloads.append(bytes(payload))
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


@pytest.mark.parametrize("module", [ros1, mcap, db3, message_layout], ids=lambda m: m.__name__.rpartition(".")[2])
def test_a_reader_of_bytes_states_what_it_buys(module):
    stated = re.search(
        r"Over rosbags: \w+(?: \w+)? (\d+)(?: to \d+)? times as fast \(tests/benchmarks/bag_reading\.py", module.__doc__
    )
    assert stated
    assert int(stated[1]) >= 2


def test_a_database_with_other_tables_is_refused(tmp_path):
    log = tmp_path / "log.db3"
    with sqlite3.connect(log) as base:
        base.execute("CREATE TABLE other (id INTEGER)")
    base.close()
    with pytest.raises(LogError, match="has no table of topics"):
        load_run(log, mapping_of(MAPPING))


def test_a_bag_of_another_version_is_refused(tmp_path):
    log = tmp_path / "log.bag"
    log.write_bytes(b"#ROSBAG V1.2\n" + bytes(5000))
    with pytest.raises(LogError, match="a bag of another version") as error:
        load_run(log, mapping_of(MAPPING))
    assert "#ROSBAG V1.2" in error.value.found
    assert "rosbag migrate" in error.value.hint
