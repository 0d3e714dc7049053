"""Where a simulation misses its recordings: in the record, and in the bushing."""
