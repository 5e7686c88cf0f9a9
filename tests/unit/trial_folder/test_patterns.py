"""Files of a command line as a pattern, only where it stands for just them."""

from __future__ import annotations

import glob
import shlex
from pathlib import Path

from fieldsid.trial_folder.patterns import pattern_of, shortened


def made(folder, *names):
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).touch()
    return [Path(n) for n in names]


def test_many_files_are_a_pattern_that_matches_just_them(tmp_path):
    files = made(tmp_path, *(f"runs/day 1_{i}.csv" for i in range(4)))
    made(tmp_path, "runs/other.csv")
    (word,) = pattern_of(files, tmp_path)
    assert sorted(glob.glob(shlex.split(word)[0], root_dir=tmp_path)) == [str(f) for f in files]  # noqa: PTH207
    assert pattern_of(files[:3], tmp_path) == [shlex.quote(str(f)) for f in files[:3]]
    made(tmp_path, "runs/day 1_more.csv")
    assert len(pattern_of(files, tmp_path)) == 4


def test_a_command_keeps_its_model_and_options_beside_its_runs(tmp_path):
    made(tmp_path, "models/joint yaw.yaml")
    runs = [str(f) for f in made(tmp_path, *(f"runs/{i}.parquet" for i in range(5)))]
    line = shortened(["sysid", "extend", "models/joint yaw.yaml", *runs, "--add", "servo_lag"], tmp_path)
    assert line == "sysid extend 'models/joint yaw.yaml' runs/*.parquet --add servo_lag"
