"""Logs of other programs' formats, written byte by byte: time and signals (n,) by canonical name, SI and NED."""

from __future__ import annotations

import struct

import scipy.io


def write_mat(path, time, signals):
    scipy.io.savemat(path, {"log": {"time_s": time, **signals}, "note": "by hand", "gain": 3.0})
    return path


def write_alog(path, time, signals, commands=((), ())):
    """A MOOS logger's file; angles in rad under names of our own. `commands` are times and angles of a rudder told by itself."""
    head = ["%" * 40, "%% LOG FILE:  ./pandan.alog", "%% FILE OPENED ON  Fri Mar  1 2024", "%% LOGSTART   1709287200.5"]
    lines = [
        f"{t!r:<16} {name:<20} pNav   {float(v[i])!r}" for i, t in enumerate(map(float, time)) for name, v in signals.items()
    ]
    lines += [f"{float(t)!r:<16} rudder_rad           pHelm  {float(v)!r}" for t, v in zip(*commands, strict=True)]
    lines.insert(5, f"{float(time[0])!r} DB_CLIENTS  MOOSDB pNav,pHelm")
    path.write_text("\n".join([*head, "%" * 40, *lines]) + "\n")
    return path


def write_ulog(path, time, signals, commands=((), ()), topic="trial", fields=""):
    """A PX4 file: one topic with a double for each signal, or of `fields`, and one of the rudder where it is told by itself."""

    def message(kind, body):
        return struct.pack("<HB", len(body), ord(kind)) + body

    fields = fields or "".join(f"double {name};" for name in signals)
    out = bytearray(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 10))
    out += message("B", bytes(40))
    out += message("F", f"{topic}:uint64_t timestamp;{fields}".encode())
    if len(commands[0]):
        out += message("F", b"command:uint64_t timestamp;double rudder_rad;")
        out += message("A", struct.pack("<BH", 0, 8) + b"command")
    out += message("A", struct.pack("<BH", 0, 7) + topic.encode())
    for t, value in zip(*commands, strict=True):
        out += message("D", struct.pack("<HQd", 8, round(t * 1e6) + 5_000_000, value))
    for i, t in enumerate(time):
        out += message("D", struct.pack(f"<HQ{len(signals)}d", 7, round(t * 1e6) + 5_000_000, *(v[i] for v in signals.values())))
    path.write_bytes(bytes(out))
    return path


def write_dataflash(path, time, signals, commands=((), ())):
    """An ArduPilot file: its formats, then a message `TRI` with a double for each signal; `CMD` of a rudder told by itself."""
    names = [f"S{k}" for k in range(len(signals))]

    def fmt(number, length, name, types, columns):
        return b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", number, length, name, types, columns)

    out = bytearray(fmt(128, 89, b"FMT", b"BBnNZ", b"Type,Length,Name,Format,Columns"))
    out += fmt(129, 11 + 8 * len(names), b"TRI", b"Q" + b"d" * len(names), ",".join(["TimeUS", *names]).encode())
    if len(commands[0]):
        out += fmt(130, 19, b"CMD", b"Qd", b"TimeUS,Rud")
    for t, value in zip(*commands, strict=True):
        out += b"\xa3\x95\x82" + struct.pack("<Qd", round(t * 1e6) + 5_000_000, value)
    for i, t in enumerate(time):
        out += b"\xa3\x95\x81" + struct.pack(f"<Q{len(names)}d", round(t * 1e6) + 5_000_000, *(v[i] for v in signals.values()))
    path.write_bytes(bytes(out))
    return path


IMC = """<?xml version="1.0" encoding="UTF-8"?>
<messages name="IMC" version="5.4.x">
  <header><field abbrev="sync" type="uint16_t" value="0xFE54" fixed="true"/></header>
  <message id="350" name="State" abbrev="EstimatedState"><field abbrev="lat" type="fp64_t"/>{fields}</message>
  <message id="281" name="Servo" abbrev="SetServomotorPosition">
    <field abbrev="id" type="uint8_t"/><field abbrev="value" type="fp64_t" unit="rad"/></message>
  <message id="1" name="Entity" abbrev="EntityState"><field abbrev="state" type="uint8_t"/><field abbrev="label"
    type="plaintext"/><field abbrev="after" type="uint8_t"/></message>
</messages>
"""
"""A definition as DUNE copies it, of three kinds of messages."""


def imc_message(kind, time, body, *, order="<", source=0x0015, entity=40):
    """One message with its checksum, which is worked out bit by bit."""
    out = struct.pack(f"{order}HHHdHBHB", 0xFE54, kind, len(body), time, source, entity, 0xFFFF, 255) + body
    crc = 0
    for byte in out:
        crc ^= byte
        for _ in range(8):
            crc = (crc >> 1) ^ 0xA001 if crc & 1 else crc >> 1
    return out + struct.pack(f"{order}H", crc)


def write_lsf(path, time, signals, commands=((), ()), *, servo="rudder_rad", order="<", start=1.7e9):
    """A DUNE log: the signals as doubles of the estimated state, a servo of number 2, and what the entities say.

    `commands` are times and angles of that servo where it is told by itself.
    """
    names = [n for n in signals if n != servo]
    out = bytearray(imc_message(1, start, bytes(9), order=order))
    for t, value in zip(*commands, strict=True):
        out += imc_message(281, start + t, struct.pack(f"{order}Bd", 2, value), order=order)
    for i, t in enumerate(start + time):
        out += imc_message(1, t, b"\x01" + struct.pack(f"{order}H", 4) + b"idle\x07", order=order)
        if servo in signals:
            for number, value in ((1, 0.0), (2, float(signals[servo][i]))):
                out += imc_message(281, t, struct.pack(f"{order}Bd", number, value), order=order)
        out += imc_message(350, t, struct.pack(f"{order}{1 + len(names)}d", 0.7, *(signals[n][i] for n in names)), order=order)
    path.write_bytes(bytes(out))
    fields = "".join(f'<field abbrev="{n}" type="fp64_t"/>' for n in names)
    (path.parent / "IMC.xml").write_text(IMC.format(fields=fields))
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
