"""A small interpreter of the Lua that scripts for ArduPilot are written in: enough to run them as they are, against Lua 5.3.

Statements: local, assignment, function, local function, if, while, return, calls. Tables are dicts counted from one; a method
call `a:b(c)` calls the attribute `b` of a Python object. What is not known is a SyntaxError or a NameError, never skipped.
"""

from __future__ import annotations

import math
import re

TOKENS = re.compile(
    r"(?P<skip>--[^\n]*|\s+)|(?P<number>\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+)|(?P<name>[A-Za-z_]\w*)"
    r"|(?P<string>\"[^\"\n]*\")|(?P<mark>\.\.|==|~=|<=|>=|[-+*/%#<>=(){}\[\];:,.])"
)
WORDS = {"and", "or", "not", "local", "function", "if", "then", "elseif", "else", "end", "while", "do", "return", "nil", "true",
         "false"}  # fmt: skip
CONSTANTS = {"nil": None, "true": True, "false": False}
LEVELS = (("or",), ("and",), ("<", ">", "<=", ">=", "~=", "=="), ("..",), ("+", "-"), ("*", "/", "%"))


def tokens(text):
    found, at = [], 0
    while at < len(text):
        match = TOKENS.match(text, at)
        if match is None:
            raise SyntaxError(f"line {text.count(chr(10), 0, at) + 1}: {text[at : at + 20]!r}")
        at = match.end()
        if match.lastgroup != "skip":
            kind = "word" if match[0] in WORDS else match.lastgroup
            found.append((kind, match[0], text.count("\n", 0, match.start()) + 1))
    return [*found, ("end of file", "", text.count("\n") + 1)]


class Scope(dict):
    """Names of a block; what is not local to it is its parent's."""

    def __init__(self, parent=None):
        super().__init__()
        self.parent = parent

    def holder(self, name):
        scope = self
        while scope is not None and name not in scope:
            scope = scope.parent
        return scope

    def read(self, name):
        scope = self.holder(name)
        if scope is None:
            raise NameError(f"`{name}` is nil: no such global")
        return scope[name]

    def write(self, name, value):
        scope = self.holder(name)
        if scope is None:
            scope = self
            while scope.parent is not None:
                scope = scope.parent
        scope[name] = value


class ReturnError(Exception):
    """A `return` on its way out of a function."""

    def __init__(self, values):
        super().__init__()
        self.values = values


class Parser:
    """Tokens into closures: a statement takes a scope, an expression takes one and returns a value."""

    def __init__(self, text):
        self.tokens, self.at = tokens(text), 0

    def peek(self, *values):
        kind, value, _ = self.tokens[self.at]
        return kind in ("word", "mark") and value in values

    def take(self, *values):
        if not self.peek(*values):
            _, value, line = self.tokens[self.at]
            raise SyntaxError(f"line {line}: {value!r} where {' or '.join(values)} is due")
        self.at += 1
        return self.tokens[self.at - 1][1]

    def maybe(self, *values):
        return self.take(*values) if self.peek(*values) else None

    def name(self):
        kind, value, line = self.tokens[self.at]
        if kind != "name":
            raise SyntaxError(f"line {line}: {value!r} is no name")
        self.at += 1
        return value

    def block(self, *ends):
        statements = []
        while not self.peek(*ends) and self.tokens[self.at][0] != "end of file":
            statements.append(self.statement())
            self.maybe(";")
        return statements

    def statement(self):
        if self.maybe("local"):
            return self.local()
        if self.maybe("function"):
            name = self.name()
            body = self.function()
            return lambda scope: scope.write(name, body(scope))
        if self.maybe("if"):
            return self.branches()
        if self.maybe("while"):
            return self.loop()
        if self.maybe("return"):
            values = [] if self.peek("end", "else", "elseif") or self.tokens[self.at][0] == "end of file" else self.list()
            return lambda scope: leave([v(scope) for v in values])
        return self.assignment()

    def local(self):
        if self.maybe("function"):
            name = self.name()
            body = self.function()

            def define(scope):
                scope[name] = None
                scope[name] = body(scope)

            return define
        names = [self.name()]
        while self.maybe(","):
            names.append(self.name())
        values = self.list() if self.maybe("=") else []

        def assign(scope):
            found = [v(scope) for v in values]
            for i, name in enumerate(names):
                scope[name] = found[i] if i < len(found) else None

        return assign

    def branches(self):
        cases = []
        condition = self.expression()
        self.take("then")
        cases.append((condition, self.block("elseif", "else", "end")))
        while self.maybe("elseif"):
            condition = self.expression()
            self.take("then")
            cases.append((condition, self.block("elseif", "else", "end")))
        if self.maybe("else"):
            cases.append((lambda _: True, self.block("end")))
        self.take("end")

        def choose(scope):
            for holds, body in cases:
                if truth(holds(scope)):
                    run(body, Scope(scope))
                    return

        return choose

    def loop(self):
        condition = self.expression()
        self.take("do")
        body = self.block("end")
        self.take("end")

        def repeat(scope):
            while truth(condition(scope)):
                run(body, Scope(scope))

        return repeat

    def assignment(self):
        line = self.tokens[self.at][2]
        start = self.at
        first = self.suffixed()
        if not self.peek("=", ","):
            if self.tokens[self.at - 1][1] != ")":
                raise SyntaxError(f"line {line}: an expression is no statement")
            return first
        self.at = start
        names = [self.name()]
        while self.maybe(","):
            names.append(self.name())
        self.take("=")
        values = self.list()

        def assign(scope):
            found = [v(scope) for v in values]
            for i, name in enumerate(names):
                scope.write(name, found[i] if i < len(found) else None)

        return assign

    def function(self):
        self.take("(")
        names = []
        while not self.peek(")"):
            names.append(self.name())
            self.maybe(",")
        self.take(")")
        body = self.block("end")
        self.take("end")

        def define(scope):
            def call(*given):
                inner = Scope(scope)
                for i, name in enumerate(names):
                    inner[name] = given[i] if i < len(given) else None
                try:
                    run(body, inner)
                except ReturnError as back:
                    return back.values[0] if len(back.values) == 1 else tuple(back.values) or None
                return None

            return call

        return define

    def list(self):
        values = [self.expression()]
        while self.maybe(","):
            values.append(self.expression())
        return values

    def expression(self, level=0):
        if level == len(LEVELS):
            return self.unary()
        left = self.expression(level + 1)
        while mark := self.maybe(*LEVELS[level]):
            left = joined(mark, left, self.expression(level + 1))
        return left

    def unary(self):
        if mark := self.maybe("not", "-", "#"):
            value = self.unary()
            return {
                "not": lambda scope: not truth(value(scope)),
                "-": lambda scope: -value(scope),
                "#": lambda scope: len(value(scope)),
            }[mark]
        return self.suffixed()

    def suffixed(self):
        value = self.primary()
        while mark := self.maybe("(", "[", ".", ":"):
            if mark == "(":
                value = called(value, self.arguments())
            elif mark == "[":
                value = indexed(value, self.expression())
                self.take("]")
            elif mark == ".":
                value = attribute(value, self.name())
            else:
                name = self.name()
                self.take("(")
                value = called(attribute(value, name), self.arguments())
        return value

    def arguments(self):
        values = [] if self.peek(")") else self.list()
        self.take(")")
        return values

    def primary(self):
        kind, text, line = self.tokens[self.at]
        self.at += 1
        if kind == "name":
            return lambda scope: scope.read(text)
        if kind in ("number", "string") or text in CONSTANTS:
            value = constant(kind, text)
            return lambda _: value
        if text == "(":
            value = self.expression()
            self.take(")")
            return value
        if text not in ("{", "function"):
            raise SyntaxError(f"line {line}: {text!r} where a value is due")
        return self.table() if text == "{" else self.function()

    def table(self):
        values = []
        while not self.peek("}"):
            values.append(self.expression())
            self.maybe(",", ";")
        self.take("}")
        return lambda scope: {i: v(scope) for i, v in enumerate(values, 1)}


def constant(kind, text):
    if kind == "number":
        return float(text) if re.search(r"[.eE]", text) else int(text)
    return text[1:-1] if kind == "string" else CONSTANTS[text]


def leave(values):
    raise ReturnError(values)


def run(statements, scope):
    for statement in statements:
        statement(scope)


def truth(value):
    """Only nil and false are false."""
    return value is not None and value is not False


def called(function, given):
    return lambda scope: function(scope)(*[g(scope) for g in given])


def indexed(table, key):
    return lambda scope: table(scope).get(key(scope))


def attribute(value, name):
    return lambda scope: getattr(value(scope), name)


def joined(mark, left, right):
    if mark == "and":
        return lambda scope: right(scope) if truth(value := left(scope)) else value
    if mark == "or":
        return lambda scope: value if truth(value := left(scope)) else right(scope)
    act = {
        "+": lambda a, b: a + b, "-": lambda a, b: a - b, "*": lambda a, b: a * b, "/": lambda a, b: a / b,
        "%": lambda a, b: a % b, "..": lambda a, b: f"{a}{b}", "<": lambda a, b: bool(a < b), ">": lambda a, b: bool(a > b),
        "<=": lambda a, b: bool(a <= b), ">=": lambda a, b: bool(a >= b), "==": lambda a, b: bool(a == b),
        "~=": lambda a, b: bool(a != b),
    }[mark]  # fmt: skip
    return lambda scope: act(left(scope), right(scope))


class LuaMath:
    """The part of Lua's `math` that Python's has under the same names, and what it has not."""

    pi, sin, cos, floor, abs, max, min = math.pi, math.sin, math.cos, math.floor, abs, max, min


def execute(text, **known):
    """Run a script with globals of the host's; return its scope and the values it returns."""
    parser = Parser(text)
    body = parser.block()
    _, left, line = parser.tokens[parser.at]
    if left:
        raise SyntaxError(f"line {line}: {left!r} without a beginning")
    scope = Scope()
    scope |= {"math": LuaMath, **known}
    try:
        run(body, scope)
    except ReturnError as back:
        return scope, tuple(back.values)
    return scope, ()
