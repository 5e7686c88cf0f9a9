"""sysid guide: the manual, offline: a trial, the theory, every effect and command."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from fieldsid.cli.console import Body, emit
from fieldsid.cli.options import argument

if TYPE_CHECKING:
    from rich.console import Console

    from fieldsid.guide import Page

WIDEST = 100
"""Columns of a page at most: longer lines are hard to read."""
KEEPS_STYLES = "FRX"
"""Options of `less` where the user has set none: show colours, and leave at once where a page fits the screen."""


def command(
    topic: str | None = argument("TOPIC", "A page, such as `trial` or `effects/servo_lag`; the contents if not given.", None),
) -> Body:
    """Show a page of the guide: on a terminal in a pager, else as text.

    The pages are Markdown files that are installed with the program, so that no network is needed. An effect, a command, the code
    of a warning and a parameter can be asked for by its name alone. `--json` gives the list of topics, or the text of one.

    Example: sysid guide effects/servo_lag
    """
    from fieldsid.guide import all_pages, pick_page
    from fieldsid.results.trial import Contents, Title, Topic

    page = pick_page(topic or "index")
    contents = Contents(tuple(Title(p.topic, p.title) for p in all_pages().values()))
    result = contents if topic is None else Topic(page.topic, page.title, str(page.path), page.text)
    return emit(result, render=lambda to: _show(to, page))


def _show(to: Console, page: Page) -> None:
    from fieldsid.cli.help.markdown import rendered

    if not to.is_terminal:
        to.print(rendered(page), crop=False)
        return
    os.environ.setdefault("LESS", KEEPS_STYLES)
    with to.pager(styles=True):
        to.print(rendered(page), width=min(to.width, WIDEST), crop=False)
