"""The one loader of YAML and JSON: every limit with an error of its own, plain values alone, and plain files alone."""

from __future__ import annotations

import os
import time

import pytest

from fieldsid.errors import ArtifactError
from fieldsid.records import reading
from fieldsid.records.reading import DEEPEST, LARGEST_TEXT, MOST_VALUES, near_files, read_json, read_text, read_yaml


def refused(tmp_path, text):
    path = tmp_path / "file.yaml"
    path.write_text(text)
    with pytest.raises(ArtifactError) as error:
        read_yaml(path)
    return str(error.value)


def bomb(levels, width):
    lines = ["a0: &a0 [x, x]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * width)}]" for i in range(1, levels)]
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (bomb(12, 9), "aliases .* stand for more than"),
        (bomb(60, 2), "aliases .* stand for more than"),
        ("a: &a {b: *a}\n", "line 1: a value that holds itself"),
        ("a: " + "[" * (DEEPEST + 5) + "]" * (DEEPEST + 5), "inside one another more than"),
        ("a: [" + "1, " * MOST_VALUES + "1]", "more than 30000 keys and values"),
        ("x: 1\na: !own 3\n", "line 2: a value of a type of its own, `'!own'`"),
        ("a: !!python/object/apply:os.system [id]\n", "a value of a type of its own"),
        ("a: !!binary aGVsbG8=\n", "a value of a type of its own"),
        ("? [1, 2]\n: 3\n", "a key that is no word"),
        ("a: " + "9" * 400 + "\n", "a number of 400 digits"),
        ("a: 0x" + "f" * 20 + "\n", "beyond 64 bits"),
        ('a: "\\ud800"\n', "half a letter"),
        ("a: [1\n", "not valid YAML"),
        ('a: "\\UFFFFFFFF"\n', "cannot read"),
        ("- 1\n", "holds no keys with values"),
        ("a: 1\na: 2\n", "not valid YAML"),
    ],
)
def test_what_passes_a_limit_is_refused_at_once_with_its_reason(tmp_path, text, says):
    begin = time.process_time()
    found = refused(tmp_path, text)
    assert time.process_time() - begin < 60.0  # no hang, on a slow machine too
    assert len(found) < 1000
    with pytest.raises(AssertionError, match=says):
        raise AssertionError(found)


def test_words_that_yaml_has_types_for_stay_text_and_keys_are_text(tmp_path):
    path = tmp_path / "file.yaml"
    path.write_text(
        "day: 2026-05-01\nsum: =\n1: one\ntrue: yes\n~: [0x1f, 1e3, .inf, null]\nagain: &a {x: 1}\nmore: {<<: *a, y: 2}\n"
    )
    assert read_yaml(path) == {
        "day": "2026-05-01", "sum": "=", "1": "one", "true": "yes", "~": [31, 1000.0, float("inf"), None],
        "again": {"x": 1}, "more": {"x": 1, "y": 2},
    }  # fmt: skip


def test_a_file_that_is_too_large_is_not_read(tmp_path):
    path = tmp_path / "file.yaml"
    with path.open("wb") as stream:
        stream.truncate(LARGEST_TEXT + 1)
    with pytest.raises(ArtifactError, match="too large"):
        read_text(path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="the system has no pipes with a name")
def test_a_pipe_and_a_device_are_no_plain_files(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", reading.Path("/dev/zero")):
        with pytest.raises(ArtifactError, match="is no plain file"):
            read_text(path)


@pytest.mark.parametrize(
    "text", [b"9" * 400, b"[" * 100_000, b'{"a":' * 50_000, b"\xff", b'"\\ud800"', b'{"a": ' + b"1" * 25 + b"}", b"{", b""]
)
def test_json_beyond_the_limits_is_a_value_error(text):
    with pytest.raises(ValueError, match=r"."):
        read_json(text)


def test_json_is_read_as_it_is():
    assert read_json(b'{"a": [1, -2.5, null, true, "\\u00e9"]}') == {"a": [1, -2.5, None, True, "é"]}
    assert read_json(str(2**63)) == 2**63


def test_a_name_that_is_nearly_right_is_told(tmp_path):
    (tmp_path / "model.yaml").write_text("a: 1\n")
    assert "model.yaml" in near_files(tmp_path / "modle.yaml")
