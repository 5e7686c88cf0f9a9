"""The figure of a diagnosis: the error with each candidate and its probability, and where the model fails."""

from __future__ import annotations

from fieldsid.diagnosis import Candidate, Diagnosis
from fieldsid.figures import bars
from fieldsid.figures.panel import Bars, Picture
from fieldsid.rounding import DEGREES, probability


def figure(found: Diagnosis) -> Picture:
    """Return the candidates at the left and where the model fails at the right."""
    chances = [c.probability for c in found.candidates]
    sure = f", probability {probability(chances[0])}" if found.effects and chances[0] == max(chances) else ""
    title = f"{found.axis.value}, {found.verdict}: {found.says}{sure}"
    at = f"the model as it is fails most at {DEGREES.words(found.where[0].condition)}\n{bars.LOOKS_AT}" if found.where else ""
    columns = (candidates(found),), (bars.places(found.where, at),)
    return Picture(title, (13.0, 6.4), columns[: 1 + bool(found.where)], (1.25, 1.0)[: 1 + bool(found.where)])


def candidates(found: Diagnosis) -> Bars:
    """Return the bars of a diagnosis: the present model, then the candidates in order."""
    models = [("model as it is", found.base, found.noise_floor, "")]
    models += [(c.effect, c.errors, found.noise_floor, words_of(c)) for c in found.candidates]
    return bars.errors(models, "+".join(found.effects), noiseless=found.noiseless)


def words_of(c: Candidate) -> str:
    """Return what stands beside the error of a candidate: the share of the excess explained if any, and the probability."""
    return f", {'worse' if c.worse else f'{100 * c.explained:.0f} % explained'}, probability {probability(c.probability)}"
