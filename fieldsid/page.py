"""A page: what a record has to say, as plain words in blocks; the same page as fixed text and as HTML."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from html import escape
from re import compile as pattern
from textwrap import fill

INDENT = "  "
GAP = "  "
WIDTH = 100
"""Columns from which on a sentence goes on in the next line."""
_BESIDE_A_NUMBER = pattern(r" (?=\.\.|\+/-)|(?<=\.\.) |(?<=\+/-) |(?<=\d) (?=%|1/s|[A-Za-z]{1,3}\b)")
"""The blanks of `1.2 +/- 0.3 rad/s`, `5 .. 9 deg` and `8 %`, at which no line ends."""
LONGEST_WORD = 60
"""Characters of a name or a path in a line, beyond which its middle is left out."""


@dataclass(frozen=True, slots=True)
class Block:
    """One block of a page: its title, the heads of its columns (none where they need none) and its rows, all as words.

    The first `left` columns are words and stand at the left, the others are numbers and stand at the right. A terminal
    keeps what is first in a row in one piece up to `kept` letters, whatever stands beside it: it is a name to be pasted.
    """

    title: str
    rows: tuple[tuple[str, ...], ...]
    columns: tuple[str, ...] = ()
    left: int = 1
    kept: int = 0


class Whole(str):
    """A sentence that a terminal shows as one line however long it is, for it names files or runs."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class Page:
    """What a record says: a title, what must be read before any number, blocks and sentences in their order.

    A sentence belongs to what stands before it, unless it begins with an empty line; those of the closing are whole.
    """

    title: str
    warnings: tuple[str, ...] = ()
    blocks: tuple[Block | str, ...] = ()
    closing: tuple[str, ...] = ()


def facts(title: str, pairs: Iterable[tuple[str, str]]) -> Block:
    """Return a block of names and what they are, without those that nothing is known of."""
    return Block(title, tuple(pair for pair in pairs if pair[1]), left=2)


def paragraph(lines: Sequence[str], kind: type[str] = str) -> tuple[str, ...]:
    """Return sentences that stand together, apart from what stands before them, each of a kind, such as Whole."""
    return tuple(kind(line if i else f"\n{line}") for i, line in enumerate(lines))


def written(**files: str | Iterable[str] | None) -> tuple[str, ...]:
    """Return a line for each file that was written, as `figure: history.png`: what it is, and one path or several."""
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
    """Whether a block says anything."""
    return bool(block.rows if isinstance(block, Block) else block)


def counted(count: int, word: str, many: str = "") -> str:
    """Return `1 run`, `2 runs`; `many` is a plural that is no `s` more."""
    return f"{count} {word if count == 1 else many or f'{word}s'}"


def cut(text: str, longest: int) -> str:
    """Return a text on one line, its end left out where it is longer than so many characters."""
    line = " ".join(text.split())
    return line if len(line) <= longest else f"{line[: longest - 3]}..."


def listed(names: Sequence[str], most: int = 4) -> str:
    """Return names joined by commas, only their count for those beyond the first few."""
    shown = ", ".join(cut(n, LONGEST_WORD) for n in names[:most])
    return shown if len(names) <= most else f"{shown} and {len(names) - most} more"


def folded(line: str, width: int = WIDTH, *, first: str = "", rest: str = INDENT) -> str:
    """Return a line as several of a width, words and names unbroken and a number in one line with its error and its unit.

    first and rest: what the first of them, and what the others begin with.
    """
    glued = _BESIDE_A_NUMBER.sub("\u00a0", line)
    folds = fill(glued, width, initial_indent=first, subsequent_indent=rest, break_long_words=False, break_on_hyphens=False)
    return folds.replace("\u00a0", " ")


def dense(block: Block) -> Block:
    """Return a block without the columns that nothing stands in."""
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
    return [folded(said, first=f"{INDENT}{name.ljust(width)}{GAP}", rest=rest) for name, said in rows]


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
