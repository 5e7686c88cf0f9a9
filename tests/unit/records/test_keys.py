"""A record's JSON is what its keys say: names, shares in per cent, records inline, what is left out and what is null."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import pytest

from fieldsid.artifacts import plain
from fieldsid.records.keys import INLINE, Key, Number, Result, Words, body_of, keys_of


@dataclass(frozen=True, slots=True)
class Inner:
    radius: Annotated[Number, Key("Its radius.", "radius_m")]
    aside: object = None

    @property
    def is_round(self) -> Annotated[bool, Key()]:
        """Whether it is round."""
        return True


@dataclass(frozen=True, slots=True)
class Outer(Result):
    SCHEMA = "fieldsid/outer/1"

    inner: Annotated[Inner, INLINE]
    parts: Annotated[tuple[Inner, ...], Key("Its parts.")]
    by_name: Annotated[dict[str, Inner], Key("The same by name.")]
    share: Annotated[float, Key("Its share.", "share_percent", times=100.0)]
    stale: Annotated[Words, Key("Why it is stale.")] = ""
    file: Annotated[str | None, Key("Its file.", is_optional=True)] = None
    figure: Annotated[str | None, Key("Its figure.")] = None


OUTER = Outer(Inner(2.0), (Inner(float("nan")),), {"a": Inner(1.0)}, 0.25)
BODY = {
    "schema": "fieldsid/outer/1",
    "radius_m": 2.0,
    "is_round": True,
    "parts": [{"radius_m": None, "is_round": True}],
    "by_name": {"a": {"radius_m": 1.0, "is_round": True}},
    "share_percent": 25.0,
    "stale": None,
    "figure": None,
}


def test_a_records_json_is_what_its_keys_say():
    assert plain(OUTER) == BODY


def test_an_optional_key_is_there_where_it_has_a_value():
    assert body_of(Outer(Inner(2.0), (), {}, 0.25, file="a.yaml"))["file"] == "a.yaml"


def test_a_field_without_a_key_is_no_part_of_the_json():
    assert [name for _, name, _, _ in keys_of(Inner)] == ["radius_m", "is_round"]


@pytest.mark.parametrize("value", [np.zeros(3), "text", 1, {"a": 1}])
def test_what_is_no_record_stays_as_it_is(value):
    assert np.array_equal(body_of(Inner(1.0, aside=value))["radius_m"], 1.0)
    assert plain({"x": value})["x"] == (value.tolist() if isinstance(value, np.ndarray) else value)
