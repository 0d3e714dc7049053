"""Studies of many designs: variables, sampling, answers of each design, and their statistics."""
