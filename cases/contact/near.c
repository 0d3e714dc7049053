/* Facets of a surface that come near each other: whether there are any, and which ones. */

#include "sweep.h"

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
