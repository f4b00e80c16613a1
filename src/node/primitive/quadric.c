/* The slow and certain way to a crossing: everything in double-double, the constants of the quadratic by compensated
 * summation of their exact products (SumK of Ogita, Rump, Oishi 2005, K = 4), and the roots by tools/polyroots. About
 * the point nearest the origin b is nearly 0 and D = b^2 - a c is free of the cancellation that a far origin brings
 * (Haines, Guenther, Akenine-Moeller, "Precision improvements for ray/sphere intersection", Ray Tracing Gems, 2019,
 * chapter 7). */
#include "node/primitive/quadric.h"

#include "tools/polyroots.h"

/* The greatest number of exact terms in one coefficient: (h + l)^2 in three components and the constant. */
enum { TERMS_MAX = 16 };

typedef struct { double v[TERMS_MAX]; int n; } Terms;

static void add_prod(Terms *t, double sign, double a, double b)
{
    Dd p = dd_prod(a, b);
    t->v[t->n++] = sign * p.hi;
    t->v[t->n++] = sign * p.lo;
}

/* The sum to double-double: three passes that push the rounding errors down leave at most u^3 of the terms' sum. */
static Dd sum_terms(Terms *t)
{
    double *v = t->v;
    int n = t->n;
    for (int pass = 0; pass < 3; pass++)
        for (int i = 1; i < n; i++) {
            Dd s = dd_sum(v[i], v[i - 1]);
            v[i] = s.hi;
            v[i - 1] = s.lo;
        }
    double low = 0;
    for (int i = 0; i < n - 1; i++) low += v[i];
    return dd_sum(v[n - 1], low);
}

static Vec3 ldexp3(Vec3 v, int e) { return vec3_make(ldexp(v.x, e), ldexp(v.y, e), ldexp(v.z, e)); }

/* The same line with the direction's greatest component in [1, 2): t = (t of *scaled) 2^exponent. */
static bool rescale(const Ray *ray, Ray *scaled, int *exponent)
{
    double m = vec3_max(vec3_abs(ray->d));
    if (!(m > 0 && isfinite(m))) return false;
    *exponent = -ilogb(m);
    *scaled = (Ray){ray->o, ldexp3(ray->d, *exponent), -INFINITY, INFINITY};
    return true;
}

/* One crossing after the other, as tmin and tmax may have no counterpart on the scaled line. */
bool rescaled_intersect(const Prim *prim, const Ray *ray, Hit *hit, Scratch *scratch)
{
    Ray scaled;
    int e;
    if (!rescale(ray, &scaled, &e)) return false;
    Hit next = *hit, first = *hit;
    bool found = false;
    for (; prim->ops->intersect(prim, &scaled, &next, scratch); scaled.tmin = next.t) {
        double t = ldexp(next.t, e);
        if (!isfinite(t)) return false;
        if (found || !(t > ray->tmin)) continue;
        found = true;
        first = next;
        first.t = t;
        first.u = ldexp(next.u, e);
    }
    if (!found || !(first.t <= ray->tmax)) return false;
    *hit = first;
    return true;
}

static void rescale_edge(Edge *edge, int e)
{
    edge->t = ldexp(edge->t, e);
    edge->u = ldexp(edge->u, e);
    edge->t_err = ldexp(edge->t_err, e) + 0x1p-1074;
}

bool rescaled_segments(const Prim *prim, const Ray *ray, SegList *list)
{
    Ray scaled;
    int e;
    if (!rescale(ray, &scaled, &e)) return true;
    uint32_t before = list->count;
    if (!prim->ops->segments(prim, &scaled, list)) return false;
    for (uint32_t i = before; i < list->count; i++) {
        rescale_edge(&list->seg[i].in, e);
        rescale_edge(&list->seg[i].out, e);
    }
    if (list->count > before && !(isfinite(list->seg[before].in.t) && isfinite(list->seg[list->count - 1].out.t)))
        list->count = before;
    return true;
}

/* For a t or d of which the products' halves would leave the range. */
__attribute__((noinline)) static Vec3 extreme_point(const Ray *ray, double t, double lo)
{
    Ray scaled;
    int e;
    bool again = !ray_is_moderate(ray) && rescale(ray, &scaled, &e);
    return again ? ray_point(&scaled, ldexp(t, -e), ldexp(lo, -e)) : vec3_at(ray->o, t, ray->d);
}

Vec3 ray_point(const Ray *ray, double t, double lo)
{
    Vec3 o = ray->o, d = ray->d;
    double big = fmax(fmax(fabs(t), vec3_max(vec3_abs(d))), vec3_max(vec3_abs(o)));
    if (!(big < 0x1p900)) return extreme_point(ray, t, lo);
    return vec3_make(ray_component(o.x, d.x, t, lo), ray_component(o.y, d.y, t, lo), ray_component(o.z, d.z, t, lo));
}

Crossing plane_crossing_extreme(double o, double d, double value, uint32_t part)
{
    double gap = dd_sum(value, -o).hi, t = gap / d;
    int e = d != 0 && isfinite(d) ? -ilogb(d) : 0;
    if (e != 0 && fabs(gap) > 0x1p-800 && fabs(gap) < 0x1p800) {
        Crossing c = plane_crossing(o, ldexp(d, e), value, part);
        return (Crossing){ldexp(c.t, e), ldexp(c.lo, e), ldexp(c.err, e) + 0x1p-1074, part};
    }
    return (Crossing){t, 0, GAMMA(2) * fabs(t) + 0x1p-1074, part};
}

/* o + l + t d, and what its rounding may have lost. */
static double shift_component(double *hi, double *lo, double t, double d)
{
    Dd p = dd_add(dd_prod(t, d), (Dd){*hi, *lo});
    double lost = DD_ROUNDOFF * (fabs(*hi) + fabs(t * d));
    *hi = p.hi;
    *lo = p.lo;
    return lost;
}

/* The line through o passes the origin at less than `centre` times |o|. */
static bool leads_to_origin(Vec3 o, Vec3 d, double dd, double centre)
{
    double along = vec3_dot(o, d);
    return along * along > (1 - centre * centre) * (vec3_dot(o, o) * dd);
}

bool near_line(const Ray *ray, double radius, double centre, NearLine *line)
{
    double m = vec3_max(vec3_abs(ray->d));
    if (!(m > 0 && isfinite(m))) return false;
    line->exponent = -ilogb(m);
    Vec3 d = ldexp3(ray->d, line->exponent);
    *line = (NearLine){.hi = ray->o, .d = d, .exponent = line->exponent};

    /* 1/16 keeps the dot product from overflowing. Two rounds: the first may miss the nearest point by u |o|. */
    double dd = vec3_dot(d, d), reach = vec3_max(vec3_abs(ray->o));
    if (!(reach < 0x1p990)) return false;
    for (int round = 0; round < 2; round++) {
        if (!(vec3_max(vec3_abs(line->hi)) > 4 || (centre > 0 && leads_to_origin(line->hi, d, dd, centre)))) break;
        double t = -16 * (vec3_dot(vec3_scale(line->hi, 0x1p-4), d) / dd);
        line->err.x += shift_component(&line->hi.x, &line->lo.x, t, d.x);
        line->err.y += shift_component(&line->hi.y, &line->lo.y, t, d.y);
        line->err.z += shift_component(&line->hi.z, &line->lo.z, t, d.z);
        line->t0 = dd_add_d(line->t0, t);
    }
    if (!(vec3_max(vec3_abs(line->hi)) < 0x1p400)) return false;
    double along = vec3_dot(line->hi, d), limit = radius * 1.0625 + 2 * vec3_max(line->err);
    return !(vec3_dot(line->hi, line->hi) - along * along / dd > limit * limit);
}

Crossing line_crossing(const NearLine *line, Dd r, double err)
{
    if (!isfinite(r.hi)) return (Crossing){r.hi, 0, INFINITY, 0};
    Dd t = dd_add(line->t0, r);
    int e = line->exponent;
    Crossing c = {ldexp(t.hi, e), ldexp(t.lo, e), 0, 0};
    c.err = GAMMA(1) * fabs(c.t) + ldexp(err + DD_ROUNDOFF * (fabs(line->t0.hi) + fabs(r.hi)), e) + 0x1p-1074;
    return c;
}

void quadric_roots(const NearLine *line, Vec3 s, double k, QuadricRoots *roots)
{
    double sign[3] = {s.x, s.y, s.z}, d[3] = {line->d.x, line->d.y, line->d.z};
    double hi[3] = {line->hi.x, line->hi.y, line->hi.z}, lo[3] = {line->lo.x, line->lo.y, line->lo.z};
    double err[3] = {line->err.x, line->err.y, line->err.z};
    *roots = (QuadricRoots){0};

    /* The components that take part may all be tiny: they get a power of two of their own. */
    double m = 0;
    for (int i = 0; i < 3; i++)
        if (sign[i] != 0) m = fmax(m, fabs(d[i]));
    int e = m > 0 ? -ilogb(m) : 0;

    Terms ta = {.n = 0}, tb = {.n = 0}, tc = {.n = 0};
    double reach = 0, moved_b = 0, moved_c = 0;   /* by the line's own error */
    for (int i = 0; i < 3; i++) {
        if (sign[i] == 0) continue;
        double di = ldexp(d[i], e);
        add_prod(&ta, sign[i], di, di);
        add_prod(&tb, sign[i], hi[i], di);
        add_prod(&tb, sign[i], lo[i], di);
        add_prod(&tc, sign[i], hi[i], hi[i]);
        add_prod(&tc, sign[i], 2 * hi[i], lo[i]);
        tc.v[tc.n++] = sign[i] * lo[i] * lo[i];
        reach += fabs(hi[i]);
        moved_b += err[i] * fabs(di);
        moved_c += err[i] * (2 * fabs(hi[i]) + err[i]);
    }
    tc.v[tc.n++] = k;
    Dd a = m > 0 ? sum_terms(&ta) : (Dd){0, 0}, b = m > 0 ? sum_terms(&tb) : (Dd){0, 0}, c = sum_terms(&tc);
    roots->a = a;
    roots->b = b;
    roots->c = c;
    if (a.hi == 0 && b.hi == 0) {
        roots->constant = true;
        return;
    }

    /* first-order bounds: a is exact but for u^3, b and c carry the line's error */
    double ea = 0x1p-150 + DD_ROUNDOFF * 0x1p-4 * fabs(a.hi);
    double eb = 0x1p-149 * reach + DD_ROUNDOFF * 0x1p-4 * fabs(b.hi) + 2 * moved_b;
    double ec = 0x1p-149 * (fabs(k) + reach * reach) + DD_ROUNDOFF * 0x1p-4 * fabs(c.hi) + 2 * moved_c;
    Dd poly[3] = {c, {2 * b.hi, 2 * b.lo}, a};
    PolyRoot root[2];
    int n = poly_quadratic(poly, (const double[3]){ec, 2 * eb, ea}, root);
    if (n == 1) root[1] = root[0];
    /* a tangent has no way inside; but a < 0 (a cone met steeply) always has roots */
    if (n == 0 || (a.hi > 0 && root[0].x == root[1].x && root[0].lo == root[1].lo)) return;
    roots->count = 2;
    Crossing x[2];
    for (int i = 0; i < 2; i++) {
        Dd r = {root[i].x, root[i].lo};
        if (isfinite(r.hi)) r = (Dd){ldexp(r.hi, e), ldexp(r.lo, e)};
        x[i] = line_crossing(line, r, ldexp(root[i].err, e));
    }
    bool swapped = crossing_before(&x[1], &x[0]);
    roots->root[0] = x[swapped];
    roots->root[1] = x[!swapped];
}
