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

import numpy as np
from bags import MAPPING, write_bag
from binary_logs import write_alog, write_dataflash, write_dbd, write_lsf, write_mat, write_ulog
from cli import trial
from fuzz.mutate import (
    Spoil,
    spoil_bytes,
    spoil_column,
    spoil_heads,
    spoil_json,
    spoil_lines,
    spoil_names,
    spoil_parquet,
    spoil_sqlite,
    spoil_text,
    spoil_yaml,
)
from look_alikes import units_row, write_key_value, write_text_dataflash

from fieldsid.artifacts import plain, to_yaml
from fieldsid.cli.app import run as command
from fieldsid.errors import FieldsidError
from fieldsid.logs import Note, Run, load_run, save_run
from fieldsid.logs.inspection import inspect_log
from fieldsid.models.axis import Axis
from fieldsid.models.model import load_model, save_model
from fieldsid.models.speed_law import SpeedLaw
from fieldsid.online.identifier import OnlineIdentifier
from fieldsid.online.look import look_body
from fieldsid.online.progress import Watch, default_goals
from fieldsid.online.samples import MessageReader, Sample, samples_of
from fieldsid.online.sources import lines_of
from fieldsid.online.state_file import load_state, save_state
from fieldsid.plant.laws.axis_laws import load_laws
from fieldsid.registry import members
from fieldsid.reporting.material import material_of
from fieldsid.reporting.page import html_of
from fieldsid.reporting.sections import context_of
from fieldsid.results.logs import inspected as told
from fieldsid.schedule.record import load_schedule
from fieldsid.templates import template_path
from fieldsid.trial_folder.journal import Entry, Stamp, append
from fieldsid.trial_folder.state import state_of

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
    json.dumps(plain(told(found, None)))
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


def as_tables(folder):
    """A run in two tables, the motion and four fins row by row; either of them may be spoilt."""
    place = folder / "tables"
    place.mkdir()
    motion = [
        f"{1.7e9 + t:.2f},{y:.5f},{r:.5f}" for t, y, r in zip(TIME, SIGNALS["yaw_rad"], SIGNALS["yaw_rate_rad_s"], strict=True)
    ]
    (place / "State.csv").write_text("timestamp,psi (rad),r (rad/s)\n" + "\n".join(motion) + "\n")
    fins = [
        f"{1.7e9 + t:.2f},{k},{(-1) ** k * d:.4f}" for t, d in zip(TIME, SIGNALS["rudder_rad"], strict=True) for k in range(4)
    ]
    (place / "Servo.csv").write_text("timestamp,id,value (rad)\n" + "\n".join(fins) + "\n")
    return place


def as_mapping(folder):
    path = folder / "mapping.yaml"
    signals = {
        "yaw_rad": {"column": "yaw_rad", "unit": "rad", "sign": 1, "offset": 0.0},
        "surge_m_s": "surge_m_s",
        "rudder_rad": {"column": 4, "unit": "counts", "centre": 0.0, "scale": 2.0},
        "position": {"columns": [1, 2]},
        "elevator_rad": {"sum": [{"column": 3, "unit": "deg", "scale": 0.5}, {"column": "surge_m_s", "scale": -0.5}]},
    }
    table = {"separator": ",", "header": True, "skip": 0, "encoding": "utf-8", "decimal": "."}
    body = {"schema": "fieldsid/mapping/1", "frame": "NED/FRD", "stamp": "header", "clock": "yaw_rad", "gap_factor": 2.5,
            "time": {"column": "time_s", "unit": "s"}, "pressure": {"density": 1025.0}, "table": table,
            "signals": signals}  # fmt: skip
    path.write_text(to_yaml(body))
    return path


def as_vehicle(folder):
    path = folder / "vehicle.yaml"
    fins = "fins: {names: [a, b], to_rudder: [0.5, 0.5], to_elevator: [0.5, -0.5], limits: 0.5}\n"
    path.write_text(template_path("vehicle/torpedo.yaml").read_text() + fins)
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
    from fieldsid.planning.belief.prior_model import load_believed

    load_believed(path)


def as_plan(folder):
    from plan_legs import leg, plan

    from fieldsid.planning.output.plan_file import save_plan

    return save_plan(plan(leg("square_pulses"), leg("doublet")), folder / "plan.yaml")


def exported(path):
    """Export a schedule to every target: each file holds what it holds where the same numbers have no words of others."""
    from fieldsid.exports import all_targets
    from fieldsid.schedule.record import load_schedule

    known = load_schedule(path)
    plain = replace(known, provenance={}, notes=())
    for name, target in all_targets().items():
        text, own = (target.render(s, target.node, None) for s in (known, plain))
        check_lines("\n".join(x for x in text.split("\n") if x not in own.split("\n")))
        check_lines(own.replace("\t", " "))  # which separates what a target writes itself, and nothing that names say
        if name != "yaml":
            own_lines, lines = ([x for x in t.split("\n") if not x.startswith(("#", "//"))] for t in (own, text))
            assert lines == own_lines, f"{name} holds lines that are none of the schedule's"


def flown_from_list(path):
    """Write every leg of a plan as every mission: lines of text, the same ones whatever the plan calls things."""
    from fieldsid.planning.output.mission import render, styles
    from fieldsid.planning.output.plan_file import load_plan

    known = load_plan(path)
    for leg in known.legs:
        for style in styles():
            text, own = (render(p, leg, style) for p in (known, replace(known, vehicle="x")))
            check_lines(text)
            assert text.split("\n")[1:] == own.split("\n")[1:], f"{style} holds lines that are none of the plan's"


def check_lines(text):
    """What is written for a vehicle or shown on a terminal has no letter that is not printable."""
    for line in text.split("\n"):
        assert line.isprintable(), f"a line holds {line[:200]!r}"


def shown(*words):
    """A command line whose output and messages are looked through for what would steer a terminal."""

    def door(path):
        out = io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
            try:
                said(*words)(path)
            except FieldsidError as error:
                out.write(str(error))
        check_lines(out.getvalue())

    return door


def in_a_trial(name, *, journal=False):
    """Put a spoilt file into a trial of one model, as what its name says."""

    def door(path):
        folder = path.parent / "trial"
        (folder / "models").mkdir(parents=True, exist_ok=True)
        (folder / "models" / "m.yaml").write_bytes((good_files() / "m1.0.yaml").read_bytes())
        if not journal:
            (folder / "journal.jsonl").write_bytes(as_journal(path.parent).read_bytes())
        (folder / name).write_bytes(path.read_bytes())
        reported(folder, page=len(path.read_bytes()) % PAGES == 0)

    return door


def printed(path):
    """Print what a file holds, each line of it as a name: in a table, as a headline's line, a note, a message."""
    from fieldsid.cli.console import complain, out, table, warn, words
    from fieldsid.page import Block

    names = path.read_bytes().decode(errors="surrogateescape").split("\n")
    stream = io.StringIO()
    with contextlib.redirect_stdout(stream), contextlib.redirect_stderr(stream):
        for name in names:
            out().print(table(Block(name, ((name, "1.0"), ("", name)), (name, "number"))))
            out().print(words(name, "bold"))
            out().print(name, soft_wrap=True)
            complain(name)
            warn([Note("code", name, {})])
            stream.write(str(FieldsidError(name, found=name, hint=name)))
    check_lines(stream.getvalue())


PAGES = 8
"""Of so many files one's page is laid out too: compiling its template takes ten times as long as all else."""


def reported(folder, *, page):
    """Make all of a folder's report but the page's file; what to do next in it is a part of that."""
    context = context_of(material_of(state_of(folder)))
    if page:
        html_of(context).encode()


def as_journal(folder):
    path = folder / "journal.jsonl"
    path.unlink(missing_ok=True)
    stamps = (Stamp("models/m.yaml", "0" * 64, 3000, 10**18), Stamp("runs/x.parquet", "1" * 64, 9000, 10**18))
    for i, words in enumerate((("identify", "x"), ("diagnose", "x"), ("schedule", "verify", "gains.yaml"), ("report",))):
        done = Entry(f"2026-05-01T10:0{i}:00+00:00", ("sysid", *words), 0, 1.5, "says so", stamps[:1], stamps)
        append(folder, done)
    return path


def as_diagnosis(folder):
    errors = {
        "train": {"angle_rms_rad": 0.016, "rate_rms_rad_s": 0.02},
        "validation": {"angle_rms_rad": 0.01, "rate_rms_rad_s": None},
    }
    found = {"effect": "servo_lag", "probability": 0.97, "explained": 0.99, "log_evidence": 10.0, "worse": False, **errors}
    body = {"schema": "fieldsid/diagnosis/1", "inputs": [{"path": "runs/x.parquet", "sha256": "a" * 64}], "parent": None,
            "axis": "yaw", "verdict": "effect", "says": "so", "effects": ["servo_lag"], "base": errors, "noiseless": False,
            "noise_floor": {"angle_rad": 0.005, "rate_rad_s": 0.003}, "candidates": [found, {**found, "effect": "delay"}],
            "runs": ["x"], "validation_runs": ["y"]}  # fmt: skip
    return written_yaml(folder / "diagnosis.yaml", body)


def as_turns(folder):
    row = {"speed_m_s": 1.0, "side": "port", "radius_m": 5.3, "interval95": [4.8, 5.9], "steady_radius_m": 5.3,
           "u_turn_radius_m": 5.8,
           "u_turn_time_s": 18.0, "yaw_rate_max_rad_s": 0.19, "extrapolated": False, "trust": "identified"}  # fmt: skip
    rows = [{**row, "side": side, "speed_m_s": speed} for side in ("port", "starboard") for speed in (1.0, 1.8)]
    return written_yaml(
        folder / "turns.yaml", {"schema": "fieldsid/turn-radius/1", "inputs": [], "rudder_max_rad": 0.27, "rows": rows}
    )


def written_yaml(path, body):
    path.write_text(to_yaml(body))
    return path


@cache
def flown_state() -> str:
    identifier, watch = OnlineIdentifier("yaw"), Watch(default_goals(Axis.YAW))
    for sample in samples_of(load_run(good_files() / "flown.parquet"), Axis.YAW):
        identifier.update(*sample[:5], fin_is_held=sample.fin_is_held, fin_line=sample.fin_line)
        watch.excitation.hear(sample.time, sample.fin, sample.rate)
        if sample.time % 1.0 < 0.02:
            watch.look(identifier.estimate())
    return save_state(good_files() / "state.json", identifier, watch, "flown.parquet").read_text()


def as_state(folder):
    path = folder / "state.json"
    path.write_text(flown_state())
    return path


def state_read(path):
    """Go on from a state with forty samples more, and keep it again."""
    watch = Watch(default_goals(Axis.YAW))
    identifier, source = load_state(path, Axis.YAW, watch)
    begin = identifier.time if math.isfinite(identifier.time) else 0.0
    feed(identifier, watch, [Sample(begin + 0.05 * i, 0.1, 0.01 * i, 0.2, 1.0) for i in range(1, 40)])
    save_state(path, identifier, watch, source)


def feed(identifier, watch, samples):
    for sample in samples:
        identifier.update(*sample[:5], fin_is_held=sample.fin_is_held, fin_line=sample.fin_line)
        watch.excitation.hear(sample.time, sample.fin, sample.rate)
    now = identifier.estimate()
    json.dumps(look_body(now, watch.look(now), source="x", goals_from="y", unreadable=0, then=""), allow_nan=False)


def as_messages(folder):
    path = folder / "lines.jsonl"
    rows = [{"time_s": round(0.05 * i, 3), "rudder_deg": 5.0 * (-1) ** (i // 20), "yaw_deg": 90.0 + i, "yaw_rate_rad_s": 0.1,
             "surge_m_s": 1.2, "mode": "auto"} for i in range(80)]  # fmt: skip
    path.write_text("\n".join(json.dumps(row) for row in rows) + "\n")
    return path


def messages_read(path):
    """Take lines as live input, and keep the state they leave."""
    watch, identifier = Watch(default_goals(Axis.YAW)), OnlineIdentifier("yaw")
    with path.open("rb") as stream:
        feed(identifier, watch, [s for s in lines_of(stream, MessageReader(Axis.YAW)) if s is not None])
    save_state(path, identifier, watch, "-")


def schedule_exported(path):
    """Read a schedule, and write it for every vehicle."""
    schedule = load_schedule(path)
    schedule.at(1.3)
    for target in members("fieldsid.exports", "EXPORT").values():
        target.render(schedule, "", None)


TABLE = (spoil_text, spoil_text, spoil_column, spoil_bytes)
LINES = (spoil_lines, spoil_lines, spoil_lines, spoil_text, spoil_bytes)
NODES = (spoil_yaml, spoil_yaml, spoil_yaml, spoil_text, spoil_bytes)
LOG = (imported(None), inspected)
BAG = (imported(MAPPING), inspected)

KINDS = (
    Kind("parquet", as_run, (spoil_parquet, spoil_parquet, spoil_parquet, spoil_bytes), LOG),
    Kind("csv", as_csv, TABLE, LOG),
    Kind("foreign_csv", as_foreign_csv, TABLE, (inspected,)),
    Kind("units_row", units_row, (spoil_text, spoil_bytes), (inspected,), slow=True),
    Kind("db3", bag("db3"), (spoil_sqlite, spoil_sqlite, spoil_bytes), BAG, part="*.db3"),
    Kind("bag_metadata", bag("db3"), (spoil_yaml, spoil_text), BAG, part="metadata.yaml"),
    Kind("mcap", bag("mcap"), (spoil_bytes,), BAG, part="*.mcap"),
    Kind("mcap_chunks", bag("mcap", "storage"), (spoil_bytes,), BAG, part="*.mcap"),
    Kind("ros1", bag("ros1"), (spoil_bytes,), BAG, slow=True),
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
    Kind("several_tables", as_tables, TABLE, (inspected,), part="S*.csv", slow=True),
    Kind("mapping", as_mapping, NODES, (mapping_read,)),
    Kind("vehicle", as_vehicle, NODES, (vehicle_read,)),
    Kind("model", good("m1.0.yaml"), NODES, (model_read,)),
    Kind("law", good("law.yaml"), NODES, (law_read,)),
    Kind("schedule", good("gains.yaml"), NODES, (schedule_read,)),
    Kind("schedule_exports", good("gains.yaml"), NODES, (schedule_exported,)),
    Kind("journal", as_journal, LINES, (in_a_trial("journal.jsonl", journal=True),)),
    Kind("diagnosis_record", as_diagnosis, NODES, (in_a_trial("diagnosis.yaml"),)),
    Kind("turn_record", as_turns, NODES, (in_a_trial("turns.yaml"),)),
    Kind("schedule_record", good("gains.yaml"), NODES, (in_a_trial("gains.yaml"),)),
    Kind("model_record", good("m1.0.yaml"), NODES, (in_a_trial("models/m.yaml"),)),
    Kind("law_record", good("law.yaml"), NODES, (in_a_trial("law.yaml"), load_laws)),
    Kind("live_state", as_state, (spoil_json, spoil_json, spoil_json, spoil_text, spoil_bytes), (state_read,)),
    Kind("live_input", as_messages, LINES, (messages_read,)),
    Kind("prior", good("prior.yaml"), NODES, (prior_read,)),
    Kind("export", good("gains.yaml"), (spoil_names,), (exported, shown("schedule", "export", "FILE", "--to", "moos"))),
    Kind("mission", as_plan, (spoil_names,), (flown_from_list,)),
    Kind("heads", as_foreign_csv, (spoil_heads,), (shown("inspect", "FILE"),), slow=True),
    Kind("terminal", as_foreign_csv, (spoil_heads, spoil_text, spoil_bytes), (printed,), slow=True),
    Kind("radius_table", as_radius_table, TABLE, (said("turn-radius", "FILE", "--rudder-max", "0.2", "--json"),
                                                 said("fit", "FILE", "--json"))),
    Kind("effect", as_effect, NODES, (effect_read,)),
    Kind("identify", good("flown.parquet"), (spoil_parquet,), (said("identify", "FILE", "--axis", "yaw", "--json"),), slow=True),
)  # fmt: skip
