/* The solvers of quadratics and quartics against MPFR: the oracle finds the zeros of the polynomial with exactly the
 * given coefficients, by bisection between the zeros of its derivatives. */
#include "tools/polyroots.h"

#include <float.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>
#include <mpfr.h>

#include "common/numeric.h"
#include "common/rng.h"
#include "support/quartic_roots.h"

enum { BITS = 400, BISECTIONS = 300, QUADRATIC_BITS = 8400 };  /* b^2 and 4 a c may be 2^8000 apart */

typedef struct { mpfr_t c[5]; int degree; } Poly;

static void poly_open(Poly *p, int degree)
{
    p->degree = degree;
    for (int i = 0; i < 5; i++) mpfr_init2(p->c[i], BITS);
}

static void poly_close(Poly *p)
{
    for (int i = 0; i < 5; i++) mpfr_clear(p->c[i]);
}

static int poly_sign(const Poly *p, mpfr_t x)
{
    mpfr_t y;
    mpfr_init2(y, 2 * BITS);
    mpfr_set(y, p->c[p->degree], MPFR_RNDN);
    for (int i = p->degree - 1; i >= 0; i--) {
        mpfr_mul(y, y, x, MPFR_RNDN);
        mpfr_add(y, y, p->c[i], MPFR_RNDN);
    }
    int sign = mpfr_sgn(y);
    mpfr_clear(y);
    return sign;
}

/* The places in (-2^e, 2^e) where the sign changes, 0 counting as the leading coefficient's sign. */
static int poly_zeros(const Poly *p, long e, mpfr_t *zero)
{
    if (p->degree == 0) return 0;
    Poly derivative;
    poly_open(&derivative, p->degree - 1);
    for (int i = 1; i <= p->degree; i++) mpfr_mul_si(derivative.c[i - 1], p->c[i], i, MPFR_RNDN);
    mpfr_t stop[5], a, b, m;
    for (int i = 0; i < 5; i++) mpfr_init2(stop[i], BITS);
    mpfr_inits2(BITS, a, b, m, (mpfr_ptr)NULL);
    mpfr_set_si_2exp(stop[0], -1, e, MPFR_RNDN);
    int stops = poly_zeros(&derivative, e, stop + 1) + 1, n = 0;
    mpfr_set_si_2exp(stop[stops], 1, e, MPFR_RNDN);
    int lead = mpfr_sgn(p->c[p->degree]);
    for (int i = 0; i < stops; i++) {
        mpfr_set(a, stop[i], MPFR_RNDN);
        mpfr_set(b, stop[i + 1], MPFR_RNDN);
        int sa = poly_sign(p, a), sb = poly_sign(p, b);
        if ((sa ? sa : lead) == (sb ? sb : lead)) continue;
        for (int k = 0; k < BISECTIONS; k++) {
            mpfr_add(m, a, b, MPFR_RNDN);
            mpfr_div_2ui(m, m, 1, MPFR_RNDN);
            int sm = poly_sign(p, m);
            if ((sm ? sm : lead) == (sa ? sa : lead)) mpfr_set(a, m, MPFR_RNDN);
            else mpfr_set(b, m, MPFR_RNDN);
        }
        mpfr_set(zero[n++], b, MPFR_RNDN);
    }
    for (int i = 0; i < 5; i++) mpfr_clear(stop[i]);
    mpfr_clears(a, b, m, (mpfr_ptr)NULL);
    poly_close(&derivative);
    return n;
}

static double distance(mpfr_t truth, const PolyRoot *root)
{
    mpfr_t d;
    mpfr_init2(d, BITS);
    mpfr_sub_d(d, truth, root->x, MPFR_RNDN);
    mpfr_sub_d(d, d, root->lo, MPFR_RNDN);
    double off = fabs(mpfr_get_d(d, MPFR_RNDN));
    mpfr_clear(d);
    return off;
}

/* In units of the last place of the true value; below DBL_MIN of the least subnormal. */
static double ulps_off(mpfr_t truth, double x)
{
    double t = fabs(mpfr_get_d(truth, MPFR_RNDZ));
    mpfr_t d;
    mpfr_init2(d, BITS);
    mpfr_sub_d(d, truth, x, MPFR_RNDN);
    mpfr_div_d(d, d, nextafter(t, INFINITY) - t, MPFR_RNDN);
    double off = fabs(mpfr_get_d(d, MPFR_RNDN));
    mpfr_clear(d);
    return off;
}

/* -- quadratics -- */

/* The exact roots: 1 if the discriminant is at least 0. */
static int true_quadratic(double a, double b, double c, mpfr_t root[2])
{
    mpfr_t d, t, ma;
    mpfr_inits2(QUADRATIC_BITS, d, t, ma, (mpfr_ptr)NULL);
    mpfr_set_d(d, b, MPFR_RNDN);
    mpfr_sqr(d, d, MPFR_RNDN);
    mpfr_set_d(t, a, MPFR_RNDN);
    mpfr_mul_d(t, t, c, MPFR_RNDN);
    mpfr_mul_si(t, t, 4, MPFR_RNDN);
    mpfr_sub(d, d, t, MPFR_RNDN);
    int real = mpfr_sgn(d) >= 0;
    if (real) {
        mpfr_sqrt(d, d, MPFR_RNDN);
        mpfr_set_d(ma, a, MPFR_RNDN);
        mpfr_mul_si(ma, ma, 2, MPFR_RNDN);
        for (int i = 0; i < 2; i++) {
            mpfr_set_d(t, -b, MPFR_RNDN);
            if ((i == 0) == (a > 0)) mpfr_sub(t, t, d, MPFR_RNDN);
            else mpfr_add(t, t, d, MPFR_RNDN);
            mpfr_div(root[i], t, ma, MPFR_RNDN);
        }
    }
    mpfr_clears(d, t, ma, (mpfr_ptr)NULL);
    return real;
}

static int quadratic(double a, double b, double c, PolyRoot root[2])
{
    return poly_quadratic((const Dd[3]){{c, 0}, {b, 0}, {a, 0}}, NULL, root);
}

static void check_quadratic(double a, double b, double c, double *worst)
{
    mpfr_t truth[2];
    mpfr_inits2(QUADRATIC_BITS, truth[0], truth[1], (mpfr_ptr)NULL);
    PolyRoot root[2];
    int n = quadratic(a, b, c, root), expected = 2 * true_quadratic(a, b, c, truth);
    if (n != expected) print_error("a %a b %a c %a: %d roots, not %d\n", a, b, c, n, expected);
    assert_int_equal(n, expected);
    for (int i = 0; i < n; i++) {
        if (fabs(mpfr_get_d(truth[i], MPFR_RNDN)) == INFINITY) {
            assert_true(isinf(root[i].x));
            continue;
        }
        double off = ulps_off(truth[i], root[i].x);
        bool bound = distance(truth[i], &root[i]) <= root[i].err;
        if (off > 2 || !bound)
            print_error("a %a b %a c %a: root %d is %g, %g ulps off, bound %g\n", a, b, c, i, root[i].x, off,
                        root[i].err);
        assert_true(off <= 2 && bound);
        *worst = fmax(*worst, off);
    }
    mpfr_clears(truth[0], truth[1], (mpfr_ptr)NULL);
}

static double random_number(Rng *rng, int exponent)
{
    double x = ldexp(1 + rng_double(rng), (int)(rng_u32(rng) % (uint32_t)(2 * exponent)) - exponent);
    return rng_u32(rng) % 2 ? x : -x;
}

static void test_quadratic_random(void **state)
{
    (void)state;
    double worst = 0;
    for (uint64_t seed = 0; seed < 30000; seed++) {
        Rng rng = rng_seed(seed, 1);
        int exponent = seed % 3 == 0 ? 4 : seed % 3 == 1 ? 60 : 1000;
        double a = random_number(&rng, exponent), b = random_number(&rng, exponent), c = random_number(&rng, exponent);
        if (seed % 50 == 0) b = 0;
        if (seed % 50 == 1) c = 0;
        check_quadratic(a, b, c, &worst);
    }
    print_message("worst %.2f ulps\n", worst);
}

/* b^2 = 4 a c but for a few units in the last place of any coefficient, at every magnitude. */
static void test_quadratic_nearly_double(void **state)
{
    (void)state;
    double worst = 0;
    for (uint64_t seed = 0; seed < 20000; seed++) {
        Rng rng = rng_seed(seed, 2);
        double gap = (double)(rng_u32(&rng) % 8) * ldexp(1, -(int)(rng_u32(&rng) % 53));
        double r = random_number(&rng, 3), s = r * (1 + gap);
        double a = random_number(&rng, 3), b = -a * (r + s), c = a * r * s;
        int k = (int)(rng_u32(&rng) % 900) - 450;
        check_quadratic(a, ldexp(b, k), ldexp(c, 2 * k), &worst);
    }
    check_quadratic(1, -2, 1, &worst);
    check_quadratic(1, -2 * (1 + 0x1p-52), 1 + 0x1p-51, &worst);
    check_quadratic(94906265.625, -2 * 94906267.000, 94906268.375, &worst);   /* Kahan 2004, On the cost of ... */
    check_quadratic(94906266.375, -2 * 94906267.375, 94906268.375, &worst);
    check_quadratic(1e200, 1e300, 1e200, &worst);
    check_quadratic(1e-200, -1e-300, -1e-300, &worst);
    check_quadratic(DBL_MAX, DBL_MAX, -DBL_MAX, &worst);
    check_quadratic(5e-324, -5e-324, 0, &worst);
    check_quadratic(5e-324, 1, 5e-324, &worst);
    print_message("worst %.2f ulps\n", worst);
}

static void test_quadratic_degenerate(void **state)
{
    (void)state;
    PolyRoot root[2];
    assert_int_equal(quadratic(0, 0, 1, root), 0);
    assert_int_equal(quadratic(0, 2, -1, root), 1);
    assert_true(root[0].x == 0.5);
    assert_int_equal(quadratic(0, 2, 0, root), 1);
    assert_true(root[0].x == 0);
    assert_int_equal(quadratic(1, 0, 0, root), 2);
    assert_true(root[0].x == 0 && root[1].x == 0);
    assert_int_equal(quadratic(1, 2, 1, root), 2);
    assert_true(root[0].x == -1 && root[1].x == -1);
    assert_int_equal(quadratic(1, 0, 1, root), 0);
}

/* -- quartics -- */

typedef struct { double worst_ulps; int solved, skipped; } Tally;

/* The value that the polynomial would have to reach between two zeros for their number to be in doubt. */
static bool nearly_touches(const Poly *p, long e, const double *c, double noise)
{
    Poly derivative;
    poly_open(&derivative, 3);
    for (int i = 1; i <= 4; i++) mpfr_mul_si(derivative.c[i - 1], p->c[i], i, MPFR_RNDN);
    mpfr_t stop[4], y;
    for (int i = 0; i < 4; i++) mpfr_init2(stop[i], BITS);
    mpfr_init2(y, 2 * BITS);
    int n = poly_zeros(&derivative, e, stop);
    bool touches = false;
    for (int i = 0; i < n; i++) {
        double x = fabs(mpfr_get_d(stop[i], MPFR_RNDN)), size = 0;
        mpfr_set(y, p->c[4], MPFR_RNDN);
        for (int k = 3; k >= 0; k--) {
            mpfr_mul(y, y, stop[i], MPFR_RNDN);
            mpfr_add(y, y, p->c[k], MPFR_RNDN);
        }
        for (int k = 4; k >= 0; k--) size = size * x + fabs(c[k]);
        touches = touches || fabs(mpfr_get_d(y, MPFR_RNDN)) <= 0x1p-95 * size + noise;
    }
    for (int i = 0; i < 4; i++) mpfr_clear(stop[i]);
    mpfr_clear(y);
    poly_close(&derivative);
    return touches;
}

/* |p(x)| is at most 16 u sum |c_i| |x|^i, that is, x is a zero of a polynomial with coefficients 16 u away. */
static bool backward_small(const double *c, double x)
{
    mpfr_t y;
    mpfr_init2(y, BITS);
    mpfr_set_d(y, c[4], MPFR_RNDN);
    double size = fabs(c[4]);
    for (int i = 3; i >= 0; i--) {
        mpfr_mul_d(y, y, x, MPFR_RNDN);
        mpfr_add_d(y, y, c[i], MPFR_RNDN);
        size = size * fabs(x) + fabs(c[i]);
    }
    double residual = fabs(mpfr_get_d(y, MPFR_RNDN));
    mpfr_clear(y);
    return residual <= 16 * UNIT_ROUNDOFF * size;
}

/* e: all zeros lie within 2^e. */
static void check_quartic(const double c[5], long e, const char *what, uint64_t seed, Tally *tally)
{
    Poly p;
    poly_open(&p, 4);
    mpfr_t truth[4];
    for (int i = 0; i < 4; i++) mpfr_init2(truth[i], BITS);
    Dd dd[5];
    for (int i = 0; i < 5; i++) {
        mpfr_set_d(p.c[i], c[i], MPFR_RNDN);
        dd[i] = (Dd){c[i], 0};
    }
    PolyRoot root[4];
    int n = poly_quartic(dd, NULL, root, NULL, NULL), expected = poly_zeros(&p, e, truth);
    bool ok = n % 2 == 0;
    if (n != expected && nearly_touches(&p, e, c, 0)) {
        tally->skipped++;
    } else {
        ok = ok && n == expected;
        for (int i = 0; ok && i < n; i++) {
            ok = distance(truth[i], &root[i]) <= root[i].err && backward_small(c, root[i].x);
            tally->worst_ulps = fmax(tally->worst_ulps, ulps_off(truth[i], root[i].x));
        }
        tally->solved++;
    }
    if (!ok) {
        print_error("%s, seed %llu: %a %a %a %a %a: %d zeros, not %d\n", what, (unsigned long long)seed, c[4], c[3],
                    c[2], c[1], c[0], n, expected);
        for (int i = 0; i < n; i++)
            print_error("  %.17g err %g, off %g\n", root[i].x, root[i].err,
                        i < expected ? distance(truth[i], &root[i]) : NAN);
    }
    for (int i = 0; i < 4; i++) mpfr_clear(truth[i]);
    poly_close(&p);
    assert_true(ok);
}

static void expand(const double r[4], double c[5])
{
    c[4] = 1;
    c[3] = -(r[0] + r[1] + r[2] + r[3]);
    c[2] = r[0] * r[1] + (r[0] + r[1]) * (r[2] + r[3]) + r[2] * r[3];
    c[1] = -(r[0] * r[1] * (r[2] + r[3]) + r[2] * r[3] * (r[0] + r[1]));
    c[0] = r[0] * r[1] * r[2] * r[3];
}

static void test_quartic_random(void **state)
{
    (void)state;
    Tally tally = {0};
    for (uint64_t seed = 0; seed < 500; seed++) {
        Rng rng = rng_seed(seed, 3);
        double c[5];
        for (int i = 0; i < 5; i++) c[i] = random_number(&rng, seed % 2 ? 2 : 20);
        c[4] = seed % 2 ? c[4] : random_number(&rng, 2);
        check_quartic(c, 24, "random coefficients", seed, &tally);
    }
    print_message("%d solved, %d in doubt, worst %.2f ulps\n", tally.solved, tally.skipped, tally.worst_ulps);
    assert_int_equal(tally.skipped, 0);
}

/* Roots drawn, two, three or four of them within 10^-k. */
static void test_quartic_clustered(void **state)
{
    (void)state;
    Tally tally = {0};
    for (uint64_t seed = 0; seed < 600; seed++) {
        Rng rng = rng_seed(seed, 4);
        double r[4], c[5], gap = pow(10, -(double)(seed % 17));
        for (int i = 0; i < 4; i++) r[i] = 2 * rng_double(&rng) - 1;
        for (uint64_t i = 1; i < 2 + seed / 17 % 3; i++) r[i] = r[0] + gap * r[i];
        expand(r, c);
        check_quartic(c, 4, "clustered roots", seed, &tally);
    }
    print_message("%d solved, %d in doubt, worst %.2f ulps\n", tally.solved, tally.skipped, tally.worst_ulps);
    assert_true(tally.skipped < 60);
}

static void test_quartic_spread(void **state)
{
    (void)state;
    Tally tally = {0};
    for (uint64_t seed = 0; seed < 300; seed++) {
        Rng rng = rng_seed(seed, 5);
        double r[4], c[5];
        for (int i = 0; i < 4; i++) r[i] = (rng_u32(&rng) % 2 ? 1 : -1) * pow(10, 18 * rng_double(&rng) - 9);
        expand(r, c);
        check_quartic(c, 36, "spread roots", seed, &tally);
    }
    print_message("%d solved, %d in doubt, worst %.2f ulps\n", tally.solved, tally.skipped, tally.worst_ulps);
    assert_true(tally.skipped < 10);
}

static void test_quartic_published(void **state)
{
    (void)state;
    Tally tally = {0};
    for (size_t i = 0; i < QUARTIC_ROOTS_COUNT; i++) {
        double c[5], greatest = 1;
        expand(QUARTIC_ROOTS[i], c);
        for (int k = 0; k < 4; k++) greatest = fmax(greatest, fabs(QUARTIC_ROOTS[i][k]));
        check_quartic(c, ilogb(greatest) + 3, "published roots", i, &tally);
    }
    /* no real root; two; a biquadratic; a huge and a tiny constant */
    static const double SETS[][5] = {
        {1, 0, 0, 0, 1}, {-1, 0, 0, 0, 1}, {4, 0, -5, 0, 1}, {-1e-30, 0, 0, 0, 1}, {-1e30, 0, 0, 0, 1},
        {1e-20, 1, 1, 1, 1}, {-1, 1e10, -1e10, 1, 1},
    };
    for (size_t i = 0; i < sizeof SETS / sizeof SETS[0]; i++) check_quartic(SETS[i], 40, "set", i, &tally);
    print_message("%d solved, %d in doubt, worst %.2f ulps\n", tally.solved, tally.skipped, tally.worst_ulps);
    assert_int_equal(tally.skipped, 0);
}

/* x^4 and (x^2 - 1)^2 touch 0 without crossing it; their derivative's roots are known. */
static void test_quartic_touching(void **state)
{
    (void)state;
    Dd power[5] = {{0, 0}, {0, 0}, {0, 0}, {0, 0}, {1, 0}}, twice[5] = {{1, 0}, {0, 0}, {-2, 0}, {0, 0}, {1, 0}};
    PolyRoot root[4];
    double critical[3];
    int n;
    assert_int_equal(poly_quartic(power, NULL, root, NULL, NULL), 0);
    assert_int_equal(poly_quartic(twice, NULL, root, critical, &n), 0);
    assert_int_equal(n, 3);
    assert_true(critical[0] == -1 && critical[1] == 0 && critical[2] == 1);
}

/* The guess answers only for what the certain way confirms. */
static void test_quartic_guess(void **state)
{
    (void)state;
    int sure = 0;
    for (uint64_t seed = 0; seed < 20000; seed++) {
        Rng rng = rng_seed(seed, 6);
        double c[4], guess[4];
        for (int i = 0; i < 4; i++) c[i] = 4 * rng_double(&rng) - 2;
        int n, m;
        double critical[3];
        if (!poly_quartic_guess(c, guess, &n)) continue;
        Dd dd[5] = {{c[0], 0}, {c[1], 0}, {c[2], 0}, {c[3], 0}, {1, 0}};
        PolyRoot root[4];
        assert_int_equal(poly_quartic(dd, NULL, root, critical, &m), n);
        for (int i = 0; i < n; i++) assert_true(fabs(root[i].x - guess[i]) < 1e-6);
        sure++;
    }
    assert_true(sure > 19000);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_quadratic_random),    cmocka_unit_test(test_quadratic_nearly_double),
        cmocka_unit_test(test_quadratic_degenerate), cmocka_unit_test(test_quartic_random),
        cmocka_unit_test(test_quartic_clustered),   cmocka_unit_test(test_quartic_spread),
        cmocka_unit_test(test_quartic_published),   cmocka_unit_test(test_quartic_touching),
        cmocka_unit_test(test_quartic_guess),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
