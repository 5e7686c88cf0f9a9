"""What the training runs make of the unseen ones: the predictive likelihood, the doubt in the parameters allowed for.

The likelihood of unseen runs at the parameters' estimate punishes a hypothesis whose numbers the training runs hardly
determine as if it were wrong. With theta ~ N(estimate, Lambda^-1) after the training runs, residual e and sensitivities S
of an unseen run, both whitened, |e - S d|^2 = e'e - 2 b'd + d'A d, and to first order

    log p(run) = -e'e/2 + (Lambda m + b)' (Lambda + A)^-1 (Lambda m + b) / 2 - m' Lambda m / 2 - log det(I + Lambda^-1 A) / 2

after which Lambda <- Lambda + A and m is where the two together lead. A run's own slots are projected out of A and b.
A run's own speed is measured only so well: its error e ~ N(0, 1) along c in the shared slots is averaged over first,
    A <- A - A c c'A / (1 + s),  b <- b - A c t / (1 + s),  log p <- log p + t^2 / (2 + 2 s) - log(1 + s) / 2,  s = c'A c, t = c'b
Source: MacKay 1992, Neural Computation 4(3), Bayesian interpolation; Kass and Raftery 1995, section 4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fieldsid.diagnosis.trial import Judged
from fieldsid.fitting.descent import normal_equations, products
from fieldsid.fitting.noise import estimate_noise, log_likelihood
from fieldsid.fitting.predict import values_held
from fieldsid.fitting.problem import Problem, RunResult
from fieldsid.fitting.products import solved
from fieldsid.fitting.whitening import noise_vector
from fieldsid.logs.run import FloatArray
from fieldsid.models.axis import NAMES
from fieldsid.models.model import Noise
from fieldsid.models.record import Record

STEP = 1e-4
ROUNDED = 1e-14
"""Share of a slot's information below which what is left of it is not told from rounding."""
SINGULAR = 1e-10
"""What is added to the precision of every combination of parameters, in units of their own."""
ALIKE = 4.0
"""Sum of squares over the noise floor within which residuals ask for the same noise."""


@dataclass(frozen=True, slots=True)
class Unseen:
    """An unseen run: its one-run problem and x, residual (2, n), and how its shared slots move with the training ones (F, S).

    `speed` (F,) is what they move by with the error of the run's own speed. `line` is the problem linearised at x in all
    its slots: no noise enters it.
    """

    problem: Problem
    x: FloatArray
    residual: FloatArray
    moves: FloatArray
    speed: FloatArray
    line: RunResult


def predictive(judged: Judged, runs: Sequence[Unseen], records: Sequence[Record]) -> FloatArray:
    """Return the log predictive likelihood of each unseen run, in turn, under the noise that all of them together ask for.

    The parameters are the training runs'; the noise is not, or a hypothesis that is right where it was fitted and a little
    wrong elsewhere would be punished for having been right.
    """
    dynamics = [(b.damping, b.stiffness) for b in (r.problem.base_of(r.x, 0) for r in runs)]
    known = precision(judged)

    plain = [r.residual for r in runs]
    _, led = _under(judged.noise, runs, dynamics, known)
    found = []
    for residuals in (plain, led) if _differ(plain, led, judged.floor) else (plain,):
        noise, _ = estimate_noise(records, dynamics, residuals, judged.family, judged.noise, floor=judged.floor)
        found.append(_under(noise, runs, dynamics, known)[0])
    return max(found, key=lambda v: float(v.sum()))


def _differ(plain: Sequence[FloatArray], led: Sequence[FloatArray], floor: Noise) -> bool:
    """Whether two sets of residuals differ by more than a noise could tell: its parameters see no less than that."""
    sigma = np.array([[floor.angle], [floor.rate]])
    return sum(float(np.sum(((a - b) / sigma) ** 2)) for a, b in zip(plain, led, strict=True)) > ALIKE


def precision(judged: Judged) -> FloatArray:
    """Return the precision (S, S) that the training runs leave the shared slots with, their own slots projected out."""
    problem, x = judged.trial.problem, judged.trial.x
    shared = problem.layout.shared
    _, normal, _, _ = normal_equations(problem, x, judged.noise, range(x.size))
    width = (problem.layout.high - problem.layout.low)[:shared]
    a, _ = _without_own(normal, np.zeros(x.size), shared)
    return a + np.diag(1.0 / width**2)


def moves_of(judged: Judged, frozen: Problem, speed: float) -> FloatArray:
    """Return how the shared slots of a run's one-run problem move with the shared ones of the training problem, (F, S)."""
    layout, x = judged.trial.problem.layout, judged.trial.x
    damping = NAMES[layout.axis].damping
    out = np.zeros((frozen.layout.shared, layout.shared))

    def at(values: dict[str, float]) -> FloatArray:
        law = layout.law(values)
        here = values_held(law, values, layout.axis, speed)
        here[damping] *= law.scale(speed) ** (law.damping_exponent - frozen.layout.groups.exponent)
        return np.array([here[n] for n in frozen.layout.names])

    values = dict(zip(layout.names, x[: layout.shared].tolist(), strict=True))
    for j, name in enumerate(layout.names):
        step = STEP * max(abs(values[name]), STEP)
        out[:, j] = (at(values | {name: values[name] + step}) - at(values | {name: values[name] - step})) / (2.0 * step)
    return out


def _under(
    noise: Noise, runs: Sequence[Unseen], dynamics: Sequence[tuple[float, float]], known: FloatArray
) -> tuple[FloatArray, list[FloatArray]]:
    """Return each run's log predictive likelihood under a noise, and its residual where all that is in doubt is led."""
    vector, values, parts = noise_vector(noise), list[float](), list[FloatArray | None]()
    middle: FloatArray = np.zeros(known.shape[0])
    # in units of each parameter's own doubt: their sizes differ by ten powers of ten, and some move as one
    unit = 1.0 / np.sqrt(np.diag(known))
    doubt = known * np.outer(unit, unit) + SINGULAR * np.eye(unit.size)
    for run, d in zip(runs, dynamics, strict=True):
        likelihood = log_likelihood(run.problem.records, [d], [run.residual], vector)
        product = products(run.problem.records[0], noise, *d, run.line)
        parts.append(product)
        if product is not None:
            a, b = _without_own(product[1:, 1:], product[1:, 0], run.problem.layout.shared)
            a, b, averaged = _without_speed(a, b, run.speed)
            likelihood += averaged
            moves = run.moves * unit
            a, b = moves.T @ a @ moves, moves.T @ b
            pull = doubt @ middle
            moved = np.linalg.solve(doubt + a, pull + b)
            gain = 0.5 * float((pull + b) @ moved - middle @ pull)
            likelihood += gain - 0.5 * (_log_det(doubt + a) - _log_det(doubt))
            middle, doubt = np.asarray(moved), doubt + a
        values.append(likelihood)
    led = [run.residual if p is None else _led(run, p, unit * middle) for run, p in zip(runs, parts, strict=True)]
    return np.array(values), led


def _led(run: Unseen, product: FloatArray, middle: FloatArray) -> FloatArray:
    """Return a run's residual (2, n) with the shared slots moved, the run's speed and its own slots following."""
    shared, normal = run.problem.layout.shared, product[1:, 1:]
    step = run.moves @ middle
    a, b = _without_own(normal, product[1:, 0], shared)
    step = step + run.speed * float(run.speed @ (b - a @ step)) / (1.0 + float(run.speed @ a @ run.speed))
    own = -solved(normal[shared:, shared:], normal[shared:, :shared] @ step)
    return np.asarray(run.residual - np.tensordot(np.concatenate([step, own]), run.line.sensitivity, axes=1))


def _without_own(normal: FloatArray, gradient: FloatArray, shared: int) -> tuple[FloatArray, FloatArray]:
    """Return normal matrix and gradient of the shared slots with the others at their best.

    In units of each slot's own information: what is left of a slot that the others stand in for is a small difference.
    """
    size = np.sqrt(np.maximum(np.diag(normal), np.finfo(float).tiny))
    unit, pull = normal / np.outer(size, size), gradient / size
    cross = unit[shared:, :shared]
    inverse = np.linalg.pinv(unit[shared:, shared:], rcond=1e-12, hermitian=True)
    a = unit[:shared, :shared] - cross.T @ inverse @ cross
    known, of = 0.5 * (a + a.T), size[:shared]
    known[np.diag_indices(shared)] = np.maximum(np.diag(known), ROUNDED)
    return known * np.outer(of, of), (pull[:shared] - cross.T @ inverse @ pull[shared:]) * of


def _without_speed(a: FloatArray, b: FloatArray, c: FloatArray) -> tuple[FloatArray, FloatArray, float]:
    """Return normal matrix and gradient with the error of a run's speed averaged over, and what that adds to its likelihood."""
    along, t = a @ c, float(c @ b)
    room = 1.0 + float(c @ along)
    gain = 0.5 * (t * t / room - np.log(room))
    return a - np.outer(along, along) / room, b - along * t / room, gain


def _log_det(matrix: FloatArray) -> float:
    return float(np.linalg.slogdet(matrix)[1])
