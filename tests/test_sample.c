/* Each replicate is a (0,2)-sequence in base 2, unbiased, and independent of the other. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>
#include <math.h>
#include <string.h>

#include "render/sample.h"

/* The first 2^k samples: one in each elementary interval of area 2^-k, whatever its shape. */
static void elementary_intervals(void **state)
{
    (void)state;
    for (uint32_t seed = 0; seed < 100; seed++)
        for (int k = 0; k <= 9; k++)
            for (int a = 0; a <= k; a++) {
                char seen[512] = {0};
                for (uint32_t i = 0; i < (1u << k); i++) {
                    Sample2 s = sample_place(sample_key(seed, 3, seed * 7, seed % 2), i);
                    assert_true(s.x >= 0 && s.x < 1 && s.y >= 0 && s.y < 1);
                    int cell = (int)ldexp(s.x, a) << (k - a) | (int)ldexp(s.y, k - a);
                    assert_int_equal(seen[cell], 0);
                    seen[cell] = 1;
                }
            }
}

/* Mean 1/2, variance 1/12, no correlation between replicates, dimensions or neighbours; four standard errors. */
static void moments(void **state)
{
    (void)state;
    enum { N = 200000 };
    double mean = 0, square = 0, replicates = 0, dimensions = 0, neighbours = 0;
    for (uint32_t p = 0; p < N; p++) {
        Sample2 a = sample_place(sample_key(1, p % 512, p / 512, 0), 0);
        Sample2 b = sample_place(sample_key(1, p % 512, p / 512, 1), 0);
        Sample2 c = sample_place(sample_key(1, p % 512 + 1, p / 512, 0), 0);
        mean += a.x - 0.5;
        square += (a.x - 0.5) * (a.x - 0.5);
        replicates += (a.x - 0.5) * (b.x - 0.5);
        dimensions += (a.x - 0.5) * (a.y - 0.5);
        neighbours += (a.y - 0.5) * (c.y - 0.5);
    }
    assert_true(fabs(mean / N) < 4 * sqrt(1.0 / 12 / N));
    assert_true(fabs(square / N - 1.0 / 12) < 4 * sqrt(1.0 / 180 / N));
    assert_true(fabs(replicates / N) < 4.0 / 12 / sqrt(N));
    assert_true(fabs(dimensions / N) < 4.0 / 12 / sqrt(N));
    assert_true(fabs(neighbours / N) < 4.0 / 12 / sqrt(N));
}

static void shares(void **state)
{
    (void)state;
    assert_int_equal(sample_share_a(9), 5);
    assert_int_equal(sample_share_a(8), 4);
    assert_int_equal(sample_share_a(1), 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(elementary_intervals),
        cmocka_unit_test(moments),
        cmocka_unit_test(shares),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
