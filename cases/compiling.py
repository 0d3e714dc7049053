"""Compiles a function of a point (`forms.point`): builds its UFL expression, from which FFCx makes a shared library.

Separate from `cases.kernels`, which calls the library, because a function that is already compiled needs neither UFL
nor the form compiler.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import basix.ufl
import numpy as np
import ufl
from mpi4py import MPI
from numpy.typing import NDArray
from ufl.algorithms import expand_derivatives
from ufl.corealg.map_dag import map_expr_dag
from ufl.corealg.multifunction import MultiFunction

from cases import jit
from forms.point import PointFunction

Array = NDArray[np.float64]


def compiled_function(function: PointFunction) -> tuple[tuple[str, ...], int, Any]:
    """Compile a function: the inputs that it reads, how many numbers it returns, and its cffi module."""
    inputs = {
        name: ufl.Coefficient(_numbers(n, 1 if function.is_single(name) else function.batch))
        for name, n in function.blocks.items()
    }
    values = bare(ufl.as_vector(list(function.make(inputs))))
    compiled, module = jit.compiled_expression(values, _places(function.batch), MPI.COMM_SELF)
    # Inputs that do not occur in the result are left out.
    order = [compiled.original_coefficient_positions[i] for i in range(compiled.num_coefficients)]
    left = ufl.algorithms.extract_coefficients(values)
    names = {inputs[name]: name for name in inputs}
    return tuple(names[left[i]] for i in order), len(values), module


@cache
def _places(batch: int) -> Array:
    """Return points of an interval; only their number matters."""
    return (np.arange(batch, dtype=np.float64)[:, None] + 0.5) / batch


@cache
def _numbers(n: int, batch: int) -> Any:
    """Return a space whose functions are n numbers at each of `batch` points, on a dummy domain."""
    if batch == 1:
        return ufl.FunctionSpace(_domain(), basix.ufl.element("DG", "interval", 0, shape=(n,)))
    weights = np.full(batch, 1.0 / batch)
    element = basix.ufl.quadrature_element(
        "interval", value_shape=(n,), points=_places(batch), weights=weights
    )
    return ufl.FunctionSpace(_domain(), element)


@cache
def _domain() -> Any:
    return ufl.Mesh(basix.ufl.element("Lagrange", "interval", 1, shape=(1,)))


def bare(expression: Any) -> Any:
    """Return an expression without its ufl.variable labels, whose numbers would become part of the signature."""
    return map_expr_dag(_Bare(), expand_derivatives(expression))


class _Bare(MultiFunction):  # type: ignore[misc]  # UFL has no type information
    expr = MultiFunction.reuse_if_untouched

    def variable(self, o: object, operand: object, _: object) -> object:
        """Replace a labelled expression by the expression itself."""
        return operand
