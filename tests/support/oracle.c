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

typedef struct { Quad o[3], d[3], t0; } QLine;   /* the ray's t is t0 + r */

/* The ray's line about its point nearest to the origin. */
static QLine q_line(const Ray *ray)
{
    QLine l = {{ray->o.x, ray->o.y, ray->o.z}, {ray->d.x, ray->d.y, ray->d.z}, 0};
    for (int round = 0; round < 2; round++) {
        Quad od = 0, dd = 0;
        for (int i = 0; i < 3; i++) {
            od += l.o[i] * l.d[i];
            dd += l.d[i] * l.d[i];
        }
        Quad t = -od / dd;
        l.t0 += t;
        for (int i = 0; i < 3; i++) l.o[i] += t * l.d[i];
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

int poly_roots(const Quad *c, int degree, Quad lo, Quad hi, Quad *root)
{
    if (degree == 0) return 0;
    Quad derivative[8], stop[10];
    for (int i = 1; i <= degree; i++) derivative[i - 1] = c[i] * i;
    int stops = poly_roots(derivative, degree - 1, lo, hi, stop + 1), n = 0;
    stop[0] = lo;
    stop[stops + 1] = hi;
    for (int i = 0; i <= stops; i++)
        if ((poly(c, degree, stop[i]) < 0) != (poly(c, degree, stop[i + 1]) < 0))
            root[n++] = poly_zero(c, derivative, degree, stop[i], stop[i + 1]);
    return n;
}

/* Roots of a r^2 + 2 b r + c as an interval; false if there are none. */
static bool q_quadratic(Quad a, Quad b, Quad c, Quad r[2])
{
    Quad disc = b * b - a * c;
    if (disc <= 0) return false;
    Quad root = q_sqrt(disc), q = b < 0 ? -b + root : -b - root;
    r[0] = q_min(q / a, c / q);
    r[1] = q_max(q / a, c / q);
    return true;
}

static void finish_interval(Quad in, Quad out, const QLine *l, Truth *truth)
{
    Quad length = q_sqrt(l->d[0] * l->d[0] + l->d[1] * l->d[1] + l->d[2] * l->d[2]);
    truth->margin = q_min(truth->margin, q_abs(out - in) * length);
    truth->n = 0;
    if (in >= out) return;
    truth->t[0] = l->t0 + in;
    truth->t[1] = l->t0 + out;
    truth->n = 2;
}

/* From the ray's own origin: moved to the nearest point, a steep plane's t would lose digits. */
static void slab(const QLine *l, double origin, int axis, Quad lo, Quad hi, Quad *in, Quad *out, Quad *margin)
{
    Quad o = origin, d = l->d[axis];
    *margin = q_min(*margin, 1);
    if (d == 0) {
        *margin = q_min(*margin, q_min(q_abs(o - lo), q_abs(o - hi)));
        bool inside = o >= lo && o <= hi;
        *in = inside ? -Q_FAR : Q_FAR;
        *out = -*in;
        return;
    }
    Quad a = (lo - o) / d - l->t0, b = (hi - o) / d - l->t0;
    *in = q_min(a, b);
    *out = q_max(a, b);
}

void sphere_truth(double minor, const Ray *ray, Truth *truth)
{
    (void)minor;
    QLine l = q_line(ray);
    Quad a = 0, b = 0, c = -1, r[2] = {0, 0};
    for (int i = 0; i < 3; i++) {
        a += l.d[i] * l.d[i];
        b += l.o[i] * l.d[i];
        c += l.o[i] * l.o[i];
    }
    truth->margin = q_abs(c - b * b / a);
    q_quadratic(a, b, c, r);
    finish_interval(r[0], r[1], &l, truth);
    if (truth->n == 0) truth->margin = q_abs(c - b * b / a);
}

void cube_truth(double minor, const Ray *ray, Truth *truth)
{
    (void)minor;
    QLine l = {{0, 0, 0}, {ray->d.x, ray->d.y, ray->d.z}, 0};
    Quad in = -Q_FAR, out = Q_FAR;
    truth->margin = 1;
    for (int i = 0; i < 3; i++) {
        Quad a, b;
        slab(&l, vec3_get(ray->o, i), i, 0, 1, &a, &b, &truth->margin);
        in = q_max(in, a);
        out = q_min(out, b);
    }
    finish_interval(in, out, &l, truth);
}

void cylinder_truth(double minor, const Ray *ray, Truth *truth)
{
    (void)minor;
    QLine l = q_line(ray);
    Quad a = l.d[0] * l.d[0] + l.d[2] * l.d[2], b = l.o[0] * l.d[0] + l.o[2] * l.d[2];
    Quad c = l.o[0] * l.o[0] + l.o[2] * l.o[2] - 1, r[2] = {-Q_FAR, Q_FAR}, in, out;
    truth->margin = q_abs(a == 0 ? c : c - b * b / a);
    slab(&l, ray->o.y, 1, -1, 1, &in, &out, &truth->margin);
    truth->n = 0;
    if (a == 0 ? c > 0 : !q_quadratic(a, b, c, r)) return;
    finish_interval(q_max(in, r[0]), q_min(out, r[1]), &l, truth);
}

void cone_truth(double minor, const Ray *ray, Truth *truth)
{
    (void)minor;
    QLine l = q_line(ray);
    Quad a = l.d[0] * l.d[0] - l.d[1] * l.d[1] + l.d[2] * l.d[2];
    Quad b = l.o[0] * l.d[0] - l.o[1] * l.d[1] + l.o[2] * l.d[2];
    Quad c = l.o[0] * l.o[0] - l.o[1] * l.o[1] + l.o[2] * l.o[2];
    Quad dd = l.d[0] * l.d[0] + l.d[1] * l.d[1] + l.d[2] * l.d[2];
    Quad in, out, r[2] = {0, 0};
    truth->n = 0;
    truth->margin = q_abs(b * b - a * c) / dd;
    slab(&l, ray->o.y, 1, -1, 0, &in, &out, &truth->margin);
    if (in >= out) return;
    /* cut the slab at the roots: the piece whose middle is inside, y being below 0 throughout */
    Quad cut[4] = {in, out, out, out};
    int n = 1;
    if (a == 0 && b != 0) r[0] = r[1] = -c / (2 * b);
    else if (a != 0) q_quadratic(a, b, c, r);
    for (int i = 0; i < 2; i++)
        if (r[i] > cut[n - 1] && r[i] < out) cut[n++] = r[i];
    cut[n] = out;
    for (int i = 0; i < n; i++) {
        Quad m = (cut[i] + cut[i + 1]) / 2;
        if ((a * m + 2 * b) * m + c <= 0 && cut[i] < cut[i + 1]) finish_interval(cut[i], cut[i + 1], &l, truth);
    }
}

void torus_truth(double minor, const Ray *ray, Truth *truth)
{
    QLine l = q_line(ray);
    Quad a = 0, b = 0, c = 0, m = minor;
    for (int i = 0; i < 3; i++) {
        a += l.d[i] * l.d[i];
        b += l.o[i] * l.d[i];
        c += l.o[i] * l.o[i];
    }
    truth->n = 0;
    truth->margin = q_abs(c - (1 + m) * (1 + m));
    if (c > (1 + m) * (1 + m)) return;
    Quad flat_a = l.d[0] * l.d[0] + l.d[2] * l.d[2], flat_b = l.o[0] * l.d[0] + l.o[2] * l.d[2];
    Quad flat_c = l.o[0] * l.o[0] + l.o[2] * l.o[2], k = c + 1 - m * m;
    Quad p[5] = {k * k - 4 * flat_c, 4 * b * k - 8 * flat_b, 4 * b * b + 2 * a * k - 4 * flat_a, 4 * a * b, a * a};
    Quad derivative[4] = {p[1], 2 * p[2], 3 * p[3], 4 * p[4]}, stop[4], root[4];
    Quad limit = 2 * (1 + m) / q_sqrt(a);
    int stops = poly_roots(derivative, 3, -limit, limit, stop), n = poly_roots(p, 4, -limit, limit, root);
    for (int i = 0; i < stops; i++)
        truth->margin = q_min(truth->margin, q_abs(poly(p, 4, stop[i])) / (4 * m * m));
    /* the inner sheet of a spindle, |p|^2 + 1 - m^2 < 0, bounds nothing */
    for (int i = 0; i < n; i++) {
        Quad g = (a * root[i] + 2 * b) * root[i] + k;
        if (m > 1) truth->margin = q_min(truth->margin, q_abs(g));
        if (m <= 1 || g >= 0) truth->t[truth->n++] = l.t0 + root[i];
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
