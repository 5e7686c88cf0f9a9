"""An archive of logs through `sysid batch`: rows, what is skipped and why, resumed after a kill, two processes against one.

    python tests/benchmarks/archive.py [--logs 300] [--broken 20]

Pulses of one vehicle at several speeds, a third of them with a slow servo and a third with quadratic damping hidden in it, and
files that are broken in ten ways. The batch is killed when it knows a third of the logs, begun again, and then timed from
nothing with two processes and with one.
"""

from __future__ import annotations

import argparse
import gzip
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pandas as pd

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from cli import trial

HIDDEN = (None, ("servo_lag", {"lag": 0.35}), ("quadratic_damping", {"quadratic": 5.0}))
SPEEDS = (1.0, 1.4, 1.8)
HEADER = "time_s,yaw_rad,yaw_rate_rad_s,rudder_rad\n"


def rows_of(time_s: Callable[[int], object], rest: str = "0.1,0.01,0.1", count: int = 400) -> str:
    return HEADER + "".join(f"{time_s(i)},{rest}\n" for i in range(count))


BROKEN: tuple[tuple[str, bytes], ...] = (
    ("empty.csv", b""),
    ("header.csv", HEADER.encode()),
    ("prose.csv", b"the vehicle was lost at noon\nand found at one\n"),
    ("binary.csv", bytes(range(256)) * 40),
    ("resting.csv", rows_of(lambda i: i / 20).encode()),
    ("standing_clock.csv", rows_of(lambda _: 1.0).encode()),
    ("words.csv", rows_of(lambda i: i / 20, "a,b,c").encode()),
    ("no_fin.csv", rows_of(lambda i: i / 20, "0.1,0.01,").encode()),
    ("cut.csv.gz", gzip.compress(rows_of(lambda i: i / 20).encode())[:300]),
    ("cut.parquet", b"PAR1" + bytes(200)),
)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--logs", type=int, default=300, help="of which some are broken")
    parser.add_argument("--broken", type=int, default=20)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        logs, work = Path(folder, "logs"), Path(folder)
        made(logs, asked.logs - asked.broken, asked.broken)
        known_at_kill = killed(logs, work / "killed", asked.logs // 3)
        resumed = batch(logs, work / "killed", 2)
        report("killed, then resumed", resumed)
        print(f"  {known_at_kill} logs were known when it was killed, {resumed['known_logs']} were not done again")
        two, one = batch(logs, work / "two", 2), batch(logs, work / "one", 1)
        report("two processes", two)
        report("one process", one)
        print(f"  one over two: {one['seconds'] / two['seconds']:.2f}; the same tables: {same(resumed, two) and same(two, one)}")
    for reason, count in Counter(
        f"{Path(r['file']).name.split('-')[0]}: {r['what'].split('`')[-1]}" for r in two["skipped_runs"]
    ).items():
        print(f"  skipped {count} x {reason}")
    return 0


def made(folder: Path, good: int, broken: int) -> None:
    """Write the archive."""
    folder.mkdir()
    for i in range(good):
        speed = SPEEDS[i // len(HIDDEN) % len(SPEEDS)]
        trial.flown(folder, speed=speed, seed=i, name=f"run{i:03d}", hidden=HIDDEN[i % len(HIDDEN)])
    for i in range(broken):
        name, held = BROKEN[i % len(BROKEN)]
        first, _, suffix = name.partition(".")
        (folder / f"{first}-{i}.{suffix}").write_bytes(held)


def command(logs: Path, output: Path, workers: int) -> list[str]:
    return [
        sys.executable,
        "-m",
        "fieldsid",
        "batch",
        str(logs),
        "--axis",
        "yaw",
        "-o",
        str(output),
        "--workers",
        str(workers),
        "--json",
    ]


def batch(logs: Path, output: Path, workers: int) -> dict:
    """Run a batch to its end and return its JSON."""
    done = subprocess.run(command(logs, output, workers), capture_output=True, text=True, check=False)
    if done.returncode != 1:  # some logs are broken
        raise SystemExit(done.stderr)
    return json.loads(done.stdout)


def killed(logs: Path, output: Path, after: int) -> int:
    """Begin a batch, kill it and its processes when it has answered for so many logs, and return for how many it had."""
    with subprocess.Popen(command(logs, output, 2), stdout=subprocess.DEVNULL, start_new_session=True) as running:
        while (known := answers(output)) < after and running.poll() is None:
            time.sleep(0.2)
        os.killpg(running.pid, signal.SIGKILL)
    return known


def answers(output: Path) -> int:
    return sum(1 for p in output.rglob("*.json"))


def report(title: str, body: dict) -> None:
    found = ", ".join(f"{name} {count}" for name, count in body["verdicts"].items())
    print(f"{title}: {body['runs']} runs of {body['logs']} logs, {len(body['skipped_runs'])} skipped, {body['seconds']:.0f} s")
    print(f"  {found}; {', '.join(f'{name} {count}' for name, count in body['effects'].items())}", flush=True)


def same(a: dict, b: dict) -> bool:
    """Whether two tables have the same rows."""
    one, two = (pd.read_parquet(x["table"]).sort_values("log", ignore_index=True) for x in (a, b))
    columns = ["log", "status", "verdict", "effects", "a22", "b2", "C0"]
    return one[columns].equals(two[columns])


if __name__ == "__main__":
    raise SystemExit(main())
