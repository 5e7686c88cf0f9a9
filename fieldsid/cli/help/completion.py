"""`sysid --install-completion`: commands and options by the tabulator key, for bash, zsh and fish.

The script contains the list of commands and options, so that a completion does not wait for Python.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from fieldsid.artifacts import write_text
from fieldsid.cli.help.catalogue import entries
from fieldsid.cli.voice import JSON
from fieldsid.errors import UsageError

PROGRAMS = ("sysid", "fieldsid")
PLACES: Mapping[str, str] = {
    "bash": ".local/share/bash-completion/completions/sysid",
    "zsh": ".zfunc/_sysid",
    "fish": ".config/fish/completions/sysid.fish",
}
AFTERWARDS: Mapping[str, str] = {
    "bash": "open a new shell, or `source {path}`",
    "zsh": "once: add `fpath+=~/.zfunc; autoload -Uz compinit && compinit` to ~/.zshrc; then open a new shell",
    "fish": "open a new shell",
}


def install(arguments: Sequence[str]) -> str:
    """Write the completion script of the named shell, or of the one in use, and return what to do next.

    Raises UsageError for a shell that is not known.
    """
    shell = arguments[0] if arguments else Path(os.environ.get("SHELL", "")).name
    if shell not in PLACES:
        hint = "name one: `sysid --install-completion bash`, `zsh` or `fish`"
        raise UsageError(
            f"there is no completion for the shell `{shell or 'unknown'}`", found=os.environ.get("SHELL", ""), hint=hint
        )
    path = write_text(Path.home() / PLACES[shell], script(shell), force=True)
    return f"completion for {shell} written to `{path}`\nnext: {AFTERWARDS[shell].format(path=path)}\n"


def script(shell: str) -> str:
    """Return the completion script of a shell."""
    return {"bash": _bash, "zsh": _zsh, "fish": _fish}[shell](options())


def options() -> dict[str, tuple[str, ...]]:
    """Return the options of every command, and the subcommands of those that have some."""
    import typer

    from fieldsid.cli.programs import program_of

    found = {}
    for name in entries():
        command: Any = typer.main.get_command(program_of([name])[0])
        subcommands = command.commands[name].commands if hasattr(command, "commands") else {}
        known = {
            o
            for c in subcommands.values() or [command]
            for p in c.params
            for o in (*p.opts, *p.secondary_opts)
            if o.startswith("-")
        }
        found[name] = (*subcommands, *sorted({*known, JSON}), "--help")
    return found


def _bash(known: Mapping[str, Sequence[str]]) -> str:
    cases = "\n".join(f'    {name}) words="{" ".join(words)}" ;;' for name, words in known.items())
    return f"""# completion of sysid; written by `sysid --install-completion bash`
_sysid() {{
  local here="${{COMP_WORDS[COMP_CWORD]}}" words=""
  if [ "$COMP_CWORD" -eq 1 ]; then
    COMPREPLY=($(compgen -W "{" ".join(known)} --help --version" -- "$here"))
    return
  fi
  case "${{COMP_WORDS[1]}}" in
{cases}
  esac
  COMPREPLY=($(compgen -W "$words" -- "$here") $(compgen -f -- "$here"))
}}
complete -o filenames -F _sysid {" ".join(PROGRAMS)}
"""


def _zsh(known: Mapping[str, Sequence[str]]) -> str:
    cases = "\n".join(f"    {name}) compadd -- {' '.join(words)} ;;" for name, words in known.items())
    return f"""#compdef {" ".join(PROGRAMS)}
# completion of sysid; written by `sysid --install-completion zsh`
if (( CURRENT == 2 )); then
  compadd -- {" ".join(known)} --help --version
else
  case "$words[2]" in
{cases}
  esac
  _files
fi
"""


def _fish(known: Mapping[str, Sequence[str]]) -> str:
    lines = ["# completion of sysid; written by `sysid --install-completion fish`"]
    for program in PROGRAMS:
        for name, words in known.items():
            lines.append(f"complete -c {program} -n __fish_use_subcommand -a {name}")
            longs = [w.removeprefix("--") for w in words if w.startswith("--")]
            lines += [f"complete -c {program} -n '__fish_seen_subcommand_from {name}' -l {w}" for w in longs]
            subs = [w for w in words if not w.startswith("-")]
            lines += [f"complete -c {program} -n '__fish_seen_subcommand_from {name}' -a {w}" for w in subs]
    return "\n".join(lines) + "\n"
