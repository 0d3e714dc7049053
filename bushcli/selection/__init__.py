"""Selection of models: one is fitted, its neighbours are predicted, and the most promising of them is fitted next.

`fit` fits a model, beginning with the plain law (`plain`). Derivatives of the curves by effects that it does not have
(`columns`) predict the evidence of its neighbours to first order (`predict`). The search (`queue`) fits models in the
order of that prediction until those that remain could not change the posterior.
"""
