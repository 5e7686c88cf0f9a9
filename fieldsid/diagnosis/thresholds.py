"""The thresholds that decide a diagnosis, each with its unit; other constants in this package concern the numerics only.

Log odds are natural logarithms, p probabilities; an error ratio is a free-run error over another, or over the noise floor. The
effect of 20 % more or less of each is printed by `python tests/benchmarks/threshold_sensitivity.py`, on cases of the repository's
bank and, where its folder is given, of an independent one.
"""

from __future__ import annotations

from math import exp

from fieldsid.comparison import sufficient

# ----- prior odds

ALTERNATIVE_LOG_ODDS = 6.0
"""Log odds, 400 to 1. Prior against one effect of the catalogue, one variant other than the textbook's, another kind of noise, or
another speed law than the usual, since dozens of each are tried. An effect pays it EVIDENCE_TEMPERATURE times in the log
evidence, which is divided by that before it becomes a probability, because a prior, unlike the evidence, is not overstated. A
variant pays it once, since an effect has few. On cases of the second bank this removed a superfluous effect in five, and a true
second effect in two."""
RIVAL_LOG_ODDS = 3.0
"""Log odds, 20 to 1. Two models within it are rivals, and a maneuver is proposed where it is expected to give more."""
RIVAL_PROBABILITY_RATIO = exp(-RIVAL_LOG_ODDS)
"""The same as a ratio of two probabilities."""
EVIDENCE_TEMPERATURE = 2.0
"""Divisor of the log evidence before it becomes a probability: the evidence of models that are never exact is overstated."""
UNTRIED_LEAST, UNTRIED_MOST, UNTRIED_POWER = 0.005, 0.6, 3.0
"""Probability that the effects of the vehicle are in no set tried: UNTRIED_MOST times the power UNTRIED_POWER of the share of the
remaining squared error that is not noise, and never less than UNTRIED_LEAST. Of 242 verdicts on all three banks 1 of 181 was
wrong where fitted and unseen runs were left within 1.15 x the noise, 3 of 43 up to 1.6 x, 2 of 5 up to 2.5 x, 6 of 13 above."""
MISFIT_SHARE = 0.06
"""Error that the right effects leave beyond the noise, as a share of the base's: no hull is quite the model's, and a sea moves
it. Good sensors show it: with a twentieth of the usual noise, right sets that leave more than 4 x the noise left 0.04 to 0.18 of
the base's error in seven cases of the second bank. Sets named for a cause in no catalogue left 0.38 to 0.67 in five cases of all
three banks."""
MIN_TRAINING_GAIN = 4.0
"""Log likelihood on the training runs that an effect with nuisance parameters of each run must gain. On validation runs those
parameters are fitted too, so that a gain there alone proves nothing. An effect without them may gain on validation runs only."""

# ----- what counts as a lower error

MAX_ERROR_RATIO = 0.92
"""Error ratio that an addition must reach: a significant effect need not be important. Speed, trim and clock of a real vehicle
always differ a little from the model's, which leaves a few percent of the noise."""
EQUAL_ERROR_RATIO = 1.03
"""Error ratio up to which two models predict equally well."""

# ----- errors over the noise floor

EXPLAINED_ERROR_RATIO = 1.02
"""Error over the floor up to which the error counts as noise."""
SUFFICIENT_ERROR_RATIO = sufficient.SUFFICIENT_ERROR_RATIO
"""Error over the floor below which the model is sufficient; all commands use this limit."""
MISSING_ERROR_RATIO = 1.5
"""Error over the floor above which something is missing, even where no effect in its textbook variant gains evidence; above which
a fit may be at a local minimum; and which the right effect rarely leaves."""
GUSTY_ERROR_RATIO = 2.0
"""Error over the floor below which only dependence on the motion separates an effect from a disturbance, since gusts are bursts
too."""
MAX_VALIDATION_ERROR_RATIO = 2.0
"""Validation error over training error above which something besides a disturbance is missing: a disturbance is equal on both."""
MIN_BASE_ERROR_SHARE = 0.02
"""Smallest noise under which models are compared, as a share of the base model's error. A filtered log shows almost no noise;
then the smallest inconsistency of its sensors would outweigh everything the base model fails to follow. In 112 cases of two banks
the base model leaves at most 33 times the noise of a channel; in an aircraft's filtered pitch 83 and 154 times, in the log of a
ship model in a tank thousands."""
MIN_COLOUR_RATIO = 0.5
"""Coloured over white sensor noise above which the reported floor includes the coloured part."""

# ----- the error that may remain with a named effect

MIN_P_VALUE = 2e-2
"""p below which the residuals are not a disturbance."""
COLOUR_P_EXPONENT = 0.2
"""Exponent of the p-value of whiteness: the model's disturbance has one time constant, a real sea a broader spectrum."""
MIN_EXPLAINED_SHARE = 0.7
"""Share of the excess error below which a search continues, because the effects found are not all that is missing."""
LEAST_EXPLAINED_SHARE = 0.3
"""Share of the excess error that must be explained on the validation runs alone, near the noise: an effect acts in all runs. Of
20 effects that count there, in cases of three seeds of the second bank, 18 explain 0.58 or more of it, a true lag of a sample
0.28, and a step in runs without one 0.10."""
MAIN_EXPLAINED_SHARE = 0.5
"""Smallest share of the excess error that an effect must explain, so that it explains more than it leaves. It is required in
three cases: where an error near the noise floor cannot fall to MAX_ERROR_RATIO while the base, or the model without the effect in
some run, leaves a visible one; in logs without noise, where every residual is significant, so that p-values decide nothing; and
of a model that leaves an error above MISSING_ERROR_RATIO, whatever the tests say. Of 702 cases of the second bank three would
name an effect below it: two a lag of 20 ms together with a moment in no catalogue, and one half of a pair that alone lowered
nothing."""
BELIEVED_SHARE_OF_MISFIT = 0.2
"""Smallest ratio of the excess squared error that an effect explains to the excess that remains with it. Of 29 correctly named
effects in cases of all three banks one had a ratio below 0.4; of nine wrongly named ones four had a ratio below 0.3."""
