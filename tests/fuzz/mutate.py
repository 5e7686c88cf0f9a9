"""Ways to spoil a file: its bytes, the cells of a text, the nodes of a YAML file, the columns of Parquet, the cells of SQLite."""

from __future__ import annotations

import contextlib
import io
import json
import sqlite3
import tempfile
from collections.abc import Callable
from copy import deepcopy
from functools import lru_cache
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from ruamel.yaml import YAML

Spoil = Callable[[bytes, np.random.Generator], bytes]

ODD_WORDS = (
    b"", b"nan", b"-inf", b"1e400", b"-1", b"0", b"1e-320", b"99999999999999999999", b"0x1f", b"1,5", b"true", b"null", b"\x00",
    b"\xff\xfe", "\u00b0".encode(), b"-", b"--", b"2024-01-01", b"24:61:61", b'"', b"'", b"'''", b";", b"\t", b"\n", b"\r", b"#",
    b"~", b"[", b"{", b"A" * 300, b"-999", b"1_000", b"0.1.2", b"time_s", b"yaw_rad",
)  # fmt: skip
ODD_VALUES = (
    None, "", "x", "nan", -1, 0, 1, 2,
    1e308, -1e308, 1e-320, float("nan"), float("inf"), -float("inf"), True, False, [], {}, [[]],
    10**400, 1e6, -1e9, "\u202e", "0.97", "no",
    [None], [1, 2, 3], {"a": 1}, {"value": None}, [{}], 10**30, "1.5", "yaw", "pitch", b"\x00\x01", "A" * 300, 3.5, [0.0] * 9,
)  # fmt: skip


ENDS = ("\n", "\r", "\r\n", "\x0b", "\x0c", "\x1c", "\x85", "\u2028", "\u2029")
ODD_NAMES = (
    "SERVO1_MIN,500", "      fin_limit_rad: [9.0]", "Maximum Fin Angle = 9.0", "  ROW = kp=9.0", "[Control]", "}", "*/", "--]]",
    "os.exit()", "\x1b[31m", "\x1b]0;t\x07", "\x9b2J", "\u202egpj", "\x00", "\x7f", "[/s]", "[bold]", "[link=http:x]y", ":smile:",
    "\\[", "{{ 1 / 0 }}", "{%", "=1+1", "+1", "-1", "@x", "\t", "#", "//", "'", '"', "$(x)", "%s", "%(a)s", "A" * 300,
    "\u65e5\u672c", "\U0001f600", "e\u0301", "",
)  # fmt: skip
"""Names that mean something to a terminal, a vehicle's file, a template or a table; and ends of lines that bring them there."""


def odd_name(random: np.random.Generator) -> str:
    """Return a name of somebody else's: any letters, odd words and ends of lines in any order."""
    parts = [lambda: _pick(ODD_NAMES, random), lambda: _pick(ENDS, random), lambda: chr(int(random.integers(0, 0xD800)))]
    return "".join(parts[int(random.integers(0, 3))]() for _ in range(int(random.integers(1, 7))))


def _pick(words, random):
    return words[int(random.integers(0, len(words)))]


def spoil_names(data: bytes, random: np.random.Generator) -> bytes:
    """Give up to four of the words of a YAML file, and keys beside them, the names of somebody else."""
    yaml = YAML(typ="safe")
    body = yaml.load(data.decode())
    for _ in range(int(random.integers(1, 5))):
        words = [(parent, key) for parent, key in _places(body) if isinstance(parent[key], str) and key != "schema"]
        parent, key = words[int(random.integers(0, len(words)))]
        parent[key] = odd_name(random)
        if isinstance(parent, dict) and random.random() < 0.2:
            parent[odd_name(random)] = odd_name(random)
    stream = io.BytesIO()
    yaml.dump(body, stream)
    return stream.getvalue()


def spoil_heads(data: bytes, random: np.random.Generator) -> bytes:
    """Give up to three columns of a text table the names of somebody else, quoted as such a table has them."""
    head, _, rest = data.partition(b"\n")
    cells = head.decode().split(",")
    for _ in range(int(random.integers(1, 4))):
        at = int(random.integers(0, len(cells)))
        cells[at] = '"' + (cells[at] if random.random() < 0.5 else "").strip('"') + odd_name(random).replace('"', '""') + '"'
    return ",".join(cells).encode() + b"\n" + rest


def spoil_bytes(data: bytes, random: np.random.Generator) -> bytes:
    """Flip, set, cut, copy, insert or drop bytes at one to eight places."""
    out = bytearray(data)
    for _ in range(int(random.integers(1, 9))):
        at, length = (int(random.integers(0, max(len(out), 1))), int(2 ** random.uniform(0, 7)))
        match int(random.integers(0, 8)):
            case 0:
                out[at : at + 1] = bytes([out[at] ^ (1 << int(random.integers(0, 8)))]) if out else b"x"
            case 1:
                out[at : at + 1] = bytes([int(random.integers(0, 256))])
            case 2:
                out[at : at + length] = bytes(min(length, len(out) - at))
            case 3:
                out[at : at + length] = b"\xff" * min(length, len(out) - at)
            case 4:
                del out[at : at + length]
            case 5:
                out[at:at] = random.bytes(length)
            case 6:
                start = int(random.integers(0, max(len(out), 1)))
                out[at:at] = out[start : start + length]
            case _:
                if random.random() < 0.2:
                    del out[at:]
                else:
                    out[at : at + 4] = int(random.choice([0, 1, 2**31 - 1, 2**32 - 1, 255, 65536])).to_bytes(4, "little")
    return bytes(out)


def spoil_text(data: bytes, random: np.random.Generator) -> bytes:
    """Replace, drop, double or move whole cells and lines of a text; now and then its bytes as well."""
    lines = data.split(b"\n")
    for _ in range(int(random.integers(1, 6))):
        at = min(int(random.integers(0, 6)), len(lines) - 1) if random.random() < 0.4 else int(random.integers(0, len(lines)))
        match int(random.integers(0, 6)):
            case 0 | 1 | 2:
                mark = next((m for m in (b",", b";", b"\t", b":", b" ") if m in lines[at]), b" ")
                cells = lines[at].split(mark)
                cells[int(random.integers(0, len(cells)))] = ODD_WORDS[int(random.integers(0, len(ODD_WORDS)))]
                lines[at] = mark.join(cells)
            case 3:
                del lines[at]
            case 4:
                lines.insert(at, lines[int(random.integers(0, len(lines)))])
            case _:
                lines[at] = spoil_bytes(lines[at], random)
        lines = lines or [b""]
    return b"\n".join(lines)


def spoil_column(data: bytes, random: np.random.Generator) -> bytes:
    """Set a whole column of a text table to one odd word, to another column or to a step, or drop it."""
    rows = [line.split(b",") for line in data.split(b"\n")]
    width = len(rows[0])
    for _ in range(int(random.integers(1, 4))):
        column, other = (int(v) for v in random.integers(0, width, 2))
        kind, word = int(random.integers(0, 4)), ODD_WORDS[int(random.integers(0, len(ODD_WORDS)))]
        for i, row in enumerate(rows[1:] if random.random() < 0.8 else rows):
            if max(column, other) < len(row):
                row[column] = (word, row[other], row[column] if i % 2 else word, b"%d" % (i * 10 ** int(column)))[kind]
    return b"\n".join(b",".join(row) for row in rows)


def spoil_tree(body: object, random: np.random.Generator) -> None:
    """Replace, drop, double or rename one to three nodes of nested mappings and lists, in place."""
    for _ in range(int(random.integers(1, 4))):
        places = list(_places(body))
        if not places:
            return
        parent, key = places[int(random.integers(0, len(places)))]
        value = deepcopy(ODD_VALUES[int(random.integers(0, len(ODD_VALUES)))])
        match int(random.integers(0, 6)):
            case 0:
                del parent[key]
            case 1 if isinstance(parent, dict):
                parent[str(value)] = parent.pop(key)
            case 2 if isinstance(parent, list):
                parent.insert(key, parent[key])
            case 3:
                other, name = places[int(random.integers(0, len(places)))]
                held = other[name] if (name in other if isinstance(other, dict) else name < len(other)) else value
                parent[key] = json.loads(json.dumps(held, default=str))
            case _:
                parent[key] = value


def _places(body):
    if isinstance(body, (dict, list)):
        for key, value in list(body.items() if isinstance(body, dict) else enumerate(body)):
            yield body, key
            yield from _places(value)


def spoil_yaml(data: bytes, random: np.random.Generator) -> bytes:
    """Spoil nodes of a YAML file, written as a block or, most of the time, as JSON, which is YAML as well and done faster."""
    body = deepcopy(_loaded(data))
    spoil_tree(body, random)
    if random.random() < 0.7:
        return json.dumps(body, default=str).encode()
    stream = io.BytesIO()
    YAML(typ="safe").dump(body, stream)
    return stream.getvalue()


@lru_cache(maxsize=4)
def _loaded(data: bytes) -> object:
    return YAML(typ="safe").load(data.decode())


def spoil_json(data: bytes, random: np.random.Generator) -> bytes:
    """Spoil nodes of a JSON text."""
    body = json.loads(data)
    spoil_tree(body, random)
    return json.dumps(body, default=str).encode()


LONG_LINES = (b"[" * 20_000, b'{"a":' * 2_000, b"9" * 5_000, b"\xff" * 50, b'"\\ud800"', b"x" * 300_000, b"null", b"[]", b"{}")


def spoil_lines(data: bytes, random: np.random.Generator) -> bytes:
    """Spoil nodes of lines of JSON, or put a line that is none in their place."""
    lines = data.split(b"\n")
    for _ in range(int(random.integers(1, 4))):
        at = int(random.integers(0, len(lines)))
        if random.random() < 0.2:
            lines[at] = LONG_LINES[int(random.integers(0, len(LONG_LINES)))]
        elif lines[at].startswith(b"{"):
            with contextlib.suppress(ValueError, RecursionError):
                lines[at] = spoil_json(lines[at], random)
    return b"\n".join(lines)


def spoil_parquet(data: bytes, random: np.random.Generator) -> bytes:
    """Give columns of a Parquet file other types, names or lengths, and its metadata other values."""
    table = pq.read_table(io.BytesIO(data))
    names, columns = list(table.column_names), [c.combine_chunks() for c in table.columns]
    metadata = dict(table.schema.metadata or {})
    for _ in range(int(random.integers(1, 4))):
        at = int(random.integers(0, len(names)))
        match int(random.integers(0, 8)):
            case 0:
                names[at] = ("", "yaw_rad", names[0], "time_s", "None", "a b", "x.y", "yaw_deg")[int(random.integers(0, 8))]
            case 1 if len(names) > 1:
                del names[at], columns[at]
            case 2 | 3:
                metadata = _spoilt_metadata(metadata, random)
            case 4:
                rows = int(random.integers(0, 3))
                columns = [c[:rows] for c in columns]
            case _:
                columns[at] = _other_type(columns[at], random)
    stream = io.BytesIO()
    pq.write_table(pa.Table.from_arrays(columns, names=names).replace_schema_metadata(metadata), stream)
    return stream.getvalue()


def _spoilt_metadata(metadata, random):
    out = {}
    for key, text in metadata.items():
        try:
            body = json.loads(text)
        except ValueError:
            body = None
        if random.random() < 0.3 or not isinstance(body, dict):
            out[key] = spoil_bytes(text, random)
        else:
            spoil_tree(body, random)
            out[key] = json.dumps(body, default=str).encode()
    return out


def _other_type(column, random):
    n = len(column)
    makers = (
        lambda: pa.array([f"w{i}" for i in range(n)]),
        lambda: pa.array(["1.5"] * n).dictionary_encode(),
        lambda: pa.array([bool(i % 2) for i in range(n)]),
        lambda: pa.array(range(n), pa.timestamp("ns")),
        lambda: pa.array(range(n), pa.timestamp("us", tz="UTC")),
        lambda: pa.array(range(n), pa.duration("s")),
        lambda: pa.array(range(n), pa.date32()),
        lambda: pa.array(range(n), pa.time64("us")),
        lambda: pa.array([[float(i)] * (i % 3) for i in range(n)]),
        lambda: pa.array([{"a": float(i)} for i in range(n)], pa.struct([("a", pa.float64())])),
        lambda: pa.array([b"\x00\xff"] * n),
        lambda: pa.nulls(n),
        lambda: pa.array([None if i % 2 else float(i) for i in range(n)], pa.float64()),
        lambda: pa.array([i % 100 for i in range(n)], pa.int8()),
        lambda: pa.array([2**63 + i for i in range(n)], pa.uint64()),
        lambda: pa.array([None if i % 2 else i for i in range(n)], pa.int64()),
        lambda: pa.array(np.arange(n, dtype=np.float16)),
        lambda: pa.array([i * 1000 for i in range(n)], pa.int64()).cast(pa.decimal128(30, 3)),
        lambda: pa.array([[("k", 1.0)]] * n, pa.map_(pa.string(), pa.float64())),
        lambda: pa.array([float("inf")] * n),
        lambda: pa.array([1e308 * (-1) ** i for i in range(n)]),
    )
    return makers[int(random.integers(0, len(makers)))]()


def spoil_sqlite(data: bytes, random: np.random.Generator) -> bytes:
    """Put values of other types into cells of an SQLite file, drop rows, columns or tables."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "file.db3"
        path.write_bytes(data)
        with sqlite3.connect(path) as base:
            for _ in range(int(random.integers(1, 4))):
                _spoil_base(base, random)
        base.close()
        return path.read_bytes()


SQL_VALUES = (None, "", "x", b"", b"\x00\x01\x00\x00", b"\xff" * 40, -1, 0, 2**62, -(2**62), 1.5, float("inf"),
              "nav_msgs/msg/Odometry", "std_msgs/msg/String", "json", "cdr", "a/b/c/d", "\ud7ff", "A" * 300)  # fmt: skip


def _spoil_base(base, random):
    tables = [name for (name,) in base.execute("select name from sqlite_master where type = 'table'")]
    if not tables:
        return
    table = tables[int(random.integers(0, len(tables)))]
    columns = [row[1] for row in base.execute(f'pragma table_info("{table}")')]
    column = columns[int(random.integers(0, len(columns)))]
    match int(random.integers(0, 12)):
        case 0:
            base.execute(f'delete from "{table}" where rowid % 3 = 0')  # noqa: S608
        case 1 if random.random() < 0.3:
            base.execute(f'drop table "{table}"')
        case 2 if random.random() < 0.3:
            base.execute(f'alter table "{table}" rename column "{column}" to "other"')
        case 3 | 4:
            row = base.execute(f'select rowid, "{column}" from "{table}" order by random() limit 1').fetchone()  # noqa: S608
            if row and isinstance(row[1], bytes):
                base.execute(f'update "{table}" set "{column}" = ? where rowid = ?', (spoil_bytes(row[1], random), row[0]))  # noqa: S608
        case kind:
            value = SQL_VALUES[int(random.integers(0, len(SQL_VALUES)))]
            part = "" if kind < 8 else " where rowid % 2 = 0"
            try:
                base.execute(f'update "{table}" set "{column}" = ?{part}', (value,))  # noqa: S608
            except sqlite3.IntegrityError:
                return
