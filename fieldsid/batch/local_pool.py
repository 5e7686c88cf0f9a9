"""The workers of this machine: processes that take logs one by one, and are replaced when they end, hang or take too much."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time as clock
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from queue import Empty, SimpleQueue
from select import select
from threading import Event

from fieldsid.batch.rows import Row, failed_row
from fieldsid.batch.task import Task
from fieldsid.batch.worker import ENVIRONMENT

LOGS_A_PROCESS = 50
"""Logs after which a process is replaced: memory that libraries do not release would add up over an archive."""
TRIES = 2
LOOK_S = 0.5
PAGE = os.sysconf("SC_PAGE_SIZE") if hasattr(os, "sysconf") else 4096
COMMAND = (sys.executable, "-P", "-m", "fieldsid.batch.worker")
"""With -P no module is looked for in the working folder."""


def run_here(tasks: Sequence[Task], workers: int, *, timeout_s: float, memory_mb: float) -> Iterator[tuple[Task, list[Row]]]:
    """Yield each task with its rows as they are computed, by `workers` processes.

    A process that takes longer than timeout_s on a log, or more than memory_mb, is ended, and the row of the log says so. A log
    whose process ends unexpectedly is tried once more by another.
    """
    crew = _Crew(timeout_s, memory_mb)
    with ThreadPoolExecutor(max(min(workers, len(tasks)), 1)) as pool:
        asked = {pool.submit(crew.rows, task): task for task in tasks}
        try:
            for answer in as_completed(asked):
                yield asked[answer], answer.result()
        finally:
            pool.shutdown(wait=False, cancel_futures=True)  # first, so that no process is started that is ended at once
            crew.dismiss()


@dataclass
class _Process:
    """A worker process, and the number of logs it has had."""

    process: subprocess.Popen[bytes]
    had: int = 0

    def rows(self, task: Task, timeout_s: float, memory_mb: float) -> list[Row] | None:
        """Return the rows of a task, those of a failure where it exceeds a limit; None where the process has ended."""
        stdin, stdout, answer = self.process.stdin, self.process.stdout, b""
        if stdin is None or stdout is None:
            return None
        with suppress(BrokenPipeError):  # it has ended: its closed output shows that
            stdin.write(json.dumps(task.plain()).encode() + b"\n")
            stdin.flush()
        self.had, since = self.had + 1, clock.monotonic()
        while not answer.endswith(b"\n"):
            if select([stdout], [], [], LOOK_S)[0]:
                if not (part := os.read(stdout.fileno(), 1 << 16)):
                    self.process.wait()
                    return None
                answer += part
            elif (took := clock.monotonic() - since) > timeout_s:
                return self._failed(task, f"it took longer than {timeout_s:g} s", f"{took:.0f} s", "raise `--timeout`")
            elif (memory := self._memory_mb()) > memory_mb:
                return self._failed(task, f"it took more memory than {memory_mb:g} MB", f"{memory:.0f} MB", "raise `--memory`")
        rows: list[Row] = json.loads(answer)
        return rows

    def end(self) -> None:
        """End the process."""
        self.process.kill()
        self.process.wait()
        for stream in (self.process.stdin, self.process.stdout):
            if stream is not None:
                with suppress(BrokenPipeError):
                    stream.close()

    def _failed(self, task: Task, *why: str) -> list[Row]:
        self.process.kill()
        self.process.wait()
        return [failed_row(task, "failed", *why)]

    def _memory_mb(self) -> float:
        """Return its resident memory in MB, 0 where the system does not report it."""
        try:
            pages = int(Path(f"/proc/{self.process.pid}/statm").read_text(encoding="ascii").split()[1])
        except (OSError, IndexError, ValueError):
            return 0.0
        return pages * PAGE / 1e6


@dataclass
class _Crew:
    """The processes, one for each thread that asks, and those of them that have no task."""

    timeout_s: float
    memory_mb: float
    members: list[_Process] = field(default_factory=list)
    idle: SimpleQueue[_Process] = field(default_factory=SimpleQueue)
    is_dismissed: Event = field(default_factory=Event)

    def rows(self, task: Task) -> list[Row]:
        """Return the rows of a task, asking another process where one ends unexpectedly."""
        code = 0
        for _ in range(TRIES):
            one = self._ready()
            rows = one.rows(task, self.timeout_s, self.memory_mb)
            self.idle.put(one)
            if rows is not None or self.is_dismissed.is_set():
                return rows or []
            code = one.process.wait()
        by = f"signal {-code}" if code < 0 else f"exit code {code}"
        what = f"the process that read it ended {TRIES} times"
        return [failed_row(task, "failed", what, by, "try it alone: `sysid identify`")]

    def dismiss(self) -> None:
        """End all processes."""
        self.is_dismissed.set()
        for one in self.members:
            one.end()

    def _ready(self) -> _Process:
        """Return a process that waits for a task: an idle one, unless it has ended or had its share of logs, else a new one."""
        with suppress(Empty):
            one = self.idle.get_nowait()
            if one.had < LOGS_A_PROCESS and one.process.poll() is None:
                return one
            one.end()
        pipe, environment = subprocess.PIPE, os.environ | ENVIRONMENT
        made = subprocess.Popen(
            COMMAND, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL, env=environment, start_new_session=True
        )
        one = _Process(made)
        self.members.append(one)
        if self.is_dismissed.is_set():
            one.end()
        return one
