"""Messages decoded in blocks against rosbags' own deserializer, message by message."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from fieldsid.errors import LogError, MappingError
from fieldsid.logs.readers.bags.messages.message_layout import Decoder

ODD = """
bool flag
float64 first
string label
uint8 small
float32[3] three
int16[] row
string[] name
float64[] position
custom_msgs/Part[] parts
custom_msgs/Part part
uint64 last
"""
PART = "uint8 id\nfloat64 value\nstring text\n"

STORE = get_typestore(Stores.ROS2_HUMBLE)
STORE.register({**get_types_from_msg(ODD, "custom_msgs/msg/Odd"), **get_types_from_msg(PART, "custom_msgs/msg/Part")})
FIELDS = {name: list(fields) for name, (_, fields) in STORE.fielddefs.items()}

texts = st.text(st.characters(codec="ascii", exclude_characters="\x00"), max_size=9)
numbers = st.floats(allow_nan=False, width=64)
parts = st.builds(STORE.types["custom_msgs/msg/Part"], id=st.integers(0, 255), value=numbers, text=texts)
odds = st.builds(
    STORE.types["custom_msgs/msg/Odd"],
    flag=st.booleans(),
    first=numbers,
    label=texts,
    small=st.integers(0, 255),
    three=st.lists(st.floats(width=32, allow_nan=False), min_size=3, max_size=3).map(lambda v: np.array(v, dtype=np.float32)),
    row=st.lists(st.integers(-(2**15), 2**15 - 1), max_size=4).map(lambda v: np.array(v, dtype=np.int16)),
    name=st.lists(texts, max_size=3),
    position=st.lists(numbers, max_size=3).map(lambda v: np.array(v, dtype=np.float64)),
    parts=st.lists(parts, max_size=3),
    part=parts,
    last=st.integers(0, 2**53),
)
PATHS = ["flag", "first", "small", "three[1]", "part.id", "part.value", "last", "row[1]", "position[0]"]


def value_at(message, path):
    for step in path.replace("]", "").split("."):
        name, _, index = step.partition("[")
        message = getattr(message, name)
        if index:
            message = message[int(index)] if int(index) < len(message) else np.nan
    return float(message)


@settings(max_examples=60, deadline=None)
@given(st.lists(odds, min_size=1, max_size=6), st.booleans())
def test_any_messages_decode_as_rosbags_decodes_them(messages, cdr):
    name = "custom_msgs/msg/Odd"
    serialize = STORE.serialize_cdr if cdr else STORE.serialize_ros1
    payloads = [bytes(serialize(m, name)) for m in messages]
    found, good = Decoder(FIELDS, name, cdr=cdr).decode(payloads, PATHS)
    assert good.all()
    for path, column in zip(PATHS, found, strict=True):
        np.testing.assert_array_equal(column[:, 0], [value_at(m, path) for m in messages], err_msg=path)


@settings(max_examples=30, deadline=None)
@given(odds, st.integers(1, 60))
def test_a_cut_message_is_refused_and_never_read_past_its_end(message, cut):
    raw = bytes(STORE.serialize_cdr(message, "custom_msgs/msg/Odd"))[:-cut]
    with pytest.raises(LogError):
        Decoder(FIELDS, "custom_msgs/msg/Odd", cdr=True).layout(raw)


@given(st.binary(max_size=80), st.booleans())
def test_bytes_of_anything_are_a_layout_or_a_refusal(raw, cdr):
    try:
        layout = Decoder(FIELDS, "nav_msgs/msg/Odometry", cdr=cdr).layout(raw)
    except LogError:
        return
    assert layout.end <= len(raw)


def test_big_endian_messages_are_read():
    raw = bytes(STORE.serialize_cdr(STORE.types["std_msgs/msg/Float64"](1.25), "std_msgs/msg/Float64", little_endian=False))
    assert Decoder(FIELDS, "std_msgs/msg/Float64", cdr=True).decode([raw], ["data"])[0][0].tolist() == [[1.25]]


def joints(names, positions):
    header = STORE.types["std_msgs/msg/Header"](stamp=STORE.types["builtin_interfaces/msg/Time"](1, 2), frame_id="")
    message = STORE.types["sensor_msgs/msg/JointState"](header, names, np.array(positions), np.zeros(0), np.zeros(0))
    return bytes(STORE.serialize_cdr(message, "sensor_msgs/msg/JointState"))


def test_a_joint_is_found_by_name_though_the_order_changes():
    payloads = [
        joints(["rudder", "stern_"], [0.1, 0.2]),
        joints(["stern_", "rudder"], [0.3, 0.4]),
        joints(["rudder", "stern_"], [0.5, 0.6]),
    ]
    decoder = Decoder(FIELDS, "sensor_msgs/msg/JointState", cdr=True)
    (by_name, by_index), _ = decoder.decode(payloads, ["position[rudder]", "position[0]"])
    assert by_name[:, 0].tolist() == [0.1, 0.4, 0.5]
    assert by_index[:, 0].tolist() == [0.1, 0.3, 0.5]


def test_an_unknown_joint_and_an_unknown_field_list_the_near_ones():
    decoder = Decoder(FIELDS, "sensor_msgs/msg/JointState", cdr=True)
    with pytest.raises(MappingError, match="no element named 'ruder'") as joint:
        decoder.decode([joints(["rudder"], [0.1])], ["position[ruder]"])
    assert "`rudder`" in joint.value.hint
    with pytest.raises(MappingError, match="no number at `positon") as field:
        decoder.decode([joints(["rudder"], [0.1])], ["positon[0]"])
    assert "`position[0]`" in field.value.hint


def test_many_different_layouts_are_all_decoded():
    text = STORE.types["custom_msgs/msg/Part"]
    payloads = [bytes(STORE.serialize_cdr(text(i % 7, float(i), "x" * (i % 60)), "custom_msgs/msg/Part")) for i in range(200)]
    found = Decoder(FIELDS, "custom_msgs/msg/Part", cdr=True).decode(payloads, ["value"])[0][0]
    assert found[:, 0].tolist() == [float(i) for i in range(200)]


def test_a_definition_that_does_not_fit_is_said_so():
    raw = bytes(STORE.serialize_cdr(STORE.types["geometry_msgs/msg/Vector3"](1.0, 2.0, 3.0), "geometry_msgs/msg/Vector3"))
    with pytest.raises(LogError, match="does not fit its messages"):
        Decoder(FIELDS, "std_msgs/msg/Float64", cdr=True).layout(raw)
    with pytest.raises(LogError, match="no definition of message type `my/msg/Type`"):
        Decoder(FIELDS, "my/msg/Type", cdr=True).layout(raw)
