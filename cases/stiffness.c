/* Stiffness of a group of cells, and the places of its entries in a matrix. */

#include <stdlib.h>

#include "group.h"

/* w T^T A T, full: A[gradients + 1, packed] by the components' slopes in the reference cell; the pressure is last. */
static inline void turned(const group *s, const int components, const double *restrict A, const double *restrict T,
                          double w, double *restrict out)
{
    const int ng = s->gradients, count = FUNCTIONS, n = components * count + 1;
    double half[(ng + 1) * n];
    memset(half, 0, sizeof half);
    memset(out, 0, sizeof(double) * n * n);
    for (int k = 0; k <= ng; ++k)
        for (int l = k; l <= ng; ++l)
        {
            const double a = w * *A++;
            if (l == ng)
                half[k * n + n - 1] += a;
            else
                for (int m = 0; m < count; ++m)
                    half[k * n + s->component[l] * count + m] += a * T[s->table[l] * count + m];
            if (l != k)
                for (int m = 0; m < count; ++m)
                    half[l * n + s->component[k] * count + m] += a * T[s->table[k] * count + m];
        }
    for (int k = 0; k < ng; ++k)
        for (int m = 0; m < count; ++m)
        {
            const double t = T[s->table[k] * count + m];
            double *row = out + (s->component[k] * count + m) * n;
            for (int l = 0; l < n; ++l)
                row[l] += t * half[k * n + l];
        }
    out[n * n - 1] = half[ng * n + n - 1];
}

/* One component's block of an element: K[I][J] = sum over rows r of M[r][I] B[r][J], nodes filled up to whole fours. */
static inline void block(const int nodes, const int fours, const int rows, const double *restrict M,
                         const double *restrict B, double *restrict K, const int stride)
{
    for (int i = 0; i < nodes; i += 2)
    {
        const int next = i + 1 < nodes ? i + 1 : i;
        four first[fours], second[fours];
        memset(first, 0, sizeof first);
        memset(second, 0, sizeof second);
        for (int r = 0; r < rows; ++r)
        {
            const double m = M[r * 4 * fours + i], n = M[r * 4 * fours + next];
            const four *b = (const four *)(B + r * 4 * fours);
            for (int j = 0; j < fours; ++j)
            {
                first[j] += m * b[j];
                second[j] += n * b[j];
            }
        }
        memcpy(K + i * stride, first, sizeof(double) * nodes);
        memcpy(K + next * stride, second, sizeof(double) * nodes);
    }
}

/* The pressure's columns of an element's stiffness K, n x n, from the turned moduli F of its points. */
static inline void add_pressure(const group *s, const int nodes, const int fours, const double *restrict F,
                                double *restrict K)
{
    const int count = FUNCTIONS, last = s->components * count, own = s->components * nodes, n = own + s->corners;
    for (int q = 0; q < s->points; ++q, F += (last + 1) * (last + 1))
    {
        const double *N = s->pressure + q * s->corners;
        for (int i = 0; i < s->components; ++i)
            for (int node = 0; node < nodes; ++node)
            {
                double f = 0.0;
                for (int m = 0; m < count; ++m)
                    f += F[(i * count + m) * (last + 1) + last] * s->reference[(q * count + m) * 4 * fours + node];
                for (int a = 0; a < s->corners; ++a)
                    K[(i * nodes + node) * n + own + a] += f * N[a];
            }
        for (int a = 0; a < s->corners; ++a)
            for (int b = 0; b < s->corners; ++b)
                K[(own + a) * n + own + b] += F[last * (last + 1) + last] * N[a] * N[b];
    }
}

/* values[place] += the element stiffnesses of A[cells][points][upper triangle]. */
static inline void assemble(const group *s, const int nodes, const int fours, const int components, const int tables,
                            const double *restrict A, const int32_t *restrict place, double *restrict values)
{
    const int ng = s->gradients, packed = (ng + 1) * (ng + 2) / 2, count = FUNCTIONS;
    const int own = components * nodes, n = own + s->corners, side = components * count + 1;
    double *K = malloc(sizeof(double) * n * n), *M = calloc(s->points * count * 4 * fours, sizeof(double));
    double *full = malloc(sizeof(double) * s->points * side * side);
    for (long c = 0; c < s->cells; ++c)
    {
        memset(K, 0, sizeof(double) * n * n);
        for (int q = 0; q < s->points; ++q)
        {
            const long point = c * s->points + q;
            turned(s, components, A + point * packed, s->turn + point * tables * count, s->weight[point],
                   full + q * side * side);
        }
        for (int i = 0; i < components; ++i)
            for (int j = i; j < components; ++j)
            {
                for (int q = 0; q < s->points; ++q)
                    for (int m = 0; m < count; ++m)
                    {
                        four *row = (four *)(M + (q * count + m) * 4 * fours);
                        memset(row, 0, sizeof(four) * fours);
                        for (int l = 0; l < count; ++l)
                        {
                            const double f = full[(q * side + i * count + l) * side + j * count + m];
                            const four *b = (const four *)(s->reference + (q * count + l) * 4 * fours);
                            for (int v = 0; v < fours; ++v)
                                row[v] += f * b[v];
                        }
                    }
                block(nodes, fours, s->points * count, M, s->reference, K + i * nodes * n + j * nodes, n);
            }
        add_pressure(s, nodes, fours, full, K);
        /* Only the components' blocks on and above the diagonal were computed. */
        for (int i = 0; i < n; ++i)
            for (int j = i + 1; j < n; ++j)
                K[j * n + i] = K[i * n + j];
        const int32_t *at = place + c * n * n;
        for (int i = 0; i < n * n; ++i)
            values[at[i]] += K[i];
    }
    free(K), free(M), free(full);
}

void stiffness(const group *s, const double *A, const int32_t *place, double *values)
{
    FOR_SIZES(assemble, s, A, place, values);
}

/* Position of each entry of n x n element matrices in a CSR matrix with sorted columns; `nowhere` for fixed and for
 * negative unknowns, `missing` where the matrix has no entry. */
void locate(long cells, int n, const int32_t *unknown, const uint8_t *fixed, const int32_t *start,
            const int32_t *column, int32_t nowhere, int32_t missing, int32_t *place)
{
    for (long c = 0; c < cells; ++c, unknown += n)
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < n; ++j, ++place)
            {
                *place = nowhere;
                if (unknown[i] < 0 || unknown[j] < 0 || fixed[unknown[i]] || fixed[unknown[j]])
                    continue;
                int32_t low = start[unknown[i]], high = start[unknown[i] + 1] - 1;
                while (low < high)
                {
                    const int32_t middle = (low + high) / 2;
                    if (column[middle] < unknown[j])
                        low = middle + 1;
                    else
                        high = middle;
                }
                *place = low <= high && column[low] == unknown[j] ? low : missing;
            }
}
