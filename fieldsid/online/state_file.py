"""The state of a live estimate as a file, written repeatedly in full, so that a restarted program continues where it was."""

from __future__ import annotations

import json
from pathlib import Path

from fieldsid._version import __version__
from fieldsid.artifacts import write_text
from fieldsid.errors import ArtifactError, DataError, UsageError
from fieldsid.models.axis import Axis
from fieldsid.online.identifier import OnlineIdentifier
from fieldsid.online.progress import Watch
from fieldsid.records.check import check
from fieldsid.records.online import STATE
from fieldsid.records.reading import read_json, read_text

SCHEMA = "fieldsid/online/1"


def save_state(path: Path, identifier: OnlineIdentifier, watch: Watch, source: str) -> Path:
    """Write the states of an identifier and its watch, with the name of the source of the samples; raises ArtifactError."""
    states = {"state": identifier.state(), "watch": watch.state()}
    body = {"schema": SCHEMA, "tool": f"fieldsid {__version__}", "source": source, **states}
    return write_text(path, json.dumps(body, allow_nan=False), force=True)


def load_state(path: Path, axis: Axis, watch: Watch) -> tuple[OnlineIdentifier, str]:
    """Return the identifier of a state file and the name of the source of its samples; restore the watch in place.

    Raises ArtifactError for a file that is not a valid state, UsageError for a state of the other axis.
    """
    hint = "name another file with `--state`, or remove this one"
    try:
        body = read_json(read_text(path))
        if not isinstance(body, dict) or body.get("schema") != SCHEMA:
            raise ArtifactError(f"`{path}` is no state of `sysid live`", found=f"no `schema: {SCHEMA}`", hint=hint)
        check(body, STATE)
        identifier = OnlineIdentifier.from_state(body["state"])
        if identifier.axis is axis:
            watch.recall(body["watch"], axis)
    except (ValueError, DataError) as error:
        raise ArtifactError(f"`{path}` is no state of `sysid live`", found=str(error).splitlines()[0], hint=hint) from error
    if identifier.axis is not axis:
        raise UsageError(f"`{path}` is of {identifier.axis.value}, not {axis.value}", found=body["source"], hint=hint)
    return identifier, body["source"]
