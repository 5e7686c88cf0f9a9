"""sysid turn-radius: radius over speed, both sides, with bands, against measured circles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fieldsid.cli.console import emit, messages, table, warn
from fieldsid.cli.options import Figures, Force, JsonFlag, MappingFile, ModelFiles, OutputDir, VehicleFile

if TYPE_CHECKING:
    from rich.console import Console

    from fieldsid.logs.run import Run
    from fieldsid.turning.prediction import TurnPrediction
    from fieldsid.turning.source import Source

Speeds = Annotated[
    str | None,
    typer.Option("--speeds", metavar="LIST", help="Speeds in m/s, 0.5:2.5:0.1 or 1.0,1.6; those of the models if not given."),
]
RudderMax = Annotated[
    float | None, typer.Option("--rudder-max", metavar="RAD", help="Rudder held in the turn; the vehicle's limit if not given.")
]
Measured = Annotated[
    list[Path] | None, typer.Option("--measured", metavar="RUN", help="Run of a turning circle to compare with; may repeat.")
]
Runs = Annotated[
    list[Path] | None,
    typer.Option("--runs", metavar="RUN", help="Runs to take the loss of speed from; the models' own if not given."),
]
Method = Annotated[str, typer.Option("--method", metavar="NAME", help="auto, u_turn, steady or simulated.")]
OwnLaw = Annotated[
    list[str] | None, typer.Option("--law", metavar="NAME=c0[,c1]", help="A law of your own, c0 + c1 u^2, as `b2=-0.23,-0.33`.")
]
FinZero = Annotated[
    float, typer.Option("--fin-zero", metavar="RAD", min=0.0, help="Fin offsets below this are not counted in the formula.")
]


def command(
    models: ModelFiles,
    speeds: Speeds = None,
    rudder_max: RudderMax = None,
    measured: Measured = None,
    runs: Runs = None,
    method: Method = "auto",
    law: OwnLaw = None,
    fin_zero: FinZero = 0.0175,
    mapping: MappingFile = None,
    vehicle: VehicleFile = None,
    output: OutputDir = None,
    figures: Figures = True,
    force: Force = False,
    as_json: JsonFlag = False,
) -> Mapping[str, Any]:
    """Predict the turning radius over speed, port and starboard apart, with 95 % bands.

    Models that carry effects are simulated to the settled circle, with the speed lost in the turn; a table, a fit file or
    first-order models go by the u-turn formula. Rows say what they rest on: measured, identified or extrapolated.

    Example: sysid turn-radius models/*.yaml --rudder-max 0.35 --measured circle.parquet -o turning/
    """
    from fieldsid.cli.inputs import read_runs
    from fieldsid.cli.speeds import speeds_of
    from fieldsid.turning.radius import turn_radius
    from fieldsid.turning.source import load_source

    source = load_source(models, laws=law or ())
    prediction = turn_radius(
        source,
        speeds_of(speeds) or [float(s) for s in dict.fromkeys(source.speeds)],
        _rudder(rudder_max, vehicle, source),
        runs=_runs(runs, source, mapping),
        measured=read_runs(measured, mapping=mapping) if measured else (),
        method=method,
        fin_zero=fin_zero,
    )
    body: dict[str, Any] = {"schema": "fieldsid/turn-radius/1", **prediction.record(), "figures": []}
    if output is not None:
        body["figures"] = _written(prediction, body, output, source, figures=figures, force=force)
    if not as_json:
        warn(prediction.notes)
    return emit(body, as_json=as_json, render=lambda to: _render(to, prediction, body))


def _rudder(given: float | None, vehicle: Path | None, source: Source) -> float:
    """Return the rudder of the turn: the option, the vehicle's limit, or the largest the models were trained on."""
    from fieldsid.errors import UsageError
    from fieldsid.vehicle import find_vehicle, load_vehicle

    if given is not None:
        return given
    known = load_vehicle(vehicle) if vehicle is not None else find_vehicle(Path())
    if known is not None and known.rudder_max_rad is not None:
        return known.rudder_max_rad
    trained = [m.trained["fin_max"] for m in source.models if m.trained.get("fin_max", 0.0) > 0]
    if trained:
        messages().print(f"rudder: {max(trained):.4g} rad, the largest in the models' runs; `--rudder-max` takes another")
        return max(trained)
    raise UsageError(
        "how far does the rudder go in the turn", found="no --rudder-max and no vehicle.yaml", hint="add `--rudder-max 0.26`"
    )


def _runs(given: Sequence[Path] | None, source: Source, mapping: Path | None) -> Sequence[Run]:
    """Return the runs the models came from: those given, else the inputs the model files name, where they still are."""
    from fieldsid.artifacts import read_yaml
    from fieldsid.cli.inputs import read_runs

    if given:
        return read_runs(given, mapping=mapping)
    if not any(m.effects for m in source.models):
        return ()
    named = [Path(i["path"]) for p in source.paths for i in read_yaml(p).get("inputs", [])]
    there = [p for p in dict.fromkeys(named) if p.is_file() or p.is_dir()]
    if len(there) < len(dict.fromkeys(named)):
        messages().print("some runs of the models are not where they were: name them with `--runs` for the loss of speed")
    return read_runs(there, mapping=mapping) if there else ()


def _written(
    prediction: TurnPrediction, body: Mapping[str, Any], folder: Path, source: Source, *, figures: bool, force: bool
) -> list[str]:
    from fieldsid.artifacts import save_record
    from fieldsid.figures.canvas import save
    from fieldsid.figures.turn import figure, track_figure

    inputs = [p for p in source.paths if p.is_file()]
    rest = {k: v for k, v in body.items() if k not in ("schema", "figures")}
    save_record(folder / "turn_radius.yaml", "fieldsid/turn-radius/1", rest, inputs=inputs, force=force)
    if not figures:
        return []
    drawn = [save(figure(prediction), folder / "turn_radius.png", force=force)]
    drawn += [save(track_figure(m.turn), folder / f"circle_{m.turn.run}.png", force=force) for m in prediction.measured]
    return [str(p) for p in drawn]


def _render(to: Console, prediction: TurnPrediction, body: Mapping[str, Any]) -> None:
    from fieldsid.rounding import number

    columns = ("side", "m/s", "radius m", "from", "to (95 %)", "deg/s", "180 deg s", "trust")
    rows = [
        (
            r.side,
            number(r.speed, 3),
            number(r.radius, 3),
            number(r.interval95[0], 3),
            number(r.interval95[1], 3),
            number(r.yaw_rate_max * 57.29577951308232, 3),
            number(r.u_turn_time, 3),
            r.trust,
        )
        for r in prediction.rows
    ]
    to.print(
        table(f"rudder {prediction.rudder_max:.4g} rad, {', '.join(sorted({r.method for r in prediction.rows}))}", columns, rows)
    )
    _render_measured(to, prediction)
    for reason in dict.fromkeys(b for r in prediction.rows for b in r.because):
        to.print(f"extrapolated: {reason}")
    settle = next((r.settle_with for r in prediction.rows if r.because), "")
    if settle:
        to.print(f"what would settle it: {settle}")
    for side, best in body["minimum"].items():
        if best:
            to.print(f"tightest at higher speed, {side}: {best['radius_m']:.2f} m at {best['speed_m_s']:.2f} m/s")
    for path in body["figures"]:
        to.print(f"figure: {path}", soft_wrap=True)


def _render_measured(to: Console, prediction: TurnPrediction) -> None:
    from fieldsid.rounding import number, with_error

    if not prediction.measured:
        return
    rows = []
    for m in prediction.measured:
        circle = m.turn.circle
        off = 100.0 * (m.predicted / circle.radius - 1.0)
        band = f"{number(m.predicted95[0], 3)} .. {number(m.predicted95[1], 3)}"
        radius = with_error(circle.radius, circle.radius_std_error)
        rows.append((m.turn.run, number(m.turn.fin, 3), radius, number(m.predicted), band, f"{off:+.1f}"))
    to.print()
    to.print(table("measured circles", ("run", "fin", "radius m", "predicted", "95 %", "off %"), rows))
