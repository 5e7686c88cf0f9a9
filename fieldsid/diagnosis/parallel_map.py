"""A parallel map over this process and a forked worker, where the system has a second core and can fork.

Results refer to the records and effects that both processes have in memory instead of copying them.
"""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterable, Sequence
from io import BytesIO
from typing import Any, TypeVar

from fieldsid.fitting.problem.problem import Problem
from fieldsid.models.effect import Effect, variant_of, with_variant
from fieldsid.models.record import Record
from fieldsid.runtime.evaluation_counter import EvaluationCounter
from fieldsid.runtime.parallel_map import parallel_map
from fieldsid.runtime.pickling import WorkerPickler, dumps

T = TypeVar("T")
R = TypeVar("R")


class ParallelMap:
    """The objects that two processes share: records by index, effects by name, and the counter of evaluations."""

    def __init__(
        self, records: Iterable[Record], effects: Iterable[Effect], evaluations: EvaluationCounter | None = None
    ) -> None:  # fmt: skip
        self.records, self.evaluations = tuple(records), evaluations or EvaluationCounter()
        self.effects, self._is_sharing = {e.name: e for e in effects}, False

    def map(self, function: Callable[[T], R], items: Sequence[T]) -> list[R]:
        """Return a function of every item as `parallel_map` does, and count the evaluations of both processes.

        A map inside a map runs in one process.
        """
        if self._is_sharing:
            return [function(item) for item in items]

        def counted(item: T) -> tuple[R, int]:
            before = self.evaluations.count
            value = function(item)
            used, self.evaluations.count = self.evaluations.count - before, before
            return value, used

        self._is_sharing = True
        try:
            done = parallel_map(counted, items, self.dumps, self.loads)
        finally:
            self._is_sharing = False
        self.evaluations.add(sum(used for _, used in done))
        return [value for value, _ in done]

    def dumps(self, value: object) -> bytes:
        """Return a value as bytes that `loads` reads."""
        return dumps(value, lambda out: _Writer(out, self))

    def loads(self, answer: bytes) -> Any:
        """Return the value that `dumps` was given, with the shared records and effects themselves in it."""
        return _Reader(BytesIO(answer), self).load()


class _Writer(WorkerPickler):
    def __init__(self, out: BytesIO, known: ParallelMap) -> None:
        super().__init__(out)
        self.places = {id(r): i for i, r in enumerate(known.records)}
        self.effects, self.evaluations = known.effects, known.evaluations

    def persistent_id(self, obj: object) -> tuple[str, object] | None:
        """Return the reference to a shared record, effect or counter, None for anything else."""
        if obj is self.evaluations:
            return "evaluations", None
        if isinstance(obj, Record) and id(obj) in self.places:
            return "record", self.places[id(obj)]
        if isinstance(obj, Effect) and obj.name in self.effects:
            names = tuple(c.name for c in obj.coefficients)
            same = with_coefficients(self.effects[obj.name], names)
            return ("effect", (obj.name, names)) if same is not None and same.coefficients == obj.coefficients else None
        return None

    def reducer_override(self, obj: object) -> Any:
        """Return the reduction of a problem without its cached arrays; for any other object that of the base class."""
        if isinstance(obj, Problem):
            return Problem, (obj.records, obj.layout, obj.evaluations)
        return super().reducer_override(obj)


class _Reader(pickle.Unpickler):
    def __init__(self, stream: BytesIO, known: ParallelMap) -> None:
        super().__init__(stream)
        self.known = known

    def persistent_load(self, pid: tuple[str, Any]) -> object:
        """Return the record or effect of a reference, the effect in the variant with the coefficients of the reference."""
        kind, what = pid
        if kind == "record":
            return self.known.records[what]
        if kind == "evaluations":
            return self.known.evaluations
        name, coefficients = what
        effect = with_coefficients(self.known.effects[name], coefficients)
        if effect is None:
            raise pickle.UnpicklingError(f"no form of {name} has {', '.join(coefficients)}")
        return effect


def with_coefficients(effect: Effect, names: tuple[str, ...]) -> Effect | None:
    """Return an effect in the variant with coefficients of these names; the effect itself where it has them."""
    if names == tuple(c.name for c in effect.coefficients):
        return effect
    form = variant_of(effect, names)
    return None if form is None else with_variant(effect, form)
