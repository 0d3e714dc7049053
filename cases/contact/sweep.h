/* Facets in the order of their centres along an axis, and tests of which ones may meet. */

#pragma once

#include <stdlib.h>

#include "surface.h"

/* Whether soft facet f does not meet facet m, because both are parts of a fold (`folds.py`). */
static int folded(const surface *s, long f, long m)
{
    for (int64_t i = s->fold[f]; i < s->fold[f + 1]; ++i)
        if (s->folded[i] == m)
            return 1;
    return 0;
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
