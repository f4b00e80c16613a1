/* What the sphere, the cylinder and the cone share: where a line meets the quadric s.x x^2 + s.y y^2 + s.z z^2 + k = 0
 * (each s is -1, 0 or 1), and the frame of a convex solid, which a line enters and leaves once.
 *
 * There are two ways to a crossing, chosen by the ray alone. Nearly always a double-precision guess is improved by one
 * Newton step on the implicit function evaluated in double-double. Where the guess can't be trusted (near a tangent,
 * from very far, with extreme directions, at a rim) the whole quadratic is solved in double-double about the point of
 * the line that is nearest to the solid. Either way t is the true value to within about one rounding, and the residual
 * that the double t leaves out is kept, so the point can be had far more exactly than t allows. */
#ifndef RT_NODE_PRIMITIVE_QUADRIC_H
#define RT_NODE_PRIMITIVE_QUADRIC_H

#include "common/dd.h"
#include "common/numeric.h"
#include "node/primitive/prim.h"

typedef struct {
    double t, lo;    /* the crossing is at t + lo; lo travels as the payload u of Hit and Edge */
    double err;      /* bound on |t - true t| */
    uint32_t part;
} Crossing;

/* -- the line, brought near the origin -- */

/* The ray's line as (hi + lo) + r d with d of greatest component in [1, 2): t = (t0 + r) 2^exponent. */
typedef struct {
    Vec3 hi, lo, d;
    Dd t0;
    int exponent;
    double err;      /* bound on the error of each component of hi + lo */
} NearLine;

/* False if the line passes the origin at more than `radius` for certain, or has no direction. */
bool near_line(const Ray *ray, double radius, NearLine *line);

/* a r^2 + 2 b r + c = 0 for the restriction of a quadric to a NearLine. */
typedef struct {
    Dd a, b, c;
    bool constant;       /* a = b = 0: no component of the direction takes part */
    int count;           /* real roots: 0, or 2 (which may be infinite if a is 0 or nearly so) */
    Crossing root[2];    /* in ascending order, as t of the ray */
} QuadricRoots;

void quadric_roots(const NearLine *line, Vec3 s, double k, QuadricRoots *roots);

/* The crossing with the plane where an axis has the given value; the direction's component of that axis isn't 0. */
static inline Crossing plane_crossing(double o, double d, double value, uint32_t part)
{
    Dd gap = dd_sum(value, -o);
    double t = gap.hi / d;
    if (!isfinite(t) || fabs(t) > 0x1p900 || fabs(t) < 0x1p-900 || fabs(d) < 0x1p-900 || fabs(d) > 0x1p900)
        return (Crossing){t, 0, GAMMA(2) * fabs(t) + 0x1p-1074, part};
    Dd td = dd_prod(t, d);
    double lo = ((gap.hi - td.hi) - td.lo + gap.lo) / d;
    Dd sum = dd_quick_sum(t, lo);
    return (Crossing){sum.hi, sum.lo, GAMMA(1) * fabs(sum.hi) + 0x1p-1074, part};
}

/* The ray's point at t + lo, correctly rounded but for a few u^2 of the greatest term. */
static inline double ray_component(double o, double d, double t, double lo)
{
    Dd td = dd_prod(t, d), s = dd_sum(o, td.hi);
    return s.hi + (s.lo + (td.lo + lo * d));
}

Vec3 ray_point(const Ray *ray, double t, double lo);

/* Lexicographic order of t + lo. */
static inline bool crossing_before(const Crossing *a, const Crossing *b)
{
    return a->t < b->t || (a->t == b->t && a->lo < b->lo);
}

/* One Newton step for s.x x^2 + s.y y^2 + s.z z^2 + k from t, residual in double-double. For a t whose own error is
 * second order small, on a ray of moderate magnitudes. */
static inline Crossing quadric_refine(const Ray *ray, Vec3 s, double k, double t, uint32_t part)
{
    double o[3] = {ray->o.x, ray->o.y, ray->o.z}, d[3] = {ray->d.x, ray->d.y, ray->d.z}, sign[3] = {s.x, s.y, s.z};
    double f_lo = 0, slope = 0, a = 0, reach = 1;
    Dd f = {k, 0};
    for (int i = 0; i < 3; i++) {
        if (sign[i] == 0) continue;
        Dd td = dd_prod(t, d[i]), p = dd_sum(o[i], td.hi);
        double p_lo = p.lo + td.lo;
        Dd sq = dd_prod(p.hi, p.hi);
        f = dd_sum(f.hi, sign[i] * sq.hi);
        f_lo += f.lo + sign[i] * (sq.lo + 2 * p.hi * p_lo);
        slope += sign[i] * p.hi * d[i];
        a += d[i] * d[i];
        reach += fabs(o[i]);
    }
    slope *= 2;
    double step = -(f.hi + f_lo) / slope;
    Dd sum = dd_quick_sum(t, step);
    /* the step's own error: the second-order term, the residual's u^2 rounding and the slope's rounding */
    double err = (4 * a * step * step + 0x1p-98 * reach) / fabs(slope) + 0x1p-40 * fabs(step);
    return (Crossing){sum.hi, sum.lo, GAMMA(1) * fabs(sum.hi) + err, part};
}

/* -- convex solids -- */

/* The two crossings in double precision. */
typedef struct {
    double t[2];        /* in, out; off by at most `slack` */
    uint32_t part[2];
    double slack;
    bool sure;          /* false: nothing is known but that the ray isn't a certain miss */
} Guess;

/* What a convex primitive supplies. */
typedef struct {
    bool (*guess)(const Ray *, Guess *);                             /* false: certainly no crossing */
    bool (*refine)(const Ray *, const Guess *, int i, Crossing *);   /* false: beyond it, take the exact way */
    bool (*exact)(const Ray *, Crossing[2]);                         /* false: no crossing */
    Vec3 (*normal)(Vec3 p, uint32_t part);
} Convex;

/* The functions below are inlined into each primitive, where the table is a constant. Which way a crossing is found
 * depends on the line and on the crossing alone, so intersect and segments give the same t. A line with a crossing that
 * a double can't hold (a direction of 1e-310) counts as a miss. */
__attribute__((always_inline)) static inline bool convex_crossing(const Convex *shape, const Ray *ray,
                                                                  const Guess *guess, int i, Crossing *crossing)
{
    if (guess->sure && shape->refine(ray, guess, i, crossing)) return true;
    Crossing c[2];
    if (!shape->exact(ray, c)) return false;
    *crossing = c[i];
    return isfinite(c[0].t) && isfinite(c[1].t);
}

__attribute__((always_inline)) static inline bool convex_intersect(const Convex *shape, const Ray *ray, Hit *hit)
{
    Guess guess;
    if (!shape->guess(ray, &guess)) return false;
    bool ahead = true;
    if (guess.sure) {
        if (guess.t[1] + guess.slack < ray->tmin || guess.t[0] - guess.slack > ray->tmax) return false;
        ahead = guess.t[0] + guess.slack >= ray->tmin;
    }
    for (int i = ahead ? 0 : 1; i < 2; i++) {
        Crossing c;
        if (convex_crossing(shape, ray, &guess, i, &c) && c.t > ray->tmin) {
            if (!(c.t <= ray->tmax)) return false;
            *hit = (Hit){.t = c.t, .u = c.lo, .part = c.part, .object = hit->object};
            return true;
        }
    }
    return false;
}

__attribute__((always_inline)) static inline bool convex_segments(const Convex *shape, const Ray *ray, SegList *list)
{
    Guess guess;
    if (!shape->guess(ray, &guess)) return true;
    Edge edge[2];
    for (int i = 0; i < 2; i++) {
        Crossing c;
        if (!convex_crossing(shape, ray, &guess, i, &c)) return true;
        edge[i] = (Edge){.t = c.t, .t_err = c.err, .u = c.lo, .part = c.part,
                         .n = shape->normal(ray_point(ray, c.t, c.lo), c.part)};
    }
    return seg_list_add(list, edge[0], edge[1]);
}

#endif
