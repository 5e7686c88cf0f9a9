"""Logs of other programs' formats, written byte by byte: time and signals (n,) by canonical name, SI and NED."""

from __future__ import annotations

import struct

import scipy.io


def write_mat(path, time, signals):
    scipy.io.savemat(path, {"log": {"time_s": time, **signals}, "note": "by hand", "gain": 3.0})
    return path


def write_alog(path, time, signals):
    """A MOOS logger's file; angles in rad under names of our own."""
    head = ["%" * 40, "%% LOG FILE:  ./pandan.alog", "%% FILE OPENED ON  Fri Mar  1 2024", "%% LOGSTART   1709287200.5"]
    lines = [
        f"{t!r:<16} {name:<20} pNav   {float(v[i])!r}" for i, t in enumerate(map(float, time)) for name, v in signals.items()
    ]
    lines.insert(5, f"{float(time[0])!r} DB_CLIENTS  MOOSDB pNav,pHelm")
    path.write_text("\n".join([*head, "%" * 40, *lines]) + "\n")
    return path


def write_ulog(path, time, signals):
    """A PX4 file: one topic `trial` with a double for each signal."""

    def message(kind, body):
        return struct.pack("<HB", len(body), ord(kind)) + body

    fields = "".join(f"double {name};" for name in signals)
    out = bytearray(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 10))
    out += message("B", bytes(40))
    out += message("F", f"trial:uint64_t timestamp;{fields}".encode())
    out += message("A", struct.pack("<BH", 0, 7) + b"trial")
    for i, t in enumerate(time):
        out += message("D", struct.pack(f"<HQ{len(signals)}d", 7, round(t * 1e6) + 5_000_000, *(v[i] for v in signals.values())))
    path.write_bytes(bytes(out))
    return path


def write_dataflash(path, time, signals):
    """An ArduPilot file: its formats, then one message `TRI` with a double for each signal."""
    names = [f"S{k}" for k in range(len(signals))]

    def fmt(number, length, name, types, columns):
        return b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", number, length, name, types, columns)

    out = bytearray(fmt(128, 89, b"FMT", b"BBnNZ", b"Type,Length,Name,Format,Columns"))
    out += fmt(129, 11 + 8 * len(names), b"TRI", b"Q" + b"d" * len(names), ",".join(["TimeUS", *names]).encode())
    for i, t in enumerate(time):
        out += b"\xa3\x95\x81" + struct.pack(f"<Q{len(names)}d", round(t * 1e6) + 5_000_000, *(v[i] for v in signals.values()))
    path.write_bytes(bytes(out))
    return path


def write_dbd(path, time, signals):
    """A glider's file with the list of its sensors inside: doubles, each written in every cycle."""
    names = ["m_present_time", *signals]
    lists = [f"s: T {i:4d} {i:4d} 8 {n} {'timestamp' if i == 0 else 'nodim'}" for i, n in enumerate(names)]
    state = (len(names) + 3) // 4
    head = [
        "dbd_label:    DBD(dinkum_binary_data)file", "encoding_ver:    5", "num_ascii_tags:    14", "all_sensors:    T",
        "the8x3_filename:    00010000", "full_filename:    pandan-2024-060-1-0", "filename_extension:    dbd",
        "mission_name:    PANDAN.MI", "fileopen_time:    Fri_Mar__1_10:00:00_2024", f"total_num_sensors:    {len(names)}",
        f"sensors_per_cycle:    {len(names)}", f"state_bytes_per_cycle:    {state}", "sensor_list_crc:    0A0B0C0D",
        "sensor_list_factored:    0", *lists,
    ]  # fmt: skip
    out = bytearray(("\n".join(head) + "\n").encode())
    out += b"sa" + struct.pack("<hfd", 0x1234, 123.456, 123456789.12345)
    bits = "10" * len(names) + "00" * (4 * state - len(names))
    flags = bytes(int(bits[i : i + 8], 2) for i in range(0, len(bits), 8))
    blank = struct.pack(f"<{len(names)}d", *([time[0] + 1e3] + [0.0] * len(signals)))
    out += b"d" + flags + blank
    for i, t in enumerate(time):
        out += b"d" + flags + struct.pack(f"<{len(names)}d", t + 1e3, *(v[i] for v in signals.values()))
    path.write_bytes(bytes(out + b"X"))
    return path
