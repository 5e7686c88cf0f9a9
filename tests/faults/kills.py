"""Kill commands at random times by -9, INT and TERM; look at what they leave: files cut short, hidden files, processes.

By name, for a longer run:

    python tests/faults/kills.py --count 200 [--seed 1]
"""

from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from contextlib import chdir, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
from cli import trial

from fieldsid.cli import app
from fieldsid.logs import load_run, save_run
from fieldsid.models.model import load_model
from fieldsid.plant.laws.axis_laws import load_laws
from fieldsid.records.named_inputs import sha256_of
from fieldsid.schedule.record import load_schedule

SIGNALS = (signal.SIGKILL, signal.SIGINT, signal.SIGTERM)
COMMANDS = {
    "import": ("import", "run.csv", "-o", "out/"),
    "identify": ("identify", "run.csv", "--axis", "yaw", "-o", "out"),
    "extend": ("extend", "model.yaml", "--add", "servo_lag", "run.csv", "-o", "out/model_lag.yaml"),
    "diagnose": ("diagnose", "run.csv", "other.csv", "--axis", "yaw", "-o", "out/diagnosis.yaml"),
    "fit": ("fit", "points.csv", "-o", "out/law.yaml", "--force"),
    "schedule": ("schedule", "design", "points.csv", "--fin-limit", "0.26", "-o", "out/gains.yaml", "--force"),
    "export": ("schedule", "export", "gains.yaml", "--into", "config.yaml", "--key", "heading", "--write"),
}
WHOLE_PNG = b"IEND\xaeB`\x82"
GONE_S = 3.0
"""How long a process may take to be gone after its parent."""


@dataclass(frozen=True)
class Killed:
    """One command, the signal it got after so many seconds, and what was wrong with what it left."""

    command: str
    signal: str
    after_s: float
    was_alive: bool
    wrong: tuple[str, ...]


def prepared(folder: Path) -> Path:
    """Make the files of a trial: two logs, a model, a table of parameters, a schedule and a configuration."""
    for name, seed in (("run", 3), ("other", 4)):
        made = load_run(trial.flown(folder, seed=seed, name=name))
        save_run(made, folder / f"{name}.csv")
        (folder / f"{name}.parquet").unlink()
    trial.model_file(folder).rename(folder / "model.yaml")
    rows = ["1.0,0.8,-0.6,0.01", "1.4,1.12,-1.17,0.02", "1.8,1.44,-1.94,0.03"]
    (folder / "points.csv").write_text("speed_m_s,a22,b2,C0\n" + "\n".join(rows) + "\n")
    with chdir(folder), redirect_stdout(StringIO()), redirect_stderr(StringIO()):
        if app.main(["schedule", "design", "points.csv", "--fin-limit", "0.26", "-o", "gains.yaml"]):
            raise RuntimeError("no schedule is made")
    (folder / "config.yaml").write_text("# mine\nheading: {}\nother: 1\n")
    return folder


def started(folder: Path, words) -> subprocess.Popen[bytes]:
    out = subprocess.DEVNULL
    return subprocess.Popen(
        [sys.executable, "-m", "fieldsid", *words], cwd=folder, stdout=out, stderr=out, start_new_session=True
    )


def done(folder: Path, words) -> float:
    """Run a command to its end and return how long it took, in s."""
    began = time.monotonic()
    if started(folder, words).wait() > 1:
        raise RuntimeError(f"{words} does not work")
    return time.monotonic() - began


def killed(folder: Path, name: str, which: signal.Signals, after_s: float) -> Killed:
    """Kill a command after some time and say what is wrong with what it left."""
    before = {p.name: sha256_of(p) for p in folder.iterdir() if p.is_file()}
    process = started(folder, COMMANDS[name])
    time.sleep(after_s)
    was_alive = process.poll() is None
    process.send_signal(which)
    process.wait()
    wrong = [f"process {p} lives on" for p in survivors(process.pid)]
    wrong += [f"`{n}` was changed" for n, sha in before.items() if n != "config.yaml" and sha256_of(folder / n) != sha]
    wrong += [f"`{p.name}` was left" for p in folder.rglob(".*")]
    wrong += [f"`{p.name}` is cut short" for p in folder.rglob("*") if p.is_file() and not is_whole(p)]
    return Killed(name, which.name, after_s, was_alive, tuple(wrong))


def survivors(session: int) -> list[int]:
    """Return the processes of a session that are still there after a while, and end them."""
    until = time.monotonic() + GONE_S
    while (found := _of_session(session)) and time.monotonic() < until:
        time.sleep(0.02)
    for process in found:
        os.kill(process, signal.SIGKILL)
    return found


def _of_session(session: int) -> list[int]:
    found = []
    for place in Path("/proc").glob("[0-9]*"):
        try:
            state, _, _, of = (place / "stat").read_text().rpartition(")")[2].split()[:4]
        except OSError:
            continue
        if int(of) == session and state != "Z":
            found.append(int(place.name))
    return found


def is_whole(path: Path) -> bool:
    """Whether a file is all of what it is to be, by its kind."""
    if path.suffix == ".png":
        return path.read_bytes().endswith(WHOLE_PNG)
    if path.suffix == ".parquet":
        return len(load_run(path)) > 10
    if path.name.startswith("config.yaml"):  # its backups too: `.bak`, `.bak2`
        return path.read_text().endswith("other: 1\n")
    readers = {"fieldsid/model/1": load_model, "fieldsid/fit/1": load_laws, "fieldsid/schedule/1": load_schedule}
    if path.suffix == ".yaml":
        schema = path.read_text().partition("\n")[0].removeprefix("schema: ")
        return readers[schema](path) is not None if schema in readers else path.read_text().endswith("\n")
    return path.suffix in {".csv", ".bak"}


def table(count: int, seed: int, folder: Path, commands=tuple(COMMANDS)) -> list[Killed]:
    """Kill commands, each in turn by each signal, at times drawn evenly over how long each takes."""
    random = np.random.default_rng(seed)
    prepared(folder)
    lasts = {name: done(folder, COMMANDS[name]) for name in commands}
    found = []
    for i in range(count):
        name = commands[i % len(commands)]
        _cleared(folder)
        found.append(killed(folder, name, SIGNALS[i // len(commands) % 3], float(random.uniform(0.1, 1.05)) * lasts[name]))
    return found


def _cleared(folder: Path) -> None:
    for path in [*folder.rglob(".*"), *(folder / "out").rglob("*")]:
        if path.is_file():
            path.unlink()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("commands", nargs="*", default=list(COMMANDS))
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        found = table(given.count, given.seed, Path(name), tuple(given.commands))
    print(f"{'command':10} {'signal':8} {'killed':>6} {'at work':>7} {'wrong':>5}")
    kinds = Counter((k.command, k.signal) for k in found)
    for (command, which), count in kinds.items():
        of = [k for k in found if (k.command, k.signal) == (command, which)]
        print(f"{command:10} {which:8} {count:6} {sum(k.was_alive for k in of):7} {sum(bool(k.wrong) for k in of):5}")
    wrong = [k for k in found if k.wrong]
    for k in wrong:
        print(f"{k.command} {k.signal} after {k.after_s:.2f} s: {'; '.join(k.wrong)}")
    print(f"{len(found)} kills, {sum(k.was_alive for k in found)} at work, {len(wrong)} left something wrong")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
