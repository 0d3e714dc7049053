"""The likelihood of a recording: noise of the sensors, calibration, error of form, unknown physics."""
