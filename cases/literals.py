"""Numbers in a form as constants, so that forms that differ in them alone share their compiled code.

A thickness or the height of a plate in an energy would be written into the generated code, and every other bushing
would compile forms of its own.
"""

from __future__ import annotations

from typing import Any

import ufl
from dolfinx import fem
from ufl.constantvalue import FloatValue
from ufl.corealg.traversal import unique_pre_traversal


def without_literals(form: Any, mesh: Any) -> Any:
    """Return the form with a constant in place of each floating-point number; integers, such as exponents, stay.

    Parameters
    ----------
    form
        UFL form.
    mesh
        DOLFINx mesh of the form.
    """
    numbers = dict.fromkeys(
        node
        for integral in form.integrals()
        for node in unique_pre_traversal(integral.integrand())
        if isinstance(node, FloatValue)
    )
    # In the order in which they occur: the order in which constants are made is part of a form's signature.
    return ufl.replace(form, {number: fem.Constant(mesh, float(number)) for number in numbers})
