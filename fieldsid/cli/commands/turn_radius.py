"""sysid turn-radius: radius over speed, both sides, with bands, against measured circles."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from fieldsid.angles import FIN, parse_angle
from fieldsid.cli import options
from fieldsid.cli.console import Body, emit
from fieldsid.cli.progress import refuse_closed
from fieldsid.cli.session import draw_figures
from fieldsid.cli.skipped_logs import Skips
from fieldsid.cli.voice import angles
from fieldsid.display import page_of
from fieldsid.errors import UsageError
from fieldsid.figures.sketch import sketch
from fieldsid.page import Page, written
from fieldsid.records.keys import body_of

if TYPE_CHECKING:
    from fieldsid.plant.parameter_source import ParameterSource
    from fieldsid.results.turning import TurnRadius


def _fin_zero(text: str, option: str) -> float:
    """Return the size below which a fin's offset is not counted, in rad; raises UsageError."""
    angle = parse_angle(text, option, FIN)
    if not 0.0 <= angle <= FIN:
        words = "the tolerance of a fin's zero lies in 0 .. 45 deg"
        raise UsageError(words, found=f"{option} {text}", hint=f"`{option} 0` counts every offset")
    return angle


class Options(options.ToFolder, options.OfVehicle, options.Mapped, options.Models):
    """What `sysid turn-radius` takes."""

    speeds: str | None = options.SPEEDS
    rudder_max: float | None = options.FIN_MAX
    measured: options.Paths = options.option(
        "--measured RUN", "Run of a turning circle, to compare with and to learn from; may repeat."
    )
    runs: options.Paths = options.option("--runs RUN", "Runs that the turn is fitted to; the models' own if not given.")
    method: str = options.option("--method NAME", "auto, maneuvering, simulated, u_turn or steady.", default="auto")
    law: list[str] | None = options.LAW
    fin_zero: float = options.option(
        "--fin-zero ANGLE",
        "Fin offsets below this, `1deg`, are not counted in the formula.",
        default="0.0175rad",
        parse=(_fin_zero,),
    )


@options.takes(Options)
def command(given: Options) -> Body:
    """Predict the turning radius over speed, port and starboard apart, with 95 % bands.

    Models that carry effects, in a fit file too: surge, sway and yaw are fitted to all their runs and the measured turns at
    once, and the radius is the median of what these allow; without runs the models are simulated to the settled circle. A table
    or first-order models go by the u-turn formula. Rows say what they rest on: measured, identified or extrapolated.

    Example: sysid turn-radius models/*.yaml --fin-max 0.35 --measured circle.parquet -o turning/
    """
    from fieldsid.cli.headlines.gains import caveat, headline_of_turn
    from fieldsid.cli.inputs import models_among, read_runs
    from fieldsid.cli.user_effects import read_source
    from fieldsid.face.gains import turn_radius
    from fieldsid.results.turning import TurnRadius

    refuse_closed(given.output)
    models = models_among(given.models)
    source, skips = read_source(models, given.law or ()), Skips()
    how = {"mapping": given.mapping, "models": source.paths, "refused": skips.skip}
    fitted, circles = (read_runs(logs, **how) if logs else () for logs in (given.runs, given.measured))
    read = {"models": source, "runs": fitted if given.runs else None, "measured": circles, "unfit": skips.skip}
    prediction = turn_radius(**options.arguments_of(turn_radius, given, **read))
    result = TurnRadius(prediction=prediction, skipped_runs=tuple(skips.records))
    if given.output is not None:
        _save(result, given.output, source, force=given.force)
        plots = {"turn_radius": sketch("turn", prediction)}
        plots |= {f"circle_{m.turn.run}": sketch("turn", m.turn, draw="track_figure") for m in prediction.measured}
        drawn = draw_figures(given.drawn_to, plots, force=given.force)
        result = replace(result, figures=tuple(drawn))
    headline, notes = headline_of_turn(prediction, models, caveat(source.models, models)), prediction.notes
    page = Page("", blocks=page_of(prediction, angles()).blocks, closing=written(figure=result.figures))
    body = emit(result, render=page, headline=headline, notes=notes)
    return skips.end(body, len(given.runs or []) + len(given.measured or []) - len(skips.records))


def _save(result: TurnRadius, folder: Path, source: ParameterSource, *, force: bool) -> None:
    from fieldsid.artifacts import save_record

    inputs = [p for p in source.paths if p.is_file()]
    rest = {k: v for k, v in body_of(result).items() if k not in ("schema", "figures")}
    save_record(folder / "turn_radius.yaml", result.SCHEMA, rest, inputs=inputs, force=force)
