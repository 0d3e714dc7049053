/* Points that penetrate other facets, and the points of these facets that are nearest to them (`search.py`). */

#include <float.h>

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

/* A place on a facet: position, tangents, and second derivatives by (0,0), (0,1), (1,1) of the reference coordinates. */
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

static double distance(const surface *s, const double *one, const double *other)
{
    double square = 0.0;
    for (int k = 0; k < s->d; ++k)
        square += (one[k] - other[k]) * (one[k] - other[k]);
    return sqrt(square);
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
