"""What commands print: data to stdout, messages to stderr, one JSON object on demand, tables that fit 80 columns.

Everything that goes to a terminal passes through here. Text, and the cell of a table, is plain text without markup, and control
codes in it are made visible: names in a log may contain anything.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from copy import copy
from functools import partial
from logging import INFO, Handler, LogRecord, getLogger
from typing import Any, TypeAlias, TypeVar

from rich.console import Console, ConsoleOptions, Group, JustifyMethod, RenderableType, RenderResult
from rich.measure import Measurement
from rich.progress import BarColumn, Progress, ProgressColumn, TaskID, TaskProgressColumn, TextColumn, TimeElapsedColumn
from rich.segment import Segment
from rich.table import Column, Table
from rich.text import Text

from fieldsid.artifacts import plain
from fieldsid.cli.exit_codes import GATE_FAILED
from fieldsid.cli.headlines.headline import Headline
from fieldsid.cli.voice import voice
from fieldsid.logs.run import Note
from fieldsid.page import Block, Page, Whole, dense, folded, has_content
from fieldsid.records.keys import Result, body_of
from fieldsid.text.one_line import one_line

T = TypeVar("T")
Body: TypeAlias = Mapping[str, Any]
"""The JSON object of a result."""
WIDTH = 80
_VERDICT: ContextVar[str] = ContextVar("verdict", default="")
NARROW, FAR, LEAST_WORDS = 60, 1000, 12
"""Widths in characters: below NARROW a table that does not fit is shown row by row; in FAR any table fits; a column of words is
folded down to LEAST_WORDS."""


class Terminal(Console):
    """A console that prints text literally: no markup, no emoji by name, no highlights, no control codes but its own."""

    def render_str(self, text: str, **given: Any) -> Text:
        """Return a printed text, or the cell of a table, as one line of printable characters."""
        return super().render_str(one_line(text), **given)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Yield the segments of a renderable, with the control codes in its text made printable."""
        for piece in super().render(renderable, options):
            is_safe = piece.control or piece.text.isprintable() or piece.text == "\n"
            yield piece if is_safe else Segment("\n".join(map(one_line, piece.text.split("\n"))), piece.style)


def words(text: str, style: str = "") -> Text:
    """Return one line of plain text in a style."""
    return Text(one_line(text), style=style)


def out() -> Console:
    """Return the console for data; it is made at each call, so that it follows a redirected stdout."""
    return _console(stderr=False)


def messages() -> Console:
    """Return the console for messages, on stderr."""
    return _console(stderr=True)


def emit(
    result: Result | Body,
    *,
    render: Page | Callable[[Console], None],
    headline: Headline | None = None,
    notes: Iterable[Note] = (),
    is_file: bool = False,
) -> Body:
    """Print a result, or the JSON body of one, and return the body with the headline: as one JSON object, or as text.

    As text: the headline, then the notes as warnings, then `render`, which is a page or a function that prints; with `--quiet`
    the headline alone. A page of the guide, which is no result, has no headline. is_file: `render` prints the text of a file, to
    be redirected to one; then the headline goes to stderr, and `--quiet` leaves it out and not the text.
    """
    if headline is not None:
        _VERDICT.set(headline.says)
    body = body_of(result) if isinstance(result, Result) else result
    body = body if headline is None else {**body, "headline": body_of(headline)}
    if voice().is_json:
        sys.stdout.write(json.dumps(plain(body), allow_nan=False) + "\n")
        return body
    to = out()
    if headline is not None and is_file:
        for line in headline.lines:
            say(line)
    elif headline is not None:
        print_headline(to, headline)
        if voice().is_quiet:
            return body
        warn(notes)
        to.print()
        for rest in headline.rest:
            to.print(f"... {rest}", soft_wrap=True)
    if isinstance(render, Page):
        print_page(to, render)
    else:
        render(to)
    return body


def take_verdict() -> str:
    """Return the verdict of the last result that was printed, and clear it; empty where there was none."""
    verdict = _VERDICT.get()
    _VERDICT.set("")
    return verdict


def print_headline(to: Console, headline: Headline) -> None:
    """Print the first lines of a result, each on one line however long: the last is pasted."""
    for i, line in enumerate(headline.lines):
        to.print(words(line, "bold" if i == 0 else ""), soft_wrap=True)
    to.file.flush()


def print_file(to: Console, text: str) -> None:
    """Print the text of a file: unchanged where it is redirected to a file, else line by line as plain text."""
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
        sentence = one_line(block.removeprefix("\n"))
        for line in [sentence] if isinstance(block, Whole) else folded(sentence, to.width, rest="").split("\n"):
            to.print(line, soft_wrap=True)
    for line in page.closing:
        to.print(line, soft_wrap=True)


class Rows(Table):
    """A table that is shown row by row, a line for each cell, where its columns do not fit: no number or name is broken."""

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Yield the table where it fits: with one blank between columns, or, where NARROW or wider, with its words folded."""
        for line in folded(one_line(str(self.title)), options.max_width, rest="").split("\n") if self.title else ():
            yield _unfolded(words(line, "bold"))
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
        wide = min(max(map(len, heads)) + 2, options.max_width // 2)  # a longer head is a model's name, and stays in one piece
        for row in zip(*(column.cells for column in self.columns), strict=True):
            for head, cell in zip(heads, map(str, row), strict=True):
                for i, line in enumerate(folded(one_line(cell), options.max_width - wide, rest="").split("\n") if cell else ()):
                    yield _unfolded(words(f"{'' if i else f'{head}  ':<{wide}}", "dim").append_text(words(line)))
            yield ""

    @staticmethod
    def _least(console: Console, far: ConsoleOptions, column: Column) -> int:
        """Return the least width of a column in characters: that of its longest number, or of its longest word."""
        cells = Measurement.get(console, far, Group(column.header, *column.cells))
        if column.width is not None:
            return column.width
        return cells.maximum if column.no_wrap else max(cells.minimum, min(cells.maximum, LEAST_WORDS))


def _unfolded(line: Text) -> Text:
    """Mark a line as one that is neither cut nor folded, and return it."""
    line.no_wrap, line.overflow = True, "ignore"
    return line


def table(block: Block) -> Table:
    """Return the table of a block: the first `left` columns to the left, the others to the right, numbers never folded."""
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
        has_numbers = i >= block.left and any(_is_number(cell) for row in block.rows for cell in row[i : i + 1])
        side: JustifyMethod = "left" if i < block.left else "right"
        made.add_column(column, justify=side, header_style="dim", overflow="fold", no_wrap=has_numbers)
    if block.kept:
        made.columns[0].width = min(max(len(row[0]) for row in block.rows), block.kept)
    for row in block.rows:
        made.add_row(*row)
    return made


def _is_number(cell: str) -> bool:
    return cell.lstrip("+-<>=~.")[:1].isdigit()


def say(text: str) -> None:
    """Print a message on stderr; nothing with `--quiet`."""
    if not voice().is_quiet:
        complain(text)


class _Said(Handler):
    """Prints the messages of the Python functions as `say` does."""

    def emit(self, record: LogRecord) -> None:
        """Print one."""
        say(record.getMessage())


@contextmanager
def heard() -> Iterator[None]:
    """Print on stderr what the Python functions tell their logger while the context runs, once for a command in a tour."""
    logger, handler = getLogger("fieldsid"), _Said()
    if any(isinstance(h, _Said) for h in logger.handlers):
        yield
        return
    level = logger.level
    logger.addHandler(handler)
    logger.setLevel(INFO)
    try:
        yield
    finally:
        logger.removeHandler(handler)
        logger.setLevel(level)


def complain(*lines: str) -> None:
    """Print on stderr why the exit code is not 0, also with `--quiet`."""
    for line in lines:
        messages().print(words(line), soft_wrap=True)


def gated(body: Body, why: Iterable[str] = (), *, failed: bool) -> Body:
    """Return the JSON body of a result; where a gate of the command failed, say why on stderr and end it with exit code 1."""
    if failed:
        import typer

        complain(*why)
        raise typer.Exit(GATE_FAILED)
    return body


def warn(notes: Iterable[Note], *, of: str = "") -> None:
    """Print warnings on stderr, each with its code: shortened to a line on a terminal, in full with `-v`, none with `--quiet`."""
    if voice().is_quiet:
        return
    where, to = f"{of}: " if of else "", messages()
    for note in notes:
        text = f"{where}{note.message} [{note.code}]"
        to.print(words(f"warning: {shortened(text, to.width) if to.is_terminal else text}", "yellow"), soft_wrap=True)


def one_of_each_kind(found: Iterable[tuple[Hashable, str, Note]]) -> list[Note]:
    """Return one warning of each kind: that of the first run that has it, with the number of the others.

    found: of each warning its kind, the name of its run, and the note.
    """
    kinds: dict[Hashable, list[tuple[str, Note]]] = {}
    for kind, run, note in found:
        kinds.setdefault(kind, []).append((run, note))
    merged = []
    for (run, note), *others in kinds.values():
        more = f" (and {len(others)} more like it)" if others else ""
        of = "" if run in note.message else f"{run}: "
        merged.append(Note(note.code, f"{of}{note.message}{more}", {}))
    return merged


def shortened(text: str, width: int) -> str:
    """Return a warning shortened to a line behind `warning: `, with its code; unchanged with `-v`."""
    room = width - len("warning: ")
    if voice().is_verbose or len(text) <= room:
        return text
    message, _, code = text.rpartition(" [")
    end = f" ... [{code} -v"
    return f"{message[: max(room - len(end), 20)].rstrip()}{end}"


@contextmanager
def progress(says: str, total: int) -> Iterator[Callable[[], None]]:
    """Yield a function that advances a progress bar by one; the bar is drawn on stderr, and only on a terminal."""
    with _bar(TextColumn("{task.completed}/{task.total}")) as bar:
        task = bar.add_task(says, total=total)
        yield lambda: bar.advance(task)


def tracked(items: Sequence[T], says: str) -> Iterator[tuple[T, Callable[[float], None]]]:
    """Yield each item with a function that sets the share of it that is done; a bar on a terminal shows the progress."""
    with _bar(TaskProgressColumn()) as bar:
        task = bar.add_task(says, total=len(items))
        for i, item in enumerate(items):
            yield item, partial(_show_share, bar, task, i)
            bar.update(task, completed=i + 1)


def shows_progress(console: Console) -> bool:
    """Whether progress is drawn: on a terminal, unless with `--quiet`."""
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
