"""The house: imports go one way between rooms and sub-rooms, no two files import each other.

Heavy libraries stay in their rooms.
"""

from __future__ import annotations

import ast
import warnings
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "fieldsid"

ORDER = (
    "_version", "text", "errors", "numerics", "runtime", "registry", "page", "display", "records",
    "artifacts", "rounding", "settled", "angles", "strict",
    "templates", "guide", "logs", "maneuvers", "models", "vehicle", "effects", "dynamics", "noise", "fitting", "estimators",
    "comparison", "planning", "diagnosis", "extension", "batch", "plant", "turning", "schedule", "online", "exports",
    "trial_folder", "change", "figures", "views", "reporting", "face", "results",
    "demo", "cli", "__main__",
)  # fmt: skip
"""A room may import itself and what stands before it."""

SUB_ROOMS = {
    "logs": ("convert", "doctor", "several", "mapping", "readers"),
    "logs/readers/bags": ("messages", "containers"),
    "models": ("helpers",),
    "noise": ("kalman",),
    "fitting": ("problem", "regression", "optimise", "covariance", "initial", "predict", "checks"),
    "diagnosis": ("data", "evidence", "residual_tests", "moves", "search", "report"),
    "planning": ("specify", "belief", "flight", "safety", "design", "discriminate", "output"),
    "plant": ("laws",),
    "turning": ("measured", "steady", "maneuvering"),
    "schedule": ("flown", "search"),
    "cli": ("help", "trial", "headlines", "live", "commands"),
}
"""The folders inside a room: each may import itself and what stands before it. Files that stand in the room itself are its
entry and what its folders share: of them, as of all files, no two import each other by any way round."""

REGISTRIES = ("effects", "maneuvers", "figures", "views", "logs/readers", "cli/commands")
"""Folders with one file per member, however many there are."""
MOST_FILES = 12

ONLY = {
    "rosbags": ("fieldsid/logs/readers/bags/",),
    "matplotlib": ("fieldsid/figures/",),
    "typer": ("fieldsid/cli/",),
    "rich": ("fieldsid/cli/",),
    "pydantic": ("fieldsid/strict", "fieldsid/vehicle", "fieldsid/logs/mapping/mapping_file"),
    "numba": ("fieldsid/numerics/jit.py",),
}
LATE = ("control", "pandas", "pyarrow", "scipy.optimize", "scipy.signal", "scipy.stats")
"""What no file imports when it is loaded itself: each costs as much as NumPy, and most commands need few of them."""
TOP = {"pyproject.toml", "README.md", "LICENSE", "CONTRIBUTING.md", "CHANGELOG.md", "templates", "fieldsid", "tests"}
WRITTEN_BY_TOOLS = ("build", "dist", "sysid-demo")
LONGEST = 400

FILES = sorted(p for p in PACKAGE.rglob("*.py"))


@cache
def parsed(source: str) -> tuple[tuple[str, ...], frozenset[str]]:
    """What a source text imports anywhere, and what when it is imported itself: many tests ask, and it takes long."""
    tree = ast.parse(source)
    nodes = [n for n in tree.body if isinstance(n, (ast.Import, ast.ImportFrom))]
    return tuple(_imports_in(tree)), frozenset(getattr(n, "module", None) or n.names[0].name for n in nodes)


def imports_of(source: str) -> tuple[str, ...]:
    """Every module a source text imports, inside functions too, by name or through `import_module("...")`."""
    return parsed(source)[0]


def imports_at_start(path: Path) -> frozenset[str]:
    """The modules that are loaded when a file is imported: not those inside functions, nor those for mypy alone."""
    return parsed(path.read_text())[1]


def _imports_in(tree: ast.Module) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield ("." * node.level) + (node.module or "")
            if (node.module or "").split(".")[0] == "fieldsid":
                yield from (name for alias in node.names if is_module(name := f"{node.module}.{alias.name}"))
        elif isinstance(node, ast.Call) and getattr(node.func, "id", getattr(node.func, "attr", "")) == "import_module":
            yield from (a.value for a in node.args if isinstance(a, ast.Constant) and isinstance(a.value, str))


def is_module(name: str) -> bool:
    """Whether a dotted name is a file or a folder of the package, or would be one of its rooms."""
    parts = name.split(".")
    place = PACKAGE.joinpath(*parts[1:])
    return len(parts) == 2 or place.is_dir() or place.with_suffix(".py").is_file()


def libraries_of(path: Path) -> set[str]:
    """The first part of every module a file imports."""
    return {name.split(".")[0] for name in imports_of(path.read_text())}


def room_of(path: Path) -> str:
    part = path.relative_to(PACKAGE).parts[0]
    return part.removesuffix(".py")


def wrong_arrows(room: str, source: str) -> list[str]:
    """The imports of a source text in a room that point to a later room, or to none."""
    wrong = []
    for name in imports_of(source):
        if name.startswith("."):
            wrong.append(f"relative import {name}")
        elif name.startswith("fieldsid."):
            target = name.split(".")[1]
            if target not in ORDER or ORDER.index(target) > ORDER.index(room):
                wrong.append(f"{room} -> {name}")
    return wrong


def wrong_sub_arrows(room: str, place: str, source: str) -> list[str]:
    """The imports of a source text in a folder of a room that point to a later folder of that room."""
    order = SUB_ROOMS[room]
    start = f"fieldsid.{room.replace('/', '.')}."
    targets = [name.removeprefix(start).split(".")[0] for name in imports_of(source) if name.startswith(start)]
    return [f"{room}: {place} -> {t}" for t in targets if t in order and order.index(t) > order.index(place)]


def circles(arrows: dict[str, set[str]]) -> list[list[str]]:
    """The groups of files of which each reaches each by imports (Tarjan 1972), longer than one file."""
    number: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found = []

    def visit(node: str) -> None:
        number[node] = low[node] = len(number)
        stack.append(node)
        for other in sorted(arrows[node]):
            if other not in number:
                visit(other)
                low[node] = min(low[node], low[other])
            elif other in stack:
                low[node] = min(low[node], number[other])
        if low[node] == number[node]:
            at = stack.index(node)
            group = stack[at:]
            del stack[at:]
            if len(group) > 1:
                found.append(sorted(group))

    for node in sorted(arrows):
        if node not in number:
            visit(node)
    return found


def file_arrows() -> dict[str, set[str]]:
    """Which file imports which, imports for mypy alone and those inside functions among them."""
    names = {p: ".".join(p.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__") for p in FILES}
    known = set(names.values())
    return {name: {t for t in imports_of(p.read_text()) if t in known and t != name} for p, name in names.items()}


def test_a_file_imports_only_from_rooms_before_its_own():
    files = [path for path in FILES if path != PACKAGE / "__init__.py"]
    assert imports_at_start(PACKAGE / "__init__.py") <= {"fieldsid._version", "importlib", "typing", "__future__"}
    assert [path for path in files if room_of(path) not in ORDER] == []
    wrong = {path.relative_to(PACKAGE).as_posix(): wrong_arrows(room_of(path), path.read_text()) for path in files}
    assert {name: arrows for name, arrows in wrong.items() if arrows} == {}


@pytest.mark.parametrize("room", SUB_ROOMS)
def test_a_file_imports_only_from_folders_before_its_own(room):
    folders = {p.name for p in (PACKAGE / room).iterdir() if p.is_dir() and any(p.glob("*.py"))} - {"readers", "bags"}
    assert folders <= set(SUB_ROOMS[room]), f"a folder of {room} has no place in SUB_ROOMS"
    wrong = []
    for place in SUB_ROOMS[room]:
        for path in (PACKAGE / room / place).rglob("*.py"):
            wrong += wrong_sub_arrows(room, place, path.read_text())
    assert wrong == []


def test_no_two_files_import_each_other_by_any_way_round():
    # the package's own __init__ names its public records for mypy alone, and loads none of them
    arrows = {k: v - {"fieldsid"} for k, v in file_arrows().items() if k != "fieldsid"}
    assert circles(arrows) == []


def test_a_circle_of_files_is_seen():
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}}) == [["a", "b", "c"]]
    assert circles({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == []


@pytest.mark.parametrize("library", ONLY)
def test_a_heavy_library_is_known_in_its_room_only(library):
    users = [p.relative_to(ROOT).as_posix() for p in FILES if library in libraries_of(p)]
    assert [u for u in users if not u.startswith(ONLY[library])] == []


def test_what_takes_long_to_load_is_imported_where_it_is_used():
    early = {p.relative_to(ROOT).as_posix(): [n for n in imports_at_start(p) if n.startswith(LATE)] for p in FILES}
    assert {path: names for path, names in early.items() if names} == {}


@pytest.mark.parametrize(
    ("room", "source"),
    [
        ("models", "from fieldsid.estimators import fit"),
        ("errors", "import fieldsid.cli.app"),
        ("logs", "from fieldsid import figures"),
        ("models", "def f():\n    from fieldsid.reporting import page"),
        ("logs", "from . import run"),
        ("models", "from importlib import import_module\nimport_module('fieldsid.cli.app')"),
        ("schedule", "from fieldsid.cli.commands import plan"),
    ],
)
def test_a_wrong_arrow_is_seen(room, source):
    assert wrong_arrows(room, source)


@pytest.mark.parametrize(
    ("room", "place", "source"),
    [
        ("fitting", "problem", "from fieldsid.fitting.optimise.levenberg_marquardt import covariance"),
        ("fitting", "problem", "from fieldsid.fitting import checks"),
        ("diagnosis", "evidence", "def f():\n    from fieldsid.diagnosis.search.search import Search"),
    ],
)
def test_a_wrong_arrow_inside_a_room_is_seen(room, place, source):
    assert wrong_sub_arrows(room, place, source)


@pytest.mark.filterwarnings("default")
def test_a_long_file_and_a_full_folder_are_warned_of():
    """Not refused: where one idea takes more, it stays in one file, and a folder is not divided to satisfy a number."""
    for path in FILES:
        if (lines := len(path.read_text().splitlines())) > LONGEST:
            warnings.warn(f"{path.relative_to(ROOT)} has {lines} lines, more than {LONGEST}: one idea?", stacklevel=1)
    for folder in {path.parent for path in FILES}:
        files = len(list(folder.glob("[!_]*.py")))
        if folder.relative_to(PACKAGE).as_posix() not in REGISTRIES and files > MOST_FILES:
            warnings.warn(f"{folder.relative_to(ROOT)} has {files} files, more than {MOST_FILES}: one room?", stacklevel=1)


def test_nothing_but_the_house_stands_at_the_top():
    found = {p.name for p in ROOT.iterdir() if not p.name.startswith((".", *WRITTEN_BY_TOOLS))}
    assert found - TOP == set()


def test_help_page_and_front_door_import_nothing_heavy():
    light = (
        "_version",
        "cli.help.catalogue",
        "cli.help.command_order",
        "cli.exit_codes",
        "runtime.interrupts",
        "runtime.streams",
    )
    own = {f"fieldsid.{name}" for name in light}
    for name in ("app", "exit_codes", "help/catalogue", "help/command_order", "help/help_page"):
        modules = imports_at_start(PACKAGE / "cli" / f"{name}.py")
        assert modules <= {"__future__", "atexit", "gc", "os", "sys", "typing", *own}
