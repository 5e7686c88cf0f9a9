"""A signal that several fins or motors make up: how a mapping says it, and what it gives."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fieldsid.errors import MappingError
from fieldsid.logs.load import load_run
from fieldsid.logs.mapping.mapping_file import mapping_of

TIME = 0.1 * np.arange(200)
YAW = {"column": "yaw", "unit": "rad"}


def table(path, **columns):
    names = ["t", "yaw", *columns]
    rows = np.stack([TIME, 0.01 * TIME, *columns.values()], axis=1)
    path.write_text(",".join(names) + "\n" + "\n".join(",".join(f"{v:.9g}" for v in row) for row in rows) + "\n")
    return path


def read(path, **signals):
    return load_run(path, mapping_of({"time": {"column": "t", "unit": "s"}, "signals": {"yaw_rad": YAW, **signals}}))


def test_each_entry_has_its_unit_its_sign_and_its_share(tmp_path):
    one, two, pulses = np.sin(TIME), np.cos(3 * TIME), np.round(1500 + 300 * np.sin(2 * TIME))
    log = table(tmp_path / "x.csv", fin1=np.degrees(one), fin2=two, servo=pulses)
    entries = [
        {"column": "fin1", "unit": "deg", "scale": 0.5},
        {"column": "fin2", "sign": -1, "scale": 0.25},
        {"column": "servo", "unit": "counts", "centre": 1500, "scale": -0.001},
    ]
    run = read(log, rudder_rad={"sum": entries})
    assert_allclose(run["rudder_rad"], 0.5 * one - 0.25 * two - 0.001 * (pulses - 1500), atol=1e-7)
    assert set(run.signals) == {"yaw_rad", "rudder_rad"}


def test_thrusters_in_newton_make_a_yaw_command(tmp_path):
    port, starboard = 5 + 3 * np.sin(TIME), 5 - 3 * np.sin(TIME)
    log = table(tmp_path / "boat.csv", port=port, stbd=starboard)
    entries = [{"column": "stbd", "unit": "N", "scale": 0.02}, {"column": "port", "unit": "N", "scale": -0.02}]
    assert_allclose(read(log, rudder_rad={"sum": entries})["rudder_rad"], 0.02 * (starboard - port), atol=1e-8)


def test_entries_of_other_clocks_stand_until_their_next(tmp_path):
    log = tmp_path / "moos.alog"
    heading = [(0.1 * i, "NAV_HEADING", i % 7) for i in range(100)]
    fins = [(0.03 + 1.0 * i, "FIN_A", (-1) ** i * 10.0) for i in range(10)] + [(0.57 + 1.5 * i, "FIN_B", i) for i in range(6)]
    lines = "".join(f"{t:.3f} {name} pNav {value}\n" for t, name, value in sorted([*heading, *fins]))
    log.write_text("%% LOG FILE:  a.alog\n%% LOGSTART   1709287200.5\n" + lines)
    entries = [
        {"topic": "FIN_A", "field": "data", "unit": "deg", "scale": 0.5},
        {"topic": "FIN_B", "field": "data", "unit": "deg"},
    ]
    heading_of = {"topic": "NAV_HEADING", "field": "data", "unit": "deg"}
    run = load_run(log, mapping_of({"signals": {"yaw_rad": heading_of, "rudder_rad": {"sum": entries}}}))
    a = np.array([(-1) ** np.floor(t - 0.03 + 1e-9) * 5.0 for t in run.time])
    b = np.floor((run.time - 0.57) / 1.5 + 1e-9)
    known = run.time >= 0.57
    assert_allclose(np.degrees(run["rudder_rad"][known]), (a + np.minimum(b, 5))[known], atol=1e-9)
    assert np.isnan(run["rudder_rad"][~known]).all()


def test_a_sample_that_no_fin_has_is_missing(tmp_path):
    one = np.sin(TIME)
    one[50:53] = np.nan
    other = np.cos(TIME)
    other[51] = np.nan
    run = read(table(tmp_path / "x.csv", fin1=one, fin2=other), rudder_rad={"sum": [{"column": "fin1"}, {"column": "fin2"}]})
    assert np.flatnonzero(np.isnan(run["rudder_rad"])).tolist() == [51]
    assert_allclose(run["rudder_rad"][50], one[49] + other[50], atol=1e-8)  # a command stands


def test_a_channel_stands_for_the_whole_sum(tmp_path):
    from fieldsid.logs.channels import Source

    log = table(tmp_path / "x.csv", fin1=np.sin(TIME), fin2=np.cos(TIME))
    mapping = mapping_of(
        {"time": {"column": "t"}, "signals": {"yaw_rad": YAW, "rudder_rad": {"sum": [{"column": "fin1"}, {"column": "fin2"}]}}}
    )
    assert_allclose(load_run(log, mapping, channels={"rudder_rad": Source(column="fin2")})["rudder_rad"], np.cos(TIME), atol=1e-8)


@pytest.mark.parametrize(
    ("item", "says"),
    [
        ({"sum": [{"column": "a"}], "unit": "deg"}, "has `unit` beside its `sum`"),
        ({"sum": [{"column": "a", "scale": 0}]}, "scale of zero"),
        ({"sum": [{"column": "a", "unit": "N"}]}, "`rudder_rad[0]`"),
        ({"sum": [{"column": "a", "unit": "bushel", "scale": 2}]}, "no unit 'bushel'"),
        ({"sum": [{"column": "a", "centre": 1500}]}, "`centre` without counts"),
        ({"sum": [{}]}, "needs one of"),
        ({"sum": []}, "sum"),
        ({"sum": [{"column": "a", "sclae": 1}]}, "unknown key"),
    ],
)
def test_a_sum_that_cannot_be_meant_is_refused(item, says):
    with pytest.raises(MappingError) as caught:
        mapping_of({"signals": {"rudder_rad": item}})
    assert says in str(caught.value)


def test_only_fins_and_motors_are_summed():
    with pytest.raises(MappingError, match="cannot be a sum"):
        mapping_of({"signals": {"yaw_rad": {"sum": [{"column": "a"}]}}})


def test_a_column_that_is_not_there_is_named_with_its_entry(tmp_path):
    with pytest.raises(MappingError, match=r"no column `fin9` for `rudder_rad\[1\]`"):
        read(table(tmp_path / "x.csv", fin1=TIME), rudder_rad={"sum": [{"column": "fin1"}, {"column": "fin9"}]})
