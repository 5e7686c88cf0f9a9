"""Names and files that a step is given, in the ways that a person writes them."""

from __future__ import annotations

import pytest

from fieldsid.face.arguments import names_of


@pytest.mark.parametrize(
    "said", ["delay,servo_lag", "delay+servo_lag", " delay , servo_lag,", "delay servo_lag", ["delay", "servo_lag"]]
)
def test_a_set_of_names_is_the_same_in_each_of_its_spellings(said):
    assert names_of(said) == ("delay", "servo_lag")


def test_no_names_are_none():
    assert names_of(None) == names_of("") == ()
