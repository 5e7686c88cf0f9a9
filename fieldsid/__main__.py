"""`python -m fieldsid` is `sysid`."""

import os
import sys

# Python puts the working folder before its own modules: a `numpy.py` in an untrusted folder would be run as NumPy.
try:
    _here = os.getcwd()  # noqa: PTH109 - `pathlib` would be looked for there
except OSError:  # the working folder has been removed
    _here = ""
if not sys.flags.safe_path:
    sys.path[:1] = [place for place in sys.path[:1] if place not in {"", _here}]

from fieldsid.cli.app import entry

entry()
