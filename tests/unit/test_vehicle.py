"""vehicle.yaml: what is taken, and what is refused with the near match."""

import dataclasses

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldsid.errors import ArtifactError, FieldsidError, VehicleError
from fieldsid.templates import template_path
from fieldsid.vehicle import Vehicle, find_vehicle, load_vehicle, vehicle_of


@pytest.mark.parametrize("template", sorted(template_path("vehicle").glob("*.yaml")), ids=lambda p: p.stem)
def test_every_template_is_a_valid_vehicle(template):
    vehicle = load_vehicle(template)
    assert vehicle.name == template.stem
    assert vehicle.rudder_max_rad > 0
    assert vehicle.speed_min_m_s < vehicle.speed_max_m_s
    assert "rudder_rad" in vehicle.signals


def test_a_vehicle_is_frozen_and_knows_the_fin_of_an_axis():
    vehicle = vehicle_of({"name": "a", "rudder_max_rad": 0.4, "elevator_max_rad": 0.3})
    assert (vehicle.fin_max_rad("yaw"), vehicle.fin_max_rad("pitch")) == (0.4, 0.3)
    with pytest.raises(dataclasses.FrozenInstanceError):
        vehicle.name = "b"


def test_only_the_name_is_needed():
    assert vehicle_of({"name": "a"}) == Vehicle("a")


@pytest.mark.parametrize(
    ("body", "what", "hint"),
    [
        ({"name": "a", "ruder_max_rad": 0.3}, "unknown key `ruder_max_rad`", "`rudder_max_rad`"),
        ({"name": "a", "rudder_max_rad": "0.3"}, "`rudder_max_rad` is not valid", "correct"),
        ({"name": "a", "rudder_max_rad": 25.0}, "`rudder_max_rad` is not valid", "correct"),
        ({"name": "a", "rudder_max_rad": True}, "`rudder_max_rad` is not valid", "correct"),
        ({"name": "a", "length_m": -1.0}, "`length_m` is not valid", "correct"),
        ({"name": "a", "positive_rudder": "left"}, "`positive_rudder` is not valid", "correct"),
        ({"name": "a", "signals": ["yaw_rads"]}, "unknown signal `yaw_rads`", "`yaw_rad`"),
        ({"name": "a", "speed_min_m_s": 2.0, "speed_max_m_s": 1.0}, "is not below", "correct"),
        ({"name": 7}, "`name` is not valid", "correct"),
        ({}, "lacks `name`", "name"),
    ],
)
def test_a_wrong_vehicle_is_refused_with_its_place(body, what, hint):
    with pytest.raises(VehicleError) as error:
        vehicle_of(body)
    assert what in error.value.what
    assert hint in error.value.hint
    assert error.value.found


def test_a_file_that_is_no_mapping_is_refused(tmp_path):
    path = tmp_path / "vehicle.yaml"
    assert find_vehicle(tmp_path) is None
    path.write_text("- a\n- b\n")
    with pytest.raises(ArtifactError, match="holds no keys with values"):
        find_vehicle(tmp_path)
    path.write_text("name: a\n")
    assert find_vehicle(tmp_path).source == path


values = st.one_of(
    st.none(), st.booleans(), st.integers(), st.floats(), st.text(max_size=5), st.lists(st.text(max_size=3), max_size=2)
)


@given(
    st.dictionaries(
        st.one_of(st.sampled_from([f.name for f in dataclasses.fields(Vehicle)]), st.text(max_size=6)), values, max_size=4
    )
)
def test_any_body_is_a_vehicle_or_a_three_part_error(body):
    try:
        parts = (vehicle_of({"name": "a", **body}).name,)
    except FieldsidError as error:
        parts = (error.what, error.found, error.hint)
    assert all(parts)
