"""sysid simulate: a model's own prediction of a maneuver or of a run's fin, as a run."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from fieldsid.cli.console import emit
from fieldsid.cli.options import Force, MappingFile, ModelFile, OutputFile, option
from fieldsid.cli.voice import angles
from fieldsid.display import page_of
from fieldsid.errors import UsageError
from fieldsid.page import Page, written

if TYPE_CHECKING:
    from fieldsid.logs.run import Run
    from fieldsid.models.model import Model


def command(
    model: ModelFile,
    maneuver: Annotated[str | None, option("--maneuver", "SPEC", "`zigzag`, or `zigzag:amplitude=15deg,turn=20deg`.")] = None,
    run: Annotated[Path | None, option("--run", "RUN", "Replay the fin of this run.")] = None,
    mapping: MappingFile = None,
    speed: Annotated[float | None, option("--speed", "M_S", "Speed; the model's own if not given.")] = None,
    fin_max: Annotated[str, option("--fin-max", "ANGLE", "Largest fin angle, trim included: `20deg` or `0.35rad`.")] = "0.35rad",
    rate: Annotated[float, option("--rate", "HZ", "Samples per second of a maneuver.", min=1.0, max=1000.0)] = 20.0,
    noise: Annotated[int | None, option("--noise", "SEED", "Add the model's sensor noise from this seed.")] = None,
    output: OutputFile = None,
    force: Force = False,
) -> Mapping[str, Any]:
    """Simulate a model: fly a maneuver with it, or replay a run's fin, and keep the motion as a run.

    A maneuver starts from rest about trim; the autopilot steers before, between and after its parts. A replay starts from the
    run's first measured angle and rate. Without `-o` nothing is written.

    Example: sysid simulate model.yaml --maneuver zigzag:amplitude=15deg --speed 1.4 -o zigzag.csv
    """
    from fieldsid.cli.headlines.models import headline_of_simulation
    from fieldsid.cli.inputs import read_run
    from fieldsid.cli.user_effects import read_model
    from fieldsid.face.speeds import refuse_speed
    from fieldsid.results.logs import SignalRange, Simulation

    if (maneuver is None) == (run is None):
        raise UsageError(
            "give either a maneuver or a run",
            found="both" if run else "neither",
            hint="`--maneuver square_pulses` or `--run RUN`",
        )
    if speed is not None:
        refuse_speed(speed, f"--speed {speed:g}")
    known = read_model(model)
    if run is None:
        made = _fly_maneuver(known, maneuver or "", speed, fin_max, rate)
    else:
        made = _replay_run(known, read_run(run, mapping=mapping, models=[model]), speed)
    if noise is not None:
        from fieldsid.planning.flight.dry_run import with_noise

        made = with_noise(made, known, noise)
    if output is not None:
        from dataclasses import replace

        from fieldsid.logs import save_run
        from fieldsid.logs.run import SIMULATED, Note

        note = Note(SIMULATED, f"made by the model {model}, not measured", {"model": str(model)})
        made = replace(made, name=Path(output.name.removesuffix(".gz")).stem, notes=(*made.notes, note))
        save_run(made, output, force=force)
    signals = {n: SignalRange(float(v.min()), float(v.max()), float(v[-1])) for n, v in made.signals.items()}
    result = Simulation(
        model=str(model),
        run=made.name,
        file=None if output is None else str(output),
        samples=len(made),
        seconds=float(made.time[-1] - made.time[0]),
        signals=signals,
    )
    headline = headline_of_simulation(result, known.axis.value, maneuver, run)
    page = Page("", blocks=page_of(made, angles()).blocks, closing=written(run=result.file))
    return emit(result, render=page, headline=headline)


def _fly_maneuver(model: Model, spec: str, speed: float | None, fin_max: str, rate: float) -> Run:
    from fieldsid.angles import FIN, TILT, parse_angle
    from fieldsid.maneuvers import Limits, Schedule, parse_spec
    from fieldsid.planning.flight.dry_run import dry_run

    return dry_run(
        model,
        *parse_spec(spec),
        speed=model.law.reference if speed is None else speed,
        limits=Limits(parse_angle(fin_max, "--fin-max", FIN, TILT)),
        schedule=Schedule(rate_hz=rate),
    )


def _replay_run(model: Model, run: Run, speed: float | None) -> Run:
    """Return the model's motion under the fin of a run, at a constant speed in m/s where one is given."""
    from dataclasses import replace

    from fieldsid.dynamics.free_run import simulate
    from fieldsid.models.record import record_of
    from fieldsid.planning.flight.dry_run import replayed

    record = record_of(run, model.axis)
    record = record if speed is None else replace(record, speed=speed)
    return replayed(model, record, simulate(model, record))
