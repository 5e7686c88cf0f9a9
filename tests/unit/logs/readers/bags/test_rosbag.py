"""Bags of all three kinds: frames, stamps, rates, joints, pressure, own message types, and bags cut anywhere."""

import shutil
import sqlite3

import numpy as np
import pytest
from bags import EPOCH_NS, KINDS, MAPPING, BagWriter, write_bag
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fieldsid.errors import FieldsidError, LogError, MappingError
from fieldsid.logs import load_run
from fieldsid.logs.mapping.mapping_file import mapping_of

TIME = np.arange(300) / 20
SPIRAL = {
    "time_s": TIME,
    "yaw_rad": 0.5 + 0.6 * TIME,
    "pitch_rad": 0.2 * np.sin(TIME),
    "roll_rad": 0.1 * np.cos(TIME),
    "yaw_rate_rad_s": np.full(TIME.size, 0.6) + 0.01 * np.sin(TIME),
    "pitch_rate_rad_s": 0.2 * np.cos(TIME),
    "surge_m_s": 1.5 + 0.1 * np.sin(TIME),
    "sway_m_s": 0.1 * np.sin(2 * TIME),
    "heave_m_s": -0.05 * np.cos(TIME),
    "x_m": 3.0 * np.sin(0.6 * TIME),
    "y_m": -3.0 * np.cos(0.6 * TIME),
    "depth_m": 10.0 + np.sin(TIME),
    "rudder_rad": 0.2 * np.sign(np.sin(TIME + 0.01)),
    "elevator_rad": 0.1 * np.sign(np.cos(TIME + 0.01)),
}


@pytest.fixture(scope="module", params=KINDS)
def spiral(request, tmp_path_factory):
    return write_bag(tmp_path_factory.mktemp(request.param) / "spiral", request.param, SPIRAL)


def file_of(bag):
    return bag if bag.is_file() else next(p for p in bag.iterdir() if p.suffix in (".mcap", ".db3"))


def test_every_signal_comes_back_from_ros_frames_through_several_turns(spiral):
    run = load_run(spiral, mapping_of(MAPPING))
    np.testing.assert_array_equal(run.time, TIME)
    for name in SPIRAL.keys() - {"time_s", "yaw_rad"}:
        np.testing.assert_allclose(run[name], SPIRAL[name], atol=1e-12, err_msg=name)
    np.testing.assert_allclose(run["yaw_rad"], SPIRAL["yaw_rad"], atol=1e-12)


def test_a_bare_file_and_its_folder_are_the_same_log(spiral):
    a, b = load_run(spiral, mapping_of(MAPPING)), load_run(file_of(spiral), mapping_of(MAPPING))
    for name in a.signals:
        np.testing.assert_array_equal(a[name], b[name])


def test_a_bag_needs_a_mapping_and_says_how_to_get_one(spiral):
    with pytest.raises(MappingError, match="needs a mapping") as error:
        load_run(spiral)
    assert "--write-mapping" in error.value.hint
    assert "/odom" in error.value.found


@pytest.mark.parametrize("share", [0.3, 0.6, 0.97])
def test_a_cut_bag_gives_what_is_left_with_a_note(spiral, tmp_path, share):
    whole = file_of(spiral)
    cut = tmp_path / f"cut{whole.suffix}"
    cut.write_bytes(whole.read_bytes()[: int(share * whole.stat().st_size)])
    run = load_run(cut, mapping_of(MAPPING))
    assert "truncated" in {n.code for n in run.notes}
    assert 0.5 * share * TIME.size < len(run) <= TIME.size
    np.testing.assert_allclose(run["yaw_rate_rad_s"], SPIRAL["yaw_rate_rad_s"][: len(run)], atol=1e-12)


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(place=st.floats(0.0, 1.0), flip=st.booleans())
def test_a_bag_damaged_anywhere_is_read_as_far_as_it_goes_or_refused(spiral, tmp_path, place, flip):
    whole = file_of(spiral)
    raw = bytearray(whole.read_bytes())
    at = min(int(place * len(raw)), len(raw) - 1)
    if flip:
        raw[at : at + 16] = b"\xff" * len(raw[at : at + 16])
    hurt = tmp_path / f"hurt{whole.suffix}"
    hurt.write_bytes(bytes(raw) if flip else bytes(raw[:at]))
    try:
        parts = (len(load_run(hurt, mapping_of(MAPPING), salvage=True, max_gap_s=float("inf"))) >= 2,)
    except FieldsidError as error:
        parts = (error.what, error.found, error.hint)
    assert all(parts)


def write(path, kind, rows, **more):
    """Write (topic, type, make message from the bag, time in s) rows."""
    with BagWriter(path, kind, **more) as bag:
        for topic, type_name, make, t in rows:
            bag.write(topic, type_name, make(bag), EPOCH_NS + round(t * 1e9))
    return bag.path


def number(value):
    return lambda bag: bag.make("std_msgs/Float64", float(value))


def joint(names, values, t):
    def make(bag):
        empty = np.zeros(0)
        return bag.make(
            "sensor_msgs/JointState",
            bag.header(EPOCH_NS + round(t * 1e9)),
            list(names),
            np.array(values, dtype=float),
            empty,
            empty,
        )

    return make


@pytest.mark.parametrize("kind", KINDS)
def test_signals_of_several_rates_and_joints_by_name_come_to_one_clock(tmp_path, kind):
    rows = [("/heading", "std_msgs/msg/Float64", number(10 * k), 0.1 * k) for k in range(50)]
    rows += [
        ("/joints", "sensor_msgs/msg/JointState", joint(("fin_a", "rudder"), (0.0, 0.01 * k), 0.25 * k), 0.25 * k)
        for k in range(20)
    ]
    rows += [("/rudder", "std_msgs/msg/Float32", lambda bag: bag.make("std_msgs/Float32", 0.5), 1.0)]
    log = write(tmp_path / "bag", kind, sorted(rows, key=lambda r: r[3]))
    mapping = mapping_of({
        "signals": {
            "yaw_rad": {"topic": "/heading", "unit": "deg"},
            "rudder_measured_rad": {"topic": "/joints", "field": "position[rudder]"},
            "rudder_rad": {"topic": "/rudder", "sign": -1},
        }
    })  # fmt: skip
    run = load_run(log, mapping)
    np.testing.assert_allclose(run.time, 0.1 * np.arange(50), atol=1e-12)
    np.testing.assert_allclose(run["yaw_rad"], np.radians(10.0 * np.arange(50)), atol=1e-12)
    expected = np.where(run.time <= 4.75, 0.04 * run.time, np.nan)
    np.testing.assert_allclose(run["rudder_measured_rad"], expected, atol=1e-12)
    np.testing.assert_array_equal(run["rudder_rad"], np.where(run.time < 1.0 - 1e-9, np.nan, -0.5))


@pytest.mark.parametrize("kind", KINDS)
def test_a_pressure_is_a_depth(tmp_path, kind):
    def pressure(k):
        return lambda bag: bag.make(
            "sensor_msgs/FluidPressure", bag.header(EPOCH_NS + k * 10**8), 101325.0 + 1000.0 * 9.80665 * k, 0.0
        )

    log = write(tmp_path / "bag", kind, [("/p", "sensor_msgs/msg/FluidPressure", pressure(k), 0.1 * k) for k in range(20)])
    mapping = mapping_of({"frame": "ENU/FLU", "pressure": {"density": 1000.0}, "signals": {"depth_m": {"topic": "/p"}}})
    np.testing.assert_allclose(load_run(log, mapping)["depth_m"], np.arange(20.0), atol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("type_name", "path"),
    [
        ("PoseStamped", "pose.orientation"),
        ("PoseWithCovarianceStamped", "pose.pose.orientation"),
        ("QuaternionStamped", "quaternion"),
    ],
)
def test_attitude_comes_from_any_message_with_a_quaternion(tmp_path, kind, type_name, path):
    from bags import quaternion

    def stamped(k):
        def make(bag):
            q = bag.make("geometry_msgs/Quaternion", *map(float, quaternion(np.pi / 2 - 0.1 * k, 0.0, 0.0)))
            header = bag.header(EPOCH_NS + k * 10**8)
            if type_name == "QuaternionStamped":
                return bag.make(f"geometry_msgs/{type_name}", header, q)
            pose = bag.make("geometry_msgs/Pose", bag.make("geometry_msgs/Point", 0.0, 0.0, 0.0), q)
            if "Covariance" in type_name:
                pose = bag.make("geometry_msgs/PoseWithCovariance", pose, np.zeros(36))
            return bag.make(f"geometry_msgs/{type_name}", header, pose)

        return make

    log = write(tmp_path / "bag", kind, [("/q", f"geometry_msgs/msg/{type_name}", stamped(k), 0.1 * k) for k in range(80)])
    run = load_run(log, mapping_of({"frame": "ENU/FLU", "signals": {"yaw_rad": {"topic": "/q", "field": path}}}))
    np.testing.assert_allclose(run["yaw_rad"], 0.1 * np.arange(80), atol=1e-12)
    assert set(run.signals) == {"yaw_rad"}
    whole = load_run(log, mapping_of({"frame": "ENU/FLU", "signals": {"attitude": {"topic": "/q"}}}))
    assert set(whole.signals) == {"yaw_rad", "pitch_rad", "roll_rad"}


OWN = {
    "my_auv/msg/Fins": "uint32 id\nstring mode\nfloat32[2] angles\nmy_auv/Inner[] inner\n",
    "my_auv/msg/Inner": "float64 rate\n",
}


def fins(k):
    def make(bag):
        inner = [bag.make("my_auv/Inner", 0.5 * k), bag.make("my_auv/Inner", -0.25 * k)]
        return bag.make("my_auv/Fins", k, "auto" if k % 2 else "hand", np.array([0.0, k / 4], dtype=np.float32), inner)

    return make


OWN_MAPPING = {
    "signals": {
        "rudder_measured_rad": {"topic": "/fins", "field": "angles[1]"},
        "yaw_rate_rad_s": {"topic": "/fins", "field": "inner[1].rate", "sign": -1},
    }
}


@pytest.mark.parametrize("kind", KINDS)
def test_an_own_type_is_read_by_the_definition_in_the_bag(tmp_path, kind):
    log = write(tmp_path / "bag", kind, [("/fins", "my_auv/msg/Fins", fins(k), 0.1 * k) for k in range(20)], types=OWN)
    run = load_run(log, mapping_of(OWN_MAPPING))
    np.testing.assert_allclose(run["rudder_measured_rad"], np.arange(20) / 4)
    np.testing.assert_allclose(run["yaw_rate_rad_s"], np.arange(20) / 4)


def late_imu(k, *, late):
    def make(bag):
        none = np.zeros(9)
        turn = bag.make("geometry_msgs/Quaternion", 0.0, 0.0, 0.0, 1.0)
        rates, up = bag.vector(0, 0, 0.1 * k), bag.vector(0, 0, 9.8)
        header = bag.header(EPOCH_NS + k * 10**8 - round(late * 1e9))
        return bag.make("sensor_msgs/Imu", header, turn, none, rates, none, up, none)

    return make


def imu_log(tmp_path, late):
    rows = [("/imu", "sensor_msgs/msg/Imu", late_imu(k, late=late), 0.1 * k) for k in range(30)]
    rows += [("/rudder", "std_msgs/msg/Float64", number(k), 0.1 * k) for k in range(30)]
    return write(tmp_path / "bag", "mcap", rows)


IMU = {"yaw_rate_rad_s": {"topic": "/imu", "field": "angular_velocity.z"}, "rudder_rad": {"topic": "/rudder"}}


def test_header_stamps_are_used_and_their_delay_is_noted(tmp_path):
    run = load_run(imu_log(tmp_path, 0.04), mapping_of({"signals": IMU}))
    note = next(n for n in run.notes if n.code == "stamp_latency")
    assert note.data["seconds"] == pytest.approx(0.04)
    assert np.isnan(run["rudder_rad"][0])
    assert run["rudder_rad"][1] == 0.0


def test_receive_stamps_are_used_on_request(tmp_path):
    run = load_run(imu_log(tmp_path, 0.04), mapping_of({"stamp": "receive", "signals": IMU}))
    np.testing.assert_array_equal(run["rudder_rad"], np.arange(30.0))


def test_two_clocks_in_one_bag_are_refused(tmp_path):
    log = imu_log(tmp_path, 1000.0)
    with pytest.raises(MappingError, match="on another clock") as error:
        load_run(log, mapping_of({"signals": IMU}))
    assert "stamp: receive" in error.value.hint
    assert len(load_run(log, mapping_of({"stamp": "receive", "signals": IMU}))) == 30


def test_a_header_that_is_not_there_cannot_be_insisted_on(tmp_path):
    with pytest.raises(MappingError, match="no header stamps"):
        load_run(imu_log(tmp_path, 0.0), mapping_of({"signals": {"rudder_rad": {"topic": "/rudder", "stamp": "header"}}}))


def test_repeated_stamps_are_refused_and_left_out_when_salvaging(tmp_path):
    rows = [("/heading", "std_msgs/msg/Float64", number(k), 0.1 * min(k, 20)) for k in range(30)]
    log = write(tmp_path / "bag", "mcap", rows)
    mapping = mapping_of({"signals": {"yaw_rad": {"topic": "/heading"}}})
    with pytest.raises(LogError, match="time repeats in /heading"):
        load_run(log, mapping)
    assert len(load_run(log, mapping, salvage=True)) == 21


def test_a_split_recording_is_one_log(tmp_path):
    first = write(tmp_path / "a", "mcap", [("/h", "std_msgs/msg/Float64", number(k), 0.1 * k) for k in range(10)])
    second = write(tmp_path / "b", "mcap", [("/h", "std_msgs/msg/Float64", number(k), 0.1 * k) for k in range(10, 25)])
    folder = tmp_path / "both"
    folder.mkdir()
    shutil.copy(file_of(first), folder / "both_0.mcap")
    shutil.copy(file_of(second), folder / "both_1.mcap")
    run = load_run(folder, mapping_of({"signals": {"yaw_rate_rad_s": {"topic": "/h"}}}))
    np.testing.assert_array_equal(run["yaw_rate_rad_s"], np.arange(25.0))


@pytest.mark.parametrize("mode", ["FILE", "MESSAGE", "STORAGE"])
@pytest.mark.parametrize("plugin", ["MCAP", "SQLITE3"])
def test_compressed_ros_2_bags_are_read(tmp_path, mode, plugin):
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    if (mode, plugin) == ("STORAGE", "SQLITE3"):
        pytest.skip("SQLite has no compression of its own")
    store = get_typestore(Stores.ROS2_HUMBLE)
    writer = Writer(tmp_path / "bag", version=9, storage_plugin=StoragePlugin[plugin])
    writer.set_compression(CompressionMode[mode], CompressionFormat.ZSTD)
    with writer:
        link = writer.add_connection("/h", "std_msgs/msg/Float64", typestore=store)
        for k in range(30):
            writer.write(
                link,
                EPOCH_NS + k * 10**8,
                store.serialize_cdr(store.types["std_msgs/msg/Float64"](float(k)), "std_msgs/msg/Float64"),
            )
    run = load_run(tmp_path / "bag", mapping_of({"signals": {"yaw_rate_rad_s": {"topic": "/h"}}}))
    np.testing.assert_array_equal(run["yaw_rate_rad_s"], np.arange(30.0))


HEADINGS = {"signals": {"yaw_rate_rad_s": {"topic": "/h"}}}


def compressed_ros1(path, form, *, chunk_bytes=1 << 20):
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    writer = Writer(path)
    writer.set_compression(Writer.CompressionFormat[form])
    writer.chunk_threshold = chunk_bytes
    with writer:
        link = writer.add_connection("/h", "std_msgs/msg/Float64", typestore=store)
        for k in range(3000):
            message = store.types["std_msgs/msg/Float64"](float(k))
            writer.write(link, EPOCH_NS + k * 10**8, store.serialize_ros1(message, "std_msgs/msg/Float64"))
    return path


@pytest.mark.parametrize("form", ["BZ2", "LZ4"])
def test_compressed_ros_1_bags_are_read(tmp_path, form):
    run = load_run(compressed_ros1(tmp_path / "a.bag", form), mapping_of(HEADINGS))
    np.testing.assert_array_equal(run["yaw_rate_rad_s"], np.arange(3000.0))


@pytest.mark.parametrize("form", ["BZ2", "LZ4"])
@pytest.mark.parametrize("share", [0.3, 0.5, 0.8])
def test_a_cut_compressed_bag_gives_its_whole_chunks_and_says_what_the_last_one_lost(tmp_path, form, share):
    from rosbags.rosbag1 import Reader

    whole = compressed_ros1(tmp_path / "a.bag", form, chunk_bytes=1 << 13)
    with Reader(whole) as reader:
        chunks = sorted(reader.chunks.values(), key=lambda c: c.datapos)
        last = int(share * len(chunks))
        before = sum(sum(info.connection_counts.values()) for info in reader.chunk_infos[:last])
        end = chunks[last].datapos + chunks[last].datasize // 2
    cut = tmp_path / "cut.bag"
    cut.write_bytes(whole.read_bytes()[:end])
    run = load_run(cut, mapping_of(HEADINGS))
    np.testing.assert_array_equal(run["yaw_rate_rad_s"], np.arange(float(before)))
    assert any("is cut: 0 of its" in n.message for n in run.notes if n.code == "truncated")


def test_a_bag_of_one_block_that_is_cut_is_refused_with_what_was_lost(tmp_path):
    whole = compressed_ros1(tmp_path / "a.bag", "LZ4")
    cut = tmp_path / "cut.bag"
    cut.write_bytes(whole.read_bytes()[:5000])
    with pytest.raises(LogError, match="has no messages") as error:
        load_run(cut, mapping_of(HEADINGS))
    assert "the chunk at byte" in error.value.found
    assert "is cut: 0 of its" in error.value.found


def test_what_a_crash_left_in_the_write_ahead_log_is_read(tmp_path):
    log = file_of(write(tmp_path / "bag", "db3", [("/h", "std_msgs/msg/Float64", number(k), 0.1 * k) for k in range(10)]))
    base = sqlite3.connect(log)
    base.execute("PRAGMA journal_mode=WAL")
    base.execute("PRAGMA wal_autocheckpoint=0")
    base.execute("INSERT INTO messages (topic_id, timestamp, data) SELECT topic_id, timestamp + 2000000000, data FROM messages")
    base.commit()
    crashed = tmp_path / "crashed"
    crashed.mkdir()
    for file in (log, log.with_name(log.name + "-wal")):
        shutil.copy(file, crashed / file.name)
    base.close()
    run = load_run(crashed / log.name, mapping_of({"signals": {"yaw_rate_rad_s": {"topic": "/h"}}}))
    assert len(run) == 20
    assert sorted(p.name for p in crashed.iterdir()) == [log.name, log.name + "-wal"]
