/* Points that penetrate other facets, and the points of these facets that are nearest to them (`search.py`). */

#include <float.h>
#include <stdlib.h>

#include "nearest.h"
#include "sweep.h"

/* Two surfaces face each other if the cosine between their normals is below this. */
#define FACING -0.5
/* There is rubber between two points if the line from one to the other leads into the rubber of the body at rest: its
 * cosine to the inward normal exceeds the first value at one end, or the second at both. In a fold of a flat face the
 * cosines are zero. */
#define THROUGH 0.7
#define BOTH 0.3
/* Least cosine between the line to the nearest point and the facet's normal; at an edge, less means that the point lies
 * beside the facet. */
#define BESIDE 0.7
/* Relative size of the term that decides between two facets whose common edge is nearest to a point. */
#define TIE 1e-6
/* Facets are taken for further away than another where their frames are by this share of their breadth: frames are made
 * from nodes, and curved facets lie a little outside of them. */
#define MARGIN 0.05

/* Whether rubber lies between point q of facet f and the place xi of facet m in the body at rest. */
static int through(const surface *s, long f, int q, long m, const double *xi)
{
    double here[3], way[3], own[3], its[3];
    position(s, f, q, s->X, here);
    place there = place_at(s, m, s->X, xi);
    upright(s, f, s->slopes + q * (s->d - 1) * s->nodes, s->X, own);
    outward(s, m, there.tangent, its);
    const double length = fmax(distance(s, there.at, here), DBL_MIN);
    for (int k = 0; k < s->d; ++k)
        way[k] = (there.at[k] - here[k]) / length;
    const double one = dot(s->d, way, own), other = -dot(s->d, way, its);
    return fmin(one, other) < -THROUGH || fmax(one, other) < -BOTH;
}

/* A facet that a point may have penetrated. */
typedef struct
{
    double key, behind, xi[2], free[4], r[3];
    long other;
} candidate;

/* Take facet m for `best` if it is nearer to point q of facet f, which is at `at`, and the two may meet. */
static void compare(const surface *s, long f, int q, long m, const double *x, const double *at, double reach,
                    candidate *best)
{
    candidate one;
    double normal[3], own[3];
    nearest(s, m, x, at, one.xi, one.free);
    place p = place_at(s, m, x, one.xi);
    for (int k = 0; k < s->d; ++k)
        one.r[k] = at[k] - p.at[k];
    const double depth = sqrt(dot(s->d, one.r, one.r));
    if (!(depth > 0.0 && depth < reach * span(s, f, m)))
        return;
    outward(s, m, p.tangent, normal);
    one.behind = -dot(s->d, one.r, normal) / fmax(depth, DBL_MIN);
    /* At a common edge, the facet that the point lies over. */
    one.key = depth * (1.0 - TIE * fabs(one.behind));
    if (!(one.key < best->key))
        return;
    if (m < s->soft)
    {
        upright(s, f, s->slopes + q * (s->d - 1) * s->nodes, x, own);
        if (!(dot(s->d, normal, own) < FACING) || through(s, f, q, m, one.xi))
            return;
    }
    one.other = m;
    *best = one;
}

/* Put the facet whose middle is nearest to a point first among the `near` ones: others can then be excluded sooner. */
static void first(const surface *s, long near, const double *at)
{
    double least_square = INFINITY;
    long best = 0;
    for (long i = 0; i < near; ++i)
    {
        const double *middle = s->frame + s->near[i] * FRAME;
        double square = 0.0;
        for (int k = 0; k < s->d; ++k)
            square += (at[k] - middle[k]) * (at[k] - middle[k]);
        if (square < least_square)
        {
            least_square = square;
            best = i;
        }
    }
    const int64_t facet = s->near[best];
    s->near[best] = s->near[0];
    s->near[0] = facet;
}

static int by_number(const void *one, const void *other)
{
    const int64_t a = *(const int64_t *)one, b = *(const int64_t *)other;
    return a < b ? -1 : a > b;
}

/* Collect the facets that are `close_by` to soft facet f in `near`, in the order of their numbers; returns how many. */
static long gathered(const surface *s, const sweep *w, long f, double reach, double maybe)
{
    const double here = w->stops[w->rank[f]].at, far = window(s, w, f, reach);
    long near = 0;
    for (int way = -1; way <= 1; way += 2)
        for (long i = w->rank[f] + way; i >= 0 && i < s->facets && fabs(w->stops[i].at - here) <= far; i += way)
        {
            const long m = w->stops[i].facet;
            if (close_by(s, f, m, reach * span(s, f, m), maybe))
                s->near[near++] = m;
        }
    qsort(s->near, near, sizeof(int64_t), by_number);
    return near;
}

/* Points that penetrate other facets by no more than `reach` times their breadth. For each: its facet, its number
 * there, the facet that it penetrates, the nearest point on it with the directions in which that may move ([d - 1], and
 * [d - 1][d - 1] by columns), and the vector from there to the point ([d]). Returns how many; there is room for two for
 * each point, of which one penetrates a soft facet and one a rigid one. */
long inside(const surface *s, const double *x, double reach, double maybe, int64_t *facet, int64_t *point,
            int64_t *other, double *xi, double *free, double *r)
{
    const int a = s->d - 1;
    long count = 0;
    sweep w = swept(s, x);
    for (long f = 0; f < s->soft; ++f)
    {
        const long near = gathered(s, &w, f, reach, maybe);
        for (int q = 0; near > 0 && q < s->points; ++q)
        {
            double at[3];
            int some = 0;
            candidate best[2] = {{.key = INFINITY}, {.key = INFINITY}};
            position(s, f, q, x, at);
            for (long i = 0; i < near && !some; ++i)
                some = enters(s, f, q, s->near[i], x, at, reach * span(s, f, s->near[i]), maybe);
            if (some)
                first(s, near, at);
            for (long i = 0; some && i < near; ++i)
            {
                const long m = s->near[i];
                candidate *nearer = best + (m >= s->soft);
                /* A facet further away than the nearest so far does not count. */
                const double broad = span(s, f, m), deep = fmin(reach * broad, nearer->key + MARGIN * broad);
                if (beside(s, m, at, deep, deep))
                    compare(s, f, q, m, x, at, reach, nearer);
            }
            for (int hard = 0; hard < 2; ++hard)
            {
                if (!(best[hard].key < INFINITY) || !(best[hard].behind > BESIDE))
                    continue;
                facet[count] = f;
                point[count] = q;
                other[count] = best[hard].other;
                for (int i = 0; i < a; ++i)
                    xi[count * a + i] = best[hard].xi[i];
                for (int i = 0; i < a * a; ++i)
                    free[count * a * a + i] = best[hard].free[i];
                for (int k = 0; k < s->d; ++k)
                    r[count * s->d + k] = best[hard].r[k];
                ++count;
            }
        }
    }
    release(&w);
    return count;
}
