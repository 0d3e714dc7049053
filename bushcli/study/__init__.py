"""Many designs: what is varied, how it is sampled, what is asked of each design, and what the answers say together."""
