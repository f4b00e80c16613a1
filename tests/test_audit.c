/* The audit: draws have the probabilities that they claim, its mean is unbiased whatever the replicates say, and its
 * interval holds what it should. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

#include "common/rng.h"
#include "render/audit.h"
#include "render/sample.h"

enum { WIDTH = 75, HEIGHT = 50, PIXELS = WIDTH * HEIGHT };

/* A map in which a fifth of the pixels have an error, in stripes; what tells the truth in `true_square` differs. */
static void make_map(ErrorMap *map, Rng *rng, double known)
{
    assert_true(error_map_create(map, WIDTH, HEIGHT, NULL));
    for (uint32_t tile = 0; tile < map->tiles.count; tile++) {
        TileRect r = tile_rect(&map->tiles, tile);
        for (uint32_t y = r.y0; y < r.y1; y++)
            for (uint32_t x = r.x0; x < r.x1; x++) {
                double e = (x + y) % 20 < 4 && rng_double(rng) < known ? 0.01 * rng_double(rng) : 0;
                error_map_put(map, x, y, e);
                map->tile[tile].sum += e;
            }
    }
}

/* Weights times probabilities are 1: the mean weight is, and so is that of each half of the picture for its part. */
static void draws_have_their_probabilities(void **state)
{
    (void)state;
    enum { DRAWS = 1024, LOOKS = 200 };
    ErrorMap map;
    Rng rng = rng_seed(1, 0);
    make_map(&map, &rng, 0.7);
    AuditDraw *draw = malloc(DRAWS * sizeof *draw);
    double all = 0, squares = 0, left = 0, flat = 0;
    for (uint32_t look = 0; look < LOOKS; look++) {
        audit_pick(&map, 5, look, draw, DRAWS);
        double sum = 0;
        for (int i = 0; i < DRAWS; i++) {
            assert_true(draw[i].x < WIDTH && draw[i].y < HEIGHT);
            assert_true(draw[i].weight > 0 && draw[i].weight < 4.0001);
            sum += draw[i].weight / DRAWS;
            if (draw[i].x < 20) left += draw[i].weight / DRAWS;
            if ((draw[i].x + draw[i].y) % 20 >= 4) flat += draw[i].weight / DRAWS;
        }
        all += sum;
        squares += sum * sum;
    }
    double mean = all / LOOKS, deviation = sqrt((squares / LOOKS - mean * mean) / LOOKS);
    assert_true(fabs(mean - 1) < 5 * deviation && deviation < 0.01);
    assert_true(fabs(left / LOOKS - 20.0 / WIDTH) < 0.01);
    assert_true(fabs(flat / LOOKS - 0.8) < 0.02);
    free(draw);
    error_map_destroy(&map);
}

/* A normal number by the sum of twelve. */
static double normal(Rng *rng)
{
    double sum = -6;
    for (int i = 0; i < 12; i++) sum += rng_double(rng);
    return sum;
}

/* Pictures with known errors: `bias` for all pixels of the stripes, beside noise; the map knows only `known` of the stripes'
 * pixels. Returns how many of `trials` intervals hold the true RMSE; *ratio gets the mean of estimated to true square. */
static int coverage(double bias, double noise, double known, int trials, double *ratio)
{
    enum { DRAWS = 1024 };
    AuditDraw *draw = malloc(DRAWS * sizeof *draw);
    double (*error)[3] = malloc(PIXELS * sizeof *error);
    int holds = 0;
    *ratio = 0;
    for (int t = 0; t < trials; t++) {
        ErrorMap map;
        Rng rng = rng_seed(3, (uint64_t)t);
        make_map(&map, &rng, known);
        double truth = 0;
        for (int i = 0; i < PIXELS; i++)
            for (int k = 0; k < 3; k++) {
                bool stripe = (i % WIDTH + i / WIDTH) % 20 < 4;
                error[i][k] = stripe ? bias + noise * normal(&rng) : 0;
                truth += error[i][k] * error[i][k] / (3.0 * PIXELS);
            }
        audit_pick(&map, (uint64_t)t, 0, draw, DRAWS);
        for (int i = 0; i < DRAWS; i++) {
            AuditDraw *d = &draw[i];
            const double *e = error[d->y * WIDTH + d->x];
            d->samples = 4;
            d->picture_samples = 8;
            for (int k = 0; k < 3; k++) {
                d->picture[k] = 0.5 + e[k];
                for (int j = 0; j < 2; j++) d->fresh[j][k] = 4 * (0.5 + (e[k] != 0 ? 1.4 * noise * normal(&rng) : 0));
            }
        }
        MeanSquare square = audit_mean_square(draw, DRAWS);
        Estimate e = root_estimate(square, 0.05);
        *ratio += square.mean / truth / trials;
        holds += e.low <= sqrt(truth) && sqrt(truth) <= e.high;
        error_map_destroy(&map);
    }
    free(draw);
    free(error);
    return holds;
}

/* Of 400 intervals of 95 %, 4.4 more or less are a standard deviation; four of them are granted. */
static void intervals_hold_the_truth(void **state)
{
    (void)state;
    const struct { double bias, noise, known; } cases[] = {{0, 0.05, 1}, {0.05, 0.02, 1}, {0, 0.05, 0.3}, {0.1, 0.05, 0}};
    for (int i = 0; i < 4; i++) {
        double ratio;
        int holds = coverage(cases[i].bias, cases[i].noise, cases[i].known, 400, &ratio);
        if (holds < 380 - 18 || holds > 380 + 18) fail_msg("case %d: %d of 400", i, holds);
        if (fabs(ratio - 1) > 0.03) fail_msg("case %d: the mean is %g of the truth", i, ratio);
    }
}

static void quantiles_are_normal(void **state)
{
    (void)state;
    assert_true(fabs(normal_quantile(0.05) - 1.959963984540054) < 1e-9);
    assert_true(fabs(normal_quantile(0.0016) - 3.1559067579) < 1e-6);
    assert_true(fabs(normal_quantile(0.5) - 0.6744897501960817) < 1e-9);
}

static void roots_of_what_is_near_0(void **state)
{
    (void)state;
    Estimate e = root_estimate((MeanSquare){-1e-6, 1e-6}, 0.05);
    assert_true(e.value == 0 && e.low == 0 && e.high > 1e-3 && e.high < 2e-3);
    e = root_estimate((MeanSquare){0, 0}, 0.05);
    assert_true(e.value == 0 && e.low == 0 && e.high == 0);
    e = root_estimate((MeanSquare){1e-4, 1e-6}, 0.05);
    assert_true(fabs(e.value - 0.01) < 1e-12 && e.low < 0.01 && e.high > 0.01 && e.high / e.low < 1.03);
    assert_true(isnan(root_estimate((MeanSquare){NAN, NAN}, 0.05).high));
}

/* Half-planes x + s y < p sampled by two replicates: what the mean of all samples has of the squared difference. The doubt
 * and 5 % for chance are granted. */
static void splits_have_their_share(void **state)
{
    (void)state;
    enum { TRIALS = 20000, ROWS = 256 };
    const uint32_t sizes[][2] = {{1, 1}, {2, 1}, {5, 4}, {13, 12}, {8, 8}};
    for (int i = 0; i < 5; i++) {
        double squares = 0, differences = 0, n[2] = {sizes[i][0], sizes[i][1]};
        Rng rng = rng_seed(11, (uint64_t)i);
        for (uint32_t t = 0; t < TRIALS; t++) {
            double s = rng_double(&rng), p = (1 + s) * rng_double(&rng), area = 0, hits[2] = {0, 0};
            for (int y = 0; y < ROWS; y++) area += fmin(1, fmax(0, p - s * (y + 0.5) / ROWS)) / ROWS;
            for (uint32_t r = 0; r < 2; r++)
                for (uint32_t k = 0; k < sizes[i][r]; k++) {
                    Sample2 at = sample_place(sample_key(3, t, 0, r), k);
                    hits[r] += at.x + s * at.y < p;
                }
            double error = (hits[0] + hits[1]) / (n[0] + n[1]) - area, d = hits[0] / n[0] - hits[1] / n[1];
            squares += error * error;
            differences += d * d;
        }
        ReplicateSplit split = replicate_split(sizes[i][0], sizes[i][1]);
        if (sizes[i][0] == sizes[i][1]) assert_true(split.share == 0.25 && split.doubt == 0);
        double off = squares / differences / split.share - 1;
        if (fabs(off) > split.doubt + 0.05) fail_msg("%g + %g samples: off by %g", n[0], n[1], off);
    }
}

static void contradictions_leave_the_audit(void **state)
{
    (void)state;
    MeanSquare both = agreed_mean_square((MeanSquare){1, 0.1}, (MeanSquare){0.9, 0.01});
    assert_true(both.mean > 0.9 && both.mean < 1 && both.deviation < 0.1);
    MeanSquare one = agreed_mean_square((MeanSquare){1, 0.1}, (MeanSquare){0.1, 0.01});
    assert_true(one.mean == 1 && one.deviation == 0.1);
    MeanSquare none = agreed_mean_square((MeanSquare){0, 0}, (MeanSquare){0, 0});
    assert_true(none.mean == 0 && none.deviation == 0);
}

/* A hidden area of just that size in one pixel is missed by all samples with the probability alpha. */
static void what_was_not_seen_is_bounded(void **state)
{
    (void)state;
    for (double n = 1; n < 1000; n *= 3) {
        double area = audit_unseen(1, n, 0.05);
        assert_true(fabs(pow(1 - area, n) - 0.05) < 1e-12);
        assert_true(fabs(audit_unseen(400, n, 0.05) - area / 20) < 1e-15);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(draws_have_their_probabilities),
        cmocka_unit_test(intervals_hold_the_truth),
        cmocka_unit_test(quantiles_are_normal),
        cmocka_unit_test(roots_of_what_is_near_0),
        cmocka_unit_test(splits_have_their_share),
        cmocka_unit_test(contradictions_leave_the_audit),
        cmocka_unit_test(what_was_not_seen_is_bounded),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
