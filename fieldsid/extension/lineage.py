"""The ancestry of an extended model: its parents with the errors before and after each addition, and a check of their hashes.

And the modelling loop in one record: where the first model fails, which effects were added, and how the error fell with each.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import degrees
from pathlib import Path
from typing import Annotated, Any, Literal

from fieldsid.comparison.compare import Comparison
from fieldsid.comparison.localize import Place
from fieldsid.diagnosis.records import Errors, Pair
from fieldsid.display import Brief
from fieldsid.errors import ArtifactError
from fieldsid.extension.extend import Extension, Gain, whole_of
from fieldsid.logs.run import Run
from fieldsid.models.model import KIND, Noise, load_model, save_model
from fieldsid.numerics.arrays import known
from fieldsid.records.check import ShapeError, check
from fieldsid.records.keys import INLINE, Key, Number, body_of
from fieldsid.records.model import EXTENSION
from fieldsid.records.named_inputs import first_allowed, sha256_of, sha256_of_named
from fieldsid.records.reading import load_record
from fieldsid.rounding import MANY

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


def kept_by(extension: Extension, whole: Extension | None = None) -> str:
    """Return why an extension is kept: `unseen` data are predicted better, the `evidence` rises, or the user gave `--keep`.

    A step that does not pay by itself is kept for the `set` with it, `whole`, where that pays.
    """
    if not extension.pays:
        return "set" if whole is not None and whole.pays else "--keep"
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
    whole: Extension | None = None,
) -> Path:
    """Write the extended model with its parent, errors before and after, and the hashes of the data; raises ArtifactError.

    `whole` is the addition of all effects at once of which this is a step.
    """
    roles = [("training", r) for r in training] + [("validation", r) for r in validation]
    files = [(role, r.name, r.source) for role, r in roles if r.source is not None and r.source.exists()]
    body = {
        **body_of(extension.gain),
        "log_evidence": extension.evidence,
        "kept_by": kept_by(extension, whole),
        "data": [{"run": n, "role": role, "path": str(p), "sha256": sha256_of(p)} for role, n, p in files],
    }
    model = replace(extension.model, info={**extension.model.info, "extension": body})
    return save_model(model, path, inputs=[p for _, _, p in files], mapping=mapping, parent=parent, force=force)


def save_steps(
    steps: Sequence[Extension], files: Sequence[Path], parent: Path, data: tuple[Sequence[Run], Sequence[Run]], *,
    mapping: Path | None = None, force: bool,
) -> None:  # fmt: skip
    """Write the model of each step with that of the previous step as its parent; `data` are the training and unseen runs.

    Raises ArtifactError.
    """
    (training, unseen), whole = data, whole_of(steps)
    for step, file, before in zip(steps, files, [parent, *files], strict=False):
        save_extension(step, file, parent=before, training=training, validation=unseen, mapping=mapping, force=force, whole=whole)


def parent_of(path: Path) -> Parent | None:
    """Return the parent that a model file names, None where it names none; raises ArtifactError.

    The parent is looked for at the path in the file, and in the folder of the file, which may have been moved.
    """
    named = load_record(path, KIND).get("parent")
    if named is None:
        return None
    named_path, digest = Path(named["path"]), named["sha256"]
    trial = path.resolve().parent.parent
    places = [p for p in (named_path, path.parent / named_path.name) if first_allowed([p], trial) is not None and not p.is_dir()]
    for place in places:
        if sha256_of_named(place) == digest:
            return Parent(place, digest, INTACT)
    return Parent(places[0], digest, CHANGED) if places else Parent(named_path, digest, MISSING)


def history_of(path: Path) -> tuple[Generation, ...]:
    """Return the ancestors of a model, the oldest first, and the model itself; raises ArtifactError where one cannot be read.

    Where a parent is missing the line ends with an entry made of what its child records. The logs are hashed only after all
    models have been read.
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
    """Return a generation with the names of those of its logs that have changed."""
    trial = generation.path.resolve().parent.parent
    there = [(path, digest) for path, digest in logs if first_allowed([path], trial) is not None]
    changed = tuple(str(path) for path, digest in there if sha256_of_named(path) not in (None, digest))
    return generation if generation.step is None else replace(generation, step=replace(generation.step, changed_data=changed))


def _step(path: Path, body: Any) -> tuple[Step | None, list[tuple[Path, str]]]:
    """Return the step by which a model was extended, and the logs it was made from with their hashes."""
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
        noise_floor=Noise(known(floor["angle_rad"]), known(floor["rate_rad_s"])),
        unseen=bool(body["unseen"]),
        learned_on=tuple(str(n) for n in body["learned_on"]),
        judged_on=tuple(str(n) for n in body["judged_on"]),
    )


def _pair(body: Mapping[str, Any]) -> Pair:
    sides = (body["train"], body["validation"])
    train, validation = (Errors(known(s["angle_rms_rad"]), known(s["rate_rms_rad_s"])) for s in sides)
    return Pair(train, validation)


@dataclass(frozen=True, slots=True)
class LoopStep:
    """A model of the line: what was added, and its error over the noise floor on the runs fitted to and on unseen ones.

    In a log without noise the errors are over those of the first model; `says` has them in their units there.
    """

    added: Annotated[str, Key("What was added; of the first model its effects.")]
    fitted: Annotated[Number, Key("The error on the runs fitted to.")]
    unseen: Annotated[Number, Key("The error on unseen runs.")]
    says: tuple[str, str]


@dataclass(frozen=True, slots=True, repr=False)
class Loop(Brief):
    """The same run by the first model of a line and by its last, and the line."""

    before: Comparison
    after: Comparison
    line: tuple[Generation, ...]

    @property
    def run(self) -> Annotated[str, Key()]:
        """The run that it is shown on."""
        return self.before.run

    @property
    def start(self) -> str:
        """The first model in words."""
        return ", ".join(self.before.model.effects) or "plain model"

    @property
    def added(self) -> Annotated[tuple[str, ...], Key()]:
        """The effects that were added, in their order."""
        return tuple(name for g in self.line if g.step for name in g.step.gain.added)

    @property
    def where(self) -> Annotated[tuple[Place, ...], Key()]:
        """Where the worst channel of the first model fails, the most first."""
        return tuple(p for p in self.before.where if p.beyond > 0.0)

    @property
    def is_noiseless(self) -> bool:
        """Whether the log has no noise to which errors could be compared."""
        return self.before.over_noise >= MANY

    @property
    def steps(self) -> Annotated[tuple[LoopStep, ...], Key()]:
        """The errors before the first addition and after each."""
        gains = [g.step.gain for g in self.line if g.step]
        pairs = [(self.start, gains[0].before, gains[0].noise_floor)]
        pairs += [(f"+ {', '.join(g.added)}", g.after, g.noise_floor) for g in gains]
        return tuple(_loop_step(name, pair, floor, gains[0].before if self.is_noiseless else None) for name, pair, floor in pairs)

    def left_by(self, found: Comparison) -> str:
        """Return in words the error of one of the two models on the run."""
        if not self.is_noiseless:
            return f"error {found.over_noise:.2f} x the noise"
        worst_channel = next(c for c in found.channels if c.name == self.before.worst_channel.name)
        return f"{worst_channel.name} fit {worst_channel.fit:.1f} %"


def _loop_step(name: str, pair: Pair, floor: Noise, first: Pair | None) -> LoopStep:
    def side(errors: Errors, of: Errors | None) -> tuple[float, str]:
        over = errors.over(floor if of is None else Noise(of.angle_rms_rad, of.rate_rms_rad_s))
        return over, f"{over:.2f} x" if of is None else errors.sized("deg", degrees(1.0))

    fitted, fitted_says = side(pair.train, None if first is None else first.train)
    unseen, unseen_says = side(pair.validation, None if first is None else first.validation)
    return LoopStep(name, fitted, unseen, (fitted_says, unseen_says))


def loop_of(line: Sequence[Generation], first: Sequence[Comparison], last: Sequence[Comparison]) -> Loop | None:
    """Return the loop of a line from comparisons of its first and last model with the same runs; None without an extension.

    It is shown on the run with the largest error of the first model, if possible one to which the last was not fitted.
    """
    pairs = [(b, a) for b in first for a in last if a.run == b.run]
    unseen = [(b, a) for b, a in pairs if b.run not in a.model.runs]
    if not pairs or not any(g.step for g in line):
        return None
    before, after = max(unseen or pairs, key=lambda pair: pair[0].badness)
    return Loop(before, after, tuple(line))
