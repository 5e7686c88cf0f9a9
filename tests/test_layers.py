"""The house: imports go one way, heavy libraries stay in their rooms, files stay short, nothing strange at the top."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / "fieldsid"

ORDER = (
    "_version", "errors", "copies", "registry", "page", "display", "artifacts", "rounding", "angles", "strict", "templates",
    "guide", "logs", "vehicle", "maneuvers", "models", "effects", "fitting", "estimators", "comparison", "planning", "diagnosis",
    "extension", "turning", "schedule", "exports", "figures", "report", "views", "face", "demo", "cli", "__main__",
)  # fmt: skip
"""A room may import itself and what stands before it."""

ONLY = {
    "pyulog": ("fieldsid/logs/readers/ulog.py",),
    "pymavlink": ("fieldsid/logs/readers/ardupilot.py",),
    "dbdreader": ("fieldsid/logs/readers/slocum.py",),
    "h5py": ("fieldsid/logs/readers/mat.py",),
    "rosbags": ("fieldsid/logs/readers/bags/",),
    "matplotlib": ("fieldsid/figures/",),
    "typer": ("fieldsid/cli/",),
    "rich": ("fieldsid/cli/",),
    "pydantic": ("fieldsid/strict", "fieldsid/vehicle", "fieldsid/logs/mapping"),
    "numba": ("fieldsid/models/jit.py",),
}
TOP = {"pyproject.toml", "README.md", "LICENSE", "CONTRIBUTING.md", "CHANGELOG.md", "templates", "fieldsid", "tests"}
WRITTEN_BY_TOOLS = ("build", "dist", "sysid-demo")
LONGEST = 400

FILES = sorted(p for p in PACKAGE.rglob("*.py"))


def imports_of(source: str) -> Iterator[str]:
    """Every module a source text imports, inside functions too, by name or through `import_module("...")`."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield ("." * node.level) + (node.module or "")
            if node.module == "fieldsid":
                yield from (f"fieldsid.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Call) and getattr(node.func, "id", getattr(node.func, "attr", "")) == "import_module":
            yield from (a.value for a in node.args if isinstance(a, ast.Constant) and isinstance(a.value, str))


def imports_at_start(path: Path) -> set[str]:
    """The modules that are loaded when a file is imported: not those inside functions, nor those for mypy alone."""
    nodes = [n for n in ast.parse(path.read_text()).body if isinstance(n, (ast.Import, ast.ImportFrom))]
    return {getattr(n, "module", None) or n.names[0].name for n in nodes}


@cache
def libraries_of(path: Path) -> frozenset[str]:
    """The first part of every module a file imports."""
    return frozenset(name.split(".")[0] for name in imports_of(path.read_text()))


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


@pytest.mark.parametrize("path", FILES, ids=lambda p: p.relative_to(PACKAGE).as_posix())
def test_a_file_imports_only_from_rooms_before_its_own(path):
    if path == PACKAGE / "__init__.py":
        assert imports_at_start(path) <= {"fieldsid._version", "importlib", "typing", "__future__"}
        return
    assert room_of(path) in ORDER, f"{path} is in no known room"
    assert wrong_arrows(room_of(path), path.read_text()) == []


@pytest.mark.parametrize("library", ONLY)
def test_a_heavy_library_is_known_in_its_room_only(library):
    users = [p.relative_to(ROOT).as_posix() for p in FILES if library in libraries_of(p)]
    assert [u for u in users if not u.startswith(ONLY[library])] == []


@pytest.mark.parametrize(
    ("room", "source"),
    [
        ("models", "from fieldsid.estimators import fit"),
        ("errors", "import fieldsid.cli.app"),
        ("logs", "from fieldsid import figures"),
        ("models", "def f():\n    from fieldsid.report import page"),
        ("logs", "from . import run"),
        ("models", "from importlib import import_module\nimport_module('fieldsid.cli.app')"),
    ],
)
def test_a_wrong_arrow_is_seen(room, source):
    assert wrong_arrows(room, source)


def test_no_file_of_the_package_is_longer_than_the_limit():
    assert {p.name: n for p in FILES if (n := len(p.read_text().splitlines())) > LONGEST} == {}


def test_nothing_but_the_house_stands_at_the_top():
    found = {p.name for p in ROOT.iterdir() if not p.name.startswith((".", *WRITTEN_BY_TOOLS))}
    assert found - TOP == set()


def test_help_page_and_front_door_import_nothing_heavy():
    for name in ("app", "catalogue", "day", "front"):
        modules = imports_at_start(PACKAGE / "cli" / f"{name}.py")
        own = {"fieldsid._version", "fieldsid.cli.catalogue", "fieldsid.cli.day"}
        assert modules <= {"__future__", "atexit", "gc", "os", "sys", "typing", *own}
