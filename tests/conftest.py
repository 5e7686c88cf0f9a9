"""Settings and fixtures of all tests: environment, distribution over processes, and the program run in this process."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from hashlib import sha256
from io import StringIO
from pathlib import Path
from typing import Any

os.environ.setdefault("MPLBACKEND", "Agg")
# Before NumPy is loaded: the systems solved here are tiny, and threads that wait for a busy core cost ten times the work.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import pytest
from hypothesis import settings
from xdist.scheduler import LoadScopeScheduling

from fieldsid.cli.app import main
from fieldsid.runtime.worker_pool import can_fork

ROOT = Path(__file__).resolve().parents[1]


def _stamp_of_kernels() -> str:
    """Return a hash of every file that holds a compiled function."""
    digest = sha256()
    for path in sorted((*ROOT.glob("fieldsid/**/*.py"), *ROOT.glob("tests/truth/*.py"))):
        text = path.read_bytes()
        if b"jit" in text:
            digest.update(text)
    return digest.hexdigest()[:16]


# numba checks only the file of a kernel: it would reuse one that was compiled with an older kernel of another file.
# Nothing imported above loads numba, which reads this variable once.
os.environ.setdefault("NUMBA_CACHE_DIR", str(ROOT / ".pytest_cache" / "numba" / _stamp_of_kernels()))

# The same examples on every machine, without a deadline, which would depend on its load; more: --hypothesis-profile=many
settings.register_profile("steady", derandomize=True, deadline=None, max_examples=30)
settings.register_profile("many", deadline=None, max_examples=1000)
settings.load_profile("steady")

MOST_WORKERS = 4
"""Largest number of processes for the whole suite: each needs half a GiB and makes the shared fixtures anew."""
SHARE = "FIELDSID_TEST_SHARE"
"""Environment variable for the part of the tests to run, as 1/2, where several machines share them."""
FORKS = pytest.StashKey[list[str]]()
"""Files with tests that fork, which the processes of the suite leave to a separate one."""


def pytest_xdist_auto_num_workers(config: pytest.Config) -> int:
    """Return the number of processes for the whole suite, one per core; 0 for a part of it, which this process runs."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    whole = config.args_source is pytest.Config.ArgsSource.TESTPATHS
    return min(cores, MOST_WORKERS) if whole and cores > 1 else 0


OF_THE_GUIDE = ("tests/contract/test_schemas.py", "tests/cli/test_demo.py")
"""Files outside `tests/guide` that use `guide_session`."""


class FilesTogether(LoadScopeScheduling):
    """Scheduler that gives a whole file to a process, for its fixtures; the files that use `guide_session` go together."""

    def _split_scope(self, nodeid: str) -> str:
        file = nodeid.partition("::")[0]
        return "guide" if file.startswith("tests/guide/") or file in OF_THE_GUIDE else file


def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> FilesTogether:
    return FilesTogether(config, log)


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Deselect or skip the tests that fork where they cannot, and the tests outside of SHARE.

    A process of the suite has threads and leaves them to test_forks.py; on a machine that cannot fork they are skipped.
    """
    forking = [item for item in items if item.get_closest_marker("forks")]
    if hasattr(config, "workerinput"):
        config.stash[FORKS] = sorted({str(item.path) for item in forking})
        left_out = forking
    else:
        left_out = [item for item in items if item.path.name == "test_forks.py"]
        for item in forking if not can_fork() else ():
            item.add_marker(pytest.mark.skip(reason="needs Linux, a second core and no other threads"))
    if share := os.environ.get(SHARE):
        which, of = (int(number) for number in share.split("/"))
        left_out += [item for i, item in enumerate(items) if i % of != which - 1]
    if left_out:
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if item not in left_out]


@pytest.fixture
def files_that_fork(pytestconfig: pytest.Config) -> list[str]:
    """Return the files whose forking tests are left out of this process."""
    return pytestconfig.stash[FORKS]


@dataclass(frozen=True, slots=True)
class Answer:
    """The exit code, stdout and stderr of a command line."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> Mapping[str, Any]:
        """Stdout as one JSON object; the exit code must be 0."""
        assert self.code == 0, self.err
        body = json.loads(self.out)
        assert isinstance(body, dict)
        return body


@pytest.fixture
def run_cli(capfd: pytest.CaptureFixture[str]) -> Callable[..., Answer]:
    """Return a function that runs `sysid` with its arguments in this process."""

    def call(*arguments: object) -> Answer:
        capfd.readouterr()
        code = main([str(a) for a in arguments])
        out, err = capfd.readouterr()
        return Answer(code, out, err)

    return call


@pytest.fixture(scope="session")
def run_shared() -> Callable[..., Answer]:
    """Return `run_cli` for what several tests look at: a fixture of theirs runs the command once."""

    def call(*arguments: object) -> Answer:
        out, err = StringIO(), StringIO()
        with redirect_stdout(out), redirect_stderr(err):
            code = main([str(a) for a in arguments])
        return Answer(code, out.getvalue(), err.getvalue())

    return call


@pytest.fixture
def batch_here() -> Iterator[None]:
    """Let a batch work on its logs in this process."""
    from batches import in_this_process

    with in_this_process():
        yield


@pytest.fixture(scope="session")
def guide_session(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Return the answers of the guide's command lines, each run once, to compare with its pages and check by its schemas."""
    from guide.make import everything_run

    return everything_run(tmp_path_factory.mktemp("guide"))


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Return the folder of third-party data; skips the test where it is absent."""
    folder = ROOT.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip(f"third-party data are not part of the project and absent here: {folder}")
    return folder
