"""The interpreter of Lua against what the language's manual says of each construct."""

from __future__ import annotations

import pytest
from lua import execute


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1 + 2 * 3 - 4 / 2", 5.0),
        ("-7 % 3", 2),
        ("(-4.0 + math.pi) % (2 * math.pi) - math.pi < 2.3", True),
        ("not nil and 0", 0),
        ("false or nil", None),
        ("nil and 1 or 2", 2),
        ('"a" .. "b" == "ab"', True),
        ("#{ 4, 5, 6 }", 3),
        ("({ { 1, true }, { 2, false } })[2][1]", 2),
        ("1 < 2 and 2 ~= 3", True),
        ("not 1 == 2", False),
    ],
)
def test_values(text, value):
    assert execute(f"return {text}")[1] == (value,)


def test_statements_functions_and_scopes():
    text = """
    local a, b, c = 1, 2
    local function up(n) if n > 3 then return n, "far" elseif n == 3 then a = a + 10 else b = -1 end return n + 1 end
    local i = 0
    while i < 4 do i = i + 1 local a = 7 up(i) end -- a comment
    a, b = b, a
    function whole() return a, b, c end
    return whole()
    """
    scope, (values,) = execute(text)
    assert values == (-1, 11, None)
    assert scope["whole"]() == (-1, 11, None)


@pytest.mark.parametrize("text", ["local = 3", "if 1 then", "return (1", "a +", "x = 1 end", "~", "1 + 2"])
def test_what_is_no_lua_is_refused(text):
    with pytest.raises(SyntaxError):
        execute(text)


def test_a_global_that_nobody_set_is_an_error():
    with pytest.raises(NameError, match="nobody"):
        execute("return nobody()")
