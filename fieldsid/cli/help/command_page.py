"""The page of help of one command: its options in groups, its examples on lines that can be pasted."""

from __future__ import annotations

from typing import Any

from typer.core import TyperCommand

from fieldsid.cli.options import ANSWER, GROUPS
from fieldsid.cli.voice import HAS_OWN_V, SAYS, VERBOSE

EXAMPLE = "Example: "
OTHERS = "Options"


class CommandPage(TyperCommand):
    """A command whose page lists its options by group: first the groups that only it has, then those of GROUPS in order."""

    def format_help_text(self, ctx: Any, formatter: Any) -> None:  # noqa: ARG002 - the parser's own signature
        """Write the text: paragraphs are filled, and each example is one line however long."""
        for paragraph in (self.help or "").split("\n\n"):
            words = " ".join(paragraph.split())
            formatter.write_paragraph()
            with formatter.indentation():
                if words.startswith(EXAMPLE):
                    formatter.write(f"{'':>{formatter.current_indent}}{words}\n")
                else:
                    formatter.write_text(words)

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write the arguments, then each group of options."""
        groups: dict[str, list[tuple[str, str]]] = {}
        for param in self.get_params(ctx):
            if (record := param.get_help_record(ctx)) is not None:
                default_group = "Arguments" if param.param_type_name == "argument" else ANSWER if param.name == "help" else OTHERS
                groups.setdefault(getattr(param, "rich_help_panel", None) or default_group, []).append(record)
        has_own_v = ctx.info_name in HAS_OWN_V
        first, *others = ((n, says) for n, says in SAYS.items() if not (has_own_v and n == VERBOSE))
        groups[ANSWER] = [first, *groups[ANSWER], *others]
        for title in sorted(groups, key=lambda name: GROUPS.index(name) if name in GROUPS else -1):
            with formatter.section(title):
                formatter.write_dl(groups[title])
