"""Write fin commands as a ROS 2 bag: each fin as std_msgs/Float64, and whether the autopilot steers as std_msgs/Bool.

The conditions to abort the playback are written first, as std_msgs/String.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path

from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from fieldsid.errors import ArtifactError
from fieldsid.numerics.arrays import FloatArray


def write_commands(
    path: Path,
    time: FloatArray,
    commands: Mapping[str, FloatArray],
    autopilot: FloatArray,
    *,
    conditions: str,
    force: bool = False,
) -> Path:
    """Write a bag folder (MCAP): commands (n,) about trim by topic, autopilot (n,) 0 or 1 on `/autopilot`, times (n,) in s.

    `conditions` is written on `/abort_conditions` before the first command.

    Raises ArtifactError when the folder exists and `force` is false, or cannot be written.
    """
    if path.exists() and not force:
        raise ArtifactError(f"`{path}` exists", found="a bag folder", hint="add `--force`, or name another output")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        work = Path(tempfile.mkdtemp(prefix=f".{path.name}.", dir=path.parent))
    except OSError as error:
        raise ArtifactError(
            f"`{path}` cannot be written: {error.strerror}", hint="choose a folder that can be written"
        ) from error
    try:
        _fill(work / path.name, time, commands, autopilot, conditions)
        if path.exists():
            shutil.rmtree(path)
        (work / path.name).replace(path)
    finally:
        shutil.rmtree(work, ignore_errors=True)
    return path


def _fill(path: Path, time: FloatArray, commands: Mapping[str, FloatArray], autopilot: FloatArray, conditions: str) -> None:
    store = get_typestore(Stores.ROS2_HUMBLE)
    float64, boolean, string = (store.types[f"std_msgs/msg/{name}"] for name in ("Float64", "Bool", "String"))
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        fins = [writer.add_connection(topic, float64.__msgtype__, typestore=store) for topic in commands]
        pilot = writer.add_connection("/autopilot", boolean.__msgtype__, typestore=store)
        abort = writer.add_connection("/abort_conditions", string.__msgtype__, typestore=store)
        writer.write(abort, 0, bytes(store.serialize_cdr(string(data=conditions), string.__msgtype__)))
        values = [v.tolist() for v in commands.values()]
        for t, is_steering, *angles in zip(time.tolist(), autopilot.tolist(), *values, strict=True):
            stamp = round(t * 1e9)
            for command, angle in zip(fins, angles, strict=True):
                writer.write(command, stamp, bytes(store.serialize_cdr(float64(data=angle), float64.__msgtype__)))
            writer.write(pilot, stamp, bytes(store.serialize_cdr(boolean(data=bool(is_steering)), boolean.__msgtype__)))
