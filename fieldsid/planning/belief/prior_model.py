"""The prior model before a dive: parameters with their covariance, from a file or a template, and draws from it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import solve_banded

from fieldsid.dynamics.assemble import Base, combined_core
from fieldsid.dynamics.free_run import base_at, effects_of
from fieldsid.dynamics.steady_kernel import straight_slopes
from fieldsid.effects import pick_effect
from fieldsid.errors import ArtifactError, ModelError, UsageError
from fieldsid.logs.wrong_file import unless_log
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.hull import OF_ANGLE, Core
from fieldsid.models.model import Model, Noise, load_model
from fieldsid.models.speed_law import TRIM_OF_FIN, SpeedLaw
from fieldsid.numerics.arrays import FloatArray
from fieldsid.planning.whole_file import whole_file
from fieldsid.records.check import finite_number
from fieldsid.records.reading import load_record, read_yaml
from fieldsid.registry import near
from fieldsid.templates import template_names, template_path

KIND = "fieldsid/prior"
UNMEASURED = 1e3
"""Noise, in rad or rad/s, of a channel that nothing measured: it tells nothing of a flight either."""
CHANNELS = {"angle": "angle_rad", "rate": "rate_rad_s"}
"""Channels of a noise floor and their keys in files, null where nothing measured them."""


def load_believed(path: Path) -> Model:
    """Read a prior model: a prior file, or an identified model; raises ArtifactError.

    The noise of a channel that the model's runs did not measure is UNMEASURED.
    """
    with unless_log(path, "a model or a prior"):
        schema = str(read_yaml(path).get("schema", ""))
    if schema.startswith(f"{KIND}/"):
        return load_prior(path)
    model = load_model(path)
    floor = model.info.get("left", {}).get("noise_floor", {})
    silent = {c: UNMEASURED for c, key in CHANNELS.items() if key in floor and floor[key] is None}
    return replace(model, noise=replace(model.noise, **silent))


def load_prior(path: Path) -> Model:
    """Read a prior file as a model with a diagonal covariance; raises ArtifactError naming what is missing or wrong."""
    body = load_record(path, KIND)
    with whole_file(path, "prior", "compare it with `templates/plan/priors/torpedo_yaw.yaml`"):
        return _model_of(body)


def _model_of(body: Mapping[str, Any]) -> Model:
    axis = Axis(body["axis"])
    effects = tuple(str(e) for e in body.get("effects", []))
    known = [*NAMES[axis].base, *(c.name for e in effects for c in pick_effect(e).shared)]
    entries = body["parameters"]
    for name in known:
        if name not in entries:
            hint = f"add `{name}: {{value: .., std_error: ..}}`"
            raise ArtifactError(f"the prior has no parameter `{name}`", found=", ".join(entries), hint=hint)
    for name in entries:
        if name not in known:
            raise ArtifactError(f"the prior has an unknown parameter `{name}`", found=", ".join(known), hint=near(name, known))
    values = {n: finite_number(entries[n]["value"], n) for n in known}
    errors = {n: finite_number(entries[n].get("std_error", 0.0), f"{n}: std_error") for n in known}
    free = tuple(n for n in known if errors[n] > 0)
    return Model(
        axis=axis,
        effects=effects,
        values=values,
        units={n: str(entries[n].get("unit", "")) for n in known},
        free=free,
        covariance=np.diag([errors[n] ** 2 for n in free]) if free else np.zeros((0, 0)),
        law=SpeedLaw(
            finite_number(body["reference_m_s"], "reference_m_s"),
            finite_number(body.get("damping_exponent", 1.0), "damping_exponent"),
            finite_number(body.get("authority_exponent", 2.0), "authority_exponent"),
            trim_of_fin=TRIM_OF_FIN[axis],
        ),
        noise=_noise(body["noise"]),
        method="prior",
        info={"name": str(body.get("name", "prior"))},
    )


def _noise(body: Mapping[str, Any]) -> Noise:
    known = [f.name for f in fields(Noise)]
    for name in body:
        if name not in known:
            raise ArtifactError(f"the prior's noise has an unknown key `{name}`", found=", ".join(known), hint=near(name, known))
    noise = Noise(**{k: finite_number(v, k) for k, v in body.items()})
    if not (noise.angle > 0 and noise.rate > 0 and noise.disturbance >= 0):
        raise ArtifactError(
            "the prior's noise must be above zero", found=f"angle {noise.angle:g}, rate {noise.rate:g}", hint="in rad and rad/s"
        )
    return noise


FOLDER = "plan/priors"
WIDEST = 3.0
"""Draws are clipped at this many standard deviations."""


def prior_names() -> tuple[str, ...]:
    """Return the names of the priors among the templates, such as `torpedo`."""
    stems = [Path(n).stem for n in template_names() if n.startswith(f"{FOLDER}/")]
    return tuple(sorted({s.rsplit("_", 1)[0] for s in stems}))


def named_prior(name: str, axis: Axis) -> Model:
    """Return a prior from the templates; raises UsageError naming the near matches."""
    known = prior_names()
    if name not in known:
        raise UsageError(f"there is no prior named {name!r}", found=", ".join(known) or "none", hint=near(name, known))
    return load_prior(template_path(f"{FOLDER}/{name}_{axis.value}.yaml"))


def checked_prior(model: Model, axis: Axis, speeds: tuple[float, ...]) -> Model:
    """Return the model if it is of the axis and can be simulated at the speeds.

    Raises UsageError for the wrong axis, ModelError when the straight run is unstable and no damping bounds the rate.
    """
    if model.axis is not axis:
        raise UsageError(
            f"the prior is of the {model.axis.value} axis, the plan of {axis.value}",
            found=f"axis: {model.axis.value}",
            hint=f"plan that axis: `--axis {model.axis.value}`",
        )
    rate_is_bounded = any(e.bounds_rate(model.values) for e in effects_of(model))
    for speed in speeds:
        values = {"damping_exponent": model.law.damping_exponent} | dict(model.values)
        growth = growth_of(base_at(model, speed), combined_core(effects_of(model), values, model.law.scale(speed)))
        if growth > 0 and not rate_is_bounded:
            names = NAMES[axis]
            raise ModelError(
                f"the prior is unstable at {speed:g} m/s: a disturbance doubles every {np.log(2) / growth:.2g} s",
                found=", ".join(f"{n} = {model.values[n]:g}" for n in names.base if n != names.trim),
                hint="identify it with `--effects quadratic_damping`, or start from `--prior torpedo`",
            )
    return model


def growth_of(base: Base, core: Core) -> float:
    """Return the largest real part (1/s) of the poles on a straight run, zero where none is unstable.

    y'' = -a y' - k y + m x, x' = -c x - c_r y': the cross state may stabilise a hull or destabilise it. The terms in the angle
    itself, such as that of a current, are left out.
    """
    constants = np.array([core], dtype=np.float64)
    constants[:, OF_ANGLE] = 0.0
    a, k, c, by_rate, _ = straight_slopes(constants)[:, 0] + [base.damping, base.stiffness, 0.0, 0.0, 0.0]
    roots = np.roots([1.0, a + c, k + a * c + by_rate, k * c])
    worst = float(np.max(roots.real))
    return worst if worst > 1e-6 else 0.0


def draws_of(model: Model, count: int, seed: int) -> tuple[Model, ...]:
    """Return models drawn from the prior; damping and authority keep their sign, coefficients stay within their bounds."""
    if not model.free or not np.isfinite(model.covariance).all():
        return (model,) * count
    rng = np.random.default_rng(seed)
    values, vectors = np.linalg.eigh(model.covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    steps = np.clip(rng.standard_normal((count, len(model.free))), -WIDEST, WIDEST) @ root.T
    return tuple(_shifted(model, dict(zip(model.free, step.tolist(), strict=True))) for step in steps)


def corner(model: Model, sigmas: Mapping[str, float]) -> Model:
    """Return the model with some free values shifted by a number of their standard errors (`sigmas`)."""
    return _shifted(model, {n: s * model.std_error(n) for n, s in sigmas.items() if n in model.free})


def _shifted(model: Model, shifts: Mapping[str, float]) -> Model:
    names = NAMES[model.axis]
    bounds = {c.name: (c.low, c.high) for e in effects_of(model) for c in e.coefficients}
    values = dict(model.values)
    for name, shift in shifts.items():
        value = values[name]
        if name in (names.damping, names.authority) and value != 0.0:
            # a shift of the logarithm, so that authority and damping keep their sign
            values[name] = value * float(np.exp(shift / value))
        elif name in bounds:
            values[name] = float(np.clip(value + shift, *bounds[name]))
        else:
            values[name] = value + shift
    if names.stiffness is not None and model.values[names.stiffness] > 0:
        values[names.stiffness] = max(values[names.stiffness], 0.0)
    law = model.law
    if law.points:
        factor = values[names.authority] / model.values[names.authority]
        law = replace(law, points=tuple((u, b * factor) for u, b in law.points))
    return replace(model, values=values, law=law)


def scales_of(model: Model, base: Base, fin: float) -> dict[str, float]:
    """Return the scale by which the error of each parameter is divided.

    It is the absolute value, or the standard error of the prior where that is larger, both at the speed of `base`; for the trim
    it is the moment of the full fin (rad/s^2).
    """
    names = NAMES[model.axis]
    at_speed = {names.damping: base.damping, names.authority: base.authority, names.trim: base.authority * fin}
    out: dict[str, float] = {}
    for name in (*names.base, *(c.name for e in effects_of(model) for c in e.shared)):
        believed = model.values.get(name, 0.0)
        value = at_speed.get(name, believed)
        error = model.std_error(name) if name in model.free and name != names.trim else 0.0
        if name in at_speed and believed:
            error *= abs(value / believed)
        out[name] = max(abs(value), error, 1e-9)
    return out


def disturbances(model: Model, draws: int, count: int, step: float, rng: np.random.Generator) -> FloatArray:
    """Return draws of the prior's disturbance moment, (draws, count) rad/s^2, samples `step` s apart."""
    sigma = model.noise.disturbance
    if sigma <= 0:
        return np.zeros((draws, count))
    keep = float(np.exp(-step / model.noise.disturbance_time))
    push = sigma * rng.standard_normal((draws, count))
    push[:, 1:] *= np.sqrt(1.0 - keep**2)
    # x[i] - keep x[i-1] = push[i] as a banded system: scipy.signal's filter takes a second to import
    bands = np.stack([np.ones(count), np.full(count, -keep)])
    return np.asarray(solve_banded((1, 0), bands, push.T).T)
