"""sysid turn-radius: radius over speed, both sides, with bands, against measured circles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fieldsid.cli.console import emit, print_page, say
from fieldsid.cli.options import Figures, Force, JsonFlag, MappingFile, ModelFiles, OutputDir, OwnLaw, VehicleFile, option
from fieldsid.cli.progress import refuse_closed
from fieldsid.cli.session import tasks_of
from fieldsid.cli.skipped_logs import Skips
from fieldsid.cli.voice import angles
from fieldsid.display import page_of

if TYPE_CHECKING:
    from rich.console import Console

    from fieldsid.logs.run import Run
    from fieldsid.plant.parameter_source import ParameterSource
    from fieldsid.results.turning import TurnRadius
    from fieldsid.turning.prediction import TurnPrediction

Speeds = Annotated[
    str | None, option("--speeds", "LIST", "Speeds in m/s, 0.5:2.5:0.1 or 1.0,1.6; those of the models if not given.")
]
RudderMax = Annotated[
    str | None,
    option("--fin-max", "ANGLE", "Rudder held in the turn, `15deg`; if not given the vehicle's limit, else the models' largest."),
]
Measured = Annotated[
    list[Path] | None, option("--measured", "RUN", "Run of a turning circle, to compare with and to learn from; may repeat.")
]
Runs = Annotated[list[Path] | None, option("--runs", "RUN", "Runs that the turn is fitted to; the models' own if not given.")]
Method = Annotated[str, option("--method", "NAME", "auto, maneuvering, simulated, u_turn or steady.")]
FinZero = Annotated[str, option("--fin-zero", "ANGLE", "Fin offsets below this, `1deg`, are not counted in the formula.")]


def command(
    context: typer.Context,
    models: ModelFiles,
    speeds: Speeds = None,
    rudder_max: RudderMax = None,
    measured: Measured = None,
    runs: Runs = None,
    method: Method = "auto",
    law: OwnLaw = None,
    fin_zero: FinZero = "0.0175rad",
    mapping: MappingFile = None,
    vehicle: VehicleFile = None,
    output: OutputDir = None,
    figures: Figures = True,
    force: Force = False,
    as_json: JsonFlag = False,
) -> Mapping[str, Any]:
    """Predict the turning radius over speed, port and starboard apart, with 95 % bands.

    Models that carry effects, in a fit file too: surge, sway and yaw are fitted to all their runs and the measured turns at
    once, and the radius is the median of what these allow; without runs the models are simulated to the settled circle. A table
    or first-order models go by the u-turn formula. Rows say what they rest on: measured, identified or extrapolated.

    Example: sysid turn-radius models/*.yaml --fin-max 0.35 --measured circle.parquet -o turning/
    """
    from fieldsid.angles import FIN, parse_angle
    from fieldsid.cli.headlines.gains import caveat, of_turn
    from fieldsid.cli.inputs import models_among, read_runs
    from fieldsid.cli.user_effects import check_effects
    from fieldsid.face.arguments import length_of
    from fieldsid.face.speeds import speeds_of
    from fieldsid.plant.parameter_source import load_parameter_source
    from fieldsid.records.keys import body_of
    from fieldsid.results.turning import TurnRadius
    from fieldsid.turning.radius import turn_radius

    refuse_closed(output)
    given = None if rudder_max is None else parse_angle(rudder_max, "--fin-max", FIN)
    models = models_among(models)
    source, skips = load_parameter_source(models, laws=law or ()), Skips()
    check_effects(zip(source.paths, source.models, strict=False))  # a table has no models
    prediction = turn_radius(
        source,
        speeds_of(speeds) or source.knots,
        _rudder(given, vehicle, source),
        runs=_runs(runs, source, mapping, skips),
        measured=read_runs(measured, mapping=mapping, refused=skips.skip) if measured else (),
        method=method,
        fin_zero=_fin_zero(fin_zero),
        unfit=skips.skip,
        length=length_of(vehicle),
    )
    found = TurnRadius(prediction=prediction, skipped_runs=tuple(skips.records))
    if output is not None:
        drawn = _written(found, output, source, context, figures=figures, force=force)
        found = replace(found, figures=drawn)
    body = body_of(found)
    headline, notes = of_turn(body, models, caveat(source.models, models)), prediction.notes
    result = emit(body, as_json=as_json, render=lambda to: _render(to, prediction, body), headline=headline, notes=notes)
    skips.end(len(runs or []) + len(measured or []) - len(skips.records))
    return result


def _fin_zero(text: str) -> float:
    from fieldsid.angles import FIN, parse_angle
    from fieldsid.errors import UsageError

    angle = parse_angle(text, "--fin-zero", FIN)
    if not 0.0 <= angle <= FIN:
        words = "the tolerance of a fin's zero lies in 0 .. 45 deg"
        raise UsageError(words, found=f"--fin-zero {text}", hint="`--fin-zero 0` counts every offset")
    return angle


def _rudder(given: float | None, vehicle: Path | None, source: ParameterSource) -> float:
    """Return the rudder of the turn: the option, the vehicle's limit, or the largest the models were trained on."""
    from fieldsid.face.arguments import rudder_of, vehicle_of

    return given if given is not None else rudder_of(vehicle_of(vehicle), source, say)


def _runs(given: Sequence[Path] | None, source: ParameterSource, mapping: Path | None, skips: Skips) -> Sequence[Run]:
    """Return the runs the models came from: those given, else the inputs the model files name, where they can still be read."""
    from fieldsid.cli.inputs import mapping_of, read_runs
    from fieldsid.face.arguments import run_files
    from fieldsid.logs import Run, load_run
    from fieldsid.logs.several.sifting import attempt

    if given:
        return read_runs(given, mapping=mapping, refused=skips.skip)
    chosen = mapping_of(mapping)
    outcomes = {path: attempt(lambda p: load_run(p, chosen), path) for path in run_files(source, say)}
    lost = [f"`{path}`" for path, outcome in outcomes.items() if not isinstance(outcome, Run)]
    if lost:
        say(
            f"runs of the models that cannot be read again: {', '.join(lost)}: name them with `--runs`, the turn is fitted to all"
        )
    return [outcome for outcome in outcomes.values() if isinstance(outcome, Run)]


def _written(
    found: TurnRadius,
    folder: Path,
    source: ParameterSource,
    context: typer.Context,
    *,
    figures: bool,
    force: bool,
) -> tuple[str, ...]:
    from fieldsid.artifacts import save_record
    from fieldsid.figures.canvas import save
    from fieldsid.figures.turn import figure, track_figure
    from fieldsid.records.keys import body_of

    inputs = [p for p in source.paths if p.is_file()]
    rest = {k: v for k, v in body_of(found).items() if k not in ("schema", "figures")}
    save_record(folder / "turn_radius.yaml", found.SCHEMA, rest, inputs=inputs, force=force)
    if not figures:
        return ()
    prediction = found.prediction
    drawn = {"turn_radius": figure(prediction)} | {f"circle_{m.turn.run}": track_figure(m.turn) for m in prediction.measured}
    return tuple(str(save(f, folder / f"{name}.png", force=force, tasks=tasks_of(context))) for name, f in drawn.items())


def _render(to: Console, prediction: TurnPrediction, body: Mapping[str, Any]) -> None:
    print_page(to, page_of(prediction, angles()))
    for path in body["figures"]:
        to.print(f"figure: {path}", soft_wrap=True)
