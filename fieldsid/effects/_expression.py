"""A user's moment as an expression of the signals: parsed to a tree of arithmetic only, never executed as code.

The text is parsed by Python's grammar (`ast`). Every node that is not a number, a known name, + - * / ** or a listed function
is refused, and the error shows its place. Evaluation walks the tree over arrays.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from fieldsid.errors import EffectError
from fieldsid.numerics.arrays import FloatArray
from fieldsid.registry import near

Operation = Callable[..., FloatArray]
LONGEST = 500
LARGEST_NUMBER = 1e100
FUNCTIONS: Mapping[str, Operation] = MappingProxyType(
    {
        "sin": np.sin, "cos": np.cos, "tan": np.tan, "abs": np.abs, "sign": np.sign, "sqrt": np.sqrt, "exp": np.exp,
        "tanh": np.tanh, "min": np.minimum, "max": np.maximum,
    }
)  # fmt: skip
TWO_ARGUMENTS = ("min", "max")
OPERATORS: Mapping[type[ast.operator], Operation] = MappingProxyType(
    {ast.Add: np.add, ast.Sub: np.subtract, ast.Mult: np.multiply, ast.Div: np.divide, ast.Pow: np.power}
)


@dataclass(frozen=True, slots=True)
class Expression:
    """A parsed expression: its text, the names it uses, and its tree."""

    text: str
    names: frozenset[str]
    tree: ast.expr

    def at(self, table: Mapping[str, FloatArray | float], time: FloatArray) -> FloatArray:
        """Return the value (n,) at every sample; raises EffectError naming the time of a division by zero."""
        with np.errstate(all="ignore"):
            value = _value(self, self.tree, table, time)
        return np.array(np.broadcast_to(value, time.shape), dtype=np.float64)


def parse(text: str, known: Collection[str]) -> Expression:
    """Return the parsed expression, whose names must be in `known`; raises EffectError showing the place of the fault."""
    text = text.strip()
    if not text or len(text) > LONGEST:
        raise EffectError(
            "an expression must have 1 .. 500 characters", found=f"{len(text)} characters", hint='write `moment: "k * r"`'
        )
    try:
        tree = ast.parse(text, mode="eval").body
    except SyntaxError as error:
        raise _at(text, (error.offset or 1) - 1, "the expression cannot be read here", _grammar_hint(text)) from error
    except (ValueError, RecursionError, MemoryError) as error:
        found = str(error) or type(error).__name__
        raise EffectError("the expression cannot be read", found=found, hint="make it shorter") from error
    names: set[str] = set()
    _check(text, tree, known, names)
    return Expression(text, frozenset(names), tree)


def _check(text: str, node: ast.expr, known: Collection[str], names: set[str]) -> None:
    """Raise EffectError for a node that is not arithmetic, and add the names that are used to `names`."""
    if isinstance(node, ast.Constant):
        _check_number(text, node)
    elif isinstance(node, ast.Name):
        if node.id not in known:
            is_call = node.id in FUNCTIONS
            what = f"`{node.id}` is a function and needs (...)" if is_call else f"there is no signal or coefficient `{node.id}`"
            raise _at(text, node.col_offset, what, near(node.id, tuple(known)))
        names.add(node.id)
    elif isinstance(node, ast.BinOp):
        if type(node.op) not in OPERATORS:
            raise _at(text, node.col_offset, f"the operator {type(node.op).__name__} is not allowed", _grammar_hint(text))
        _check(text, node.left, known, names)
        _check(text, node.right, known, names)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.USub, ast.UAdd)):
        _check(text, node.operand, known, names)
    elif isinstance(node, ast.Call):
        for argument in _arguments(text, node):
            _check(text, argument, known, names)
    else:
        raise _at(text, node.col_offset, f"{_plain_name(node)} is not allowed in an expression", _grammar_hint(text))


def _check_number(text: str, node: ast.Constant) -> None:
    value = node.value
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not abs(value) < LARGEST_NUMBER:
        raise _at(text, node.col_offset, f"{str(node.value)[:20]!r} is not a plain number", _grammar_hint(text))


def _arguments(text: str, node: ast.Call) -> list[ast.expr]:
    """Return a call's arguments; raises EffectError for an unknown function or a wrong count."""
    if not isinstance(node.func, ast.Name):
        raise _at(text, node.col_offset, "only the listed functions can be called", _grammar_hint(text))
    name = node.func.id
    if name not in FUNCTIONS:
        raise _at(text, node.col_offset, f"there is no function `{name}`", near(name, tuple(FUNCTIONS)))
    count = 2 if name in TWO_ARGUMENTS else 1
    if len(node.args) != count or node.keywords:
        what = f"`{name}` takes {count} argument{'s' if count > 1 else ''}"
        raise _at(text, node.col_offset, what, f"write `{name}({', '.join('xy'[:count])})`")
    return node.args


def _value(expression: Expression, node: ast.expr, table: Mapping[str, FloatArray | float], time: FloatArray) -> FloatArray:
    if isinstance(node, ast.Constant):
        return np.asarray(node.value, dtype=np.float64)
    if isinstance(node, ast.Name):
        return np.asarray(table[node.id], dtype=np.float64)
    if isinstance(node, ast.UnaryOp):
        inner = _value(expression, node.operand, table, time)
        return -inner if isinstance(node.op, ast.USub) else inner
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        return FUNCTIONS[node.func.id](*(_value(expression, a, table, time) for a in node.args))
    if not isinstance(node, ast.BinOp):
        raise EffectError(f"{_plain_name(node)} is not allowed in an expression", found=expression.text)
    left = _value(expression, node.left, table, time)
    right = _value(expression, node.right, table, time)
    if isinstance(node.op, ast.Div) and np.any(right == 0.0):
        first = int(np.argmax(np.broadcast_to(right == 0.0, time.shape)))
        what = f"the expression divides by zero at t = {time[first]:.3f} s: `{ast.unparse(node.right)}` is 0"
        raise _at(expression.text, node.right.col_offset, what, "keep it away from zero, for example `max(abs(x), 0.01)`")
    return OPERATORS[type(node.op)](left, right)


def _at(text: str, offset: int, what: str, hint: str) -> EffectError:
    """Return an error that shows the expression with a caret under the place."""
    column = len(text.encode("utf-8")[: max(offset, 0)].decode("utf-8", errors="ignore"))
    return EffectError(what, found=f"{text}\n{' ' * column}^", hint=hint)


def _grammar_hint(text: str) -> str:
    if "^" in text:
        return "write a power as `**`, for example `r**2`"
    return f"use numbers, names, + - * / ** and {', '.join(FUNCTIONS)}"


def _plain_name(node: ast.expr) -> str:
    words = {"Attribute": "a dot", "Subscript": "an index", "Compare": "a comparison", "IfExp": "`if`", "Lambda": "`lambda`"}
    return words.get(type(node).__name__, f"a {type(node).__name__}")
