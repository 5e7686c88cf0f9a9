"""The truth of a case as coefficients of the catalogue's effects.

A form that is not the textbook's is represented by its textbook part. The parameters of the base model are not given where they
change with it; the caller fits them with these coefficients fixed.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True, slots=True)
class Projection:
    """Coefficients shared by all runs, those of each training run, and parameters of the base model where known."""

    shared: dict[str, float]
    per_run: list[dict[str, float]] = field(default_factory=list)
    base: dict[str, float] = field(default_factory=dict)


def without_fin(damping, stiffness, authority, cross):
    """Return damping, stiffness, cross damping and cross rate of a model with the same response to the fin but no fin term in x'.

    The cross state is x' = -c x - n p + f d, (c, n, f) = `cross`. The transfer function from fin to angle has the denominator
    (s^2 + a s + k)(s + c) + n s and the numerator b (s + c) + f; its zero c + f / b becomes the cross damping.
    """
    c, n, f = cross
    zero = c + f / authority
    a = damping + c - zero
    k = stiffness * c / zero if zero else 0.0
    return a, k, zero, damping * c + stiffness + n - a * zero - k


def of_own_bank(case, reference):
    """Return the projection of a case of tests/truth/bank.py at a reference speed in m/s."""
    d, name = case.details, case.effects[0]
    u = reference / d["nominal_speed"] if np.isfinite(reference) else 1.0
    q = d["fields"]
    base = {"damping": q.get("damping", d["damping"]), "stiffness": d["stiffness"]}
    cross = (
        q.get("cross_damping", 1.0) * u,
        -q.get("cross_rate", 0.0) * q.get("cross_moment", 0.0) * u * u,
        -q.get("cross_fin", 0.0) * q.get("cross_moment", 0.0) * u**3,
    )
    values = {
        "delay": lambda: {"delay": q["delay"]},
        "rate_limit": lambda: {"max_rate": q["max_rate"]},
        "servo_lag": lambda: {"lag": q["servo_tau"] or 1.4 / q["servo_omega"]},
        "backlash": lambda: {"gap": q["backlash_gap"]},
        "deadband": lambda: {"width": q["deadband_width"]},
        "asymmetric_fin": lambda: {"asymmetry": q["asymmetry"]},
        "stall": lambda: {"stall_angle": q["stall_angle"], "slope_after": q["stall_slope"]},
        "quadratic_damping": lambda: {"quadratic": q["quadratic"]},
        "crossflow_drag": lambda: {
            "crossflow": q["crossflow"],
            "flow_damping": q["cross_damping"] * u,
            "flow_rate": q["cross_rate"] * u / q["length"],
            "flow_fin": 0.0,
        },
        "speed_varying": lambda: {"speed_share": 1.0},
        "trim_drift": lambda: {"drift": 60.0 * q["drift"]},
        "step_change": lambda: {"loss": q["step_loss"], "moment_step": q["step_moment"]},
        "prop_moment": lambda: {"prop_moment": q["thrust_moment"]},
        "wave": lambda: {"period": q["wave_period"], "amplitude": q["wave_amplitude"]},
        "roll_coupling": lambda: {"roll_moment": q["roll_moment"]},
        "current": lambda: {"current_sin": q["current_sin"], "current_cos": q["current_cos"]},
        "large_angle_righting": lambda: {"righting_sin": d["stiffness"], "righting_cos": d["trim"] + q["trim"]},
        "depth_buoyancy": lambda: {"depth_moment": q["depth_moment"]},
        "speed_moment": lambda: {"speed_moment": q["speed_moment"]},
        "compass_deviation": lambda: {"deviation_sin": q["compass_sin"], "deviation_cos": q["compass_cos"]},
        "gyro_bias": lambda: {"bias": q["gyro_bias"]},
        "gyro_scale": lambda: {"scale_error": q["gyro_scale"]},
        "clock_offset": lambda: {"offset": -q["clock_offset"]},
    }
    if name in ("sway_coupling", "heave_coupling"):
        a, k, c, n = without_fin(base["damping"] * u ** d["law"], d["stiffness"], d["authority"] * u * u, cross)
        return Projection({"cross_damping": c, "cross_rate": n}, base={"damping": a, "stiffness": k})
    per_run = {
        "step_change": lambda f: {"event_time": min(f["step_time"] / d["run_s"], 1.0)},
        "wave": lambda f: {"phase": f["wave_phase"]},
    }.get(name, lambda _f: {})
    return Projection(values[name](), [per_run(f) for f in d["per_run"]], base)


def of_second_bank(key, run_s):
    """Return the projection of a case of the second bank from its key; run_s: duration of its runs in s."""
    p, v, name = key["parameters"], key["vehicle"], key["effects"][0]
    pitching, speed = key["axis"] == "pitch", float(np.median(key["speeds_m_s"]))
    base = {"damping": v["c2"] if pitching else v["a"], "stiffness": v["c3"] if pitching else 0.0}
    values = {
        "quadratic_damping": lambda: {"quadratic": p["a_rr"]},
        "servo_lag": lambda: {"lag": p["tau"]},
        "delay": lambda: {"delay": p["delay"]},
        "rate_limit": lambda: {"max_rate": p["rate"]},
        "deadband": lambda: {"width": p["db"]},
        "backlash": lambda: {"gap": p["play"]},
        "stall": lambda: {"stall_angle": p["st_angle"], "slope_after": 1.0 - p["st_k"]},
        "asymmetric_fin": lambda: {"asymmetry": p["asym"]},
        "speed_varying": lambda: {"speed_share": 1.0},
        "roll_coupling": lambda: {"roll_moment": p["k_phi"]},
        "current": lambda: {"current_sin": p["k_c"] * np.cos(p["psi_c"]), "current_cos": -p["k_c"] * np.sin(p["psi_c"])},
        "wave": lambda: {"period": p["t_w"], "amplitude": p["a_w"]},
        "trim_drift": lambda: {"drift": 60.0 * p["k_t"]},
        # the log's thrust ratio is n, and the moment is proportional to n^2: take the slope at the mean
        "prop_moment": lambda: {"prop_moment": 2.0 * p["k_n"] * speed / 2.4},
        "compass_deviation": lambda: {
            "deviation_sin": p["dev"] * np.cos(p["dev_ph"]),
            "deviation_cos": p["dev"] * np.sin(p["dev_ph"]),
        },
        "gyro_bias": lambda: {"bias": p["g_b"]},
        "step_change": lambda: {"loss": p["loss"], "moment_step": 0.0},
        "large_angle_righting": lambda: {"righting_sin": p["c3_big"], "righting_cos": p["cx"]},
        "depth_buoyancy": lambda: {"depth_moment": p["k_z"]},
        "speed_moment": lambda: {"speed_moment": p["k_u"]},
    }
    if name in ("sway_coupling", "heave_coupling"):
        cross = (v["av"], -p["k_v"] * v["kvr"] * speed, -p["k_v"] * v["bv"])
        authority = key["gain"]["b_ref"] * (speed / 1.6) ** key["gain"]["b_exp"]
        if pitching:
            cross = (v["aw"], p["k_v"] * v["kwq"] * speed, -p["k_v"] * v["bw"])
            authority = key["gain"]["d_ref"] * (speed / 1.6) ** key["gain"]["d_exp"]
        a, k, c, n = without_fin(base["damping"], base["stiffness"], authority, cross)
        return Projection({"cross_damping": c, "cross_rate": n}, base={"damping": a, "stiffness": k})
    runs = len(key["train"]) if "train" in key else 3
    per_run = {
        "step_change": lambda i: {"event_time": float(np.clip(p["t_loss_s_per_run"][i] / run_s, 0.0, 1.0))},
        "wave": lambda i: {"phase": p["phase_per_run"][i]},
    }.get(name, lambda _i: {})
    return Projection(values[name](), [per_run(i) for i in range(runs)], base)
