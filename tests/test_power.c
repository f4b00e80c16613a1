/* Powers of cosines against the C library's long double ones. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

#include "common/power.h"
#include "common/rng.h"

/* In units of the float next to it. */
static double error_in_ulps(double x, double exponent)
{
    long double truth = powl((long double)x, (long double)exponent);
    float got = (float)power_of(x, exponent), at = (float)truth;
    double ulp = (double)(nextafterf(at, INFINITY) - at);
    return fabs((double)((long double)got - truth)) / ulp;
}

static void within_a_float(void **state)
{
    (void)state;
    static const double exponents[] = {0.01, 0.5, 1, 2, 10, 20, 25, 100, 1000, 12345.678, 1e6};
    Rng rng = rng_seed(1, 0);
    double worst = 0;
    for (size_t k = 0; k < sizeof exponents / sizeof *exponents; k++)
        for (int i = 0; i < 100000; i++) {
            double x = (double)(float)rng_double(&rng);
            if (i % 2) x = 1 - x * exp2(-24 * rng_double(&rng));
            x = (double)(float)x;
            if (!(x > 0)) continue;
            worst = fmax(worst, error_in_ulps(x, exponents[k]));
        }
    printf("worst error of a power as a float: %.4f units in the last place\n", worst);
    assert_true(worst <= 0.501);
}

static void ends(void **state)
{
    (void)state;
    assert_true(power_of(1, 0) == 1 && power_of(1, 1e38) == 1 && power_of(0x1p-126, 0) == 1);
    assert_true(power_of(0.5, 1) == 0.5 && power_of(0.25, 0.5) == 0.5 && power_of(0x1p-126, 1) == 0x1p-126);
    assert_true((float)power_of(0.9, 1e38) == 0 && (float)power_of(0x1p-126, 100) == 0);
    float below = nextafterf(1, 0);
    assert_true(fabs(power_of((double)below, 1e6) - exp(1e6 * log((double)below))) < 1e-10);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(within_a_float), cmocka_unit_test(ends)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
