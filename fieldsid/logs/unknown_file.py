"""Errors for a file that no reader takes: of this program, of a format without a reader, damaged, or a folder of logs."""

from __future__ import annotations

import re
import struct
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from shlex import quote
from types import MappingProxyType

from fieldsid.errors import LogError
from fieldsid.logs.few_of import few_of
from fieldsid.records.named_inputs import inputs_of

COPY_AGAIN = "where the vehicle's own file is larger, copy it again"
"""Hint for any log that holds less than it should."""

ULOG = b"ULog\x01\x12\x35"
DATAFLASH = b"\xa3\x95\x80"
ULOG_HEADER = struct.calcsize("<7sBQ")
"""Bytes of a ULog file's header: signature, version and time of the start."""
NO_READER = ", for which no reader is installed"
FOREIGN: Mapping[bytes, tuple[str, str]] = MappingProxyType(
    {
        b"\x89HDF": ("an HDF5 file" + NO_READER, "write a table from it"),
        b"PK\x03\x04": ("a ZIP file, as .xlsx and .npz are too" + NO_READER, "unpack it, or write a table from it"),
        b"BZh": ("a bzip2 file" + NO_READER, "unpack it: `bunzip2 -k {path}`"),
        b"\xfd7zXZ\x00": ("an xz file" + NO_READER, "unpack it: `unxz -k {path}`"),
        b"\x28\xb5\x2f\xfd": ("a zstd file" + NO_READER, "unpack it: `unzstd {path}`"),
        b"\x93NUMPY": ("a NumPy array" + NO_READER, "write a table with a header from it"),
        b"\x89PNG": ("a picture, not a log", ""),
        b"%PDF": ("a document, not a log", ""),
        b"\x7fELF": ("a program, not a log", ""),
    }
)
"""Binary formats by their signature: what they are, and how to obtain a log from them where that is possible."""
TABLE = "write a table from it, a column for each signal"
TEXTS: tuple[tuple[re.Pattern[str], str, str], ...] = (
    (re.compile(r"^[$!][A-Z]{2,}[A-Z0-9]*,"), "a log of NMEA 0183 sentences", TABLE),
    (re.compile(r"^\s*[{\[]\s*[\"{\[]"), "JSON, an object a line", "give it to `sysid live -`, or " + TABLE),
    (re.compile(r"^\s*<[?!\w]"), "XML, as GPX and KML are", TABLE),
    (re.compile(r"^\s*\(\d+\.\d+\)\s+\w+\s+[0-9A-F]+#"), "a log of a CAN bus, as NMEA 2000 is", "decode it first, and " + TABLE),
)
"""Text that is not a table, by the start of its lines: what it is, and how to obtain a log from it."""
READ_ELSEWHERE = (ULOG, DATAFLASH, b"MATLAB ", b"PAR1", b"SQLite format", b"\x89MCAP", b"#ROSBAG")
"""Signatures of the files that have a reader of their format."""

_OWN = re.compile(rb"^\s*\{?\s*[\"']?schema[\"']?\s*:\s*[\"']?(fieldsid/([a-z-]+)/\d+)", re.MULTILINE)
_HEAD = 4096


def head_of(path: Path) -> bytes:
    """Return the first bytes of a file; empty for a folder."""
    if path.is_dir():
        return b""
    with path.open("rb") as stream:
        return stream.read(_HEAD)


def unreadable(path: Path, what: str, error: Exception) -> LogError:
    """Return the error of a log that a library cannot read: `what` it is, and the message of the library."""
    return LogError(f"`{path}` is {what}", found=f"{type(error).__name__}: {error}"[:160], hint=COPY_AGAIN)


def is_text(path: Path) -> bool:
    """Return whether a file may be a text table: it has no known signature, and no zero bytes, or as many as UTF-16 has."""
    head = head_of(path)
    if head[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return True
    if head.startswith(tuple(FOREIGN)) or _is_read_elsewhere(head) or _OWN.search(head):
        return False
    return b"\x00" not in head[:512] or head[:512].count(b"\x00") > len(head[:512]) // 4


def known_text(path: Path, lines: Sequence[str]) -> LogError | None:
    """Return the error of a text that is of a known kind and not a table, by its lines; None where it is of no known kind."""
    seen = [line for line in lines if line.strip()]
    for begins, what, way in TEXTS:
        if seen and 2 * sum(begins.match(line) is not None for line in seen) > len(seen):
            return LogError(f"`{path}` is {what}, and no table", found=f"first line: {seen[0][:60]!r}", hint=way)
    return None


def is_glider_log(head: bytes) -> bool:
    """Return whether a file with this head is a binary log of a glider; its text form has another head and is read as a table."""
    return head.startswith(b"dbd_label:") and b"(dinkum_binary_data)" in head[:100]


def imc_order(head: bytes) -> str | None:
    """Return the byte order, as `struct` writes it, of an IMC log (DUNE, LSTS) from its first two bytes; None for another file.

    These bytes are the number 0xFE5n, for version 5.n of the protocol.
    """
    if len(head) < 2:
        return None
    low, high = sorted((head[0], head[1]))
    if high != 0xFE or low >> 4 != 5:
        return None
    return "<" if head[1] == high else ">"


def _is_read_elsewhere(head: bytes) -> bool:
    return head.startswith(READ_ELSEWHERE) or is_glider_log(head) or imc_order(head) is not None


def not_a_log(path: Path, suffixes: Sequence[str]) -> LogError:
    """Return the error of a file or folder that no reader takes; `suffixes` are those of the logs that can be read."""
    give = f"give a log: {', '.join(dict.fromkeys(suffixes))}"
    if path.is_dir():
        return _folder_error(path, suffixes, give)
    head, size = head_of(path), f"{path.stat().st_size} bytes"
    own = _OWN.search(head)
    if own is not None:
        return _own_file_error(path, own[1].decode(), own[2].decode(), give)
    if _is_read_elsewhere(head):
        return LogError(f"`{path}` starts as a log of another kind does, and is none", found=size, hint=COPY_AGAIN)
    for signature, (what, way) in FOREIGN.items():
        if head.startswith(signature):
            return LogError(f"`{path}` is {what}", found=size, hint=way.format(path=quote(str(path))) or give)
    return LogError(f"`{path}` is no log this program reads", found=f"{size} with no known signature", hint=give)


def own_kind(path: Path) -> str | None:
    """Return the kind of a file of this program, from its schema: "model", "fit" and so on; None for any other file."""
    try:
        found = _OWN.search(head_of(path)) if path.is_file() else None
    except OSError:  # the code that reads it reports the reason
        return None
    return None if found is None else found[2].decode()


def _own_file_error(path: Path, schema: str, kind: str, give: str) -> LogError:
    hints = {"mapping": f"give it beside the log: `--mapping {quote(str(path))}`", "model": _logs_hint(path) or give}
    article = "an" if kind[0] in "aeiou" else "a"
    what = f"`{path}` is {article} {kind} file of this program, not a log"
    return LogError(what, found=f"schema: {schema}", hint=hints.get(kind, give))


def _logs_hint(path: Path) -> str:
    logs = " ".join(quote(str(p)) for p in inputs_of(path))
    return f"give logs, such as those it was made from: `{logs}`" if logs else ""


def _folder_error(path: Path, suffixes: Sequence[str], give: str) -> LogError:
    names = sorted(p.name for p in path.iterdir())
    known = Counter(s for name in names for s in suffixes if name.endswith(s)).most_common(1)
    shown = few_of(names)
    hint = f"give the logs in it: `{quote(str(path))}/*{known[0][0]}`" if known else give
    return LogError(f"`{path}` is a folder, and no bag", found=f"it holds {shown or 'nothing'}", hint=hint)
