/* Test whether any surfaces come near each other, over every pair of facets, after every step of a march. */

#include <math.h>
#include <stdint.h>

/* Facets of a surface. The first `soft` belong to the mesh; the rigid ones after them count as facing all others. */
typedef struct
{
    long facets, soft;
    int nodes, d, points;
    const int64_t *facet;              /* [facets][nodes] */
    const double *sign, *breadth;      /* [facets] */
    const double *values, *slopes;     /* shape functions at the points: [points][nodes], [points][d - 1][nodes] */
    const double *middle;              /* slopes in the facet's middle: [d - 1][nodes] */
    double *frame;                     /* workspace: [facets][FRAME] */
    const int64_t *fold, *folded;      /* facets that each soft one does not meet: [soft + 1], and their numbers */
} surface;

/* Numbers for a facet: centre, unit normal there, radius, and its highest and lowest node along that normal. */
#define FRAME 9

/* Whether soft facet f does not meet facet m, because both are parts of a fold (`folds.py`). */
static int folded(const surface *s, long f, long m)
{
    for (int64_t i = s->fold[f]; i < s->fold[f + 1]; ++i)
        if (s->folded[i] == m)
            return 1;
    return 0;
}

static double dot(int d, const double *a, const double *b)
{
    double total = 0.0;
    for (int k = 0; k < d; ++k)
        total += a[k] * b[k];
    return total;
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

static void framed(const surface *s, long f, const double *x)
{
    const int d = s->d;
    double *own = s->frame + f * FRAME, *normal = own + 3, way[3];
    for (int k = 0; k < FRAME; ++k)
        own[k] = 0.0;
    for (int n = 0; n < s->nodes; ++n)
        for (int k = 0; k < d; ++k)
            own[k] += x[s->facet[f * s->nodes + n] * d + k] / s->nodes;
    upright(s, f, s->middle, x, normal);
    for (int n = 0; n < s->nodes; ++n)
    {
        for (int k = 0; k < d; ++k)
            way[k] = x[s->facet[f * s->nodes + n] * d + k] - own[k];
        const double height = dot(d, way, normal);
        own[6] = fmax(own[6], sqrt(dot(d, way, way)));
        own[7] = fmax(own[7], height);
        own[8] = fmin(own[8], height);
    }
}

/* Whether a point of facet f may penetrate facet m, no deeper than `deep`. */
static int enters(const surface *s, long f, long m, const double *x, double deep, double maybe)
{
    const int d = s->d;
    const double *its = s->frame + m * FRAME, *normal = its + 3, slack = 0.1 * (its[7] - its[8]);
    for (int q = 0; q < s->points; ++q)
    {
        double way[3] = {0.0}, own[3];
        for (int n = 0; n < s->nodes; ++n)
            for (int k = 0; k < d; ++k)
                way[k] += s->values[q * s->nodes + n] * x[s->facet[f * s->nodes + n] * d + k];
        for (int k = 0; k < d; ++k)
            way[k] -= its[k];
        const double up = dot(d, way, normal), reach = 1.05 * its[6] + deep;
        if (up >= its[7] + slack || up <= its[8] - slack - deep || dot(d, way, way) >= reach * reach)
            continue;
        if (m >= s->soft)
            return 1;
        upright(s, f, s->slopes + q * (d - 1) * s->nodes, x, own);
        if (dot(d, own, normal) < maybe)
            return 1;
    }
    return 0;
}

/* 1 if some point may penetrate another facet, no deeper than `reach` times their breadth. Facets whose normals have a
 * cosine of `maybe` or more do not face each other. x: positions of the nodes, [nodes][d]. */
int meeting(const surface *s, const double *x, double reach, double maybe)
{
    for (long f = 0; f < s->facets; ++f)
        framed(s, f, x);
    for (long f = 0; f < s->soft; ++f)
        for (long m = f + 1; m < s->facets; ++m)
        {
            const double *one = s->frame + f * FRAME, *other = s->frame + m * FRAME;
            const double deep = reach * 0.5 * (s->breadth[f] + s->breadth[m < s->soft ? m : f]);
            /* Curved facets lie a little outside of their nodes' sphere. */
            const double room = 1.05 * (one[6] + other[6]) + deep;
            double square = 0.0;
            for (int k = 0; k < s->d; ++k)
                square += (one[k] - other[k]) * (one[k] - other[k]);
            if (!(square < room * room) || (m < s->soft && dot(s->d, one + 3, other + 3) >= maybe))
                continue;
            if (folded(s, f, m))
                continue;
            if (enters(s, f, m, x, deep, maybe) || (m < s->soft && enters(s, m, f, x, deep, maybe)))
                return 1;
        }
    return 0;
}
