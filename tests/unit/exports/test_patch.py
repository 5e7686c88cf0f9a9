"""A YAML file is patched under one key and nowhere else: comments, order, quotes, line ends; refusals; the backup."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from ruamel.yaml import YAML

from fieldsid.errors import ArtifactError, UsageError
from fieldsid.exports._patch import patch_yaml, write_patch
from fieldsid.exports._target import decimal

COLUMNS = {"speed_m_s": [1.0, 1.5], "kp": [-0.5, -1e-05], "supported": [1.0, 0.0]}
FILE = """# the vehicle, edited by hand
vehicle:
  name: 'pandan'      # keep the quotes
  limits: [0.26, 0.35]
control:
  heading:
    # tuned at the pond
    gains:
      kp: [0.5, 0.6]  # by ear
      old: 3
    rate_hz: 20
  depth: {kp: 1.0}
list:
  - a
  - b: 2
"""
RAGGED = """a:   1
control:
      gains:
          kp: 1.0
          list:
          - 1
      # about the next one
      other:   "x"
b : [1,
     2]
"""


def written(folder, text, newline="\n"):
    path = folder / "vehicle_config.yaml"
    path.write_bytes(text.replace("\n", newline).encode())
    return path


def changed(patch):
    removed = [line[1:] for line in patch.difference.splitlines() if line.startswith("-") and not line.startswith("---")]
    added = [line[1:] for line in patch.difference.splitlines() if line.startswith("+") and not line.startswith("+++")]
    return removed, added


@pytest.mark.parametrize("newline", ["\n", "\r\n"], ids=["unix", "dos"])
def test_only_the_keys_own_lines_differ_and_its_comments_stay(tmp_path, newline):
    path = written(tmp_path, FILE, newline)
    patch = patch_yaml(path, "control.heading.gains", COLUMNS)
    removed, added = changed(patch)
    assert [line.strip() for line in removed] == ["kp: [0.5, 0.6]  # by ear", "old: 3"]
    assert len(added) == 3
    assert "# by ear" in patch.after
    assert "# tuned at the pond" in patch.after
    assert patch.after.count("\r\n") == (patch.after.count("\n") if newline == "\r\n" else 0)
    assert path.read_bytes().decode() == FILE.replace("\n", newline)


def test_the_new_value_has_floats_only_and_no_exponent(tmp_path):
    patch = patch_yaml(written(tmp_path, FILE), "control.heading.gains", COLUMNS)
    gains = YAML(typ="safe").load(patch.after)["control"]["heading"]["gains"]
    assert gains == COLUMNS
    assert "-0.00001" in patch.after
    assert "e-05" not in patch.after


def test_a_scalar_can_be_replaced_by_the_gains(tmp_path):
    patch = patch_yaml(written(tmp_path, FILE), "control.heading.rate_hz", COLUMNS)
    assert YAML(typ="safe").load(patch.after)["control"]["heading"]["rate_hz"] == COLUMNS


def test_a_ragged_file_keeps_every_other_line(tmp_path):
    patch = patch_yaml(written(tmp_path, RAGGED), "control.gains", COLUMNS)
    removed, added = changed(patch)
    assert [line.strip() for line in removed] == ["kp: 1.0", "list:", "- 1"]
    assert len(added) == 3
    assert patch.after.startswith("a:   1\n")
    assert "      # about the next one\n" in patch.after


@pytest.mark.parametrize(
    "old", ["", " 3  # so", " *b", " [1, 2]", "\n  - 1\n  # of a list\n", "\n    kp: 1 # it\n    ki: {x: 1}\n"]
)
@pytest.mark.parametrize("after", ["", "\n", "\n# the next\nother: *b\n"])
def test_whatever_stands_at_a_key_is_replaced(tmp_path, old, after):
    text = f"base: &b {{x: 1}}\ngains:{old}{after}"
    patch = patch_yaml(written(tmp_path, text), "gains", COLUMNS)
    assert YAML(typ="safe").load(patch.after) == {**YAML(typ="safe").load(text), "gains": COLUMNS}
    assert all(comment in patch.after for comment in ("# so", "# it", "# of a list", "# the next") if comment in text)


def test_a_key_inside_braces_is_replaced_there(tmp_path):
    patch = patch_yaml(written(tmp_path, FILE), "control.depth.kp", COLUMNS)
    assert "depth: {kp: {speed_m_s: [1.0, 1.5], kp: [" in patch.after


def test_a_key_that_is_not_there_names_the_near_one(tmp_path):
    with pytest.raises(UsageError, match="gians") as caught:
        patch_yaml(written(tmp_path, FILE), "control.heading.gians", COLUMNS)
    assert "`gains`" in caught.value.hint
    with pytest.raises(UsageError):
        patch_yaml(written(tmp_path, FILE), "vehicle.name.x", COLUMNS)
    with pytest.raises(UsageError):
        patch_yaml(written(tmp_path, FILE), "", COLUMNS)


@pytest.mark.parametrize("text", ["a: [1\n", "- 1\n- 2\n", "\tx: 1\n"])
def test_a_file_that_is_no_yaml_mapping_is_refused(tmp_path, text):
    with pytest.raises(ArtifactError):
        patch_yaml(written(tmp_path, text), "a", COLUMNS)


def test_writing_keeps_a_backup_and_never_overwrites_one(tmp_path):
    path = written(tmp_path, FILE)
    first = write_patch(patch_yaml(path, "control.heading.gains", COLUMNS))
    second = write_patch(patch_yaml(path, "control.heading.gains", {"kp": [9.0]}))
    assert first.read_text() == FILE
    assert [first.name, second.name] == ["vehicle_config.yaml.bak", "vehicle_config.yaml.bak2"]
    assert YAML(typ="safe").load(path.read_text())["control"]["heading"]["gains"] == {"kp": [9.0]}


def test_a_read_only_file_is_refused_and_untouched(tmp_path):
    path = written(tmp_path, FILE)
    patch = patch_yaml(path, "control.heading.gains", COLUMNS)
    path.chmod(0o444)
    with pytest.raises(ArtifactError, match="read-only"):
        write_patch(patch)
    assert path.read_text() == FILE
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_a_file_that_changed_meanwhile_is_refused(tmp_path):
    path = written(tmp_path, FILE)
    patch = patch_yaml(path, "control.heading.gains", COLUMNS)
    path.write_text(FILE + "more: 1\n")
    with pytest.raises(ArtifactError, match="changed meanwhile"):
        write_patch(patch)


@given(st.floats(-1e4, 1e4))
def test_a_decimal_reads_back_as_a_float_to_six_places(value):
    text = decimal(value)
    assert "." in text
    assert "e" not in text
    assert float(text) == pytest.approx(value, abs=6e-7)
