"""The rival models of a separation: a prior with named effects, or the most probable candidates of a diagnosis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fieldsid.effects import pick_effect, refuse_clash
from fieldsid.errors import UsageError
from fieldsid.logs.wrong_file import unless_log
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.effect import Coefficient, definitions_of, effect_held
from fieldsid.models.model import Model, Noise
from fieldsid.models.speed_law import TRIM_OF_FIN, SpeedLaw
from fieldsid.planning.belief.prior_model import CHANNELS, UNMEASURED
from fieldsid.planning.whole_file import whole_file
from fieldsid.records.reading import load_record
from fieldsid.registry import near

KIND = "fieldsid/diagnosis"
PLAIN = "none"
LEAST_PROBABILITY, MOST_RIVALS = 0.02, 4


def rivals_named(model: Model, names: Sequence[str]) -> tuple[Model, ...]:
    """Return a model for each rival: the given one with effects added (joined by `+`), or unchanged for `none`.

    Coefficients that the model lacks have a typical value. Raises UsageError for an unknown effect, an effect of the other axis,
    or fewer than two rivals.
    """
    distinct = tuple(dict.fromkeys(names))
    if len(distinct) < 2:
        raise UsageError(
            "two rivals are needed", found=", ".join(names) or "none", hint="name them: `--separate delay,servo_lag`"
        )
    return tuple(_with_effects(model, _effects(name)) for name in distinct)


def typical(coefficient: Coefficient) -> float:
    """Return a coefficient's typical value: the median of its scan (the upper of two), else its start value."""
    return sorted(coefficient.scan)[len(coefficient.scan) // 2] if coefficient.scan else coefficient.start


def rivals_from(path: Path, names: Sequence[str] = ()) -> tuple[Model, ...]:
    """Return the rivals of a diagnosis file: those named, else its most probable candidates.

    The noise is that of the sensors, and the disturbance moment that the best of the rivals leaves. Raises ArtifactError when the
    file is not a complete diagnosis or lacks a name, UsageError when there are fewer than two rivals.
    """
    with unless_log(path, "a diagnosis"):
        body = load_record(path, KIND)
    with whole_file(path, "diagnosis", "diagnose again, with `-o`"):
        axis = Axis(body["axis"])
        candidates = sorted(body["candidates"], key=lambda c: -float(c["probability"]))
        chosen = _named(candidates, names) if names else _most_probable(candidates)
        models = tuple(_model_of(axis, c, body) for c in chosen)
        calmest = min((_disturbance(c, m) for c, m in zip(chosen, models, strict=True)), default=0.0)
        models = tuple(replace(m, noise=replace(m.noise, disturbance=calmest)) for m in models)
    if len(models) < 2:
        known = ", ".join(f"{c['effect']} with probability {float(c['probability']):.2g}" for c in candidates[:MOST_RIVALS])
        hint = "name two of them with `--separate A,B`"
        raise UsageError("the diagnosis leaves no rivals to tell apart", found=known or "no candidates", hint=hint)
    return models


def _named(candidates: Sequence[Mapping[str, Any]], names: Sequence[str]) -> list[Mapping[str, Any]]:
    """Return the candidates of the names, whose effects may be in any order; raises UsageError for a name without one."""
    known = {frozenset(_effects(str(c["effect"]))): str(c["effect"]) for c in candidates}
    asked = {frozenset(_effects(name)): name for name in names}
    for effects, name in asked.items():
        if effects not in known:
            listed = list(known.values())
            raise UsageError(f"the diagnosis has no candidate `{name}`", found=", ".join(listed), hint=near(name, listed))
    return [c for c in candidates if frozenset(_effects(str(c["effect"]))) in asked]


def _disturbance(candidate: Mapping[str, Any], model: Model) -> float:
    """Return the disturbance moment (rad/s^2) that leaves the candidate's error beyond the noise of the sensors.

    It is that of the noise's correlation time `t`, which moves a hull of damping a and stiffness k by the rate
    sigma sqrt(t / (a (1 + a t + k t^2))); where no rate was measured, that is the angle's error times a.
    """
    names, noise, error = NAMES[model.axis], model.noise, candidate["train"]
    a, t = abs(model.values[names.damping]), noise.disturbance_time
    k = max(model.values[names.stiffness], 0.0) if names.stiffness else 0.0
    of_rate = noise.rate < UNMEASURED
    left = (float(error["rate_rms_rad_s"]), noise.rate) if of_rate else (float(error["angle_rms_rad"]), noise.angle)
    excess = np.sqrt(max(left[0] ** 2 - left[1] ** 2, 0.0)) * (1.0 if of_rate else a)
    return float(excess * np.sqrt(a * (1.0 + a * t + k * t**2) / t))


def _most_probable(candidates: Sequence[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Return the candidates of LEAST_PROBABILITY or more, at most MOST_RIVALS; improbable ones need no flight."""
    return [c for c in candidates if float(c["probability"]) >= LEAST_PROBABILITY][:MOST_RIVALS]


def _model_of(axis: Axis, candidate: Mapping[str, Any], body: Mapping[str, Any]) -> Model:
    effects = (*map(str, body.get("known", ())), *_effects(str(candidate["effect"])))
    parameters = {str(k): _value(v) for k, v in candidate["parameters"].items()}
    floor = body["noise_floor"]
    law = body.get("speed_law", {})
    coefficients = {c.name: typical(c) for e in effects for c in pick_effect(e).shared}
    names = NAMES[axis]
    missing = [n for n in names.base if n not in parameters]
    if missing:
        raise KeyError(f"{candidate['effect']}: {missing[0]}")
    return Model(
        axis=axis,
        effects=effects,
        values=coefficients | parameters,
        units={},
        free=(),
        covariance=np.zeros((0, 0)),
        law=SpeedLaw(float(law.get("reference_m_s") or body.get("speed_m_s") or np.nan), trim_of_fin=TRIM_OF_FIN[axis]),
        noise=Noise(**{c: UNMEASURED if floor[key] is None else float(floor[key]) for c, key in CHANNELS.items()}),
        method="diagnosis",
    )


def _value(item: Any) -> float:
    return float(item["value"]) if isinstance(item, Mapping) else float(item)


def _effects(name: str) -> tuple[str, ...]:
    return () if name == PLAIN else tuple(part.strip() for part in name.split("+"))


def _with_effects(model: Model, effects: tuple[str, ...]) -> Model:
    present = {name: effect_held(name, model.own) for name in model.effects}
    added = {name: pick_effect(name) for name in effects if name not in present}
    for name, effect in added.items():
        refuse_clash(effect, present.values())
        if model.axis not in effect.axes:
            raise UsageError(
                f"effect `{name}` does not act on the {model.axis.value} axis",
                found=", ".join(a.value for a in effect.axes),
                hint=f"use `--axis {effect.axes[0].value}`",
            )
    values = {c.name: typical(c) for e in added.values() for c in e.shared}
    return replace(
        model,
        effects=(*model.effects, *added),
        values={**values, **model.values},
        own={**model.own, **definitions_of(added.values())},
    )
