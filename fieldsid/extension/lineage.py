"""Where an extended model comes from: its parents with the error before and after each addition, their hashes checked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

from fieldsid.diagnosis.records import Errors, Pair
from fieldsid.display import Brief
from fieldsid.errors import ArtifactError
from fieldsid.extension.extend import Extension, Gain
from fieldsid.logs.run import Run
from fieldsid.models.model import KIND, Noise, load_model, save_model
from fieldsid.records.check import ShapeError, check
from fieldsid.records.keys import INLINE, Key, body_of
from fieldsid.records.model import EXTENSION
from fieldsid.records.named_inputs import beside, sha256_of, sha256_of_named
from fieldsid.records.reading import load_record

INTACT, CHANGED, MISSING = "intact", "changed", "missing"


@dataclass(frozen=True, slots=True, repr=False)
class Step(Brief):
    """One addition: what it changed, why it was kept, and the logs that are no longer what it was made from."""

    gain: Annotated[Gain, INLINE]
    kept_by: Annotated[str, Key("What it was kept for.")]
    changed_data: Annotated[tuple[str, ...], Key("Data files that have changed since.")] = ()


@dataclass(frozen=True, slots=True)
class Parent:
    """The file a model was made from: where it is now, and whether it is still as it was (`intact`, `changed`, `missing`)."""

    path: Annotated[Path, Key("Its file.")]
    sha256: Annotated[str, Key("The file's hash.")]
    state: Annotated[str, Key("Whether it is as it was when its child was made.", of=Literal["intact", "changed", "missing"])]


@dataclass(frozen=True, slots=True, repr=False)
class Generation(Brief):
    """One model of a line: its file, its effects, whether the file is as its child knew it, and how it came about."""

    path: Annotated[Path, Key("Its file.", "model")]
    effects: Annotated[tuple[str, ...], Key("Its effects.")]
    state: Annotated[
        str, Key("Whether the file is as it was when its child was made.", of=Literal["intact", "changed", "missing"])
    ]
    step: Annotated[Step | None, Key(is_inline=True, is_optional=True)]

    @property
    def added(self) -> Annotated[tuple[str, ...], Key()]:
        """The effects added to its parent; none for the first."""
        return () if self.step is None else self.step.gain.added


def kept_by(extension: Extension) -> str:
    """Return why an extension is kept: `unseen` data are predicted better, the `evidence` pays, or the user said `--keep`."""
    if not extension.pays:
        return "--keep"
    return "unseen" if extension.gain.unseen else "evidence"


def save_extension(
    extension: Extension,
    path: Path,
    *,
    parent: Path,
    training: Sequence[Run] = (),
    validation: Sequence[Run] = (),
    mapping: Path | None = None,
    force: bool = False,
) -> Path:
    """Write the extended model with its parent, errors before and after, and the hashes of the data; raises ArtifactError."""
    roles = [("training", r) for r in training] + [("validation", r) for r in validation]
    files = [(role, r.name, r.source) for role, r in roles if r.source is not None and r.source.exists()]
    body = {
        **body_of(extension.gain),
        "log_evidence": extension.evidence,
        "kept_by": kept_by(extension),
        "data": [{"run": n, "role": role, "path": str(p), "sha256": sha256_of(p)} for role, n, p in files],
    }
    model = replace(extension.model, info={**extension.model.info, "extension": body})
    return save_model(model, path, inputs=[p for _, _, p in files], mapping=mapping, parent=parent, force=force)


def save_steps(
    steps: Sequence[Extension], files: Sequence[Path], parent: Path, data: tuple[Sequence[Run], Sequence[Run]], *,
    mapping: Path | None = None, force: bool,
) -> None:  # fmt: skip
    """Write each step's model with the one before it as its parent; data: training and unseen runs, by a mapping if any.

    Raises ArtifactError.
    """
    training, unseen = data
    for step, file, before in zip(steps, files, [parent, *files], strict=False):
        save_extension(step, file, parent=before, training=training, validation=unseen, mapping=mapping, force=force)


def parent_of(path: Path) -> Parent | None:
    """Return the parent a model file names, None where it names none; raises ArtifactError.

    The parent is looked for where the file says, and beside the file itself: a folder may have been moved.
    """
    named = load_record(path, KIND).get("parent")
    if named is None:
        return None
    said, digest = Path(named["path"]), named["sha256"]
    trial = path.resolve().parent.parent
    places = [p for p in (said, path.parent / said.name) if beside([p], trial) is not None and not p.is_dir()]
    for place in places:
        if sha256_of_named(place) == digest:
            return Parent(place, digest, INTACT)
    return Parent(places[0], digest, CHANGED) if places else Parent(said, digest, MISSING)


def history_of(path: Path) -> tuple[Generation, ...]:
    """Return the line of a model from its oldest known ancestor on; raises ArtifactError where a file cannot be read.

    A parent that is missing ends the line: what its child knows of it is all that is said. No log is looked at before every
    model of the line has been read.
    """
    line: list[Generation] = []
    logs: dict[Path, list[tuple[Path, str]]] = {}
    place, state = path, INTACT
    while True:
        model = load_model(place)
        step, logs[place] = _step(place, model.info.get("extension"))
        line.append(Generation(place, model.effects, state, step))
        parent = parent_of(place)
        if parent is None:
            break
        if parent.state == MISSING:
            before = tuple(e for e in model.effects if step is None or e not in step.gain.added)
            line.append(Generation(parent.path, before, MISSING, None))
            break
        if parent.path.resolve() in {g.path.resolve() for g in line}:
            raise ArtifactError(f"`{place}` descends from itself", found=str(parent.path), hint="extend the oldest model again")
        place, state = parent.path, parent.state
    return tuple(_with_logs(g, logs.get(g.path, ())) for g in reversed(line))


def _with_logs(generation: Generation, logs: Sequence[tuple[Path, str]]) -> Generation:
    """Return a generation that knows which of its logs are no longer what they were."""
    trial = generation.path.resolve().parent.parent
    changed = tuple(str(path) for path, digest in logs if _differs(path, digest, trial))
    return generation if generation.step is None else replace(generation, step=replace(generation.step, changed_data=changed))


def _step(path: Path, body: Any) -> tuple[Step | None, list[tuple[Path, str]]]:
    """Return how a model was extended, and the logs it was made from with their hashes."""
    if body is None:
        return None, []
    try:
        check(body, EXTENSION, "info.extension")
    except ShapeError as error:
        raise ArtifactError(
            f"`{path}` does not say completely how it was extended",
            found=str(error),
            hint="extend its parent again, with `--force`",
        ) from error
    return Step(_gain(body), body["kept_by"]), [(Path(d["path"]), d["sha256"]) for d in body["data"]]


def _gain(body: Mapping[str, Any]) -> Gain:
    floor = body["noise_floor"]
    return Gain(
        added=tuple(str(n) for n in body["added"]),
        before=_pair(body["before"]),
        after=_pair(body["after"]),
        noise_floor=Noise(_number(floor["angle_rad"]), _number(floor["rate_rad_s"])),
        unseen=bool(body["unseen"]),
        learned_on=tuple(str(n) for n in body["learned_on"]),
        judged_on=tuple(str(n) for n in body["judged_on"]),
    )


def _differs(path: Path, digest: str, trial: Path) -> bool:
    return beside([path], trial) is not None and sha256_of_named(path) not in (None, digest)


def _pair(body: Mapping[str, Any]) -> Pair:
    sides = (body["train"], body["validation"])
    train, validation = (Errors(_number(s["angle_rms_rad"]), _number(s["rate_rms_rad_s"])) for s in sides)
    return Pair(train, validation)


def _number(value: float | None) -> float:
    return float("nan") if value is None else float(value)
