"""One file per shape; every subclass of `geometry.shape.Shape` defined here is found by `geometry.shape.shapes`."""
