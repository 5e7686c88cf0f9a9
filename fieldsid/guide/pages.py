"""Pages of the guide by topic: `trial` is trial.md, `effects/servo_lag` a page in a folder, `effects` the folder's index.md."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from fieldsid.errors import UsageError
from fieldsid.registry import near

GUIDE = Path(__file__).resolve().parent
INDEX = "index"
READING_ORDER = (
    INDEX, "trial", "mapping", "theory", "effects", "commands", "parameters", "codes", "figures", "python", "extending", "limits",
    "measured", "schemas",
)  # fmt: skip
"""Topics at the top, in the order of reading; the pages of a folder follow its index in the order of their names."""
SHORT_IN = ("effects", "commands")
"""Folders whose pages can be asked for by their own name alone."""
SECTIONS_OF = ("codes", "parameters")
"""Pages whose sections can be asked for by the name that is their heading."""
_SECTION = re.compile(r"^## (.+?)\n(.*?)(?=^## |\Z)", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True, slots=True)
class Page:
    """One page: its topic, its title, the file that holds it (Markdown, or a JSON schema), and the section of it that it is."""

    topic: str
    title: str
    path: Path
    section: str = ""

    @property
    def text(self) -> str:
        """The file's text, or that of the section under its own title."""
        text = self.path.read_text(encoding="utf-8")
        return f"# {self.section}\n{_sections(text)[self.section]}" if self.section else text

    @property
    def markdown(self) -> str:
        """The page as Markdown: a JSON schema as a block of code under its title."""
        return f"# {self.title}\n\n```json\n{self.text.rstrip()}\n```\n" if self.path.suffix == ".json" else self.text


@cache
def all_pages() -> dict[str, Page]:
    """Return every page by topic, in the order of reading."""
    found = [page_of(p) for p in GUIDE.rglob("*") if p.suffix in {".md", ".json"}]
    return {p.topic: p for p in sorted(found, key=lambda p: (READING_ORDER.index(p.topic.partition("/")[0]), p.topic))}


def page_of(path: Path) -> Page:
    """Return the page that a file of the guide holds; raises ValueError where its folder is not in READING_ORDER."""
    parts = path.relative_to(GUIDE).with_suffix("").parts
    topic = "/".join(parts[:-1] if parts[-1] == INDEX and len(parts) > 1 else parts)
    if parts[0] not in READING_ORDER:
        raise ValueError(f"{path} is in no known part of the guide")
    if path.suffix == ".json":
        return Page(topic, str(json.loads(path.read_text(encoding="utf-8"))["title"]), path)
    with path.open(encoding="utf-8") as stream:
        return Page(topic, stream.readline().lstrip("# ").strip(), path)


def _sections(text: str) -> dict[str, str]:
    return {name.strip("`"): body for name, body in _SECTION.findall(text)}


@cache
def sections() -> dict[str, Page]:
    """Return what every warning's code and every parameter is about, by its name."""
    pages = [all_pages()[topic] for topic in SECTIONS_OF]
    return {name: Page(f"{page.topic}/{name}", name, page.path, name) for page in pages for name in _sections(page.text)}


@cache
def short_topics() -> set[str]:
    """Return the names that stand for a page by themselves: those of effects and of commands, of codes and parameters."""
    parts = [topic.partition("/") for topic in all_pages()]
    return {name for folder, _, name in parts if folder in SHORT_IN and name} | sections().keys()


def pick_page(topic: str) -> Page:
    """Return the page of a topic, or of an effect, a command, a warning's code or a parameter by its own name.

    Raises UsageError naming the near ones.
    """
    parts = sections()
    known = {**{page.topic: page for page in parts.values()}, **all_pages()}
    for name in (topic, *(f"{folder}/{topic}" for folder in (*SHORT_IN, *SECTIONS_OF))):
        if name in known:
            return known[name]
    top = ", ".join(t for t in known if "/" not in t)
    raise UsageError(
        f"the guide has no topic {topic!r}",
        found=f"{top}, and a page of its own for every effect, command, code of a warning and parameter",
        hint=near(topic, [*known, *short_topics()]),
    )
