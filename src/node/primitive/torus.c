/* The torus about the y axis with major radius 1 and minor radius m: every point within m of the circle. With
 * g(p) = |p|^2 + 1 - m^2 and w = x^2 + z^2,
 *
 *   g^2 - 4 w = ((sqrt(w) - 1)^2 + y^2 - m^2) ((sqrt(w) + 1)^2 + y^2 - m^2):
 *
 * the first factor is negative inside. The second is positive for m < 1; for a spindle it is negative in the inner
 * lens, which belongs to the solid and has g < 0.
 *
 * Along the line, s measured from the point nearest the centre, where p.d = 0 or nearly so, g is a s^2 + 2 b s + k and
 * w is A s^2 + 2 B s + C, so the quartic has hardly a cubic term, and coefficients that are as accurate from afar as
 * from nearby. As with the quadrics there is a cheap way (double precision, one Newton step on the implicit function)
 * and a certain one (coefficients and roots in double-double). */
#include "node/primitive/primitive.h"

#include <stdlib.h>

#include "node/primitive/quadric.h"
#include "node/primitive/wrap.h"
#include "tools/polyroots.h"

typedef struct {
    Prim prim;
    double minor;
} Torus;

/* Up to two segments: crossings in ascending order, in and out by turns. */
typedef struct {
    double t[4];
    int count;
    double slack;   /* a t is off by no more */
    bool sure;      /* false: nothing is known but that the ray isn't a certain miss */
} TorusGuess;

/* Minor radii for which the cheap way's thresholds have been derived: coefficients and slopes of the order of 1. */
#define PLAIN_MINOR_LEAST 0x1p-5
#define PLAIN_MINOR_GREATEST 2.0

/* For rays that leave the surface: origins within this have f of moderate size, its error in double-double, some 2^-100
 * of terms below 2^12, is less than VALUE_DOUBT, and over the guess's slack f' changes by less than half of SLOPE_LEAST
 * (f'' is at most 128, the slack 2^-27), which itself is a quarter of what the guess asks for. */
#define ORIGIN_MOST 4
#define VALUE_DOUBT 0x1p-85
#define SLOPE_LEAST 0x1p-10

/* False: certainly no crossing. */
static bool guess(const Torus *torus, const Ray *ray, TorusGuess *g)
{
    Vec3 o = ray->o, d = ray->d;
    double m = torus->minor;
    g->sure = false;
    g->count = 0;
    double dd = vec3_dot(d, d), reach = fabs(o.x) + fabs(o.y) + fabs(o.z);
    if (!(dd > 0x1p-400 && dd < 0x1p400 && reach < 0x1p400 && m < 0x1p100)) return true;
    double near = -vec3_dot(o, d) / dd, e = GAMMA(16) * reach;
    Vec3 l = vec3_at(o, near, d);
    double limit = (1 + m + e) * (1 + GAMMA(8)), ll = vec3_dot(l, l), left = limit * limit - ll;
    if (left < 0) return false;

    /* the chord of the bounding sphere must reach the slab |y| <= m */
    double scale = 1 / sqrt(dd), uy = d.y * scale, chord = sqrt(left) * (1 + GAMMA(8)) + e;
    if (fabs(l.y) - chord * fabs(uy) > (m + e) * (1 + GAMMA(16)) + e) return false;
    if (!(reach < 0x1p20 && m >= PLAIN_MINOR_LEAST && m <= PLAIN_MINOR_GREATEST)) return true;

    double ux = d.x * scale, uz = d.z * scale;
    double k = ll + 1 - m * m, a = ux * ux + uz * uz, b = l.x * ux + l.z * uz, c = l.x * l.x + l.z * l.z;
    double quartic[4] = {k * k - 4 * c, -8 * b, 2 * k - 4 * a, 0}, s[4];
    if (!poly_quartic_guess(quartic, s, &g->count)) return true;
    /* the error of l grows with reach: Newton's one step must still leave less than u t */
    double slope_least = reach < 0x1p12 ? 0x1p-8 : 0x1p-2;
    int roots = g->count;
    g->count = 0;
    for (int i = 0; i < roots; i++) {
        double slope = (4 * s[i] * s[i] + 2 * quartic[2]) * s[i] + quartic[1], sheet = s[i] * s[i] + k;
        if (!(fabs(slope) > slope_least) || (m > 1 && !(fabs(sheet) > 0x1p-8))) return true;
        if (m <= 1 || sheet > 0) g->t[g->count++] = near + s[i] * scale;
    }
    /* the residual is some 2^-40, the slope 2^-8 at least, and near carries the origin's rounding */
    g->slack = (0x1p-28 + 0x1p-40 * reach) * scale;
    g->sure = true;
    return g->count > 0;
}

/* One Newton step on g^2 - 4 w; the squares of the coordinates are exact as in quadric_refine. */
static bool refine(const Torus *torus, const Ray *ray, const TorusGuess *g, int i, Crossing *crossing)
{
    double t = g->t[i];
    if (fabs(t) < 0x1p-8 * (g->t[g->count - 1] - g->t[0])) return false;
    Vec3 o = ray->o, d = ray->d;
    double c = 0x8000001p0 * t, t_hi = c - (c - t), t_lo = t - t_hi;
    Split x = split_component(o.x, d.x, t_hi, t_lo), y = split_component(o.y, d.y, t_hi, t_lo);
    Split z = split_component(o.z, d.z, t_hi, t_lo);
    double w = x.hi * x.hi + z.hi * z.hi, w_lo = x.lo * (2 * x.hi + x.lo) + z.lo * (2 * z.hi + z.lo);
    Dd mm = dd_prod(torus->minor, torus->minor);
    Dd k = dd_sum(w + y.hi * y.hi + 1, -mm.hi);
    k = dd_sum(k.hi, k.lo - mm.lo + w_lo + y.lo * (2 * y.hi + y.lo));
    Dd kk = dd_prod(k.hi, k.hi);
    double residual = (kk.hi - 4 * w) + (kk.lo + 2 * k.hi * k.lo - 4 * w_lo);
    double wd = x.hi * d.x + z.hi * d.z, slope = 4 * k.hi * (wd + y.hi * d.y) - 8 * wd, dd = vec3_dot(d, d);
    double step = -residual / slope;
    Dd sum = dd_quick_sum(t, step);
    /* half the second derivative is at most 64 dd within the bounding sphere; then the residual's rounding; then the
     * slope's, which hi alone gave */
    double reach = 1 + fabs(o.x) + fabs(o.y) + fabs(o.z);
    double err = (64 * dd * step * step + 0x1p-66 * reach) / fabs(slope) + 0x1p-12 * fabs(step);
    *crossing = (Crossing){sum.hi, sum.lo, GAMMA(1) * fabs(sum.hi) + err, 0};
    return true;
}

static Dd dd_dot2(double a, double b, double c, double d) { return dd_add(dd_prod(a, b), dd_prod(c, d)); }

static Dd dd_square(double hi, double lo) { return dd_mul((Dd){hi, lo}, (Dd){hi, lo}); }

/* The restriction of g to the line is positive at s. */
static bool lens_at(const Dd g[3], double s)
{
    return dd_add(dd_mul_d(dd_add(dd_mul_d(g[2], s), g[1]), s), g[0]).hi < 0;
}

/* For a spindle: the crossings of the outer sheet. The line is cut wherever the quartic is 0 or stationary (a line
 * through a pole, where the sheets meet, only touches 0); a piece is inside where the quartic is negative or g is. */
static int outer_crossings(const Dd quartic[5], const double noise[5], const Dd g[3], const PolyRoot *root, int roots,
                           const double *critical, int criticals, PolyRoot out[4])
{
    PolyRoot cut[8];
    int n = 0;
    for (int i = 0, j = 0; i < roots || j < criticals;) {
        if (j == criticals || (i < roots && root[i].x <= critical[j])) {
            cut[n++] = root[i++];
        } else {
            /* where the value is in doubt: a (s - at)^4 at least moves it out of that */
            double at = critical[j++], doubt = 0;
            for (int k = 4; k >= 0; k--) doubt = doubt * fabs(at) + noise[k];
            cut[n++] = (PolyRoot){at, 0, sqrt(doubt / quartic[4].hi) + GAMMA(4) * fabs(at)};
        }
    }
    bool inside = false;
    int count = 0;
    for (int i = 0; i < n && count < 4; i++) {
        bool next = false;
        if (i + 1 < n) {
            double s = 0.5 * (cut[i].x + cut[i + 1].x);
            Dd y = quartic[4];
            for (int k = 3; k >= 0; k--) y = dd_add(dd_mul_d(y, s), quartic[k]);
            next = y.hi < 0 || lens_at(g, s);
        }
        if (next != inside) out[count++] = cut[i];
        inside = next;
    }
    return count;
}

/* The quartic g^2 - 4 w along the line and a bound on the error of each coefficient. On the axis of a horn torus all
 * but the leading one vanish, and its four roots lie within 1e-8 of each other or less: only bounds that go with the
 * terms themselves, not with the size of the torus, keep them apart. */
typedef struct { Dd c[5], g[3]; double noise[5]; } Quartic;

static void quartic_along(const NearLine *line, double m, Quartic *q)
{
    Vec3 d = line->d, h = line->hi, l = line->lo, e = line->err, ad = vec3_abs(d), ah = vec3_abs(h);
    Dd flat_a = dd_dot2(d.x, d.x, d.z, d.z), a = dd_add(flat_a, dd_prod(d.y, d.y));
    Dd flat_b = dd_add(dd_dot2(h.x, d.x, h.z, d.z), dd_dot2(l.x, d.x, l.z, d.z));
    Dd b = dd_add(flat_b, dd_add(dd_prod(h.y, d.y), dd_prod(l.y, d.y)));
    Dd flat_c = dd_add(dd_square(h.x, l.x), dd_square(h.z, l.z)), yy = dd_square(h.y, l.y);
    /* (1 - m)(1 + m) keeps what m^2 would lose as m approaches 1 */
    Dd rim = dd_mul(dd_sum(1, -m), dd_sum(1, m)), k = dd_add(dd_add(flat_c, yy), rim);

    double e_flat_b = 4 * DD_ROUNDOFF * (ah.x * ad.x + ah.z * ad.z) + e.x * ad.x + e.z * ad.z;
    double e_b = e_flat_b + 4 * DD_ROUNDOFF * (ah.x * ad.x + ah.y * ad.y + ah.z * ad.z) + e.y * ad.y;
    double e_flat_c = 2 * DD_ROUNDOFF * flat_c.hi + e.x * (2 * ah.x + e.x) + e.z * (2 * ah.z + e.z);
    double e_k = e_flat_c + 4 * DD_ROUNDOFF * (flat_c.hi + yy.hi + fabs(rim.hi)) + e.y * (2 * ah.y + e.y);
    double ab = fabs(b.hi), ak = fabs(k.hi);

    q->g[2] = a;
    q->g[1] = (Dd){2 * b.hi, 2 * b.lo};
    q->g[0] = k;
    q->c[4] = dd_mul(a, a);
    q->c[3] = dd_mul_d(dd_mul(a, b), 4);
    q->c[2] = dd_add(dd_mul_d(dd_mul(b, b), 4), dd_sub(dd_mul_d(dd_mul(a, k), 2), dd_mul_d(flat_a, 4)));
    q->c[1] = dd_sub(dd_mul_d(dd_mul(b, k), 4), dd_mul_d(flat_b, 8));
    q->c[0] = dd_sub(dd_mul(k, k), dd_mul_d(flat_c, 4));

    /* to first order; 4 roundings at most in a term */
    double r = 4 * DD_ROUNDOFF;
    q->noise[4] = r * a.hi * a.hi;
    q->noise[3] = 4 * a.hi * (e_b + r * ab);
    q->noise[2] = 8 * ab * e_b + 2 * a.hi * e_k + r * (4 * ab * ab + 2 * a.hi * ak + 4 * flat_a.hi);
    q->noise[1] = 4 * (ab * e_k + ak * e_b) + 8 * e_flat_b + r * (4 * ab * ak + 8 * fabs(flat_b.hi));
    q->noise[0] = 2 * ak * e_k + 4 * e_flat_c + r * (ak * ak + 4 * flat_c.hi);
}

static int exact(const Torus *torus, const Ray *ray, Crossing c[4])
{
    NearLine line;
    double m = torus->minor;
    if (!near_line(ray, 1 + m, 1, &line)) return 0;
    Quartic q;
    quartic_along(&line, m, &q);
    PolyRoot root[4], outer[4];
    double critical[3];
    int criticals, n;
    if (m > 1) {
        n = poly_quartic(q.c, q.noise, root, critical, &criticals);
        n = outer_crossings(q.c, q.noise, q.g, root, n, critical, criticals, outer);
    } else {
        n = poly_quartic(q.c, q.noise, outer, NULL, NULL);
    }
    for (int i = 0; i < n; i++) {
        c[i] = line_crossing(&line, (Dd){outer[i].x, outer[i].lo}, outer[i].err);
        if (!isfinite(c[i].t)) return 0;
    }
    return n;
}

/* The crossings past the first `skip` are wanted one by one: the exact ones are had all at once. */
typedef struct {
    TorusGuess guess;
    Crossing exact[4];
    int exact_count;   /* -1: not yet computed */
} Crossings;

/* The guess is made; where it isn't sure, all is computed. */
static void crossings_begin(const Torus *torus, const Ray *ray, Crossings *x)
{
    x->exact_count = -1;
    if (!x->guess.sure) x->guess.count = x->exact_count = exact(torus, ray, x->exact);
}

static bool crossings_get(const Torus *torus, const Ray *ray, Crossings *x, int i, Crossing *c)
{
    if (x->guess.sure && refine(torus, ray, &x->guess, i, c)) return true;
    if (x->exact_count < 0) x->exact_count = exact(torus, ray, x->exact);
    if (i >= x->exact_count) return false;
    *c = x->exact[i];
    return true;
}

static Box bounds(const Prim *prim)
{
    double m = ((const Torus *)prim)->minor, r = nextafter(1 + m, INFINITY);
    return (Box){{-r, -m, -r}, {r, m, r}};
}

static Box bounds_in(const Prim *prim, const Affine *map)
{
    Vec3 tube = vec3_scale(affine_ball_extent(map), ((const Torus *)prim)->minor);
    return affine_box_about(map, vec3_make(0, 0, 0), vec3_add(affine_disc_extent(map), tube));
}

/* f = g^2 - 4 w at a point, in double-double; and *k gets g. */
static Dd value_at(const Torus *torus, Vec3 p, Dd *k)
{
    Dd w = dd_add(dd_prod(p.x, p.x), dd_prod(p.z, p.z)), mm = dd_prod(torus->minor, torus->minor);
    *k = dd_sub(dd_add_d(dd_add(w, dd_prod(p.y, p.y)), 1), mm);
    return dd_sub(dd_mul(*k, *k), (Dd){4 * w.hi, 4 * w.lo});
}

double torus_minor(const Prim *prim) { return ((const Torus *)prim)->minor; }

bool torus_is_outside(const Prim *prim, Vec3 p)
{
    Dd k;
    return vec3_max(vec3_abs(p)) < ORIGIN_MOST && value_at((const Torus *)prim, p, &k).hi > VALUE_DOUBT;
}

/* Whether a crossing next to the ray's origin is behind it, as for most rays that leave the torus: it is near the root of
 * the tangent to f there, so its t has the sign of -f / f'. f needs twice the precision; f' is well off 0 (the guess has
 * seen to that at the crossing) and hardly changes within slack. False if it is ahead, or in doubt. */
static bool is_left_behind(const Torus *torus, const Ray *ray, const TorusGuess *g, int i)
{
    if (!(fabs(g->t[i]) <= g->slack && ray->tmin >= 0)) return false;
    Vec3 o = ray->o, d = ray->d;
    if (!(vec3_max(vec3_abs(o)) < ORIGIN_MOST)) return false;
    Dd k, f = value_at(torus, o, &k);
    double wd = o.x * d.x + o.z * d.z, slope = 4 * k.hi * (wd + o.y * d.y) - 8 * wd;
    return fabs(f.hi) > VALUE_DOUBT && fabs(slope) > SLOPE_LEAST * vec3_max(vec3_abs(d)) && (f.hi > 0) == (slope > 0);
}

static bool intersect(const Prim *prim, const Ray *ray, Hit *hit, Scratch *scratch)
{
    const Torus *torus = (const Torus *)prim;
    Crossings x;
    if (!guess(torus, ray, &x.guess)) return false;
    if (!x.guess.sure && !ray_is_moderate(ray)) return rescaled_intersect(prim, ray, hit, scratch);
    crossings_begin(torus, ray, &x);
    for (int i = 0; i < x.guess.count; i++) {
        if (x.guess.sure && x.guess.t[i] + x.guess.slack < ray->tmin) continue;
        if (x.guess.sure && x.guess.t[i] - x.guess.slack > ray->tmax) return false;
        if (x.guess.sure && is_left_behind(torus, ray, &x.guess, i)) continue;
        Crossing c;
        if (!crossings_get(torus, ray, &x, i, &c) || !(c.t > ray->tmin)) continue;
        if (!(c.t <= ray->tmax)) return false;
        *hit = (Hit){.t = c.t, .u = c.lo, .object = hit->object};
        return true;
    }
    return false;
}

static bool occluded(const Prim *prim, const Ray *ray, Scratch *scratch)
{
    TorusGuess g;
    Hit hit;
    if (!guess((const Torus *)prim, ray, &g)) return false;
    for (int i = 0; g.sure && i < g.count; i++)
        if (g.t[i] - g.slack > ray->tmin && g.t[i] + g.slack <= ray->tmax) return true;
    return intersect(prim, ray, &hit, scratch);
}

/* The gradient of the tube: away from the nearest point of the circle; on the axis, where that isn't one point, along
 * the axis. */
static Vec3 normal(Vec3 p)
{
    double rho = sqrt(p.x * p.x + p.z * p.z);
    if (rho == 0) return vec3_make(0, p.y < 0 ? -1 : 1, 0);
    double s = (rho - 1) / rho;
    Vec3 n = {p.x * s, p.y, p.z * s};
    return vec3_max(vec3_abs(n)) > 0 ? n : vec3_make(0, 1, 0);
}

static bool segments(const Prim *prim, const Ray *ray, SegList *list)
{
    const Torus *torus = (const Torus *)prim;
    Crossings x;
    if (!guess(torus, ray, &x.guess)) return true;
    if (!x.guess.sure && !ray_is_moderate(ray)) return rescaled_segments(prim, ray, list);
    crossings_begin(torus, ray, &x);
    for (int i = 0; i + 1 < x.guess.count; i += 2) {
        Edge edge[2];
        for (int k = 0; k < 2; k++) {
            Crossing c;
            if (!crossings_get(torus, ray, &x, i + k, &c)) return true;
            edge[k] = (Edge){.t = c.t, .t_err = c.err, .u = c.lo, .n = normal(ray_point(ray, c.t, c.lo))};
        }
        if (!seg_list_add(list, edge[0], edge[1])) return false;
    }
    return true;
}

static void surface(const Prim *prim, const Ray *ray, const Hit *hit, bool uv, Surface *surface)
{
    double m = ((const Torus *)prim)->minor;
    Vec3 p = ray_point(ray, hit->t, hit->u);
    double rho = sqrt(p.x * p.x + p.z * p.z), out = rho - 1, off = sqrt(out * out + p.y * p.y);
    if (off > 0) {
        /* put onto the tube: the circle's nearest point plus m times the unit vector from it */
        double s = m / off, ring = rho > 0 ? fmax(0, 1 + out * s) / rho : 0;
        p = vec3_make(p.x * ring, p.y * s, p.z * ring);
    }
    /* rho, its difference from 1, the root, quotients and products: in units of the coordinates, not of the tube */
    double err = GAMMA(12) * (1 + m);
    surface->p = p;
    surface->p_err = vec3_make(err, err, err);
    surface->n = surface->ns = normal(p);
    surface->u = uv ? wrap_u(p) : 0;
    surface->v = uv ? 0.5 + 0.5 * ONE_OVER_PI * atan2(p.y, out) : 0;
}

static const PrimOps OPS = {
    .name = "torus", .form = FORM_TORUS, .closed = true, .bounds = bounds, .bounds_in = bounds_in, .intersect = intersect,
    .occluded = occluded, .segments = segments, .surface = surface,
};

Prim *torus_create(double minor)
{
    Torus *torus = malloc(sizeof *torus);
    if (!torus) return NULL;
    *torus = (Torus){{&OPS}, minor};
    return &torus->prim;
}
