"""Logs of vehicles with several fins for one plane, and of runs in several tables; the numbers behind them are known.

Yaw is of first order in its rate, r' = -A22 r + B2 rudder; pitch has a righting moment beside, q' = -A_Q q - A_S theta + B_Q
elevator. What is commanded changes with a sample of the motion, which is solved exactly between two of them.
"""

from __future__ import annotations

import numpy as np
from binary_logs import write_alog
from scipy.linalg import expm

A22, B2 = 0.9, 0.8
A_Q, A_S, B_Q = 1.1, 0.5, 0.7
STEP, LENGTH_S, EPOCH = 0.05, 160.0, 1.7e9
TIME = STEP * np.arange(round(LENGTH_S / STEP))


def steps(seed, size, shortest_s, longest_s):
    """A command (n,) that changes at random times to random values."""
    rng, values = np.random.default_rng(seed), np.zeros(TIME.size)
    at = 60
    while at < TIME.size:
        until = at + rng.integers(round(shortest_s / STEP), round(longest_s / STEP))
        values[at:until] = rng.choice([-1.0, -0.5, 0.0, 0.5, 1.0]) * size
        at = until
    return values


def moved(matrix, column, command):
    """The states (n, k) of x' = matrix x + column u, u standing from one sample to the next."""
    k = len(column)
    whole = expm(STEP * np.block([[matrix, column[:, None]], [np.zeros((1, k + 1))]]))
    states = np.zeros((command.size, k))
    for i in range(1, command.size):
        states[i] = whole[:k, :k] @ states[i - 1] + whole[:k, k] * command[i - 1]
    return states


def motion(rudder, elevator=None, noise=True, seed=5):
    """Heading, yaw rate, pitch and pitch rate (n,), in deg, as a compass and a gyro give them."""
    rng, size = np.random.default_rng(seed), noise * 1.0
    yaw, rate = moved(np.array([[0.0, 1.0], [0.0, -A22]]), np.array([0.0, B2]), rudder).T
    up, pitching = moved(
        np.array([[0.0, 1.0], [-A_S, -A_Q]]), np.array([0.0, B_Q]), 0.0 * rudder if elevator is None else elevator
    ).T
    return {
        "heading": (40.0 + np.degrees(yaw) + 0.1 * size * rng.standard_normal(yaw.size)) % 360.0,
        "yaw_rate": np.degrees(rate) + 0.1 * size * rng.standard_normal(yaw.size),
        "pitch": np.degrees(up) + 0.1 * size * rng.standard_normal(yaw.size),
        "pitch_rate": np.degrees(pitching) + 0.1 * size * rng.standard_normal(yaw.size),
    }


RUDDER, ELEVATOR = steps(1, 0.2, 1.5, 5.0), steps(2, 0.15, 1.5, 5.0)
ONE = (1.0, 1.0, -1.0, -1.0)
"""How the fins of an X tail go with the rudder; with the elevator go the first and the third."""
OTHER = (1.0, -1.0, 1.0, -1.0)


def x_fins():
    """The four fins (n,) of an X tail in rad, of which rudder and elevator are the sums of a quarter each."""
    return [a * RUDDER + b * ELEVATOR for a, b in zip(ONE, OTHER, strict=True)]


def table(path, columns, digits=6):
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = (
        ",".join(str(v) if isinstance(v, (int, str)) else f"{v:.{digits}f}" for v in row)
        for row in zip(*columns.values(), strict=True)
    )
    path.write_text(",".join(columns) + "\n" + "\n".join(rows) + "\n")
    return path


def of(values):
    return np.asarray(values).tolist()


def angles(found):
    return {"heading_deg": of(found["heading"]), "yaw_rate_deg_s": of(found["yaw_rate"])} | {
        "pitch_deg": of(found["pitch"]),
        "pitch_rate_deg_s": of(found["pitch_rate"]),
    }


def x_tail(folder):
    """A table of an X tail that steers and dives at once, fins in degrees."""
    fins = {f"fin{k}": of(np.degrees(fin)) for k, fin in enumerate(x_fins(), 1)}
    return table(folder / "x_tail.csv", {"time_s": of(TIME), **angles(motion(RUDDER, ELEVATOR)), **fins})


def x_tail_by_pulses(folder):
    """The same fins as pulses of their servos in us, 30 deg at 400 of them."""
    fins = {f"servo{k}_us": of(np.round(1500 + 400 * fin / np.radians(30.0)).astype(int)) for k, fin in enumerate(x_fins(), 1)}
    return table(folder / "pulses.csv", {"time_s": of(TIME), **angles(motion(RUDDER, ELEVATOR)), **fins})


def twin_rudders(folder):
    """Two rudders that toe in, and of which each is trimmed by itself."""
    apart = steps(7, 0.05, 2.0, 6.0)
    sides = {"rudder_port_deg": of(np.degrees(RUDDER + apart) + 2.0), "rudder_stbd_deg": of(np.degrees(RUDDER - apart) - 2.0)}
    return table(folder / "twin.csv", {"time_s": of(TIME), **angles(motion(RUDDER)), **sides})


def plus_tail(folder):
    """Two rudders and two elevators under numbers that say nothing."""
    fins = {f"servo{k}": of(np.degrees(fin)) for k, fin in enumerate((RUDDER, ELEVATOR, RUDDER, ELEVATOR), 1)}
    return table(folder / "plus.csv", {"time_s": of(TIME), **angles(motion(RUDDER, ELEVATOR)), **fins})


PER_NEWTON = 0.01
"""Rad of rudder that a difference of one newton between the thrusters stands for."""


def differential_thrust(folder):
    """A boat without a rudder: (starboard - port) x PER_NEWTON is what turns it."""
    ahead, apart = 20.0 + steps(9, 5.0, 4.0, 9.0), RUDDER / PER_NEWTON / 2.0
    sides = {"thruster_port": of(ahead - apart), "thruster_stbd": of(ahead + apart)}
    found = motion(RUDDER)
    return table(
        folder / "boat.csv",
        {"time_s": of(TIME), "heading_deg": of(found["heading"]), "yaw_rate_deg_s": of(found["yaw_rate"]), **sides},
    )


def moos_x_tail(folder):
    """The X tail by a MOOS logger, each fin a variable."""
    found = motion(RUDDER, ELEVATOR)
    fins = {f"FIN_{k}_DEG": np.degrees(fin) for k, fin in enumerate(x_fins(), 1)}
    return write_alog(folder / "x.alog", TIME, {"NAV_HEADING": found["heading"], "NAV_PITCH": np.radians(found["pitch"]), **fins})


LATE_S = 0.002
"""How long before its sample a command is stamped, where the two are stamped apart."""


def neptus(folder):
    """Two tables of one message each: the state, and four servos row by row; all in rad, seconds since 1970."""
    found, place = motion(RUDDER, ELEVATOR), folder / "mra"
    stamp = "timestamp (seconds since 01/01/1970)"
    rows = len(TIME)
    state = {
        stamp: of(EPOCH + TIME), " system": ["auv-1"] * rows, " phi (rad)": [0.001] * rows,
        " theta (rad)": of(np.radians(found["pitch"])), " psi (rad)": of(np.angle(np.exp(1j * np.radians(found["heading"])))),
        " q (rad/s)": of(np.radians(found["pitch_rate"])), " r (rad/s)": of(np.radians(found["yaw_rate"])),
        " lat (rad)": [0.7] * rows,
    }  # fmt: skip
    table(place / "EstimatedState.csv", state)
    servos = np.stack(x_fins(), axis=1)
    at = np.repeat(EPOCH + TIME - LATE_S, 4)
    ids = np.tile(np.arange(4), rows)
    sent = {stamp: of(at), " system": ["auv-1"] * ids.size, " id": of(ids), " value (rad)": of(servos.ravel())}
    table(place / "SetServoPosition.csv", sent)
    return place


def ulog_tables(folder):
    """Tables of one log that begin with its name, us since boot; of its outputs the last is the rudder."""
    found, place = motion(RUDDER), folder / "log_7"
    at = np.round(1e6 * (112.5 + TIME)).astype(int)
    turn = {"timestamp": of(at), "heading": of(np.radians(found["heading"])), "yaw_rate": of(np.radians(found["yaw_rate"]))}
    table(place / "log_7_vehicle_attitude_0.csv", turn)
    outputs = {"output[0]": of(0.6 + 2.0 * ELEVATOR), "output[1]": of(0.0 * RUDDER)}
    table(place / "log_7_actuator_outputs_0.csv", {"timestamp": of(at - 2000), **outputs, "output[2]": of(RUDDER)})
    return place


def rostopic(folder):
    """Three tables of `rostopic echo -p`, ns since 1970, one number each."""
    found, place = motion(RUDDER), folder / "echo"
    at = (np.int64(EPOCH * 1e9) + np.round(1e9 * TIME).astype(np.int64)).astype(np.int64)
    for name, values in (
        ("heading_deg", found["heading"]),
        ("yaw_rate_deg_s", found["yaw_rate"]),
        ("rudder_deg", np.degrees(RUDDER)),
    ):
        table(place / f"{name}.csv", {"%time": of(at), "field.data": of(values)})
    return place


def simulator(folder):
    """States and inputs apart, seconds from the start, inputs written when they change."""
    found, place = motion(RUDDER), folder / "sim"
    states = {"t [s]": of(TIME), "psi [deg]": of(found["heading"]), "r [deg/s]": of(found["yaw_rate"])}
    table(place / "run3_states.csv", states)
    changes = np.flatnonzero(np.diff(RUDDER, prepend=np.nan) != 0.0)
    changes = np.append(changes, TIME.size - 1)
    table(place / "run3_inputs.csv", {"t [s]": of(TIME[changes]), "rudder [rad]": of(RUDDER[changes])})
    return place
