"""The user's own effects: an Effect from a YAML file with a name, an expression for the moment, and its coefficients.

    name: tether_drag
    moment: "-k * r * abs(r)"
    coefficients: {k: {unit: 1/rad, low: 0, high: 20, start: 0.1}}
The moment (rad/s^2) is added to p', evaluated along the simulated motion. The file is data: nothing in it is executed.
"""

from __future__ import annotations

import keyword
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import count
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from fieldsid.effects._expression import FUNCTIONS, Expression, parse
from fieldsid.errors import ArtifactError, EffectError
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.definition import of_text
from fieldsid.models.effect import Coefficient, Effect, Motion, Stage, Values
from fieldsid.models.record import Record
from fieldsid.numerics.arrays import FloatArray
from fieldsid.records.reading import read_text, yaml_mapping
from fieldsid.registry import near

SIGNAL_OF: Mapping[str, str] = MappingProxyType(
    {
        "angle": "angle", "psi": "angle", "theta": "angle", "rate": "rate", "r": "rate", "q": "rate",
        "fin": "fin", "delta": "fin", "speed": "surge", "u": "surge", "roll": "roll", "phi": "roll",
        "depth": "depth", "z": "depth", "thrust": "thrust", "t": "time",
    }
)  # fmt: skip
"""The signal of each name in an expression; `t` counts from the run's first sample."""

ONE_AXIS: Mapping[str, Axis] = MappingProxyType({"r": Axis.YAW, "psi": Axis.YAW, "q": Axis.PITCH, "theta": Axis.PITCH})
CROSS_SPEED: Mapping[str, str] = MappingProxyType(
    {"v": "sway_coupling", "w": "heave_coupling", "cross": "sway_coupling` or `heave_coupling"}
)
"""Names of the cross speed, and the effect that has it as a state: the measured cross speed is an output and no input."""
ROLES = ("surge", "roll", "depth", "thrust")
KEYS = ("name", "says", "axes", "moment", "coefficients", "telltale", "excited_by", "mistaken_for", "source")
COEFFICIENT_KEYS = ("unit", "low", "high", "start", "scan", "step", "per_run", "says")
LONGEST_NAME, LONGEST_COEFFICIENT = 40, 60
SUFFIXES = (".yaml", ".yml")
RESERVED = ("none",)
"""Names that no effect can have: `sysid plan --separate none` means the model without an additional effect."""
MAX_MOMENT_RAD_S2 = 1e4
"""Moment above which the motion is diverging; moments of vehicles are about 10 rad/s^2 at most."""


@dataclass(frozen=True, slots=True)
class Moment:
    """The hook `moment` of a user's effect, which evaluates the expression along a motion."""

    effect: str
    expression: Expression

    def __call__(self, motion: Motion, values: Values, record: Record) -> FloatArray:
        """Return the moment (n,) rad/s^2; raises EffectError with time and value where it is NaN or above MAX_MOMENT_RAD_S2."""
        table = {n: _signal(SIGNAL_OF[n], motion, record) if n in SIGNAL_OF else values[n] for n in self.expression.names}
        moment = self.expression.at(table, record.time)
        bad = ~(np.abs(moment) <= MAX_MOMENT_RAD_S2)
        if bad.any():
            i = int(np.argmax(bad))
            at = ", ".join(f"{n} = {np.broadcast_to(v, moment.shape)[i]:.4g}" for n, v in sorted(table.items()))
            how = "is not a number" if np.isnan(moment[i]) else "grows without bound"
            raise EffectError(
                f"the moment of effect {self.effect!r} {how}: {moment[i]:.4g} rad/s^2 at t = {record.time[i]:.3f} s",
                found=f"`{self.expression.text}` with {at}",
                hint="narrow the coefficient's low and high, check its sign, or bound the term: `max(min(x, 1), -1)`",
            )
        return moment


def user_effect_files(folder: Path) -> list[Path]:
    """Return the YAML files of a folder in order, and the Python files unless the folder is a package; raises EffectError.

    The list is empty if there is no such folder. Python is not executed: `load_user_effect` raises an error that says what to do.
    """
    if not folder.is_dir():
        return []
    kinds = SUFFIXES if (folder / "__init__.py").exists() else (*SUFFIXES, ".py")
    try:
        return sorted(p for p in folder.iterdir() if p.suffix in kinds and not p.is_dir())
    except OSError as error:
        raise EffectError(
            f"the folder `{folder}` cannot be read: {error.strerror}", found=str(folder), hint=f"try `chmod u+rx {folder}`"
        ) from error


def load_user_effect(path: Path) -> Effect:
    """Return the effect of one YAML file; raises EffectError naming the file and the place."""
    if path.suffix not in SUFFIXES:
        raise EffectError(
            f"`{path}` is Python: only YAML is read from a folder, and no code is run",
            found=path.name,
            hint="make it a package with an entry point of the group `fieldsid.effects`, or write the moment as YAML",
        )
    try:
        text = read_text(path)
        return effect_of_text(text, path, origin=str(path))
    except ArtifactError as error:
        raise EffectError(error.what, found=error.found, hint=error.hint) from error


def effect_of_text(text: str, path: Path, *, origin: str) -> Effect:
    """Return the effect that a YAML text defines, with that text as its `definition`; raises EffectError naming the file."""
    try:
        return replace(effect_of(yaml_mapping(text, path), origin=origin), definition=of_text(text, path))
    except ArtifactError as error:
        raise EffectError(error.what, found=error.found, hint=error.hint) from error
    except EffectError as error:
        raise EffectError(f"`{path}`: {error.what}", found=error.found, hint=error.hint) from error


@lru_cache(maxsize=32)
def effect_of_definition(text: str, file: str) -> Effect:
    """Return the effect of a definition that a model keeps: its YAML text, and the file that had it; raises EffectError."""
    return effect_of_text(text, Path(file), origin=f"{file}, as the model holds it")


def possible_names(path: Path) -> set[str]:
    """Return the names under which a user may look for the effect of an unusable file: that of the file, and the one in it."""
    try:
        name = re.search(r"^name:[ \t]*['\"]?([A-Za-z]\w*)", read_text(path), re.MULTILINE)
    except ArtifactError:
        name = None
    return {path.stem} | ({name[1]} if name else set())


def effect_of(spec: Mapping[str, Any], *, origin: str) -> Effect:
    """Return the effect of a mapping with the keys of the module's example; raises EffectError."""
    _known_keys("an effect", spec, KEYS, required=("name", "moment", "coefficients"))
    name = checked_name(spec["name"])
    coefficients = _coefficients(spec["coefficients"])
    if not isinstance(spec["moment"], str):
        raise EffectError("`moment` must be text", found=repr(spec["moment"])[:60], hint='write `moment: "k * r * abs(phi)"`')
    expression = parse(spec["moment"], (*SIGNAL_OF, *CROSS_SPEED, *(c.name for c in coefficients)))
    _refuse_cross_speed(expression)
    unused = [c.name for c in coefficients if c.name not in expression.names]
    if unused:
        raise EffectError(f"coefficient `{unused[0]}` is not used", found=expression.text, hint="use it in `moment` or delete it")
    axes = _axes(spec.get("axes"), expression)
    _refuse_base_names(axes, coefficients)
    return Effect(
        name=name,
        says=str(spec.get("says", "a moment of the user's own")),
        stage=Stage.HYDRODYNAMICS,
        axes=axes,
        equation=f"p' += {expression.text} (p: the rate)",
        coefficients=coefficients,
        telltale=str(spec.get("telltale", "the residual moment moves with the expression")),
        excited_by=_words(spec, "excited_by", ("multisine", "zigzag", "square_pulses")),
        mistaken_for=_words(spec, "mistaken_for", ()),
        source=str(spec.get("source", origin)),
        needs=tuple(r for r in ROLES if r in {SIGNAL_OF.get(n) for n in expression.names}),
        moment=Moment(name, expression),
        origin=origin,
    )


def _signal(kind: str, motion: Motion, record: Record) -> FloatArray:
    simulated = {"angle": motion.angle, "rate": motion.rate, "fin": record.fin}
    if kind == "time":
        return np.asarray(record.time - record.time[0])
    return simulated[kind] if kind in simulated else record[kind]


def _axes(stated: object, expression: Expression) -> tuple[Axis, ...]:
    """Return the axes under the key `axes`, or without it those whose signals the expression uses; raises EffectError."""
    used = {ONE_AXIS[n] for n in expression.names if n in ONE_AXIS}
    if len(used) > 1:
        raise EffectError("the expression mixes yaw and pitch signals", found=expression.text, hint="use `angle`, `rate`")
    possible = tuple(used) or (Axis.YAW, Axis.PITCH)
    words = [stated] if isinstance(stated, str) else stated
    if words is None:
        return possible
    if not isinstance(words, list) or not words or any(w not in tuple(Axis) for w in words):
        raise EffectError("`axes` must list yaw, pitch or both", found=repr(stated), hint="write `axes: [yaw]`")
    axes = tuple(a for a in Axis if a in words)
    if not set(axes) <= set(possible):
        what = f"the expression has {possible[0].value} signals only, `axes` says {', '.join(axes)}"
        raise EffectError(what, found=expression.text, hint="use `angle` and `rate`")
    return axes


def _coefficients(table: object) -> tuple[Coefficient, ...]:
    if not isinstance(table, Mapping) or not table:
        raise EffectError(
            "`coefficients` must map each name to unit, low, high and start",
            found=repr(table)[:60],
            hint="write `coefficients: {k: {unit: 1/s^2, low: -5, high: 5, start: 0.1}}`",
        )
    return tuple(_coefficient(_name("coefficient", n, LONGEST_COEFFICIENT), body) for n, body in table.items())


def _coefficient(name: str, body: object) -> Coefficient:
    if name in SIGNAL_OF or name in CROSS_SPEED or name in FUNCTIONS:
        raise EffectError(f"coefficient `{name}` has the name of a signal or function", found=name, hint=f"call it `k_{name}`")
    if not isinstance(body, Mapping):
        raise EffectError(f"coefficient `{name}` must have unit, low, high and start", found=repr(body)[:60])
    _known_keys(f"coefficient `{name}`", body, COEFFICIENT_KEYS, required=("unit", "low", "high", "start"))
    low, high, start = (_number(name, k, body[k]) for k in ("low", "high", "start"))
    if not (low < high and low <= start <= high):
        raise EffectError(
            f"coefficient `{name}` needs low < high and start between them",
            found=f"low {low:g}, high {high:g}, start {start:g}",
            hint=f"write `low: {min(low, high):g}, high: {max(low, high):g}, start: {0.5 * (low + high):g}`",
        )
    scan = body.get("scan", [])
    return Coefficient(
        name,
        str(body["unit"]),
        low,
        high,
        start,
        scan=tuple(_number(name, "scan", v) for v in (scan if isinstance(scan, list) else [scan])),
        step=_number(name, "step", body.get("step", 1e-4)),
        per_run=body.get("per_run", False) is True,
        says=str(body.get("says", "")),
    )


def _number(name: str, key: str, value: object) -> float:
    if isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < 1e100:
        return float(value)
    raise EffectError(f"`{key}` of coefficient `{name}` must be a number", found=repr(value)[:60], hint=f"write `{key}: 0.1`")


def checked_name(value: object, taken: Collection[str] = ()) -> str:
    """Return an effect's name; raises EffectError for a name that is not allowed, with a hint that is not in `taken`."""
    name = _name("effect", value, LONGEST_NAME, taken)
    if name in RESERVED:
        what = f"`{name}` cannot be the name of an effect: it is what `sysid plan --separate` calls the plain model"
        raise EffectError(what, found=name, hint=f"call it `{name}_1`")
    return name


def _name(what: str, value: object, longest: int, taken: Collection[str] = ()) -> str:
    if not isinstance(value, str) or not re.fullmatch(rf"[a-z][A-Za-z0-9_]{{0,{longest - 1}}}", value):
        raise EffectError(
            f"the name of the {what} must be a small letter, then letters, digits and _, at most {longest}",
            found=repr(value)[:80],
            hint=f"call it `{name_like(value, taken)}`",
        )
    if keyword.iskeyword(value):
        what = f"`{value}` cannot be the name of the {what}: it is a word of Python's own"
        raise EffectError(what, found=value, hint=f"call it `{value}_1`")
    return value


def name_like(value: object, taken: Collection[str]) -> str:
    """Return an allowed name that is close to `value` and not in `taken`."""
    stem = re.sub(r"\W+", "_", str(value), flags=re.ASCII).strip("_0123456789").lower()
    stem = stem[: LONGEST_NAME - len("_99")].rstrip("_") or "tether_drag"
    names = (stem if i == 0 else f"{stem}_{i}" for i in count())
    return next(n for n in names if not keyword.iskeyword(n) and n not in RESERVED and n not in taken)


def _words(spec: Mapping[str, Any], key: str, default: tuple[str, ...]) -> tuple[str, ...]:
    value = spec.get(key, list(default))
    words = [value] if isinstance(value, str) else value
    if not isinstance(words, list) or any(not isinstance(w, str) for w in words):
        raise EffectError(f"`{key}` must be a list of names", found=repr(value)[:60], hint=f"write `{key}: [zigzag]`")
    return tuple(words)


def _known_keys(what: str, body: Mapping[str, Any], known: tuple[str, ...], *, required: tuple[str, ...]) -> None:
    for key in body:
        if key not in known:
            raise EffectError(f"{what} has no key `{key}`", found=", ".join(str(k) for k in body), hint=near(str(key), known))
    for key in required:
        if key not in body:
            found = ", ".join(str(k) for k in body) or "nothing"
            raise EffectError(f"{what} lacks `{key}`", found=found, hint="copy templates/effect.yaml")


def _refuse_cross_speed(expression: Expression) -> None:
    for name in sorted(expression.names & set(CROSS_SPEED)):
        raise EffectError(
            f"`{name}` cannot drive a moment: it is a motion of the hull's own, an output of a model and no input",
            found=expression.text,
            hint=f"leave it out and add the effect `{CROSS_SPEED[name]}`, which has it as a state",
        )


def _refuse_base_names(axes: tuple[Axis, ...], coefficients: tuple[Coefficient, ...]) -> None:
    taken = {n for axis in axes for n in (*NAMES[axis].base, NAMES[axis].trim_fin)}
    for c in coefficients:
        if c.name in taken:
            what = f"coefficient `{c.name}` has the name of a base parameter"
            raise EffectError(what, found=c.name, hint=f"call it `k_{c.name}`")
