/* The point of a facet that is nearest to another point. */

#pragma once

#include "surface.h"

/* Largest number of Newton iterations for a point of a facet, and length of the last step in reference coordinates: the
 * remaining error is of the order of its square. */
#define PROJECTIONS 12
#define CLOSE 1e-7
/* Edges are not searched where the iterate lies beyond the facet by more than this times the point's distance from it:
 * BESIDE excludes such a point. */
#define ASIDE 2.0
/* Far from a curved facet the distance is not convex: the facet is treated as plane where the least curvature of half
 * the squared distance is below this share of the plane's. */
#define CONVEX 0.2

/* A place on a facet: position, tangents, second derivatives by (0,0), (0,1), (1,1) of the reference coordinates. */
typedef struct
{
    double at[3], tangent[2][3], bend[3][3];
} place;

/* Highest power of a coordinate in a facet's shape functions. */
#define HIGHEST 4

/* Powers of a coordinate, and their first and second derivatives. */
static void powers(double x, double to[3][HIGHEST + 1])
{
    to[0][0] = 1.0;
    to[1][0] = to[2][0] = 0.0;
    for (int e = 1; e <= HIGHEST; ++e)
    {
        to[0][e] = x * to[0][e - 1];
        to[1][e] = e * to[0][e - 1];
        to[2][e] = e * to[1][e - 1];
    }
}

/* The place of facet f, which has n nodes, at xi. */
static inline place place_of(const surface *s, const int n, long f, const double *x, const double *xi)
{
    const int a = s->d - 1;
    static const int BY[6][2] = {{0, 0}, {1, 0}, {0, 1}, {2, 0}, {1, 1}, {0, 2}};
    double of[2][3][HIGHEST + 1], monomial[n][6];
    place found = {{0.0}};
    powers(xi[0], of[0]);
    powers(a == 2 ? xi[1] : 0.0, of[1]);
    for (int j = 0; j < n; ++j)
    {
        const int64_t *exponent = s->powers + j * a;
        for (int table = 0; table < 6; ++table)
            monomial[j][table] =
                of[0][BY[table][0]][exponent[0]] * of[1][BY[table][1]][a == 2 ? exponent[1] : 0];
    }
    for (int i = 0; i < n; ++i)
    {
        const double *node = x + s->facet[f * n + i] * s->d;
        double shape[6] = {0.0};
        for (int j = 0; j < n; ++j)
            for (int table = 0; table < 6; ++table)
                shape[table] += monomial[j][table] * s->weights[j * n + i];
        for (int k = 0; k < s->d; ++k)
        {
            found.at[k] += shape[0] * node[k];
            for (int table = 1; table < 3; ++table)
                found.tangent[table - 1][k] += shape[table] * node[k];
            for (int table = 3; table < 6; ++table)
                found.bend[table - 3][k] += shape[table] * node[k];
        }
    }
    return found;
}

/* The place of facet f at xi, with the nodes at x. For the usual facets the compiler knows the length of the loops. */
static place place_at(const surface *s, long f, const double *x, const double *xi)
{
    if (s->nodes == 6)
        return place_of(s, 6, f, x, xi);
    if (s->nodes == 9)
        return place_of(s, 9, f, x, xi);
    return place_of(s, s->nodes, f, x, xi);
}

static double clip(double value, double low, double high)
{
    return fmin(fmax(value, low), high);
}

/* Least eigenvalue of [[a, b], [b, c]]. */
static double least(double a, double b, double c)
{
    return 0.5 * (a + c) - hypot(0.5 * (a - c), b);
}

/* One Newton step towards the nearest point of the whole, unbounded facet; returns its length in xi. */
static double step_over(const surface *s, long f, const double *x, const double *point, double *xi)
{
    const int a = s->d - 1;
    const place p = place_at(s, f, x, xi);
    double r[3], H[3] = {0.0, 0.0, 1.0}, plain[3] = {0.0, 0.0, 1.0}, force[2] = {0.0}, step[2];
    for (int k = 0; k < s->d; ++k)
        r[k] = point[k] - p.at[k];
    for (int i = 0, entry = 0; i < a; ++i)
    {
        force[i] = dot(s->d, p.tangent[i], r);
        for (int j = i; j < a; ++j, ++entry)
        {
            const int of = a == 1 ? 0 : entry;
            plain[of] = dot(s->d, p.tangent[i], p.tangent[j]);
            H[of] = plain[of] - dot(s->d, p.bend[of], r);
        }
    }
    const double floor = a == 1 ? plain[0] : least(plain[0], plain[1], plain[2]);
    const double lowest = a == 1 ? H[0] : least(H[0], H[1], H[2]);
    const double *use = lowest > CONVEX * floor ? H : plain;
    if (a == 1)
        step[0] = force[0] / use[0];
    else
    {
        const double det = use[0] * use[2] - use[1] * use[1];
        step[0] = (use[2] * force[0] - use[1] * force[1]) / det;
        step[1] = (use[0] * force[1] - use[1] * force[0]) / det;
    }
    double length = 0.0;
    for (int i = 0; i < a; ++i)
    {
        /* Points beyond the neighbouring facets do not matter: the iterate is kept near the facet. */
        const double next = clip(xi[i] + clip(step[i], -0.5, 0.5), -0.5, 1.5);
        length = fmax(length, fabs(next - xi[i]));
        xi[i] = next;
    }
    return length;
}

/* Nearest point of an edge; returns its distance, and whether it is between the edge's ends in `free`. */
static double on_edge(const surface *s, long f, int edge, const double *x, const double *point, double *xi, int *free)
{
    const int a = s->d - 1, n = s->nodes;
    const double *start = s->edge + 2 * edge * a, *along = start + a;
    const int bends = along[0] != 0.0 || (a == 2 && along[1] != 0.0);
    double course[s->bow + 1][3], t = bends ? 0.5 : 0.0, r[3], slope[3], bend[3];
    for (int e = 0; e <= s->bow; ++e)
    {
        const double *shape = s->course + (edge * (s->bow + 1) + e) * n;
        for (int k = 0; k < s->d; ++k)
        {
            course[e][k] = 0.0;
            for (int i = 0; i < n; ++i)
                course[e][k] += shape[i] * x[s->facet[f * n + i] * s->d + k];
        }
    }
    for (int iteration = 0; bends && iteration < PROJECTIONS; ++iteration)
    {
        for (int k = 0; k < s->d; ++k)
        {
            double at = 0.0;
            slope[k] = bend[k] = 0.0;
            for (int e = s->bow; e >= 0; --e)
            {
                bend[k] = bend[k] * t + 2.0 * slope[k];
                slope[k] = slope[k] * t + at;
                at = at * t + course[e][k];
            }
            r[k] = point[k] - at;
        }
        const double plain = dot(s->d, slope, slope), H = plain - dot(s->d, bend, r);
        const double step = dot(s->d, slope, r) / (H > CONVEX * plain ? H : plain), before = t;
        t = clip(t + clip(step, -0.5, 0.5), -0.5, 1.5);
        if (fabs(t - before) <= CLOSE)
            break;
    }
    const double held = clip(t, 0.0, 1.0);
    *free = bends && held == t;
    for (int i = 0; i < a; ++i)
        xi[i] = start[i] + held * along[i];
    for (int k = 0; k < s->d; ++k)
    {
        double at = 0.0;
        for (int e = s->bow; e >= 0; --e)
            at = at * held + course[e][k];
        r[k] = point[k] - at;
    }
    return sqrt(dot(s->d, r, r));
}

/* Where facet f is nearest to a point. If that is not inside the facet, it is the nearest of the nearest points of its
 * edges; for points far beside a facet it is only approximate. The columns of `free`, [d - 1][d - 1], span the
 * directions in which the nearest point may move. */
static void nearest(const surface *s, long f, const double *x, const double *point, double *xi, double *free)
{
    const int a = s->d - 1;
    for (int i = 0; i < a; ++i)
        xi[i] = s->centre[i];
    for (int iteration = 0; iteration < PROJECTIONS && step_over(s, f, x, point, xi) > CLOSE; ++iteration)
        ;
    const double low = a == 1 ? xi[0] : fmin(xi[0], xi[1]);
    const double high = a == 1 ? xi[0] : s->triangle ? xi[0] + xi[1] : fmax(xi[0], xi[1]);
    const int within = low >= -1e-12 && high <= 1.0 + 1e-12;
    for (int i = 0; i < a * a; ++i)
        free[i] = within && i % (a + 1) == 0 ? 1.0 : 0.0;
    if (within)
        return;
    const place beyond = place_at(s, f, x, xi);
    for (int i = 0; i < a; ++i)
        xi[i] = clip(xi[i], 0.0, 1.0);
    const place side = place_at(s, f, x, xi);
    if (!(distance(s, beyond.at, side.at) < ASIDE * distance(s, point, side.at)))
        return;
    double best = INFINITY;
    for (int edge = 0; edge < s->edges; ++edge)
    {
        double trial[2];
        int moves;
        const double apart = on_edge(s, f, edge, x, point, trial, &moves);
        if (!(apart < best))
            continue;
        best = apart;
        for (int i = 0; i < a; ++i)
        {
            xi[i] = trial[i];
            free[i * a] = moves ? s->edge[(2 * edge + 1) * a + i] : 0.0;
        }
    }
}
