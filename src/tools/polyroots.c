/* Notation of Algorithm 1010 (see the header): x^4 + a x^3 + b x^2 + c x + d is the quadratic form of a symmetric 3 x 3
 * matrix in (x^2, x, 1) that has one free parameter phi. Made singular by a root of the resolvent cubic, its L D L^T
 * decomposition (l1, l2, l3, d2) gives the factors (x^2 + aq x + bq)(x^2 + cq x + dq). */
#include "tools/polyroots.h"

#include <stdint.h>
#include <string.h>

#include "common/numeric.h"

/* -- quadratic -- */

/* x 2^e: for ordinary exponents a product with the power, whose bits are its exponent alone, is faster than ldexp. */
static double scale(double x, int e)
{
    if (e < -1022 || e > 1023) return ldexp(x, e);
    uint64_t bits = (uint64_t)(e + 1023) << 52;
    double power;
    memcpy(&power, &bits, sizeof power);
    return x * power;
}

static Dd dd_scale(Dd a, int e) { return (Dd){scale(a.hi, e), scale(a.lo, e)}; }

/* x = q 2^k, q off by at most err. */
static PolyRoot scaled_root(Dd q, double err, int k)
{
    if (k == 0) return (PolyRoot){q.hi, q.lo, err};
    double x = scale(q.hi, k), lo = isfinite(x) ? scale(q.lo, k) : 0;
    return (PolyRoot){x, lo, scale(err, k) + 0x1p-1074};
}

/* -num / den 2^k; both have relative errors. */
static PolyRoot quotient_root(Dd num, double num_err, Dd den, double den_err, int k)
{
    Dd q = dd_neg(dd_div(num, den));
    return scaled_root(q, fabs(q.hi) * (DD_ROUNDOFF + 2 * (num_err + den_err)), k);
}

static double relative_noise(const Dd *c, const double *noise, int i)
{
    return noise && c[i].hi != 0 ? noise[i] / fabs(c[i].hi) : 0;
}

/* c[i + 1] x + c[i]. */
static PolyRoot linear_root(const Dd *c, const double *noise, int i)
{
    int e = ilogb(c[i + 1].hi), k = c[i].hi == 0 ? 0 : ilogb(c[i].hi);
    return quotient_root(dd_scale(c[i], -k), relative_noise(c, noise, i), dd_scale(c[i + 1], -e),
                         relative_noise(c, noise, i + 1), k - e);
}

static bool root_before(const PolyRoot *a, const PolyRoot *b) { return a->x < b->x || (a->x == b->x && a->lo < b->lo); }

/* Between these no product of two of three coefficients nor its error leaves the range of a double. */
static bool is_ordinary(double c) { return c == 0 || (fabs(c) > 0x1p-200 && fabs(c) < 0x1p200); }

/* q = -(b + sign(b) sqrt(b^2 - a c)) never subtracts; the roots are q / a and c / q. Bounds to first order. */
int poly_quadratic(const Dd c[3], const double noise[3], PolyRoot root[2])
{
    if (!isfinite(c[0].hi) || !isfinite(c[1].hi) || !isfinite(c[2].hi)) return 0;
    if (c[2].hi == 0) {
        if (c[1].hi == 0) return 0;
        root[0] = linear_root(c, noise, 0);
        return 1;
    }
    Dd a = c[2], b = {0.5 * c[1].hi, 0.5 * c[1].lo}, z = c[0];
    double na = noise ? noise[2] : 0, nb = noise ? 0.5 * noise[1] : 0, nz = noise ? noise[0] : 0;
    int k = 0;
    if (!is_ordinary(a.hi) || !is_ordinary(c[1].hi) || !is_ordinary(z.hi)) {
        /* x = 2^k y brings a and c to the order of 1 */
        int ea = ilogb(a.hi), eb = c[1].hi == 0 ? 0 : ilogb(c[1].hi), ez = z.hi == 0 ? 0 : ilogb(z.hi);
        k = ez >= ea ? (ez - ea) / 2 : -((ea - ez + 1) / 2);
        if (c[1].hi != 0 && (z.hi == 0 || eb - ea - k > 120)) {
            /* b^2 exceeds a c by 2^238 at least: the roots are -b / a and -c / b to far beyond a double-double */
            PolyRoot big = linear_root(c, noise, 1), small = linear_root(c, noise, 0);
            bool swap = (c[1].hi < 0) == (a.hi < 0);   /* big is negative, whatever it is rounded to */
            root[swap ? 0 : 1] = big;
            root[swap ? 1 : 0] = small;
            return 2;
        }
        a = dd_scale(a, -ea);
        b = c[1].hi == 0 ? (Dd){0, 0} : dd_scale(c[1], -ea - k - 1);
        z = dd_scale(z, -ea - 2 * k);
        na = scale(na, -ea);
        nb = scale(nb, -ea - k);
        nz = scale(nz, -ea - 2 * k);
    }
    Dd bb = dd_mul(b, b), az = dd_mul(a, z), disc = dd_sub(bb, az);
    double e_disc = 2 * fabs(b.hi) * nb + fabs(a.hi) * nz + fabs(z.hi) * na;
    if (a.lo != 0 || b.lo != 0 || z.lo != 0) e_disc += DD_ROUNDOFF * (bb.hi + fabs(az.hi));
    if (disc.hi < 0) {
        if (disc.hi < -e_disc) return 0;
        disc = (Dd){0, 0};
    }
    e_disc += DD_ROUNDOFF * disc.hi;
    Dd s = dd_sqrt(disc), q = dd_neg(b.hi < 0 ? dd_sub(b, s) : dd_add(b, s));
    double e_root = disc.hi > 2 * e_disc ? e_disc / s.hi : sqrt(3 * e_disc);
    double eq = nb + e_root + DD_ROUNDOFF * fabs(q.hi);
    if (q.hi == 0) {
        root[0] = root[1] = scaled_root((Dd){0, 0}, 2 * eq / fabs(a.hi), k);
        return 2;
    }
    Dd r0 = dd_div(z, q), r1 = dd_div(q, a);
    double e0 = 2 * (nz + fabs(r0.hi) * eq) / fabs(q.hi) + DD_ROUNDOFF * fabs(r0.hi);
    double e1 = 2 * (eq + fabs(r1.hi) * na) / fabs(a.hi) + DD_ROUNDOFF * fabs(r1.hi);
    PolyRoot first = scaled_root(r0, e0, k), second = scaled_root(r1, e1, k);
    bool swap = root_before(&second, &first);
    root[0] = swap ? second : first;
    root[1] = swap ? first : second;
    return 2;
}

/* -- factoring a quartic -- */

/* The root of greatest magnitude of x^3 + g x + h. */
static double depressed_cubic_dominant(double g, double h)
{
    double q = -g / 3, r = 0.5 * h, q3 = q * q * q, rr = r * r;
    if (q == 0 && r == 0) return 0;
    if (rr < q3) {
        double theta = acos(r / sqrt(q3)), m = -2 * sqrt(q);
        return theta < M_PI / 2 ? m * cos(theta / 3) : m * cos((theta + 2 * M_PI) / 3);
    }
    double s = -copysign(cbrt(fabs(r) + sqrt(rr - q3)), r);
    return s == 0 ? 0 : s + q / s;
}

/* The resolvent's dominant root phi0. Its coefficients don't change under a shift of x, and are taken where b vanishes
 * or is least: that spares cancellation. */
static double resolvent_root(double a, double b, double c, double d)
{
    double disc = 9 * a * a - 24 * b, s = -a / 4;
    if (disc > 0) s = -2 * b / (3 * a + copysign(sqrt(disc), a));
    double aq = a + 4 * s, bq = b + 3 * s * (a + 2 * s), cq = c + s * (2 * b + s * (3 * a + 4 * s));
    double dq = d + s * (c + s * (b + s * (a + s)));
    double gg = bq * bq / 9, hh = aq * cq, g = hh - 4 * dq - 3 * gg;
    double h = (8 * dq + hh - 2 * gg) * bq / 3 - cq * cq - dq * aq * aq;
    double x = depressed_cubic_dominant(g, h), f = x * (x * x + g) + h;
    for (int i = 0; i < 8 && f != 0; i++) {
        double slope = 3 * x * x + g;
        if (slope == 0) break;
        double next = x - f / slope, f_next = next * (next * next + g) + h;
        if (!(fabs(f_next) < fabs(f))) break;
        x = next;
        f = f_next;
    }
    return x;
}

static double relative(double got, double want) { return want == 0 ? fabs(got) : fabs((got - want) / want); }

typedef struct { double aq, bq, cq, dq; } Factors;

static double factors_error(const double c[4], const Factors *f)
{
    return relative(f->aq + f->cq, c[3]) + relative(f->bq + f->aq * f->cq + f->dq, c[2]) +
           relative(f->bq * f->cq + f->aq * f->dq, c[1]) + relative(f->bq * f->dq, c[0]);
}

/* Newton's method on the four coefficients as functions of the factors; keeps what is best. */
static void polish_factors(const double c[4], Factors *f)
{
    double best = factors_error(c, f);
    for (int i = 0; i < 8 && best > 0; i++) {
        Factors x = *f;
        double f0 = x.bq * x.dq - c[0], f1 = x.bq * x.cq + x.aq * x.dq - c[1];
        double f2 = x.bq + x.aq * x.cq + x.dq - c[2], f3 = x.aq + x.cq - c[3];
        /* eliminate d(aq) = -f3 - d(cq) and d(bq) = -f2 - aq d(cq) - cq d(aq) - d(dq); two equations remain */
        double e = x.cq - x.aq;   /* d(bq) = r + e d(cq) - d(dq) */
        double r = -f2 + x.cq * f3;
        double m00 = x.dq * e, m01 = x.bq - x.dq, r0 = -f0 - x.dq * r;
        double m10 = x.cq * e + x.bq - x.dq, m11 = x.aq - x.cq, r1 = -f1 - x.cq * r + x.dq * f3;
        double det = m00 * m11 - m01 * m10;
        if (det == 0) return;
        double dc = (r0 * m11 - m01 * r1) / det, dd = (m00 * r1 - m10 * r0) / det;
        x.aq += -f3 - dc;
        x.bq += r + e * dc - dd;
        x.cq += dc;
        x.dq += dd;
        double error = factors_error(c, &x);
        if (!(error < best)) return;
        best = error;
        *f = x;
    }
}

/* Of several values for d2 and l2, which agree in exact arithmetic, the pair that reproduces b, c, d best. */
static void choose_ldl(const double c[4], double l1, double l3, double bl311, double *d2, double *l2)
{
    double del2 = c[1] - c[3] * l3, dml3l3 = c[0] - l3 * l3, try_d2[3], try_l2[3], best = INFINITY;
    int n = 0;
    if (bl311 != 0) {
        try_d2[n] = bl311;
        try_l2[n++] = del2 / (2 * bl311);
    }
    if (del2 != 0) {
        double l = 2 * dml3l3 / del2;
        if (l != 0) {
            try_d2[n] = del2 / (2 * l);
            try_l2[n++] = l;
        }
        try_d2[n] = bl311;
        try_l2[n++] = l;
    }
    *d2 = *l2 = 0;
    for (int i = 0; i < n; i++) {
        double d = try_d2[i], l = try_l2[i];
        double error = relative(d + l1 * l1 + 2 * l3, c[2]) + relative(2 * (d * l + l1 * l3), c[1]) +
                       relative(d * l * l + l3 * l3, c[0]);
        if (error < best) {
            best = error;
            *d2 = d;
            *l2 = l;
        }
    }
}

/* False if the factors are complex, (x^2 + aq x + bq) + i (cq x + dq) and its conjugate: then so are all roots (or real
 * ones are double). */
static bool factor_quartic(const double c[4], Factors *f)
{
    double a = c[3], b = c[2], d = c[0], phi = resolvent_root(c[3], c[2], c[1], c[0]);
    double l1 = a / 2, l3 = b / 6 + phi / 2, bl311 = 2 * b / 3 - phi - l1 * l1, d2, l2;
    choose_ldl(c, l1, l3, bl311, &d2, &l2);
    bool found = false;
    if (d2 < 0) {
        double g = sqrt(-d2);
        *f = (Factors){l1 + g, l3 + g * l2, l1 - g, l3 - g * l2};
        if (fabs(f->dq) < fabs(f->bq)) f->dq = d / f->bq;
        else if (fabs(f->dq) > fabs(f->bq)) f->bq = d / f->dq;
        if (fabs(f->aq) < fabs(f->cq)) f->aq = a - f->cq;
        else f->cq = a - f->aq;
        found = true;
    }
    /* d2 = 0 within its rounding: both factors have the same linear term */
    double d3 = d - l3 * l3;
    if (fabs(d2) <= 4 * UNIT_ROUNDOFF * (fabs(2 * b / 3) + fabs(phi) + l1 * l1) && d3 <= 0) {
        double s = sqrt(-d3);
        Factors same = {l1, l3 + s, l1, l3 - s};
        if (fabs(same.dq) < fabs(same.bq)) same.dq = d / same.bq;
        else if (same.dq != 0) same.bq = d / same.dq;
        if (!found || factors_error(c, &same) < factors_error(c, f)) *f = same;
        found = true;
    }
    if (found) {
        polish_factors(c, f);
    } else {
        double g = sqrt(fmax(d2, 0));
        *f = (Factors){l1, l3, g, g * l2};
    }
    return found;
}

static void sort_roots(double *x, int n)
{
    for (int i = 1; i < n; i++)
        for (int j = i; j > 0 && x[j] < x[j - 1]; j--) {
            double swap = x[j];
            x[j] = x[j - 1];
            x[j - 1] = swap;
        }
}

/* How far a discriminant must stay from 0, and a complex root from the real axis, coefficients being of order 1, for
 * the rounding of the coefficients and of the factors (below 2^-40) to be unable to make real roots of complex ones or
 * the reverse: a double complex root moves by the square root of that. */
#define SURE_DISC 0x1p-14
#define SURE_IMAGINARY 0x1p-8
#define SURE_RESIDUAL 0x1p-40

/* The roots of x^2 + (p + i r) x + (q + i s) stay clear of the real axis, and the product with the conjugate is c. */
static bool surely_complex(const double c[4], const Factors *f)
{
    double p = f->aq, q = f->bq, r = f->cq, s = f->dq, size = 1 + fabs(p) + fabs(q) + fabs(r) + fabs(s);
    double off = fabs(2 * p - c[3]) + fabs(p * p + 2 * q + r * r - c[2]) + fabs(2 * (p * q + r * s) - c[1]) +
                 fabs(q * q + s * s - c[0]);
    if (!(off < SURE_RESIDUAL * size)) return false;
    /* the imaginary part of the root of the discriminant u + i v */
    double u = p * p - r * r - 4 * q, v = 2 * p * r - 4 * s, root = sqrt(0.5 * (sqrt(u * u + v * v) - u));
    return fabs(0.5 * (r - root)) > SURE_IMAGINARY && fabs(0.5 * (r + root)) > SURE_IMAGINARY;
}

bool poly_quartic_guess(const double c[4], double root[4], int *count)
{
    Factors f;
    *count = 0;
    if (!factor_quartic(c, &f)) return surely_complex(c, &f);
    double size = 1 + fabs(f.aq) + fabs(f.bq) + fabs(f.cq) + fabs(f.dq);
    double off = fabs(f.aq + f.cq - c[3]) + fabs(f.bq + f.aq * f.cq + f.dq - c[2]) +
                 fabs(f.bq * f.cq + f.aq * f.dq - c[1]) + fabs(f.bq * f.dq - c[0]);
    double disc[2] = {f.aq * f.aq - 4 * f.bq, f.cq * f.cq - 4 * f.dq};
    if (!(off < SURE_RESIDUAL * size && fabs(disc[0]) > SURE_DISC * size && fabs(disc[1]) > SURE_DISC * size))
        return false;
    double p[2] = {f.aq, f.cq}, q[2] = {f.bq, f.dq};
    int n = 0;
    for (int i = 0; i < 2; i++) {
        if (disc[i] < 0) continue;
        double s = -0.5 * (p[i] + copysign(sqrt(disc[i]), p[i]));
        root[n++] = s;
        root[n++] = q[i] / s;
    }
    sort_roots(root, n);
    *count = n;
    return true;
}

/* -- isolation by sign -- */

/* The value of a quartic in double-double and a bound on its error: noise[i] is that of coefficient i, roundings
 * included. */
static Dd evaluate(const Dd c[5], const double noise[5], Dd x, double *bound)
{
    Dd y = c[4];
    double b = noise[4], ax = fabs(x.hi);
    for (int i = 3; i >= 0; i--) {
        y = dd_add(dd_mul(y, x), c[i]);
        b = b * ax + noise[i];
    }
    *bound = b;
    return y;
}

__attribute__((noinline)) static double evaluate_exactly(const Dd *c, int degree, double x)
{
    Dd y = c[degree];
    for (int i = degree - 1; i >= 0; i--) y = dd_add(dd_mul_d(y, x), c[i]);
    return y.hi;
}

/* The value, in plain double precision where its sign is certain so. */
static double evaluate_sign(const Dd *c, int degree, double x)
{
    double y = c[degree].hi, size = fabs(y), ax = fabs(x);
    for (int i = degree - 1; i >= 0; i--) {
        y = y * x + c[i].hi;
        size = size * ax + fabs(c[i].hi);
    }
    return fabs(y) > GAMMA(16) * size ? y : evaluate_exactly(c, degree, x);
}

static double evaluate_plain(const Dd *c, int degree, double x)
{
    double y = c[degree].hi;
    for (int i = degree - 1; i >= 0; i--) y = y * x + c[i].hi;
    return y;
}

static void derive(const Dd *c, int degree, Dd *out)
{
    for (int i = 1; i <= degree; i++) out[i - 1] = dd_mul_d(c[i], i);
}

/* The sign change in [lo, hi], where the value is negative at one end and not at the other, to double precision:
 * Newton's method, and bisection where that leaves the bracket or is slow. */
static double bracketed_zero(const Dd *c, const Dd *slope, int degree, double lo, double hi, bool rising)
{
    double x = 0.5 * (lo + hi), last_step = hi - lo;
    for (int i = 0; i < 200; i++) {
        double y = evaluate_sign(c, degree, x);
        if (y == 0) break;
        if ((y < 0) == rising) lo = x;
        else hi = x;
        double next = x - y / evaluate_plain(slope, degree - 1, x);
        if (!(next > lo && next < hi && fabs(next - x) <= 0.5 * last_step)) next = 0.5 * (lo + hi);
        last_step = fabs(next - x);
        x = next;
        if (last_step <= UNIT_ROUNDOFF * fabs(x)) break;
    }
    return x;
}

/* About how far from x the value must get out of `doubt`: the least of what its Taylor terms need alone. Near a
 * multiple root the slope says nothing, the second to fourth derivatives do. */
static double doubtful_width(const Dd *c, double x, double doubt)
{
    double p1 = fabs(((4 * c[4].hi * x + 3 * c[3].hi) * x + 2 * c[2].hi) * x + c[1].hi), first = doubt / p1;
    double p2 = fabs((6 * c[4].hi * x + 3 * c[3].hi) * x + c[2].hi), p3 = fabs(4 * c[4].hi * x + c[3].hi);
    double p4 = fabs(c[4].hi);
    if (((p4 * first + p3) * first + p2) * first < p1) return first;
    return fmin(fmin(first, sqrt(doubt / p2)), fmin(cbrt(doubt / p3), sqrt(sqrt(doubt / p4))));
}

/* What a Newton step leaves, its slope having been rounded and the value being no straight line. */
#define STEP_ROUNDOFF 0x1p-40

static double first_error(const Dd *c, Dd x, double step, double bound)
{
    double err = STEP_ROUNDOFF * fabs(step) + DD_ROUNDOFF * fabs(x.hi) + 0x1p-1074;
    double width = bound > 0 ? doubtful_width(c, x.hi, 2 * bound) : 0;
    return isfinite(width) ? err + width : err;
}

/* The rest that x leaves out, and an error widened until the signs on both sides are beyond doubt or the bracket's ends
 * are reached. */
static PolyRoot finish_root(const Dd *c, const double *noise, const Dd *slope_c, double x, double lo, double hi,
                            bool rising)
{
    double bound, step = -evaluate(c, noise, (Dd){x, 0}, &bound).hi / evaluate_plain(slope_c, 3, x);
    if (!(fabs(step) <= GAMMA(8) * fabs(x))) step = 0;
    Dd sum = dd_quick_sum(x, step);
    double err = first_error(c, sum, step, bound);
    for (int i = 0; i < 600; i++, err *= 2) {
        double bound_a, bound_b;
        Dd a = dd_add_d(sum, -err), b = dd_add_d(sum, err);
        bool left_done = a.hi <= lo, right_done = b.hi >= hi;
        Dd ya = evaluate(c, noise, a, &bound_a), yb = evaluate(c, noise, b, &bound_b);
        if (!left_done) left_done = rising ? ya.hi < -bound_a : ya.hi > bound_a;
        if (!right_done) right_done = rising ? yb.hi > bound_b : yb.hi < -bound_b;
        if (left_done && right_done) break;
    }
    return (PolyRoot){sum.hi, sum.lo, err};
}

/* The sign changes in (-limit, limit), where `stop` are the roots of the derivative; where the value only touches 0
 * there is none. Gives the zeros, and (of a quartic, unless NULL) the roots with their bounds. */
static int zeros_between(const Dd *c, const Dd *slope, int degree, double limit, const double *stop, int stops,
                         double *zero, const double *noise, PolyRoot *root)
{
    int n = 0;
    double a = -limit;
    bool negative_a = evaluate_sign(c, degree, a) < 0;
    for (int i = 0; i <= stops; i++) {
        double b = i < stops ? stop[i] : limit, y = evaluate_sign(c, degree, b);
        bool negative_b = y == 0 ? negative_a : y < 0;
        if (negative_a != negative_b) {
            double x = bracketed_zero(c, slope, degree, a, b, negative_a);
            if (root) root[n] = finish_root(c, noise, slope, x, a, b, negative_a);
            zero[n++] = x;
        }
        a = b;
        negative_a = negative_b;
    }
    return n;
}

/* The zeros of the derivatives, one after the other, starting from the linear third one. */
static int isolate_quartic(const Dd c[5], const Dd d1[4], const double noise[5], double limit, PolyRoot root[4],
                           double critical[3], int *criticals)
{
    Dd d2[3], d3[2];
    derive(d1, 3, d2);
    derive(d2, 2, d3);
    double inflection = -d3[0].hi / d3[1].hi, turn[2], stop[3], zero[4];
    int turns = zeros_between(d2, d3, 2, limit, &inflection, 1, turn, NULL, NULL);
    int stops = zeros_between(d1, d2, 3, limit, turn, turns, stop, NULL, NULL);
    if (criticals) {
        for (int i = 0; i < stops; i++) critical[i] = stop[i];
        *criticals = stops;
    }
    return zeros_between(c, d1, 4, limit, stop, stops, zero, noise, root);
}

/* Polishes a guess and makes sure of it. False: isolate instead. */
static bool polish_root(const Dd c[5], const Dd slope_c[4], const double noise[5], double x, PolyRoot *root)
{
    double bound, step = 0;
    Dd sum = {x, 0};
    for (int i = 0; i < 3; i++) {
        Dd y = evaluate(c, noise, (Dd){sum.hi, 0}, &bound);
        step = -y.hi / evaluate_plain(slope_c, 3, sum.hi);
        sum = dd_sum(sum.hi, step);
        if (!(fabs(step) > GAMMA(4) * fabs(sum.hi))) break;
    }
    if (!(fabs(step) <= GAMMA(4) * fabs(sum.hi))) return false;
    double err = first_error(c, sum, step, bound), bound_a, bound_b;
    Dd a = evaluate(c, noise, dd_add_d(sum, -err), &bound_a), b = evaluate(c, noise, dd_add_d(sum, err), &bound_b);
    *root = (PolyRoot){sum.hi, sum.lo, err};
    return fabs(a.hi) > bound_a && fabs(b.hi) > bound_b && (a.hi < 0) != (b.hi < 0);
}

int poly_quartic(const Dd c[5], const double noise[5], PolyRoot root[4], double critical[3], int *criticals)
{
    if (criticals) *criticals = 0;
    for (int i = 0; i < 5; i++)
        if (!isfinite(c[i].hi)) return 0;

    /* x = 2^k y makes every coefficient at most of the order of the leading one; all roots are then below 4
     * (Fujiwara's bound is twice the greatest |c_i / c_4|^(1 / (4 - i))) */
    int e4 = ilogb(c[4].hi), k = -10000;
    for (int i = 0; i < 4; i++) {
        if (c[i].hi == 0) continue;
        int e = ilogb(c[i].hi) - e4, part = e >= 0 ? (e + 3 - i) / (4 - i) : -(-e / (4 - i));
        if (part > k) k = part;
    }
    if (k == -10000) return 0;
    Dd s[5];
    double bound[5];
    for (int i = 0; i < 5; i++) {
        int e = k * (i - 4) - e4;
        s[i] = dd_scale(c[i], e);
        bound[i] = 0x1p-98 * fabs(s[i].hi) + (noise ? scale(noise[i], e) : 0);
    }

    Dd slope[4];
    derive(s, 4, slope);
    double monic[4], guess[4];
    int n;
    for (int i = 0; i < 4; i++) monic[i] = s[i].hi / s[4].hi;
    bool sure = !criticals && poly_quartic_guess(monic, guess, &n);
    for (int i = 0; sure && i < n; i++) sure = polish_root(s, slope, bound, guess[i], &root[i]);
    if (sure)
        for (int i = 1; i < n; i++) sure = sure && root[i].x - root[i].err > root[i - 1].x + root[i - 1].err;
    if (!sure) n = isolate_quartic(s, slope, bound, 8, root, critical, criticals);
    for (int i = 0; i < n; i++)
        root[i] = scaled_root((Dd){root[i].x, root[i].lo}, root[i].err, k);
    if (criticals)
        for (int i = 0; i < *criticals; i++) critical[i] = scale(critical[i], k);
    return n;
}
