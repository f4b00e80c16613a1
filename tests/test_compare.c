/* The measures of two pictures: what they must be by their definitions, and reference values that other programs computed
 * (tests/data/compare/reference.py says how). */
#include "compare/compare.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "common/rng.h"
#include "support/alloc_fail.h"

enum { SEED = 8 };

static Image make(uint32_t width, uint32_t height, double white)
{
    Image image = {width, height, white, calloc((size_t)width * height * 3, sizeof(float))};
    assert_non_null(image.rgb);
    return image;
}

static Image constant(uint32_t width, uint32_t height, float r, float g, float b)
{
    Image image = make(width, height, 1);
    for (size_t i = 0; i < (size_t)width * height; i++) {
        image.rgb[3 * i] = r;
        image.rgb[3 * i + 1] = g;
        image.rgb[3 * i + 2] = b;
    }
    return image;
}

static Image noise(uint32_t width, uint32_t height, uint64_t stream)
{
    Image image = make(width, height, 65535);
    Rng rng = rng_seed(SEED, stream);
    for (size_t i = 0; i < (size_t)width * height * 3; i++) image.rgb[i] = (float)(rng_u32(&rng) & 0xffff);
    return image;
}

static Comparison compare(const Image *a, const Image *b, const CompareSettings *settings)
{
    CompareSettings any = compare_defaults();
    Comparison result;
    Err err = {ERR_NONE, ""};
    if (!compare_images(a, b, settings ? settings : &any, &result, &err)) fail_msg("%s", err.text);
    return result;
}

static void assert_near(double x, double expected, double most)
{
    if (!(fabs(x - expected) <= most)) fail_msg("%.12g, not %.12g", x, expected);
}

/* ---- references ---- */

/* FLIP: both sides are double, one by separable filters, the other by whole ones. */
static void reference_values(void **state)
{
    (void)state;
    FILE *file = fopen("tests/data/compare/reference.txt", "r");
    assert_non_null(file);
    char name[2][64];
    int linear, pairs = 0;
    double rmse, psnr, ssim, flip;
    while (fscanf(file, "%63s %63s %d %lf %lf %lf %lf", name[0], name[1], &linear, &rmse, &psnr, &ssim, &flip) == 7) {
        Image image[2];
        Err err = {ERR_NONE, ""};
        for (int i = 0; i < 2; i++) {
            char path[256];
            snprintf(path, sizeof path, "tests/data/compare/%s", name[i]);
            if (!image_load(path, &image[i], &err)) fail_msg("%s", err.text);
        }
        CompareSettings settings = compare_defaults();
        settings.linear = linear;
        Comparison r = compare(&image[0], &image[1], &settings);
        assert_near(r.rmse, rmse, 1e-11);
        assert_near(r.psnr_db, psnr, 1e-9);
        assert_near(r.ssim, ssim, 1e-10);
        assert_near(r.flip, flip, 1e-8);
        for (int i = 0; i < 2; i++) image_free(&image[i]);
        pairs++;
    }
    assert_int_equal(pairs, 6);
    fclose(file);
}

/* ---- laws ---- */

static void a_picture_equals_itself(void **state)
{
    (void)state;
    static const uint32_t sizes[][2] = {{1, 1}, {11, 11}, {1, 40}, {40, 1}, {10, 40}, {64, 48}, {333, 17}};
    CompareSettings strict = compare_defaults();
    strict.max_rmse = strict.max_diff = strict.max_share = 0;
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        Image a = noise(sizes[i][0], sizes[i][1], i);
        Comparison r = compare(&a, &a, &strict);
        assert_true(r.rmse == 0 && isinf(r.psnr_db) && r.psnr_db > 0 && r.flip == 0 && r.max_diff == 0);
        assert_int_equal(r.differing, 0);
        assert_int_equal(r.pixels, sizes[i][0] * sizes[i][1]);
        if (sizes[i][0] < 11 || sizes[i][1] < 11) assert_true(isnan(r.ssim));
        else assert_true(r.ssim == 1);
        char text[256];
        assert_true(compare_passes(&r, &strict, text, sizeof text));
        assert_string_equal(text, "");
        image_free(&a);
    }
}

static Image transposed(const Image *image)
{
    Image t = make(image->height, image->width, image->white);
    for (uint32_t y = 0; y < image->height; y++)
        for (uint32_t x = 0; x < image->width; x++)
            memcpy(t.rgb + 3 * ((size_t)x * t.width + y), image->rgb + 3 * ((size_t)y * image->width + x), 3 * sizeof(float));
    return t;
}

static Image rotated(const Image *image)
{
    size_t count = (size_t)image->width * image->height;
    Image r = make(image->width, image->height, image->white);
    for (size_t i = 0; i < count; i++) memcpy(r.rgb + 3 * i, image->rgb + 3 * (count - 1 - i), 3 * sizeof(float));
    return r;
}

static void assert_same(const Comparison *r, const Comparison *s)
{
    assert_near(r->rmse, s->rmse, 1e-13);
    assert_near(r->flip, s->flip, 1e-12);
    if (!isnan(r->ssim)) assert_near(r->ssim, s->ssim, 1e-12);
    assert_true(r->max_diff == s->max_diff && r->differing == s->differing);
}

/* Small pictures too: there the filters reach beyond both borders. */
static void neither_order_nor_pose_matters(void **state)
{
    (void)state;
    static const uint32_t sizes[][2] = {{1, 1}, {2, 9}, {5, 3}, {13, 12}, {64, 33}, {1, 50}};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        Image a = noise(sizes[i][0], sizes[i][1], 2 * i), b = noise(sizes[i][0], sizes[i][1], 2 * i + 1);
        Comparison r = compare(&a, &b, NULL), swapped = compare(&b, &a, NULL);
        assert_true(r.rmse == swapped.rmse && r.flip == swapped.flip && r.max_diff == swapped.max_diff);
        assert_same(&r, &swapped);
        assert_true(r.flip > 0 && r.flip < 1);
        Image ta = transposed(&a), tb = transposed(&b), ra = rotated(&a), rb = rotated(&b);
        Comparison t = compare(&ta, &tb, NULL), turned = compare(&ra, &rb, NULL);
        assert_same(&r, &t);
        assert_same(&r, &turned);
        Image *all[] = {&a, &b, &ta, &tb, &ra, &rb};
        for (int k = 0; k < 6; k++) image_free(all[k]);
    }
}

/* ---- by hand ---- */

/* Two pictures of one colour each have no structure: the first factor of SSIM is left. FLIP's filters change nothing. */
static void pictures_of_one_colour(void **state)
{
    (void)state;
    static const float grey[][2] = {{0, 1}, {0.25f, 0.5f}, {0.5f, 0.52f}, {0, 0.001f}};
    for (size_t i = 0; i < sizeof grey / sizeof *grey; i++) {
        double p = (double)grey[i][0], q = (double)grey[i][1];
        Image a = constant(30, 20, grey[i][0], grey[i][0], grey[i][0]);
        Image b = constant(30, 20, grey[i][1], grey[i][1], grey[i][1]);
        CompareSettings linear = compare_defaults();
        linear.linear = true;
        Comparison r = compare(&a, &b, &linear);
        assert_near(r.rmse, q - p, 1e-12);
        assert_near(r.psnr_db, -20 * log10(q - p), 1e-9);
        assert_near(r.max_diff, q - p, 1e-15);
        assert_near(r.ssim, (2 * p * q + 1e-4) / (p * p + q * q + 1e-4), 1e-9);
        /* Greys have only lightness, whose formula is CIE's; 41.2761 is that of green and blue. */
        double lp = p > 216 / 24389.0 ? 116 * cbrt(p) - 16 : 24389 / 27.0 * p;
        double lq = q > 216 / 24389.0 ? 116 * cbrt(q) - 16 : 24389 / 27.0 * q;
        double d = pow(lq - lp, 0.7), knee = 0.4 * 41.2761;
        double expected = d < knee ? 0.95 * d / knee : 0.95 + 0.05 * (d - knee) / (41.2761 - knee);
        assert_near(r.flip, expected, 3e-6);
        image_free(&a);
        image_free(&b);
    }
    Image green = constant(25, 25, 0, 1, 0), blue = constant(25, 25, 0, 0, 1);
    assert_near(compare(&green, &blue, NULL).flip, 1, 1e-8);
    image_free(&green);
    image_free(&blue);
}

/* SSIM of a picture and its negative about 1/2 with equal means: the second factor is near -1. */
static void the_negative_is_opposite(void **state)
{
    (void)state;
    Image a = make(64, 64, 1), b = make(64, 64, 1);
    for (int y = 0; y < 64; y++)
        for (int x = 0; x < 64; x++)
            for (int k = 0; k < 3; k++) {
                float v = (float)((x + y) % 2);
                a.rgb[3 * (64 * y + x) + k] = v;
                b.rgb[3 * (64 * y + x) + k] = 1 - v;
            }
    assert_near(compare(&a, &b, NULL).ssim, -1, 0.01);
    image_free(&a);
    image_free(&b);
}

static void rmse_is_over_pixels_and_channels(void **state)
{
    (void)state;
    Image a = constant(10, 10, 0, 0, 0), b = constant(10, 10, 0, 0, 0);
    b.rgb[3 * 57 + 1] = 30;  /* not clamped */
    b.rgb[3 * 80] = -4;
    Comparison r = compare(&a, &b, NULL);
    assert_near(r.rmse, sqrt((900 + 16) / 300.0), 1e-12);
    assert_true(r.max_diff == 30 && r.max_x == 7 && r.max_y == 5 && r.differing == 2);
    image_free(&a);
    image_free(&b);
}

/* All pairs of levels of 8 bits: what is off by k levels is so exactly. */
static void tolerance_counts_whole_levels(void **state)
{
    (void)state;
    Image a = make(256, 256, 65535), b = make(256, 256, 65535);
    for (int y = 0; y < 256; y++)
        for (int x = 0; x < 256; x++) {
            a.rgb[3 * (256 * y + x) + 2] = (float)(257 * x);
            b.rgb[3 * (256 * y + x) + 2] = (float)(257 * y);
        }
    static const int tolerances[] = {0, 1, 2, 3, 10, 100, 127, 200, 253, 254, 255};
    for (size_t i = 0; i < sizeof tolerances / sizeof *tolerances; i++) {
        int t = tolerances[i];
        CompareSettings settings = compare_defaults();
        settings.tolerance = t;
        Comparison r = compare(&a, &b, &settings);
        assert_int_equal(r.differing, (255 - t) * (256 - t));  /* twice the sum of 1 .. 255 - t */
        assert_true(r.max_diff == 1);
    }
    image_free(&a);
    image_free(&b);
}

/* A PNG and a PFM of the same values. */
static void whites_of_their_own(void **state)
{
    (void)state;
    Image png = noise(40, 30, 1), pfm = make(40, 30, 1);
    for (size_t i = 0; i < 3 * 40 * 30; i++) pfm.rgb[i] = png.rgb[i] / 65535;
    Comparison r = compare(&png, &pfm, NULL);
    assert_true(r.max_diff < 1e-7 && r.rmse < 1e-7 && r.flip < 1e-3 && r.ssim > 1 - 1e-9);
    Image other = noise(40, 30, 2);
    Comparison s = compare(&png, &other, NULL), t = compare(&pfm, &other, NULL);
    assert_near(s.rmse, t.rmse, 1e-7);
    assert_near(s.flip, t.flip, 1e-6);
    assert_near(s.ssim, t.ssim, 1e-6);
    image_free(&png);
    image_free(&pfm);
    image_free(&other);
}

static void numbers_beyond_all_screens(void **state)
{
    (void)state;
    Image a = constant(20, 20, 3e38f, -3e38f, 1e-40f), b = constant(20, 20, -3e38f, 3e38f, 0);
    Comparison r = compare(&a, &b, NULL);
    assert_near(r.rmse / (6e38 * sqrt(2 / 3.0)), 1, 1e-6);
    assert_true(isfinite(r.ssim) && isfinite(r.flip) && r.flip > 0.5 && r.flip <= 1);
    image_free(&a);
    image_free(&b);
}

/* ---- grading ---- */

static void edges_excuse_pixels_beside_them(void **state)
{
    (void)state;
    Image a = make(40, 40, 65535), b = make(40, 40, 65535);
    for (int y = 0; y < 40; y++)
        for (int x = 0; x < 40; x++)
            for (int k = 0; k < 3; k++) {
                a.rgb[3 * (40 * y + x) + k] = x < 20 ? 0 : 200 * 257;
                b.rgb[3 * (40 * y + x) + k] = x < 21 ? 0 : 200 * 257;
            }
    CompareSettings settings = compare_defaults();
    settings.tolerance = 3;
    settings.only_edges = true;
    settings.reach = 2;
    settings.max_share = 5;
    char text[256];
    Comparison r = compare(&a, &b, &settings);
    assert_int_equal(r.differing, 40);
    assert_int_equal(r.stray, 0);
    assert_true(compare_passes(&r, &settings, text, sizeof text));
    settings.max_share = 2;
    assert_false(compare_passes(&r, &settings, text, sizeof text));
    assert_string_equal(text, "fails: 40 pixels, 2.500 %, differ by more than 3 levels; 2 % may\n");
    /* a difference in the plain, too small to make a step of its own size */
    settings.max_share = 100;
    for (int x = 30; x < 40; x++)
        for (int y = 0; y < 40; y++) b.rgb[3 * (40 * y + x)] += 257.0f * 4;
    r = compare(&a, &b, &settings);
    assert_int_equal(r.stray, 400 - 2 * 40);  /* the new edge excuses two columns */
    assert_int_equal(r.stray_x, 32);
    assert_int_equal(r.stray_y, 0);
    assert_false(compare_passes(&r, &settings, text, sizeof text));
    assert_string_equal(text, "fails: 320 differing pixels not near an edge, the first at 32,0\n");
    image_free(&a);
    image_free(&b);
}

static void limits_are_inclusive(void **state)
{
    (void)state;
    Image a = constant(12, 12, 0, 0, 0), b = constant(12, 12, 0.5f, 0.5f, 0.5f);
    CompareSettings settings = compare_defaults();
    Comparison r = compare(&a, &b, &settings);
    char text[512];
    settings.max_rmse = settings.max_diff = 0.5;
    assert_true(compare_passes(&r, &settings, text, sizeof text));
    settings.max_rmse = 0.499;
    settings.max_diff = 0.4;
    assert_false(compare_passes(&r, &settings, text, sizeof text));
    assert_string_equal(text, "fails: RMSE 0.5 is more than 0.499\nfails: the greatest difference 0.5 is more than 0.4\n");
    /* a text that doesn't fit is cut */
    assert_false(compare_passes(&r, &settings, text, 10));
    assert_string_equal(text, "fails: RM");
    image_free(&a);
    image_free(&b);
}

static void words(void **state)
{
    (void)state;
    CompareSettings settings = compare_defaults();
    settings.tolerance = 1;
    Comparison r = {.rmse = 0.25, .psnr_db = 12.0412, .ssim = 0.99999999, .flip = 0.125, .max_diff = 1 / 255.0,
                    .max_x = 3, .max_y = 4, .pixels = 1000000, .differing = 999999};
    char text[512];
    compare_text(&r, &settings, text, sizeof text);
    assert_string_equal(text, "RMSE      0.25\nPSNR      12.041 dB\nSSIM      0.999999\nFLIP      0.125\n"
                              "greatest  0.00392157, 1 level, at 3,4\n"
                              "differing 999999 of 1000000 pixels, 99.999 %, by more than 1 level\n");
    r = (Comparison){.psnr_db = (double)INFINITY, .ssim = (double)NAN, .pixels = 1000000, .differing = 1};
    compare_text(&r, &settings, text, sizeof text);
    assert_string_equal(text, "RMSE      0\nPSNR      inf dB\nSSIM      none below 11 x 11 pixels\nFLIP      0\n"
                              "greatest  0, 0 levels\n"
                              "differing 1 of 1000000 pixels, 0.001 %, by more than 1 level\n");
}

static void heat_goes_with_the_difference(void **state)
{
    (void)state;
    Image a = constant(4, 1, 0, 0, 0), b = constant(4, 1, 0, 0, 0);
    b.rgb[3] = 0.9f;            /* the greatest */
    b.rgb[7] = 0.1f;            /* a ninth: a third of the way, red */
    b.rgb[11] = 0.4f;           /* four ninths: two thirds, yellow */
    uint8_t map[12];
    compare_heat_map(&a, &b, compare(&a, &b, NULL).max_diff, map);
    assert_memory_equal(map, ((const uint8_t[]){0, 0, 0, 255, 255, 255, 255, 0, 0, 255, 255, 0}), 12);
    compare_heat_map(&a, &a, 0, map);
    for (int i = 0; i < 12; i++) assert_int_equal(map[i], 0);
    image_free(&a);
    image_free(&b);
}

static void every_allocation_may_fail(void **state)
{
    (void)state;
    Image a = noise(20, 20, 1), b = noise(20, 20, 2);
    CompareSettings settings = compare_defaults();
    for (long n = 1;; n++) {
        Comparison r;
        Err err = {ERR_NONE, ""};
        alloc_fail_at(n);
        bool done = compare_images(&a, &b, &settings, &r, &err);
        bool failed = alloc_fail_stop();
        assert_true(failed == !done);
        if (!failed) {
            assert_true(n > 5);
            break;
        }
        assert_int_equal(err.kind, ERR_LIMIT);
    }
    image_free(&a);
    image_free(&b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(reference_values),
        cmocka_unit_test(a_picture_equals_itself),
        cmocka_unit_test(neither_order_nor_pose_matters),
        cmocka_unit_test(pictures_of_one_colour),
        cmocka_unit_test(the_negative_is_opposite),
        cmocka_unit_test(rmse_is_over_pixels_and_channels),
        cmocka_unit_test(tolerance_counts_whole_levels),
        cmocka_unit_test(whites_of_their_own),
        cmocka_unit_test(numbers_beyond_all_screens),
        cmocka_unit_test(edges_excuse_pixels_beside_them),
        cmocka_unit_test(limits_are_inclusive),
        cmocka_unit_test(words),
        cmocka_unit_test(heat_goes_with_the_difference),
        cmocka_unit_test(every_allocation_may_fail),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
