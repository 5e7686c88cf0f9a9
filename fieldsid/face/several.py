"""Several records of one kind, as the functions return them: a tuple with a summary, a table and a figure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar

from fieldsid.display import LONGEST, Plotted, view_of
from fieldsid.errors import UsageError
from fieldsid.page import cut, listed

if TYPE_CHECKING:
    from pandas import DataFrame

T_co = TypeVar("T_co", bound=Plotted, covariant=True)
MOST_NAMED = 8
RUN = "run"


class Several(Plotted, tuple[T_co, ...]):
    """Records of one kind in order; `summary` and `to_frame` cover all of them, `plot` takes a single one."""

    __slots__ = ()

    def __repr__(self) -> str:
        if not self:
            return "<no records>"
        if len(self) == 1:
            return cut(f"({self[0]!r},)", LONGEST)
        labels = [view_of(type(record)).label(record) for record in self]
        return cut(f"<{len(self)} {type(self[0]).__name__} records: {listed(labels, MOST_NAMED)}>", LONGEST)

    def summary(self) -> str:
        """Return the summaries of all records, one below the other."""
        return "\n\n\n".join(record.summary() for record in self)

    def _repr_html_(self) -> str:
        return f"<div>{''.join(record._repr_html_() for record in self)}</div>"

    def to_frame(self, part: str = "") -> DataFrame:
        """Return a part of all records as one pandas table, whose first index is the name of the run; raises UsageError."""
        import pandas as pd

        if not self:
            return pd.DataFrame()
        tables = [record.to_frame(part) for record in self]
        if all(table.index.names[0] == RUN for table in tables):
            return pd.concat(tables)
        return pd.concat(tables, keys=[view_of(type(record)).label(record) for record in self], names=[RUN])

    def plot(self, part: str = "") -> Any:
        """Return the matplotlib Figure of the only record; raises UsageError where there are several, or none."""
        if len(self) != 1:
            raise UsageError(
                f"{len(self)} records have a figure each", found=repr(self), hint="draw one of them: `[0].plot()`" if self else ""
            )
        return self[0].plot(part)
