"""The workers of this machine: processes that take logs one by one, and are replaced when they end, hang or take too much."""

from __future__ import annotations

import json
import os
import selectors
import subprocess
import sys
import time as clock
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fieldsid.batch.rows import Row, failed_row
from fieldsid.batch.task import Task
from fieldsid.batch.worker import ENVIRONMENT

LOGS_A_PROCESS = 50
"""Logs after which a process is replaced: memory that libraries do not release would add up over an archive."""
TRIES = 2
LOOK_S = 0.5
PAGE = os.sysconf("SC_PAGE_SIZE") if hasattr(os, "sysconf") else 4096


@dataclass
class _Process:
    """A worker process, its task and the start of that, and the number of logs it has had."""

    process: subprocess.Popen[bytes]
    task: Task | None = None
    since: float = 0.0
    had: int = 0
    answer: bytearray = field(default_factory=bytearray)

    def give(self, task: Task) -> None:
        self.task, self.since, self.had = task, clock.monotonic(), self.had + 1
        self.answer.clear()
        stdin = self.process.stdin
        if stdin is not None:
            try:
                stdin.write(json.dumps(task.plain()).encode() + b"\n")
                stdin.flush()
            except BrokenPipeError:
                return  # it has ended: its closed output shows that, and the log is tried again

    def end(self) -> None:
        self.process.kill()
        self.process.wait()
        for stream in (self.process.stdin, self.process.stdout):
            if stream is not None:
                try:
                    stream.close()
                except BrokenPipeError:
                    continue

    def memory_mb(self) -> float:
        """Return its resident memory in MB, 0 where the system does not report it."""
        try:
            pages = int(Path(f"/proc/{self.process.pid}/statm").read_text(encoding="ascii").split()[1])
        except (OSError, IndexError, ValueError):
            return 0.0
        return pages * PAGE / 1e6


def run_here(tasks: Sequence[Task], workers: int, *, timeout_s: float, memory_mb: float) -> Iterator[tuple[Task, list[Row]]]:
    """Yield each task with its rows as they are computed, by `workers` processes.

    A process that takes longer than timeout_s on a log, or more than memory_mb, is ended, and the row of the log says so. A log
    whose process ends unexpectedly is tried once more by another.
    """
    with closing(_Crew(tasks)) as crew:
        for _ in range(min(workers, len(tasks))):
            crew.hire()
        while crew.is_at_work:
            for one in crew.heard():
                yield from crew.answers(one)
            for one in [o for o in crew.members if o.task]:
                task, why = one.task, _exceeded_limit(one, timeout_s, memory_mb)
                if why and task is not None:
                    yield task, [failed_row(task, "failed", *why)]
                    crew.dismiss(one)


class _Crew:
    """The running processes and the waiting tasks."""

    def __init__(self, tasks: Sequence[Task]) -> None:
        self.waiting, self.tries = deque(tasks), dict.fromkeys(tasks, 0)
        self.members: list[_Process] = []
        self._selector = selectors.DefaultSelector()

    @property
    def is_at_work(self) -> bool:
        """Whether one of the processes has a task."""
        return any(one.task for one in self.members)

    def hire(self) -> None:
        """Start a process and give it a task."""
        one = _start_process()
        self.members.append(one)
        self._selector.register(_output(one), selectors.EVENT_READ, one)
        self._give_next(one)

    def dismiss(self, one: _Process) -> None:
        """End a process, and start another where tasks wait."""
        self._selector.unregister(_output(one))
        self.members.remove(one)
        one.end()
        if self.waiting:
            self.hire()

    def heard(self) -> list[_Process]:
        """Wait a moment and return the processes with output or that have ended."""
        return [key.data for key, _ in self._selector.select(LOOK_S)]

    def answers(self, one: _Process) -> Iterator[tuple[Task, list[Row]]]:
        """Yield the answer of a process, if there is one, and give it the next task."""
        part, task = os.read(_output(one).fileno(), 1 << 16), one.task
        one.answer += part
        if not part:
            yield from self._ended(one, task)
        elif task is not None and one.answer.endswith(b"\n"):
            yield task, json.loads(one.answer)
            if one.had >= LOGS_A_PROCESS:
                self.dismiss(one)
            else:
                self._give_next(one)

    def close(self) -> None:
        """End all processes."""
        for one in self.members:
            one.end()
        self._selector.close()

    def _ended(self, one: _Process, task: Task | None) -> Iterator[tuple[Task, list[Row]]]:
        """Queue the task of a process that ended unexpectedly again; the second time yield a row that says so."""
        if task is not None:
            code = one.process.wait()
            if self.tries[task] < TRIES:
                self.waiting.append(task)
            else:
                yield task, [_ended(task, code)]
        self.dismiss(one)

    def _give_next(self, one: _Process) -> None:
        one.task = None
        if self.waiting:
            task = self.waiting.popleft()
            self.tries[task] += 1
            one.give(task)


def _start_process() -> _Process:
    command = [sys.executable, "-P", "-m", "fieldsid.batch.worker"]  # -P: no module is looked for in the working folder
    environment = os.environ | ENVIRONMENT
    process = subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=environment, start_new_session=True
    )
    return _Process(process)


def _output(one: _Process) -> Any:
    return one.process.stdout


def _ended(task: Task, code: int) -> Row:
    by = f"signal {-code}" if code < 0 else f"exit code {code}"
    return failed_row(task, "failed", f"the process that read it ended {TRIES} times", by, "try it alone: `sysid identify`")


def _exceeded_limit(one: _Process, timeout_s: float, memory_mb: float) -> tuple[str, str, str] | None:
    took = clock.monotonic() - one.since
    if took > timeout_s:
        return f"it took longer than {timeout_s:g} s", f"{took:.0f} s", "raise `--timeout`"
    memory = one.memory_mb()
    if memory > memory_mb:
        return f"it took more memory than {memory_mb:g} MB", f"{memory:.0f} MB", "raise `--memory`"
    return None
