"""Workers: forked copies of this process, each for one piece of work, that answer with bytes.

A worker sees all objects of this process without pickling; only its answer is pickled. A ProcessPoolExecutor of one worker
(`concurrent.futures`), initialised once with the records, the effects and the compiled kernels, was measured against a worker
forked for each shared map on five runs of `sysid diagnose` (four yaw, one pitch; 3 or 5 logs of 44 to 57 s; medians of three; two
cores):

    a worker forked for each map        1.29 to 2.13 s
    executor, start method fork         1.39 to 2.35 s      8 to 10 % more, and every closure pickled with its variables
    executor, start method spawn        2.23 to 3.23 s     52 to 73 % more
    one process, one core               1.72 to 3.01 s     30 to 45 % more

Only spawn works on macOS and with other threads, and there a second process costs more than it saves: where this process cannot
be forked (`can_fork`), it does all of the work itself.
"""

from __future__ import annotations

import ctypes
import os
import select
import signal
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Never, Self

IS_WORKER = "FIELDSID_IS_WORKER"
"""Environment variable that is set in a process that must not fork."""
END_OF_ANSWER = b"end of answer"
"""The last bytes of a complete answer."""
PR_SET_PDEATHSIG = 1
"""The option of Linux's prctl(2) that names the signal a process gets when its parent ends."""


class Worker:
    """A forked worker. The end of its context waits for it where there is an error or the worker gave no answer.

    Otherwise this process continues at once, as the system takes some milliseconds to remove a copy of this process; the worker
    is reaped when the next one is forked, see `_ending`.
    """

    def __init__(self, process: int, source: int) -> None:
        self.process, self._stream, self._has_died = process, os.fdopen(source, "rb"), False

    def answer(self) -> bytes | None:
        """Wait for the worker's answer and return it; None where it ended without one."""
        answer = self._stream.read()
        self._has_died = not answer.endswith(END_OF_ANSWER)
        return None if self._has_died else answer.removesuffix(END_OF_ANSWER)

    def is_running(self) -> bool:
        """Whether the worker has neither answered nor ended."""
        return not select.select([self._stream], [], [], 0.0)[0]

    def kill(self) -> None:
        """Kill the worker and wait for its end."""
        os.kill(self.process, signal.SIGKILL)
        self._stream.close()
        os.waitpid(self.process, 0)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, error: object, *_more: object) -> None:
        if error is None and not self._has_died:
            self._stream.close()
            _ending.append(self.process)
        else:
            self.kill()


_ending: list[int] = []
"""Workers that have answered but have not been reaped; the last ones remain as zombies until this process ends."""


def job_queue(count: int) -> int:
    """Return the read end of a pipe with the numbers below count, each of which only one of the processes reads."""
    source, target = os.pipe()
    with os.fdopen(target, "wb") as stream:
        stream.write(bytes(range(count)))
    return source


def fork_worker(work: Callable[[], bytes]) -> Worker | None:
    """Return a forked worker that does the work; None where this process cannot be forked.

    Side effects of the work occur in the worker only; its output and errors are discarded. The worker ends with its parent
    process, however that ends.
    """
    source, target = os.pipe()
    process = fork()
    if process is None:
        os.close(source)
        os.close(target)
        return None
    if process == 0:
        os.close(source)
        _work(work, target)
    os.close(target)
    return Worker(process, source)


def fork() -> int | None:
    """Fork this process, and return 0 in the worker, its process id here; None where this process cannot be forked.

    The worker has no output, and ends with this process. It must always end by `os._exit`.
    """
    if not can_fork():
        return None
    while _ending:
        os.waitpid(_ending.pop(), 0)
    parent = os.getpid()
    try:
        process = os.fork()
    except OSError:  # there is too little memory, or there are too many processes
        return None
    if process == 0:
        _enter_worker(parent)
    return process


def _enter_worker(parent: int) -> None:
    """Make this process a worker of its parent: without output and without further workers."""
    try:
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:  # the parent ended before the signal was requested
            os._exit(0)
        os.environ[IS_WORKER] = "1"
        _ending.clear()
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.dup2(nowhere, 2)
    except BaseException:  # noqa: BLE001 - what it goes on to would be done twice
        os._exit(1)


def _work(work: Callable[[], bytes], target: int) -> Never:
    """Write the answer of the work and end the worker without the usual clean-up at exit."""
    try:
        answer = work()
        with os.fdopen(target, "wb") as stream:
            stream.write(answer + END_OF_ANSWER)
    finally:
        os._exit(0)


def can_fork() -> bool:
    """Whether this process may be forked: on Linux, with a second core, without other threads, and not a worker itself.

    Another thread may hold a lock that the worker would wait for. The libraries of macOS do not survive a fork.
    """
    if not sys.platform.startswith("linux") or IS_WORKER in os.environ:
        return False
    return len(os.sched_getaffinity(0)) > 1 and threading.active_count() == 1 and not _fork_warns()


def _fork_warns() -> bool:
    """Whether os.fork would issue a DeprecationWarning: from Python 3.12 with any other thread, those of libraries included."""
    threads = Path("/proc/self/task")
    return sys.version_info >= (3, 12) and (not threads.is_dir() or sum(1 for _ in threads.iterdir()) > 1)
