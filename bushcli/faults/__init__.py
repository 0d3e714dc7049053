"""Faults of the data: what a rig or its logger did to a recording, found before any law is fitted to it.

A fault is no physics: no law and no effect may be blamed for it. Some faults make every fit meaningless (the
force has the other sign, units are a thousand off, two channels are exchanged); they are *fatal*, and must be
mended first. Others touch a few samples (spikes, stuck samples, a clipped load cell), which a fit leaves out.
"""

from bushcli.faults.fault import DataFault, Kind, condition, masks
from bushcli.faults.find import bad_samples, find_faults

__all__ = ["DataFault", "Kind", "bad_samples", "condition", "find_faults", "masks"]
