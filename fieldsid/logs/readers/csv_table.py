"""Read tables of text: any separator, header or none, leading lines of words, gzip, UTF-8/16, Windows-1252, decimal comma."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, Any, Literal

import numpy as np
import numpy.typing as npt

from fieldsid.errors import LogError
from fieldsid.logs.channels import ChannelMap, TableForm
from fieldsid.logs.mapping.vocabulary import TIME
from fieldsid.logs.mapping.word_meaning import meaning_of
from fieldsid.logs.reader import SAMPLED, ReadOptions
from fieldsid.logs.readers._cells import ERRORS, MISSING, SENTENCE, cells, has_number, is_word
from fieldsid.logs.readers._columns import Columns, used_by
from fieldsid.logs.readers._plain_text import HEAD, PlainText, plain_text
from fieldsid.logs.readers._rows_of_several import goes_back, refuse_rows_of_several
from fieldsid.logs.readers._tables import Table, table_reader
from fieldsid.logs.readers._text import LOOKED_AT, Form, form_of
from fieldsid.logs.readers._unpacked import GZIP, LONGEST_ROW, refuse_endless
from fieldsid.logs.run import Note
from fieldsid.logs.unknown_file import COPY_AGAIN, head_of, is_text, known_text

NUMBERS = "fiub"


_LINE = re.compile(r"line (\d+)")


def sniff(path: Path) -> bool:
    """Whether a file may be text: it is gzip, or does not have the signature of a binary format."""
    return not path.is_dir() and (head_of(path).startswith(GZIP) or is_text(path))


def table(path: Path, form: TableForm, options: ReadOptions, mapping: ChannelMap | None) -> Table:
    """Return the columns of a text table that a mapping names, or all, with its form; raises LogError where it is no table."""
    with opened(path, form, options) as text:
        written = text.form
        used = range(written.width) if mapping is None else used_by(mapping, written.names, written.width)
        if mapping is not None:
            refuse_rows_of_several(path, written, text.text.head().splitlines()[written.start :], used)
        columns = text.columns(used)
        if mapping is not None:
            _refuse_blocks_of_several(path, form, options, columns, mapping)
        sign: Literal[".", ","] = "," if written.decimal == "," else "."
        found = TableForm(written.separator, bool(written.names), written.start, form.encoding, sign)
        return Table(columns, found, tuple(text.notes))


def _refuse_blocks_of_several(path: Path, form: TableForm, options: ReadOptions, columns: Columns, mapping: ChannelMap) -> None:
    """Raise LogError where the rows are those of several one after the other, by all columns, where the time goes back."""
    source = mapping.time
    place = None if source is None or source.column is None or source.date else columns.index(source.column, TIME)
    if place is None or not goes_back(columns.take(place)).any():
        return
    with opened(path, form, options) as text:
        lines, every = text.text.head().splitlines()[text.form.start :], text.columns(range(columns.width))
    known = {i for i, name in enumerate(every.names) if (meaning := meaning_of(name)) is not None and meaning[0] != TIME}
    whole = [every.take(i) for i in range(every.width)]
    refuse_rows_of_several(path, text.form, lines, known, whole, columns.take(place))


def names_of(path: Path) -> tuple[str, ...]:
    """Return the names of a table's columns, empty for an empty text; raises LogError where the file is no table."""
    with plain_text(path, None, limit=HEAD) as text:
        head = _head_of(path, text)
        return form_of(head, TableForm(), path).names if head.strip() else ()


def _head_of(path: Path, text: PlainText) -> str:
    """Return the start of a text, from which its form is found; raises LogError where it does not contain one complete line."""
    head = text.head()
    if "\n" not in head and text.size >= HEAD:
        refuse_endless(path, text.size, head[:40])
    return head


@contextmanager
def opened(path: Path, stated: TableForm, options: ReadOptions) -> Iterator[_Table]:
    """Yield the table of a file, its text and the form in which it is written."""
    with plain_text(path, stated.encoding) as text:
        yield _Table(path, text, stated, options)


class _Table:
    """The text of one file, with its form and its cells."""

    def __init__(self, path: Path, text: PlainText, stated: TableForm, options: ReadOptions) -> None:
        self.path = path
        self.text = text
        self.options = options
        self.notes: list[Note] = []
        if text.is_blank():
            raise LogError(f"`{path}` is empty", found="no text inside", hint=COPY_AGAIN)
        self.form: Form = form_of(_head_of(path, text), stated, path)
        self.begin = text.offset_of_line(self.form.start)
        self.end = text.size
        if text.is_cut:
            self._end_at_cut()
        else:
            self._drop_half_a_line()

    def _end_at_cut(self) -> None:
        """Leave out the incomplete last line of a truncated gzip stream; raises LogError unless the options say to salvage."""
        self.end = max(self.text.last_line()[0], self.begin)
        rows = self.text.count(b"\n", self.begin, self.end)
        if not self.options.salvage:
            raise LogError(
                f"`{self.path}` is a truncated gzip file",
                found=f"{rows} whole rows before the end",
                hint=f"{COPY_AGAIN}; or take what is left: {self.options.with_option('--salvage')}",
            )
        self.notes.append(Note("truncated", f"the gzip file is cut off; {rows} rows were left", {"rows": rows}))

    def _drop_half_a_line(self) -> None:
        """Leave out a last line with too few cells, at which a file that is not packed was cut off."""
        begin, line = self.text.last_line()
        if len(line) > LONGEST_ROW:
            refuse_endless(self.path, self.text.size - begin, line[:40].decode("latin-1"))
        last = line.decode(self.text.encoding, errors="replace")
        if begin > self.begin and last.strip() and len(cells(last, self.form.separator)) < self.form.width:
            self.end = begin
            self.notes.append(
                Note("truncated", "the file is cut off inside its last line, which was left out", {"line": last[:80]})
            )

    def columns(self, wanted: Iterable[int]) -> Columns:
        """Return the columns, with cells for those whose index is wanted."""
        taken = self._cells(sorted(set(wanted)))
        return Columns(self.path, self.form.names, self.form.width, taken.__getitem__, self.form.units)

    def _cells(self, wanted: Sequence[int]) -> dict[int, npt.NDArray[Any]]:
        """Return the cells (n,) of the wanted columns; lines of words that do not fit the columns are left out."""
        with TemporaryFile() as without_errors, TemporaryFile() as without_nmea, TemporaryFile() as without_words:
            if self.text.holds(ERRORS, b"#", self.begin, self.end):
                self._without_errors(without_errors)
            if not self.form.is_sentences and self.text.holds(SENTENCE, b"$", self.begin, self.end):
                self._without_sentences(without_nmea)
            try:
                return self._parsed(wanted)
            except LogError:
                if not self._without_words(without_words):
                    raise
                return self._parsed(wanted)

    def _replaced(self, plain: IO[bytes], change: Callable[[bytes], tuple[bytes, list[bytes]]]) -> list[str]:
        """Replace the text by a copy of its rows, and return what was left out of them.

        `change` returns a row as it is copied, with what it leaves out.
        """
        found: list[str] = []

        def copied(raw: bytes) -> bytes:
            row, left_out = change(raw)
            found.extend(part.decode(self.text.encoding, errors="replace").strip() for part in left_out)
            return row

        with self.text.between(self.begin, self.end) as rows:
            plain.writelines(map(copied, rows))
        self.text = replace(self.text, stream=plain, size=plain.tell(), encoding=self.text.encoding.removesuffix("-sig"))
        self.begin, self.end = 0, plain.tell()
        return found

    def _without_errors(self, plain: IO[bytes]) -> None:
        """Replace each cell by which a program marks that there is no number by an empty one."""
        found = self._replaced(plain, lambda raw: (ERRORS.sub(b"", raw), ERRORS.findall(raw)) if b"#" in raw else (raw, []))
        if found:
            message = f"cells that say there is no number, as {found[0]!r}, taken as missing: {len(found)}"
            self.notes.append(Note("error_cells", message, {"count": len(found)}))

    def _without_sentences(self, plain: IO[bytes]) -> None:
        """Replace each sentence of NMEA between the rows by an empty line."""
        found = self._replaced(plain, lambda raw: (b"\n", [raw]) if SENTENCE.match(raw) else (raw, []))
        if found:
            message = f"lines of another talker (NMEA 0183) between the rows, left out: {len(found)}, the first {found[0][:60]!r}"
            self.notes.append(Note("nmea_lines", message, {"count": len(found)}))

    def _without_words(self, plain: IO[bytes]) -> bool:
        """Replace each line without a number by an empty one; return whether there was such a line."""

        def change(raw: bytes) -> tuple[bytes, list[bytes]]:
            line = raw.decode(self.text.encoding, errors="replace").strip()
            is_row = not line or line.startswith("#") or has_number(line, self.form.separator, self.form.decimal)
            return (raw, []) if is_row else (b"\n", [raw])

        found = self._replaced(plain, change)
        if found:
            message = f"lines of words between the rows, left out: {len(found)}, the first {found[0][:60]!r}"
            self.notes.append(Note("text_rows", message, {"count": len(found)}))
        return bool(found)

    def _parsed(self, wanted: Sequence[int]) -> dict[int, npt.NDArray[Any]]:
        """Return the cells (n,) of the wanted columns: numbers where a column contains nothing else, else objects."""
        import pandas as pd

        blocks: dict[int, list[npt.NDArray[Any]]] = {i: [] for i in wanted}
        count = 0
        with self.text.between(self.begin, self.end) as rows:
            try:
                for block in pd.read_csv(rows, **self._form_for_pandas(pd.__version__)):
                    count += len(block)
                    for i, column in blocks.items():
                        column.append(block.iloc[:, i].to_numpy(copy=True))
                    self.options.progress((self.text.stream.tell() - self.begin) / (self.end - self.begin))
            except (pd.errors.ParserError, pd.errors.EmptyDataError, ValueError) as error:
                raise self._misfit(error) from error
        if self.options.salvage:
            self._count_bad_rows(count)
        # one column after the other, so that only one is in memory twice
        return {i: self._with_points(_joined(blocks.pop(i))) for i in wanted}

    def _with_points(self, cells: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return cells with decimal points: pandas does not read decimal commas in a column that contains words."""
        if self.form.decimal == "." or cells.dtype.kind in NUMBERS:
            return cells
        return np.array([c.replace(",", ".") if isinstance(c, str) and not is_word(c, ",") else c for c in cells], dtype=object)

    def _form_for_pandas(self, version: str) -> dict[str, Any]:
        return {
            "sep": r"\s+" if self.form.separator == "whitespace" else self.form.separator,
            "header": None,
            "names": list(range(self.form.width)),
            "index_col": False,
            "decimal": self.form.decimal,
            "na_values": sorted(MISSING | {m.upper() for m in MISSING} | {m.title() for m in MISSING}),
            "skipinitialspace": True,
            "comment": "#",
            "encoding": self.text.encoding,
            "encoding_errors": "replace",
            "on_bad_lines": "skip" if self.options.salvage else "error",
            "low_memory": False,
            "chunksize": SAMPLED,
            **_exact(version),
        }

    def _misfit(self, error: Exception) -> LogError:
        return known_text(self.path, self.text.head().splitlines()[:LOOKED_AT]) or LogError(
            f"`{self.path}` has a row that does not fit its {self.form.width} columns",
            found=_LINE.sub(lambda m: f"line {int(m[1]) + self.form.start}", str(error).strip().rpartition("error: ")[2]),
            hint=f"mend the line, or leave such rows out: {self.options.with_option('--salvage')}",
        )

    def _count_bad_rows(self, parsed: int) -> None:
        """Note how many rows were left out because they do not fit the columns.

        `parsed` is the number of rows that pandas returned.
        """
        with self.text.between(self.begin, self.end) as rows:
            # a closing quote alone on a line ends a cell of the row before, and is no row
            lines = (line.strip(b"\"' \t\r\n") for line in rows)
            left_out = sum(1 for line in lines if line and not line.startswith(b"#")) - parsed
        if left_out > 0:
            self.notes.append(
                Note("bad_rows", f"rows left out because they have too many cells: {left_out}", {"count": left_out})
            )


def _joined(blocks: list[npt.NDArray[Any]]) -> npt.NDArray[Any]:
    """Return the cells (n,) of a column, read-only: numbers where all blocks are, else objects."""
    cells = np.concatenate(blocks) if blocks else np.zeros(0)
    cells.setflags(write=False)
    return cells


def _exact(version: str) -> dict[str, Any]:
    """Return the option by which pandas reads every digit; from version 3.1 on it does so by default, and warns of the option."""
    major, minor = (int(n) for n in version.split(".")[:2])
    return {} if (major, minor) >= (3, 1) else {"float_precision": "round_trip"}


READER = table_reader(
    "csv_table",
    "text table: .csv, .csv.gz, .tsv, .txt, .dat",
    (".csv", ".csv.gz", ".tsv", ".txt", ".dat"),
    "text table",
    sniff,
    table,
    names_of,
)
