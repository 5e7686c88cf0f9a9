"""sysid init: a trial folder: vehicle.yaml, mapping.yaml, notes, runs, models, journal."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

from fieldsid.cli.options import argument, option


def command(
    name: str = argument("NAME", "Name of the trial, and of the folder to make."),
    template: str = option("--template KIND", "Kind of vehicle: torpedo or surface.", default="torpedo"),
) -> None:
    """Make a trial folder with a vehicle.yaml, a mapping.yaml and notes to fill in; nothing is ever replaced.

    A command run in it takes from there what is not typed: the vehicle, the mapping, the runs, the models and the gains. It
    adds a line to journal.jsonl: when, what, the hashes of what went in and came out, the result. `sysid status` reads it.

    Example: sysid init pandan --template torpedo
    """
    from fieldsid.cli.console import emit
    from fieldsid.cli.headlines.trial import headline_of_trial
    from fieldsid.page import Page
    from fieldsid.results.trial import Init
    from fieldsid.trial_folder.journal import JOURNAL, Entry, Hashes, append
    from fieldsid.trial_folder.make import new_trial

    folder = Path(name)
    files = new_trial(folder, template)
    hashes = Hashes(folder, ())
    time, words = datetime.now(UTC).isoformat(timespec="seconds"), ("sysid", "init", name, "--template", template)
    verdict = f"a trial folder for a {template} vehicle"
    append(folder, Entry(time, words, 0, 0.0, verdict, (), tuple(hashes.stamp(f) for f in files)))
    files = [*files, folder / JOURNAL]
    result = Init(name, template, tuple(map(str, files)))
    emit(result, render=Page("", closing=result.files), headline=headline_of_trial(result))
