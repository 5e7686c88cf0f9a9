"""The contract of a physical effect: all that a command may need to know of it, in one frozen record.

Signal path: command -> ACTUATOR -> fin angle -> HYDRODYNAMICS -> motion -> SENSOR -> measurement. The equations of motion are
those of models/hull.py. The initial cross state of a run is the one that a steady rate r0 before the run leads to; a rate that
never exceeded |r0| cannot have brought it further from zero.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np

from fieldsid.errors import EffectError, UsageError
from fieldsid.models.axis import Axis
from fieldsid.models.definition import NONE, Definition
from fieldsid.models.fin_path import FinPath
from fieldsid.models.hull import RISING, Core
from fieldsid.numerics.arrays import FloatArray
from fieldsid.records.keys import Key
from fieldsid.records.named_inputs import sha256_of
from fieldsid.registry import Outside, define, pick

if TYPE_CHECKING:
    from fieldsid.models.record import Record

Values = Mapping[str, float]
InitialGuesses = Callable[[Sequence["Record"], Sequence[FloatArray]], list[dict[str, float]]]
MomentHook = Callable[["Motion", Values, "Record"], FloatArray]


REGISTRY = "fieldsid.effects"
BOUND_SHARE = 1e-6
"""A coefficient counts as on a bound where its distance to it is below this share of the range between its bounds."""


class Stage(StrEnum):
    """Where in the signal path an effect acts."""

    ACTUATOR = "actuator"
    HYDRODYNAMICS = "hydrodynamics"
    SENSOR = "sensor"


@dataclass(frozen=True, slots=True)
class Coefficient:
    """One number of an effect: unit, bounds, start value, and the grid to scan where the cost is not smooth.

    `scan` lists the start values that are tried before the descent; `step` is the half width of the central difference. `per_run`
    marks a nuisance parameter (a phase, an event time): each run has its own value, which is fitted again on validation runs; its
    bounds are fractions of the run's length when `unit` is "run". `of_start` marks the initial value of a hidden state, whose
    influence soon dies out. `rate_exponent` is the power of the hull's characteristic rate (1/s) by which the points of the grid
    are multiplied: the coefficients of a slow hull are small.
    """

    name: Annotated[str, Key("Its name.")]
    unit: Annotated[str, Key("Its unit.")]
    low: Annotated[float, Key("Lower bound.")]
    high: Annotated[float, Key("Upper bound.")]
    start: Annotated[float, Key("Start value.")]
    scan: tuple[float, ...] = ()
    step: float = 1e-4
    rate_exponent: int = 0
    per_run: Annotated[bool, Key("Whether every run has its own.")] = False
    of_start: bool = False
    says: Annotated[str, Key("What it is.")] = ""


@dataclass(frozen=True, slots=True)
class Variant:
    """Another equation for an effect than the textbook's, described in a few words (`says`), with its additional coefficients.

    The effect's hooks compute the textbook equation where the values lack these coefficients. `initial_guesses` returns start
    values of the shared coefficients, from the residuals of the textbook variant, in place of their scan grids. `axes` are the
    axes of the variant and `needs` the signals it requires in addition to the effect's. `without` names coefficients of the
    effect that the variant does not have. `extra_states` replaces the effect's; None leaves them.
    """

    says: str
    coefficients: tuple[Coefficient, ...]
    initial_guesses: InitialGuesses | None = None
    axes: tuple[Axis, ...] = tuple(Axis)
    needs: tuple[str, ...] = ()
    without: tuple[str, ...] = ()
    extra_states: tuple[str, ...] | None = None


@dataclass(frozen=True, slots=True)
class Terms:
    """Time-varying parts that depend on measured signals only, each a factor or an addition per sample (n,).

    `damping_factor` and `authority_factor` multiply a(t) and b(t); `moment` (rad/s^2) is added to m(t);
    `damping` (1/s) is added to a(t) after the factor. `cross_factor` is g in the equation of the cross state: the speed at a
    sample over the speed of the run. None leaves the part unchanged.
    """

    damping_factor: FloatArray | None = None
    authority_factor: FloatArray | None = None
    moment: FloatArray | None = None
    damping: FloatArray | None = None
    cross_factor: FloatArray | None = None

    def combined_with(self, other: Terms) -> Terms:
        """Return the terms of two effects combined: the products of the factors, the sums of the additions."""
        return Terms(*(_combined(getattr(self, part), getattr(other, part), how) for part, how in TERM_PARTS.items()))


TERM_PARTS = dict(zip(Terms.__dataclass_fields__, (np.multiply, np.multiply, np.add, np.add, np.multiply), strict=True))
"""The operation that combines a part of two effects' terms, by the name of the part."""


def _combined(a: FloatArray | None, b: FloatArray | None, how: np.ufunc) -> FloatArray | None:
    if a is None or b is None:
        return a if b is None else b
    return np.asarray(how(a, b))


@dataclass(frozen=True, slots=True)
class Motion:
    """Simulated motion at the samples: angle (n,) rad, rate (n,) rad/s."""

    angle: FloatArray
    rate: FloatArray


@dataclass(frozen=True, slots=True)
class Effect:
    """One physical effect. It has only the hooks of its stage; a hook is a pure function.

    fin(path, values, record) -> FinPath                    actuator, applied in rising `order`
    terms(values, record) -> Terms                          hydrodynamics that are known before the integration
    slope(name, values, record) -> (n,) rad/s^2             optional, for terms that are a moment only: the derivative of that
                                                            moment by one coefficient; default: a difference quotient
    core(values, scale) -> Core                             hydrodynamics inside the core; scale = speed / reference speed
    moment(motion, values, record) -> (n,) rad/s^2          hydrodynamics evaluated along the last trajectory
    measure(motion, values, record) -> Motion               sensor
    sensor_jvp(moves, motion, values, record) -> (P, 2, n)  sensor, optional: the product of the Jacobian of `measure` with P
                                                            small changes `moves` (P, 2, n) of the motion; default: differences
    sensor_slope(name, motion, values, record) -> (2, n)    sensor, optional: the derivative of `measure` by one coefficient
    `needs` lists the roles that a log must have: surge, thrust, roll, depth.
    initial_guesses(records, residuals) returns start values of the shared coefficients from the residuals [(2, n)] of a fit
    without the effect; they are tried before those of the scan grid. equivalent_solution(values, axis) returns other values that
    have the same response at one speed, None where there are none.
    `variants` are other equations, tried where the textbook equation leaves a systematic residual. An effect in one of its
    variants has the textbook effect as its `textbook`; the textbook effect itself has None.
    `log_prior_penalty` is the log evidence that the effect must gain more than others do: because another effect explains the
    same more simply, or because its free event times let it fit almost anything.
    `heading_span` (rad) is the range that the headings of all runs must cover together before the effect can be distinguished
    from a moment in proportion to the heading. `origin` says where the effect is defined, `definition` says it in the form that
    a model keeps; None where it is built in.
    """

    name: Annotated[str, Key("Its name.")]
    says: Annotated[str, Key("What it is, in plain words.")]
    stage: Annotated[Stage, Key("Where in the signal path it acts.")]
    axes: Annotated[tuple[Axis, ...], Key("The planes it acts in.")]
    equation: Annotated[str, Key("Its equation.")]
    coefficients: Annotated[tuple[Coefficient, ...], Key("Its numbers.")]
    telltale: Annotated[str, Key("What its absence leaves in the residual.")]
    excited_by: Annotated[tuple[str, ...], Key("Maneuvers that show it, the best first.")]
    mistaken_for: Annotated[tuple[str, ...], Key("Effects it may be mistaken for.")]
    source: Annotated[str, Key("Where the equation comes from.")]
    needs: Annotated[tuple[str, ...], Key("Signals the log must have: surge, thrust, roll, depth.")] = ()
    extra_states: Annotated[tuple[str, ...], Key("States it adds to the model.")] = ()
    order: int = 0
    fin: Callable[[FinPath, Values, Record], FinPath] | None = None
    terms: Callable[[Values, Record], Terms] | None = None
    slope: Callable[[str, Values, Record], FloatArray] | None = None
    core: Callable[[Values, float], Core] | None = None
    moment: MomentHook | None = None
    measure: Callable[[Motion, Values, Record], Motion] | None = None
    sensor_jvp: Callable[[FloatArray, Motion, Values, Record], FloatArray] | None = None
    sensor_slope: Callable[[str, Motion, Values, Record], FloatArray] | None = None
    initial_guesses: InitialGuesses | None = None
    equivalent_solution: Callable[[Values, Axis], dict[str, float] | None] | None = None
    variants: tuple[Variant, ...] = ()
    log_prior_penalty: float = 0.0
    heading_span: float = 0.0
    textbook: Effect | None = None
    origin: Annotated[str, Key("`built in`, or the file of a user's own.")] = field(default="built in")
    definition: Definition | None = None

    @property
    def is_formed(self) -> bool:
        """Whether it has another equation than the textbook's."""
        return self.textbook is not None

    @property
    def stateless_variant(self) -> Variant | None:
        """Its variant without a cross state, which uses the cross state of another effect of the model; None if it has none."""
        return next((v for v in self.variants if self.extra_states and v.extra_states == ()), None)

    @property
    def limits_rate(self) -> bool:
        """Whether its textbook equation is a damping that grows with the rate."""
        textbook = self.textbook or self
        return textbook.bounds_rate(textbook.starts())

    def bounds_rate(self, values: Values) -> bool:
        """Whether its damping grows with the rate at these values, so that it bounds the rate of a hull with a22 < 0."""
        return self.core is not None and any(getattr(self.core(values, 1.0), name) > 0.0 for name in RISING)

    @property
    def shared(self) -> tuple[Coefficient, ...]:
        """The coefficients with one value for all runs."""
        return tuple(c for c in self.coefficients if not c.per_run)

    @property
    def nuisance(self) -> tuple[Coefficient, ...]:
        """The coefficients with a separate value for each run."""
        return tuple(c for c in self.coefficients if c.per_run)

    @property
    def all_coefficients(self) -> tuple[Coefficient, ...]:
        """The coefficients of the effect and of all its variants, each once."""
        return tuple({c.name: c for c in (*self.coefficients, *(c for v in self.variants for c in v.coefficients))}.values())

    @property
    def names(self) -> set[str]:
        """The names of the coefficients of the effect and of all its variants."""
        return {c.name for c in self.all_coefficients}

    def placed(self, outside: Outside) -> Effect:
        """Return the effect with another package as its origin; the registry calls this when it loads an entry point."""
        where = Path(outside.file)
        definition = Definition(
            outside.file,
            sha256_of(where) if where.is_file() else "",
            package=f"entry point `{outside.value}` of {outside.distribution}",
        )
        return replace(self, origin=definition.place, definition=definition)

    def starts(self) -> dict[str, float]:
        """Return the start value of every coefficient."""
        return {c.name: c.start for c in self.coefficients}


def with_variant(effect: Effect, variant: Variant) -> Effect:
    """Return an effect in one of its variants: with the variant's coefficients added and those of its `without` removed."""
    return replace(
        effect,
        coefficients=(*(c for c in effect.coefficients if c.name not in variant.without), *variant.coefficients),
        needs=tuple(dict.fromkeys((*effect.needs, *variant.needs))),
        extra_states=effect.extra_states if variant.extra_states is None else variant.extra_states,
        variants=(),
        textbook=effect,
    )


def with_one_cross_state(effects: Sequence[Effect]) -> tuple[Effect, ...]:
    """Return the effects in variants that share one cross state, as a model can have only one.

    Where one effect cannot do without a cross state, each effect that has a stateless variant takes that; else it keeps its own.
    """
    has_owner = any(e.extra_states and e.stateless_variant is None for e in effects)
    return tuple(_without_cross_state(e) if has_owner else _with_own_cross_state(e) for e in effects)


def _without_cross_state(effect: Effect) -> Effect:
    return effect if effect.stateless_variant is None else with_variant(effect, effect.stateless_variant)


def _with_own_cross_state(effect: Effect) -> Effect:
    textbook = effect.textbook
    return effect if textbook is None or effect.extra_states or textbook.stateless_variant is None else textbook


def variant_of(effect: Effect, known: Collection[str]) -> Variant | None:
    """Return the variant with the most coefficients whose shared ones are all among the known names; None for the textbook's."""
    matching = [v for v in effect.variants if all(c.name in known for c in v.coefficients if not c.per_run)]
    return max(matching, key=lambda v: len(v.coefficients), default=None)


def as_fitted(effect: Effect, values: Values) -> Effect:
    """Return an effect in the variant whose coefficients a model's values hold."""
    variant = variant_of(effect, values)
    return effect if variant is None else with_variant(effect, variant)


def is_on_bound(value: float, low: float, high: float) -> bool:
    """Whether a coefficient's value lies on one of its bounds."""
    return min(value - low, high - value) <= BOUND_SHARE * (high - low)


def over_intervals(values: FloatArray) -> FloatArray:
    """Return the value over each interval, (n-1,), of a signal known at its ends, (n,)."""
    return np.asarray(0.5 * (values[:-1] + values[1:]))


def effect_named(name: str) -> Effect:
    """Return an effect of the registry; raises UsageError naming the near matches."""
    return _checked(name, pick(REGISTRY, "EFFECT", name))


def effect_held(name: str, definitions: Mapping[str, Definition] = NONE) -> Effect:
    """Return the effect of a model by its name: from the definition that the model keeps of it, else from the registry.

    Raises EffectError for an effect that is not known here; the error says where it was defined if the model does.
    """
    definition = definitions.get(name)
    if definition is not None and not definition.is_code:
        return _checked(name, define(REGISTRY, definition.text, definition.file))
    try:
        effect = effect_named(name)
    except UsageError as error:
        raise _unknown_effect(name, definition) from error
    if definition is not None and (effect.definition is None or not effect.definition.is_code):
        raise _unknown_effect(name, definition)
    return effect


def definitions_of(effects: Iterable[Effect]) -> dict[str, Definition]:
    """Return the definitions that a model has to keep, by the effect's name: those of the effects that are not built in."""
    return {e.name: e.definition for e in effects if e.definition is not None}


def shared_name(one: Effect, other: Effect) -> str | None:
    """Return a coefficient's name that two effects of one axis both use, None where there is none.

    Such effects cannot be in one model, which keeps the coefficients of all its effects in one table.
    """
    same_axis = bool(set(one.axes) & set(other.axes))
    return min(one.names & other.names, default=None) if same_axis and one.name != other.name else None


def _checked(name: str, effect: object) -> Effect:
    if not isinstance(effect, Effect) or effect.name != name:
        raise TypeError(f"asked for effect {name!r}, got {effect!r:.60}")
    return effect


def _unknown_effect(name: str, definition: Definition | None) -> EffectError:
    """Return the error for a model whose effect is neither defined in the model nor known here."""
    if definition is None:
        return EffectError(
            f"the model holds effect `{name}`, which is not known here",
            found="the model does not say where it lived",
            hint=f"work in the folder whose `effects/` has `{name}`, or copy its file to `effects/` here",
        )
    return EffectError(
        f"the model holds effect `{name}`, which is Python code and is not installed here: code is not kept in a model",
        found=f"it lived in {definition.place}, SHA-256 {definition.sha256 or 'not known'}",
        hint=f"install the package it came with; `sysid effects show {name}` then shows it",
    )
