/* A ray's line and a triangle: whether they cross, exactly, and where, to the last place but one.
 *
 * Whether: the signs of the three determinants of the ray and an edge each, orient3d (Shewchuk, "Adaptive precision
 * floating-point arithmetic and fast robust geometric predicates", 1997). They are estimated as in Woop, Benthin, Wald,
 * "Watertight ray/triangle intersection" (JCGT 2013), in double: vertices are moved to the ray's origin and sheared so
 * that the ray runs along an axis; three 2D edge functions are left. Where their rounding could change a sign, it is
 * taken from the coordinates without any rounding. A determinant that is zero is settled as if the ray were moved by an
 * infinitesimal (e, e^2) along the axes across, as in Edelsbrunner, Muecke, "Simulation of simplicity" (1990). The sign
 * is a function of the line and the edge, odd in the edge's ends, so a line that meets a closed mesh at an edge or a
 * vertex crosses exactly one of the triangles there on each way through: no leaks, no double hits, and parity is exact,
 * as CSG needs.
 *
 * Where: t = n . (a - o) / n . d in twice the precision, n being the normal; nothing of it depends on weights or sheared
 * vertices. See triangle_t. */
#ifndef RT_ACCEL_TRIANGLE_H
#define RT_ACCEL_TRIANGLE_H

#include <stdbool.h>

#include "common/dd.h"
#include "common/numeric.h"
#include "common/ray.h"

/* The ray along +z: x' = x - sx z and so on, axes permuted so that z is the direction's greatest component. */
typedef struct {
    const Ray *ray;
    Vec3 d;                  /* the ray's, times `scale`, the power of two that makes its greatest component 1 to 2 */
    double scale;
    double ox, oy, oz;       /* the origin, permuted */
    double sx, sy, sz;       /* sz: 1 / d.z, by which z becomes t in units of 1 / scale */
    size_t kx, ky, kz;
} Shear;

/* The ray must stay where it is as long as the result is used. */
static inline Shear shear_of(const Ray *ray)
{
    Shear s = {.ray = ray, .scale = vec3_pow2_scale(ray->d)};
    s.d = vec3_scale(ray->d, s.scale);
    Vec3 a = vec3_abs(s.d);
    s.kz = a.x >= a.y ? (a.x >= a.z ? 0 : 2) : (a.y >= a.z ? 1 : 2);
    s.kx = (s.kz + 1) % 3;
    s.ky = (s.kz + 2) % 3;
    const double *d = &s.d.x, *o = &ray->o.x;
    s.ox = o[s.kx];
    s.oy = o[s.ky];
    s.oz = o[s.kz];
    s.sx = d[s.kx] / d[s.kz];
    s.sy = d[s.ky] / d[s.kz];
    s.sz = 1.0 / d[s.kz];
    return s;
}

typedef struct { double x, y, z; } Sheared;

static inline Sheared shear(const Shear *s, const Vec3 *vertex)
{
    const double *p = &vertex->x;
    double z = p[s->kz] - s->oz;
    return (Sheared){p[s->kx] - s->ox - s->sx * z, p[s->ky] - s->oy - s->sy * z, z};
}

/* Twice the signed area of the triangle (0, p, q). */
static inline double edge_function(Sheared p, Sheared q) { return p.x * q.y - p.y * q.x; }

static inline double larger(double a, double b) { return a > b ? a : b; }
static inline double smaller(double a, double b) { return a < b ? a : b; }

/* Bound on the error of the edge functions of a triangle. With u the unit roundoff, m the greatest of |x|, |y| and z of
 * |z| over the three: of a sheared coordinate X - s Z the difference X carries one rounding, the product three (Z, s and
 * its own), the result one, and |X| <= |x| + |Z| as |s| <= 1; so it is off by h = u (2 m + 4 z). An edge function is off by
 * 4 m h + 2 h^2 from that, and by 4 u m^2 from its two products and their difference: by 12 u m^2 + 16 u m z +
 * 2 u^2 (2 m + 4 z)^2 <= 16 u (m + 8 u z) (m + z). One more u covers what is of higher order and the roundings of the
 * bound itself, 2^-1000 what underflows. *z_most becomes z. */
static inline double edge_margin(Sheared a, Sheared b, Sheared c, double *z_most)
{
    double mx = larger(larger(fabs(a.x), fabs(b.x)), fabs(c.x)), my = larger(larger(fabs(a.y), fabs(b.y)), fabs(c.y));
    double m = larger(mx, my), z = larger(larger(fabs(a.z), fabs(b.z)), fabs(c.z));
    *z_most = z;
    return 17 * UNIT_ROUNDOFF * ((m + 8 * UNIT_ROUNDOFF * z) * (m + z)) + 0x1p-1000;
}

/* The sign of the edge function of p and q by the rule above, always right; 0 for an edge along the ray. *value becomes
 * the edge function within a few roundings. For where an estimate is below its margin. */
int edge_sign(const Shear *s, const Vec3 *p, const Vec3 *q, double *value);

/* The common sign of the edge functions opposite to a, b and c, of which `edge` has estimates; 0 if they differ. Makes
 * those that are below the margin accurate. */
int edge_signs(const Shear *s, const Vec3 *a, const Vec3 *b, const Vec3 *c, double margin, double edge[3]);

/* Where a line crosses a triangle (a, b, c). */
typedef struct {
    double u, v;         /* weights of b and c, in [0, 1] */
    double z, z_err;     /* sheared, and how far the true one is from that at most */
    int facing;          /* 1 or -1: the sign of the sheared triangle's area, seen along z */
} TriangleCut;

/* False if the line passes the triangle. A triangle that is seen exactly edge on is never crossed.
 *
 * z is the mean of the vertices' z by the edge functions, of sum S. These are off by the margin M, which moves it by at
 * most 3 M / |S| of the way between two vertices, 2 |z| at most. The z are off by u, which the weights can double, the
 * mean's three products, two sums and quotient by 8 more. */
static inline __attribute__((always_inline)) bool triangle_cut(const Shear *s, const Vec3 *a, const Vec3 *b, const Vec3 *c,
                                                               TriangleCut *cut)
{
    Sheared A = shear(s, a), B = shear(s, b), C = shear(s, c);
    double edge[3] = {edge_function(C, B), edge_function(A, C), edge_function(B, A)};
    double z_most, margin = edge_margin(A, B, C, &z_most);
    double least = smaller(smaller(edge[0], edge[1]), edge[2]), most = larger(larger(edge[0], edge[1]), edge[2]);
    if (least < -margin && most > margin) return false;
    cut->facing = least > 0 ? 1 : -1;
    if (!(least > margin || most < -margin)) {
        cut->facing = edge_signs(s, a, b, c, margin, edge);
        if (cut->facing == 0) return false;
    }
    double sum = edge[0] + edge[1] + edge[2], r = sum != 0 ? 1 / sum : 0;  /* 0 by underflow only */
    cut->u = edge[1] * r;
    cut->v = edge[2] * r;
    cut->z = (edge[0] * A.z + edge[1] * B.z + edge[2] * C.z) * r;
    cut->z_err = sum != 0 ? z_most * (7 * margin * fabs(r) + 12 * UNIT_ROUNDOFF) : INFINITY;
    return true;
}

/* Whether the line goes against the normal (b - a) x (c - a) there. */
static inline bool triangle_entered(const Shear *s, const TriangleCut *cut) { return (s->sz > 0) == (cut->facing > 0); }

/* The t, in the ray's units, between which the crossing is, with the roundings of t and its bounds themselves. */
typedef struct { double lo, hi; } TriangleSpan;

static inline TriangleSpan triangle_span(const Shear *s, const TriangleCut *cut)
{
    double t = cut->z * s->sz, err = cut->z_err * fabs(s->sz) + 6 * UNIT_ROUNDOFF * fabs(t);
    return (TriangleSpan){(t - err) * s->scale, (t + err) * s->scale};
}

/* (b - a) x (c - a) in double; *size becomes the sums of the products' magnitudes. A component is off by at most 4 u of
 * its size: a product carries the roundings of two edges and its own, and their difference one more. */
static inline Vec3 triangle_cross(const Vec3 *a, const Vec3 *b, const Vec3 *c, Vec3 *size)
{
    Vec3 e = vec3_sub(*b, *a), f = vec3_sub(*c, *a);
    Vec3 p = vec3_make(e.y * f.z, e.z * f.x, e.x * f.y), q = vec3_make(e.z * f.y, e.x * f.z, e.y * f.x);
    *size = vec3_add(vec3_abs(p), vec3_abs(q));
    return vec3_sub(p, q);
}

/* Whether the crossing is surely behind the ray's origin: the sign of n . (a - o), where double can tell, against that of
 * n . d, which is known. The sum is off by 8 u of its sizes, 4 for n, one for the difference and three for the products
 * and sums. It spares the rays that have just left a triangle the way through triangle_t. */
static inline bool triangle_behind(const Shear *s, const Vec3 *a, const Vec3 *b, const Vec3 *c, const TriangleCut *cut)
{
    Vec3 size, n = triangle_cross(a, b, c, &size), to = vec3_sub(*a, s->ray->o);
    double side = vec3_dot(n, to), doubt = 9 * UNIT_ROUNDOFF * vec3_dot(size, vec3_abs(to)) + 0x1p-900;
    return triangle_entered(s, cut) ? side > doubt : side < -doubt;
}

/* Whether the plane of a triangle is surely behind a ray's origin: n . (a - o) and n . d have opposite signs, each off by
 * less than 9 u of its sizes, as above. It needs no shear: it is for rays that have just left that plane. */
static inline bool plane_behind(const Ray *ray, const Vec3 *a, const Vec3 *b, const Vec3 *c)
{
    Vec3 size, n = triangle_cross(a, b, c, &size), to = vec3_sub(*a, ray->o);
    double side = vec3_dot(n, to), side_doubt = 9 * UNIT_ROUNDOFF * vec3_dot(size, vec3_abs(to)) + 0x1p-900;
    double slope = vec3_dot(n, ray->d), slope_doubt = 9 * UNIT_ROUNDOFF * vec3_dot(size, vec3_abs(ray->d)) + 0x1p-900;
    return (side > side_doubt && slope < -slope_doubt) || (side < -side_doubt && slope > slope_doubt);
}

/* Vectors in twice the precision, sums of two doubles for each of x, y, z (and a copy of x that makes four), in the
 * compiler's vector notation, by address so that no convention of passing them matters. Errors below are in units of u^2, u
 * being the unit roundoff; 16 of them are DD_ROUNDOFF. */
typedef double Double4 __attribute__((vector_size(32)));
typedef int64_t Long4 __attribute__((vector_size(32)));
typedef struct { Double4 hi, lo; } Vec3Pair;

static inline __attribute__((always_inline)) void double4_from(const Vec3 *v, Double4 *r)
{
    *r = (Double4){v->x, v->y, v->z, v->x};
}

static inline __attribute__((always_inline)) void double4_abs(const Double4 *a, Double4 *r)
{
    *r = (Double4)((Long4)*a & INT64_MAX);
}

/* y, z, x. */
static inline __attribute__((always_inline)) void double4_turn(const Double4 *a, Double4 *r)
{
    *r = (Double4){(*a)[1], (*a)[2], (*a)[0], (*a)[1]};
}

/* a - b exactly: dd_sum. */
static inline __attribute__((always_inline)) void double4_difference(const Double4 *a, const Double4 *b, Vec3Pair *r)
{
    Double4 s = *a - *b, back = s - *a;
    r->lo = (*a - (s - back)) - (*b + back);
    r->hi = s;
}

/* a b exactly: dd_prod. */
static inline __attribute__((always_inline)) void double4_product(const Double4 *a, const Double4 *b, Vec3Pair *r)
{
    Double4 p = *a * *b;
#if defined(__FMA__) && defined(__AVX__)
    r->lo = __builtin_ia32_vfmaddpd256(*a, *b, -p);
#else
    Double4 ca = 0x8000001p0 * *a, ah = ca - (ca - *a), al = *a - ah;
    Double4 cb = 0x8000001p0 * *b, bh = cb - (cb - *b), bl = *b - bh;
    r->lo = ((ah * bh - p) + ah * bl + al * bh) + al * bl;
#endif
    r->hi = p;
}

/* e x f, each component within 16 of its size, the sum of its two products' magnitudes. The low part is at most 4 u of the
 * size, made with roundings of 14 sizes together; one more is left out. */
static inline __attribute__((always_inline)) void pair_cross(const Vec3Pair *e, const Vec3Pair *f, Vec3Pair *n,
                                                             Double4 *size)
{
    Double4 a, al, b, bl, c, cl, d, dl, ps, qs;
    double4_turn(&e->hi, &a), double4_turn(&e->lo, &al);
    double4_turn(&f->hi, &d), double4_turn(&f->lo, &dl);
    double4_turn(&a, &c), double4_turn(&al, &cl);
    double4_turn(&d, &b), double4_turn(&dl, &bl);
    Vec3Pair p, q, high;
    double4_product(&a, &b, &p);
    double4_product(&c, &d, &q);
    double4_difference(&p.hi, &q.hi, &high);
    double4_abs(&p.hi, &ps), double4_abs(&q.hi, &qs);
    *size = ps + qs;
    n->hi = high.hi;
    n->lo = high.lo + ((p.lo - q.lo) + ((a * bl + al * b) - (c * dl + cl * d)));
}

static inline __attribute__((always_inline)) double double4_sum(const Double4 *a) { return (*a)[0] + (*a)[1] + (*a)[2]; }

/* n . v for a cross product n: within 96, or 6 DD_ROUNDOFF, of the sum of size |v|. The low part is a sum of at most 8 u of
 * that; its products and nine sums are off by 5 and 64, n by 16, and 4 are left out. */
static inline __attribute__((always_inline)) Dd pair_dot(const Vec3Pair *n, const Vec3Pair *v)
{
    Vec3Pair p;
    double4_product(&n->hi, &v->hi, &p);
    Double4 low = p.lo + (n->hi * v->lo + n->lo * v->hi);
    Dd xy = dd_sum(p.hi[0], p.hi[1]), xyz = dd_sum(xy.hi, p.hi[2]);
    return dd_sum(xyz.hi, (xy.lo + xyz.lo) + double4_sum(&low));
}

/* t somewhere between those of the vertices, half as far from either as they are from each other; that is *err. */
double triangle_t_between(const Shear *s, const Vec3 *a, const Vec3 *b, const Vec3 *c, double *err);

/* t of the crossing with a triangle that the line crosses, in the ray's units; *err becomes a bound on its distance from
 * the true one of the coordinates as given. It is 2 u |t| and what double-double leaves; where that can't tell, for
 * triangles seen so flat that n . d loses 90 bits, t is somewhere between the vertices, and so says the bound. A function
 * of the line and the triangle alone, straight through, so that it may be done for several at once; with or without the
 * processor's fma it is the same.
 *
 * Numerator and denominator are off by 6 DD_ROUNDOFF of the sums of their products' sizes; where that is less than half the
 * denominator, the quotient is off by twice that at most, relative to the computed one. 2^-900 is for what underflows. */
static inline double triangle_t(const Shear *s, const Vec3 *a, const Vec3 *b, const Vec3 *c, double *err)
{
    Double4 va, vb, vc, vo, size, far, steps;
    double4_from(a, &va), double4_from(b, &vb), double4_from(c, &vc), double4_from(&s->ray->o, &vo);
    Vec3Pair d = {.lo = {0}}, to, e, f, n;
    double4_from(&s->d, &d.hi);
    double4_difference(&va, &vo, &to);
    double4_difference(&vb, &va, &e);
    double4_difference(&vc, &va, &f);
    pair_cross(&e, &f, &n, &size);
    Dd top = pair_dot(&n, &to), slope = pair_dot(&n, &d);
    double per_slope = 1 / slope.hi, t0 = top.hi * per_slope;
    Dd back = dd_prod(t0, slope.hi);
    double t = t0 + (((top.hi - back.hi) - back.lo) + (top.lo - t0 * slope.lo)) * per_slope;
    double4_abs(&to.hi, &far), double4_abs(&d.hi, &steps);
    far *= size, steps *= size;
    double across = double4_sum(&steps), along = double4_sum(&far), steep = fabs(slope.hi);
    if (!(steep > 12 * DD_ROUNDOFF * across + 0x1p-900)) return triangle_t_between(s, a, b, c, err);
    double off = 12 * DD_ROUNDOFF * (along + fabs(t) * across) + 0x1p-900;
    *err = (2 * UNIT_ROUNDOFF * fabs(t) + off / steep) * s->scale;
    return t * s->scale;
}

/* (b - a) x (c - a) times a positive number. Within 30 u as an angle, 2 u if the triangle is a sliver. *size becomes what
 * triangle_cross says, 0 if the normal is better than that. */
Vec3 triangle_normal(const Vec3 *a, const Vec3 *b, const Vec3 *c, Vec3 *size);

#endif
