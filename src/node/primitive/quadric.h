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
    Vec3 err;        /* bound on the error of each component of hi + lo */
} NearLine;

/* False if the line passes the origin at more than `radius` for certain, or has no direction. The point hi + lo is the
 * ray's own origin if that is near, so that a crossing next to it stays exact; otherwise it is the line's nearest to the
 * origin within its own rounding. The latter also where that is nearer than `centre` times the ray's origin: 0 for
 * surfaces that have no multiple root at the nearest point. */
bool near_line(const Ray *ray, double radius, double centre, NearLine *line);

/* The crossing at r, which is off by at most err: t = (t0 + r) 2^exponent. */
Crossing line_crossing(const NearLine *line, Dd r, double err);

/* a r^2 + 2 b r + c = 0 for the restriction of a quadric to a NearLine. */
typedef struct {
    Dd a, b, c;
    bool constant;       /* a = b = 0: no component of the direction takes part */
    int count;           /* real roots: 0, or 2 (which may be infinite if a is 0 or nearly so) */
    Crossing root[2];    /* in ascending order, as t of the ray */
} QuadricRoots;

void quadric_roots(const NearLine *line, Vec3 s, double k, QuadricRoots *roots);

/* plane_crossing where t or d is so large or small that t d can't be had in halves. */
Crossing plane_crossing_extreme(double o, double d, double value, uint32_t part);

/* The crossing with the plane where an axis has the given value; the direction's component of that axis isn't 0. */
static inline Crossing plane_crossing(double o, double d, double value, uint32_t part)
{
    Dd gap = dd_sum(value, -o);
    double t = gap.hi / d;
    double size = fabs(t), slope = fabs(d);
    if (!(size > 0x1p-900 && size < 0x1p900 && slope > 0x1p-900 && slope < 0x1p900))
        return plane_crossing_extreme(o, d, value, part);
    Dd td = dd_prod(t, d);
    double lo = ((gap.hi - td.hi) - td.lo + gap.lo) / d;
    Dd sum = dd_quick_sum(t, lo);
    return (Crossing){sum.hi, sum.lo, GAMMA(1) * fabs(sum.hi) + 0x1p-1074, part};
}

/* The crossing of a ray whose direction is 2^exponent times shorter. */
static inline Crossing crossing_scaled(Crossing c, int exponent)
{
    return (Crossing){ldexp(c.t, exponent), ldexp(c.lo, exponent), ldexp(c.err, exponent) + 0x1p-1074, c.part};
}

/* -- directions of any length -- */

/* The guesses bear directions whose squares are between 2^-400 and 2^400. A primitive that can't guess about another
 * one finds the crossings of the line with the direction brought into [1, 2) by a power of two. As every step of a
 * crossing commutes with such a scaling, the length of a direction in powers of two changes no hit. */
static inline bool ray_is_moderate(const Ray *ray)
{
    double m = vec3_max(vec3_abs(ray->d));
    return m > 0x1p-128 && m < 0x1p128;
}

/* PrimOps.intersect and segments by way of the primitive's own on the scaled line. A line with a crossing that a double
 * can't hold counts as a miss, and so does a direction that is 0 or not finite. */
bool rescaled_intersect(const Prim *prim, const Ray *ray, Hit *hit, Scratch *scratch);
bool rescaled_segments(const Prim *prim, const Ray *ray, SegList *list);

/* The ray's point at t + lo, correctly rounded but for a few u^2 of the greatest term. */
static inline double ray_component(double o, double d, double t, double lo)
{
    Dd td = dd_prod(t, d), s = dd_sum(o, td.hi);
    return s.hi + (s.lo + (td.lo + lo * d));
}

Vec3 ray_point(const Ray *ray, double t, double lo);

/* A component of the line's point nearest to `middle`, but for its direction's part along that axis. */
static inline double line_component(const Ray *ray, Vec3 middle, int axis)
{
    Vec3 d = vec3_scale(ray->d, vec3_pow2_scale(ray->d));
    double t = vec3_dot(vec3_sub(middle, ray->o), d) / vec3_dot(d, d);
    return vec3_get(ray->o, axis) + t * vec3_get(d, axis);
}

/* Lexicographic order of t + lo. */
static inline bool crossing_before(const Crossing *a, const Crossing *b)
{
    return a->t < b->t || (a->t == b->t && a->lo < b->lo);
}

/* The ray's point at t, split for squaring: hi has at most 24 bits after the point, so that for |hi| <= 3 the squares
 * are exact and so are their sums; lo is the rest. With t and d in halves (Veltkamp) the greatest term of o + t d is
 * exact, what remains is rounded at 2^-79 of |t d|. */
typedef struct { double hi, lo; } Split;

static inline Split split_component(double o, double d, double t_hi, double t_lo)
{
    double c = 0x8000001p0 * d, d_hi = c - (c - d), d_lo = d - d_hi;
    Dd s = dd_sum(o, t_hi * d_hi), p = dd_sum(s.hi, s.lo + (t_hi * d_lo + t_lo * d));
    double hi = (p.hi + 0x1.8p28) - 0x1.8p28;
    return (Split){hi, (p.hi - hi) + p.lo};
}

/* One Newton step for s.x x^2 + s.y y^2 + s.z z^2 + k from t, the residual being exact to about 2^-74. For a t of
 * moderate size whose own error is small to second order, at a point with coordinates below 2. */
static inline Crossing quadric_refine(const Ray *ray, Vec3 s, double k, double t, uint32_t part)
{
    Vec3 o = ray->o, d = ray->d;
    double c = 0x8000001p0 * t, t_hi = c - (c - t), t_lo = t - t_hi;
    double square = k, cross = 0, slope = 0, a = 0, reach = 1;
    if (s.x != 0) {
        Split x = split_component(o.x, d.x, t_hi, t_lo);
        square += s.x * (x.hi * x.hi);
        cross += s.x * (x.lo * (2 * x.hi + x.lo));
        slope += s.x * (x.hi * d.x);
        a += d.x * d.x;
        reach += fabs(o.x);
    }
    if (s.y != 0) {
        Split y = split_component(o.y, d.y, t_hi, t_lo);
        square += s.y * (y.hi * y.hi);
        cross += s.y * (y.lo * (2 * y.hi + y.lo));
        slope += s.y * (y.hi * d.y);
        a += d.y * d.y;
        reach += fabs(o.y);
    }
    if (s.z != 0) {
        Split z = split_component(o.z, d.z, t_hi, t_lo);
        square += s.z * (z.hi * z.hi);
        cross += s.z * (z.lo * (2 * z.hi + z.lo));
        slope += s.z * (z.hi * d.z);
        a += d.z * d.z;
        reach += fabs(o.z);
    }
    double half_inverse = 0.5 / slope, step = -(square + cross) * half_inverse;
    Dd sum = dd_quick_sum(t, step);
    /* the step's own error: the second-order term, the residual's rounding, and the slope's, which hi alone gave */
    double err = (4 * a * step * step + 0x1p-71 * reach) * fabs(half_inverse) + 0x1p-16 * fabs(step);
    return (Crossing){sum.hi, sum.lo, GAMMA(1) * fabs(sum.hi) + err, part};
}

/* Whether a ray starts outside s.x x^2 + s.y y^2 + s.z z^2 + k = 0 (no s negative) and moves away, so that it never meets
 * it: from there on a sum of squares only grows. So do most rays that leave the surface toward a light, whose crossing
 * behind them is too near 0 for any but the certain way. False where rounding (GAMMA(4) of the terms; for products that
 * underflow 3 2^-1075) leaves a doubt. */
static inline bool quadric_departs(const Ray *ray, Vec3 s, double k)
{
    Vec3 o = ray->o, d = ray->d;
    Vec3 square = vec3_make(s.x * o.x * o.x, s.y * o.y * o.y, s.z * o.z * o.z);
    Vec3 slope = vec3_make(s.x * o.x * d.x, s.y * o.y * d.y, s.z * o.z * d.z), size = vec3_abs(slope);
    double squares = square.x + square.y + square.z;
    return ray->tmin >= 0 && squares + k > GAMMA(4) * squares &&
           slope.x + slope.y + slope.z > GAMMA(4) * (size.x + size.y + size.z) + 0x1p-1073;
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

__attribute__((always_inline)) static inline bool convex_intersect(const Convex *shape, const Prim *prim, const Ray *ray,
                                                                   Hit *hit, Scratch *scratch)
{
    Guess guess;
    if (!shape->guess(ray, &guess)) return false;
    bool ahead = true;
    if (guess.sure) {
        if (guess.t[1] + guess.slack < ray->tmin || guess.t[0] - guess.slack > ray->tmax) return false;
        ahead = guess.t[0] + guess.slack >= ray->tmin;
    } else if (!ray_is_moderate(ray)) {
        return rescaled_intersect(prim, ray, hit, scratch);
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

/* Whether the guess alone tells if the ray meets anything; *blocked gets what it tells. */
__attribute__((always_inline)) static inline bool convex_guess_decides(const Convex *shape, const Ray *ray, bool *blocked)
{
    Guess guess;
    *blocked = false;
    if (!shape->guess(ray, &guess)) return true;
    if (!guess.sure) return false;
    double in = guess.t[0], out = guess.t[1], slack = guess.slack;
    if (out + slack < ray->tmin || in - slack > ray->tmax) return true;
    *blocked = (in - slack > ray->tmin && in + slack <= ray->tmax) || (out - slack > ray->tmin && out + slack <= ray->tmax);
    return *blocked;
}

/* The solid's `occluded`: the guess if it decides, and otherwise the table's intersect. */
__attribute__((always_inline)) static inline bool convex_occluded(const Convex *shape, const Prim *prim, const Ray *ray,
                                                                  Scratch *scratch)
{
    Hit hit;
    bool blocked;
    if (convex_guess_decides(shape, ray, &blocked)) return blocked;
    return prim->ops->intersect(prim, ray, &hit, scratch);
}

__attribute__((always_inline)) static inline bool convex_segments(const Convex *shape, const Prim *prim, const Ray *ray,
                                                                  SegList *list)
{
    Guess guess;
    if (!shape->guess(ray, &guess)) return true;
    if (!guess.sure && !ray_is_moderate(ray)) return rescaled_segments(prim, ray, list);
    Edge edge[2];
    for (int i = 0; i < 2; i++) {
        Crossing c;
        if (!convex_crossing(shape, ray, &guess, i, &c)) return true;
        /* the point to double precision: the normal only weighs errors of place, which are no less */
        edge[i] = (Edge){.t = c.t, .t_err = c.err, .u = c.lo, .part = c.part,
                         .n = shape->normal(vec3_at(ray->o, c.t, ray->d), c.part)};
    }
    return seg_list_add(list, edge[0], edge[1]);
}

#endif
