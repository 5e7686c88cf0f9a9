"""A page of the guide on a terminal: links become topics, figures become file names, code keeps its columns."""

from __future__ import annotations

import os.path
import re
from typing import ClassVar

from rich.console import Console, ConsoleOptions, RenderResult
from rich.markdown import CodeBlock, Heading, Markdown, MarkdownElement, Paragraph
from rich.text import Text

from fieldsid.guide import Page, pick_page
from fieldsid.guide.pages import GUIDE, page_of, short_topics

_FENCE = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
_FIGURE = "figure: "
_LINK = re.compile(r"(!?)\[([^\]\n]+)\]\(([^)\s]+)\)")


def rendered(page: Page) -> Markdown:
    """Return a page as rich shows it."""
    return GuideMarkdown(_without_links(page), hyperlinks=False)


class _Code(CodeBlock):
    """A block of code without an indent, only its long lines broken: what a command prints in 80 columns fits 80."""

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        yield Text(str(self.text).rstrip(), style="cyan", overflow="fold")


class _Heading(Heading):
    """A heading at the left, bold, the title underlined."""

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        text = self.text.copy()
        text.stylize("bold underline" if self.tag == "h1" else "bold")
        yield text


class _Paragraph(Paragraph):
    """A paragraph; the path of a figure is never broken, so that it can be copied."""

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        if self.text.plain.startswith(_FIGURE):
            self.text.no_wrap, self.text.overflow = True, "ignore"
        yield from super().__rich_console__(console, options)


class GuideMarkdown(Markdown):
    """Markdown with the guide's own headings, figures and blocks of code."""

    elements: ClassVar[dict[str, type[MarkdownElement]]] = {
        **Markdown.elements,
        "fence": _Code,
        "code_block": _Code,
        "heading_open": _Heading,
        "paragraph_open": _Paragraph,
    }


def _without_links(page: Page) -> str:
    """Return a page's text with each link outside a block of code replaced by what a reader at a terminal can use."""
    text, out, at = page.markdown, [], 0
    for fence in _FENCE.finditer(text):
        out += [_LINK.sub(lambda m: _link_in_words(m, page), text[at : fence.start()]), fence.group()]
        at = fence.end()
    return "".join([*out, _LINK.sub(lambda m: _link_in_words(m, page), text[at:])])


def _link_in_words(link: re.Match[str], page: Page) -> str:
    """Return a link in words: a figure as its file, another page as its topic."""
    is_figure, words, target = link.group(1), link.group(2), link.group(3).partition("#")[0]
    if "://" in target:
        return link.group()
    if not target:
        return words
    path = page.path.parent / target
    if is_figure:
        return f"*{_FIGURE}{words}:* {path}"
    topic = page_of(GUIDE / os.path.relpath(path.resolve(), GUIDE)).topic
    is_named = pick_page(words).topic == topic if words in short_topics() else words == topic
    return f"`{words}`" if is_named else f"{words} (`sysid guide {topic}`)"
