/* Cases 22 and 23: the solvers of tools/polyroots against MPFR. The number of zeros by Sturm's chain, their places by
 * Newton's method and the sign on either side of the bound. */
#include "stability/cases_primitive.h"

#include <float.h>
#include <math.h>
#include <mpfr.h>

#include "common/numeric.h"
#include "common/rng.h"
#include "support/oracle.h"
#include "support/quartic_roots.h"
#include "tools/polyroots.h"

/* Twice 200 bits: Sturm's chain cancels far where roots are spread over 10^18. */
enum { BITS = 400, DEGREE = 4 };

typedef struct { mpfr_t c[DEGREE + 1]; int degree; } Chain;
typedef struct { Chain chain[DEGREE + 1]; int length; mpfr_t x, y, slope, q; } Solver;

static void solver_open(Solver *s)
{
    for (int i = 0; i <= DEGREE; i++)
        for (int k = 0; k <= DEGREE; k++) mpfr_init2(s->chain[i].c[k], BITS);
    mpfr_inits2(BITS, s->x, s->y, s->slope, s->q, (mpfr_ptr)NULL);
}

static void solver_close(Solver *s)
{
    for (int i = 0; i <= DEGREE; i++)
        for (int k = 0; k <= DEGREE; k++) mpfr_clear(s->chain[i].c[k]);
    mpfr_clears(s->x, s->y, s->slope, s->q, (mpfr_ptr)NULL);
}

/* p, p', and then the negative remainder of each two. */
static void solver_chain(Solver *s, const double c[DEGREE + 1])
{
    Chain *p = s->chain;
    p[0].degree = DEGREE;
    p[1].degree = DEGREE - 1;
    for (int i = 0; i <= DEGREE; i++) mpfr_set_d(p[0].c[i], c[i], MPFR_RNDN);
    for (int i = 1; i <= DEGREE; i++) mpfr_mul_ui(p[1].c[i - 1], p[0].c[i], (unsigned long)i, MPFR_RNDN);
    for (s->length = 2; s->length <= DEGREE; s->length++) {
        Chain *r = &p[s->length], *a = r - 2, *b = r - 1;
        if (b->degree == 0) return;
        for (int i = 0; i <= a->degree; i++) mpfr_neg(r->c[i], a->c[i], MPFR_RNDN);
        for (int k = a->degree - b->degree; k >= 0; k--) {
            mpfr_div(s->q, r->c[k + b->degree], b->c[b->degree], MPFR_RNDN);
            for (int i = 0; i < b->degree; i++) {
                mpfr_mul(s->y, s->q, b->c[i], MPFR_RNDN);
                mpfr_sub(r->c[i + k], r->c[i + k], s->y, MPFR_RNDN);
            }
        }
        r->degree = b->degree - 1;
        while (r->degree > 0 && mpfr_zero_p(r->c[r->degree])) r->degree--;
        if (r->degree == 0 && mpfr_zero_p(r->c[0])) return;
    }
}

/* Distinct real zeros: the changes of sign along the chain at -infinity less those at infinity. */
static int solver_count(const Solver *s)
{
    int changes[2] = {0, 0}, last[2] = {0, 0};
    for (int i = 0; i < s->length; i++)
        for (int end = 0; end < 2; end++) {
            int sign = mpfr_sgn(s->chain[i].c[s->chain[i].degree]);
            if (end == 0 && s->chain[i].degree % 2) sign = -sign;
            changes[end] += last[end] * sign < 0;
            last[end] = sign;
        }
    return changes[0] - changes[1];
}

/* The value of the chain's i-th polynomial at s->x, into y. */
static void value(const Solver *s, int i, mpfr_t y)
{
    const Chain *p = &s->chain[i];
    mpfr_set(y, p->c[p->degree], MPFR_RNDN);
    for (int k = p->degree - 1; k >= 0; k--) mpfr_fma(y, y, s->x, p->c[k], MPFR_RNDN);
}

/* At x + lo + delta. */
static int sign_at(Solver *s, double x, double lo, double delta)
{
    mpfr_set_d(s->x, x, MPFR_RNDN);
    mpfr_add_d(s->x, s->x, lo, MPFR_RNDN);
    mpfr_add_d(s->x, s->x, delta, MPFR_RNDN);
    value(s, 0, s->y);
    return mpfr_sgn(s->y);
}

/* sum |c_i| |x|^i */
static double terms(const double c[DEGREE + 1], double x)
{
    double size = fabs(c[DEGREE]);
    for (int i = DEGREE - 1; i >= 0; i--) size = size * fabs(x) + fabs(c[i]);
    return size;
}

/* At one of its stationary points the polynomial is so near to 0 that their number is in doubt. */
static bool nearly_touches(Solver *s, const double c[DEGREE + 1])
{
    Quad derivative[DEGREE], at[DEGREE], limit = 1;
    for (int i = 1; i <= DEGREE; i++) derivative[i - 1] = (Quad)c[i] * i;
    for (int i = 0; i < DEGREE; i++) limit = q_max(limit, 2 * DEGREE * q_abs((Quad)c[i] / c[DEGREE]));
    int n = poly_roots(derivative, DEGREE - 1, -limit, limit, at);
    for (int i = 0; i < n; i++) {
        double hi = (double)at[i], lo = (double)(at[i] - hi);
        sign_at(s, hi, lo, 0);
        if (fabs(mpfr_get_d(s->y, MPFR_RNDN)) <= 0x1p-95 * terms(c, hi)) return true;
    }
    return n < 1;
}

static double ulps_off(Solver *s, double x)
{
    mpfr_set_d(s->x, x, MPFR_RNDN);
    for (int i = 0; i < 3; i++) {
        value(s, 0, s->y);
        value(s, 1, s->slope);
        if (mpfr_zero_p(s->slope)) return 0;
        mpfr_div(s->y, s->y, s->slope, MPFR_RNDN);
        mpfr_sub(s->x, s->x, s->y, MPFR_RNDN);
    }
    double truth = fabs(mpfr_get_d(s->x, MPFR_RNDN));
    mpfr_sub_d(s->x, s->x, x, MPFR_RNDN);
    return fabs(mpfr_get_d(s->x, MPFR_RNDN)) / (nextafter(truth, INFINITY) - truth);
}

static void check_quartic(Row *row, Solver *s, const double c[DEGREE + 1], uint64_t seed)
{
    Dd dd[DEGREE + 1];
    PolyRoot root[DEGREE];
    for (int i = 0; i <= DEGREE; i++) dd[i] = (Dd){c[i], 0};
    int n = poly_quartic(dd, NULL, root, NULL, NULL);
    solver_chain(s, c);
    int expected = solver_count(s);
    if (n != expected) {
        row_trial(row, n % 2 == 0 && nearly_touches(s, c), "seed %llu: %d zeros, not %d: %a %a %a %a %a",
                  (unsigned long long)seed, n, expected, c[4], c[3], c[2], c[1], c[0]);
        return;
    }
    double before = -INFINITY;
    for (int i = 0; i < n; i++) {
        double x = root[i].x, lo = root[i].lo, err = root[i].err, next = i + 1 < n ? root[i + 1].x : INFINITY;
        bool alone = x - err > before && (i + 1 == n || x + err < next - root[i + 1].err);
        before = x + err;
        sign_at(s, x, 0, 0);
        double slack = fabs(mpfr_get_d(s->y, MPFR_RNDN)) / (UNIT_ROUNDOFF * terms(c, x));
        bool held = !alone || sign_at(s, x, lo, -err) * sign_at(s, x, lo, err) <= 0;
        if (!held || slack > 16) {
            row_trial(row, false, "seed %llu: %s, backward error %.3g u, x %a: %a %a %a %a %a", (unsigned long long)seed,
                      held ? "in bound" : "out of bound", slack, x, c[4], c[3], c[2], c[1], c[0]);
            return;
        }
        if (alone) row->t_ulps = fmax(row->t_ulps, ulps_off(s, x));
    }
    row_trial(row, true, "quartic");
}

static void expand(const double r[4], double c[5])
{
    c[4] = 1;
    c[3] = -(r[0] + r[1] + r[2] + r[3]);
    c[2] = r[0] * r[1] + (r[0] + r[1]) * (r[2] + r[3]) + r[2] * r[3];
    c[1] = -(r[0] * r[1] * (r[2] + r[3]) + r[2] * r[3] * (r[0] + r[1]));
    c[0] = r[0] * r[1] * r[2] * r[3];
}

static double random_sign(Rng *rng) { return rng_u32(rng) % 2 ? 1 : -1; }

void quartics(Row *row, uint64_t trials)
{
    Solver s;
    solver_open(&s);
    for (uint64_t seed = 0; row->trials < trials; seed++) {
        Rng rng = rng_seed(seed, 122);
        double r[4], c[5];
        for (int i = 0; i < 4; i++) r[i] = random_sign(&rng) * pow(10, 18 * rng_double(&rng) - 9);
        switch (seed % 4) {
        case 0:   /* published, the coefficients a few units in the last place off */
            expand(QUARTIC_ROOTS[seed / 4 % QUARTIC_ROOTS_COUNT], c);
            if (seed / 4 >= QUARTIC_ROOTS_COUNT)
                for (int i = 0; i < 4; i++) c[i] *= 1 + 0x1p-52 * ((double)(rng_u32(&rng) % 17) - 8);
            break;
        case 1: expand(r, c); break;
        case 2: {   /* two, three or four within 10^-k */
            double gap = pow(10, -(double)(rng_u32(&rng) % 17));
            for (int i = 0; i < 4; i++) r[i] = 2 * rng_double(&rng) - 1;
            for (uint32_t i = 1, n = 2 + rng_u32(&rng) % 3; i < n; i++) r[i] = r[0] + gap * r[i];
            expand(r, c);
            break;
        }
        default:
            for (int i = 0; i < 5; i++) c[i] = random_sign(&rng) * ldexp(1 + rng_double(&rng), (int)(rng_u32(&rng) % 41) - 20);
            break;
        }
        check_quartic(row, &s, c, seed);
    }
    solver_close(&s);
}

/* The root of a x^2 + b x + c with the greater modulus and the other one: q = -(b + sign(b) sqrt(D)) / 2, q / a, c / q.
 * Where b^2 and 4ac are near each other 400 bits hold their difference exactly. False: no real root. */
static bool true_roots(Solver *s, double a, double b, double c, mpfr_t root[2])
{
    mpfr_set_d(s->y, b, MPFR_RNDN);
    mpfr_sqr(s->y, s->y, MPFR_RNDN);
    mpfr_set_d(s->q, a, MPFR_RNDN);
    mpfr_mul_d(s->q, s->q, c, MPFR_RNDN);
    mpfr_mul_ui(s->q, s->q, 4, MPFR_RNDN);
    mpfr_sub(s->y, s->y, s->q, MPFR_RNDN);
    if (mpfr_sgn(s->y) < 0) return false;
    mpfr_sqrt(s->y, s->y, MPFR_RNDN);
    if (b < 0) mpfr_neg(s->y, s->y, MPFR_RNDN);
    mpfr_add_d(s->y, s->y, b, MPFR_RNDN);
    mpfr_div_si(s->y, s->y, -2, MPFR_RNDN);
    mpfr_div_d(root[0], s->y, a, MPFR_RNDN);
    if (mpfr_zero_p(s->y)) mpfr_set_ui(root[1], 0, MPFR_RNDN);
    else mpfr_d_div(root[1], c, s->y, MPFR_RNDN);
    if (mpfr_cmp(root[0], root[1]) > 0) mpfr_swap(root[0], root[1]);
    return true;
}

static double random_number(Rng *rng, int exponent)
{
    return random_sign(rng) * ldexp(1 + rng_double(rng), (int)(rng_u32(rng) % (uint32_t)(2 * exponent)) - exponent);
}

void quadratics(Row *row, uint64_t trials)
{
    Solver s;
    mpfr_t truth[2];
    solver_open(&s);
    mpfr_inits2(BITS, truth[0], truth[1], (mpfr_ptr)NULL);
    for (uint64_t seed = 0; row->trials < trials; seed++) {
        Rng rng = rng_seed(seed, 123);
        double a, b, c;
        if (seed % 2) {
            double gap = (double)(rng_u32(&rng) % 8) * ldexp(1, -(int)(rng_u32(&rng) % 53));
            double r = random_number(&rng, 3), q = r * (1 + gap);
            int k = (int)(rng_u32(&rng) % 900) - 450;
            a = random_number(&rng, 3);
            b = ldexp(-a * (r + q), k);
            c = ldexp(a * r * q, 2 * k);
        } else {
            int exponent = seed % 6 == 0 ? 4 : seed % 6 == 2 ? 60 : 1000;
            a = random_number(&rng, exponent);
            b = seed % 50 == 0 ? 0 : random_number(&rng, exponent);
            c = seed % 50 == 2 ? 0 : random_number(&rng, exponent);
        }
        PolyRoot root[2];
        Dd poly[3] = {{c, 0}, {b, 0}, {a, 0}};
        int n = poly_quadratic(poly, NULL, root), expected = 2 * true_roots(&s, a, b, c, truth);
        double worst = 0;
        bool held = n == expected;
        for (int i = 0; held && i < n; i++) {
            double near = mpfr_get_d(truth[i], MPFR_RNDN), size = fabs(near);
            if (isinf(near)) {
                held = isinf(root[i].x);
                continue;
            }
            mpfr_sub_d(s.y, truth[i], root[i].x, MPFR_RNDN);
            mpfr_sub_d(s.q, s.y, root[i].lo, MPFR_RNDN);
            mpfr_abs(s.q, s.q, MPFR_RNDN);
            held = mpfr_cmp_d(s.q, root[i].err) <= 0;
            mpfr_abs(s.y, s.y, MPFR_RNDN);
            mpfr_div_d(s.y, s.y, size == DBL_MAX ? 0x1p971 : nextafter(size, INFINITY) - size, MPFR_RNDN);
            worst = fmax(worst, fabs(mpfr_get_d(s.y, MPFR_RNDN)));
        }
        row->t_ulps = fmax(row->t_ulps, worst);
        row_trial(row, held && worst <= 2, "seed %llu: %d roots, not %d, %.3g ulps: %a %a %a", (unsigned long long)seed, n,
                  expected, worst, a, b, c);
    }
    mpfr_clears(truth[0], truth[1], (mpfr_ptr)NULL);
    solver_close(&s);
}
