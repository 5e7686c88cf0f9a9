"""Own message types: defined in the bag, in the folder asked for, or in files beside the bag; said where they are from."""

import shutil
import sqlite3

import numpy as np
import pytest
from bags import EPOCH_NS, KINDS, BagWriter

from fieldsid.errors import LogError
from fieldsid.logs import load_run
from fieldsid.logs.inspection import inspect_log
from fieldsid.logs.mapping.mapping_file import mapping_of

OWN = {
    "my_auv/msg/Fins": "uint32 id\nstring mode\nfloat32[2] angles\nmy_auv/Inner[] inner\n",
    "my_auv/msg/Inner": "float64 rate\n",
}
MAPPING = mapping_of({
    "signals": {
        "rudder_measured_rad": {"topic": "/fins", "field": "angles[1]"},
        "yaw_rate_rad_s": {"topic": "/fins", "field": "inner[1].rate", "sign": -1},
    }
})  # fmt: skip
TRUTH = np.arange(20) / 4


def write(path, kind, *others):
    """A bag with a topic of its own type, and other topics of a type that everybody knows."""
    with BagWriter(path, kind, types=OWN) as bag:
        for k in range(20):
            inner = [bag.make("my_auv/Inner", 0.5 * k), bag.make("my_auv/Inner", -0.25 * k)]
            angles = np.array([0.0, k / 4], dtype=np.float32)
            message = bag.make("my_auv/Fins", k, "auto" if k % 2 else "hand", angles, inner)
            bag.write("/fins", "my_auv/msg/Fins", message, EPOCH_NS + k * 10**8)
            for other in others:
                bag.write(other, "std_msgs/msg/Float64", bag.make("std_msgs/Float64", 0.0), EPOCH_NS + k * 10**8)
    return bag.path


def bare(tmp_path, *others):
    """A db3 bag as recorders before 2023 wrote it: it names its types and does not define them."""
    (tmp_path / "logs").mkdir(exist_ok=True)
    log = next(write(tmp_path / "logs" / "bag", "db3", *others).glob("*.db3"))
    with sqlite3.connect(log) as base:
        base.execute("DELETE FROM message_definitions")
    base.close()
    return log


@pytest.fixture
def undefined(tmp_path):
    return bare(tmp_path)


def put(folder, types=OWN):
    for name, text in types.items():
        file = folder / f"{name}.msg"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
    return folder


def assert_read(run):
    np.testing.assert_allclose(run["rudder_measured_rad"], TRUTH)
    np.testing.assert_allclose(run["yaw_rate_rad_s"], TRUTH)


def origins(run):
    return [n.data["origin"] for n in run.notes if n.code == "definition"]


@pytest.mark.parametrize("kind", KINDS)
def test_an_own_type_is_read_by_the_definition_in_the_bag(tmp_path, kind):
    run = load_run(write(tmp_path / "bag", kind), MAPPING)
    assert_read(run)
    assert origins(run) == []


def test_a_type_that_nobody_defines_is_refused_with_the_command_that_helps(undefined, tmp_path):
    with pytest.raises(LogError, match="no definition of message type `my_auv/msg/Fins`") as error:
        load_run(undefined, MAPPING)
    assert error.value.hint == f"give the folder of `Fins.msg`: `sysid inspect {undefined} --msg-path DIR`"
    put(tmp_path / "elsewhere" / "ws")
    assert_read(load_run(undefined, MAPPING, msg_path=tmp_path / "elsewhere" / "ws"))
    with pytest.raises(LogError, match=r"holds no \.msg files"):
        load_run(undefined, MAPPING, msg_path=tmp_path / "logs" / "bag")


@pytest.mark.parametrize("place", ["logs/bag", "logs/bag/definitions", "logs", "logs/ws/src"])
def test_definitions_beside_the_bag_are_found_and_said(undefined, tmp_path, place):
    put(tmp_path / place)
    for log in (undefined, undefined.parent):
        run = load_run(log, MAPPING)
        assert_read(run)
        assert origins(run) == [f"`{(tmp_path / place).resolve() / 'my_auv/msg/Fins.msg'}`"]


def test_files_in_one_folder_without_a_package_are_found(undefined):
    for name, text in OWN.items():
        (undefined.parent / f"{name.rpartition('/')[2]}.msg").write_text(text)
    assert_read(load_run(undefined, MAPPING))


def test_a_file_that_is_no_definition_beside_those_that_are_does_not_matter(undefined):
    put(undefined.parent)
    (undefined.parent / "notes.msg").write_text("dear diary: {no definition}\n")
    assert_read(load_run(undefined, MAPPING))


def test_two_definitions_beside_the_bag_that_differ_are_refused_and_one_can_be_chosen(undefined, tmp_path):
    put(tmp_path / "logs" / "new")
    old = put(tmp_path / "logs" / "old", {**OWN, "my_auv/msg/Fins": "uint32 id\n" + OWN["my_auv/msg/Fins"]})
    with pytest.raises(LogError, match="`my_auv/msg/Fins` has 2 definitions beside the bag that differ") as error:
        load_run(undefined, MAPPING)
    folder = tmp_path.resolve() / "logs" / "new" / "my_auv" / "msg"
    assert error.value.hint == f"choose one: `sysid inspect {undefined} --msg-path {folder}`"
    assert_read(load_run(undefined, MAPPING, msg_path=folder.parent))
    shutil.rmtree(old)


def test_a_wrong_definition_in_the_bag_gives_way_to_the_one_beside_it(tmp_path):
    (tmp_path / "logs").mkdir(exist_ok=True)
    log = next(write(tmp_path / "bag", "db3").glob("*.db3"))
    with sqlite3.connect(log) as base:
        base.execute("UPDATE message_definitions SET encoded_message_definition = 'uint64 id'")
    base.close()
    put(tmp_path)
    run = load_run(log, MAPPING)
    assert_read(run)
    (note,) = [n for n in run.notes if n.code == "definition"]
    assert "the definition of `my_auv/msg/Fins` does not fit its messages; the one of `" in note.message


def test_an_inventory_says_which_topics_it_cannot_look_into_and_what_helps(tmp_path):
    log = bare(tmp_path, "/known")
    found = inspect_log(log)
    (note,) = [n for n in found.notes if n.code == "definition"]
    assert note.message.startswith("/fins: no definition of message type `my_auv/msg/Fins`; give the folder of `Fins.msg`")
    assert [(c.name, c.count) for c in found.inventory.channels] == [("/fins", 20), ("/known", 20)]


def test_a_bag_none_of_whose_topics_can_be_read_is_refused_with_what_helps(undefined):
    with pytest.raises(LogError, match="no definition of message type `my_auv/msg/Fins`") as error:
        inspect_log(undefined)
    assert error.value.hint == f"give the folder of `Fins.msg`: `sysid inspect {undefined} --msg-path DIR`"


@pytest.mark.parametrize(("others", "code"), [((), 2), (("/known",), 0)])
def test_a_type_that_holds_itself_is_an_error_where_nothing_else_can_be_read(tmp_path, run_cli, others, code):
    log = bare(tmp_path, *others)
    put(tmp_path / "logs" / "msg", {"my_auv/Fins": "my_auv/Fins inner\n"})
    answer = run_cli("inspect", log, "--msg-path", tmp_path / "logs" / "msg")
    assert answer.code == code
    assert "type `my_auv/msg/Fins` is a type that holds itself" in " ".join((answer.out + answer.err).split())
