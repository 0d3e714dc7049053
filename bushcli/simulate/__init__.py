"""Case and effects -> curves: schedule of the march, simulation of a recording, prediction and misfit."""
