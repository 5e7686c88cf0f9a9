"""`import fieldsid` is light, its names are what mypy sees, and its functions take what the commands take."""

from __future__ import annotations

import ast
import subprocess
import sys
from importlib import import_module
from inspect import Parameter, signature
from pathlib import Path

import pytest
from mypy import api

import fieldsid
from fieldsid.cli.help.catalogue import entries

ROOT = Path(__file__).resolve().parents[3]
HEAVY = ("numpy", "pandas", "scipy", "numba", "matplotlib", "typer", "rich", "pyarrow", "pydantic", "rosbags")

OF_FILES = {"output", "figure", "figures", "force", "undo", "keep", "format_", "apply"}
"""What a command takes for what it prints and writes; a function returns a record instead."""
OF_SESSION = {"context"}
"""What a command is given by the command line that runs it."""
OF_GATES = {"min_fit", "top", "require_phase_margin", "require_gain_margin", "require_delay_margin", "max_overshoot"}
OF_RUNNING = {"done", "unfit"}
"""What a command tells a function to report to, which a script seldom does."""
NOTHING = (None, ())
"""What stands for an option that is not given."""
MUST = {"add", "runs"}
"""What a command asks for in words of its own, and a function by its signature."""
COMMANDS = {
    "load": ("import", None),
    "identify": ("identify", None),
    "compare": ("compare", None),
    "diagnose": ("diagnose", None),
    "extend": ("extend", None),
    "fit_laws": ("fit", None),
    "turn_radius": ("turn-radius", None),
    "design_schedule": ("schedule", "design"),
    "verify_schedule": ("schedule", "verify"),
}


def function_of(command: str, under: str | None):
    module = import_module(entries()[command].module)
    return getattr(module, under) if under else module.command


def in_si(default):
    """What a command takes as text such as `0.26rad`, as the number that a function takes: margins are in deg there."""
    if default is ...:
        return Parameter.empty
    unit = next((u for u in ("rad", "deg") if isinstance(default, str) and default.endswith(u)), None)
    return float(default.removesuffix(unit)) if unit else default


@pytest.mark.parametrize("name", COMMANDS)
def test_a_function_takes_what_its_command_takes(name):
    theirs = {n: in_si(p.default.default) for n, p in signature(function_of(*COMMANDS[name])).parameters.items()}
    ours = {n: p.default for n, p in signature(getattr(fieldsid, name)).parameters.items() if n not in OF_RUNNING}
    assert set(ours) == set(theirs) - OF_FILES - OF_GATES - OF_SESSION
    assert {n for n, default in ours.items() if default not in (theirs[n], *NOTHING)} - MUST == set()
    assert {n for n in ours if theirs[n] not in (ours[n], *NOTHING)} - MUST == set()


def run(code: str) -> str:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip()


def test_importing_the_package_loads_nothing_heavy():
    loaded = f"print([m for m in sys.modules if m.partition('.')[0] in {HEAVY} or m.startswith('fieldsid.')])"
    assert run(f"import sys, fieldsid, fieldsid as fs; dir(fs); {loaded}") == "['fieldsid._version']"


def test_a_view_loads_no_room_before_it_shows_a_record():
    code = "import sys; from fieldsid.registry import members; members('fieldsid.views', 'VIEW')"
    loaded = run(f"{code}; print(*sorted(m for m in sys.modules if m.partition('.')[0] in ('fieldsid', *{HEAVY})))").split()
    light = {"_version", "display", "errors", "figures", "page", "records", "registry", "rounding", "text", "views"}
    assert {m.split(".")[1] for m in loaded if m.startswith("fieldsid.")} == light
    assert [m for m in loaded if m.partition(".")[0] in HEAVY] == []


def test_drawing_leaves_a_notebooks_own_settings_alone_and_tables_do_not_draw(tmp_path):
    code = (
        "import sys, numpy as np, pandas as pd, fieldsid as fs;"
        "t = np.arange(0, 5, 0.1);"
        "run = fs.Run.from_frame(pd.DataFrame({'time_s': t, 'yaw_rad': np.sin(t), 'rudder_rad': np.cos(t)}));"
        "repr(run), run.summary(), run.to_frame(), run._repr_html_();"
        "print('matplotlib' in sys.modules, 'numba' in sys.modules);"
        "run.plot();"
        "print('matplotlib.pyplot' in sys.modules)"
    )
    assert run(code).split() == ["False", "False", "False"]


def test_the_names_mypy_sees_are_the_names_that_are_loaded():
    tree = ast.parse(Path(fieldsid.__file__).read_text())
    (block,) = (n for n in tree.body if isinstance(n, ast.If))
    rooms = [n for n in block.body if isinstance(n, ast.ImportFrom) and n.module != "typing"]
    typed = {node.module: tuple(a.name for a in node.names) for node in rooms}
    assert typed == fieldsid._MODULES
    named = {name for names in typed.values() for name in names}
    assert {*named, "__version__"} == set(fieldsid.__all__)
    assert set(fieldsid.__all__) <= set(dir(fieldsid))
    for room, names in typed.items():
        for name in names:
            assert getattr(fieldsid, name) is getattr(import_module(room), name)


def test_a_name_that_is_not_there_is_no_attribute():
    with pytest.raises(AttributeError, match="'fieldsid' has no attribute 'identfy'"):
        fieldsid.identfy  # noqa: B018


USER = """
from pathlib import Path

import fieldsid as fs

def gains(folder: Path) -> fs.Schedule:
    fits = fs.identify(folder / "*.parquet", "yaw", effects=["servo_lag"])
    reveal_type(fits)
    reveal_type(fits[0].summary())
    reveal_type(fs.compare(fits[0], "a.csv")[0].merit.rate_fit)
    return fs.design_schedule(fits, fin_limit=0.3)

fs.identify("a.csv", "yaw", joit=True)
fs.turn_radius(3.0)
"""


def test_a_function_is_called_by_its_own_names_and_says_what_it_gives():
    """What mypy makes of that takes it minutes at first, and is asked by name."""
    assert str(signature(fieldsid.identify).return_annotation) == "Several[Fit]"
    assert str(signature(fieldsid.turn_radius).parameters["models"].annotation) == "Models"
    with pytest.raises(TypeError, match="unexpected keyword argument 'joit'"):
        signature(fieldsid.identify).bind("a.csv", "yaw", joit=True)


@pytest.mark.slow
def test_a_typed_user_sees_signatures_and_mistakes(tmp_path):
    user = tmp_path / "user.py"
    user.write_text(USER)
    cache, config = str(ROOT / ".mypy_cache"), str(ROOT / "pyproject.toml")
    out, _, _ = api.run(["--strict", "--cache-dir", cache, "--config-file", config, str(user)])
    said = [line.partition(": ")[2] for line in out.splitlines() if "user.py:" in line]
    assert 'note: Revealed type is "fieldsid.face.several.Several[fieldsid.fitting.fit.Fit]"' in said
    for kind in ("str", "float"):
        assert f'note: Revealed type is "{kind}"' in [line.replace("builtins.", "") for line in said]
    errors = [line for line in said if line.startswith("error")]
    assert len(errors) == 2, out
    assert 'Unexpected keyword argument "joit"' in errors[0]
    assert 'Argument 1 to "turn_radius"' in errors[1]
