"""A trial walked as by a tired person: each `next:` is pasted where it was printed, each hint tried in a copy of the folder."""

from __future__ import annotations

import os
import re
import shlex
import shutil
from collections.abc import Callable, Iterator
from contextlib import chdir
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

NEXT = re.compile(r"^next: (.+)$", re.MULTILINE)
SNIPPET = re.compile(r"`(sysid [^`]+)`|^hint: (sysid .+)$", re.MULTILINE)
NOT_TO_PASTE = re.compile(r"\b[A-Z]{2,}\b|<|--help|sysid (guide|effects new|init|demo)")
FLIGHT = re.compile(r"sysid live .*--udp|python -m webbrowser")
"""Where a walk in a laptop ends: at sea, and in a browser."""
MOST_STEPS = 30


@dataclass
class Walk:
    """Steps taken: each command line with its exit code and what it printed, and the hints that were tried."""

    run: Callable[..., Any]
    steps: list[str] = field(default_factory=list)
    tried: dict[str, str] = field(default_factory=dict)
    tell: Callable[[str], None] = lambda _line: None

    def until_done(self, first: str = "sysid status") -> None:
        """Follow `next:` from a command on until `status` has nothing more to say; fails on a circle and on a failing line."""
        line = first
        while line != "":
            line = self.paste(line)
            if line == "" or FLIGHT.search(line):
                line = self.paste("sysid status")
            assert len(self.steps) < MOST_STEPS, "\n".join(self.steps)

    def paste(self, line: str) -> str:
        """Run a line, and its hints in a copy of the folder; return what it says is next."""
        self.tell(f"$ {line}")
        assert line == "sysid status" or line not in self.steps, f"in a circle: {line}\n" + "\n".join(self.steps)
        self.steps.append(line)
        out, err = self._run(line)
        for hint in dict.fromkeys(a or b for a, b in SNIPPET.findall(out + err)):
            names_a_command = len(hint.split()) == 2 and not Path("journal.jsonl").exists()  # and is no line, but in a trial
            if hint not in self.tried and not names_a_command and not NOT_TO_PASTE.search(hint) and not FLIGHT.search(hint):
                self.tried[hint] = line
                self._try(hint)
        found = NEXT.search(out)
        return found[1] if found else ""

    def _try(self, hint: str) -> None:
        here, copy = Path.cwd(), Path.cwd().with_name(f"{Path.cwd().name}_copy")
        self.tell(f"  hint $ {hint}")
        shutil.copytree(here, copy)
        try:
            with chdir(copy):
                self._run(hint)
        finally:
            shutil.rmtree(copy)

    def _run(self, line: str) -> tuple[str, str]:
        out = err = ""
        for words in _commands(line):
            answer = self.run(*words)
            out, err = out + answer.out, err + answer.err
            self.tell("\n".join(f"    {said}" for said in [*answer.out.splitlines()[:3], *answer.err.splitlines()]))
            assert answer.code in (0, 1), f"{line}: exit {answer.code}\n{answer.err}\nafter:\n" + "\n".join(self.steps)
        return out, err


def _commands(line: str) -> Iterator[list[str]]:
    """Yield the words of each command of a line, patterns as a shell would have them."""
    for part in line.split(" && "):
        program, *words = shlex.split(part)
        if program == "cd":
            os.chdir(*words)
            continue
        assert program == "sysid", line
        yield [w for word in words for w in (sorted(map(str, Path().glob(word))) if "*" in word else [word])]
