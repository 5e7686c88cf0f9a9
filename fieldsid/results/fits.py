"""What `sysid identify` comes to."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import nan
from pathlib import Path
from typing import Annotated

from fieldsid.comparison.sufficient import pooled_over_noise
from fieldsid.fitting.checks.warnings import METHOD_CHOSEN, is_warning
from fieldsid.fitting.estimates import Estimate, estimates
from fieldsid.fitting.fit import Fit
from fieldsid.fitting.predict.goodness_of_fit import GoodnessOfFit, goodness_of_fit
from fieldsid.fitting.predict.predict import Prediction
from fieldsid.logs.run import Note, Run
from fieldsid.models.axis import Axis
from fieldsid.models.model import Noise
from fieldsid.records.keys import INLINE, Interval, Key, Number
from fieldsid.results.result import OfLogs


@dataclass(frozen=True, slots=True)
class Parameter:
    """An estimate with its error."""

    estimate: Annotated[Estimate, INLINE]
    shown: Annotated[str, Key("Its name as it is printed: that of several runs with the speed it belongs to.")]


@dataclass(frozen=True, slots=True)
class FittedRun:
    """One of the runs a model was fitted to."""

    merit: Annotated[GoodnessOfFit, INLINE]
    run: Annotated[str, Key("Its name.")]
    speed_m_s: Annotated[Number, Key("Median speed through the water.")]
    segment_s: Annotated[Interval, Key("First and last time that was fitted.")]


@dataclass(frozen=True, slots=True, kw_only=True)
class FittedModel:
    """One identified model."""

    merit: Annotated[GoodnessOfFit, INLINE]
    run: Annotated[str, Key("Name of the run; of a joint fit all names, joined by a plus.")]
    model: Annotated[str | None, Key("The file that was written.")]
    speed_m_s: Annotated[Number, Key("The speed the parameters hold at.")]
    method: Annotated[str, Key("The estimator: `output_error`, `pem`, `svf_ls`, `svf_rls` or `srivc`.")]
    method_reason: Annotated[str | None, Key("Why `auto` took it, where it had to choose; else null.")]
    effects: Annotated[tuple[str, ...], Key("Effects in the model.")]
    parameters: Annotated[
        Mapping[str, Parameter],
        Key(
            "By name: a22 b2 C0 delta_r0 of yaw, c22 c23 d2 Cb delta_s0 of pitch, and each effect's coefficients. A joint fit "
            "has `damping_exponent` and an authority for each speed, such as `b2@1.8`."
        ),
    ]
    noise_floor: Annotated[Noise, Key("Noise of the sensors.")]
    warnings: Annotated[tuple[Note, ...], Key("What to know before the numbers are trusted, the gravest first.")]
    whiteness_p: Annotated[Number, Key("p-value of the whitened residuals being white (Ljung and Box).")]
    runs: Annotated[tuple[FittedRun, ...], Key("Each run's own fit.")]
    settled_s: Annotated[
        Mapping[str, float] | None, Key("By parameter, when the recursive estimate settled; null for other methods.")
    ]

    @property
    def over_noise(self) -> float:
        """Its error over the noise."""
        return over_noise_of(self.merit, self.noise_floor)


@dataclass(frozen=True, slots=True, kw_only=True)
class Identified(OfLogs):
    """The models that `sysid identify` found."""

    SCHEMA = "fieldsid/identify/1"

    axis: Annotated[Axis, Key("The plane.")]
    fits: Annotated[tuple[FittedModel, ...], Key("One for each run, or one of all runs with `--joint`.")]


def over_noise_of(merit: GoodnessOfFit, floor: Noise) -> float:
    """Return free-run errors over a noise floor, the measured channels pooled."""
    return pooled_over_noise((merit.angle_rms, floor.angle), (merit.rate_rms, floor.rate))


def fitted_model(fit: Fit, path: Path | None, logs: Sequence[Run]) -> FittedModel:
    """Return a fit as the command tells it; path: its file, logs: what it was fitted to."""
    model, law = fit.model, fit.model.info.get("law_parameters", {})
    notes = (*fit.notes, *(n for run in logs for n in run.notes))
    return FittedModel(
        run="+".join(model.runs),
        model=None if path is None else str(path),
        speed_m_s=model.law.reference,
        method=model.method,
        method_reason=next((n.message for n in fit.notes if n.code == METHOD_CHOSEN), None),
        effects=model.effects,
        parameters={e.name: Parameter(e, e.name if e.name in law else model.shown(e.name)) for e in estimates(model)},
        merit=goodness_of_fit(fit.predictions),
        noise_floor=fit.floor,
        warnings=tuple(n for n in notes if is_warning(n, model.axis)),
        whiteness_p=model.info.get("whiteness_p", nan),
        runs=tuple(fitted_run(p) for p in fit.predictions),
        settled_s=None if fit.history is None else fit.history.settled_s,
    )


def fitted_run(p: Prediction) -> FittedRun:
    """Return how well one of a fit's runs is followed."""
    time = p.record.time
    return FittedRun(goodness_of_fit([p]), p.record.name, p.record.speed, (float(time[0]), float(time[-1])))
