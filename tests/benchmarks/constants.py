"""Every numeric constant of the package, by its name: its file, its value and the reason given for it.

    python tests/benchmarks/constants.py [--room noise] [--without-reason] [--same] [--counts]

A constant is a module-level name in capitals whose value is a number, or a tuple of numbers, and the default, a number other than
0 and 1, of a parameter or of a dataclass's field. The reason is the text under it, the comment beside it, or for a default the
docstring's sentence that names it. `--same` lists the values that several names of one room say. `--counts` prints how many there
are, and how many numbers other than 0, 1, 2 and -1 stand in the code of each room.
"""

from __future__ import annotations

import argparse
import ast
import re
import sys
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[2] / "fieldsid"
PLAIN = (0, 1, 2, -1)


@dataclass(frozen=True)
class Constant:
    """A number with a name, where it is, and why it is what it is."""

    name: str
    place: str
    value: str
    reason: str

    @property
    def room(self) -> str:
        """The room it belongs to, the package itself where it lies beside the rooms."""
        return self.place.split("/")[0] if "/" in self.place else "."


def constants(package: Path = PACKAGE) -> list[Constant]:
    """Return all constants of a package, by file and line."""
    return [constant for path in sorted(package.rglob("*.py")) for constant in _of_file(path, package)]


def _of_file(path: Path, package: Path) -> Iterator[Constant]:
    source = path.read_text(encoding="utf-8")
    tree, lines, place = ast.parse(source), source.splitlines(), path.relative_to(package).as_posix()
    for node, following in zip(tree.body, [*tree.body[1:], None], strict=False):
        if isinstance(node, ast.Assign) and (values := _numbers(node)):
            reason = _text(following) or _comment(lines, node)
            yield from (Constant(name, f"{place}:{node.lineno}", value, reason) for name, value in values)
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            yield from _defaults(node, place)
        elif isinstance(node, ast.ClassDef):
            yield from _fields(node, place, lines)


def _numbers(node: ast.Assign) -> list[tuple[str, str]]:
    """Return the names in capitals that an assignment gives numbers, and their values as they are written."""
    pairs = [(target, node.value) for target in node.targets]
    if isinstance(pairs[0][0], ast.Tuple) and isinstance(node.value, ast.Tuple):
        pairs = list(zip(pairs[0][0].elts, node.value.elts, strict=True))
    named = [(t.id, value) for t, value in pairs if isinstance(t, ast.Name) and re.fullmatch(r"_?[A-Z][A-Z0-9_]*", t.id)]
    return [(name, ast.unparse(value)) for name, value in named if _is_number(value)]


def _is_number(value: ast.expr) -> bool:
    """Whether an expression is made of numbers alone: one, a sum or product of some, or a tuple of them."""
    if isinstance(value, ast.Constant):
        return type(value.value) in (int, float)
    if isinstance(value, ast.UnaryOp):
        return _is_number(value.operand)
    if isinstance(value, ast.BinOp):
        return _is_number(value.left) and _is_number(value.right)
    return isinstance(value, ast.Tuple) and bool(value.elts) and all(map(_is_number, value.elts))


def _defaults(node: ast.FunctionDef, place: str) -> Iterator[Constant]:
    """Yield the defaults of a function's parameters that are numbers."""
    plain = [*node.args.posonlyargs, *node.args.args]
    given = [*zip(plain[len(plain) - len(node.args.defaults) :], node.args.defaults, strict=True)]
    given += [(a, d) for a, d in zip(node.args.kwonlyargs, node.args.kw_defaults, strict=True) if d is not None]
    text = ast.get_docstring(node) or ""
    for argument, default in given:
        if _is_number(default) and ast.unparse(default) not in {"0", "1", "0.0", "1.0", "-1"}:
            said = next((s for s in re.split(r"(?<=[.;])\s", text) if re.search(rf"\b{argument.arg}\b", s)), "")
            yield Constant(f"{node.name}({argument.arg})", f"{place}:{default.lineno}", ast.unparse(default), _one_line(said))


def _fields(node: ast.ClassDef, place: str, lines: Sequence[str]) -> Iterator[Constant]:
    """Yield the defaults of a class's fields that are numbers."""
    for part, following in zip(node.body, [*node.body[1:], None], strict=False):
        if isinstance(part, ast.AnnAssign) and isinstance(part.target, ast.Name) and part.value is not None:
            written = ast.unparse(part.value)
            if _is_number(part.value) and written not in {"0", "1", "0.0", "1.0", "-1"}:
                reason = _text(following) or _comment(lines, part)
                yield Constant(f"{node.name}.{part.target.id}", f"{place}:{part.lineno}", written, reason)


def _text(node: ast.stmt | None) -> str:
    """Return a text that stands alone as a statement, on one line; empty where the statement is another."""
    is_text = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
    return _one_line(node.value.value) if is_text else ""


def _comment(lines: Sequence[str], node: ast.stmt) -> str:
    """Return the comment at the end of a statement's last line, or in the line above it."""
    beside, above = lines[(node.end_lineno or 1) - 1], lines[node.lineno - 2] if node.lineno > 1 else ""
    found = re.search(r"\s# (.*)$", beside) or re.match(r"\s*# (.*)$", above)
    return found[1] if found else ""


def _one_line(text: str) -> str:
    return " ".join(text.split())


def literals(package: Path = PACKAGE) -> dict[str, int]:
    """Return how many numbers other than 0, 1, 2 and -1 stand in the code of each room."""
    counts: dict[str, int] = defaultdict(int)
    for path in sorted(package.rglob("*.py")):
        place = path.relative_to(package)
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Constant) and type(node.value) in (int, float) and node.value not in PLAIN:
                counts[place.parts[0] if len(place.parts) > 1 else "."] += 1
    return counts


def _same(found: Sequence[Constant]) -> Iterator[str]:
    """Yield the values that several constants of one room have, and their names."""
    alike: dict[tuple[str, str], list[Constant]] = defaultdict(list)
    for one in found:
        alike[one.room, one.value].append(one)
    for (room, value), group in sorted(alike.items(), key=lambda item: -len(item[1])):
        if len(group) > 1:
            yield f"{room}: {value}: " + ", ".join(f"{one.name} ({one.place})" for one in group)


def main(argv: Sequence[str] | None = None) -> int:
    """Print the constants asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--room", default="")
    for flag in ("--without-reason", "--same", "--counts"):
        parser.add_argument(flag, action="store_true")
    asked = parser.parse_args(argv)
    found = [c for c in constants() if asked.room in {"", c.room} and not (asked.without_reason and c.reason)]
    if asked.counts:
        numbers = literals()
        for room in sorted(numbers, key=numbers.__getitem__, reverse=True):
            print(f"{room:14} {sum(c.room == room for c in found):5} constants {numbers[room]:6} numbers")
        print(f"{'in all':14} {len(found):5} constants {sum(numbers.values()):6} numbers")
    else:
        print("\n".join(_same(found) if asked.same else (f"{c.name}\t{c.value}\t{c.place}\t{c.reason or '-'}" for c in found)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
