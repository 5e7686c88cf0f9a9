"""The named effects added one at a time, so that a person watches the error fall."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from fieldsid.extension.extend import Extension, extend
from fieldsid.logs.run import Run
from fieldsid.models.model import Model


def extend_in_steps(
    parent: Model,
    effects: Sequence[str],
    training: Sequence[Run],
    validation: Sequence[Run] = (),
    *,
    report: Callable[[str], None] = lambda _text: None,
) -> tuple[Extension, ...]:
    """Return an extension for each of some effects, each of the model before it, in their order.

    Every step is refitted to the training runs and judged by the validation runs as `extend` does, and raises what that raises.
    """
    steps = list[Extension]()
    for effect in effects:
        steps.append(extend(steps[-1].model if steps else parent, [effect], training, validation, report=report))
    return tuple(steps)
