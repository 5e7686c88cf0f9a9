"""Work shared out between this process and a forked copy of it, where the system has a second core and can copy a process.

What comes back refers to the records and effects that both processes know, instead of bringing copies of them.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterable, Sequence
from io import BytesIO
from typing import Any, TypeVar

from fieldsid.copies import Writer, each, written
from fieldsid.fitting import effort
from fieldsid.fitting.problem import Problem
from fieldsid.models.effect import Effect, form_of, in_form
from fieldsid.models.record import Record

T = TypeVar("T")
R = TypeVar("R")


class Beside:
    """What two processes know: records by their place, effects by their name."""

    def __init__(self, records: Iterable[Record], effects: Iterable[Effect]) -> None:
        self.records = tuple(records)
        self.effects = {e.name: e for e in effects}

    def each(self, function: Callable[[T], R], items: Sequence[T]) -> list[R]:
        """Return a function of every item as `copies.each` does, what the copy has worked out counted here as well."""
        before = effort.done()

        def read(answer: bytes) -> dict[int, R]:
            done, worked_out = self.loads(answer)
            effort.count(worked_out)
            return dict(done)

        return each(function, items, lambda done: self.dumps((done, effort.done() - before)), read)

    def dumps(self, value: object) -> bytes:
        """Return a value as bytes that `loads` reads."""
        return written(value, lambda out: _Writer(out, self))

    def loads(self, answer: bytes) -> Any:
        """Return what `dumps` was given, the known records and effects in it themselves."""
        return _Reader(BytesIO(answer), self).load()


class _Writer(Writer):
    def __init__(self, out: BytesIO, known: Beside) -> None:
        super().__init__(out)
        self.places = {id(r): i for i, r in enumerate(known.records)}
        self.effects = known.effects

    def persistent_id(self, obj: object) -> tuple[str, object] | None:
        """Return what stands for a known record or an effect, none for all else."""
        if isinstance(obj, Record) and id(obj) in self.places:
            return "record", self.places[id(obj)]
        if isinstance(obj, Effect) and obj.name in self.effects:
            names = tuple(c.name for c in obj.coefficients)
            same = formed(self.effects[obj.name], names)
            return ("effect", (obj.name, names)) if same is not None and same.coefficients == obj.coefficients else None
        return None

    def reducer_override(self, obj: object) -> Any:
        """Return how a problem is made anew without the arrays of its last call, and all else as a writer does."""
        if isinstance(obj, Problem):
            return Problem, (obj.records, obj.layout)
        return super().reducer_override(obj)


class _Reader(pickle.Unpickler):
    def __init__(self, stream: BytesIO, known: Beside) -> None:
        super().__init__(stream)
        self.known = known

    def persistent_load(self, pid: tuple[str, Any]) -> object:
        """Return the record or effect that a name stands for, an effect in the form its coefficients are of."""
        kind, what = pid
        if kind == "record":
            return self.known.records[what]
        name, coefficients = what
        effect = formed(self.known.effects[name], coefficients)
        if effect is None:
            raise pickle.UnpicklingError(f"no form of {name} has {', '.join(coefficients)}")
        return effect


def formed(effect: Effect, names: tuple[str, ...]) -> Effect | None:
    """Return an effect in the form that has coefficients of these names, itself where they are its own."""
    if names == tuple(c.name for c in effect.coefficients):
        return effect
    form = form_of(effect, names)
    return None if form is None else in_form(effect, form)
