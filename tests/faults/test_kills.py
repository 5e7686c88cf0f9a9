"""What is left where a process is killed; 200 times by name: `python tests/faults/kills.py`."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from faults.kills import table

from fieldsid import artifacts
from fieldsid.errors import ArtifactError

LINUX = pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="Linux ends a copy with its parent and has files without names"
)


@LINUX
@pytest.mark.parametrize(
    ("commands", "seed"), [(("import",), 1), pytest.param(("import", "schedule"), 7, marks=pytest.mark.slow)]
)
def test_killed_commands_leave_nothing_wrong(tmp_path, commands, seed):
    found = table(3 * len(commands), seed, tmp_path, commands)  # by each signal once
    assert [k for k in found if k.wrong] == []
    assert any(k.was_alive for k in found)  # how many hangs on how busy the machine is


PARENT = """
import sys, time
from fieldsid.runtime import worker_pool
worker_pool.can_fork = lambda: True
copy = worker_pool.fork_worker(lambda: time.sleep(60) or b"")
print(copy.process, flush=True)
time.sleep(60)
"""


@LINUX
@pytest.mark.parametrize("which", [signal.SIGKILL, signal.SIGTERM])
def test_a_copy_does_not_live_on_without_its_parent(which):
    with subprocess.Popen([sys.executable, "-c", PARENT], stdout=subprocess.PIPE, text=True) as parent:
        copy = int(parent.stdout.readline())
        time.sleep(0.2)
        assert Path(f"/proc/{copy}").exists()
        parent.send_signal(which)
        parent.wait()
        until = time.monotonic() + 5.0
        while is_alive(copy) and time.monotonic() < until:
            time.sleep(0.02)
        assert not is_alive(copy)


def is_alive(process):
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


WRITER = """
import signal, sys, time
from pathlib import Path
from fieldsid.artifacts import replacing
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell lets what it starts in the background ignore it
with replacing(Path(sys.argv[1]), force=True) as temporary:
    temporary.write_text("half")
    print("writing", flush=True)
    time.sleep(60)
"""


@LINUX
@pytest.mark.parametrize("which", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_a_file_that_is_being_written_leaves_nothing_behind(tmp_path, which):
    path = tmp_path / "figure.png"
    path.write_text("before")
    with subprocess.Popen([sys.executable, "-c", WRITER, path], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as writer:
        assert writer.stdout.readline()
        writer.send_signal(which)
        writer.wait()
    assert [p.name for p in tmp_path.iterdir()] == ["figure.png"]
    assert path.read_text() == "before"


@pytest.mark.parametrize("has_nameless", [True, False])
def test_with_and_without_nameless_files_a_file_is_written_whole_or_not_at_all(tmp_path, monkeypatch, has_nameless):
    if not has_nameless:
        monkeypatch.setattr(artifacts, "OWN_HANDLES", tmp_path / "nowhere")
    path = tmp_path / "new" / "file.txt"
    assert artifacts.write_text(path, "one") == path
    with pytest.raises(ArtifactError, match="exists"):
        artifacts.write_text(path, "two")
    artifacts.write_text(path, "three", force=True)
    with pytest.raises(ZeroDivisionError), artifacts.replacing(path, force=True) as temporary:
        temporary.write_text(f"four {1 / 0}")
    assert path.read_text() == "three"
    assert [p.name for p in path.parent.iterdir()] == ["file.txt"]
    umask = os.umask(0)
    os.umask(umask)
    assert path.stat().st_mode & 0o777 == 0o666 & ~umask
