"""The message of an error: its three parts on stderr or, for a bug of the program, the file with the trace."""

from __future__ import annotations

import errno
import json
import os
import shlex
import sys
import tempfile
import traceback
from collections.abc import Sequence
from pathlib import Path

import typer

from fieldsid._version import __version__
from fieldsid.cli.exit_codes import BAD_INPUT, INTERRUPTED, OUR_BUG
from fieldsid.cli.help.command_page import EXAMPLE
from fieldsid.errors import FULL, MAKE_ROOM, FieldsidError, UsageError

CLOSED = (errno.EACCES, errno.EPERM, errno.EROFS, errno.ENAMETOOLONG, errno.ELOOP, errno.ENOTDIR, errno.EISDIR, errno.EIO)
"""Error numbers for a path that cannot be read or written."""


def explain(error: Exception, arguments: Sequence[str]) -> int:
    """Print an error on stderr and return its exit code."""
    if isinstance(error, typer.Abort):
        sys.stderr.write("interrupted\n")
        return INTERRUPTED
    if isinstance(error, typer.TyperException):
        error = _as_usage(error, arguments)
    if isinstance(error, OSError) and error.errno in FULL:
        error = _as_full(error)
    if isinstance(error, OSError) and error.errno in CLOSED and error.filename:
        error = UsageError(f"`{error.filename}` cannot be reached: {error.strerror}", hint="check the path and its permissions")
    if isinstance(error, FieldsidError):
        sys.stderr.write(f"error: {error}\n")
        _print_json(arguments, BAD_INPUT, error.what, error.found, error.hint)
        return BAD_INPUT
    trace, said = _save_trace(error, arguments), f"this is a bug of fieldsid: {type(error).__name__}: {error}"
    _print_json(arguments, OUR_BUG, said, f"the trace is in `{trace}`")
    bug = FieldsidError(said, found=f"the trace is in `{trace}`", hint="send us that file with the log that caused it")
    sys.stderr.write(f"error: {bug}\n")
    return OUR_BUG


def tell_refused(errors: Sequence[FieldsidError], raised: Exception | None) -> None:
    """Print on stderr which effects and plug-ins were not used and why, without the one whose error was raised already."""
    printed = _with_causes(raised)
    for error in errors:
        if not any(error is one for one in printed):
            what, found, hint = error.shown
            below = (f"\n  {word}: {said}" if said else "" for word, said in (("found", found), ("hint", hint)))
            sys.stderr.write(f"warning: {what}; it takes no part{''.join(below)}\n")


def _with_causes(error: BaseException | None) -> list[BaseException]:
    """Return an error and its causes, each once: errors raised from one another form a cycle."""
    found: list[BaseException] = []
    while error is not None and not any(error is one for one in found):
        found.append(error)
        error = error.__cause__
    return found


def _print_json(arguments: Sequence[str], code: int, what: str, found: str, hint: str = "") -> None:
    """Print an error on stdout as one JSON object, with `--json`: its reader always gets an object."""
    if "--json" in arguments:
        body = {"schema": "fieldsid/error/1", "exit_code": code, "what": what, "found": found, "hint": hint}
        try:
            sys.stdout.write(json.dumps(body) + "\n")
            sys.stdout.flush()
        except OSError:  # standard output is the cause of the error, which stderr has reported
            return


def _as_usage(error: typer.TyperException, arguments: Sequence[str]) -> UsageError:
    """Give an error of the option parser our three parts; its own sentence already names the option."""
    unknown = getattr(error, "option_name", None) if hasattr(error, "possibilities") else None
    said = error.format_message() if unknown is None else f"no such option: {unknown}"
    words = " ".join(said.split()).removesuffix(".").replace("Value error, ", "")  # pydantic's own words
    context = getattr(error, "ctx", None)
    path = context.command_path if context is not None else f"sysid {arguments[0]}"
    words, hint = words[:1].lower() + words[1:], f"see `{path} --help`"
    if unknown is not None and context is not None:
        from fieldsid.cli.help.meant_option import meant_by

        meant = meant_by(unknown, context)
        hint = f"did you mean {meant}? {hint}" if meant else hint
    if words.startswith("missing argument"):
        from fieldsid.cli.trial.filled import FILLS
        from fieldsid.trial_folder.journal import is_trial

        if is_trial(Path()) and path.removeprefix("sysid ") in FILLS:
            return _not_given(words, arguments, path.removeprefix("sysid "))
        hint = f"{_example(context)}{hint}"
    return UsageError(words, found=shlex.join(["sysid", *arguments]), hint=hint)


def _example(context: typer.Context | None) -> str:
    """Return the example on a command's page of help, as the beginning of a hint."""
    _, is_there, line = ("" if context is None else context.command.help or "").partition(EXAMPLE)
    return f"`{line.splitlines()[0]}`, or " if is_there else ""


def _not_given(words: str, arguments: Sequence[str], command: str) -> UsageError:
    """Return the error for an argument that the trial folder should supply and lacks; the hint is the command that makes it."""
    from fieldsid.trial_folder.next_step import step_before
    from fieldsid.trial_folder.state import state_of

    why, line = step_before(command, state_of(Path()))
    hint = f"{why}: `{line}`" if line else f"{why}: `sysid status` lists what is there"
    return UsageError(f"{words}, and the trial folder does not give it", found=shlex.join(["sysid", *arguments]), hint=hint)


def _as_full(error: OSError) -> UsageError:
    """Return the error for a full disk; the file that was being written is not left behind."""
    where = f"`{error.filename}`" if error.filename else "standard output, or the folder for temporary files"
    return UsageError("there is no room left to write", found=f"{where}: {error.strerror}", hint=MAKE_ROOM)


def _save_trace(error: Exception, arguments: Sequence[str]) -> Path:
    handle, name = tempfile.mkstemp(prefix="fieldsid-trace-", suffix=".txt")
    head = f"fieldsid {__version__}\nPython {sys.version}\n{shlex.join(['sysid', *arguments])}\n\n"
    with os.fdopen(handle, "w", encoding="utf-8", errors="backslashreplace") as stream:
        stream.write(head + "".join(traceback.format_exception(error)))
    return Path(name)
