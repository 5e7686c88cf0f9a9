"""The option of a command that was meant by one that it does not have: how it begins, in other words, or mistyped."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import typer

from fieldsid.registry import similar

OTHER_WORDS: Mapping[str, frozenset[str]] = MappingProxyType(
    {option: frozenset(words.split()) for option, words in {
        "--add": "effect effects with",
        "--axis": "plane axes dof",
        "--effects": "effect with add",
        "--fin-max": "rudder rudder-limit max-rudder elevator-max max-elevator max-fin deflection",
        "--figure": "plot graph image fig",
        "--figures": "plot plots graphs images fig",
        "--force": "overwrite replace yes",
        "--from": "start begin since",
        "--join": "merge",
        "--joint": "together pooled",
        "--mapping": "config columns signals",
        "--measured": "circle circles turn turns",
        "--output": "dest destination dir directory folder save",
        "--run": "log runs",
        "--runs": "log logs run",
        "--speed": "velocity surge",
        "--speeds": "velocity velocities surge",
        "--to": "target format kind end stop until",
        "--validate": "test holdout hold-out unseen verify",
        "--whole": "all full",
        "--workers": "jobs threads processes cores",
        "--write": "apply inplace in-place",
    }.items()}
)  # fmt: skip
"""What other programs call options of ours."""


def meant_by(option: str, context: typer.Context) -> str:
    """Return the options that may be meant by one that a command does not have, each with what it is; empty without one."""
    known = {name: p for p in context.command.params for name in p.opts if name.startswith("--")}
    word = option.lower().replace("_", "-").lstrip("-")
    found = [name for name in known if len(word) > 1 and name.startswith(f"--{word}")]
    found += [name for name, words in OTHER_WORDS.items() if name in known and word in words]
    found = found or similar(f"--{word}", known)
    return " or ".join(_shown(name, known[name]) for name in dict.fromkeys(found))


def _shown(name: str, option: object) -> str:
    """Return an option with its value, and the first sentence of its help in brackets."""
    value, said = getattr(option, "metavar", None), str(getattr(option, "help", None) or "")
    sentence = said.removesuffix(".")
    return f"`{name}{f' {value}' if value else ''}`" + (f" ({sentence[:1].lower()}{sentence[1:]})" if sentence else "")
