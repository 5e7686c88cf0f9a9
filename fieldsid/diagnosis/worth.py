"""When an addition to a hypothesis is worth having: by its evidence, and by what it does to the error.

The evidence holds the prior odds of what was added; the errors are those of the free run, of fitted and of unseen runs.
"""

from __future__ import annotations

from fieldsid.diagnosis.hypothesis import Hypothesis
from fieldsid.models.model import Noise

WORTH = 6.0
"""Prior log odds against another kind of noise or another law of the speed than the usual: 400 to 1."""
LEARNED = 4.0
"""Log likelihood an addition with numbers of every run's own must gain on the runs it is fitted to: on unseen runs those
numbers are fitted too, and might come from nowhere. One without must only not lose there."""
MATTERS = 0.92
"""Share the free-run error must fall to: significant is not important. Speed, trim and clock of a real vehicle are never
exactly what a model has them to be: what that leaves is a few percent of the noise."""
REFINES = 0.97
"""The same for another form of an effect that has been named."""
CLEAN = 1.02
"""Error over the noise floor up to which nothing is left."""
ALIKE = 1.03
"""Hypotheses predict alike within this factor of each other's error."""
WORSE = 2.0
"""Error on unseen runs over that on fitted ones above which more is left than a disturbance, which is alike on both."""
MATTERS_MORE = 0.02
"""What a third and each further effect must bring beyond that: long explanations are the easier to find."""
FAR = 4.0
"""Error over the floor from which every leading child is put into other forms: far
off, a textbook's shape tells little."""
MUCH = 1.5
"""Error over the floor from which something is missing even where no effect has evidence in the textbook's form."""


def pays(without: Hypothesis, with_: Hypothesis) -> bool:
    """Whether an addition brings evidence, and matters."""
    return likelier(without, with_) and matters(without, with_)


def matters(without: Hypothesis, with_: Hypothesis) -> bool:
    """Whether an addition lowers the error on fitted or on unseen runs by more than a trifle, on all, and raises no unseen one.

    Of both either may show what it is for: a mild run says nothing of what only a hard one brings out, and a hypothesis that
    lacks it has bent its other numbers to the runs fitted to.
    """
    share = MATTERS - MATTERS_MORE * max(0, len(with_.names) - 2)
    unseen = with_.judging.mean / without.judging.mean
    if not unseen < ALIKE:
        return False
    fitted = with_.train.mean / without.train.mean
    return bool(min(unseen, fitted) < share and unseen * fitted < 1.0)


def fits(without: Hypothesis, with_: Hypothesis) -> bool:
    """Whether an addition has evidence on the runs fitted to alone."""
    return bool(with_.by_run.sum() - with_.cost > without.by_run.sum() - without.cost)


def asks_for_more(h: Hypothesis, floor: Noise) -> bool:
    """Whether a hypothesis leaves something above the noise floor, be it a disturbance or not."""
    return max(h.judging.over(floor), h.train.over(floor)) > CLEAN


def refines(plain: Hypothesis, formed: Hypothesis) -> bool:
    """Whether another form of the same effects brings evidence, lowers an error, and raises none on unseen runs.

    Of unseen and fitted runs either may show what the form is for: what else is still wrong may hide it on the others.
    """
    unseen, fitted = formed.judging.mean / plain.judging.mean, formed.train.mean / plain.train.mean
    return likelier(plain, formed) and unseen < 1.0 and min(unseen, fitted) < REFINES


def likelier(without: Hypothesis, with_: Hypothesis) -> bool:
    """Whether an addition brings evidence, whatever it does to the free run."""
    known = {e.name for e in without.effects}
    own = any(e.nuisance or e.extra_states for e in with_.effects if e.name not in known)
    learned = float(with_.by_run.sum() - without.by_run.sum()) > (LEARNED if own else 0.0)
    return learned and with_.score > without.score


def helps(without: Hypothesis, with_: Hypothesis) -> bool:
    """Whether an addition has evidence at all, on the runs fitted to alone or on all of them."""
    return fits(without, with_) or likelier(without, with_)


def worse_unseen(h: Hypothesis, floor: Noise) -> float:
    """Return the error on unseen runs over that on the runs fitted to; 1 where there are no unseen ones."""
    return h.unseen_errors.over(floor) / max(h.train.over(floor), 1.0) if h.validation else 1.0
