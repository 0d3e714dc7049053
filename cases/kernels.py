"""Compiled functions of a point, and the loops over all points that call them.

A kernel is compiled by the form compiler from a `forms.answers.PointFunction`: no mesh, no element and no quadrature
rule is in it. The loops are C (`points.c`), compiled once for all.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
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
from forms.answers import PointFunction

Array = NDArray[np.float64]

DECLARATIONS = """
typedef struct
{
    long cells;
    int points, nodes, tables, gradients, components, corners;
    const int32_t *component, *table;
    const double *reference, *transposed, *turn, *pressure;
    const int32_t *displaced, *pressed;
    const double *weight;
} group;
void evaluate(uintptr_t function, long n, int blocks, const uintptr_t *block, const long *width, const long *stride,
              double *out, long out_stride);
void gradients(const group *s, const double *x, double *g);
void forces(const group *s, const double *P, double *r);
void stiffness(const group *s, const double *A, const int32_t *place, double *values);
void locate(long cells, int n, const int32_t *unknown, const uint8_t *fixed, const int32_t *start,
            const int32_t *column, int32_t nowhere, int32_t *place);
void contract(long n, int rows, const double *A, const double *g, double *P);
"""


@cache
def loops() -> Any:
    """The loops of `points.c`: a cffi module with ``lib`` and ``ffi``."""
    return jit.compiled_source("points", Path(__file__).with_name("points.c"), DECLARATIONS)


def pointer(array: Any, kind: str = "double") -> Any:
    """Address of a contiguous array's data, for the loops."""
    assert array.flags.c_contiguous
    return loops().ffi.cast(f"{kind} *", array.ctypes.data)


class Kernel:
    """A compiled function of a point.

    Parameters
    ----------
    function
        What it computes.

    Attributes
    ----------
    size : int
        Numbers that it returns at a point.
    """

    def __init__(self, function: PointFunction) -> None:
        spaces = {n: _numbers(n) for n in function.blocks.values()}
        inputs = {name: ufl.Coefficient(spaces[n]) for name, n in function.blocks.items()}
        values = ufl.as_vector(list(function.make(inputs)))
        self.size = len(values)
        compiled, self._module = jit.compiled_expression(bare(values), np.array([[0.5]]), MPI.COMM_SELF)
        ffi = self._module.ffi
        self._function = int(ffi.cast("uintptr_t", compiled.tabulate_tensor_float64))
        # What does not occur in the result is not asked for.
        order = [compiled.original_coefficient_positions[i] for i in range(compiled.num_coefficients)]
        left = ufl.algorithms.extract_coefficients(bare(values))
        names = {inputs[name]: name for name in inputs}
        self._names = tuple(names[left[i]] for i in order)
        self._widths = [function.blocks[name] for name in self._names]
        ffi = loops().ffi
        self._block = ffi.new("uintptr_t[]", max(len(self._names), 1))
        self._width = ffi.new("long[]", [*self._widths, 0])
        self._stride = ffi.new("long[]", max(len(self._names), 1))

    def add(self, out: Array, inputs: Mapping[str, Array]) -> None:
        """Add the results at all points to the first columns of ``out``, shape (n, >= size).

        Parameters
        ----------
        inputs
            By name: shape (n, >= width), of which the first columns are taken, or (width,) for all points alike.
        """
        for i, name in enumerate(self._names):
            array = inputs[name]
            assert array.shape[-1] >= self._widths[i] and (array.strides[-1] == 8 or self._widths[i] == 1), (
                name
            )
            self._block[i] = array.ctypes.data
            self._stride[i] = array.strides[0] // 8 if array.ndim == 2 else 0
        loops().lib.evaluate(
            self._function,
            len(out),
            len(self._names),
            self._block,
            self._width,
            self._stride,
            pointer(out),
            out.strides[0] // 8,
        )

    def __call__(self, n: int, inputs: Mapping[str, Array]) -> Array:
        """Results at n points, shape (n, size)."""
        out = np.zeros((n, self.size))
        self.add(out, inputs)
        return out


_KERNELS: dict[tuple[str, ...], Kernel] = {}


def kernel(function: PointFunction) -> Kernel:
    """The compiled function; the same one for the same key."""
    if function.key not in _KERNELS:
        _KERNELS[function.key] = Kernel(function)
    return _KERNELS[function.key]


@cache
def _numbers(n: int) -> Any:
    """Space whose functions are n numbers, on a domain of no importance."""
    return ufl.FunctionSpace(_domain(), basix.ufl.element("DG", "interval", 0, shape=(n,)))


@cache
def _domain() -> Any:
    return ufl.Mesh(basix.ufl.element("Lagrange", "interval", 1, shape=(1,)))


def bare(expression: Any) -> Any:
    """An expression without the marks for differentiation, whose numbers would be part of its signature."""
    return map_expr_dag(_Bare(), expand_derivatives(expression))


class _Bare(MultiFunction):  # type: ignore[misc]  # UFL has no type information
    expr = MultiFunction.reuse_if_untouched

    def variable(self, o: object, operand: object, _: object) -> object:
        """The expression that is marked."""
        return operand
