#include "accel/triangle.h"

#include "common/exact.h"

/* The sign of a b - c d, exactly. */
static int product_order(double a, double b, double c, double d)
{
    if ((a == 0 || b == 0) && (c == 0 || d == 0)) return 0;
    Dd p = dd_prod(a, b), q = dd_prod(c, d);
    /* exact, and the nearest double and what is left say all, if nothing underflows and no factor is too large */
    if (fabs(p.hi) + fabs(q.hi) > 0x1p-900 && fabs(p.lo) + fabs(q.lo) < INFINITY)
        return p.hi != q.hi ? (p.hi > q.hi) - (p.hi < q.hi) : (p.lo > q.lo) - (p.lo < q.lo);
    ExactSum sum = {.low = EXACT_LIMBS};
    exact_add(&sum, a, b, 1);
    exact_add(&sum, -c, d, 1);
    return exact_sign(&sum);
}

static Vec3 vec3_from(const Double4 *a) { return vec3_make((*a)[0], (*a)[1], (*a)[2]); }
static bool is_double(const Vec3Pair *a) { return a->lo[0] == 0 && a->lo[1] == 0 && a->lo[2] == 0; }

/* q - p, exactly. */
static void pair_between(const Vec3 *p, const Vec3 *q, Vec3Pair *r)
{
    Double4 from, to;
    double4_from(p, &from), double4_from(q, &to);
    double4_difference(&to, &from, r);
}

static bool parallel(Vec3 a, Vec3 b)
{
    return product_order(a.x, b.y, a.y, b.x) == 0 && product_order(a.y, b.z, a.z, b.y) == 0 &&
           product_order(a.z, b.x, a.x, b.z) == 0;
}

/* The sign of the sheared edge's component along an axis: that of the edge less its share of z. */
static int sheared_order(const Shear *s, const Vec3 *p, const Vec3 *q, size_t axis)
{
    const double *d = &s->ray->d.x, dz = d[s->kz], *from = &p->x, *to = &q->x;
    Dd along = dd_sum(to[axis], -from[axis]), z = dd_sum(to[s->kz], -from[s->kz]);
    int sign;
    if (along.lo == 0 && z.lo == 0) {
        sign = product_order(dz, along.hi, d[axis], z.hi);
    } else {
        ExactSum sum = {.low = EXACT_LIMBS};
        exact_add(&sum, dz, along.hi, 1);
        exact_add(&sum, dz, along.lo, 1);
        exact_add(&sum, -d[axis], z.hi, 1);
        exact_add(&sum, -d[axis], z.lo, 1);
        sign = exact_sign(&sum);
    }
    return dz > 0 ? sign : -sign;
}

/* Adds d . (p x q). */
static void add_volume(ExactSum *sum, const Vec3 *d, const Vec3 *p, const Vec3 *q)
{
    const double *e = &d->x, *f = &p->x, *g = &q->x;
    for (int i = 0; i < 3; i++) {
        int j = (i + 1) % 3, k = (i + 2) % 3;
        exact_add(sum, e[i], f[j], g[k]);
        exact_add(sum, -e[i], f[k], g[j]);
    }
}

/* d . ((p - o) x (q - o)) over d.z: the shear keeps volumes, and sheared, d is (0, 0, d.z). */
int edge_sign(const Shear *s, const Vec3 *p, const Vec3 *q, double *value)
{
    const Vec3 *d = &s->ray->d, *o = &s->ray->o;
    double dz = (&s->d.x)[s->kz];
    Vec3Pair from, to, n, d_scaled = {.lo = {0}};
    pair_between(o, p, &from), pair_between(o, q, &to), double4_from(&s->d, &d_scaled.hi);
    Vec3 f = vec3_from(&from.hi), t = vec3_from(&to.hi);
    ExactSum sum = {.low = EXACT_LIMBS};
    bool doubles[2] = {is_double(&from), is_double(&to)};
    if (!(doubles[0] && parallel(f, *d)) && !(doubles[1] && parallel(t, *d))) {  /* no end is on the line */
        Double4 size;
        pair_cross(&from, &to, &n, &size);
        Dd volume = pair_dot(&n, &d_scaled);
        *value = volume.hi / dz;
        /* as for triangle_t, a third more */
        double margin = 8 * DD_ROUNDOFF * vec3_dot(vec3_from(&size), vec3_abs(s->d)) + 0x1p-900;
        if (fabs(volume.hi) > margin) return *value > 0 ? 1 : -1;
        if (doubles[0] && doubles[1]) {
            add_volume(&sum, d, &f, &t);
        } else {
            add_volume(&sum, d, p, q);
            add_volume(&sum, d, q, o);
            add_volume(&sum, d, o, p);
        }
    }
    int sign = dz > 0 ? exact_sign(&sum) : -exact_sign(&sum);
    *value = exact_value(&sum, ilogb(s->scale)) / dz;
    if (sign == 0) sign = sheared_order(s, q, p, s->ky);
    if (sign == 0) sign = sheared_order(s, p, q, s->kx);
    return sign;
}

int edge_signs(const Shear *s, const Vec3 *a, const Vec3 *b, const Vec3 *c, double margin, double edge[3])
{
    const Vec3 *const end[3][2] = {{c, b}, {a, c}, {b, a}};
    int sign[3];
    for (int i = 0; i < 3; i++) {
        sign[i] = edge[i] > margin ? 1 : edge[i] < -margin ? -1 : edge_sign(s, end[i][0], end[i][1], &edge[i]);
        if (sign[i] != sign[0]) return 0;
    }
    return sign[0];
}

double triangle_t_between(const Shear *s, const Vec3 *a, const Vec3 *b, const Vec3 *c, double *err)
{
    double p = shear(s, a).z * s->sz, q = shear(s, b).z * s->sz, r = shear(s, c).z * s->sz;
    double lo = smaller(smaller(p, q), r), hi = larger(larger(p, q), r), t = lo + (hi - lo) / 2;
    *err = ((hi - lo) / 2 + 8 * UNIT_ROUNDOFF * larger(fabs(lo), fabs(hi))) * s->scale;  /* z, sz, the rest twice */
    return t * s->scale;
}

/* q - p times a power of two that brings it to 1. */
static void scaled_between(const Vec3 *p, const Vec3 *q, Vec3Pair *r)
{
    double k = vec3_pow2_scale(vec3_sub(*q, *p));
    pair_between(p, q, r);
    r->hi *= k;
    r->lo *= k;
}

/* In double each component is off by 4 u of its size: by 7 u of them all together, and by 28 u of the normal if no size
 * is more than 4 times its greatest component. */
Vec3 triangle_normal(const Vec3 *a, const Vec3 *b, const Vec3 *c, Vec3 *size)
{
    Vec3 n = triangle_cross(a, b, c, size);
    if (vec3_max(*size) + 0x1p-900 <= 4 * vec3_max(vec3_abs(n))) return n;
    Vec3Pair e, f, fine;
    Double4 sizes;
    scaled_between(a, b, &e);
    scaled_between(a, c, &f);
    pair_cross(&e, &f, &fine, &sizes);
    *size = vec3_make(0, 0, 0);
    fine.hi += fine.lo;
    return vec3_from(&fine.hi);
}
