"""Templates are found in the source tree and in the wheel, and a mistyped one is refused with the near match."""

from __future__ import annotations

import pytest

from fieldsid import templates
from fieldsid.errors import UsageError
from fieldsid.templates import template_names, template_path


def test_every_template_is_found_by_its_name():
    assert template_names()
    assert all(template_path(name).is_file() for name in template_names())


def test_what_an_installer_compiles_of_a_template_is_none(tmp_path, monkeypatch):
    (tmp_path / "ros2" / "__pycache__").mkdir(parents=True)
    (tmp_path / "ros2" / "node.py").touch()
    (tmp_path / "ros2" / "__pycache__" / "node.cpython-311.pyc").touch()
    monkeypatch.setattr(templates, "template_root", lambda: tmp_path)
    assert template_names() == ("ros2/node.py",)


def test_a_mistyped_template_is_refused_with_the_near_match():
    name = template_names()[0]
    with pytest.raises(UsageError) as caught:
        template_path(name + "x")
    assert name in caught.value.hint
