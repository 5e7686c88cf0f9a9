"""Text of others as one line: nothing in it ends a line or steers a terminal, and what is printable is as it was."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldsid.errors import FieldsidError
from fieldsid.text.one_line import one_line

ANY = st.text(st.characters(codec=None), max_size=40)
"""Any letters, those of a file's name that is no UTF-8 among them."""


@given(ANY)
def test_any_text_becomes_one_printable_line(text):
    line = one_line(text)
    assert line.isprintable()
    assert len(line.splitlines()) <= 1
    assert one_line(line) == line


@given(ANY.filter(str.isprintable))
def test_what_is_printable_stays(text):
    assert one_line(text) == text


@pytest.mark.parametrize(
    ("text", "shown"),
    [("a\nb", r"a\nb"), ("\x1b[31m", r"\x1b[31m"), ("\u202egpj", r"\u202egpj"), ("f\udcff", r"f\udcff"), ("Grün 日本 [b]",) * 2],
)
def test_what_is_not_is_shown_by_its_code(text, shown):
    assert one_line(text) == shown


@given(ANY, ANY, ANY)
def test_an_error_has_the_lines_of_its_form_whatever_it_names(what, found, hint):
    error = FieldsidError(f"`{what}` is wrong", found=f"in {found}", hint=f"try `{hint}`")
    first, *rest = str(error).split("\n")
    assert first.startswith("`")
    assert first.isprintable()
    assert rest[0].startswith("  found: in ")
    assert all(line.startswith("         ") for line in rest[1:-2])
    assert rest[-2] == ""
    assert rest[-1].startswith("hint: try `")
