"""What commands print: data to stdout, messages to stderr, one JSON object on demand, tables that fit 80 columns.

The one way to a terminal: what is printed, and the cell of a table, is a line of plain text and no markup, and control codes are
shown, whatever names of others it holds.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from copy import copy
from functools import partial
from typing import Any, TypeVar

from rich.console import Console, ConsoleOptions, Group, JustifyMethod, RenderableType, RenderResult
from rich.measure import Measurement
from rich.progress import BarColumn, Progress, ProgressColumn, TaskID, TaskProgressColumn, TextColumn, TimeElapsedColumn
from rich.segment import Segment
from rich.table import Column, Table
from rich.text import Text

from fieldsid.artifacts import plain
from fieldsid.cli.headlines.headline import Headline
from fieldsid.cli.voice import voice
from fieldsid.logs.run import Note
from fieldsid.page import Block, Page, Whole, dense, folded, has_content
from fieldsid.records.keys import Result, body_of
from fieldsid.text.one_line import one_line

T = TypeVar("T")
WIDTH = 80
_SAID: ContextVar[str] = ContextVar("said", default="")
NARROW, FAR, LEAST_WORDS = 60, 1000, 12
"""Columns of a terminal below which a table that does not fit is shown row by row, those in which any table fits, and those
that a column of words is folded down to."""


class Terminal(Console):
    """A console that takes text for what it is: no markup, no emoji by name, no highlights, no control codes but its own."""

    def render_str(self, text: str, **given: Any) -> Text:
        """Return a text that is printed, or a table's cell, as one line of printable characters."""
        return super().render_str(one_line(text), **given)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Yield the pieces of whatever is shown, with the control codes in its words made printable."""
        for piece in super().render(renderable, options):
            whole = piece.control or piece.text.isprintable() or piece.text == "\n"
            yield piece if whole else Segment("\n".join(map(one_line, piece.text.split("\n"))), piece.style)


def words(text: str, style: str = "") -> Text:
    """Return one line of plain text in a style."""
    return Text(one_line(text), style=style)


def out() -> Console:
    """Return the console of the data; made at each call so that it follows a redirected stdout."""
    return _console(stderr=False)


def messages() -> Console:
    """Return the console of everything else."""
    return _console(stderr=True)


def emit(
    told: Result | Mapping[str, Any],
    *,
    render: Page | Callable[[Console], None],
    headline: Headline | None = None,
    notes: Iterable[Note] = (),
    is_file: bool = False,
) -> Mapping[str, Any]:
    """Print a result, or its body, and return that: as one JSON object, or for a reader.

    A reader gets the headline, then the notes as warnings, then the page that `render` is, or what it prints; where it is to be
    quiet, the headline alone. Only what is no result, as a page of the guide, has no headline. Where what `render` prints
    `is_file`, to be redirected to one, the headline goes to stderr, and the file is what is left where it is to be quiet.
    """
    if headline is not None:
        _SAID.set(headline.says)
    body = body_of(told) if isinstance(told, Result) else told
    whole = body if headline is None else {**body, "headline": body_of(headline)}
    if voice().is_json:
        sys.stdout.write(json.dumps(plain(whole), allow_nan=False) + "\n")
        return whole
    to = out()
    if headline is not None and is_file:
        for line in headline.lines:
            say(line)
    elif headline is not None:
        print_headline(to, headline)
        if voice().is_quiet:
            return whole
        warn(notes)
        to.print()
        for rest in headline.rest:
            to.print(f"... {rest}", soft_wrap=True)
    if isinstance(render, Page):
        print_page(to, render)
    else:
        render(to)
    return whole


def said() -> str:
    """Return the verdict of the last result, and forget it."""
    verdict = _SAID.get()
    _SAID.set("")
    return verdict


def print_headline(to: Console, headline: Headline) -> None:
    """Print the first lines of a result, each whole on a line of its own: they are read, and pasted."""
    for i, line in enumerate(headline.lines):
        to.print(words(line, "bold" if i == 0 else ""), soft_wrap=True)
    to.file.flush()


def print_file(to: Console, text: str) -> None:
    """Print the text of a file: byte for byte where it is redirected to one, line by line to a terminal."""
    if not to.is_terminal:
        to.file.write(text)
        return
    for line in text.removesuffix("\n").split("\n"):
        to.print(line, soft_wrap=True)


def print_page(to: Console, page: Page) -> None:
    """Print the blocks and sentences of a page: the first lines of the result stand for its title and warnings."""
    for i, block in enumerate(filter(has_content, page.blocks)):
        if i and (isinstance(block, Block) or block.startswith("\n")):
            to.print()
        if isinstance(block, Block):
            to.print(table(block), crop=False)
            continue
        said = one_line(block.removeprefix("\n"))
        for line in [said] if isinstance(block, Whole) else folded(said, to.width, rest="").split("\n"):
            to.print(line, soft_wrap=True)
    for line in page.closing:
        to.print(line, soft_wrap=True)


class Rows(Table):
    """A table that is shown row by row, a line for each cell, where its numbers or names do not fit: no line ends within one."""

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Yield the table where it fits, if with one blank between columns, or on a page not narrow with its words folded."""
        for line in folded(one_line(str(self.title)), options.max_width, rest="").split("\n") if self.title else ():
            yield _whole(words(line, "bold"))
        shown, far = copy(self), options.update(max_width=FAR)
        shown.title = None
        wanted = Measurement.get(console, far, shown).maximum
        blanks = len(self.columns) - 1
        least = sum(self._least(console, far, column) for column in self.columns) + 2 * blanks
        if wanted - blanks <= options.max_width or (options.max_width >= NARROW and least <= options.max_width):
            if wanted - blanks <= options.max_width < wanted:
                shown.padding = (0, 1, 0, 0)
            yield from Table.__rich_console__(shown, console, options)
            return
        heads = [str(column.header) for column in self.columns]
        wide = max(map(len, heads)) + 2
        for row in zip(*(column.cells for column in self.columns), strict=True):
            for head, cell in zip(heads, map(str, row), strict=True):
                for i, line in enumerate(folded(one_line(cell), options.max_width - wide, rest="").split("\n") if cell else ()):
                    yield _whole(words(f"{'' if i else head:<{wide}}", "dim").append_text(words(line)))
            yield ""

    @staticmethod
    def _least(console: Console, far: ConsoleOptions, column: Column) -> int:
        """Return the columns of a terminal that one of the table takes at least: all of a number, a word or a name of words."""
        cells = Measurement.get(console, far, Group(column.header, *column.cells))
        if column.width is not None:
            return column.width
        return cells.maximum if column.no_wrap else max(cells.minimum, min(cells.maximum, LEAST_WORDS))


def _whole(line: Text) -> Text:
    """Return a line that no page cuts or folds."""
    line.no_wrap, line.overflow = True, "ignore"
    return line


def table(block: Block) -> Table:
    """Return the table of a block: its columns behind those of words are to the right, and whole if of numbers."""
    block = dense(block)
    made = Rows(
        title=block.title or None,
        title_justify="left",
        title_style="bold",
        box=None,
        pad_edge=False,
        padding=(0, 2, 0, 0),
        show_header=any(block.columns),
    )
    for i, column in enumerate(block.columns or [""] * len(block.rows[0])):
        whole = i >= block.left and any(_is_number(cell) for row in block.rows for cell in row[i : i + 1])
        side: JustifyMethod = "left" if i < block.left else "right"
        made.add_column(column, justify=side, header_style="dim", overflow="fold", no_wrap=whole)
    if block.kept:
        made.columns[0].width = min(max(len(row[0]) for row in block.rows), block.kept)
    for row in block.rows:
        made.add_row(*row)
    return made


def _is_number(cell: str) -> bool:
    return cell.lstrip("+-<>=~.")[:1].isdigit()


def say(text: str) -> None:
    """Print a message on stderr, unless the command is to be quiet."""
    if not voice().is_quiet:
        complain(text)


def complain(*lines: str) -> None:
    """Print on stderr what makes the exit code other than 0, however quiet the command is to be."""
    for line in lines:
        messages().print(words(line), soft_wrap=True)


def warn(notes: Iterable[Note], *, of: str = "") -> None:
    """Print warnings on stderr, each with its code; on a terminal a line each, whole with `-v`; none where it is to be quiet."""
    if voice().is_quiet:
        return
    where, to = f"{of}: " if of else "", messages()
    for note in notes:
        said = f"{where}{note.message} [{note.code}]"
        to.print(words(f"warning: {shortened(said, to.width) if to.is_terminal else said}", "yellow"), soft_wrap=True)


def alike(found: Iterable[tuple[Hashable, str, Note]]) -> list[Note]:
    """Return one warning of each kind, that of the first run that has it and how many more have it.

    `found` gives of each its kind, whose it is, and the note.
    """
    kinds: dict[Hashable, list[tuple[str, Note]]] = {}
    for kind, whose, note in found:
        kinds.setdefault(kind, []).append((whose, note))
    said = []
    for (whose, note), *others in kinds.values():
        more = f" (and {len(others)} more like it)" if others else ""
        of = "" if whose in note.message else f"{whose}: "
        said.append(Note(note.code, f"{of}{note.message}{more}", {}))
    return said


def shortened(text: str, width: int) -> str:
    """Return a warning as it fits a line behind `warning: `, its code kept; whole with `-v`."""
    room = width - len("warning: ")
    if voice().is_verbose or len(text) <= room:
        return text
    words, _, code = text.rpartition(" [")
    end = f" ... [{code} -v"
    return f"{words[: max(room - len(end), 20)].rstrip()}{end}"


@contextmanager
def progress(says: str, total: int) -> Iterator[Callable[[], None]]:
    """Yield a function that moves a bar on by one; the bar is drawn on stderr, and only on a terminal."""
    with _bar(TextColumn("{task.completed}/{task.total}")) as bar:
        task = bar.add_task(says, total=total)
        yield lambda: bar.advance(task)


def tracked(items: Sequence[T], says: str) -> Iterator[tuple[T, Callable[[float], None]]]:
    """Yield the items while a bar on a terminal shows how far it is, each with a function that tells how much of it is done."""
    with _bar(TaskProgressColumn()) as bar:
        task = bar.add_task(says, total=len(items))
        for i, item in enumerate(items):
            yield item, partial(_show_share, bar, task, i)
            bar.update(task, completed=i + 1)


def shows_progress(console: Console) -> bool:
    """Whether what is under way is drawn: on a terminal, unless the command is to be quiet."""
    return console.is_terminal and not voice().is_quiet


def _bar(how_far: ProgressColumn) -> Progress:
    console = messages()
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), how_far, TimeElapsedColumn())
    return Progress(*columns, console=console, transient=True, disable=not shows_progress(console))


def _show_share(bar: Progress, task: TaskID, done: int, share: float) -> None:
    bar.update(task, completed=done + share)


def _console(*, stderr: bool) -> Console:
    stream = sys.stderr if stderr else sys.stdout
    width = None if stream.isatty() else WIDTH
    return Terminal(file=stream, width=width, markup=False, highlight=False, soft_wrap=False, emoji=False)
