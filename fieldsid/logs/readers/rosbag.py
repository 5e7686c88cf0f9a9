"""Read ROS 1 and ROS 2 bags: .bag, .mcap and .db3, as a file or as the folder that ROS 2 writes.

Only the mapped topics are decoded, and of them only the mapped fields: see bags/message_layout.py.
"""

from __future__ import annotations

from pathlib import Path

from fieldsid.logs.channels import ChannelMap, TableForm
from fieldsid.logs.reader import Inventory, RawLog, Reader, ReadOptions
from fieldsid.logs.readers.bags.stores import SUFFIXES, collected, is_bag


def inventory(path: Path, options: ReadOptions, form: TableForm) -> Inventory:
    """Return the topics with type, count, rate, and the first, least and largest value of each of their numbers."""
    from fieldsid.logs.readers.bags.contents import Contents

    contents = Contents(path, options)
    return contents.inventory(collected(path, None, contents.settle, options.progress))


def read(path: Path, mapping: ChannelMap, options: ReadOptions) -> RawLog:
    """Return the mapped signals; raises MappingError for an unknown topic or field, LogError for an empty bag."""
    from fieldsid.logs.readers.bags.contents import read_signals

    return read_signals(path, mapping, options)


READER = Reader(
    name="rosbag",
    says="ROS 1 bag, ROS 2 mcap or db3, a file or a folder",
    suffixes=tuple(sorted(SUFFIXES)),
    sniff=is_bag,
    inventory=inventory,
    read=read,
)
