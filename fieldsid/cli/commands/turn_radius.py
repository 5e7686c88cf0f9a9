"""sysid turn-radius: radius over speed, both sides, with bands, against measured circles."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from fieldsid.cli.console import emit
from fieldsid.cli.options import Figures, FinMax, Force, MappingFile, ModelFiles, OutputDir, OwnLaw, Speeds, VehicleFile, option
from fieldsid.cli.progress import refuse_closed
from fieldsid.cli.session import draw_figures
from fieldsid.cli.skipped_logs import Skips
from fieldsid.cli.voice import angles
from fieldsid.display import page_of
from fieldsid.figures.sketch import sketch
from fieldsid.page import Page, written
from fieldsid.records.keys import body_of

if TYPE_CHECKING:
    from fieldsid.plant.parameter_source import ParameterSource
    from fieldsid.results.turning import TurnRadius


def command(
    models: ModelFiles,
    speeds: Speeds = None,
    rudder_max: FinMax = None,
    measured: Annotated[
        list[Path] | None, option("--measured", "RUN", "Run of a turning circle, to compare with and to learn from; may repeat.")
    ] = None,
    runs: Annotated[
        list[Path] | None, option("--runs", "RUN", "Runs that the turn is fitted to; the models' own if not given.")
    ] = None,
    method: Annotated[str, option("--method", "NAME", "auto, maneuvering, simulated, u_turn or steady.")] = "auto",
    law: OwnLaw = None,
    fin_zero: Annotated[
        str, option("--fin-zero", "ANGLE", "Fin offsets below this, `1deg`, are not counted in the formula.")
    ] = "0.0175rad",
    mapping: MappingFile = None,
    vehicle: VehicleFile = None,
    output: OutputDir = None,
    figures: Figures = True,
    force: Force = False,
) -> Mapping[str, Any]:
    """Predict the turning radius over speed, port and starboard apart, with 95 % bands.

    Models that carry effects, in a fit file too: surge, sway and yaw are fitted to all their runs and the measured turns at
    once, and the radius is the median of what these allow; without runs the models are simulated to the settled circle. A table
    or first-order models go by the u-turn formula. Rows say what they rest on: measured, identified or extrapolated.

    Example: sysid turn-radius models/*.yaml --fin-max 0.35 --measured circle.parquet -o turning/
    """
    from fieldsid.angles import FIN, parse_angle
    from fieldsid.cli.headlines.gains import caveat, headline_of_turn
    from fieldsid.cli.inputs import mapping_of, models_among, read_runs
    from fieldsid.cli.user_effects import read_source
    from fieldsid.face.arguments import fin_limit_of, runs_of_turn, vehicle_of
    from fieldsid.face.quantities import given
    from fieldsid.face.speeds import speeds_of
    from fieldsid.results.turning import TurnRadius
    from fieldsid.turning.radius import turn_radius

    refuse_closed(output)
    limit = given(rudder_max, parse_angle, "--fin-max", FIN)
    models, known = models_among(models), vehicle_of(vehicle)
    source, skips = read_source(models, law or ()), Skips()
    fitted, circles = (
        read_runs(logs, mapping=mapping, models=source.paths, refused=skips.skip) if logs else () for logs in (runs, measured)
    )
    prediction = turn_radius(
        source,
        speeds_of(speeds) or source.knots,
        fin_limit_of(known, source, "rudder") if limit is None else limit,
        runs=fitted if runs else runs_of_turn(source, mapping_of(mapping)),
        measured=circles,
        method=method,
        fin_zero=_fin_zero(fin_zero),
        unfit=skips.skip,
        length=known.length_m,
    )
    result = TurnRadius(prediction=prediction, skipped_runs=tuple(skips.records))
    if output is not None:
        _save(result, output, source, force=force)
        plots = {"turn_radius": sketch("turn", prediction)}
        plots |= {f"circle_{m.turn.run}": sketch("turn", m.turn, draw="track_figure") for m in prediction.measured}
        result = replace(result, figures=tuple(draw_figures(output if figures else None, plots, force=force)))
    headline, notes = headline_of_turn(prediction, models, caveat(source.models, models)), prediction.notes
    page = Page("", blocks=page_of(prediction, angles()).blocks, closing=written(figure=result.figures))
    body = emit(result, render=page, headline=headline, notes=notes)
    return skips.end(body, len(runs or []) + len(measured or []) - len(skips.records))


def _fin_zero(text: str) -> float:
    from fieldsid.angles import FIN, parse_angle
    from fieldsid.errors import UsageError

    angle = parse_angle(text, "--fin-zero", FIN)
    if not 0.0 <= angle <= FIN:
        words = "the tolerance of a fin's zero lies in 0 .. 45 deg"
        raise UsageError(words, found=f"--fin-zero {text}", hint="`--fin-zero 0` counts every offset")
    return angle


def _save(result: TurnRadius, folder: Path, source: ParameterSource, *, force: bool) -> None:
    from fieldsid.artifacts import save_record

    inputs = [p for p in source.paths if p.is_file()]
    rest = {k: v for k, v in body_of(result).items() if k not in ("schema", "figures")}
    save_record(folder / "turn_radius.yaml", result.SCHEMA, rest, inputs=inputs, force=force)
