"""Log files: reading them as a Run, in SI units and radians, in NED and forward-starboard-down axes, on one clock."""

from fieldsid.logs.channels import ChannelMap, Source
from fieldsid.logs.load import load_run
from fieldsid.logs.run import SIGNALS, Note, Run
from fieldsid.logs.save import save_run
from fieldsid.logs.segments import Segment, segment

__all__ = ["SIGNALS", "ChannelMap", "Note", "Run", "Segment", "Source", "load_run", "save_run", "segment"]
