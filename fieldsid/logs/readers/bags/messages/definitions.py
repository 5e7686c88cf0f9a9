"""Find definitions of message types: in the bag, in a folder of .msg files, in ROS 2, or in folders near the bag."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

from rosbags.typesys import Stores, TypesysError, get_types_from_idl, get_types_from_msg, get_typestore

from fieldsid.errors import LogError
from fieldsid.logs.readers.bags.messages.message_layout import Decoder, types_in
from fieldsid.logs.readers.bags.packets import CDR, Connection
from fieldsid.logs.run import Note

Fields = dict[str, list[tuple[str, Any]]]
_IDL_RULE = "=" * 80 + "\n"
DEEPEST = 4
"""Depth of folders below a given one, or that of the bag, that are searched, as in `workspace/src/package/msg`."""
MOST_FOLDERS = 2000
"""Largest number of folders that are searched, so that a bag in a home folder does not start a search of all of it."""


@dataclass(frozen=True, slots=True)
class DefinitionSearch:
    """Where to search definitions that a bag lacks: near the log, and in the folder that the user names."""

    log: Path
    msg_path: Path | None = None


def decoder_of(connection: Connection, payload: bytes, search: DefinitionSearch) -> tuple[Decoder, Note | None]:
    """Return the decoder whose definitions fit a message of the connection, and a note where they are not those of the bag.

    Definitions are tried in this order: in the bag, in the folder that the user names, in ROS 2 (Humble), in files near the bag.
    Raises LogError when none fits or can be parsed, when two files near the bag differ, and when the named folder has none.
    """
    first: LogError | None = None
    for origin, fields in _sources(connection, search):
        try:
            decoder = _fitting(fields(), connection, payload)
        except LogError as error:
            first = first or error
            continue
        return decoder, None if first is None else _replaced(connection, first, origin)
    first = first or LogError(f"no definition of `{connection.type_name}`")
    file = f"{connection.type_name.rpartition('/')[2]}.msg"
    raise LogError(
        first.what, found=first.found, hint=f"give the folder of `{file}`: `sysid inspect {search.log} --msg-path DIR`"
    )


def _sources(connection: Connection, search: DefinitionSearch) -> Iterator[tuple[str, Any]]:
    """Yield the definitions to try, as functions that return them, each with its origin in words."""
    folder = _of_folder(search.msg_path, connection)

    def in_bag() -> Fields:
        return _parsed(connection.definition, connection.type_name, connection.language) if connection.definition else {}

    yield "the bag", lambda: {**_shipped(), **folder, **in_bag()}
    if folder:
        yield f"`--msg-path {search.msg_path}`", lambda: {**_shipped(), **folder}
    yield "ROS 2", _shipped
    near = (search.log if search.log.is_dir() else search.log.parent).resolve()
    for files in map(_msg_files, (near, near.parent)):
        file = _file_of(connection.type_name, files)
        if file is not None:
            _refuse_several(files, connection, search)
            yield f"`{file}`", lambda files=files: {**_shipped(), **_of_files(files, connection)}


def _fitting(known: Fields, connection: Connection, payload: bytes) -> Decoder:
    """Return the decoder by these definitions; raises LogError where they do not fit the message."""
    decoder = Decoder(known, connection.type_name, cdr=connection.serialization == CDR)
    decoder.layout(payload)
    return decoder


def _replaced(connection: Connection, error: LogError, origin: str) -> Note:
    message = f"{connection.topic}: {error.what}; the one of {origin} fits and is used"
    return Note("definition", message, {"topic": connection.topic, "found": error.found, "origin": origin})


@cache
def _shipped() -> Fields:
    return {name: list(fields) for name, (_, fields) in get_typestore(Stores.ROS2_HUMBLE).fielddefs.items()}


def _of_folder(folder: Path | None, connection: Connection) -> Fields:
    if folder is None:
        return {}
    files = _msg_files(folder)
    if not files:
        raise LogError(
            f"`--msg-path {folder}` holds no .msg files", found="none below it", hint="give the folder above `pkg/msg/*.msg`"
        )
    return _of_files(files, connection)


def _of_files(files: Sequence[Path], connection: Connection) -> Fields:
    """Return the definitions of the connection's type and of the types inside it, as far as there are files for them."""
    found: Fields = {}
    ahead = [connection.type_name]
    while ahead:
        name = ahead.pop()
        file = None if name in found else _file_of(name, files)
        if file is not None:
            found.update(_parsed(file.read_text(encoding="utf-8", errors="replace"), name, "msg"))
            ahead += types_in(found[name])
    return found


def _file_of(name: str, files: Sequence[Path]) -> Path | None:
    """Return the file of a type: in a folder of its package, else any with its short name; None without one."""
    package, _, short = name.partition("/msg/")
    named = [f for f in files if f.stem == short]
    return next((f for f in named if package in (f.parent.name, f.parent.parent.name)), named[0] if named else None)


@cache
def _msg_files(root: Path) -> tuple[Path, ...]:
    """Return the .msg files in a folder and the folders below it, within the limits DEEPEST and MOST_FOLDERS; none without it."""
    found: list[Path] = []
    for count, (folder, folders, names) in enumerate(os.walk(root)):
        if count >= MOST_FOLDERS:
            break
        below = len(Path(folder).relative_to(root).parts)
        folders[:] = sorted(f for f in folders if not f.startswith(".")) if below < DEEPEST else []
        found += [Path(folder) / name for name in sorted(names) if name.endswith(".msg")]
    return tuple(found)


def _refuse_several(files: Sequence[Path], connection: Connection, search: DefinitionSearch) -> None:
    """Raise LogError where two files near a bag define the type of the connection differently."""
    same_name = [f for f in files if f.stem == connection.type_name.rpartition("/")[2]]
    if len({f.read_text(encoding="utf-8", errors="replace") for f in same_name}) > 1:
        raise LogError(
            f"`{connection.type_name}` has {len(same_name)} definitions beside the bag that differ",
            found=", ".join(map(str, same_name)),
            hint=f"choose one: `sysid inspect {search.log} --msg-path {same_name[0].parent}`",
        )


@lru_cache(maxsize=256)
def _parsed(text: str, name: str, language: str) -> Fields:
    """Return a parsed definition, cached because topics share types and a log is read again with its mapping."""
    try:
        if language == "idl":
            types: dict[str, Any] = {}
            for part in text.split(_IDL_RULE):
                types.update(
                    get_types_from_idl(part.partition("\n")[2] if part.startswith("IDL: ") else part) if part.strip() else {}
                )
        else:
            types = dict(get_types_from_msg(text, name))
    except (TypesysError, RecursionError) as error:
        first = str(error).splitlines()[0][:120]
        raise LogError(
            f"the definition of `{name}` cannot be parsed", found=first, hint="give a clean one: `--msg-path DIR`"
        ) from error
    return {key: list(fields) for key, (_, fields) in types.items()}
