/* Facets of a surface that come near each other: whether there are any, and which ones. */

#include <math.h>
#include <stdint.h>
#include <stdlib.h>

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

/* Mean breadth of two facets; for a rigid facet m, the breadth of the soft one. */
static double span(const surface *s, long f, long m)
{
    return 0.5 * (s->breadth[f] + s->breadth[m < s->soft ? m : f]);
}

/* Whether the facets' spheres come nearer to each other than `deep`, and their sides may face each other. */
static int close_by(const surface *s, long f, long m, double deep, double maybe)
{
    const double *one = s->frame + f * FRAME, *other = s->frame + m * FRAME;
    /* Curved facets lie a little outside of their nodes' sphere. */
    const double room = 1.05 * (one[6] + other[6]) + deep;
    double square = 0.0;
    for (int k = 0; k < s->d; ++k)
        square += (one[k] - other[k]) * (one[k] - other[k]);
    if (!(square < room * room) || (m < s->soft && dot(s->d, one + 3, other + 3) >= maybe))
        return 0;
    return !folded(s, f, m);
}

/* A facet's centre along an axis. */
typedef struct
{
    double at;
    long facet;
} stop;

/* All facets in the order of their centres along the axis of the largest extent. */
typedef struct
{
    stop *stops;    /* [facets] */
    long *rank;     /* place of each facet among them */
    double radius;  /* the largest of a facet */
    double breadth; /* the largest of a facet */
} sweep;

static int by_place(const void *one, const void *other)
{
    const stop *a = one, *b = other;
    if (a->at != b->at)
        return a->at < b->at ? -1 : 1;
    return a->facet < b->facet ? -1 : a->facet > b->facet;
}

/* Frames of the facets with the nodes at x, and their order. */
static sweep swept(const surface *s, const double *x)
{
    sweep w = {malloc(sizeof(stop) * s->facets), malloc(sizeof(long) * s->facets), 0.0, 0.0};
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (long f = 0; f < s->facets; ++f)
    {
        const double *own = s->frame + f * FRAME;
        framed(s, f, x);
        for (int k = 0; k < s->d; ++k)
        {
            low[k] = fmin(low[k], own[k]);
            high[k] = fmax(high[k], own[k]);
        }
        w.radius = fmax(w.radius, own[6]);
        w.breadth = fmax(w.breadth, s->breadth[f]);
    }
    int axis = 0;
    for (int k = 1; k < s->d; ++k)
        if (high[k] - low[k] > high[axis] - low[axis])
            axis = k;
    for (long f = 0; f < s->facets; ++f)
        w.stops[f] = (stop){s->frame[f * FRAME + axis], f};
    qsort(w.stops, s->facets, sizeof(stop), by_place);
    for (long i = 0; i < s->facets; ++i)
        w.rank[w.stops[i].facet] = i;
    return w;
}

/* Largest distance along the axis at which a facet may be `close_by` to facet f. */
static double window(const surface *s, const sweep *w, long f, double reach)
{
    return 1.05 * (s->frame[f * FRAME + 6] + w->radius) + reach * w->breadth;
}

static void release(sweep *w)
{
    free(w->stops);
    free(w->rank);
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

/* Whether a point may lie behind facet m, no deeper than `deep`, or before it, no further than `before`. */
static int beside(const surface *s, long m, const double *at, double deep, double before)
{
    const double *its = s->frame + m * FRAME, *normal = its + 3, slack = 0.1 * (its[7] - its[8]);
    double way[3];
    for (int k = 0; k < s->d; ++k)
        way[k] = at[k] - its[k];
    const double up = dot(s->d, way, normal), reach = 1.05 * its[6] + deep;
    return up < its[7] + slack + before && up > its[8] - slack - deep && dot(s->d, way, way) < reach * reach;
}

/* Whether point q of facet f, at `at`, may penetrate facet m, no deeper than `deep`. */
static int enters(const surface *s, long f, int q, long m, const double *x, const double *at, double deep,
                  double maybe)
{
    double own[3];
    if (!beside(s, m, at, deep, 0.0))
        return 0;
    if (m >= s->soft)
        return 1;
    upright(s, f, s->slopes + q * (s->d - 1) * s->nodes, x, own);
    return dot(s->d, own, s->frame + m * FRAME + 3) < maybe;
}

static int any_enters(const surface *s, long f, long m, const double *x, double deep, double maybe)
{
    double at[3];
    for (int q = 0; q < s->points; ++q)
    {
        position(s, f, q, x, at);
        if (enters(s, f, q, m, x, at, deep, maybe))
            return 1;
    }
    return 0;
}

/* 1 if some point may penetrate another facet, no deeper than `reach` times their breadth. Facets whose normals have a
 * cosine of `maybe` or more do not face each other. x: positions of the nodes, [nodes][d]. */
int meeting(const surface *s, const double *x, double reach, double maybe)
{
    sweep w = swept(s, x);
    int met = 0;
    for (long i = 0; i < s->facets && !met; ++i)
    {
        const double end = w.stops[i].at + window(s, &w, w.stops[i].facet, reach);
        for (long j = i + 1; j < s->facets && w.stops[j].at <= end && !met; ++j)
        {
            const long one = w.stops[i].facet, other = w.stops[j].facet;
            const long f = one < other ? one : other, m = one < other ? other : one;
            const double deep = reach * span(s, f, m);
            if (f >= s->soft || !close_by(s, f, m, deep, maybe))
                continue;
            met = any_enters(s, f, m, x, deep, maybe) || (m < s->soft && any_enters(s, m, f, x, deep, maybe));
        }
    }
    release(&w);
    return met;
}

/* Pairs of soft facets that face each other at less than their breadth, (f, m) and (m, f). Returns how many; writes
 * them to `pairs`, [count][2], unless that is null. */
long facing_pairs(const surface *s, const double *x, double maybe, int64_t *pairs)
{
    long count = 0;
    for (long f = 0; f < s->soft; ++f)
        framed(s, f, x);
    for (long f = 0; f < s->soft; ++f)
        for (long m = 0; m < s->soft; ++m)
        {
            const double *one = s->frame + f * FRAME, *its = s->frame + m * FRAME, broad = span(s, f, m);
            double way[3];
            for (int k = 0; k < s->d; ++k)
                way[k] = one[k] - its[k];
            const double apart = dot(s->d, way, its + 3), aside = dot(s->d, way, way) - apart * apart;
            if (f == m || !(fabs(apart) < broad && aside < 4.0 * broad * broad))
                continue;
            if (dot(s->d, one + 3, its + 3) >= maybe || folded(s, f, m))
                continue;
            if (pairs)
            {
                pairs[2 * count] = f;
                pairs[2 * count + 1] = m;
            }
            ++count;
        }
    return count;
}
