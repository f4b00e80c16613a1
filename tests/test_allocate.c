/* Who gets samples: spreads, equal gain, and that two replicates which decide on each other stay unbiased. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

#include "common/rng.h"
#include "render/allocate.h"

static TileView *flat_view(float samples)
{
    TileView *view = calloc(1, sizeof *view);
    assert_non_null(view);
    for (int i = 0; i < VIEW_PIXELS; i++) view->samples[i] = samples;
    return view;
}

static int view_at(int x, int y) { return (y + 1) * VIEW_SIDE + x + 1; }

static void one_colour_spreads_nothing(void **state)
{
    (void)state;
    TileView *view = flat_view(2);
    float spread[TILE_PIXELS];
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < VIEW_PIXELS; i++) view->mean[k][i] = 0.1f * (float)(k + 1);
    spread_of_tile(view, spread);
    for (int i = 0; i < TILE_PIXELS; i++) assert_true(spread[i] == 0);
    free(view);
}

/* A pixel of another colour, one of them beyond the tile's edge: the nine around it get the floor, no others. */
static void an_edge_reaches_one_pixel(void **state)
{
    (void)state;
    const int places[3][2] = {{5, 7}, {0, 0}, {-1, 16}};
    for (int p = 0; p < 3; p++)
        for (int n = 1; n <= 64; n *= 4) {
            TileView *view = flat_view((float)n);
            float spread[TILE_PIXELS];
            view->mean[1][view_at(places[p][0], places[p][1])] = 0.5f;
            spread_of_tile(view, spread);
            for (int y = 0; y < TILE; y++)
                for (int x = 0; x < TILE; x++) {
                    bool near = abs(x - places[p][0]) <= 1 && abs(y - places[p][1]) <= 1;
                    double floor = near ? 0.25 / 3 * 2 / ((n + 3) * (n + 3)) : 0;
                    assert_true(fabs((double)spread[y * TILE + x] - floor) <= 1e-6 * floor);
                }
            free(view);
        }
}

/* (n - 1) parts of the pixel's own variance, one of the mean around it. */
static void variance_is_shared_with_neighbours(void **state)
{
    (void)state;
    TileView *view = flat_view(4);
    float spread[TILE_PIXELS];
    view->variance[view_at(3, 3)] = 0.9f;
    spread_of_tile(view, spread);
    assert_true(fabs((double)spread[3 * TILE + 3] - (3 * 0.9 + 0.1) / 4) < 1e-6);
    assert_true(fabs((double)spread[4 * TILE + 2] - 0.1 / 4) < 1e-6);
    assert_true(spread[5 * TILE + 3] == 0);
    free(view);
}

static int bin_of(double spread) { return error_code(spread) >> SPREAD_SHIFT; }

/* Half of the pixels spread by 1, the others by 2^-10, all with two samples; the sum is to fall to 1/50. All then gain
 * about as much by a sample more, and the sum is what was asked for. */
static void gains_become_equal(void **state)
{
    (void)state;
    SpreadTable *table = calloc(1, sizeof *table);
    Allocation *plan = malloc(sizeof *plan);
    const double spreads[2] = {1, 0x1p-10};
    int level[2] = {1, 1};
    double now = 0;
    for (int i = 0; i < 2; i++) now += 1000 * predicted_variance(spreads[i], 1);
    double sum = now, goal = now / 50;
    for (int round = 0; round < 10 && sum > goal; round++) {
        *table = (SpreadTable){.count = {{0}}};
        for (int i = 0; i < 2; i++) table->count[level[i]][bin_of(spreads[i])] += 1000;
        allocate_for_error(table, sum, goal, plan);
        uint64_t samples = 0;
        sum = 0;
        for (int i = 0; i < 2; i++) {
            int to = plan->level[level[i]][bin_of(spreads[i])];
            assert_in_range(to, level[i], level[i] + GROWTH);
            samples += 1000 * ((1u << to) - (1u << level[i]));
            level[i] = to;
            sum += 1000 * predicted_variance(spreads[i], to);
        }
        assert_true(samples > 0 && plan->samples == samples);
    }
    /* A step of a level is a factor of 2^1.5 in variance. */
    assert_true(sum <= 1.1 * goal && sum > goal / 4);
    /* Equal gains: 2^10 = (2^level)^2.5, so four levels apart, to one level. */
    assert_in_range(level[0] - level[1], 3, 5);
    free(table);
    free(plan);
}

static void no_more_than_what_is_affordable(void **state)
{
    (void)state;
    SpreadTable *table = calloc(1, sizeof *table);
    Allocation *plan = malloc(sizeof *plan);
    for (int i = 0; i < 12; i++) table->count[1][bin_of(ldexp(1, -i))] = 100;
    table->count[1][0] = 100000;  /* flat */
    for (uint64_t samples = 100; samples < 100000; samples = samples * 3 / 2) {
        allocate_samples(table, samples, plan);
        assert_true(plan->samples <= samples);
        assert_int_equal(plan->level[1][0], 1);
    }
    allocate_samples(table, 2000, plan);
    assert_true(plan->samples > 500);
    allocate_evenly(table, plan);
    assert_int_equal(plan->samples, 2 * (100000 + 1200));
    free(table);
    free(plan);
}

/* ---- an edge pixel of which 2 % are covered ---- */

enum { TRIALS = 40000, COVERED = 2, FIRST = 8, MORE = 64 };

/* A replicate's samples are drawn in its own order, however many are asked for. */
static double covered(Rng *rng, int samples)
{
    int hits = 0;
    for (int i = 0; i < samples; i++) hits += rng_double(rng) < COVERED / 100.0;
    return hits;
}

/* A replicate that goes on only if its own first samples differ keeps about the value 0 of those that agree by chance; if
 * the other's differ, its mean is right. Five standard errors are granted. */
static void cross_fitting_is_unbiased(void **state)
{
    (void)state;
    double naive = 0, crossed = 0, squares = 0;
    for (uint64_t t = 0; t < TRIALS; t++) {
        double sum[2], more[2], mean[2];
        for (uint64_t r = 0; r < 2; r++) {
            Rng rng = rng_seed(7, 2 * t + r);
            sum[r] = covered(&rng, FIRST);
            more[r] = sum[r] + covered(&rng, MORE - FIRST);
        }
        for (int r = 0; r < 2; r++) {
            mean[r] = sum[1 - r] > 0 ? more[r] / MORE : sum[r] / FIRST;
            naive += (sum[r] > 0 ? more[r] / MORE : sum[r] / FIRST) / 2;
        }
        double y = (mean[0] + mean[1]) / 2;
        crossed += y;
        squares += y * y;
    }
    double truth = COVERED / 100.0, mean = crossed / TRIALS;
    double deviation = sqrt((squares / TRIALS - mean * mean) / TRIALS);
    assert_true(fabs(mean - truth) < 5 * deviation);
    assert_true(deviation < 0.02 * truth);
    assert_true(naive / TRIALS < 0.6 * truth);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_colour_spreads_nothing),
        cmocka_unit_test(an_edge_reaches_one_pixel),
        cmocka_unit_test(variance_is_shared_with_neighbours),
        cmocka_unit_test(gains_become_equal),
        cmocka_unit_test(no_more_than_what_is_affordable),
        cmocka_unit_test(cross_fitting_is_unbiased),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
