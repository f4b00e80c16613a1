#include "support/oracle.h"

#include <float.h>
#include <math.h>

Quad q_sqrt(Quad x)
{
    if (x <= 0) return 0;
    int e = 0;
    while (x > 0x1p128) {
        x *= 0x1p-128;
        e += 64;
    }
    while (x < 0x1p-128) {
        x *= 0x1p128;
        e -= 64;
    }
    while (x > 4) {
        x /= 4;
        e++;
    }
    while (x < 0.25) {
        x *= 4;
        e--;
    }
    Quad r = (Quad)sqrt((double)x);
    for (int i = 0; i < 3; i++) r = (r + x / r) / 2;
    for (; e >= 64; e -= 64) r *= 0x1p64;
    for (; e <= -64; e += 64) r *= 0x1p-64;
    for (; e > 0; e--) r *= 2;
    for (; e < 0; e++) r /= 2;
    return r;
}

/* Larger than any t that a double holds. */
#define Q_FAR ((Quad)DBL_MAX * DBL_MAX)

/* Eight roundings of quad precision: what a component, a short sum of products or a quotient has of them, to spare. */
#define Q_ERR ((Quad)0x1p-110)

/* The ray's line about its point nearest to the origin: the ray's t is t0 + r. err bounds the error of o. */
typedef struct { Quad o[3], d[3], err[3], t0; } QLine;

static QLine q_line(const Ray *ray)
{
    QLine l = {.o = {ray->o.x, ray->o.y, ray->o.z}, .d = {ray->d.x, ray->d.y, ray->d.z}};
    for (int round = 0; round < 2; round++) {
        Quad od = 0, dd = 0;
        for (int i = 0; i < 3; i++) {
            od += l.o[i] * l.d[i];
            dd += l.d[i] * l.d[i];
        }
        Quad t = -od / dd;
        l.t0 += t;
        for (int i = 0; i < 3; i++) {
            l.err[i] += Q_ERR * (l.d[i] == 0 ? 0 : q_abs(l.o[i]) + q_abs(t * l.d[i]));
            l.o[i] += t * l.d[i];
        }
    }
    return l;
}

Quad poly(const Quad *c, int degree, Quad x)
{
    Quad y = c[degree];
    for (int i = degree - 1; i >= 0; i--) y = y * x + c[i];
    return y;
}

static long double poly_long(const Quad *c, int degree, long double x)
{
    long double y = (long double)c[degree];
    for (int i = degree - 1; i >= 0; i--) y = y * x + (long double)c[i];
    return y;
}

/* The zero between a and b, where the sign differs: bisection and Newton's method in long double, then Newton's in
 * quad. The answer counts only if the quad polynomial changes its sign around it; otherwise all is bisected in quad. */
static Quad poly_zero(const Quad *c, const Quad *derivative, int degree, Quad a, Quad b)
{
    bool negative = poly(c, degree, a) < 0;
    long double lo = (long double)a, hi = (long double)b, x = (lo + hi) / 2;
    for (int k = 0; k < 80 && lo < x && x < hi; k++) {
        long double y = poly_long(c, degree, x), next;
        if ((y < 0) == negative) lo = x;
        else hi = x;
        next = x - y / poly_long(derivative, degree - 1, x);
        if (!(next > lo && next < hi)) next = (lo + hi) / 2;
        if (fabsl(next - x) <= 0x1p-60L * fabsl(next)) break;
        x = next;
    }
    Quad r = x;
    for (int k = 0; k < 3; k++) r -= poly(c, degree, r) / poly(derivative, degree - 1, r);
    Quad reach = q_abs(r) * 0x1p-100;
    if (r - reach > a && r + reach < b && (poly(c, degree, r - reach) < 0) == negative &&
        (poly(c, degree, r + reach) < 0) != negative)
        return r;
    for (int k = 0; k < 130; k++) {
        Quad m = (a + b) / 2;
        if ((poly(c, degree, m) < 0) == negative) a = m;
        else b = m;
    }
    return (a + b) / 2;
}

/* The sign changes between the stationary points stop[1] to stop[stops]; stop[0] and stop[stops + 1] are the ends. */
static int roots_between(const Quad *c, const Quad *derivative, int degree, const Quad *stop, int stops, Quad *root)
{
    int n = 0;
    for (int i = 0; i <= stops; i++)
        if ((poly(c, degree, stop[i]) < 0) != (poly(c, degree, stop[i + 1]) < 0))
            root[n++] = poly_zero(c, derivative, degree, stop[i], stop[i + 1]);
    return n;
}

int poly_roots(const Quad *c, int degree, Quad lo, Quad hi, Quad *root)
{
    if (degree == 0) return 0;
    if (degree == 1) {
        if (c[1] == 0) return 0;
        root[0] = -c[0] / c[1];
        return root[0] > lo && root[0] < hi;
    }
    Quad derivative[8], stop[10];
    for (int i = 1; i <= degree; i++) derivative[i - 1] = c[i] * i;
    int stops = poly_roots(derivative, degree - 1, lo, hi, stop + 1);
    stop[0] = lo;
    stop[stops + 1] = hi;
    return roots_between(c, derivative, degree, stop, stops, root);
}

typedef struct { Quad t, err; } QCrossing;

/* How far a figure is from 0, in units of its error. */
static void must_differ(Truth *truth, Quad figure, Quad err)
{
    if (err > 0) truth->sure = q_min(truth->sure, q_abs(figure) / err);
}

static void may_touch(Truth *truth, Quad t)
{
    if (q_abs(t) <= DBL_MAX && truth->doubts < DOUBTS_MOST) truth->doubt[truth->doubts++] = t;
}

/* The quadric sum of sign[i] x_i^2 + k along the line, a r^2 + 2 b r + c, and the errors of a, b, c. */
typedef struct { Quad a, b, c, ea, eb, ec; } QForm;

static QForm q_form(const QLine *l, const int sign[3], int k)
{
    QForm f = {.c = k, .ec = k != 0 ? Q_ERR : 0};
    for (int i = 0; i < 3; i++) {
        if (sign[i] == 0) continue;
        Quad o = l->o[i], d = l->d[i], e = l->err[i];
        f.a += sign[i] * d * d;
        f.b += sign[i] * o * d;
        f.c += sign[i] * o * o;
        f.ea += Q_ERR * d * d;
        f.eb += Q_ERR * q_abs(o * d) + e * q_abs(d);
        f.ec += Q_ERR * o * o + e * (2 * q_abs(o) + e);
    }
    return f;
}

/* Roots in ascending order; 0 or 2 of them, or 1 if a is 0. */
static int form_roots(const QForm *f, const QLine *l, QCrossing x[2], Truth *truth)
{
    if (f->a != 0) must_differ(truth, f->a, f->ea);
    if (f->a == 0) {
        must_differ(truth, f->b, f->eb);
        if (f->b == 0) return 0;
    }
    Quad disc = f->b * f->b - f->a * f->c;
    Quad e_disc = Q_ERR * (f->b * f->b + q_abs(f->a * f->c)) + 2 * q_abs(f->b) * f->eb + q_abs(f->a) * f->ec +
                  q_abs(f->c) * f->ea;
    must_differ(truth, disc, e_disc);
    if (f->a != 0) may_touch(truth, l->t0 - f->b / f->a);
    if (disc <= 0) return 0;
    Quad root = q_sqrt(disc), q = f->b < 0 ? -f->b + root : -f->b - root;
    Quad eq = f->eb + e_disc / root + Q_ERR * q_abs(q), r[2] = {f->c / q, f->a == 0 ? 0 : q / f->a};
    Quad err[2] = {2 * (f->ec + q_abs(r[0]) * eq) / q_abs(q), 0};
    int n = f->a == 0 ? 1 : 2;
    if (n == 2) err[1] = 2 * (eq + q_abs(r[1]) * f->ea) / q_abs(f->a);
    bool swap = n == 2 && r[1] < r[0];
    for (int i = 0; i < n; i++) {
        int j = swap ? 1 - i : i;
        x[i] = (QCrossing){l->t0 + r[j], err[j] + Q_ERR * (q_abs(l->t0) + q_abs(r[j]))};
    }
    return n;
}

static void finish_interval(QCrossing in, QCrossing out, Truth *truth)
{
    must_differ(truth, out.t - in.t, in.err + out.err);
    may_touch(truth, (in.t + out.t) / 2);
    truth->n = 0;
    if (in.t >= out.t) return;
    truth->t[0] = in.t;
    truth->t[1] = out.t;
    truth->err[0] = in.err;
    truth->err[1] = out.err;
    truth->n = 2;
}

static QCrossing later(QCrossing a, QCrossing b) { return a.t < b.t ? b : a; }
static QCrossing sooner(QCrossing a, QCrossing b) { return b.t < a.t ? b : a; }

/* From the ray's own origin. Along the planes the comparison is exact. */
static void slab(double o, double d, int lo, int hi, QCrossing *in, QCrossing *out)
{
    if (d == 0) {
        bool inside = o >= lo && o <= hi;
        *in = (QCrossing){inside ? -Q_FAR : Q_FAR, 0};
        *out = (QCrossing){-in->t, 0};
        return;
    }
    Quad a = ((Quad)lo - o) / d, b = ((Quad)hi - o) / d;
    *in = (QCrossing){q_min(a, b), Q_ERR * q_abs(q_min(a, b))};
    *out = (QCrossing){q_max(a, b), Q_ERR * q_abs(q_max(a, b))};
}

void sphere_truth(double minor, const Ray *ray, Truth *truth)
{
    (void)minor;
    QLine l = q_line(ray);
    QForm f = q_form(&l, (const int[]){1, 1, 1}, -1);
    QCrossing x[2];
    *truth = (Truth){.sure = Q_FAR};
    if (form_roots(&f, &l, x, truth) == 2) finish_interval(x[0], x[1], truth);
}

void cube_truth(double minor, const Ray *ray, Truth *truth)
{
    (void)minor;
    QCrossing in = {-Q_FAR, 0}, out = {Q_FAR, 0};
    *truth = (Truth){.sure = Q_FAR};
    for (int i = 0; i < 3; i++) {
        QCrossing a, b;
        slab(vec3_get(ray->o, i), vec3_get(ray->d, i), 0, 1, &a, &b);
        in = later(in, a);
        out = sooner(out, b);
    }
    finish_interval(in, out, truth);
}

void cylinder_truth(double minor, const Ray *ray, Truth *truth)
{
    (void)minor;
    QLine l = q_line(ray);
    QForm f = q_form(&l, (const int[]){1, 0, 1}, -1);
    QCrossing x[2] = {{-Q_FAR, 0}, {Q_FAR, 0}}, in, out;
    *truth = (Truth){.sure = Q_FAR};
    slab(ray->o.y, ray->d.y, -1, 1, &in, &out);
    if (f.a == 0) {
        must_differ(truth, f.c, f.ec);
        if (f.c > 0) return;
    } else if (form_roots(&f, &l, x, truth) == 0) {
        return;
    }
    finish_interval(later(in, x[0]), sooner(out, x[1]), truth);
}

/* Lines through the apex itself, as products of doubles are exact: they stay inside from there down to the base, or on
 * the side, unless they are flatter than it and only touch the apex. Flatter by a rounding or two, either is right. */
#define HARDLY_FLATTER ((Quad)0x1p-50)

static bool apex_line(const Ray *ray, Truth *truth)
{
    Quad o[3] = {ray->o.x, ray->o.y, ray->o.z}, d[3] = {ray->d.x, ray->d.y, ray->d.z};
    if (d[1] == 0) return false;
    double t = -ray->o.y / ray->d.y;
    for (int i = 0; i < 3; i++)
        if (o[i] != -t * d[i]) return false;
    Quad base = (-1 - o[1]) / d[1], a = d[0] * d[0] + d[2] * d[2] - d[1] * d[1];
    bool open = a > 0 && a < HARDLY_FLATTER * d[1] * d[1];
    *truth = (Truth){.t = {q_min(t, base), q_max(t, base)}, .n = a > 0 ? 0 : 2, .sure = open ? 0 : Q_FAR};
    truth->err[base < t ? 0 : 1] = Q_ERR * q_abs(base);
    may_touch(truth, t);
    return true;
}

void cone_truth(double minor, const Ray *ray, Truth *truth)
{
    if (apex_line(ray, truth)) return;
    (void)minor;
    QLine l = q_line(ray);
    QForm f = q_form(&l, (const int[]){1, -1, 1}, 0);
    QCrossing in, out, x[2];
    *truth = (Truth){.sure = Q_FAR};
    slab(ray->o.y, ray->d.y, -1, 0, &in, &out);
    if (in.t >= out.t) return;
    /* cut the slab at the roots: the piece whose middle is inside, y being below 0 throughout */
    QCrossing cut[4] = {in};
    int n = 1, roots = form_roots(&f, &l, x, truth);
    for (int i = 0; i < roots; i++) {
        must_differ(truth, x[i].t - in.t, x[i].err + in.err);
        must_differ(truth, x[i].t - out.t, x[i].err + out.err);
        may_touch(truth, x[i].t);
        if (x[i].t > cut[n - 1].t && x[i].t < out.t) cut[n++] = x[i];
    }
    cut[n] = out;
    for (int i = 0; i < n; i++) {
        Quad m = (cut[i].t + cut[i + 1].t) / 2 - l.t0;
        if ((f.a * m + 2 * f.b) * m + f.c <= 0 && cut[i].t < cut[i + 1].t) finish_interval(cut[i], cut[i + 1], truth);
    }
}

static Quad poly_error(const Quad *c, const Quad *err, int degree, Quad x)
{
    Quad y = 0, ax = q_abs(x);
    for (int i = degree; i >= 0; i--) y = y * ax + err[i] + Q_ERR * q_abs(c[i]);
    return y;
}

void torus_truth(double minor, const Ray *ray, Truth *truth)
{
    QLine l = q_line(ray);
    Quad m = minor, rim = (1 - m) * (1 + m), outer = (1 + m) * (1 + m);
    QForm all = q_form(&l, (const int[]){1, 1, 1}, 0), flat = q_form(&l, (const int[]){1, 0, 1}, 0);
    Quad a = all.a, b = all.b, k = all.c + rim, ek = all.ec + Q_ERR * (all.c + q_abs(rim));
    *truth = (Truth){.sure = Q_FAR};
    if (all.c > outer) {
        must_differ(truth, all.c - outer, all.ec + Q_ERR * outer);
        return;
    }
    /* (all + rim)^2 - 4 flat along the line */
    Quad p[5] = {k * k - 4 * flat.c, 4 * b * k - 8 * flat.b, 4 * b * b + 2 * a * k - 4 * flat.a, 4 * a * b, a * a};
    Quad err[5] = {2 * q_abs(k) * ek + 4 * flat.ec + Q_ERR * (k * k + 4 * flat.c),
                   4 * (q_abs(b) * ek + q_abs(k) * all.eb) + 8 * flat.eb + Q_ERR * (4 * q_abs(b * k) + 8 * q_abs(flat.b)),
                   8 * q_abs(b) * all.eb + 2 * (a * ek + q_abs(k) * all.ea) + 4 * flat.ea +
                       Q_ERR * (4 * b * b + 2 * a * q_abs(k) + 4 * flat.a),
                   4 * (a * all.eb + q_abs(b) * all.ea) + Q_ERR * 4 * a * q_abs(b), 2 * a * all.ea + Q_ERR * a * a};
    Quad derivative[4] = {p[1], 2 * p[2], 3 * p[3], 4 * p[4]}, stop[5], root[4];
    Quad limit = 2 * (1 + m) / q_sqrt(a);
    int stops = poly_roots(derivative, 3, -limit, limit, stop + 1);
    stop[0] = -limit;
    stop[stops + 1] = limit;
    int n = roots_between(p, derivative, 4, stop, stops, root);
    for (int i = 1; i <= stops; i++) {
        must_differ(truth, poly(p, 4, stop[i]), poly_error(p, err, 4, stop[i]));
        may_touch(truth, l.t0 + stop[i]);
    }
    /* the inner sheet of a spindle, |p|^2 + 1 - m^2 < 0, bounds nothing */
    const Quad g[3] = {k, 2 * b, a}, eg[3] = {ek, 2 * all.eb, all.ea};
    for (int i = 0; i < n; i++) {
        Quad r = root[i], sheet = poly(g, 2, r);
        if (m > 1) must_differ(truth, sheet, poly_error(g, eg, 2, r));
        if (m > 1 && sheet < 0) continue;
        Quad slope = q_abs(poly(derivative, 3, r));
        /* 2^-100 r is what poly_zero makes sure of */
        truth->err[truth->n] = 2 * poly_error(p, err, 4, r) / slope + 0x1p-100 * q_abs(r) + Q_ERR * q_abs(l.t0);
        truth->t[truth->n++] = l.t0 + r;
    }
}

Quad sphere_distance(double minor, const Surface *s, uint32_t part)
{
    (void)minor, (void)part;
    Quad x = s->p.x, y = s->p.y, z = s->p.z;
    return q_sqrt(x * x + y * y + z * z) - 1;
}

static Quad outside(Quad x, Quad lo, Quad hi) { return q_max(0, q_max(lo - x, x - hi)); }

Quad cube_distance(double minor, const Surface *s, uint32_t part)
{
    (void)minor;
    Quad p[3] = {s->p.x, s->p.y, s->p.z}, far = q_abs(p[part / 2] - (part % 2));
    for (int i = 0; i < 3; i++) far = q_max(far, outside(p[i], 0, 1));
    return far;
}

Quad cylinder_distance(double minor, const Surface *s, uint32_t part)
{
    (void)minor;
    Quad x = s->p.x, y = s->p.y, z = s->p.z, r = q_sqrt(x * x + z * z);
    if (part == 0) return q_max(q_abs(r - 1), outside(y, -1, 1));
    return q_max(q_abs(y - (part == 1 ? 1 : -1)), outside(r, 0, 1));
}

Quad cone_distance(double minor, const Surface *s, uint32_t part)
{
    (void)minor;
    Quad x = s->p.x, y = s->p.y, z = s->p.z, r = q_sqrt(x * x + z * z);
    if (part == 0) return q_max(q_abs(r + y) / q_sqrt(2), outside(y, -1, 0));
    return q_max(q_abs(y + 1), outside(r, 0, 1));
}

Quad torus_distance(double minor, const Surface *s, uint32_t part)
{
    (void)part;
    Quad x = s->p.x, y = s->p.y, z = s->p.z, r = q_sqrt(x * x + z * z) - 1;
    return q_sqrt(r * r + y * y) - minor;
}
