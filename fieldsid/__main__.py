"""`python -m fieldsid` is `sysid`."""

import sys

from fieldsid.cli.app import main

sys.exit(main())
