"""mapping.yaml: what is taken, and what is refused with the near match."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldsid.artifacts import to_yaml
from fieldsid.errors import ArtifactError, FieldsidError, MappingError
from fieldsid.logs.channels import Source
from fieldsid.logs.convert.frames import Frame
from fieldsid.logs.convert.units import UNITS, dimension_of
from fieldsid.logs.mapping.mapping_file import channel_of, frame_of, load_mapping, mapping_of
from fieldsid.logs.run import SIGNALS


def test_a_whole_mapping_becomes_plain_records(tmp_path):
    path = tmp_path / "mapping.yaml"
    path.write_text("""
schema: fieldsid/mapping/1
frame: ENU/FLU
stamp: receive
clock: yaw_rate_rad_s
time: {column: t, unit: ms}
pressure: {density: 1000.0, surface_pa: 0.0}
table: {separator: ";", decimal: ",", skip: 2}
signals:
  attitude: {columns: [qx, qy, qz, qw], order: wxyz}
  yaw_rate_rad_s: {topic: /imu, field: angular_velocity.z, sign: -1, offset: 0.1, frame: NED, stamp: header}
  rudder_rad: 8
  depth_m: depth
""")
    found = load_mapping(path)
    assert found.frame == Frame("ENU", "FLU")
    assert found.sources["attitude"] == Source(columns=("qx", "qy", "qz", "qw"), order="wxyz")
    assert found.sources["yaw_rate_rad_s"] == Source(
        topic="/imu", path="angular_velocity.z", sign=-1, offset=0.1, frame=Frame("NED", "FRD"), stamp="header"
    )
    assert found.sources["rudder_rad"] == Source(column=8)
    assert found.sources["depth_m"] == Source(column="depth")
    assert (found.time.column, found.time.unit, found.clock, found.stamp) == ("t", "ms", "yaw_rate_rad_s", "receive")
    assert (found.table.separator, found.table.decimal, found.table.skip, found.pressure.density) == (";", ",", 2, 1000.0)


@pytest.mark.parametrize(
    ("body", "what", "hint"),
    [
        ({"signal": {}}, "unknown key `signal`", "`signals`"),
        ({"signals": {"yaw_rad": {"colum": "a"}}}, "unknown key `signals.yaw_rad.colum`", "`column`"),
        ({"signals": {"yaw_rads": {"column": "a"}}}, "unknown signal `yaw_rads`", "`yaw_rad`"),
        ({"signals": {"yaw_rad": {"column": "a", "sign": 2}}}, "`signals.yaw_rad.sign` is not valid", "correct"),
        ({"signals": {"yaw_rad": {"column": -1}}}, "`signals.yaw_rad.column` is not valid", "correct"),
        ({"signals": {"yaw_rad": {"column": "a", "offset": "1"}}}, "`signals.yaw_rad.offset` is not valid", "correct"),
        ({"signals": {"yaw_rad": {"column": "a", "unit": "degg"}}}, "no unit 'degg'", "`deg`"),
        ({"signals": {"yaw_rad": {"column": "a", "unit": "m"}}}, "`yaw_rad` cannot be in 'm'", "angle"),
        ({"signals": {"yaw_rad": {"column": "a", "frame": "EDN"}}}, "no frame 'EDN'", "ENU/FLU"),
        ({"signals": {"yaw_rad": {"unit": "deg"}}}, "needs one of `column`", "column"),
        ({"signals": {"yaw_rad": {"column": "a", "topic": "/b"}}}, "needs one of `column`", "column"),
        ({"signals": {"yaw_rad": {"column": "a", "field": "b"}}}, "`field` without a `topic`", "topic"),
        ({"signals": {"surge_m_s": {"columns": ["a", "b", "c", "d"]}}}, "four numbers of a quaternion", "`column`"),
        ({"signals": {"attitude": {"topic": "/a", "sign": -1}}}, "a quaternion has no sign", "frame"),
        ({"signals": {}}, "maps no signal", "yaw_rad: {column"),
        ({"time": {}, "signals": {"yaw_rad": 1}}, "`time` needs one of `column`", "`columns`"),
        ({"time": {"column": 0, "columns": [1, 2]}, "signals": {"yaw_rad": 1}}, "`time` needs one of `column`", "`columns`"),
        ({"time": {"columns": ["m", "s"]}, "signals": {"yaw_rad": 1}}, "which part of a clock", "unit: mm+ss"),
        ({"time": {"columns": ["m", "s"], "unit": "mm"}, "signals": {"yaw_rad": 1}}, "which part of a clock", "unit: mm+ss"),
        ({"time": {"columns": [0, 1, 2], "unit": "h+m+s"}, "signals": {"yaw_rad": 1}}, "which part", "[0, 1, 2], unit: hh+mm+ss"),
        ({"signals": [1, 2]}, "`signals` is not valid", "correct"),
        ({}, "lacks `signals`", "signals"),
        ({"signals": {"yaw_rad": 1}, "clock": "yaw_rate_rad_s"}, "`clock` names a signal that is not mapped", "yaw_rad"),
        ({"signals": {"yaw_rad": 1}, "schema": "fieldsid/model/1"}, "`schema` is not valid", "correct"),
    ],
)
def test_a_wrong_mapping_is_refused_with_its_place_and_what_was_meant(body, what, hint):
    with pytest.raises(MappingError) as error:
        mapping_of(body)
    assert what in error.value.what
    assert hint in error.value.hint
    assert error.value.found


def test_a_file_that_is_no_yaml_or_not_there_is_refused(tmp_path):
    path = tmp_path / "m.yaml"
    with pytest.raises(ArtifactError, match="cannot be read"):
        load_mapping(path)
    path.write_text("signals: [1, 2")
    with pytest.raises(ArtifactError, match="not valid YAML"):
        load_mapping(path)


@pytest.mark.parametrize(
    ("text", "frame"),
    [("ENU/FLU", Frame("ENU", "FLU")), ("ned", Frame()), ("FLU", Frame("NED", "FLU")), ("ENU-FRD", Frame("ENU", "FRD"))],
)
def test_frames_are_named_by_world_and_body(text, frame):
    assert frame_of(text, "here") == frame


@pytest.mark.parametrize(
    ("text", "signal", "source"),
    [
        ("yaw_rad=heading:deg", "yaw_rad", Source(column="heading", unit="deg")),
        ("rudder_rad=8:deg", "rudder_rad", Source(column=8, unit="deg")),
        ("time=t", "time_s", Source(column="t")),
        (
            "yaw_rate_rad_s=/imu/data.angular_velocity.z:rad/s",
            "yaw_rate_rad_s",
            Source(topic="/imu/data", path="angular_velocity.z", unit="rad/s"),
        ),
        ("attitude=/imu", "attitude", Source(topic="/imu")),
        ("thrust=a=b:N", "thrust", Source(column="a=b", unit="N")),
    ],
)
def test_a_channel_option_maps_one_signal(text, signal, source):
    assert channel_of(text) == (signal, source)


@pytest.mark.parametrize(
    ("text", "hint"),
    [("yaw_rad", "--channel"), ("yaw_rad=", "--channel"), ("yaw=heading", "`yaw_rad`"), ("yaw_rad=h:furlong", "choose")],
)
def test_a_wrong_channel_option_says_what_to_write(text, hint):
    with pytest.raises(MappingError) as error:
        channel_of(text)
    assert hint in error.value.hint


keys = st.one_of(st.text(max_size=8), st.sampled_from(["signals", "frame", "time", "table", "column", "topic", "unit"]))
values = st.recursive(
    st.one_of(
        st.none(), st.booleans(), st.integers(), st.floats(allow_nan=False), st.text(max_size=8), st.sampled_from(sorted(SIGNALS))
    ),
    lambda inner: st.one_of(st.lists(inner, max_size=3), st.dictionaries(keys, inner, max_size=3)),
    max_leaves=8,
)


@given(st.dictionaries(keys, values, max_size=4))
def test_any_body_is_a_mapping_or_a_three_part_error(body):
    try:
        parts = (mapping_of(body).sources,)
    except FieldsidError as error:
        parts = (error.what, error.found, error.hint)
    assert all(parts)


@given(
    st.dictionaries(
        st.sampled_from(sorted(SIGNALS)), st.tuples(st.integers(0, 99), st.sampled_from(sorted(UNITS))), min_size=1, max_size=5
    )
)
def test_a_mapping_written_as_yaml_reads_back_the_same(tmp_path_factory, items):
    fitting = {s: (c, u) for s, (c, u) in items.items() if dimension_of(s) in (None, UNITS[u].dimension)}
    body = {"signals": {s: {"column": c, "unit": u} for s, (c, u) in fitting.items()} or {"yaw_rad": {"column": 1}}}
    path = tmp_path_factory.mktemp("m") / "mapping.yaml"
    path.write_text(to_yaml(body))
    assert load_mapping(path).sources == mapping_of(body).sources
