"""Compiled functions of a point, and the loops over all points that call them.

A kernel is compiled by the form compiler from a `forms.point.PointFunction`: no mesh, no element and no quadrature
rule is in it. The loops are C (`SOURCES`), compiled once for all.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cases import jit, records
from forms.point import PointFunction

Array = NDArray[np.float64]

SOURCES = (
    *("group.h", "contact/surface.h", "contact/sweep.h", "contact/nearest.h"),
    *("evaluate.c", "points.c", "stiffness.c", "contact/near.c", "contact/inside.c"),
)
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
void evaluate(uintptr_t function, long sets, long n, int blocks, const uintptr_t *block, const long *width,
              const long *jump, const long *stride, double *out, long out_jump, long out_stride, long clear);
void evaluate_batches(uintptr_t function, long n, long batch, int blocks, const uintptr_t *block, const long *width,
              const long *stride, const long *single, long size, double *out, long out_stride, long clear);
void gradients(const group *s, const double *x, double *g);
void forces(const group *s, const double *P, double *r);
void stiffness(const group *s, const double *A, const int32_t *place, double *values);
void action(const group *s, const double *A, const double *skew, long pairs, long count, long size, const double *x,
            double *r);
void locate(long cells, int n, const int32_t *unknown, const uint8_t *fixed, const int32_t *start,
            const int32_t *column, int32_t nowhere, int32_t missing, int32_t *place);
void contract(long n, int rows, const double *A, const double *g, double *P);
typedef struct
{
    long facets, soft;
    int nodes, d, points, edges, triangle, bow;
    const int64_t *facet, *powers, *fold, *folded;
    const double *sign, *breadth, *values, *slopes, *centre, *middle, *weights, *edge, *course, *X;
    double *frame;
    int64_t *near;
} surface;
int meeting(const surface *s, const double *x, double reach, double maybe);
long facing_pairs(const surface *s, const double *x, double maybe, int64_t *pairs);
long inside(const surface *s, const double *x, double reach, double maybe, int64_t *facet, int64_t *point,
            int64_t *other, double *xi, double *free, double *r);
"""


@cache
def loops() -> Any:
    """The loops of `SOURCES`: a cffi module with ``lib`` and ``ffi``."""
    return jit.compiled_source("points", Path(__file__).parent, SOURCES, DECLARATIONS)


def pointer(array: Any, kind: str = "double") -> Any:
    """A contiguous array's data, for the loops.

    Parameters
    ----------
    array : Any
        A contiguous array.
    kind : str
        C type of its entries.
    """
    return loops().ffi.from_buffer(f"{kind}[]", array)


class Kernel:
    """A compiled function of a point.

    Parameters
    ----------
    function
        The function to be compiled.

    Attributes
    ----------
    size : int
        Count of the numbers that it returns at a point.
    """

    def __init__(self, function: PointFunction) -> None:
        record = records.find(function)
        if record is None:
            # UFL and the form compiler take longer to load than most kernels.
            from cases.compiling import compiled_function

            names, size, self._module = compiled_function(function)
            records.note(function, Path(self._module.__file__), size, names)
        else:
            names, size, self._module = record[0].names, record[0].size, record[1]
        self.size, self._names, self.batch = size, names, function.batch
        self._widths = [function.blocks[name] for name in names]
        # The form compiler puts one expression into a library.
        (entry,) = (name for name in dir(self._module.lib) if name.startswith("expression_"))
        compiled = getattr(self._module.lib, entry)
        self.function = int(self._module.ffi.cast("uintptr_t", compiled.tabulate_tensor_float64))
        ffi, singles = loops().ffi, map(PointFunction.is_single, names)
        #: Widths of the inputs, and whether each is one for all points of a batch, for the loops.
        self.widths = ffi.new("long[]", self._widths or [0])
        self.singles = ffi.new("long[]", list(map(int, singles)) or [0])

    def bind(self, out: Array, inputs: Mapping[str, Array], clear: bool = False) -> Call:
        """Return a call that adds the results at all points to the first columns of ``out``.

        It reads from and writes to these very arrays whenever it is called.

        Parameters
        ----------
        out : Array
            Where the results go, shape (n, >= size), or (sets, n, >= size) for several sets of inputs; the first is
            the sum over the sets.
        inputs : Mapping[str, Array]
            By name: shape (sets, n, >= width), of which the first columns are taken; a length that is 1 or missing
            means the same for all.
        clear : bool
            Whether ``out`` is zeroed first.
        """
        arrays = [inputs[name] for name in self._names]
        n = out.shape[-2]
        sets = max((array.shape[-3] for array in (*arrays, out) if array.ndim > 2), default=1)
        for name, array, width in zip(self._names, arrays, self._widths, strict=True):
            assert array.ndim < 2 or array.shape[-2] in (1, n), name
            assert array.ndim < 3 or array.shape[-3] in (1, sets), name
            assert array.shape[-1] >= width, name
            assert array.strides[-1] == 8 or width == 1 or not array.size, name
        return Call(self, arrays, out, sets, out.shape[-1] if clear else 0)

    def __call__(self, n: int, inputs: Mapping[str, Array]) -> Array:
        """Results at n points, shape (n, size)."""
        out = np.zeros((n, self.size))
        self.bind(out, inputs)()
        return out


class Call:
    """A kernel with its arrays: input blocks and output."""

    def __init__(self, kernel: Kernel, inputs: Sequence[Array], out: Array, sets: int, clear: int) -> None:
        ffi = loops().ffi
        # They have to live as long as this call.
        self._kept = (kernel, *inputs, out)
        # Directions without a change share one array.
        addresses = {key: _address(array) for key, array in {id(array): array for array in inputs}.items()}
        strides = ffi.new("long[]", [_step(array, -2) for array in inputs] or [0])
        blocks = (
            len(inputs),
            ffi.new("uintptr_t[]", [addresses[id(array)] for array in inputs] or [0]),
            kernel.widths,
        )
        begin, stride, n = ffi.cast("double *", _address(out)), out.strides[-2] // 8, out.shape[-2]
        self._given: tuple[Any, ...]
        if kernel.batch == 1:
            jumps = ffi.new("long[]", [_step(array, -3) for array in inputs] or [0])
            rows = (begin, _step(out, -3), stride, clear)
            self._evaluate = loops().lib.evaluate
            self._given = (kernel.function, sets, n, *blocks, jumps, strides, *rows)
        else:
            assert sets == 1, "sets of inputs in batches"
            batch = (kernel.function, n, kernel.batch, *blocks, strides, kernel.singles, kernel.size)
            self._evaluate, self._given = loops().lib.evaluate_batches, (*batch, begin, stride, clear)

    def __call__(self) -> None:
        """Evaluate the kernel."""
        self._evaluate(*self._given)


def _address(array: Array) -> int:
    # `array.ctypes` makes an object first, which takes longer than all the rest.
    return int(array.__array_interface__["data"][0])


def _step(array: Array, axis: int) -> int:
    """Numbers from one entry to the next along an axis counted from the end; 0 where all are the same."""
    return array.strides[axis] // 8 if array.ndim >= -axis and array.shape[axis] > 1 else 0


_KERNELS: dict[tuple[Hashable, ...], Kernel] = {}


def kernel(function: PointFunction) -> Kernel:
    """The compiled function; the same one for the same key."""
    if function.key not in _KERNELS:
        _KERNELS[function.key] = Kernel(function)
    return _KERNELS[function.key]
