"""The program: it finds the command and runs it. Errors are caught here alone, and become exit codes."""

from __future__ import annotations

import atexit
import gc
import os
import sys
from typing import TYPE_CHECKING, Any

from fieldsid.cli.exit_codes import DONE, INTERRUPTED
from fieldsid.runtime.interrupts import heed_interrupts, meet_interrupt
from fieldsid.runtime.streams import have_streams

if TYPE_CHECKING:
    from collections.abc import Sequence
    from typing import Never

    from fieldsid.cli.session import Session

# Before NumPy is loaded: the systems solved here are tiny, and threads that wait for a busy core cost ten times the work.
for _threads in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(_threads, "1")
# Figures are drawn with matplotlib's own settings and ours.
os.environ.setdefault("MATPLOTLIBRC", os.devnull)

JOURNAL = "journal.jsonl"
"""The file that marks a trial folder, named as in `fieldsid/trial_folder/journal.py`, whose imports would cost time here."""
GC_THRESHOLD = 50_000
"""Objects allocated between two runs of the garbage collector. Imports and compilation allocate millions that stay: at
Python's own threshold the collector takes a fifth of the time of compiling, a twentieth of a tour."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command line and return its exit code; data go to stdout, all else to stderr."""
    try:
        return _run_guarded(list(sys.argv[1:] if argv is None else argv))
    finally:
        _reset_voice()


def _run_guarded(arguments: list[str]) -> int:
    """Run one command line and return its exit code; every error is printed."""
    raised: Exception | None = None
    try:
        code = _dispatch(arguments)
        sys.stdout.flush()
    except KeyboardInterrupt:
        return _interrupted()
    except BrokenPipeError:
        # The reader went away (`| head`): point stdout elsewhere so that the interpreter's last flush is quiet.
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        code = DONE
    except Exception as error:  # noqa: BLE001 - the one boundary: every error becomes a message and an exit code
        if meet_interrupt():  # the error is a consequence of the interrupt
            return _interrupted()
        from fieldsid.cli.failure import explain

        code, raised = explain(error, arguments), error
    _warn_of_refused(raised)
    return code


def _interrupted() -> int:
    meet_interrupt()
    sys.stderr.write("interrupted\n")
    return INTERRUPTED


def entry() -> Never:
    """Run the command line of this process and end it."""
    gc.set_threshold(GC_THRESHOLD)
    heed_interrupts()
    can_answer = have_streams()
    codes: list[int] = []
    atexit.register(_end, codes)  # the first one registered is called last
    codes.append(main() if can_answer else _refuse_closed_output())
    sys.exit(codes[0])


def _refuse_closed_output() -> int:
    from fieldsid.cli.failure import explain
    from fieldsid.errors import UsageError

    hint = "leave it open, or send the result to a file: `> result.txt`"
    return explain(UsageError("standard output is closed", found="no place for the result", hint=hint), ())


def _end(codes: list[int]) -> None:
    """End the process without freeing its memory piece by piece, which takes half a second for compiled code."""
    try:
        sys.stdout.flush()
        sys.stderr.flush()
    except OSError:  # Python reports what could not be written
        return
    for code in codes:
        os._exit(code)


def run(arguments: Sequence[str], session: Session | None = None) -> Any:
    """Run one command in this process and return its result; session: what it shares with the other commands of a tour.

    Raises UsageError for an unknown command, KeyboardInterrupt, BrokenPipeError where the reader of the output has gone away,
    and whatever the command raises.
    """
    from fieldsid.cli.programs import program_of

    program, words, name = program_of(arguments)
    from fieldsid.cli.console import heard
    from fieldsid.cli.headlines.typed import remember
    from fieldsid.cli.session import in_session
    from fieldsid.cli.user_effects import load_own_effects

    remember(arguments)
    if "--help" not in arguments:
        load_own_effects()
    try:
        with in_session(session), heard():
            result = program(words, prog_name=name, standalone_mode=False)
    except SystemExit as end:
        if isinstance(end.__context__, BrokenPipeError):  # typer has turned it into an exit
            raise end.__context__ from None
        raise
    if result == INTERRUPTED:  # typer has turned it into a number
        raise KeyboardInterrupt
    return result


def _dispatch(arguments: list[str]) -> int:
    """Answer `--help`, `--version` and `--install-completion`, or run the command, in a trial folder with its journal."""
    if not arguments or arguments[0] in {"--help", "-h", "help"}:
        from fieldsid.cli.help.catalogue import entries
        from fieldsid.cli.help.help_page import front_page

        sys.stdout.write(front_page(entries()))
        return DONE
    if arguments[0] in {"--version", "-V"}:
        from fieldsid._version import __version__

        sys.stdout.write(f"fieldsid {__version__}\n")
        return DONE
    if arguments[0] == "--install-completion":
        from fieldsid.cli.help.completion import install

        sys.stdout.write(install(arguments[1:]))
        return DONE
    from fieldsid.cli.voice import command_first, take

    ordered = command_first(arguments)
    if ordered != list(arguments):
        return _dispatch(ordered)
    arguments = take(arguments)
    _enter_folder()
    is_link = os.path.islink(JOURNAL)  # noqa: PTH114 - no import
    if is_link:
        from fieldsid.cli.console import say

        say(f"warning: `{JOURNAL}` is a symbolic link: it is neither read nor written, and this folder is no trial [journal]")
    if os.path.isfile(JOURNAL) and not is_link:  # noqa: PTH113 - no import
        from fieldsid.cli.trial.journaled import run_in_trial

        result = run_in_trial(arguments, run)
    else:
        result = run(arguments)
    return result if isinstance(result, int) else DONE


def _enter_folder() -> None:
    """Raise UsageError where the working folder is gone; load matplotlib from elsewhere where it would read a file of it."""
    try:
        os.getcwd()  # noqa: PTH109 - no import
    except OSError as error:
        from fieldsid.errors import UsageError

        found = os.environ.get("PWD", "no folder")
        raise UsageError("the working folder is no longer there", found=found, hint="`cd` to one that is") from error
    if os.path.lexists("matplotlibrc"):  # matplotlib cannot be told to ignore it
        from contextlib import chdir
        from importlib import import_module

        with chdir(os.path.dirname(__file__)):  # noqa: PTH120 - no import
            import_module("fieldsid.figures.canvas")


def _reset_voice() -> None:
    """Reset the voice, so that `--quiet` and `--deg` of this command line do not apply to the next one of the process."""
    if "fieldsid.cli.voice" in sys.modules:
        from fieldsid.cli.voice import take

        take(())


def _warn_of_refused(raised: Exception | None) -> None:
    """Print at the end of a command which effects and plug-ins were not used and why, without the error raised already."""
    if "fieldsid.registry" not in sys.modules:
        return
    from fieldsid.registry import refused

    errors = refused()
    if errors:
        from fieldsid.cli.failure import tell_refused

        tell_refused(errors, raised)
