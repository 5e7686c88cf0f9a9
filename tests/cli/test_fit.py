"""`sysid fit` as a user meets it."""

from __future__ import annotations

import pytest
from truth.paper import PITCH, YAW

NAMES = {"yaw": ("a22", "b2", "C0"), "pitch": ("c22", "c23", "d2", "Cb")}


def table(folder, axis="yaw", rows=None):
    rows = rows or (YAW if axis == "yaw" else PITCH)
    path = folder / f"{axis}.csv"
    lines = [",".join(("thrust_percent", "speed_m_s", *NAMES[axis]))]
    lines += [",".join(["70", str(r.speed), *(str(getattr(r, n)) for n in NAMES[axis])]) for r in rows]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.mark.parametrize(("axis", "name", "slope", "intercept"), [("yaw", "b2", 0.327, 0.228), ("pitch", "d2", 0.367, 0.564)])
def test_json_holds_slope_intercept_exponent_and_schema(run_cli, tmp_path, axis, name, slope, intercept):
    body = run_cli("fit", table(tmp_path, axis), "--json").json
    law = body["laws"][name]
    assert body["schema"] == "fieldsid/fit/1"
    assert law["slope"] == pytest.approx(slope, abs=5e-4)
    assert law["intercept"] == pytest.approx(intercept, abs=5e-4)
    assert law["exponent"]["p_against_2"] < 0.05
    assert len(law["leave_one_out"]) == 5


def test_text_shows_the_candidates_and_says_what_the_exponent_says(run_cli, tmp_path):
    answer = run_cli("fit", table(tmp_path))
    assert answer.code == 0
    for word in ("affine *", "through zero", "power law", "slope 0.3270, intercept 0.2278", "not u^2", "leave one out"):
        assert word in answer.out
    assert "proves little" in answer.err


def test_the_limit_of_a_point_is_said_with_its_meaning(run_cli, tmp_path):
    out = " ".join(run_cli("fit", table(tmp_path)).out.split())
    assert (
        "off: how far from the law of the others, in standard errors; one of 5 points is beyond +/-9.9 by chance in 1 law of 20"
        in out
    )
    assert "out of place" not in out
    few = run_cli("fit", table(tmp_path, rows=YAW[:4]))
    assert "4 points are too few to say which does not belong" in " ".join(few.out.split())
    assert "b2 of" not in few.err


def test_the_file_is_written_with_its_figure_and_not_twice(run_cli, tmp_path):
    law = tmp_path / "law.yaml"
    assert run_cli("fit", table(tmp_path), "-o", law).code == 0
    assert law.with_suffix(".png").read_bytes()[:4] == b"\x89PNG"
    again = run_cli("fit", table(tmp_path), "-o", law)
    assert again.code == 2
    assert "exists" in again.err
    assert run_cli("turn-radius", law, "--rudder-max", "0.26", "--json").code == 0


@pytest.mark.parametrize("force", [(), ("--force",)], ids=["", "force"])
def test_a_folder_is_not_taken_for_the_file_to_write(run_cli, tmp_path, force):
    (tmp_path / "laws").mkdir()
    answer = run_cli("fit", table(tmp_path), "-o", tmp_path / "laws", *force)
    assert answer.code == 2
    assert "is a folder, not a file" in answer.err
    assert f"name a file in it: `{tmp_path / 'laws'}/NAME`" in " ".join(answer.err.split())


def test_one_speed_only_is_said_and_its_point_offered(run_cli, tmp_path):
    answer = run_cli("fit", table(tmp_path, rows=YAW[:1]))
    assert answer.code == 2
    assert "one speed only" in answer.err
    assert "b2 = -0.62" in answer.err
    assert "hint: " in answer.err


def test_a_fit_file_is_not_fitted_again(run_cli, tmp_path):
    law = tmp_path / "law.yaml"
    run_cli("fit", table(tmp_path), "-o", law, "--no-figures")
    answer = run_cli("fit", law)
    assert answer.code == 2
    assert "fit file already" in answer.err


@pytest.mark.parametrize(
    ("rows", "says"),
    [
        ("speed_m_s,a22,b2\n1.0,1.1,\n1.4,1.5,-0.9\n1.8,2.0,\n", "at 1.4 m/s a22 = 1.5, b2 = -0.9"),
        ("speed_m_s,a22,b2,b2_std_error\n1.0,1.1,-0.7,0.01\n1.4,1.5,-0.9,-0.01\n", "line 3: a standard error is not below zero"),
    ],
    ids=["an authority at one speed only", "a standard error below zero"],
)
def test_a_table_without_a_law_is_refused(run_cli, tmp_path, rows, says):
    (tmp_path / "table.csv").write_text(rows)
    answer = run_cli("fit", tmp_path / "table.csv")
    assert answer.code == 2
    assert says in answer.err
