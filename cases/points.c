/* Gradients at the points of a group of cells, forces, and products of the stiffness with vectors. */

#include "group.h"

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
    double u[components * 4 * fours], p[s->corners];
    double force[components * s->points * FUNCTIONS], turned[components * tables];
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

/* r[m] += stiffness of A[cells][points][upper triangle] times x[m], for m of `count` vectors of `size` unknowns; where
 * (a_k b_l - b_k a_l) / 2 is added to A for each of the pairs skew[pairs][2][cells][points][gradients + 1] = (a, b). */
static inline void act(const group *s, const int nodes, const int fours, const int components, const int tables,
                       const double *restrict A, const double *restrict skew, const long pairs, const long count,
                       const long size, const double *restrict x, double *restrict r)
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
            const long vector = s->cells * s->points * rows;
            for (long pair = 0; pair < pairs; ++pair)
            {
                const double *a = skew + 2 * pair * vector + (c * s->points + q) * rows, *b = a + vector;
                for (int k = 0; k < rows; ++k)
                    for (int l = 0; l < rows; ++l)
                        F[l * 4 * row_fours + k] += (a[k] * b[l] - b[k] * a[l]) / 2;
            }
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

void action(const group *s, const double *A, const double *skew, long pairs, long count, long size, const double *x,
            double *r)
{
    FOR_SIZES(act, s, A, skew, pairs, count, size, x, r);
}
