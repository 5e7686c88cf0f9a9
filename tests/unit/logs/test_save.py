"""A run that is written comes back: every number, and from Parquet every note."""

import gzip

import numpy as np
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fieldsid.errors import ArtifactError, LogError, UsageError
from fieldsid.logs import Note, Run, load_run, save_run
from fieldsid.logs.convert.conditioning import MAX_PLAUSIBLE_VALUE
from fieldsid.logs.run import SIGNALS
from fieldsid.records.named_inputs import sha256_of

finite = st.floats(-MAX_PLAUSIBLE_VALUE, MAX_PLAUSIBLE_VALUE, width=64)


def example(tmp_path):
    source = tmp_path / "source.csv"
    source.write_text("a")
    notes = (Note("unit", "said so", {"value": 1.5, "list": [1, 2]}),)
    signals = {"yaw_rad": np.array([0.1, np.nan, 1 / 3]), "thrust": np.array([9.0, 9.0, 1e-300])}
    return Run("run7", np.array([0.0, 0.05, 0.1]), signals, source, notes)


def same(a, b):
    np.testing.assert_array_equal(a.time, b.time)
    assert list(a.signals) == list(b.signals)
    for name in a.signals:
        np.testing.assert_array_equal(a[name], b[name])


@pytest.mark.parametrize("name", ["r.parquet", "r.csv", "r.csv.gz"])
def test_a_run_comes_back_to_the_last_bit(tmp_path, name):
    run = example(tmp_path)
    same(load_run(save_run(run, tmp_path / name)), run)


def test_parquet_keeps_notes_version_and_the_hash_of_the_source_and_is_called_as_its_file(tmp_path):
    run = example(tmp_path)
    path = save_run(run, tmp_path / "r.parquet")
    back = load_run(path)
    assert back.name == "r"
    assert [(n.code, n.message, dict(n.data)) for n in back.notes] == [("unit", "said so", {"value": 1.5, "list": [1, 2]})]
    head = pq.read_schema(path).metadata[b"fieldsid"].decode()
    assert sha256_of(run.source) in head
    assert "fieldsid/run/1" in head


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.floats(1e-6, 1e3), min_size=3, max_size=20),
    st.dictionaries(
        st.sampled_from([s for s in SIGNALS if s != "yaw_rad"]),
        st.lists(finite, min_size=20, max_size=20),
        min_size=1,
        max_size=4,
    ),
    st.sampled_from(["r.parquet", "r.csv", "r.csv.gz"]),
)
def test_any_run_comes_back_to_the_last_bit(tmp_path_factory, steps, signals, name):
    time = np.cumsum(steps)
    run = Run("r", time, {s: np.array(signals[s][: time.size]) for s in SIGNALS if s in signals})
    path = tmp_path_factory.mktemp("save") / name
    same(load_run(save_run(run, path)), run)


def test_an_existing_file_is_kept_unless_forced(tmp_path):
    run = example(tmp_path)
    path = tmp_path / "r.csv"
    path.write_text("mine")
    with pytest.raises(ArtifactError, match="exists"):
        save_run(run, path)
    assert path.read_text() == "mine"
    save_run(run, path, force=True)
    assert path.read_text().startswith("time_s,yaw_rad,thrust\n")


def test_another_suffix_is_refused(tmp_path):
    with pytest.raises(UsageError, match="cannot be written"):
        save_run(example(tmp_path), tmp_path / "r.xlsx")


def test_the_same_run_gives_the_same_gzip_bytes(tmp_path):
    run = example(tmp_path)
    first, second = save_run(run, tmp_path / "a.csv.gz").read_bytes(), save_run(run, tmp_path / "b.csv.gz").read_bytes()
    assert first == second
    assert gzip.decompress(first).startswith(b"time_s")


def test_a_damaged_parquet_is_refused(tmp_path):
    path = save_run(example(tmp_path), tmp_path / "r.parquet")
    path.write_bytes(path.read_bytes()[:-20])
    with pytest.raises(LogError, match="not a readable Parquet file"):
        load_run(path)


def test_somebody_elses_parquet_with_canonical_names_is_read(tmp_path):
    import pandas as pd

    frame = pd.DataFrame({"time_s": [0.0, 0.1], "yaw_deg": [90.0, 91.0], "mode": ["a", "b"]})
    frame.to_parquet(tmp_path / "theirs.parquet")
    np.testing.assert_allclose(load_run(tmp_path / "theirs.parquet")["yaw_rad"], np.radians([90, 91]))
