"""The foreign deck: the catalogue's physics by other formulas, other elements and other codes.

`halfplane` is a small finite-element code of its own (serendipity elements, reduced integration, NumPy) for axial and
torsional load, with the rubbers of `rubbers`; `component` has the industry's memory models on the force of the whole
bushing; `solid` and `morph` run FElupe for radial curves and for MORPH.
"""
