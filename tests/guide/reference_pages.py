"""Pages of reference, made from the code: the keys of a mapping, the codes of notes, the parameters of models."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill

from fieldsid.effects import all_effects
from fieldsid.logs.mapping.mapping_file import KEYS
from fieldsid.models.axis import NAMES, Axis

PACKAGE = Path(__file__).resolve().parents[2] / "fieldsid"
CONSTANT = re.compile(r'^(\w+) = "([^"\n]*)"(?:  #.*)?$', re.MULTILINE)
"""A name of a file and the text that it stands for."""
COLUMNS = 76
MAPPING = """# A mapping, key by key

`mapping.yaml` says which column or topic of a log is which signal. `sysid inspect LOG --write-mapping mapping.yaml` writes a
first one; `sysid init` puts one with comments into a trial's folder. Each key with an example:
"""
CODES = """# Codes of warnings and findings

Every note of a log, a fit or a diagnosis has a code. Here is what each says, with the places of its numbers in `<>`, and what
it is about. `sysid guide CODE` shows one.
"""
PARAMETERS = """# Parameters

What a model's numbers are: of the vehicle bare, r' = -a22 r + b2 delta + C0 in yaw, q' = -c22 q - c23 theta + d2 delta + Cb in
pitch, and of the effects beside. `sysid guide NAME` shows one.
"""
BASE = {
    "damping": (
        "1/s",
        "the damping of the rate: its inverse is a turn's time constant; below zero the vehicle turns by itself",
    ),
    "stiffness": ("1/s^2", "the righting moment: its root is the frequency with which the vehicle swings back"),
    "authority": (
        "1/s^2",
        "the authority of the fin: the angular acceleration by a radian of it, with the speed squared",
    ),
    "trim": ("rad/s^2", "the trim: the angular acceleration with the fin in the middle"),
    "trim_fin": ("rad", "the fin that holds the vehicle straight: minus the trim over the authority"),
}


def mapping() -> str:
    """Return the page on the keys of a mapping."""
    parts = [MAPPING]
    for where, model in KEYS.items():
        parts.append(f"## {f'Keys of {where}' if where else 'Keys of the file'}\n")
        for name, field in model.model_fields.items():
            default = "" if field.is_required() or field.default in (None, "") or where == "" else f" (default `{field.default}`)"
            parts.append(f"`{field.alias or name}`: {field.description}{default}\n\n```yaml\n{field.examples[0]}\n```\n")
    return "\n".join(parts)


@dataclass(frozen=True, slots=True)
class Said:
    """A note in the code: its code, its message with the places of the numbers, and what is found there, in words."""

    code: str
    message: str
    about: str


def codes() -> str:
    """Return the page on the codes of notes, in the order of the alphabet."""
    said = sorted(set(_all_said()), key=lambda s: (s.code, s.about, s.message))
    parts = [CODES]
    for code in dict.fromkeys(s.code for s in said):
        parts.append(f"## {code}\n")
        for about in dict.fromkeys(s.about for s in said if s.code == code):
            messages = [s.message for s in said if (s.code, s.about) == (code, about) and s.message]
            shown = "\n\n".join(fill(m, COLUMNS, break_long_words=False) for m in messages)
            parts.append(f"{about}\n" + (f"\n```text\n{shown}\n```\n" if shown else ""))
    return "\n".join(parts)


def _all_said() -> Iterator[Said]:
    texts = [path.read_text() for path in sorted(PACKAGE.rglob("*.py"))]
    constants = {name: code for text in texts for name, code in CONSTANT.findall(text)}
    for tree in (ast.parse(text) for text in texts if "Note(" in text):
        for function in [n for n in ast.walk(tree) if isinstance(n, ast.FunctionDef)]:
            for call in ast.walk(function):
                if isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "Note" and call.args:
                    about = _sentence(ast.get_docstring(function) or ast.get_docstring(tree) or "")
                    for code in _codes(call.args[0], constants):
                        yield Said(code, _message(call, function), about)


def _codes(node: ast.expr, constants: dict[str, str]) -> list[str]:
    match node:
        case ast.Constant(value=str(code)):
            return [code]
        case ast.Name(id=name):
            return [constants[name]] if name in constants else []
        case ast.IfExp(body=one, orelse=other):
            return [*_codes(one, constants), *_codes(other, constants)]
    return []


def _message(call: ast.Call, function: ast.FunctionDef) -> str:
    """Return a note's message, where it is written in place or is put into a variable before."""
    node = call.args[1] if len(call.args) > 1 else None
    if isinstance(node, ast.Name):
        values = [
            s.value
            for s in ast.walk(function)
            if isinstance(s, ast.Assign)
            and isinstance(s.targets[0], ast.Name)
            and s.targets[0].id == node.id
            and s.lineno < call.lineno
        ]
        node = max(values, key=lambda v: v.lineno, default=None)
    return _text(node) if node is not None else ""


def _text(node: ast.expr) -> str:
    match node:
        case ast.Constant(value=str(text)):
            return text
        case ast.JoinedStr(values=values):
            return "".join(_text(v) for v in values)
        case ast.FormattedValue(value=value):
            return f"<{_name(value)}>"
        case ast.BinOp(left=left, op=ast.Add(), right=right):
            return _text(left) + _text(right)
    return f"<{_name(node)}>"


def _name(node: ast.expr) -> str:
    """Return the word that an expression is best called by: of a call that of what it is made of."""
    while isinstance(node, ast.Call) and node.args:
        node = node.args[0]
    names = [n.attr if isinstance(n, ast.Attribute) else n.id for n in ast.walk(node) if isinstance(n, (ast.Attribute, ast.Name))]
    return names[0].strip("_") if names else "number"


def _sentence(docstring: str) -> str:
    first = " ".join(docstring.partition("\n\n")[0].split())
    bare = first.removeprefix("Return ")
    return bare[:1].upper() + bare[1:]


def parameters() -> str:
    """Return the page on the parameters of models."""
    parts = [PARAMETERS]
    for axis in Axis:
        for role, (unit, says) in BASE.items():
            name = getattr(NAMES[axis], role)
            if name is not None:
                parts.append(f"## {name}\n\nOf {axis.value}, in {unit}: {says}.\n")
    own: dict[str, list[str]] = {}
    for effect in all_effects().values():
        for c in effect.coefficients:
            says = f"{c.says}. " if c.says else ""
            text = f"Of the effect [{effect.name}](effects/{effect.name}.md) ({effect.says}): {says}In {c.unit or 'no unit'}, "
            own.setdefault(c.name, []).append(f"{text}from {c.low:g} to {c.high:g}.")
    parts += [f"## {name}\n\n" + "\n\n".join(texts) + "\n" for name, texts in sorted(own.items())]
    return "\n".join(parts)


def pages() -> dict[str, str]:
    """Return the pages by file."""
    return {"mapping.md": mapping(), "codes.md": codes(), "parameters.md": parameters()}
