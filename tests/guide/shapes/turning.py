"""Laws over speed and turning: fit, turn-radius."""

from __future__ import annotations

from typing import Literal

from guide.shapes.common import AxisName, Interval, Number, Remark, Result, Shape, Side, Skipped, schema_field


class Point(Shape):
    """Parameters at one speed."""

    name: str
    """The model, or the row of a table."""
    speed_m_s: float
    """Its speed."""
    values: dict[str, float]
    """By parameter."""
    std_errors: dict[str, Number]
    """Their standard errors, where they are known."""


class Line(Shape):
    """A law y(u): the sum of c_k u^p_k, or exp(c_0) u^c_1 where `powers` is empty."""

    kind: str
    """`constant`, `linear`, `affine`, `through_zero` or `power`."""
    powers: list[float]
    """The powers p."""
    coefficients: list[float]
    """The numbers c."""
    std_errors: list[Number]
    """Their standard errors."""
    covariance: list[list[Number]]
    """Their covariance."""
    dof: int
    """Degrees of freedom."""
    r2: Number
    """Share of the points' variance it explains; proves little."""
    rms: float
    """Root mean square of what it leaves."""


class Exponent(Shape):
    """The e of |b| = k u^e."""

    value: float
    """The estimate."""
    std_error: Number
    """Its standard error."""
    interval95: Interval
    """Its 95 % interval."""
    p_against_2: Number
    """Two-sided p-value of e = 2; null where two speeds fit any."""
    says: str
    """What that means."""


class LeftOut(Shape):
    """A point against the law of the others."""

    name: str
    """The point."""
    speed_m_s: float
    """Its speed."""
    value: float
    """Its value, times the sign."""
    predicted_without: float
    """What the law of the others gives there."""
    leading_coefficient_without: float
    """The leading coefficient of that law."""
    studentised: Number
    """How far off it is, externally studentised."""
    limit: Number
    """Bonferroni's limit."""
    belongs: bool
    """Whether it is within it."""


class Law(Shape):
    """The law of one parameter, as sign times the chosen candidate."""

    sign: float
    """-1 where the parameter is negative."""
    chosen: str
    """The candidate that the next commands take."""
    weighted: bool
    """Whether the points' standard errors weigh them."""
    slope: Number
    """Slope of the affine law against u^2."""
    intercept: Number
    """Its intercept."""
    candidates: dict[str, Line]
    """All that were fitted."""
    exponent: Exponent | None
    """The exponent of the authority, with its test against 2; null for the other parameters."""
    leave_one_out: list[LeftOut]
    """Each point against the law of the others."""


class Laws(Result):
    """Parameters against speed."""

    schema_: Literal["fieldsid/fit/1"] = schema_field("fieldsid/fit/1")
    axis: AxisName
    """The plane."""
    speed_low_m_s: float
    """Slowest point."""
    speed_high_m_s: float
    """Fastest point."""
    points: list[Point]
    """What the laws were drawn through."""
    laws: dict[str, Law]
    """By parameter."""
    warnings: list[Remark]
    """What to know before they are trusted."""
    file: str | None
    """The file that was written."""
    figure: str | None
    """The figure that was drawn."""


class Turn(Shape):
    """The turn at one entry speed to one side."""

    speed_m_s: float
    """Entry speed."""
    side: Side
    """The side."""
    radius_m: Number
    """The radius, by `method`: the median of what is believed, or the formula's."""
    interval95: Interval
    """Its 95 % band, parameters and model form together."""
    steady_radius_m: Number
    """Radius of the settled circle."""
    u_turn_radius_m: Number
    """Path of a half turn over pi."""
    u_turn_time_s: Number
    """Time of a half turn."""
    u_turn_time95_s: Interval
    """Its 95 % band."""
    yaw_rate_max_rad_s: Number
    """Largest yaw rate, its size."""
    turn_speed_m_s: Number
    """Speed along the path in the settled turn."""
    advance_m: Number
    """Distance along the approach at 90 deg; null for the formulas."""
    transfer_m: Number
    """Distance across it at 90 deg."""
    tactical_diameter_m: Number
    """Distance across it at 180 deg."""
    predicted_m: Number
    """The prediction, where `radius_m` was measured."""
    predicted95: Interval
    """Its band."""
    model_radius_m: Number
    """Radius of the identified yaw model by itself."""
    band_only: bool
    """Whether `interval95` is wider than 35 % of `radius_m`: what is known is the band, and no number in it."""
    method: Literal["u_turn", "steady", "simulated", "maneuvering", "measured"]
    """Where the radius comes from."""
    extrapolated: bool
    """Whether the turn lies beyond what the data reached."""
    trust: Literal["measured", "identified", "extrapolated"]
    """What it rests on."""
    because: list[str]
    """What was not reached."""
    settle_with: str
    """The maneuver that would settle it."""


class MeasuredTurn(Shape):
    """A measured circle beside the prediction for its fin and speed."""

    run: str
    """The run."""
    side: Side
    """The side."""
    radius_m: float
    """Radius of the circle, current taken out."""
    interval95: Interval
    """Its 95 % interval."""
    std_error_m: Number
    """Its standard error."""
    predicted_m: Number
    """The prediction."""
    predicted95: Interval
    """Its band."""
    difference_percent: Number
    """Predicted over measured, less one."""
    inside_band: bool
    """Whether the measured radius is inside the prediction's band."""
    fin_rad: Number
    """The fin it was flown with."""
    entry_speed_m_s: Number
    """Speed before the turn."""
    path_speed_m_s: Number
    """Speed along the circle."""
    centre_m: list[float]
    """North and east of the centre."""
    current_m_s: list[float]
    """North and east of the current."""
    turned_rad: float
    """Angle that was turned."""
    settled_from_s: float
    """Start of the settled part."""
    settled_to_s: float
    """End of it."""


class Tightest(Shape):
    """Where the radius is smallest over speed."""

    speed_m_s: float
    """The speed."""
    radius_m: float
    """The radius."""


class Surge(Shape):
    """Speed lost in a turn: u' = a_u (u0^2 - u^2) - k_r r^2 - k_d u^2 delta^2, v = -l_r r."""

    drag_per_m: float
    """a_u."""
    turn_loss_m: float
    """k_r."""
    fin_loss_per_m: float
    """k_d."""
    drift_per_rate_m: float
    """l_r."""
    surge_measured: bool
    """Whether surge was measured."""
    sway_measured: bool
    """Whether sway was measured."""
    rms_m_s: Number
    """Root mean square of what the fit to the surge leaves."""


class TurnRadius(Result):
    """The turning radius over speed."""

    schema_: Literal["fieldsid/turn-radius/1"] = schema_field("fieldsid/turn-radius/1")
    rudder_max_rad: float
    """Rudder held in the turn."""
    rows: list[Turn]
    """One for each speed and side."""
    measured: list[MeasuredTurn]
    """Measured circles."""
    minimum: dict[Side, Tightest | None]
    """By side, the smallest radius where it has a minimum inside the speeds."""
    surge: Surge | None
    """The loss of speed, where runs tell it."""
    warnings: list[Remark]
    """What to know before it is trusted."""
    settling: list[str]
    """What would settle the rows that are extrapolated."""
    skipped_runs: list[Skipped]
    """Logs that could not be used, and why; where there are any, the exit code is 1."""
    figures: list[str]
    """The figures that were drawn."""
