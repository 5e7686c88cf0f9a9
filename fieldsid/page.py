"""A page: the contents of a record as plain text in blocks, which is written as fixed text and as HTML."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from html import escape
from re import compile as pattern
from textwrap import fill

INDENT = "  "
GAP = "  "
WIDTH = 100
"""Width in columns at which sentences are wrapped."""
_BESIDE_A_NUMBER = pattern(r" (?=\.\.|\+/-)|(?<=\.\.) |(?<=\+/-) |(?<=\d) (?=%|1/s|[A-Za-z]{1,3}\b)")
"""The spaces in `1.2 +/- 0.3 rad/s`, `5 .. 9 deg` and `8 %`, at which lines are not broken."""
LONGEST_WORD = 60
"""Most characters of a name or a path in a line; the middle of a longer one is left out."""


@dataclass(frozen=True, slots=True)
class Block:
    """One block of a page: its title, the heads of its columns (may be empty) and its rows, all as text.

    The first `left` columns are text and aligned left, the others are numbers and aligned right. A terminal does not break the
    first cell of a row up to `kept` characters, as it is a name to be pasted.
    """

    title: str
    rows: tuple[tuple[str, ...], ...]
    columns: tuple[str, ...] = ()
    left: int = 1
    kept: int = 0


class Whole(str):
    """A sentence that a terminal does not wrap, as it names files or runs."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class Page:
    """The contents of a record: a title, warnings to be read first, and blocks and sentences in order.

    A sentence belongs to the block before it, unless it begins with an empty line; the closing sentences are not wrapped.
    """

    title: str
    warnings: tuple[str, ...] = ()
    blocks: tuple[Block | str, ...] = ()
    closing: tuple[str, ...] = ()


def facts(title: str, pairs: Iterable[tuple[str, str]]) -> Block:
    """Return a block of names and values, without those whose value is empty."""
    return Block(title, tuple(pair for pair in pairs if pair[1]), left=2)


def paragraph(lines: Sequence[str], kind: type[str] = str) -> tuple[str, ...]:
    """Return sentences as one paragraph, separated from the text before it, each of a kind, such as Whole."""
    return tuple(kind(line if i else f"\n{line}") for i, line in enumerate(lines))


def written(**files: str | Iterable[str] | None) -> tuple[str, ...]:
    """Return a line for each kind of file that was written, as `figure: history.png`, with one path or several."""
    named = ((what, [given] if isinstance(given, str) else given or ()) for what, given in files.items())
    return tuple(f"{what}: {file}" for what, paths in named for file in paths)


def text_of(page: Page) -> str:
    """Return a page as text: title and warnings first, then its blocks; sentences are folded, tables are not."""
    head = [folded(line) for line in (page.title, *(f"warning: {w}" for w in page.warnings))]
    parts = ["\n".join(head)]
    for b in page.blocks:
        if isinstance(b, Block):
            parts += [_block_text(b)] if b.rows else []
        elif b.startswith("\n"):
            parts.append(folded(b[1:]))
        else:
            parts[-1] += f"\n{folded(b)}"
    return "\n\n".join([*parts, *(["\n".join(map(folded, page.closing))] if page.closing else [])])


def html_of(page: Page) -> str:
    """Return a page as a fragment of HTML that is well-formed XML too; every word of the record is escaped."""
    warnings = "".join(f"<li>{escape(w)}</li>" for w in page.warnings)
    parts = [f"<p><b>{escape(page.title)}</b></p>", f"<ul>{warnings}</ul>" if warnings else ""]
    parts += [_block_html(b) if isinstance(b, Block) else f"<p>{escape(b.strip())}</p>" for b in page.blocks if has_content(b)]
    parts += [f"<p>{escape(line)}</p>" for line in page.closing]
    return f'<div class="fieldsid">{"".join(parts)}</div>'


def has_content(block: Block | str) -> bool:
    """Whether a block or sentence has any content."""
    return bool(block.rows if isinstance(block, Block) else block)


def counted(count: int, word: str, many: str = "") -> str:
    """Return `1 run`, `2 runs`; `many` is the plural where it is not formed with `s`."""
    return f"{count} {word if count == 1 else many or f'{word}s'}"


def cut(text: str, longest: int) -> str:
    """Return a text on one line, cut where it is longer than `longest` characters."""
    line = " ".join(text.split())
    return line if len(line) <= longest else f"{line[: longest - 3]}..."


def listed(names: Sequence[str], most: int = 4) -> str:
    """Return names joined by commas, only their count for those beyond the first few."""
    shown = ", ".join(cut(n, LONGEST_WORD) for n in names[:most])
    return shown if len(names) <= most else f"{shown} and {len(names) - most} more"


def folded(line: str, width: int = WIDTH, *, first: str = "", rest: str = INDENT) -> str:
    """Return a line wrapped to a width, without breaks within words or between a number, its error and its unit.

    `first` and `rest` are the prefixes of the first and of the other lines.
    """
    glued = _BESIDE_A_NUMBER.sub("\u00a0", line)
    folds = fill(glued, width, initial_indent=first, subsequent_indent=rest, break_long_words=False, break_on_hyphens=False)
    return folds.replace("\u00a0", " ")


def dense(block: Block) -> Block:
    """Return a block without its empty columns."""
    if not block.rows:
        return block
    kept = [i for i in range(len(block.rows[0])) if any(row[i] for row in block.rows)]
    rows = tuple(tuple(row[i] for i in kept) for row in block.rows)
    columns = tuple(block.columns[i] for i in kept if block.columns)
    return replace(block, rows=rows, columns=columns, left=sum(i < block.left for i in kept))


def _block_text(block: Block) -> str:
    block = dense(block)
    if not block.columns and block.left == 2:
        return "\n".join([block.title, *_fact_lines(block.rows)])
    rows = [block.columns, *block.rows] if block.columns else list(block.rows)
    widths = [max(len(row[i]) for row in rows) for i in range(len(rows[0]))]
    lines = [
        GAP.join(w.ljust(n) if i < block.left else w.rjust(n) for i, (w, n) in enumerate(zip(row, widths, strict=True))).rstrip()
        for row in rows
    ]
    return "\n".join([*([block.title] if block.title else []), *(f"{INDENT}{line}" for line in lines)])


def _fact_lines(rows: Sequence[tuple[str, ...]]) -> list[str]:
    width = max(len(name) for name, _ in rows)
    rest = " " * (len(INDENT) + width + len(GAP))
    return [folded(value, first=f"{INDENT}{name.ljust(width)}{GAP}", rest=rest) for name, value in rows]


def _block_html(block: Block) -> str:
    block = dense(block)
    head = f"<tr>{_cells('th', block.columns, block.left)}</tr>" if block.columns else ""
    rows = "".join(f"<tr>{_cells('td', row, block.left)}</tr>" for row in block.rows)
    caption = f"<caption>{escape(block.title)}</caption>" if block.title else ""
    return f"<table>{caption}{head}{rows}</table>"


def _cells(tag: str, words: Sequence[str], left: int) -> str:
    return "".join(
        f'<{tag} style="text-align: {"left" if i < left else "right"}">{escape(word)}</{tag}>' for i, word in enumerate(words)
    )
