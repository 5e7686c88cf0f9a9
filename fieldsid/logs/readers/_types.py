"""Definitions of message types: from the bag, from a folder of .msg files, else those that ROS 2 ships."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from rosbags.typesys import Stores, TypesysError, get_types_from_idl, get_types_from_msg, get_typestore

from fieldsid.errors import LogError
from fieldsid.logs.readers._layout import Decoder
from fieldsid.logs.readers._packets import Link
from fieldsid.logs.run import Note

Fields = dict[str, list[tuple[str, Any]]]
_IDL_RULE = "=" * 80 + "\n"


def decoder_of(link: Link, payload: bytes, msg_path: Path | None) -> tuple[Decoder, Note | None]:
    """Return the decoder whose definitions fit a message of the link, and a note where they are not the bag's.

    The bag's own definitions count most, then the folder's, then those of ROS 2 (Humble). Raises LogError when none
    fits, none can be parsed, or the folder holds none.
    """
    folder, shipped = _of_folder(msg_path, link), _shipped()
    own = _parsed(link.definition, link.type_name, link.language) if link.definition else {}
    first: LogError | None = None
    for sources in ((own, folder), (folder,), ()):
        known: Fields = dict(shipped)
        for source in reversed(sources):
            known.update(source)
        decoder = Decoder(known, link.type_name, cdr=link.encoding == "cdr")
        try:
            decoder.layout(payload)
        except LogError as error:
            first = first or error
            continue
        return decoder, None if first is None else _replaced(link, first)
    raise first or LogError(f"no definition of `{link.type_name}`")


def _replaced(link: Link, error: LogError) -> Note:
    message = f"{link.topic}: {error.what}; the standard definition fits and is used"
    return Note("definition", message, {"topic": link.topic, "found": error.found})


@cache
def _shipped() -> Fields:
    return {name: list(fields) for name, (_, fields) in get_typestore(Stores.ROS2_HUMBLE).fielddefs.items()}


def _of_folder(folder: Path | None, link: Link) -> Fields:
    if folder is None:
        return {}
    files = sorted(folder.rglob("*.msg")) if folder.is_dir() else []
    if not files:
        raise LogError(
            f"`--msg-path {folder}` holds no .msg files", found="none below it", hint="give the folder above `pkg/msg/*.msg`"
        )
    found: Fields = {}
    for file in files:
        text = file.read_text(encoding="utf-8")
        for name in _names_of(file, link):
            found.update(_parsed(text, name, "msg"))
    return found


def _names_of(file: Path, link: Link) -> list[str]:
    """Return the type names a file may stand for: by its folders, and the link's type where the short name is the same."""
    folder = file.parent.parent if file.parent.name == "msg" else file.parent
    in_bag = [link.type_name] if link.type_name.rpartition("/")[2] == file.stem else []
    return list(dict.fromkeys([f"{folder.name}/msg/{file.stem}", *in_bag]))


def _parsed(text: str, name: str, language: str) -> Fields:
    try:
        if language == "idl":
            types: dict[str, Any] = {}
            for part in text.split(_IDL_RULE):
                types.update(
                    get_types_from_idl(part.partition("\n")[2] if part.startswith("IDL: ") else part) if part.strip() else {}
                )
        else:
            types = dict(get_types_from_msg(text, name))
    except TypesysError as error:
        first = str(error).splitlines()[0][:120]
        raise LogError(
            f"the definition of `{name}` cannot be parsed", found=first, hint="give a clean one: `--msg-path DIR`"
        ) from error
    return {key: list(fields) for key, (_, fields) in types.items()}
