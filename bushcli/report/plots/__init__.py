"""Results -> plots as values: curves, axes and labels, without Matplotlib."""
