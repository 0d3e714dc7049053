"""Simulate rubber bushings, identify their rubber from recorded curves, say what a model leaves out."""

import signal
import sys

__version__ = "0.1.0"

if sys.argv[:1] and sys.argv[0].endswith("/bushcli"):
    # While the command loads its modules, Ctrl-C ends it at once and without a traceback; once it works,
    # `bushcli.runtime.interrupt.listen` saves what there is.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
