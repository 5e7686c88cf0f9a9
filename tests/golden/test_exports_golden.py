"""Exported files, letter for letter: a change of a format that vehicles read must be seen and meant."""

from __future__ import annotations

from pathlib import Path

import pytest

from fieldsid.exports import all_targets
from fieldsid.models.axis import Axis
from fieldsid.schedule.controller import Gains
from fieldsid.schedule.record import Row, Schedule

FOLDER = Path(__file__).with_suffix("")
ROWS = (
    Row(1.0, Gains(-0.8722, -0.01, 0.0), -0.013871, 0.0, 0.26, 0.0, supported=True, slowed=0.82, phase_margin_deg=64.5,
        gain_margin_db=18.1, delay_margin_s=1.41),
    Row(1.5, Gains(-0.4904, -0.005, -0.0012), 0.0, 0.0, 0.26, 0.0, supported=False, slowed=1.0, phase_margin_deg=65.5,
        gain_margin_db=float("inf"), delay_margin_s=2.26),
)  # fmt: skip
PROVENANCE = {
    "tool": "fieldsid 0.0.0",
    "models": [{"path": "models/a.yaml", "sha256": "00112233445566778899aabbccddeeff" * 2}],
    "runs": ["run1"],
    "supported_m_s": [1.0, 1.2],
    "law": "rudder = kp (ref - yaw) + ki int(ref - yaw) dt - kd rate + feed_forward, limited to +/- fin_limit",
    "sign_convention": "positive rudder turns to port (b2 < 0); angles rad, NED, body forward-starboard-down",
    "schedule_variable": "speed_m_s: forward speed through the water, m/s",
    "between_rows": "linear in speed",
    "outside_rows": "clamp: the nearest row's gains",
}
SCHEDULE = Schedule(Axis.YAW, "pi", 0.7071, 45.0, depth=False, rows=ROWS, actuator={"lag_s": 0.2}, provenance=PROVENANCE)


@pytest.mark.parametrize("name", sorted(all_targets()))
def test_the_exported_text_is_the_stored_one(name):
    target = all_targets()[name]
    stored = FOLDER / f"{name}{target.suffix}"
    assert target.render(SCHEDULE, target.node, None) == stored.read_text(encoding="utf-8")
