"""`python -m fieldsid` is `sysid`."""

from fieldsid.cli.app import entry

entry()
