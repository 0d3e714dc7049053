/* A group of cells, and what the loops over its quadrature points have in common.
 *
 * The gradients g of a point are linear in the unknowns: g_k = sum_m T[table_k][m] (Phi_m . u[component_k]), with Phi
 * the shape functions and their derivatives in the reference cell, the same for all cells, and T their transformation
 * by the geometry of the cell. The pressure follows as one more. The energy's derivatives by g, P = dW/dg and
 * A = d2W/dg2 (upper triangle, row by row), give the element's forces, sum_q w B^T P, and its stiffness,
 * sum_q w B^T A B. Material answers come from kernels that the form compiler made (`evaluate.c`).
 */

#pragma once

#include <stdint.h>
#include <string.h>

/* Three derivatives in a solid; two, and the function itself, in the half-plane. */
#define FUNCTIONS 3

typedef struct
{
    long cells;
    int points, nodes, tables, gradients, components, corners;
    const int32_t *component, *table; /* of each gradient */
    const double *reference;          /* Phi: [points][FUNCTIONS][nodes, filled up with zeros to whole fours] */
    const double *transposed;         /* the same: [nodes][points times FUNCTIONS, filled up to whole fours] */
    const double *turn;               /* T: [cells][points][tables][FUNCTIONS] */
    const double *pressure;           /* [points][corners] */
    const int32_t *displaced;         /* [cells][components][nodes], places in the vector of unknowns */
    const int32_t *pressed;           /* [cells][corners] */
    const double *weight;             /* [cells][points] */
} group;

/* Four numbers that the processor multiplies at once. */
typedef double four __attribute__((vector_size(32), aligned(8)));

/* For the usual elements the compiler knows the sizes in the loops that follow: nodes, the fours that hold them,
 * components and tables. */
#define FOR_SIZES(loop, s, ...)                                                                     \
    do                                                                                              \
    {                                                                                               \
        if ((s)->nodes == 9 && (s)->components == 2 && (s)->tables == 3)                            \
            loop(s, 9, 3, 2, 3, __VA_ARGS__);                                                       \
        else if ((s)->nodes == 9 && (s)->components == 3 && (s)->tables == 5)                       \
            loop(s, 9, 3, 3, 5, __VA_ARGS__);                                                       \
        else if ((s)->nodes == 27 && (s)->components == 3 && (s)->tables == 3)                      \
            loop(s, 27, 7, 3, 3, __VA_ARGS__);                                                      \
        else if ((s)->nodes == 10 && (s)->components == 3 && (s)->tables == 3)                      \
            loop(s, 10, 3, 3, 3, __VA_ARGS__);                                                      \
        else if ((s)->nodes == 6 && (s)->components == 2 && (s)->tables == 3)                       \
            loop(s, 6, 2, 2, 3, __VA_ARGS__);                                                       \
        else                                                                                        \
            loop(s, (s)->nodes, ((s)->nodes + 3) / 4, (s)->components, (s)->tables, __VA_ARGS__);   \
    } while (0)

/* `multiplied` for `width` fours from the four r on. All vectors share what is loaded of M, and their sums do not wait
 * for each other. */
static inline void multiplied_fours(const int width, const int r, const int vectors, const int n, const int fours,
                                    const double *restrict M, const double *restrict x, double *restrict out)
{
    four total[vectors][width];
    memset(total, 0, sizeof total);
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < width; ++j)
        {
            const four m = ((const four *)(M + i * 4 * fours))[r + j];
            for (int v = 0; v < vectors; ++v)
                total[v][j] += x[v * n + i] * m;
        }
    for (int v = 0; v < vectors; ++v)
        memcpy(out + (v * fours + r) * 4, total[v], sizeof total[v]);
}

/* out[v][r] = sum over i of M[i][r] x[v][i], rows in fours, up to four fours at once. */
static inline void multiplied(const int vectors, const int n, const int fours, const double *restrict M,
                              const double *restrict x, double *restrict out)
{
    int r = 0;
    for (; r + 4 <= fours; r += 4)
        multiplied_fours(4, r, vectors, n, fours, M, x, out);
    /* Numbers known to the compiler: it keeps the sums in registers. */
    if (fours - r == 3)
        multiplied_fours(3, r, vectors, n, fours, M, x, out);
    else if (fours - r == 2)
        multiplied_fours(2, r, vectors, n, fours, M, x, out);
    else if (fours - r == 1)
        multiplied_fours(1, r, vectors, n, fours, M, x, out);
}
