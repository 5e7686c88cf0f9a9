"""The tests that fork, in a process without the threads of the suite's workers; a part of the suite runs them in place."""

from __future__ import annotations

import subprocess
import sys

import pytest


@pytest.mark.parametrize("which", ["forks and not slow", pytest.param("forks and slow", marks=pytest.mark.slow)])
def test_what_forks_passes_in_a_process_of_its_own(files_that_fork, pytestconfig, which):
    words = [sys.executable, "-m", "pytest", "-q", "-n", "0", "-p", "no:cacheprovider", "-m", which, *files_that_fork]
    done = subprocess.run(words, cwd=pytestconfig.rootpath, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert " passed" in done.stdout
    assert " skipped" not in done.stdout
