"""A prior as a file of its own: parameters with how far they may be off, short enough to be written by hand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from fieldsid.effects import pick_effect
from fieldsid.errors import ArtifactError
from fieldsid.logs.wrong_file import unless_log
from fieldsid.models.axis import NAMES, Axis
from fieldsid.models.model import Model, Noise, load_model
from fieldsid.models.speed_law import TRIM_OF_FIN, SpeedLaw
from fieldsid.planning.whole_file import whole_file
from fieldsid.records.check import finite_number
from fieldsid.records.reading import load_record, read_yaml
from fieldsid.registry import near

KIND = "fieldsid/prior"


def load_believed(path: Path) -> Model:
    """Read a prior model: a prior file, or an identified model; raises ArtifactError."""
    with unless_log(path, "a model or a prior"):
        schema = str(read_yaml(path).get("schema", ""))
    return load_prior(path) if schema.startswith(f"{KIND}/") else load_model(path)


def load_prior(path: Path) -> Model:
    """Read a prior file as a model with a diagonal covariance; raises ArtifactError naming what is missing or wrong."""
    body = load_record(path, KIND)
    with whole_file(path, "prior", "compare it with `templates/plan/priors/torpedo_yaw.yaml`"):
        return _model_of(body)


def _model_of(body: Mapping[str, Any]) -> Model:
    axis = Axis(body["axis"])
    effects = tuple(str(e) for e in body.get("effects", []))
    known = [*NAMES[axis].base, *(c.name for e in effects for c in pick_effect(e).shared)]
    given = body["parameters"]
    for name in known:
        if name not in given:
            hint = f"add `{name}: {{value: .., std_error: ..}}`"
            raise ArtifactError(f"the prior has no parameter `{name}`", found=", ".join(given), hint=hint)
    for name in given:
        if name not in known:
            raise ArtifactError(f"the prior has an unknown parameter `{name}`", found=", ".join(known), hint=near(name, known))
    values = {n: finite_number(given[n]["value"], n) for n in known}
    errors = {n: finite_number(given[n].get("std_error", 0.0), f"{n}: std_error") for n in known}
    free = tuple(n for n in known if errors[n] > 0)
    return Model(
        axis=axis,
        effects=effects,
        values=values,
        units={n: str(given[n].get("unit", "")) for n in known},
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
