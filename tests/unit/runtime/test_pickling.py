"""What goes between processes comes back as it was."""

from __future__ import annotations

from types import MappingProxyType

import numpy as np

from fieldsid.runtime.pickling import dumps, loads


def test_mappings_that_are_read_only_are_read_back_as_such():
    value = {"signals": MappingProxyType({"yaw_rad": np.arange(3.0)}), "name": "run7"}
    again = loads(dumps(value))
    assert isinstance(again["signals"], MappingProxyType)
    np.testing.assert_array_equal(again["signals"]["yaw_rad"], np.arange(3.0))
    assert again["name"] == "run7"
