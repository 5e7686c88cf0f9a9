"""Where live samples come from: messages in any unit, a CSV and a bag that grow, datagrams, a damaged line among them."""

from __future__ import annotations

import io
import json
import socket
import threading
import time as clock

import numpy as np
import pytest
from bags import MAPPING, write_bag
from online_flights import flown

from fieldsid.errors import DataError, UsageError
from fieldsid.logs.mapping.mapping_file import mapping_of
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.online.samples import LONGEST_LINE, MessageReader, Sample, samples_of
from fieldsid.online.sources import datagrams, followed, lines_of, replayed

HEAD = "time_s,yaw_deg,yaw_rate_rad_s,rudder_rad\n"


def rows(count=400):
    time, fin, angle, rate = flown(count=count)
    return [f"{t:.3f},{np.rad2deg(y):.6f},{r:.6f},{d:.4f}\n" for t, d, y, r in zip(time, fin, angle, rate, strict=True)]


def taken(source):
    return [s for s in source if s is not None]


def test_a_message_is_taken_in_any_unit_and_what_is_none_is_counted():
    reader = MessageReader(Axis.YAW)
    sample = reader.read(
        b'{"time_ms": 1500, "rudder_deg": 90, "yaw_rate_deg_s": 180, "surge_kn": 1, "battery": "low", "yaw_rad": null}'
    )
    assert sample is not None
    np.testing.assert_allclose(sample[:2] + sample[3:5], (1.5, np.pi / 2, np.pi, 1852 / 3600))
    assert np.isnan(sample.angle)
    assert reader.read(b"  ") is None
    assert reader.unreadable == 0
    told = (b'{"yaw_rad": 1}', b'{"time_s": "noon"}', b'{"time_s": NaN}', b'{"time_s": 1, "yaw_rad": "0.1"}')
    beyond = (b'{"time_s": 1, "yaw_rad": ' + b"9" * 400 + b"}", b'{"time_s": 1, "yaw_rad": 1e300}', b'{"time_s":' + b"[" * 9000)
    long = b'{"time_s": 1, "rudder_rad": 0}' + b" " * LONGEST_LINE
    wrong = (b"{", b"[1]", b"\xff\xfe", *told, *beyond, long)
    assert [reader.read(line) for line in wrong] == [None] * len(wrong)
    assert reader.unreadable == len(wrong)


def test_a_measured_fin_goes_straight_a_command_holds():
    assert MessageReader(Axis.YAW).read(b'{"time_s": 1, "rudder_rad": 0.1}').fin_is_held
    measured = MessageReader(Axis.YAW).read(b'{"time_s": 1, "rudder_rad": 0.1, "rudder_measured_rad": 0.05}')
    assert (measured.fin, measured.fin_is_held) == (0.05, False)


def test_a_stream_of_lines_ends_with_the_stream():
    lines = [json.dumps({"time_s": i, "rudder_rad": 0.0}).encode() for i in range(5)]
    stream = io.BytesIO(b"\n".join(lines))
    assert [s.time for s in taken(lines_of(stream, MessageReader(Axis.YAW)))] == [0.0, 1.0, 2.0, 3.0, 4.0]


def test_lines_that_cannot_be_read_are_counted_and_those_behind_them_are_read():
    good = b'{"time_s": 1, "rudder_rad": 0.1}\n'
    reader = MessageReader(Axis.YAW)
    stream = io.BytesIO(b"\xff\n" + b"x" * (10 * LONGEST_LINE) + b"\n" + good + b"9" * (3 * LONGEST_LINE))
    assert [s.time for s in taken(lines_of(stream, reader))] == [1.0]
    assert reader.unreadable == 3


@pytest.mark.parametrize("size", [1, 7, 31, 32, 33, 1 << 16])
def test_lines_are_the_same_whatever_pieces_they_come_in(size, monkeypatch):
    monkeypatch.setattr("fieldsid.online.sources.PIECE_BYTES", size)
    good = b'{"time_s": %d, "rudder_rad": 0.1}\n'
    reader = MessageReader(Axis.YAW)
    stream = io.BytesIO(good % 1 + b"\n" + b"x" * (3 * LONGEST_LINE) + b"\n" + good % 2 + (good % 3)[:-1])
    assert [s.time for s in taken(lines_of(stream, reader))] == [1.0, 2.0, 3.0]
    assert reader.unreadable == 1


def test_a_stream_that_breaks_is_one_that_ends():
    class Broken(io.BytesIO):
        def read1(self, *_size):
            raise OSError(5, "Input/output error")

    assert taken(lines_of(Broken(), MessageReader(Axis.YAW))) == []


def test_a_replay_keeps_the_logs_time_or_waits_for_nothing():
    run = Run("a", np.array([0.0, 0.5, 1.0]), {"rudder_rad": np.zeros(3), "yaw_rad": np.ones(3)})
    begin = clock.monotonic()
    assert len(taken(replayed(run, Axis.YAW, 5.0))) == 3
    assert 0.15 < clock.monotonic() - begin < 2.0
    assert [s.time for s in taken(replayed(run, Axis.YAW, float("inf"), after=0.2))] == [0.5, 1.0]


def test_a_run_without_fin_or_motion_is_refused():
    time = np.arange(3.0)
    with pytest.raises(DataError, match="no fin"):
        next(samples_of(Run("a", time, {"yaw_rad": time}), Axis.YAW))
    with pytest.raises(DataError, match="neither"):
        next(samples_of(Run("a", time, {"rudder_rad": time}), Axis.YAW))


def test_a_table_is_followed_as_it_grows_and_no_half_written_number_is_taken(tmp_path):
    path, written = tmp_path / "run.csv", rows()
    path.write_text(HEAD)

    def write():
        for i in range(0, 400, 40):
            with path.open("a") as stream:
                part = "".join(written[i : i + 40])
                stream.write(part[:-9])
                stream.flush()
                clock.sleep(0.1)
                stream.write(part[-9:])

    thread = threading.Thread(target=write)
    thread.start()
    got = taken(followed(path, None, Axis.YAW, idle_s=1.5))
    thread.join()
    assert [f"{s.time:.3f},{np.rad2deg(s.angle):.6f},{s.rate:.6f},{s.fin:.4f}\n" for s in got] == written


@pytest.mark.parametrize("kind", ["mcap", "db3"])
def test_a_bags_folder_is_followed_from_where_it_was(tmp_path, kind):
    time, fin, angle, rate = flown(count=200)
    signals = {"time_s": time, "rudder_rad": fin, "yaw_rad": angle, "yaw_rate_rad_s": rate}
    zero = np.zeros(200)
    from bags import WRITTEN

    whole = {**dict.fromkeys(WRITTEN, zero), **signals}
    path = write_bag(tmp_path / "bag", kind, whole)
    got = taken(followed(path, mapping_of(MAPPING), Axis.YAW, idle_s=0.2, after=5.0))
    assert len(got) == pytest.approx(99, abs=2)
    np.testing.assert_allclose([s.fin for s in got], np.interp([s.time for s in got], time, fin), atol=0.41)
    assert all(s.time > 5.0 for s in got)


def test_datagrams_are_taken_until_nothing_comes():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    got: list[Sample] = []
    thread = threading.Thread(target=lambda: got.extend(taken(datagrams(port, MessageReader(Axis.YAW), idle_s=1.0))))
    thread.start()
    clock.sleep(0.3)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for i in range(20):
            sender.sendto(json.dumps({"time_s": i * 0.1, "rudder_rad": 0.1, "yaw_rad": 0.0}).encode(), ("127.0.0.1", port))
        sender.sendto(b"noise", ("127.0.0.1", port))
    thread.join()
    assert [round(s.time, 1) for s in got] == [round(0.1 * i, 1) for i in range(20)]


def test_a_port_that_is_taken_is_said():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as first:
        first.bind(("127.0.0.1", 0))
        with pytest.raises(UsageError, match="cannot be had"):
            next(datagrams(first.getsockname()[1], MessageReader(Axis.YAW)))
