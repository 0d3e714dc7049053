"""The foreign deck: the catalogue's physics by other formulas, other elements and other codes.

`halfplane` is a small finite-element code of its own (serendipity elements, reduced integration, NumPy) for axial and
torsional load, with the rubbers of `rubbers`; `component` has memory models on the force of the whole bushing, as the
industry has them; `solid` asks FElupe for radial curves and for MORPH.
"""
