"""Files that once ended in a traceback, each made small: the refusal says what is wrong with them."""

from __future__ import annotations

import json
import struct
from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from binary_logs import write_mat, write_ulog
from fuzz.kinds import SIGNALS, TIME, as_radius_table, as_run, bag, good_files

from fieldsid.artifacts import plain, to_yaml
from fieldsid.cli.app import run as command
from fieldsid.dynamics.free_run import effects_of
from fieldsid.errors import ArtifactError, DataError, FieldsidError, LogError, MappingError, ModelError
from fieldsid.fitting.checks.closed_loop import controller
from fieldsid.fitting.initial.equation_error import equation_error_start
from fieldsid.fitting.problem.parameters import layout_of
from fieldsid.logs import load_run
from fieldsid.logs.inspection import inspect_log
from fieldsid.logs.mapping.mapping_file import load_mapping
from fieldsid.logs.readers._mat_elements import arrays_of
from fieldsid.logs.run import Run
from fieldsid.models.axis import Axis
from fieldsid.models.model import load_model
from fieldsid.models.record import record_of
from fieldsid.planning.belief.prior_model import load_prior
from fieldsid.plant.laws.axis_laws import carried_models, load_laws
from fieldsid.records.reading import read_yaml
from fieldsid.results.logs import inspected
from fieldsid.schedule.record import load_schedule


def changed(tmp_path, name, *steps, to):
    """A good file with one node of it set, by the way to it."""
    body = read_yaml(good_files() / name)
    node = body
    for step in steps[:-1]:
        node = node[step]
    if to is None:
        del node[steps[-1]]
    else:
        node[steps[-1]] = to
    path = tmp_path / name
    path.write_text(to_yaml(body))
    return path


@pytest.mark.parametrize(
    ("way", "to"),
    [
        (("parameters",), [1.0]),
        (("parameters", "b2"), None),
        (("parameters", "C0", "value"), 1e300),
        (("trained",), []),
        (("noise",), 3.0),
        (("noise", "disturbance_time"), 0.0),
        (("info",), [[]]),
        (("info",), {"law_parameters": 3.5}),
        (("info",), {"law_parameters": {"b2@1": 0.2}}),
        (("free",), ["a22", "x"]),
        (("covariance", 0), [1e300, 0.0]),
        (("speed_law", "reference_m_s"), 0.0),
        (("speed_law", "authority_exponent"), float("nan")),
        (("speed_law", "points"), [[0.0, 1.0]]),
        (("inputs",), True),
        (("inputs",), [{"sha256": "0"}]),
    ],
)
def test_a_model_whose_parts_do_not_fit_is_no_complete_model(tmp_path, way, to):
    with pytest.raises(ArtifactError, match="is not a complete model file"):
        load_model(changed(tmp_path, "m1.0.yaml", *way, to=to))


def test_a_model_without_a_coefficient_of_its_effect_says_which(tmp_path):
    model = load_model(changed(tmp_path, "m1.0.yaml", "parameters", "lag", to=None))
    with pytest.raises(ModelError, match="no value of its `lag`"):
        effects_of(model)


@pytest.mark.parametrize("way", [("models", 0, "record", "trained"), ("models", 0, "record", "parameters"), ("models",)])
def test_a_fit_file_whose_models_are_spoilt_is_refused(tmp_path, way):
    with pytest.raises(ArtifactError):
        carried_models(changed(tmp_path, "law.yaml", *way, to=[0.5]))


@pytest.mark.parametrize(
    ("way", "to"),
    [(("points", 0, "speed_m_s"), float("inf")), (("points", 0, "values", "b2"), 1e300), (("laws", "b2", "candidates"), 1)],
)
def test_a_law_of_impossible_numbers_is_refused(tmp_path, way, to):
    with pytest.raises(ArtifactError):
        load_laws(changed(tmp_path, "law.yaml", *way, to=to))


def test_a_law_of_nested_coefficients_is_refused(tmp_path):
    kind = read_yaml(good_files() / "law.yaml")["laws"]["b2"]["chosen"]
    with pytest.raises(ArtifactError):
        load_laws(changed(tmp_path, "law.yaml", "laws", "b2", "candidates", kind, "coefficients", to=[[]]))


def test_a_column_counted_below_zero_is_refused(tmp_path):
    (tmp_path / "m.yaml").write_text("signals: {rudder_rad: -1}\n")
    with pytest.raises(MappingError, match="greater than or equal to 0"):
        load_mapping(tmp_path / "m.yaml")


def test_numbers_whose_squares_overflow_give_no_start_of_a_fit():
    time = 0.1 * np.arange(300)
    fin = np.where(time % 4.0 < 2.0, 0.2, -0.2)
    run = Run("r", time, {"yaw_rad": 1e300 * np.sin(time), "yaw_rate_rad_s": 1e300 * np.cos(time), "rudder_rad": fin})
    records = [record_of(run, Axis.YAW)]
    assert np.isfinite(equation_error_start(records, layout_of(records, Axis.YAW, ()))).all()


@pytest.mark.parametrize("dof", [float("inf"), float("nan")])
def test_a_law_without_a_count_is_refused(tmp_path, dof):
    kind = read_yaml(good_files() / "law.yaml")["laws"]["b2"]["chosen"]
    with pytest.raises(ArtifactError):
        load_laws(changed(tmp_path, "law.yaml", "laws", "b2", "candidates", kind, "dof", to=dof))


@pytest.mark.parametrize(
    ("way", "to"),
    [
        (("rows", 0, "kp"), float("nan")),
        (("rows", 0, "speed_m_s"), 9.0),
        (("rows", 0, "speed_m_s"), -1.0),
        (("actuator", "lag_s"), [1.0, 2.0]),
        (("stated",), [1]),
        (("provenance", "models"), [3]),
        (("provenance", "models", 0, "sha256"), None),
        (("provenance", "models", 0, "path"), None),
        (("provenance", "runs"), 1.5),
        (("provenance", "supported_m_s"), 3.0),
        (("provenance", "supported_m_s"), [[], 1.0]),
        (("inputs",), [0.5]),
    ],
)
def test_a_schedule_whose_parts_do_not_fit_is_no_complete_schedule(tmp_path, way, to):
    with pytest.raises(ArtifactError, match="is not a complete schedule"):
        load_schedule(changed(tmp_path, "gains.yaml", *way, to=to))


def test_a_table_with_a_row_longer_than_its_header_is_refused(tmp_path):
    path = as_radius_table(tmp_path)
    path.write_text(path.read_text().replace("speed_m_s,a22", "speed_m_s"))
    with pytest.raises(DataError, match="more cells than its header"):
        command(["turn-radius", str(path), "--rudder-max", "0.2"])


@pytest.mark.parametrize("name", ["a22", "b2"])
@pytest.mark.parametrize("words", [("turn-radius", "--rudder-max"), ("schedule", "design", "--fin-limit")])
def test_a_speed_without_damping_or_authority_has_no_plant(tmp_path, name, words):
    path = as_radius_table(tmp_path)
    rows = [line.split(",") for line in path.read_text().splitlines()]
    place = rows[0].index(name)
    for row in rows[1:-1]:
        row[place] = ""
    path.write_text("\n".join(",".join(row) for row in rows) + "\n")
    with pytest.raises(FieldsidError, match=f"`{name}` is not known at"):
        command([*words[:-1], str(path), words[-1], "0.2"])


def parquet(tmp_path, columns, metadata=None):
    path = tmp_path / "log.parquet"
    pq.write_table(pa.table(columns).replace_schema_metadata(metadata), path)
    return path


ODD_COLUMNS = {
    "list": pa.array([[1.0]] * 120),
    "struct": pa.array([{"a": 1.0}] * 120),
    "bytes": pa.array([b"\x00\xff"] * 120),
    "time": pa.array(range(120), pa.time64("us")),
    "duration": pa.array(range(120), pa.duration("s")),
    "decimal": pa.array([i * 1000 for i in range(120)], pa.int64()).cast(pa.decimal128(30, 3)),
    "instant": pa.array(range(120), pa.timestamp("us", tz="UTC")),
    "dictionary": pa.array(["1.5"] * 120).dictionary_encode(),
    "nothing": pa.nulls(120),
}


@pytest.mark.parametrize("odd", ODD_COLUMNS)
def test_a_column_of_any_type_is_listed_and_read_or_refused(tmp_path, odd):
    path = parquet(tmp_path, {"time_s": TIME, **SIGNALS, "yaw_rad": ODD_COLUMNS[odd]})
    json.dumps(plain(inspected(inspect_log(path), None)))
    try:
        run = load_run(path)
    except LogError as error:
        assert "yaw_rad" in str(error)  # noqa: PT017 - what is read is as good an answer
    else:
        assert len(run) == 120


def test_two_columns_of_one_name_are_told(tmp_path):
    path = tmp_path / "log.parquet"
    pq.write_table(pa.Table.from_arrays([pa.array(TIME)] * 3, names=["time_s", "yaw_rad", "yaw_rad"]), path)
    with pytest.raises(FieldsidError, match="2 columns named `yaw_rad`"):
        load_run(path)


@pytest.mark.parametrize(
    "notes", [b"\xff\xfe", b"{", b'{"schema": "fieldsid/run/1"}', b'{"schema": "fieldsid/run/1", "notes": [{"code": "gap"}]}',
              b'{"schema": "fieldsid/run/1", "notes": [3]}', b'{"schema": "fieldsid/run/1", "notes": 1.5}']
)  # fmt: skip
def test_a_run_of_ours_whose_notes_are_spoilt_is_refused(tmp_path, notes):
    with pytest.raises(LogError, match="whose notes are spoilt"):
        load_run(parquet(tmp_path, {"time_s": TIME, **SIGNALS}, {"fieldsid": notes}))


@pytest.mark.parametrize(
    "spoil", [{"time_s": None}, {"yaw_rad": ODD_COLUMNS["list"]}, {"time_s": pa.array([float("nan")] * 120)}]
)
def test_a_run_of_ours_whose_columns_are_spoilt_is_refused(tmp_path, spoil):
    metadata = pq.read_schema(as_run(tmp_path)).metadata
    columns = {n: v for n, v in ({"time_s": TIME, **SIGNALS} | spoil).items() if v is not None}
    with pytest.raises(FieldsidError, match=r"a run of ours|known by its name as time"):
        load_run(parquet(tmp_path, columns, metadata))


def test_a_run_of_ours_without_rows_is_refused(tmp_path):
    table = pq.read_table(as_run(tmp_path))
    pq.write_table(table[:0], tmp_path / "log.parquet")
    with pytest.raises(LogError, match="without a time"):
        inspect_log(tmp_path / "log.parquet")


def test_a_time_of_no_epoch_is_no_time(tmp_path):
    time = TIME.copy()
    time[0] = 1e305
    path = tmp_path / "log.csv"
    rows = [f"{t!r},{y!r}" for t, y in zip(time.tolist(), SIGNALS["yaw_rad"].tolist(), strict=True)]
    path.write_text("time_s,yaw_rad\n" + "\n".join(rows) + "\n")
    with pytest.raises(LogError):
        load_run(path)


def test_a_px4_topic_without_a_time_is_left_out(tmp_path):
    path = write_ulog(tmp_path / "log.ulg", TIME, SIGNALS)
    path.write_bytes(path.read_bytes().replace(b"uint64_t timestamp;", b"uint64_t timestanp;"))
    with pytest.raises(LogError, match="has no data"):
        inspect_log(path)


def in_mat(tmp_path, at, value, name=b"yaw_rad\0"):
    """A MATLAB file with one word changed behind the name of a field's array."""
    path = write_mat(tmp_path / "log.mat", TIME, SIGNALS)
    data = bytearray(path.read_bytes())
    place = data.index(struct.pack("<II", 6, 8), data.index(name)) + at
    data[place : place + 4] = struct.pack("<I", value)
    path.write_bytes(bytes(data))
    return path


@pytest.mark.parametrize(("at", "value"), [(8, 99), (24, 2**31), (16, 77), (40, 200), (44, 2**30), (40, 8)])
def test_a_matlab_file_that_would_end_the_process_is_refused(tmp_path, at, value):
    assert len(dict(arrays_of(write_mat(tmp_path / "good.mat", TIME, SIGNALS)))) == len(SIGNALS) + 2
    with pytest.raises(LogError, match="is a MATLAB file that is damaged"):
        load_run(in_mat(tmp_path, at, value))


def test_matlab_arrays_of_numbers_are_read_among_those_of_every_class(tmp_path):
    import scipy.io
    import scipy.sparse

    held = {
        "cells": np.array([1, "x", np.arange(3)], dtype=object),
        "sparse": scipy.sparse.random(5, 6, 0.3, format="csc", random_state=1),
        "complex": np.array([1 + 2j, 3]),
        "text": ["ab", "cdef"],
        "none": np.zeros((0, 0)),
        "struct": {"a": 1, "b": {"c": "text", "d": []}},
        "structs": np.array([(1, 2.0), (3, 4.0)], dtype=[("u", int), ("v", float)]),
        "logical": np.array([True, False]),
        "matrix": np.arange(6, dtype=np.int16).reshape(2, 3),
        "cube": np.arange(24.0).reshape(2, 3, 4),
    }
    numbers = {"none", "logical", "matrix", "cube"}
    for packed in (False, True):
        scipy.io.savemat(tmp_path / "log.mat", held, do_compression=packed)
        found = dict(arrays_of(tmp_path / "log.mat"))
        assert found.keys() == {"a", "b.d", *numbers}
        by_scipy = scipy.io.loadmat(tmp_path / "log.mat")
        assert all(np.array_equal(found[name], by_scipy[name]) for name in numbers)


def test_a_position_of_one_column_is_refused(tmp_path):
    path = tmp_path / "mapping.yaml"
    path.write_text("signals: {position: 1, yaw_rad: yaw_rad}\n")
    with pytest.raises(MappingError, match="needs two columns"):
        load_mapping(path)


def test_a_prior_of_impossible_numbers_is_refused(tmp_path):
    with pytest.raises(ArtifactError, match="not a complete prior"):
        load_prior(changed(tmp_path, "prior.yaml", "parameters", "b2", "std_error", to=1e300))


def test_a_law_with_more_powers_than_coefficients_is_refused(tmp_path):
    kind = read_yaml(good_files() / "law.yaml")["laws"]["b2"]["chosen"]
    with pytest.raises(ArtifactError):
        load_laws(changed(tmp_path, "law.yaml", "laws", "b2", "candidates", kind, "powers", to=[0.0, 1.0, 2.0, 3.0]))


def test_a_law_of_no_points_at_all_is_refused(tmp_path):
    with pytest.raises(ArtifactError, match="not a complete fit file"):
        load_laws(changed(tmp_path, "law.yaml", "points", to=[]))


def test_standard_errors_without_bounds_draw_no_law(tmp_path):
    path = as_radius_table(tmp_path)
    path.write_text(path.read_text().replace(",0.02\n", ",1e308\n").replace("1.4,", "1e-320,").replace("1.8,", "1e308,"))
    with pytest.raises(FieldsidError):
        command(["fit", str(path)])


def test_a_count_without_end_is_no_description_of_a_bag(tmp_path):
    path = bag("db3")(tmp_path)
    file = path / "metadata.yaml"
    text = file.read_text()
    at = text.index("message_count: ", text.index("topics_with_message_count"))
    file.write_text(text[:at] + "message_count: .inf\n" + text[text.index("\n", at) + 1 :])
    assert any("no description of a bag" in n.message for n in inspect_log(path).notes)


@pytest.mark.parametrize("length", [2**64 - 1, 2**40])
def test_a_length_that_a_bag_of_another_compression_invents_is_refused(tmp_path, length):
    path = bag("mcap", "storage")(tmp_path)
    file = next(path.glob("*.mcap"))
    data = bytearray(file.read_bytes())
    at = data.index(b"zstd")
    data[at : at + 4] = b"Qstd"
    (summary,) = struct.unpack_from("<Q", data, len(data) - 28)
    struct.pack_into("<Q", data, summary + 1, length)
    file.write_bytes(data)
    with pytest.raises(LogError, match="compressed with 'Qstd'"):
        inspect_log(path)


def test_a_record_shorter_than_a_controllers_window_has_none():
    random, n = np.random.default_rng(1), 60
    yaw, fin = np.cumsum(0.01 * random.standard_normal((2, n)), axis=1)
    record = record_of(Run("short", 1e-3 * np.arange(n), {"yaw_rad": yaw, "yaw_rate_rad_s": yaw, "rudder_rad": fin}), Axis.YAW)
    assert controller(record) is None


def test_a_heading_whose_differences_overflow_has_no_controller():
    random, n = np.random.default_rng(1), 600
    yaw, fin = np.cumsum(0.01 * random.standard_normal((2, n)), axis=1)
    yaw[300] = np.inf
    record = record_of(Run("far", 0.05 * np.arange(n), {"yaw_rad": np.zeros(n), "rudder_rad": fin}), Axis.YAW)
    assert controller(replace(record, angle=yaw))[0] == 0.0
