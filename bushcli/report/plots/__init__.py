"""Which curves, axes and labels a result is shown by: result -> plots, without Matplotlib."""
