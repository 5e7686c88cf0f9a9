"""Compare a ROS 2 bag with its metadata.yaml, which states the number of messages and the serialization of each topic."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import Any

from fieldsid.errors import FieldsidError
from fieldsid.logs.readers.bags.packets import Collector
from fieldsid.logs.run import Note
from fieldsid.records.reading import read_yaml

NAME = "metadata.yaml"


def check_against_metadata(path: Path, collector: Collector) -> None:
    """Note where a bag has fewer messages than the metadata.yaml in its folder, or the index of the bag, states.

    path: a bag's folder, or a file that is the only one of its bag.
    """
    stated: Mapping[str, int] = collector.expected
    source = "the index of the bag"
    file = (path if path.is_dir() else path.parent) / NAME
    if file.is_file():
        try:
            about = _stated_by(file, None if path.is_dir() else path.name)
        except FieldsidError as error:
            collector.notes.append(Note("metadata", f"`{file}` cannot be used: {error.what}", {"found": error.found}))
        else:
            stated, source = ({t: n for t, (n, _) in about.items()}, NAME) if about is not None else (stated, source)
            collector.notes += _other_serializations(about or {}, collector)
    collector.notes += _share_read(stated, source, collector)


def _stated_by(file: Path, only: str | None) -> dict[str, tuple[int, str]] | None:
    """Return the number of messages and the serialization that metadata.yaml states for each topic; raises FieldsidError.

    None where it describes more files than `only`, the one that is read.
    """
    body = read_yaml(file)
    try:
        about = body["rosbag2_bagfile_information"]
        names = [PurePosixPath(name).name for name in about["relative_file_paths"]]
        topics: list[Any] = [(t["topic_metadata"], t["message_count"]) for t in about["topics_with_message_count"]]
        found = {str(t["name"]): (int(count), str(t["serialization_format"])) for t, count in topics}
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise FieldsidError("it is no description of a bag", found=f"{type(error).__name__}: {error}") from error
    return found if only is None or names in ([only], [f"{only}.zstd"]) else None


def _other_serializations(about: Mapping[str, tuple[int, str]], collector: Collector) -> list[Note]:
    """Return notes on topics for which metadata.yaml and the file of the bag state different serializations."""
    notes = []
    for topic, (_, stated) in about.items():
        connection = collector.connections.get(topic)
        if connection is not None and topic in collector.packets and connection.serialization != stated:
            message = f"{topic}: {NAME} states messages in `{stated}`, the file itself in `{connection.serialization}`"
            notes.append(Note("serialization", message, {"topic": topic, "stated": stated, "found": connection.serialization}))
    return notes


def _share_read(stated: Mapping[str, int], source: str, collector: Collector) -> list[Note]:
    """Return the note on topics of which fewer messages were read than stated."""
    short = {t: (len(p.stamps), stated[t]) for t, p in collector.packets.items() if len(p.stamps) < stated.get(t, 0)}
    if not short:
        return []
    shares = [f"{got} of {count} on {topic} ({100 * got / count:.1f} %)" for topic, (got, count) in sorted(short.items())]
    message = f"fewer messages were read than {source} counts: {', '.join(shares)}"
    return [Note("incomplete", message, {topic: {"read": got, "of": count} for topic, (got, count) in short.items()})]
