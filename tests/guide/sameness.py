"""Whether what was printed once is what is printed now: words alike, numbers but for what another processor makes of them."""

from __future__ import annotations

import re
from difflib import unified_diff
from itertools import islice

NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?![\w.]*[a-f]\d)")
HASH = re.compile(r"\b[0-9a-f]{12}(?:[0-9a-f]{52})?\b")
SECONDS = re.compile(r"took [0-9.]+ s\b")
DATE = re.compile(r"\b\d{4}-\d\d-\d\d \d\d:\d\d\b")
SHARE = 0.02
"""Share by which two numbers may differ; besides, one and a half units of the last decimal that both have."""
ELIDED = "[...]"
MOST_LINES = 30


def parts_of(text: str) -> tuple[list[str], list[str]]:
    """Return a text's words between its numbers, blanks made one, and its numbers; hashes, run times and dates are all alike."""
    text = " ".join(DATE.sub("some day", SECONDS.sub("took some time", HASH.sub("SHA-256", text))).split())
    return [w.strip() for w in NUMBER.split(text)], NUMBER.findall(text)


def same(was: str, now: str) -> bool:
    """Whether two texts have the same words, and numbers that differ no more than a last bit makes them."""
    (words, numbers), (words_now, numbers_now) = parts_of(was), parts_of(now)
    return words == words_now and all(near(a, b) for a, b in zip(numbers, numbers_now, strict=True))


def difference(was: str, now: str) -> str:
    """Return what to do about two texts that are not the same, and the lines that differ."""
    lines = unified_diff(was.splitlines(), now.splitlines(), "as it is", "as it would be", lineterm="", n=0)
    return "\n".join(["the guide is stale: run .ci/docs, and look at what changed", *islice(lines, MOST_LINES)])


def near(a: str, b: str) -> bool:
    """Whether two printed numbers are the same but for rounding."""
    decimals = min(len(v.partition(".")[2].partition("e")[0]) for v in (a, b))
    x, y = float(a), float(b)
    return abs(x - y) <= max(SHARE * max(abs(x), abs(y)), 1.5 * 10.0**-decimals if "." in a else 0.0)


def shortened(like: str, text: str) -> str:
    """Return a text with as many lines kept before and after `[...]` as another one has; the whole where that has none."""
    lines = like.splitlines()
    if ELIDED not in lines:
        return text
    at = lines.index(ELIDED)
    every, after = text.splitlines(), len(lines) - at - 1
    return "\n".join([*every[:at], ELIDED, *every[len(every) - after :]])
