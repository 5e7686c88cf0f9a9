"""Read tables of one reading a row, `Timestamp, Key, Value`: each key is a topic with its own clock.

The exporters of FRC and Influx, Signal K and many private programs write such tables; a key whose values are words is no topic.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from fieldsid.errors import LogError
from fieldsid.logs.channels import TableForm
from fieldsid.logs.convert.number_cells import as_numbers
from fieldsid.logs.convert.times.time_column import likely_time_unit, seconds_of
from fieldsid.logs.mapping.canonical_names import words_of
from fieldsid.logs.mapping.vocabulary import TIME
from fieldsid.logs.mapping.word_meaning import meaning_of
from fieldsid.logs.reader import ReadOptions
from fieldsid.logs.readers import csv_table
from fieldsid.logs.readers._cells import cells, is_word
from fieldsid.logs.readers._columns import Columns
from fieldsid.logs.readers._plain_text import HEAD, plain_text
from fieldsid.logs.readers._rows_of_several import refuse_rows_of_several
from fieldsid.logs.readers._text import LOOKED_AT, Form, form_of
from fieldsid.logs.readers._topics import DATA, Topic, Topics, topic_of, topic_reader
from fieldsid.logs.run import Note
from fieldsid.numerics.arrays import FloatArray

KEYS = frozenset({"key", "name", "variable", "signal", "topic", "field", "channel", "parameter", "path", "tag", "entry"})
VALUES = frozenset({"value", "val", "data", "reading"})
"""Words in the name of the column of keys, and in that of the column of values."""


def sniff(path: Path) -> bool:
    """Whether a text table has a column of times, one of a few repeated words, and one of values."""
    if not csv_table.sniff(path):
        return False
    try:
        with plain_text(path, limit=HEAD) as text:
            head = text.head()
            form = form_of(head, TableForm(), path)
    except LogError:  # the reader of text tables reports the reason
        return False
    return _places(form, head) is not None


def _places(form: Form, head: str) -> tuple[int, int, int] | None:
    """Return the indexes of the columns of time, key and value; None where there are no such columns."""
    names = [set(words_of(name)) for name in form.names]
    times = [i for i, name in enumerate(form.names) if (meaning := meaning_of(name)) is not None and meaning[0] == TIME]
    keys = [i for i, words in enumerate(names) if words & KEYS and i not in times]
    values = [i for i, words in enumerate(names) if words & VALUES and i not in times]
    rows = [cells(line, form.separator) for line in head.splitlines()[form.start :][:LOOKED_AT]]
    rows = [row for row in rows if len(row) == form.width]
    for time, key, value in ((t, k, v) for t in times for k in keys for v in values if k != v):
        tags = [row[key] for row in rows]
        are_words = all(is_word(word, form.decimal) for word in tags)
        if are_words and 1 < len(set(tags)) <= len(tags) / 3 and any(not is_word(r[value], form.decimal) for r in rows):
            return time, key, value
    return None


def _topics(path: Path, options: ReadOptions, wanted: frozenset[str]) -> Topics:
    """Return each key with numeric values as a topic of one number, in the order of its times."""
    with csv_table.opened(path, TableForm(), options) as table:
        places = _places(table.form, table.text.head())
        if places is None:
            raise LogError(f"`{path}` is no table of keys and values", found=", ".join(table.form.names), hint="name its columns")
        lines = table.text.head().splitlines()[table.form.start :]
        lines_of: dict[str, list[str]] = {}
        for line in (line for line in lines if len(cells(line, table.form.separator)) == table.form.width):
            lines_of.setdefault(cells(line, table.form.separator)[places[1]], []).append(line)
        for of_key in lines_of.values():
            refuse_rows_of_several(path, table.form, of_key, (places[2],))
        columns = table.columns(places)
        time, notes = _times(columns, places[0])
        keys, values = columns.take(places[1]).astype(str), as_numbers(columns.take(places[2]))[0]
        found = {str(key): _topic(time, values, keys == key) for key in np.unique(keys)}
        return Topics(found, notes=(*table.notes, *notes))


def _times(columns: Columns, place: int) -> tuple[FloatArray, list[Note]]:
    """Return the times (n,) of the rows in s, and notes.

    Several readings may share a stamp; only the distinct stamps are converted, so that shared ones do not count as too coarse.
    """
    import pandas as pd

    rows, stamps = pd.factorize(columns.take(place))
    unit = columns.unit(place, TIME) or likely_time_unit(stamps)
    time, notes = seconds_of(stamps, unit, ReadOptions(salvage=True), name=columns.name(place))
    return np.where(rows >= 0, time[rows], np.nan), notes


def _topic(time: FloatArray, values: FloatArray, rows: npt.NDArray[np.bool_]) -> Topic | None:
    seen = rows & np.isfinite(values)
    return topic_of(time[seen], {DATA: values[seen]})


READER = topic_reader(
    "key_value",
    "text table of one reading a row: time, key, value",
    (".csv", ".csv.gz", ".tsv", ".txt"),
    "key-value table",
    sniff,
    _topics,
    "key",
)
