"""Every hint of the logs' errors that holds a command, an option or a line of a mapping: raised, pasted, and then it works."""

from __future__ import annotations

import ast
import re
import shlex
import shutil
import sqlite3
from pathlib import Path

import numpy as np
import pytest
from bags import EPOCH_NS, BagWriter
from binary_logs import write_lsf
from cli import test_hints
from ruamel.yaml import YAML

import fieldsid.logs
from fieldsid.artifacts import to_yaml

ROOM = Path(fieldsid.logs.__file__).parent
SNIPPET = re.compile(r"`([^`]+)`")
PASTED = re.compile(r"`[^`]*(sysid |--[a-z]|\w+: )[^`]*`")
"""What of a hint is meant to be pasted."""
OF_FINDINGS = ("doctor", "mend.py", "pandas_table.py")
"""What a finding says is pasted by test_finding_hints.py; a table in memory has no command line."""
TIME = 0.1 * np.arange(120)
ROWS = [f"{t:.1f},{40 + 5 * np.sin(t):.4f},{8 * np.cos(0.7 * t):.4f}" for t in TIME]
OWN = {"my_auv/msg/Fins": "float64 rudder\nfloat64 heading\n"}


def table(head="t,heading,rudder", rows=ROWS, mapping=None):
    Path("log.csv").write_text("\n".join([head, *rows]) + "\n")
    if mapping is not None:
        mapped(mapping)


def mapped(body):
    Path("m.yaml").write_text(body if isinstance(body, str) else to_yaml(body))


def columns(**signals):
    return {"time": {"column": "t", "unit": "s"}, "signals": signals}


YAW = {"column": "heading", "unit": "deg"}


def own_bag(*folders):
    """A bag of a type that it names and does not define; each folder beside it gets another definition."""
    with BagWriter(Path("bag"), "db3", types=OWN) as bag:
        for k in range(60):
            bag.write("/fins", "my_auv/msg/Fins", bag.make("my_auv/Fins", 0.01 * k, 0.02 * k), EPOCH_NS + k * 10**8)
    log = next(Path("bag").glob("*.db3"))
    with sqlite3.connect(log) as base:
        base.execute("DELETE FROM message_definitions")
    base.close()
    shutil.move(log, "log.db3")
    shutil.rmtree("bag")
    for i, folder in enumerate(folders):
        place = Path(folder) / "my_auv" / "msg"
        place.mkdir(parents=True)
        text = OWN["my_auv/msg/Fins"] if i == 0 else "float64 rudder\nfloat64 heading\nint8 more\n"
        (place / "Fins.msg").write_text(text)
    signals = {"yaw_rad": {"topic": "/fins", "field": "heading"}, "rudder_rad": {"topic": "/fins", "field": "rudder"}}
    mapped({"signals": signals})


def plain_bag(stamp="", late_s=0.0):
    """A bag with a stamped odometry, `late_s` before it was recorded, and a command without a header."""
    with BagWriter(Path("log.bag"), "ros1") as bag:
        for k in range(60):
            at = EPOCH_NS + k * 10**8
            turn = bag.make("geometry_msgs/Quaternion", 0.0, 0.0, np.sin(0.01 * k), np.cos(0.01 * k))
            pose = bag.make("geometry_msgs/Pose", bag.make("geometry_msgs/Point", 0.0, 0.0, 0.0), turn)
            header = bag.header(at - round(late_s * 1e9))
            bag.write("/pose", "geometry_msgs/msg/PoseStamped", bag.make("geometry_msgs/PoseStamped", header, pose), at)
            bag.write("/rudder", "std_msgs/msg/Float64", bag.make("std_msgs/Float64", 0.1 * np.sin(0.3 * k)), at)
    rudder = {"topic": "/rudder", "field": "data"} | ({"stamp": stamp} if stamp else {})
    mapped({"signals": {"attitude": {"topic": "/pose", "field": "pose.orientation"}, "rudder_rad": rudder}})


def dune():
    write_lsf(Path("Data.lsf"), TIME, {"psi": 0.2 * np.sin(TIME), "r": 0.2 * np.cos(TIME), "rudder_rad": 0.1 * np.sin(TIME)})
    Path("IMC.xml").rename(there("defs") / "IMC.xml")


def two_runs():
    place = there("logs")
    for k in (1, 2):
        motion = "".join(f"{t:.1f},{40 + 5 * np.sin(0.1 * k * t):.3f}\n" for t in TIME)
        (place / f"run{k}_state.csv").write_text("time_s,heading_deg\n" + motion)
        (place / f"run{k}_input.csv").write_text("time_s,rudder_deg\n" + "".join(f"{t:.1f},{5 * np.sin(t):.3f}\n" for t in TIME))


def there(name):
    Path(name).mkdir()
    return Path(name)


IMPORT = "import log.csv --mapping m.yaml -o runs"
CASES = {
    "a mapping without a time": (lambda: table(mapping={"signals": {"yaw_rad": YAW}}), IMPORT),
    "a column that counts samples": (
        lambda: table("sample,heading,rudder", [f"{i},{r.partition(',')[2]}" for i, r in enumerate(ROWS)],
                      {"signals": {"yaw_rad": YAW}}),
        IMPORT,
    ),
    "a rate beside a unit": (
        lambda: table(mapping={"time": {"column": "t", "unit": "s", "rate": 10}, "signals": {"yaw_rad": YAW}}),
        IMPORT,
    ),
    "a time of columns without their parts": (
        lambda: table("h,m,s,heading,rudder", [f"14,{3 + int(t // 60)},{t % 60:.1f},{40 + t},5" for t in TIME],
                      {"time": {"columns": ["h", "m", "s"]}, "signals": {"yaw_rad": YAW}}),
        IMPORT,
    ),
    "channels without a time": (table, "import log.csv --channel yaw_rad=heading:deg -o runs"),
    "a quaternion of two": (
        lambda: table("t,qx,qy,qz,qw", [f"{t:.1f},0,0,0,1" for t in TIME], columns(attitude={"columns": ["qx", "qy"]})),
        IMPORT,
    ),
    "a place beyond the table": (lambda: table(mapping=columns(yaw_rad={"column": 9})), IMPORT),
    "a name that two columns have": (lambda: table("t,a,a", mapping=columns(yaw_rad={"column": "a"})), IMPORT),
    "x in ENU alone": (lambda: table(mapping=columns(x_m={"column": "heading", "frame": "ENU"})), IMPORT),
    "no mapping": (lambda: table("a,b,c"), "import log.csv -o runs"),
    "an empty mapping": (lambda: table(mapping=columns()), IMPORT),
    "a centre without counts": (
        lambda: table(rows=[f"{t:.1f},{40 + t},{128 + round(90 * np.sin(t))}" for t in TIME],
                      mapping=columns(rudder_rad={"column": "rudder", "centre": 128})),
        IMPORT,
    ),
    "a channel that is none": (table, "import log.csv --channel heading --channel time=t:s --channel rudder_rad=2:deg -o runs"),
    "no place for a signal": (lambda: table(mapping=columns(yaw_rad={"unit": "deg"})), IMPORT),
    "a position of one": (
        lambda: table("t,LAT,LON", [f"{t:.1f},{41 + 1e-5 * t},-71" for t in TIME], columns(position={"columns": ["LAT"]})),
        IMPORT,
    ),
    "a mapping for a log": (lambda: table(mapping=columns(yaw_rad=YAW)), "inspect m.yaml"),
    "a topic without a header": (lambda: plain_bag("header"), "import log.bag --mapping m.yaml -o runs"),
    "two clocks": (lambda: plain_bag(late_s=3.0), "import log.bag --mapping m.yaml -o runs"),
    "a mapped type without a definition": (own_bag, "import log.db3 --mapping m.yaml -o runs"),
    "two definitions": (lambda: own_bag("ws1", "ws2"), "import log.db3 --mapping m.yaml -o runs"),
    "a dune log alone": (dune, "inspect Data.lsf"),
    "several runs of two tables": (two_runs, "inspect logs"),
}  # fmt: skip


def templates():
    """Return the hints of the room's errors that hold something to paste, as expressions with a place for each value."""
    found = {}
    for path in sorted(ROOM.rglob("*.py")):
        if any(part in path.parts or part == path.name for part in OF_FINDINGS):
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            for value in _hinted(node):
                text = _text(value)
                if PASTED.search(text):
                    found[f"{path.relative_to(ROOM)}:{value.lineno}"] = text
    return found


def _hinted(node):
    if isinstance(node, ast.Call):
        yield from (k.value for k in node.keywords if k.arg == "hint")
    if isinstance(node, ast.Assign) and any(isinstance(t, ast.Name) and t.id in ("hint", "way") for t in node.targets):
        yield node.value
    if isinstance(node, ast.FunctionDef) and node.name == "_inspect":
        yield from (n.value for n in ast.walk(node) if isinstance(n, ast.Return) and n.value is not None)


def _text(node):
    if isinstance(node, ast.Constant):
        return str(node.value)
    if isinstance(node, ast.JoinedStr):
        return "".join(str(v.value) if isinstance(v, ast.Constant) else "\0" for v in node.values)
    if isinstance(node, ast.BinOp):
        return _text(node.left) + _text(node.right)
    if isinstance(node, ast.IfExp):
        return _text(node.body)
    return "\0"


BY_OTHERS = {
    "leave that run out, or fly": "a fin that never moves",
    "identify it first": "a log for a model",
    "write a mapping:": "foreign names",
}
"""Hints that test_hints.py pastes, by one of its cases."""
UNREACHED = (
    "change `--from` and `--to`",
    "import the log again with `sysid import`", "give a clean one: ", "give the definitions the vehicle was built with",
    "give a definition that ends",
    "give its folder: ", "if it is one, say in a mapping how it is written, as ", "`--force`, or name another output",
)  # fmt: skip
"""Options without a value, to be chosen by the times found. Of a run made in memory; of definitions that are damaged or do not
fit, whose folder is asked for as in the cases here; an example of how a table may be written; a bag that is written, not read."""


def refused(run_cli, monkeypatch, folder, case):
    """Return the command line of a case, and the error it ends in."""
    folder.mkdir()
    monkeypatch.chdir(folder)
    prepare, line = CASES[case]
    prepare()
    answer = run_cli(*shlex.split(line))
    assert (answer.code, answer.out) == (2, ""), (answer.code, answer.out, answer.err)
    return shlex.split(line), answer.err


def edited(error, snippet):
    """Set a line of a mapping where its hint says: at the top, under the signals, or at the signal that the error names."""
    line = YAML(typ="safe").load(snippet.replace("NAME", "heading"))
    path = Path("m.yaml")
    body = YAML(typ="safe").load(path.read_text()) if path.exists() else {}
    said, hint = error.split("\nhint: ")
    (key, value), *_ = line.items()
    if "under `signals`" in hint or key in body.get("signals", {}):
        body["signals"] = {**(body.get("signals") or {}), **line}
    elif "top of the mapping" in hint or key in ("time", "table"):
        body |= line
    else:
        signal = next(s for s in re.findall(r"`(\w+)`", hint.split(snippet)[1] + said) if s in body["signals"])
        kept = {k: v for k, v in body["signals"][signal].items() if not (key == "column" and k == "columns")}
        body["signals"][signal] = {**kept, key: value}
    mapped(body)


def with_option(arguments, words, folder):
    """Return a command line with an option of a hint, in place of its own where it has one."""
    option, *values = [folder if w == "DIR" else w for w in words]
    kept = list(arguments)
    if option == "--channel":
        place = kept.index("heading") - 1 if "heading" in kept else len(kept)  # the one that was none
        return [*kept[:place], option, *values, *kept[place + 2 :]]
    if option in kept:
        kept[kept.index(option) + 1] = values[0]
        return kept
    return [*kept, option, *values]


def defined():
    """Return a folder with the definitions that a log of this folder lacks."""
    if Path("defs").exists():
        return "defs"
    place = there("defs") / "my_auv" / "msg"
    place.mkdir(parents=True)
    (place / "Fins.msg").write_text(OWN["my_auv/msg/Fins"])
    return "defs"


@pytest.mark.parametrize("case", CASES)
def test_what_a_hint_of_a_log_says_is_pasted_and_works(run_cli, tmp_path, monkeypatch, case):
    arguments, error = refused(run_cli, monkeypatch, tmp_path / "first", case)
    snippets = [s for s in SNIPPET.findall(error.split("\nhint: ")[1]) if PASTED.search(f"`{s}`") or s.startswith("--")]
    snippets = [s for s in snippets if not s.startswith("topic:")]  # of a bag, beside the line for a table
    assert snippets, error
    for i, snippet in enumerate(snippets):
        refused(run_cli, monkeypatch, tmp_path / str(i), case)
        if snippet.startswith("sysid "):
            line = [defined() if w == "DIR" else w for w in shlex.split(snippet)[1:]]
        elif snippet.startswith("--"):
            line = with_option(arguments, shlex.split(snippet), defined() if "DIR" in snippet else "")
        else:
            edited(error, snippet)
            line = arguments
        answer = run_cli(*line)
        assert answer.code == 0, (snippet, answer.err)


def test_every_hint_with_something_to_paste_is_raised_by_a_case(run_cli, tmp_path, monkeypatch):
    said = []
    for i, case in enumerate(CASES):
        said.append(refused(run_cli, monkeypatch, tmp_path / f"all{i}", case)[1].split("\nhint: ")[1])
    for place, text in templates().items():
        by_others = next((name for start, name in BY_OTHERS.items() if start in text), None)
        if by_others is not None:
            assert by_others in test_hints.CASES
        elif not any(part in text for part in UNREACHED):
            expression = ".*?".join(re.escape(part) for part in text.split("\0"))
            assert any(re.search(expression, hint, re.DOTALL) for hint in said), (place, text)
