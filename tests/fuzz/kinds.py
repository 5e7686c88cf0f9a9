"""Every kind of file that is read: a good one of it, the ways it is spoilt, and the doors it is put through."""

from __future__ import annotations

import contextlib
import io
import json
import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import lookalikes
import numpy as np
from bags import MAPPING, write_bag
from binary_logs import write_alog, write_dataflash, write_dbd, write_lsf, write_mat, write_ulog
from cli import trial
from fuzz.mutate import Spoil, spoil_bytes, spoil_column, spoil_parquet, spoil_sqlite, spoil_text, spoil_yaml
from look_alikes import write_key_value, write_text_dataflash

from fieldsid.artifacts import plain, to_yaml
from fieldsid.cli.app import run as command
from fieldsid.errors import FieldsidError
from fieldsid.logs import Note, Run, load_run, save_run
from fieldsid.logs.inspection import inspect_log
from fieldsid.models.axis import Axis
from fieldsid.models.model import load_model, save_model
from fieldsid.models.speed_law import SpeedLaw
from fieldsid.templates import template_path

TIME = 0.05 * np.arange(120)
SIGNALS = {
    "yaw_rad": 3.0 + 0.5 * np.sin(0.5 * TIME),
    "yaw_rate_rad_s": 0.25 * np.cos(0.5 * TIME),
    "surge_m_s": 1.5 + 0.1 * np.sin(TIME),
    "rudder_rad": 0.2 * np.sign(np.sin(0.5 * TIME + 0.01)),
}
NOTES = (Note("gap", "a gap", {"signal": "yaw_rad", "at_s": [1.0, 2.0]}), Note("clock", "a clock", {}))


@dataclass(frozen=True)
class Kind:
    """A good file (or folder, of which `part` is spoilt), made in a folder; and what is done with a spoilt one."""

    name: str
    make: Callable[[Path], Path]
    spoilers: tuple[Spoil, ...]
    doors: tuple[Callable[[Path], None], ...]
    part: str = ""
    slow: bool = False


def inspected(path):
    """Inspect a log, and import it by the mapping that this proposes."""
    found = inspect_log(path)
    json.dumps(found.record(None))
    mapping = path.parent / "proposed.yaml"
    mapping.write_text(found.yaml(), encoding="utf-8")
    with contextlib.suppress(FieldsidError):
        load_run(path, mapping)
    load_run(path, mapping, salvage=True, max_gap_s=math.inf)


def imported(mapping):
    def door(path):
        with contextlib.suppress(FieldsidError):
            load_run(path, mapping and Path(_file(path, mapping)))
        run = load_run(path, mapping and Path(_file(path, mapping)), salvage=True, max_gap_s=math.inf)
        with contextlib.suppress(FieldsidError):
            save_run(run, path.parent / "again.csv", force=True)
        save_run(run, path.parent / "again.parquet", force=True)
        load_run(path.parent / "again.parquet")

    return door


def _file(path, mapping):
    file = path.parent / "given.yaml"
    if not file.exists():
        file.write_text(to_yaml(plain(mapping)))
    return file


def said(*words):
    """A command line, in which FILE stands for the spoilt file and GOOD/ for the folder of good ones."""

    def door(path):
        line = [str(w).replace("FILE", str(path)).replace("GOOD", str(good_files())) for w in words]
        command(line)

    return door


@cache
def good_files() -> Path:
    """A folder of good files that a spoilt one is used beside."""
    import atexit
    import shutil
    import tempfile

    folder = Path(tempfile.mkdtemp(prefix="fieldsid-fuzz-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    as_run(folder).rename(folder / "run.parquet")
    save_run(Run("table", TIME, SIGNALS), folder / "table.csv")
    for speed in (1.0, 1.8):
        model = trial.vehicle(Axis.YAW, "servo_lag", a22=0.8 * speed, b2=-0.6 * speed**2, lag=0.3)
        model = replace(model, law=SpeedLaw(speed), free=("a22", "b2"), covariance=1e-4 * np.eye(2))
        save_model(model, folder / f"m{speed}.yaml")
    trial.flown(folder, name="flown")
    quietly(["fit", folder / "m1.0.yaml", folder / "m1.8.yaml", "-o", folder / "law.yaml", "--no-figures"])
    quietly(
        ["schedule", "design", folder / "law.yaml", "--speeds", "1.0,1.8", "--fin-limit", "0.26", "-o", folder / "gains.yaml"]
    )
    (folder / "prior.yaml").write_text(template_path("plan/priors/torpedo_yaw.yaml").read_text())
    return folder


def quietly(arguments) -> None:
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        command([str(a) for a in arguments])


def good(name):
    def make(folder):
        path = folder / name
        path.write_bytes((good_files() / name).read_bytes())
        return path

    return make


def as_run(folder):
    return save_run(Run("log", TIME, SIGNALS, None, NOTES), folder / "log.parquet")


def as_csv(folder):
    return save_run(Run("log", TIME, SIGNALS), folder / "log.csv")


def as_foreign_csv(folder):
    path = folder / "foreign.csv"
    head = "Date,Time,C True Heading,Vehicle Speed (kn),Fin Yaw T,Latitude,Longitude,mode\n"
    rows = [
        f"06/08/2024,10:00:{t:05.2f},{np.degrees(y):.2f},2.9,{128 + 100 * d:.0f},{41.7 + 1e-6 * i:.7f},-71.4,auto"
        for i, (t, y, d) in enumerate(zip(TIME, SIGNALS["yaw_rad"], SIGNALS["rudder_rad"], strict=True))
    ]
    path.write_text(head + "\n".join(rows) + "\n")
    return path


def bag(kind, compression=""):
    def make(folder):
        return write_bag(
            folder / "log", kind, {"time_s": TIME[:25], **{n: v[:25] for n, v in SIGNALS.items()}}, compression=compression
        )

    return make


def written(writer, name):
    return lambda folder: writer(folder / name, TIME[:60], {n: v[:60] for n, v in SIGNALS.items()})


def as_lsf(folder):
    """A folder as DUNE leaves it, the log and its definition."""
    place = folder / "120000"
    place.mkdir()
    names = {"psi": "yaw_rad", "r": "yaw_rate_rad_s", "u": "surge_m_s", "rudder_rad": "rudder_rad"}
    write_lsf(place / "Data.lsf", TIME[:60], {n: SIGNALS[s][:60] for n, s in names.items()})
    return place


def lsf_inspected(folder):
    inspected(folder / "Data.lsf")


def as_mapping(folder):
    path = folder / "mapping.yaml"
    signals = {
        "yaw_rad": {"column": "yaw_rad", "unit": "rad", "sign": 1, "offset": 0.0},
        "surge_m_s": "surge_m_s",
        "rudder_rad": {"column": 4, "unit": "counts", "centre": 0.0, "scale": 2.0},
        "position": {"columns": [1, 2]},
    }
    table = {"separator": ",", "header": True, "skip": 0, "encoding": "utf-8", "decimal": "."}
    body = {"schema": "fieldsid/mapping/1", "frame": "NED/FRD", "stamp": "header", "clock": "yaw_rad", "gap_factor": 2.5,
            "time": {"column": "time_s", "unit": "s"}, "pressure": {"density": 1025.0}, "table": table,
            "signals": signals}  # fmt: skip
    path.write_text(to_yaml(body))
    return path


def as_vehicle(folder):
    path = folder / "vehicle.yaml"
    path.write_text(template_path("vehicle/torpedo.yaml").read_text())
    return path


def vehicle_read(path):
    from fieldsid.vehicle import load_vehicle

    load_vehicle(path)


def mapping_read(path):
    load_run(good_files() / "table.csv", path, salvage=True, max_gap_s=math.inf)


def as_radius_table(folder):
    path = folder / "radius.csv"
    rows = ["1.0,0.8,-0.6,0.01,0.02", "1.4,1.12,-1.17,0.02,0.03", "1.8,1.44,-1.94,0.03,0.04"]
    path.write_text("speed_m_s,a22,b2,C0,b2_std_error\n" + "\n".join(rows) + "\n")
    return path


def as_effect(folder):
    path = folder / "effect.yaml"
    path.write_text(template_path("effect.yaml").read_text())
    return path


def model_read(path):
    """Read a model and use it as the commands do that need no fit."""
    load_model(path)
    with contextlib.suppress(FieldsidError):
        command(["compare", str(path), str(good_files() / "flown.parquet"), "--json"])
    with contextlib.suppress(FieldsidError):
        command(["schedule", "design", str(path), "--fin-limit", "0.26", "--json"])
    command(["turn-radius", str(path), "--rudder-max", "0.2", "--json"])


def law_read(path):
    with contextlib.suppress(FieldsidError):
        command(["schedule", "design", str(path), "--speeds", "1.4", "--fin-limit", "0.26", "--json"])
    command(["turn-radius", str(path), "--speeds", "1.4", "--rudder-max", "0.2", "--json"])


def schedule_read(path):
    with contextlib.suppress(FieldsidError):
        command(["schedule", "export", str(path), "--to", "ros2"])
    with contextlib.suppress(FieldsidError):
        command(["schedule", "export", str(path), "--to", "dune"])
    command(["schedule", "verify", str(path), "--json"])


def effect_read(path):
    from fieldsid.effects._user_file import load_user_effect

    load_user_effect(path)


def prior_read(path):
    from fieldsid.planning.belief.prior_file import load_believed

    load_believed(path)


TABLE = (spoil_text, spoil_text, spoil_column, spoil_bytes)
NODES = (spoil_yaml, spoil_yaml, spoil_yaml, spoil_text, spoil_bytes)
LOG = (imported(None), inspected)
BAG = (imported(MAPPING), inspected)

KINDS = (
    Kind("parquet", as_run, (spoil_parquet, spoil_parquet, spoil_parquet, spoil_bytes), LOG),
    Kind("csv", as_csv, TABLE, LOG),
    Kind("foreign_csv", as_foreign_csv, TABLE, (inspected,)),
    Kind("units_row", lookalikes.units_row, (spoil_text, spoil_bytes), (inspected,), slow=True),
    Kind("db3", bag("db3"), (spoil_sqlite, spoil_sqlite, spoil_bytes), BAG, part="*.db3"),
    Kind("bag_metadata", bag("db3"), (spoil_yaml, spoil_text), BAG, part="metadata.yaml"),
    Kind("mcap", bag("mcap"), (spoil_bytes,), BAG, part="*.mcap"),
    Kind("mcap_chunks", bag("mcap", "storage"), (spoil_bytes,), BAG, part="*.mcap"),
    Kind("ros1", bag("ros1"), (spoil_bytes,), BAG),
    Kind("ros1_bz2", bag("ros1", "bz2"), (spoil_bytes,), BAG),
    Kind("ulog", written(write_ulog, "log.ulg"), (spoil_bytes,), (inspected,)),
    Kind("ardupilot", written(write_dataflash, "log.bin"), (spoil_bytes,), (inspected,)),
    Kind("text_dataflash", written(write_text_dataflash, "log.log"), (spoil_text, spoil_bytes), (inspected,)),
    Kind("key_value", written(write_key_value, "log.csv"), (spoil_text, spoil_bytes), (inspected,)),
    Kind("slocum", written(write_dbd, "log.dbd"), (spoil_bytes, spoil_text), (inspected,)),
    Kind("mat", written(write_mat, "log.mat"), (spoil_bytes,), LOG),
    Kind("alog", written(write_alog, "log.alog"), (spoil_text, spoil_bytes), (inspected,)),
    Kind("lsf", as_lsf, (spoil_bytes,), (lsf_inspected,), part="Data.lsf"),
    Kind("imc_definition", as_lsf, (spoil_text, spoil_bytes), (lsf_inspected,), part="IMC.xml"),
    Kind("mapping", as_mapping, NODES, (mapping_read,)),
    Kind("vehicle", as_vehicle, NODES, (vehicle_read,)),
    Kind("model", good("m1.0.yaml"), NODES, (model_read,)),
    Kind("law", good("law.yaml"), NODES, (law_read,)),
    Kind("schedule", good("gains.yaml"), NODES, (schedule_read,)),
    Kind("prior", good("prior.yaml"), NODES, (prior_read,)),
    Kind("radius_table", as_radius_table, TABLE, (said("turn-radius", "FILE", "--rudder-max", "0.2", "--json"),
                                                 said("fit", "FILE", "--json"))),
    Kind("effect", as_effect, NODES, (effect_read,)),
    Kind("identify", good("flown.parquet"), (spoil_parquet,), (said("identify", "FILE", "--axis", "yaw", "--json"),), slow=True),
)  # fmt: skip
