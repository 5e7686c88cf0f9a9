"""The contract of a physical effect: everything any command may ask of it, in one frozen record.

Signal path: command -> ACTUATOR -> fin angle -> HYDRODYNAMICS -> motion -> SENSOR -> measurement. The equations of motion are
those of models/hull.py. A run starts with a cross state where some steady rate before it had left it; no motion within that rate
leaves it further from zero.
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
"""Share of the range of a number from a bound within which it stands on it."""


class Stage(StrEnum):
    """Where in the signal path an effect acts."""

    ACTUATOR = "actuator"
    HYDRODYNAMICS = "hydrodynamics"
    SENSOR = "sensor"


@dataclass(frozen=True, slots=True)
class Coefficient:
    """One number of an effect: unit, bounds, start value, and the grid to scan where the cost is not smooth.

    `scan` gives start values tried before the descent; `step` is the half width of the central difference. `per_run` marks a
    nuisance (a phase, an event time) that every run has of its own and that is refitted on validation runs; its bounds are
    fractions of the run's length when `unit` is "run". `of_start` marks one that is where a hidden state begins, which the run
    soon forgets. `rate_exponent` is the power of the hull's characteristic rate (1/s) that
    scales the points of the grid: the coefficients of a slow hull are small.
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
    """A variant of an effect that is not the textbook's, in a few words, with the coefficients it takes besides the effect's.

    The effect's hooks compute the textbook's variant where the values lack these coefficients. `initial_guesses` gives start
    values of the shared ones as an effect's does, from the residuals of the textbook's variant, in place of their scan grids.
    `axes` and `needs` are those of the variant, where it has fewer axes than the effect or needs more signals. `without` are
    coefficients of the effect that it does without, `beside` effects beside which alone it may show. `extra_states` are the
    variant's, None for those of the effect.
    """

    says: str
    coefficients: tuple[Coefficient, ...]
    initial_guesses: InitialGuesses | None = None
    axes: tuple[Axis, ...] = tuple(Axis)
    needs: tuple[str, ...] = ()
    without: tuple[str, ...] = ()
    beside: tuple[str, ...] = ()
    extra_states: tuple[str, ...] | None = None


@dataclass(frozen=True, slots=True)
class Terms:
    """Time-varying parts that depend on measured signals only, each a factor or an addition per sample (n,).

    `damping_factor` and `authority_factor` multiply a(t) and b(t); `moment` (rad/s^2) is added to m(t);
    `damping` (1/s) is added to a(t) after the factor. `cross_factor` is g, the speed over the run's own in the cross
    state's equation. None leaves the part as it is.
    """

    damping_factor: FloatArray | None = None
    authority_factor: FloatArray | None = None
    moment: FloatArray | None = None
    damping: FloatArray | None = None
    cross_factor: FloatArray | None = None

    def beside(self, other: Terms) -> Terms:
        """Return the parts of two effects together: the products of the factors, the sums of the additions."""
        return Terms(*(_joined(getattr(self, part), getattr(other, part), how) for part, how in TERM_PARTS.items()))


TERM_PARTS = dict(zip(Terms.__dataclass_fields__, (np.multiply, np.multiply, np.add, np.add, np.multiply), strict=True))
"""How the parts of two effects go together, each by its name."""


def _joined(a: FloatArray | None, b: FloatArray | None, how: np.ufunc) -> FloatArray | None:
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
    """One physical effect. Exactly the hooks of its stage are given; a hook is a pure function.

    fin(path, values, record) -> FinPath                    actuator, in rising `order`
    terms(values, record) -> Terms                          hydrodynamics known before integration
    slope(name, values, record) -> (n,) rad/s^2             optional, where the terms are a moment and no more: its derivative by
                                                            one of the coefficients; without it differences are taken
    core(values, scale) -> Core                             hydrodynamics inside the core; scale = speed / reference
    moment(motion, values, record) -> (n,) rad/s^2          hydrodynamics evaluated along the last trajectory
    measure(motion, values, record) -> Motion               sensor
    sensor_jvp(moves, motion, values, record) -> (P, 2, n)  sensor, optional: the derivative of measure, applied to P small
                                                            moves (P, 2, n) of the motion; without it differences are taken
    sensor_slope(name, motion, values, record) -> (2, n)    sensor, optional: that by one of the coefficients
    `needs` lists roles a log must have: surge, thrust, roll, depth.
    initial_guesses(records, residuals) -> start values for the shared coefficients, from residuals [(2, n)] of a fit without
    the effect, before those of the scan grid. equivalent_solution(values, axis) -> another with the same response at one speed.
    `variants` are other shapes, tried where the textbook's leaves something; `textbook` is the effect that one of them is of,
    None for the textbook's own.
    `log_prior_penalty` is log evidence the effect must bring beyond others: where another says the same in simpler words,
    or where free event times make it fit anything.
    `heading_span` (rad) is what the runs' headings must span together for it to be told from what goes with the heading itself.
    `origin` says where the effect is defined, `definition` the same as a model keeps it; None where it is built in.
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
        """Whether it is in another variant than the textbook's."""
        return self.textbook is not None

    @property
    def stateless(self) -> Variant | None:
        """Its variant without the state of its textbook's, which takes that of an effect beside it; None without one."""
        return next((v for v in self.variants if self.extra_states and v.extra_states == ()), None)

    @property
    def limits_rate(self) -> bool:
        """Whether it is a damping that grows with the rate, whatever else it is in another variant."""
        textbook = self.textbook or self
        return textbook.holds_rate(textbook.starts())

    def holds_rate(self, values: Values) -> bool:
        """Whether at these values its damping grows with the rate, and so holds a hull that is unstable at small angles."""
        return self.core is not None and any(getattr(self.core(values, 1.0), name) > 0.0 for name in RISING)

    @property
    def shared(self) -> tuple[Coefficient, ...]:
        """Coefficients that all runs have in common."""
        return tuple(c for c in self.coefficients if not c.per_run)

    @property
    def nuisance(self) -> tuple[Coefficient, ...]:
        """Coefficients every run has of its own."""
        return tuple(c for c in self.coefficients if c.per_run)

    @property
    def every(self) -> tuple[Coefficient, ...]:
        """Its coefficients, and those that forms take besides, each once."""
        return tuple({c.name: c for c in (*self.coefficients, *(c for f in self.variants for c in f.coefficients))}.values())

    @property
    def names(self) -> set[str]:
        """Names of the coefficients, those of the forms among them."""
        return {c.name for c in self.every}

    def placed(self, outside: Outside) -> Effect:
        """Return the effect of another package with its origin; the registry asks for it when it loads an entry point."""
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


def with_variant(effect: Effect, form: Variant) -> Effect:
    """Return an effect in one of its forms: with that form's coefficients among its own, without those it does without."""
    return replace(
        effect,
        coefficients=(*(c for c in effect.coefficients if c.name not in form.without), *form.coefficients),
        needs=tuple(dict.fromkeys((*effect.needs, *form.needs))),
        extra_states=effect.extra_states if form.extra_states is None else form.extra_states,
        variants=(),
        textbook=effect,
    )


def with_one_cross_state(effects: Sequence[Effect]) -> tuple[Effect, ...]:
    """Return effects of which one has a model's one cross state: what can do without takes that of one which cannot."""
    owned = any(e.extra_states and e.stateless is None for e in effects)
    return tuple(_beside_state(e) if owned else _with_own_state(e) for e in effects)


def _beside_state(effect: Effect) -> Effect:
    return effect if effect.stateless is None else with_variant(effect, effect.stateless)


def _with_own_state(effect: Effect) -> Effect:
    whole = effect.textbook
    return effect if whole is None or effect.extra_states or whole.stateless is None else whole


def variant_of(effect: Effect, known: Collection[str]) -> Variant | None:
    """Return the form whose shared numbers are all among the known names, the largest of several; None for the textbook's."""
    fitting = [f for f in effect.variants if all(c.name in known for c in f.coefficients if not c.per_run)]
    return max(fitting, key=lambda f: len(f.coefficients), default=None)


def as_fitted(effect: Effect, values: Values) -> Effect:
    """Return an effect in the form that a model's values belong to."""
    form = variant_of(effect, values)
    return effect if form is None else with_variant(effect, form)


def is_on_bound(value: float, low: float, high: float) -> bool:
    """Whether a number stands on one of its bounds."""
    return min(value - low, high - value) <= BOUND_SHARE * (high - low)


def over_intervals(values: FloatArray) -> FloatArray:
    """Return the value over each interval, (n-1,), of a signal known at its ends, (n,)."""
    return np.asarray(0.5 * (values[:-1] + values[1:]))


def effect_named(name: str) -> Effect:
    """Return an effect of the registry; raises UsageError naming the near matches."""
    return _checked(name, pick(REGISTRY, "EFFECT", name))


def effect_held(name: str, own: Mapping[str, Definition] = NONE) -> Effect:
    """Return an effect that a model holds: as the model's own definition has it where there is one, else the registry's.

    Raises EffectError for one that is not known here, saying where it lived if the model does.
    """
    definition = own.get(name)
    if definition is not None and not definition.is_code:
        return _checked(name, define(REGISTRY, definition.text, definition.file))
    try:
        effect = effect_named(name)
    except UsageError as error:
        raise _not_here(name, definition) from error
    if definition is not None and (effect.definition is None or not effect.definition.is_code):
        raise _not_here(name, definition)
    return effect


def definitions_of(effects: Iterable[Effect]) -> dict[str, Definition]:
    """Return what a model has to keep of its effects, by name: the definitions of those that are not built in."""
    return {e.name: e.definition for e in effects if e.definition is not None}


def shared_name(one: Effect, other: Effect) -> str | None:
    """Return a coefficient's name that keeps two effects out of one model, None where there is none.

    A model keeps the coefficients of all its effects in one table.
    """
    same_axis = bool(set(one.axes) & set(other.axes))
    return min(one.names & other.names, default=None) if same_axis and one.name != other.name else None


def _checked(name: str, effect: object) -> Effect:
    if not isinstance(effect, Effect) or effect.name != name:
        raise TypeError(f"asked for effect {name!r}, got {effect!r:.60}")
    return effect


def _not_here(name: str, definition: Definition | None) -> EffectError:
    """Return the error of a model whose effect is neither in it nor known here."""
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
