"""What is few: the names that a message lists, and the shares and numbers of samples by which the rules about a log decide."""

from __future__ import annotations

from collections.abc import Sequence

SHOWN = 12
MOSTLY = 0.5
"""A column, a table or a signal is of a kind if more than this share of it is."""
NEARLY_ALL = 0.9
"""Smallest share of the samples that must follow a rule for it to hold; it is below one because a damaged log has exceptions."""
FEW = 0.05
"""Largest share of the samples that are exceptions, such as missing ones or words, and no property of the signal."""
FEWEST = 10
"""Smallest number of events from which a share or an interval is estimated: by counting ten it is known to a third."""


def few_of(names: Sequence[str]) -> str:
    """Return the names joined by commas, at most the first SHOWN of them."""
    return ", ".join(names[:SHOWN]) + ", ..." * (len(names) > SHOWN)
