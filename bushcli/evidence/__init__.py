"""The evidence of one model: priors of effects, laws and values, the posterior density, and its integral.

A fit minimises the density (`density`); Laplace's method integrates it about that minimum (`laplace`). `amplitudes`
finds the amplitudes of effects to first order, and `stopping_rule` the evidence that a fit in progress can still reach.
"""
