"""sysid simulate: a model's own prediction of a maneuver or of a run's fin, as a run."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from fieldsid.angles import FIN, TILT, parse_angle
from fieldsid.cli import options
from fieldsid.cli.console import Body, emit
from fieldsid.cli.options import option
from fieldsid.cli.voice import angles
from fieldsid.display import page_of
from fieldsid.errors import UsageError
from fieldsid.face.speeds import refuse_speed
from fieldsid.page import Page, written

if TYPE_CHECKING:
    from fieldsid.logs.run import Run
    from fieldsid.models.model import Model


class Options(options.ToFile, options.Mapped, options.OneModel):
    """What `sysid simulate` takes."""

    maneuver: str | None = option("--maneuver SPEC", "`zigzag`, or `zigzag:amplitude=15deg,turn=20deg`.")
    run: Path | None = option("--run RUN", "Replay the fin of this run.")
    speed: float | None = option("--speed M_S", "Speed; the model's own if not given.")
    fin_max: float = option(
        "--fin-max ANGLE", "Largest fin angle, trim included: `20deg` or `0.35rad`.", default="0.35rad",
        parse=(parse_angle, FIN, TILT),
    )  # fmt: skip
    rate: float = option("--rate HZ", "Samples per second of a maneuver.", default=20.0, min=1.0, max=1000.0)
    noise: int | None = option("--noise SEED", "Add the model's sensor noise from this seed.")


@options.takes(Options)
def command(given: Options) -> Body:
    """Simulate a model: fly a maneuver with it, or replay a run's fin, and keep the motion as a run.

    A maneuver starts from rest about trim; the autopilot steers before, between and after its parts. A replay starts from the
    run's first measured angle and rate. Without `-o` nothing is written.

    Example: sysid simulate model.yaml --maneuver zigzag:amplitude=15deg --speed 1.4 -o zigzag.csv
    """
    from fieldsid.cli.headlines.models import headline_of_simulation
    from fieldsid.cli.user_effects import read_model
    from fieldsid.results.logs import SignalRange, Simulation

    if (given.maneuver is None) == (given.run is None):
        raise UsageError(
            "give either a maneuver or a run",
            found="both" if given.run else "neither",
            hint="`--maneuver square_pulses` or `--run RUN`",
        )
    if given.speed is not None:
        refuse_speed(given.speed, f"--speed {given.speed:g}")
    known, model = read_model(given.model), str(given.model)
    made = _motion(known, given)
    if given.output is not None:
        made = _save(made, model, given.output, force=given.force)
    signals = {n: SignalRange(float(v.min()), float(v.max()), float(v[-1])) for n, v in made.signals.items()}
    file, seconds = None if given.output is None else str(given.output), float(made.time[-1] - made.time[0])
    result = Simulation(model=model, run=made.name, file=file, samples=len(made), seconds=seconds, signals=signals)
    headline = headline_of_simulation(result, known.axis.value, given.maneuver, given.run)
    page = Page("", blocks=page_of(made, angles()).blocks, closing=written(run=file))
    return emit(result, render=page, headline=headline)


def _motion(model: Model, given: Options) -> Run:
    """Return the model's motion in a maneuver or under the fin of a run, with noise where that is asked for."""
    from fieldsid.cli.inputs import read_run
    from fieldsid.planning.flight.dry_run import with_noise

    if given.run is None:
        made = _fly_maneuver(model, given)
    else:
        made = _replay_run(model, read_run(given.run, mapping=given.mapping, models=[given.model]), given.speed)
    return made if given.noise is None else with_noise(made, model, given.noise)


def _save(made: Run, model: str, output: Path, *, force: bool) -> Run:
    """Write a simulated run with a note on its model, and return it."""
    from fieldsid.logs import save_run
    from fieldsid.logs.run import SIMULATED, Note

    note = Note(SIMULATED, f"made by the model {model}, not measured", {"model": model})
    noted = replace(made, name=Path(output.name.removesuffix(".gz")).stem, notes=(*made.notes, note))
    save_run(noted, output, force=force)
    return noted


def _fly_maneuver(model: Model, given: Options) -> Run:
    from fieldsid.maneuvers import Limits, Schedule, parse_spec
    from fieldsid.planning.flight.dry_run import dry_run

    return dry_run(
        model,
        *parse_spec(given.maneuver or ""),
        speed=model.law.reference if given.speed is None else given.speed,
        limits=Limits(given.fin_max),
        schedule=Schedule(rate_hz=given.rate),
    )


def _replay_run(model: Model, run: Run, speed: float | None) -> Run:
    """Return the model's motion under the fin of a run, at a constant speed in m/s where one is given."""
    from fieldsid.dynamics.free_run import simulate
    from fieldsid.models.record import record_of
    from fieldsid.planning.flight.dry_run import replayed

    record = record_of(run, model.axis)
    record = record if speed is None else replace(record, speed=speed)
    return replayed(model, record, simulate(model, record))
