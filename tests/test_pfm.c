/* PFM files: every bit of what is written comes back, both byte orders, colour and grey, and what broken files are told. */
#include "tools/pfm.h"

#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "common/rng.h"
#include "support/alloc_fail.h"

enum { SEED = 5 };

/* Any finite float, subnormal ones and both zeros among them. */
static float any_float(Rng *rng)
{
    for (;;) {
        uint32_t bits = rng_u32(rng);
        float x;
        memcpy(&x, &bits, sizeof x);
        if (isfinite(x)) return x;
    }
}

static void every_bit_comes_back(void **state)
{
    (void)state;
    static const uint32_t sizes[][2] = {{1, 1}, {3, 5}, {1, 300}, {300, 1}, {65, 33}, {65535, 1}, {1, 65535}};
    static const float special[] = {0, -0.0f, FLT_MAX, -FLT_MAX, FLT_MIN, FLT_TRUE_MIN, -FLT_TRUE_MIN, 1, 0.1f};
    Rng rng = rng_seed(SEED, 0);
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        uint32_t w = sizes[i][0], h = sizes[i][1];
        size_t count = (size_t)3 * w * h, size;
        float *rgb = malloc(count * sizeof *rgb);
        assert_non_null(rgb);
        for (size_t k = 0; k < count; k++) rgb[k] = k < 9 ? special[k] : any_float(&rng);
        uint8_t *data;
        Err err = {ERR_NONE, ""};
        assert_true(pfm_encode(rgb, w, h, &data, &size, &err));
        size_t most = SIZE_MAX;
        assert_true(pfm_accept("a.pfm", data, size, &most, &err));
        assert_int_equal(most, size + 1);
        Pfm pfm;
        if (!pfm_decode("a.pfm", data, size, &pfm, &err)) fail_msg("%s", err.text);
        assert_int_equal(pfm.width, w);
        assert_int_equal(pfm.height, h);
        assert_memory_equal(pfm.rgb, rgb, count * sizeof *rgb);
        /* the other byte order: the same picture */
        char *scale = strstr((char *)data, "-1.0\n");
        *scale = '+';
        for (uint8_t *p = (uint8_t *)scale + 5; p < data + size; p += 4) {
            uint8_t swapped[4] = {p[3], p[2], p[1], p[0]};
            memcpy(p, swapped, 4);
        }
        pfm_free(&pfm);
        if (!pfm_decode("a.pfm", data, size, &pfm, &err)) fail_msg("%s", err.text);
        assert_memory_equal(pfm.rgb, rgb, count * sizeof *rgb);
        pfm_free(&pfm);
        assert_null(pfm.rgb);
        free(rgb);
        free(data);
    }
}

static void assert_values(const char *data, size_t size, const float *expected, size_t count)
{
    Pfm pfm;
    Err err = {ERR_NONE, ""};
    if (!pfm_decode("a.pfm", (const unsigned char *)data, size, &pfm, &err)) fail_msg("%s", err.text);
    assert_int_equal((size_t)pfm.width * pfm.height * 3, count);
    assert_memory_equal(pfm.rgb, expected, count * sizeof *expected);
    pfm_free(&pfm);
}
#define VALUES(data, ...) \
    assert_values(data, sizeof data - 1, (const float[]){__VA_ARGS__}, sizeof((const float[]){__VA_ARGS__}) / sizeof(float))

/* Bytes by hand: 1 is 3f800000, 2 is 40000000, -0.5 is bf000000. */
static void files_written_by_others(void **state)
{
    (void)state;
    VALUES("PF\n1 1\n1.0\n\x3f\x80\0\0\x40\0\0\0\xbf\0\0\0", 1, 2, -0.5f);
    VALUES("PF\n1 1\n-1.0\n\0\0\x80\x3f\0\0\0\x40\0\0\0\xbf", 1, 2, -0.5f);
    /* the first row of the file is the lowest */
    VALUES("Pf\n1 2\n-1\n\0\0\x80\x3f\0\0\0\x40", 2, 2, 2, 1, 1, 1);
    VALUES("Pf 2\t1\r\n1e0 \x3f\x80\0\0\x40\0\0\0", 1, 1, 1, 2, 2, 2);
    /* the scale is a factor */
    VALUES("Pf\n2 1\n-2.5\n\0\0\x80\x3f\0\0\0\xbf", 2.5f, 2.5f, 2.5f, -1.25f, -1.25f, -1.25f);
    /* one blank ends the header: what follows is the picture, blank or not */
    VALUES("Pf\n1 1\n-1\n\n\n\n\n", 6.6463464e-33f, 6.6463464e-33f, 6.6463464e-33f);
}

static void assert_refused(const void *data, size_t size, const char *expected)
{
    Pfm pfm;
    Err err = {ERR_NONE, ""};
    assert_false(pfm_decode("bad.pfm", data, size, &pfm, &err));
    assert_int_equal(err.kind, ERR_INPUT);
    assert_string_equal(err.text, expected);
    assert_null(pfm.rgb);
}
#define REFUSED(data, expected) assert_refused(data, sizeof data - 1, "bad.pfm: " expected)

static void broken_files(void **state)
{
    (void)state;
    REFUSED("", "no PFM: it begins with neither PF nor Pf");
    REFUSED("P6\n1 1\n255\n", "no PFM: it begins with neither PF nor Pf");
    REFUSED("PFX 1 1 1\n", "no PFM: it begins with neither PF nor Pf");
    REFUSED("PF\n", "no width, height and scale in the header");
    REFUSED("PF\n12", "no width, height and scale in the header");
    REFUSED("PF\n1 1\n-1.0", "no width, height and scale in the header");
    REFUSED("PF\n1111111111111111111111111111111111111111 1\n-1.0\n", "no width, height and scale in the header");
    REFUSED("PF\n-1 1\n-1.0\n", "'-1 1' is no size of a picture");
    REFUSED("PF\n1 0\n-1.0\n", "'1 0' is no size of a picture");
    REFUSED("PF\n1.5 2\n-1.0\n", "'1.5 2' is no size of a picture");
    REFUSED("PF\n0x8 2\n-1.0\n", "'0x8 2' is no size of a picture");
    REFUSED("PF\n65536 1\n-1\n", "65536 x 1 pixels; at most 65535 a side and 268435456 in all are allowed");
    REFUSED("PF\n4294967297 1\n-1\n", "4294967297 x 1 pixels; at most 65535 a side and 268435456 in all are allowed");
    REFUSED("PF\n1 99999999999999999999\n-1\n",
            "1 x 99999999999999999999 pixels; at most 65535 a side and 268435456 in all are allowed");
    REFUSED("Pf\n16385 16384\n-1\n", "16385 x 16384 pixels; at most 65535 a side and 268435456 in all are allowed");
    REFUSED("PF\n1 1\n0\n", "'0' is no scale");
    REFUSED("PF\n1 1\nnan\n", "'nan' is no scale");
    REFUSED("PF\n1 1\n-inf\n", "'-inf' is no scale");
    REFUSED("PF\n1 1\n1,0\n", "'1,0' is no scale");
    REFUSED("PF\n1 1\n-1\n01234567890", "the file is cut off");
    REFUSED("Pf\n1 1\n-1\n01234", "more bytes than its pixels need");
    REFUSED("Pf\n2 2\n-1\n0000000000000\0\xc0\x7f", "pixel 1,0 is no finite number");
    REFUSED("PF\n1 1\n1\n00000000\xff\x80\0\0", "pixel 0,0 is no finite number");
    REFUSED("Pf\n1 1\n-10\n\xff\xff\x7f\x7f", "pixel 0,0 is no finite number");
}

/* The header alone is enough to refuse a size; nothing is allocated for it. */
static void sizes_are_judged_by_the_head(void **state)
{
    (void)state;
    static const char head[] = "PF\n65535 65535\n-1\n";
    Err err = {ERR_NONE, ""};
    size_t most = SIZE_MAX;
    assert_false(pfm_accept("bad.pfm", (const unsigned char *)head, sizeof head - 1, &most, &err));
    assert_int_equal(err.kind, ERR_INPUT);
}

static void cut_anywhere_it_is_no_picture(void **state)
{
    (void)state;
    const float rgb[12] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
    uint8_t *data;
    size_t size;
    assert_true(pfm_encode(rgb, 2, 2, &data, &size, NULL));
    for (size_t cut = 0; cut < size; cut++) {
        uint8_t *part = malloc(cut + 1);  /* of its own, so that a sanitizer sees reads beyond it */
        assert_non_null(part);
        memcpy(part, data, cut);
        Pfm pfm;
        Err err = {ERR_NONE, ""};
        assert_false(pfm_decode("cut.pfm", part, cut, &pfm, &err));
        assert_int_equal(err.kind, ERR_INPUT);
        free(part);
    }
    free(data);
}

static void allocations_may_fail(void **state)
{
    (void)state;
    const float rgb[3] = {1, 2, 3};
    uint8_t *data;
    size_t size;
    Pfm pfm;
    Err err;
    alloc_fail_at(1);
    assert_false(pfm_encode(rgb, 1, 1, &data, &size, &err));
    alloc_fail_stop();
    assert_int_equal(err.kind, ERR_LIMIT);
    assert_null(data);
    assert_true(pfm_encode(rgb, 1, 1, &data, &size, &err));
    alloc_fail_at(1);
    assert_false(pfm_decode("a.pfm", data, size, &pfm, &err));
    alloc_fail_stop();
    assert_int_equal(err.kind, ERR_LIMIT);
    assert_string_equal(err.text, "out of memory for a.pfm");
    free(data);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_bit_comes_back),
        cmocka_unit_test(files_written_by_others),
        cmocka_unit_test(broken_files),
        cmocka_unit_test(sizes_are_judged_by_the_head),
        cmocka_unit_test(cut_anywhere_it_is_no_picture),
        cmocka_unit_test(allocations_may_fail),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
