/* Facets of a surface: their points, normals and breadths. */

#pragma once

#include <math.h>
#include <stdint.h>

/* Facets of a surface. The first `soft` belong to the mesh; the rigid ones after them count as facing all others.
 * A shape function is the sum of monomials of the reference coordinates times `weights` (`facets.py`). */
typedef struct
{
    long facets, soft;
    int nodes, d, points, edges, triangle, bow; /* bow: degree of the shape functions along an edge */
    const int64_t *facet;              /* [facets][nodes] */
    const int64_t *powers;             /* exponents of the monomials: [nodes][d - 1] */
    const int64_t *fold, *folded;      /* facets that each soft one does not meet: [soft + 1], and their numbers */
    const double *sign, *breadth;      /* [facets] */
    const double *values, *slopes;     /* shape functions at the points: [points][nodes], [points][d - 1][nodes] */
    const double *centre, *middle;     /* the facet's middle, [d - 1], and the slopes there, [d - 1][nodes] */
    const double *weights;             /* [nodes][nodes] */
    const double *edge;                /* start and direction of each edge: [edges][2][d - 1] */
    const double *course;              /* powers of the way along each edge in them: [edges][bow + 1][nodes] */
    const double *X;                   /* positions of the nodes in the body at rest: [nodes of all facets][d] */
    double *frame;                     /* workspace: [facets][FRAME] */
    int64_t *near;                     /* workspace: [facets] */
} surface;

/* Numbers for a facet: centre, unit normal there, radius, and its highest and lowest node along that normal. */
#define FRAME 9

static double dot(int d, const double *a, const double *b)
{
    double total = 0.0;
    for (int k = 0; k < d; ++k)
        total += a[k] * b[k];
    return total;
}

/* Outward unit normal of facet f where it has these tangents. */
static void outward(const surface *s, long f, double t[2][3], double *normal)
{
    const int d = s->d;
    if (d == 2)
    {
        normal[0] = t[0][1];
        normal[1] = -t[0][0];
    }
    else
        for (int k = 0; k < 3; ++k)
            normal[k] = t[0][(k + 1) % 3] * t[1][(k + 2) % 3] - t[0][(k + 2) % 3] * t[1][(k + 1) % 3];
    const double length = sqrt(dot(d, normal, normal));
    for (int k = 0; k < d; ++k)
        normal[k] *= s->sign[f] / length;
}

/* Outward unit normal of facet f where the shape functions have these slopes. */
static void upright(const surface *s, long f, const double *slope, const double *x, double *normal)
{
    const int d = s->d;
    double t[2][3] = {{0.0}};
    for (int n = 0; n < s->nodes; ++n)
        for (int a = 0; a < d - 1; ++a)
            for (int k = 0; k < d; ++k)
                t[a][k] += slope[a * s->nodes + n] * x[s->facet[f * s->nodes + n] * d + k];
    outward(s, f, t, normal);
}

static double distance(const surface *s, const double *one, const double *other)
{
    double square = 0.0;
    for (int k = 0; k < s->d; ++k)
        square += (one[k] - other[k]) * (one[k] - other[k]);
    return sqrt(square);
}

/* Position of point q of facet f. */
static void position(const surface *s, long f, int q, const double *x, double *at)
{
    for (int k = 0; k < s->d; ++k)
        at[k] = 0.0;
    for (int n = 0; n < s->nodes; ++n)
        for (int k = 0; k < s->d; ++k)
            at[k] += s->values[q * s->nodes + n] * x[s->facet[f * s->nodes + n] * s->d + k];
}

/* Mean breadth of two facets; for a rigid facet m, the breadth of the soft one. */
static double span(const surface *s, long f, long m)
{
    return 0.5 * (s->breadth[f] + s->breadth[m < s->soft ? m : f]);
}
