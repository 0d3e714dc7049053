"""One file per deformation mode; every module's `MODE` is found by `cases.mode.modes`."""
