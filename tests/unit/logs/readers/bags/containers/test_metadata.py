"""metadata.yaml beside a bag: the share that was read against its counts, and how it says messages are serialized."""

import shutil

import numpy as np
import pytest
from bags import EPOCH_NS, KINDS, BagWriter

from fieldsid.errors import LogError
from fieldsid.logs import load_run
from fieldsid.logs.inspection import inspect_log
from fieldsid.logs.mapping.mapping_file import mapping_of

MAPPING = mapping_of({"signals": {"yaw_rate_rad_s": {"topic": "/h"}}})
ROS2 = ("db3", "mcap")


def write(path, kind, count=40):
    with BagWriter(path, kind) as bag:
        for k in range(count):
            bag.write("/h", "std_msgs/msg/Float64", bag.make("std_msgs/Float64", float(k)), EPOCH_NS + k * 10**8)
            bag.write("/other", "std_msgs/msg/Float64", bag.make("std_msgs/Float64", 0.0), EPOCH_NS + k * 10**8)
    return bag.path


def file_of(bag):
    return bag if bag.is_file() else next(p for p in bag.iterdir() if p.suffix in (".mcap", ".db3"))


def changed(bag, old, new):
    file = bag / "metadata.yaml"
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))


def notes_of(run):
    return {n.code: n.message for n in run.notes}


@pytest.mark.parametrize("kind", KINDS)
def test_a_whole_bag_is_whole(tmp_path, kind):
    bag = write(tmp_path / "bag", kind)
    assert not {"incomplete", "metadata", "serialization"} & {n.code for n in load_run(bag, MAPPING).notes}
    assert not {"incomplete", "metadata", "serialization"} & {n.code for n in inspect_log(bag).notes}


@pytest.mark.parametrize("kind", ROS2)
def test_the_share_is_told_of_the_topics_that_are_read(tmp_path, kind):
    bag = write(tmp_path / "bag", kind)
    changed(bag, "message_count: 40", "message_count: 50")
    told = "fewer messages were read than metadata.yaml counts: 40 of 50 on /h (80.0 %)"
    assert notes_of(load_run(bag, MAPPING))["incomplete"] == told
    assert notes_of(load_run(file_of(bag), MAPPING))["incomplete"] == told
    listed = next(n.message for n in inspect_log(bag).notes if n.code == "incomplete")
    assert listed == f"{told}, 40 of 50 on /other (80.0 %)"


@pytest.mark.parametrize("kind", ["ros1", "mcap"])
def test_without_metadata_the_index_of_the_bag_counts(tmp_path, kind):
    log = shutil.copy(file_of(write(tmp_path / "bag", kind)), tmp_path / f"alone.{'bag' if kind == 'ros1' else 'mcap'}")
    raw = log.read_bytes()
    at = raw.index(np.float64(20.0).tobytes())
    log.write_bytes(raw[: at - 60] + bytes(40) + raw[at - 20 :])
    notes = notes_of(load_run(log, MAPPING, salvage=True))
    assert "fewer messages were read than the index of the bag counts:" in notes["incomplete"]
    assert " of 40 on /h" in notes["incomplete"]


def test_one_file_of_several_is_not_held_against_the_counts_of_all(tmp_path):
    bag = write(tmp_path / "bag", "mcap")
    shutil.copy(file_of(bag), bag / "bag_1.mcap")
    changed(bag, "bag.mcap", "bag_1.mcap\n  - bag.mcap")
    changed(bag, "message_count: 40", "message_count: 80")
    assert "incomplete" not in notes_of(load_run(bag / "bag_1.mcap", MAPPING))


@pytest.mark.parametrize("text", ["rosbag2_bagfile_information: 3\n", "a: [1\n", "other: {}\n", ""])
def test_metadata_that_cannot_be_used_is_said_and_the_bag_is_read(tmp_path, text):
    bag = write(tmp_path / "bag", "mcap")
    (bag / "metadata.yaml").write_text(text)
    run = load_run(bag, MAPPING)
    assert len(run) == 40
    assert "metadata.yaml` cannot be used: " in notes_of(run)["metadata"]


@pytest.mark.parametrize("kind", ROS2)
def test_metadata_that_states_another_serialization_than_the_file_is_said(tmp_path, kind):
    bag = write(tmp_path / "bag", kind)
    changed(bag, "serialization_format: cdr", "serialization_format: wrong_format")
    told = "/h: metadata.yaml states messages in `wrong_format`, the file itself in `cdr`"
    assert notes_of(load_run(bag, MAPPING))["serialization"] == told


def test_messages_in_a_serialization_that_is_unknown_are_refused_with_its_name(tmp_path):
    bag = write(tmp_path / "bag", "mcap")
    log = file_of(bag)
    log.write_bytes(log.read_bytes().replace(b"\x03\x00\x00\x00cdr", b"\x03\x00\x00\x00pb2"))
    refused = "the messages of `/h` are serialized as `pb2`, and only `cdr` and `ros1` are known"
    for reading in (lambda: load_run(log, MAPPING), lambda: inspect_log(log)):
        with pytest.raises(LogError, match=refused) as error:
            reading()
        assert "ros2 bag convert" in error.value.hint
