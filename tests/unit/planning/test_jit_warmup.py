"""What planning compiles ahead is what it calls."""

from __future__ import annotations

import subprocess
import sys

AGAIN = """
from fieldsid.planning import jit_warmup
from fieldsid.planning.flight.rule_flight import closed_loop
doors = (closed_loop,)
jit_warmup.compile_planning()
known = [d.signatures for d in doors]
from fieldsid.cli.app import run
run(["plan", "--axis", "yaw", "--speeds", "1.4", "--json"])
print([len(d.signatures) for d in doors] == [len(k) for k in known] == [1] * len(doors))
"""


def test_a_plan_compiles_nothing_more():
    done = subprocess.run([sys.executable, "-c", AGAIN], capture_output=True, text=True, check=True)
    assert done.stdout.split()[-1] == "True"
