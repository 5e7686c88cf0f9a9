"""The JSON schemas of every command, made from the records that they return, and the page that lists them."""

from __future__ import annotations

import json
from functools import cache
from typing import Any

from guide.schema_of import schema_of_results
from jsonschema import Draft202012Validator

from fieldsid.online.look import Look
from fieldsid.records.keys import Result
from fieldsid.results import comparisons, diagnoses, effects, extensions, fits, gains, logs, plans, trial, turning

DIALECT = "https://json-schema.org/draft/2020-12/schema"
RESULTS: dict[str, tuple[type[Result], ...]] = {
    "init": (trial.Init,),
    "status": (trial.Status,),
    "report": (trial.Report,),
    "plan": (plans.Planned,),
    "inspect": (logs.Inspected,),
    "import": (logs.Import,),
    "identify": (fits.Identified,),
    "live": (Look,),
    "compare": (comparisons.Compared, comparisons.BeforeAfter, comparisons.ComparedSeveral, comparisons.AsPromised),
    "simulate": (logs.Simulation,),
    "diagnose": (diagnoses.Diagnosed,),
    "extend": (extensions.Extended, extensions.Undone),
    "history": (extensions.History,),
    "effects list": (effects.Catalogue,),
    "effects show": (effects.ShownEffect,),
    "effects new": (effects.NewEffect,),
    "fit": (turning.FittedLaws,),
    "turn-radius": (turning.TurnRadius,),
    "schedule design": (gains.Design,),
    "schedule verify": (gains.Verified,),
    "schedule export": (gains.Exported,),
    "batch": (trial.Batch,),
    "demo": (trial.Demo,),
    "guide": (trial.Contents, trial.Topic),
}
"""By command, what it prints with `--json`."""
INDEX = """# JSON schemas

Every command takes `--json` and then prints one JSON object on standard output. Its key `schema` names it and its version, such
as `fieldsid/identify/1`; within a version keys are added and none is taken away. Units are in the names; numbers are null where
they are not known. Each file below is a JSON Schema (draft 2020-12): every key with its type and what it means.

| command | object | schema |
|---|---|---|
"""


def file_of(command: str) -> str:
    """Return the name of a command's schema."""
    return f"{command.replace(' ', '-')}.json"


@cache
def schema_of(command: str) -> dict[str, Any]:
    """Return the JSON schema of what a command prints."""
    return {"$schema": DIALECT, "title": f"sysid {command} --json", **schema_of_results(RESULTS[command])}


def ids_of(command: str) -> set[str]:
    """Return the names of the objects a command prints."""
    return {d["properties"]["schema"]["const"] for d in _objects(schema_of(command)) if "schema" in d.get("properties", {})}


def command_of(body: dict[str, Any]) -> str:
    """Return the command that a JSON object is of."""
    (command,) = (c for c in RESULTS if body["schema"] in ids_of(c))
    return command


def faults(body: dict[str, Any], schema: dict[str, Any], *, closed: bool = False) -> list[str]:
    """Return where a JSON object differs from a schema; closed: a key the schema does not have is a fault too."""
    checked = _closed(schema) if closed else schema
    found = Draft202012Validator(checked).iter_errors(body)
    return [f"{e.json_path}: {e.message[:200]}" for e in found]


def required(schema: dict[str, Any], *path: str) -> set[str]:
    """Return the keys that are always there in the object at a path of keys; a list stands for its items."""
    here = schema
    for key in ("", *path):
        here = _followed(here["properties"][key] if key else here, schema)
    return set(here["required"])


def pages() -> dict[str, str]:
    """Return the schemas and the page that lists them, by path below `schemas/`."""
    rows = [
        f"| [{c}](../commands/{c.split()[0]}.md) | {', '.join(sorted(ids_of(c)))} | [{file_of(c)}]({file_of(c)}) |"
        for c in RESULTS
    ]
    schemas = {file_of(c): json.dumps(schema_of(c), indent=1) + "\n" for c in RESULTS}
    return {"index.md": INDEX + "\n".join(rows) + "\n", **schemas}


def _followed(schema: dict[str, Any], root: dict[str, Any]) -> dict[str, Any]:
    """Return the first object that a schema stands for: behind a reference, an alternative, a list or a mapping."""
    for key in ("$ref", "anyOf", "items", "additionalProperties"):
        if key in schema:
            inner = root["$defs"][schema[key].rpartition("/")[2]] if key == "$ref" else schema[key]
            return _followed(inner[0] if isinstance(inner, list) else inner, root)
    return schema


def _objects(schema: dict[str, Any]) -> list[dict[str, Any]]:
    return [schema, *schema.get("$defs", {}).values()]


def _closed(schema: Any) -> Any:
    if isinstance(schema, dict):
        inner = {k: _closed(v) for k, v in schema.items()}
        return inner | {"additionalProperties": False} if "properties" in schema else inner
    return [_closed(v) for v in schema] if isinstance(schema, list) else schema
