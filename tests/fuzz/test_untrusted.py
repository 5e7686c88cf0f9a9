"""Files from somebody else that once ended in a crash, a hang or a wrong file, each made small."""

from __future__ import annotations

import gzip
import json
import os
import time
import zlib
from types import SimpleNamespace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from binary_logs import write_mat
from fuzz.kinds import SIGNALS, TIME, as_diagnosis, as_run, as_state, as_turns, good_files

from fieldsid.artifacts import plain, to_yaml
from fieldsid.batch.archive import SCHEMA, known_rows
from fieldsid.cli.app import main
from fieldsid.errors import ArtifactError, LogError, UsageError
from fieldsid.exports._patch import patch_yaml
from fieldsid.logs.inspection import inspect_log
from fieldsid.logs.readers._mat_elements import arrays_of
from fieldsid.logs.readers._unpacked import SMALL, UnpackedSize
from fieldsid.logs.readers.bags.messages.definitions import _parsed
from fieldsid.logs.readers.bags.messages.message_layout import Decoder
from fieldsid.models.axis import Axis
from fieldsid.models.model import load_model
from fieldsid.online.progress import Watch, default_goals
from fieldsid.online.state_file import load_state
from fieldsid.plant.laws.axis_laws import load_laws
from fieldsid.records.reading import read_yaml
from fieldsid.reporting.material import material_of
from fieldsid.reporting.sections import context_of
from fieldsid.results.logs import LISTED, inspected
from fieldsid.schedule.record import load_schedule
from fieldsid.trial_folder.state import state_of


def changed(path, body, *steps, to):
    """A record with one node of it set, by the way to it."""
    node = body
    for step in steps[:-1]:
        node = node[step]
    node[steps[-1]] = to
    path.write_text(json.dumps(body) if path.suffix == ".json" else to_yaml(body))
    return path


@pytest.mark.parametrize(
    ("way", "to"),
    [
        (("rows", 0, "fin_limit_rad"), -1.0), (("rows", 0, "fin_limit_rad"), 0.0), (("rows", 0, "fin_limit_rad"), 1.6),
        (("rows", 0, "supported"), "no"), (("rows", 0, "kd"), -525533.0), (("rows", 0, "kp"), "-0.7"), (("rows", 0, "kp"), 0.5),
        (("rows", 1, "speed_m_s"), 0.5), (("rows", 1, "speed_m_s"), 60.0), (("rows",), []), (("rows", 0, "slowed"), 2.0),
        (("controller",), "pd\nfin_limit_rad: [9.0]"), (("controller",), "PD"), (("depth",), 1), (("damping_ratio",), -0.7),
        (("actuator", "lag_s"), -1.0), (("provenance", "runs"), [3]), (("axis",), "roll"), (("inputs",), 3),
    ],
)  # fmt: skip
def test_a_schedule_of_wrong_numbers_is_refused(tmp_path, way, to):
    body = read_yaml(good_files() / "gains.yaml")
    with pytest.raises(ArtifactError, match="is not a complete schedule"):
        load_schedule(changed(tmp_path / "gains.yaml", body, *way, to=to))


@pytest.mark.parametrize(
    ("way", "to"),
    [
        (("speed_law", "authority_exponent"), 2e6), (("speed_law", "damping_exponent"), -21.0), (("speed_law", "snap"), -0.1),
        (("speed_law", "trim_of_fin"), "no"), (("noise", "angle"), -0.1), (("parameters", "b2", "value"), "1"),
        (("covariance",), [["x", 0.0], [0.0, 0.0]]), (("effects",), "servo_lag"), (("trained", "fin_max"), [1.0]),
        (("info",), {"extension": {"after": 3}}), (("inputs",), [{"path": 3}]), (("runs",), [None]),
    ],
)  # fmt: skip
def test_a_model_of_wrong_numbers_is_refused(tmp_path, way, to):
    body = read_yaml(good_files() / "m1.0.yaml")
    with pytest.raises(ArtifactError, match="is not a complete model file"):
        load_model(changed(tmp_path / "model.yaml", body, *way, to=to))


@pytest.mark.parametrize(
    ("way", "to"),
    [
        (("points", 0, "speed_m_s"), -1.0), (("points", 0, "std_errors", "b2"), -0.1), (("laws", "b2", "sign"), 0.5),
        (("laws", "b2", "chosen"), "other"), (("models", 0, "record", "speed_law", "authority_exponent"), 1e5),
        (("laws", "a22", "candidates"), {"affine": {"kind": "affine", "powers": [900.0], "coefficients": [1.0],
                                                    "covariance": [[0.0]], "dof": 1, "r2": None, "rms": None}}),
    ],
)  # fmt: skip
def test_laws_of_wrong_numbers_are_refused(tmp_path, way, to):
    body = read_yaml(good_files() / "law.yaml")
    with pytest.raises(ArtifactError, match="is not a complete fit file"):
        load_laws(changed(tmp_path / "law.yaml", body, *way, to=to))


@pytest.mark.parametrize(
    ("way", "to"),
    [
        (("state", "seen"), 10**40), (("state", "window"), {}), (("state", "window", 25), None), (("state", "filter"), []),
        (("state", "filter", "memory", 1), 1e300), (("state", "filter", "late"), [[1.0, 0.0, True, [None, None]]] * 9),
        (("state", "filter", "lagged", "begin"), None), (("state", "speeds"), None), (("watch", "looks"), 3),
        (("watch", "excitation", "means"), [0.0]), (("watch",), None), (("state", "settings", "more"), 1), (("source",), {}),
    ],
)  # fmt: skip
def test_a_spoilt_state_is_no_state(tmp_path, way, to):
    body = json.loads(as_state(tmp_path).read_text())
    with pytest.raises(ArtifactError, match="is no state of `sysid live`"):
        load_state(changed(tmp_path / "state.json", body, *way, to=to), Axis.YAW, Watch(default_goals(Axis.YAW)))


@pytest.fixture
def trial(tmp_path):
    (tmp_path / "models").mkdir()
    (tmp_path / "journal.jsonl").touch()
    (tmp_path / "models" / "m.yaml").write_bytes((good_files() / "m1.0.yaml").read_bytes())
    return tmp_path


@pytest.mark.parametrize(
    ("make", "way", "to"),
    [
        (as_diagnosis, ("noise_floor", "rate_rad_s"), " "), (as_diagnosis, ("candidates", 0, "probability"), "0.97"),
        (as_diagnosis, ("base",), "1e5"), (as_diagnosis, ("validation_runs",), 1e308),
        (as_diagnosis, ("candidates", 0), 3),
        (as_turns, ("rows",), None), (as_turns, ("rows", 0, "side"), "x"), (as_turns, ("rows", 0, "interval95"), [1.0]),
        (as_turns, ("rows", 1, "radius_m"), "-0"), (as_turns, ("rows", 1, "yaw_rate_max_rad_s"), "\u202e"),
    ],
)  # fmt: skip
def test_a_wrong_record_is_left_out_of_the_report_with_its_reason(trial, make, way, to):
    path = make(trial)
    changed(path, read_yaml(path), *way, to=to)
    (said,) = context_of(material_of(state_of(trial)))["skipped"]
    assert said.startswith(f"{path.name}: `{way[0]}")


def test_a_diagnosis_that_says_too_little_is_left_out_too(trial):
    path = as_diagnosis(trial)
    body = read_yaml(path)
    del body["base"]
    path.write_text(to_yaml(body))
    assert context_of(material_of(state_of(trial)))["skipped"] == ["diagnosis.yaml: `base` is missing"]


@pytest.mark.parametrize("named", ["/dev/zero", "dev/zero", "/usr", "usr", "pipe", "sparse.csv", "\0", "x" * 4000])
def test_what_a_model_names_ends_no_command(trial, named, monkeypatch, capsys):
    monkeypatch.chdir(trial)
    os.mkfifo(trial / "pipe")
    with (trial / "sparse.csv").open("wb") as stream:
        stream.write(b"time_s,yaw_rad\n")
        stream.truncate(1 << 40)
    body = read_yaml(trial / "models" / "m.yaml")
    body["inputs"] = [{"path": named, "sha256": "0" * 64}]
    (trial / "models" / "m.yaml").write_text(to_yaml(body))
    begin = time.process_time()
    assert main(["status", "--json"]) == 0
    assert time.process_time() - begin < 60.0  # no hang, on a slow machine too
    (model,) = [f for f in json.loads(capsys.readouterr().out)["files"] if f["kind"] == "model"]
    assert model["missing"] == [f"{named} (too large to be hashed)" if named == "sparse.csv" else named]


def test_texts_that_unpack_to_gigabytes_are_refused_unread(tmp_path):
    words = pa.array(["x" * 1_000_000]).take(pa.array(np.zeros(200, dtype=np.int64)))
    table = pa.table({"time_s": np.arange(200.0), "rudder_rad": np.zeros(200), "said": words})
    pq.write_table(table, tmp_path / "log.parquet", compression="zstd")
    with pytest.raises(LogError, match="unpacks to far more"):
        inspect_log(tmp_path / "log.parquet")


def test_numbers_that_unpack_to_gigabytes_are_refused_unread(tmp_path):
    columns = {f"c{i}": np.zeros(900_000) for i in range(20)}
    pq.write_table(pa.table(columns), tmp_path / "log.parquet", compression="zstd")
    with pytest.raises(LogError, match="unpacks to far more"):
        inspect_log(tmp_path / "log.parquet")


def test_a_packed_variable_of_a_matlab_file_is_unpacked_up_to_a_size(tmp_path):
    path = write_mat(tmp_path / "log.mat", TIME[:60], {n: v[:60] for n, v in SIGNALS.items()})
    packed = zlib.compress(bytes(SMALL + 4096), 9)
    path.write_bytes(path.read_bytes()[:128] + (15).to_bytes(4, "little") + len(packed).to_bytes(4, "little") + packed)
    with pytest.raises(LogError, match="unpacks to far more"):
        list(arrays_of(path))


def test_lines_that_unpack_without_end_are_refused(tmp_path):
    path = tmp_path / "log.csv.gz"
    row = (b"0.5," + b"0" * 4000 + b"\n") * 34_000
    path.write_bytes(gzip.compress(b"time_s,a\n" + row, 6))
    with pytest.raises(LogError, match=r"unpacks to far more|repeat one another|line of it"):
        inspect_log(path)


def test_what_packs_as_logs_do_is_counted_and_let_through(tmp_path):
    size = UnpackedSize(tmp_path, packed=SMALL)
    size.add(10 * SMALL)
    assert size.left > 0


@pytest.mark.parametrize("channels", [6_000, pytest.param(40_000, marks=pytest.mark.slow)])
def test_of_many_channels_the_first_are_listed_and_the_others_counted(tmp_path, channels):
    path = tmp_path / "many.alog"
    rows = "".join(f"{0.001 * i:.3f} VAR_{i} pNav {i % 7}.5\n" for i in range(channels))
    path.write_text(f"%%%%\n%% LOGSTART   1709287200.5\n%%%%\n{rows}")
    begin = time.process_time()
    record = plain(inspected(inspect_log(path), None))
    assert time.process_time() - begin < 60.0  # no hang, on a slow machine too
    assert (len(record["channels"]), len(record["shown"]), record["more_channels"]) == (LISTED, LISTED, channels - LISTED)
    assert "many_channels" in {f["code"] for f in record["findings"]}


@pytest.mark.parametrize("columns", [400, pytest.param(6000, marks=pytest.mark.slow)])
def test_a_wide_table_is_listed_in_part(tmp_path, columns):
    table = pa.table({"time_s": TIME, **{f"c{i}": TIME for i in range(columns)}})
    pq.write_table(table, tmp_path / "log.parquet")
    record = plain(inspected(inspect_log(tmp_path / "log.parquet"), None))
    assert len(record["channels"]) + record["more_channels"] == columns + 1


RULE = "\n" + "=" * 80 + "\n"


@pytest.mark.parametrize(
    "definition",
    [
        "a/B inner",
        f"a/C inner{RULE}MSG: a/C\na/B[] inner",
        RULE.join(["a/L0[9] x", *(f"MSG: a/L{i}\na/L{i + 1}[9] x" for i in range(12)), "MSG: a/L12\nfloat64 x"]),
        RULE.join(["a/L0 x", *(f"MSG: a/L{i}\na/L{i + 1} x" for i in range(80)), "MSG: a/L80\nfloat64 x"]),
    ],
    ids=["itself", "by another", "wide", "deep"],
)
def test_a_message_type_without_end_is_refused(definition):
    with pytest.raises(LogError, match=r"holds itself|is none that is recorded|does not fit its messages"):
        Decoder(_parsed(definition, "a/msg/B", "msg"), "a/msg/B", cdr=False).layout(b"\1\0\0\0" * 100)


@pytest.mark.parametrize(
    "text",
    [
        "name: !x 3\ngains: {}\n",
        "gains: {}\na: &a [1, 1]\n"
        + "".join(f"a{i}: &a{i} [{', '.join(['*a' + str(i - 1) if i else '*a'] * 9)}]\n" for i in range(9)),
    ],
    ids=["tag", "aliases"],
)
def test_a_file_that_cannot_be_patched_safely_is_left(tmp_path, text):
    path = tmp_path / "params.yaml"
    path.write_text(text)
    with pytest.raises(ArtifactError, match="could not be patched safely"):
        patch_yaml(path, "gains", {"kp": [1.0]})
    assert path.read_text() == text


def test_a_key_of_a_good_file_is_patched_still(tmp_path):
    path = tmp_path / "params.yaml"
    path.write_text("day: 2026-05-01\n# a comment\n1: one\ngains: {kp: [0.5]}\n")
    assert "kp: [1.0]" in patch_yaml(path, "gains", {"kp": [1.0]}).after
    with pytest.raises(UsageError):
        patch_yaml(path, "gain", {"kp": [1.0]})


def test_a_run_whose_notes_are_spoilt_is_told_and_left_out(trial):
    path = as_run(trial)
    table = pq.read_table(path)
    head = json.loads(table.schema.metadata[b"fieldsid"])
    for spoilt in ({**head, "notes": 3}, {**head, "notes": [{"code": "limit"}]}, {**head, "inputs": [{"path": 3}]}):
        pq.write_table(table.replace_schema_metadata({b"fieldsid": json.dumps(spoilt)}), path)
        state = state_of(trial)
        assert [i.path for i in state.items] == ["models/m.yaml"]
        assert state.unreadable


@pytest.mark.parametrize(
    "spoilt", ["{", "[" * 9999, "null", '{"schema": 3}', '{"rows": [3]}', '{"rows": [{"status": 3}]}',
               '{"rows": [{"status": "done", "speed_m_s": "x"}]}', '{"rows": []}', '{"rows": [{"status": "failed"}]}'],
)  # fmt: skip
def test_a_spoilt_answer_of_a_batch_is_asked_for_again(tmp_path, spoilt):
    (tmp_path / "logs").mkdir()
    path = tmp_path / "logs" / "one.json"
    task = SimpleNamespace(key="one")
    rows = [{"status": "done", "speed_m_s": 1.0, "verdict": None}]
    path.write_text(json.dumps({"schema": SCHEMA, "rows": rows}))
    assert known_rows(tmp_path, task) == rows
    path.write_text(spoilt.replace('{"rows"', f'{{"schema": "{SCHEMA}", "rows"'))
    assert known_rows(tmp_path, task) is None
