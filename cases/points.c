/* Loops over the quadrature points of a group of cells: work that has to be fast and is the same for every material.
 *
 * The gradients g of a point are linear in the unknowns: g_k = sum_m T[table_k][m] (Phi_m . u[component_k]), with Phi the
 * shape functions and their derivatives in the reference cell, the same for all cells, and T their transformation by the
 * geometry of the cell. The pressure follows as one more. The energy's derivatives by g, P = dW/dg and A = d2W/dg2 (upper
 * triangle, row by row), give the element's forces, sum_q w B^T P, and its stiffness, sum_q w B^T A B. Material answers
 * come from kernels that the form compiler made (`evaluate.c`).
 */

#include <stdint.h>
#include <stdlib.h>
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

/* `multiplied` for `width` fours from the four r on. All vectors share what is loaded of M, and their sums do not wait for
 * each other. */
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

/* g[cells][points][gradients + 1] of the unknowns x. */
static inline void gather(const group *s, const int nodes, const int fours, const int components, const int tables,
                          const double *restrict x, double *restrict g)
{
    const int rows = s->gradients + 1, long_fours = (s->points * FUNCTIONS + 3) / 4;
    double u[components * nodes], p[s->corners], slope[components * 4 * long_fours], turned[components * tables];
    (void)fours;
    for (long c = 0; c < s->cells; ++c)
    {
        const int32_t *at = s->displaced + c * components * nodes;
        for (int i = 0; i < components * nodes; ++i)
            u[i] = x[at[i]];
        for (int i = 0; i < s->corners; ++i)
            p[i] = x[s->pressed[c * s->corners + i]];
        multiplied(components, nodes, long_fours, s->transposed, u, slope);
        const double *T = s->turn + c * s->points * tables * FUNCTIONS;
        for (int q = 0; q < s->points; ++q, g += rows, T += tables * FUNCTIONS)
        {
            for (int i = 0; i < components; ++i)
                for (int t = 0; t < tables; ++t)
                {
                    const double *v = slope + i * 4 * long_fours + q * FUNCTIONS, *w = T + t * FUNCTIONS;
                    turned[i * tables + t] = w[0] * v[0] + w[1] * v[1] + w[2] * v[2];
                }
            for (int k = 0; k < s->gradients; ++k)
                g[k] = turned[s->component[k] * tables + s->table[k]];
            double total = 0.0;
            for (int i = 0; i < s->corners; ++i)
                total += s->pressure[q * s->corners + i] * p[i];
            g[s->gradients] = total;
        }
    }
}

void gradients(const group *s, const double *x, double *g)
{
    FOR_SIZES(gather, s, x, g);
}

/* r += forces of P[cells][points][gradients + 1]. */
static inline void scatter(const group *s, const int nodes, const int fours, const int components, const int tables,
                           const double *restrict P, double *restrict r)
{
    double u[components * 4 * fours], p[s->corners], force[components * s->points * FUNCTIONS], turned[components * tables];
    memset(turned, 0, sizeof turned);
    for (long c = 0; c < s->cells; ++c)
    {
        memset(p, 0, sizeof p);
        const double *T = s->turn + c * s->points * tables * FUNCTIONS;
        for (int q = 0; q < s->points; ++q, P += s->gradients + 1, T += tables * FUNCTIONS)
        {
            const double w = s->weight[c * s->points + q];
            for (int k = 0; k < s->gradients; ++k)
                turned[s->component[k] * tables + s->table[k]] = w * P[k];
            for (int i = 0; i < components; ++i)
                for (int m = 0; m < FUNCTIONS; ++m)
                {
                    double total = 0.0;
                    for (int t = 0; t < tables; ++t)
                        total += turned[i * tables + t] * T[t * FUNCTIONS + m];
                    force[(i * s->points + q) * FUNCTIONS + m] = total;
                }
            for (int i = 0; i < s->corners; ++i)
                p[i] += w * P[s->gradients] * s->pressure[q * s->corners + i];
        }
        const int32_t *at = s->displaced + c * components * nodes;
        multiplied(components, s->points * FUNCTIONS, fours, s->reference, force, u);
        for (int i = 0; i < components; ++i)
            for (int node = 0; node < nodes; ++node)
                r[*at++] += u[i * 4 * fours + node];
        for (int i = 0; i < s->corners; ++i)
            r[s->pressed[c * s->corners + i]] += p[i];
    }
}

void forces(const group *s, const double *P, double *r)
{
    FOR_SIZES(scatter, s, P, r);
}

/* w T^T A T: A[gradients + 1, packed] by the components' slopes in the reference cell, full; the pressure stays last. */
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

/* P = A g at n points, A packed. */
void contract(long n, int rows, const double *A, const double *g, double *P)
{
    memset(P, 0, sizeof(double) * n * rows);
    for (long i = 0; i < n; ++i, g += rows, P += rows)
        for (int k = 0; k < rows; ++k)
        {
            P[k] += *A++ * g[k];
            for (int l = k + 1; l < rows; ++l, ++A)
            {
                P[k] += *A * g[l];
                P[l] += *A * g[k];
            }
        }
}

/* r[m] += stiffness of A[cells][points][upper triangle] times x[m], for m of `count` vectors of `size` unknowns. */
static inline void act(const group *s, const int nodes, const int fours, const int components, const int tables,
                       const double *restrict A, const long count, const long size, const double *restrict x,
                       double *restrict r)
{
    const int rows = s->gradients + 1, row_fours = (rows + 3) / 4;
    double g[s->points * rows], P[s->points * rows], out[4 * row_fours];
    double full[s->points * rows * 4 * row_fours];
    memset(full, 0, sizeof full);
    group cell = *s;
    cell.cells = 1;
    for (long c = 0; c < s->cells; ++c)
    {
        /* Whole rows: the cell's vectors share them, and one after the other they are multiplied in fours. */
        for (int q = 0; q < s->points; ++q)
        {
            double *F = full + q * rows * 4 * row_fours;
            for (int k = 0; k < rows; ++k)
                for (int l = k; l < rows; ++l)
                    F[k * 4 * row_fours + l] = F[l * 4 * row_fours + k] = *A++;
        }
        for (long m = 0; m < count; ++m)
        {
            gather(&cell, nodes, fours, components, tables, x + m * size, g);
            for (int q = 0; q < s->points; ++q)
            {
                multiplied(1, rows, row_fours, full + q * rows * 4 * row_fours, g + q * rows, out);
                memcpy(P + q * rows, out, sizeof(double) * rows);
            }
            scatter(&cell, nodes, fours, components, tables, P, r + m * size);
        }
        cell.turn += s->points * tables * FUNCTIONS;
        cell.displaced += components * nodes;
        cell.pressed += s->corners;
        cell.weight += s->points;
    }
}

void action(const group *s, const double *A, long count, long size, const double *x, double *r)
{
    FOR_SIZES(act, s, A, count, size, x, r);
}

/* Position of each entry of n x n element matrices in a CSR matrix with sorted columns; `nowhere` for fixed and for
 * negative unknowns, `missing` where the matrix has no entry. */
void locate(long cells, int n, const int32_t *unknown, const uint8_t *fixed, const int32_t *start, const int32_t *column,
            int32_t nowhere, int32_t missing, int32_t *place)
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
