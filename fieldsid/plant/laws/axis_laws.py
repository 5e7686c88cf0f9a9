"""All laws of one axis over speed (`sysid fit`): fitted to points, saved and loaded as `fieldsid/fit/1`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any

import numpy as np

from fieldsid.artifacts import save_record
from fieldsid.display import Plotted
from fieldsid.errors import ArtifactError, DataError, UsageError
from fieldsid.logs.run import Note
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.model import KIND as MODEL_KIND
from fieldsid.models.model import Model, model_of
from fieldsid.numerics.arrays import FloatArray
from fieldsid.planning.whole_file import whole_file
from fieldsid.plant.laws.parameter_law import ParameterLaw, authority_law, other_law
from fieldsid.plant.laws.regression import Regression, regression_of
from fieldsid.plant.points import Point, check_authority, distinct_speeds
from fieldsid.records.check import ShapeError
from fieldsid.records.keys import Key, body_of
from fieldsid.records.laws import LARGEST_COEFFICIENT
from fieldsid.records.reading import load_record
from fieldsid.rounding import nine_digits

KIND = "fieldsid/fit"


@dataclass(frozen=True, slots=True, repr=False)
class Laws(Plotted):
    """The laws of one axis by parameter name, and the points that they were fitted to."""

    axis: Annotated[Axis, Key("The plane.")]
    points: Annotated[tuple[Point, ...], Key("What the laws were drawn through.")]
    by_name: Annotated[Mapping[str, ParameterLaw], Key("By parameter.", "laws")]
    notes: tuple[Note, ...] = ()

    @property
    def speed_low(self) -> Annotated[float, Key(name="speed_low_m_s")]:
        """Slowest point."""
        return float(self.speeds[0])

    @property
    def speed_high(self) -> Annotated[float, Key(name="speed_high_m_s")]:
        """Fastest point."""
        return float(self.speeds[-1])

    @property
    def warnings(self) -> Annotated[tuple[Note, ...], Key()]:
        """What to know before they are trusted."""
        return (*self.notes, *law_notes(self))

    @property
    def authority(self) -> ParameterLaw:
        """The law of the control authority."""
        return self.by_name[NAMES[self.axis].authority]

    @property
    def speeds(self) -> FloatArray:
        """Speeds of the points, (n,) m/s, rising."""
        return np.sort(np.array([p.speed for p in self.points]))

    def at(self, speed: float) -> dict[str, float]:
        """Return the parameters at a speed by the chosen laws."""
        return {n: float(law.at(speed)[0]) for n, law in self.by_name.items()}

    def std(self, speed: float) -> dict[str, float]:
        """Return the standard errors of the laws at a speed, by parameter name."""
        return {n: float(law.line.std(speed)[0]) for n, law in self.by_name.items()}


def fit_laws(axis: Axis, points: Sequence[Point], *, weighted: bool = True) -> Laws:
    """Fit the law of every parameter of an axis that is known at two speeds or more.

    `weighted`: the points are weighted by their standard errors where all of them have one; otherwise all weights are equal.
    Raises DataError when the sign of the authority differs between points.
    """
    points = tuple(sorted(points, key=lambda p: nine_digits(p.speed)))
    sign = check_authority(axis, points)
    laws, notes = {}, []
    for name in NAMES[axis].base:
        known = [p for p in points if name in p.values]
        if len(known) < 2 or distinct_speeds(np.array([p.speed for p in known])) < 2:
            continue
        speeds = np.array([p.speed for p in known])
        values = np.array([p.values[name] for p in known])
        errors = _errors(name, known) if weighted else None
        if errors is None and weighted:
            notes.append(
                Note("unweighted", f"{name}: not every point has a standard error, so all count alike", {"parameter": name})
            )
        labels = [p.name for p in known]
        if name == NAMES[axis].authority:
            laws[name] = authority_law(name, sign, speeds, values, errors, labels)
        else:
            laws[name] = other_law(name, speeds, values, errors, labels)
    return Laws(axis, points, MappingProxyType(laws), tuple(notes))


def with_own_law(laws: Laws, text: str) -> Laws:
    """Return the laws with one of them replaced by the user's `NAME=c0[,c1]`, which means c0 + c1 u^2; raises UsageError."""
    name, _, numbers = text.partition("=")
    try:
        coefficients = np.array([float(n) for n in numbers.split(",")])
    except ValueError as error:
        raise UsageError(
            f"`--law {text}` is not NAME=c0[,c1]", found=str(error), hint="write `--law a22=1` or `--law b2=-0.23,-0.33`"
        ) from error
    if not np.all(np.abs(coefficients) <= LARGEST_COEFFICIENT):
        raise UsageError(
            f"`--law {text}` is not a law of numbers that can be meant",
            found=f"{numbers}; numbers are at most {LARGEST_COEFFICIENT:g}",
            hint="write `--law a22=1` or `--law b2=-0.23,-0.33`",
        )
    if name not in NAMES[laws.axis].base or coefficients.size > 2:
        raise UsageError(f"`--law {text}` is not NAME=c0[,c1]", found=name, hint=f"names: {', '.join(NAMES[laws.axis].base)}")
    size = coefficients.size
    powers = (0.0, 2.0)[:size]
    line = Regression("affine" if size == 2 else "constant", powers, coefficients, np.zeros((size, size)), 0, float("nan"), 0.0)
    speeds = laws.speeds
    new = ParameterLaw(name, 1.0, speeds, np.asarray(line.at(speeds)), None, (line,), line.kind, None, ())
    base = laws.by_name.get(name, new)
    own = replace(base, sign=1.0, values=base.sign * base.values, candidates=(line,), chosen=line.kind, exponent=None, points=())
    return replace(laws, by_name=MappingProxyType({**laws.by_name, name: own}))


def law_notes(laws: Laws) -> tuple[Note, ...]:
    """Return the notes of every law, those on outliers first."""
    outliers = [
        Note(
            "does_not_belong",
            f"{law.name} of `{p.name}` ({p.value:.4g} at {p.speed:.2f} m/s) does not belong to the others' law "
            f"({p.predicted_without:.4g}): {p.studentised:+.1f} of its standard errors off (limit {p.limit:.1f} for "
            f"{len(law.points)} points)",
            {"point": p.name, "parameter": law.name},
        )
        for law in laws.by_name.values()
        for p in law.points
        if not p.belongs
    ]
    return (*outliers, *(n for law in laws.by_name.values() for n in law.notes))


def save_laws(laws: Laws, path: Path, *, models: Sequence[Path] = (), inputs: Sequence[Path] = (), force: bool = False) -> Path:
    """Write the laws as YAML, with the complete records of the models that they were fitted to; raises ArtifactError."""
    carried = [{"name": p.stem, "record": load_record(p, MODEL_KIND)} for p in models]
    return save_record(path, f"{KIND}/1", body_of(laws) | {"models": carried}, inputs=inputs, force=force)


def carried_models(path: Path) -> tuple[tuple[str, Model], ...]:
    """Return the models in a fit file with their names, none where the laws came from a table; raises ArtifactError.

    A file without the key `models` is refused, because the effects of its models would be lost without notice.
    """
    body = load_record(path, KIND)
    if "models" not in body:
        raise ArtifactError(
            f"`{path}` does not carry the models it was made from: their effects would be lost",
            found="no key `models`",
            hint="make it again: `sysid fit MODEL... -o " + f"{path} --force`",
        )
    return tuple((m["name"], model_of(m["record"], path)) for m in body["models"])


def load_laws(path: Path) -> Laws:
    """Read laws back; raises ArtifactError naming the key that is missing or wrong."""
    body = load_record(path, KIND)
    with whole_file(path, "fit file", "make it again: `sysid fit MODEL...`"):
        points = _points_of(body["points"])
        laws = {n: _law_of(n, r, points) for n, r in body["laws"].items()}
    return Laws(Axis(body["axis"]), points, MappingProxyType(laws))


def _points_of(records: Sequence[Mapping[str, Any]]) -> tuple[Point, ...]:
    points = tuple(
        Point(
            p["name"],
            float(p["speed_m_s"]),
            MappingProxyType({k: float(v) for k, v in p["values"].items()}),
            MappingProxyType({k: float(v) for k, v in p["std_errors"].items()}),
        )
        for p in records
    )
    if not points:
        raise ShapeError("`points` is empty: no law comes from none")
    return points


def _law_of(name: str, record: Mapping[str, Any], points: Sequence[Point]) -> ParameterLaw:
    known = [p for p in points if name in p.values]
    sign = float(record["sign"])
    if abs(sign) != 1.0:
        raise ShapeError(f"the sign of {name} is {sign:g}, not 1 or -1")
    lines = tuple(regression_of(c) for c in record["candidates"].values())
    values = sign * np.array([p.values[name] for p in known])
    speeds = np.array([p.speed for p in known])
    if record["chosen"] not in {line.kind for line in lines}:
        raise ShapeError(f"chosen law {record['chosen']!r} of {name} is not among its candidates")
    return ParameterLaw(name, sign, speeds, values, _errors(name, known), lines, str(record["chosen"]), None, ())


def _errors(name: str, points: Sequence[Point]) -> FloatArray | None:
    errors = [p.std_errors.get(name, float("nan")) for p in points]
    return np.array(errors) if bool(np.all(np.isfinite(errors))) and errors else None


def refuse_single_speed(axis: Axis, points: Sequence[Point]) -> None:
    """Raise DataError where points have one speed, through which no law against u^2 can be drawn."""
    speeds = np.array([p.speed for p in points])
    if distinct_speeds(speeds) > 1:
        return
    shown = "; ".join(f"at {p.speed:.3g} m/s " + ", ".join(f"{n} = {v:.4g}" for n, v in p.values.items()) for p in points)
    raise DataError(
        "one speed only: no law against u^2 can be drawn through a single point",
        found=shown,
        hint=f"use the point as it is, `sysid turn-radius` and `sysid schedule` take it; or fly two more speeds: "
        f"`sysid plan --axis {axis.value} --speeds {0.8 * speeds[0]:.2f},{speeds[0]:.2f},{1.2 * speeds[0]:.2f}`",
    )
