/* Pictures as floats, from either kind of file. */
#include "tools/image.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "common/rng.h"
#include "support/alloc_fail.h"
#include "support/test_file.h"
#include "tools/pfm.h"
#include "tools/png.h"

enum { SEED = 6, WIDTH = 200, HEIGHT = 150, COUNT = 3 * WIDTH * HEIGHT };

/* A file of WIDTH x HEIGHT random pixels, larger than what is read first; samples get what a reader should see. */
static const char *png_file(const char *name, unsigned bits, uint16_t *samples)
{
    static uint8_t rgb[2 * COUNT];
    Rng rng = rng_seed(SEED, bits);
    for (int i = 0; i < COUNT; i++) {
        uint8_t high = (uint8_t)rng_u32(&rng), low = bits == 16 ? (uint8_t)rng_u32(&rng) : high;
        if (bits == 16) {
            rgb[2 * i] = high;
            rgb[2 * i + 1] = low;
        } else {
            rgb[i] = high;
        }
        samples[i] = (uint16_t)(high << 8 | low);
    }
    uint8_t *data;
    size_t size;
    assert_true(png_encode(rgb, bits, WIDTH, HEIGHT, &data, &size, NULL));
    const char *path = test_file_bytes(name, data, size);
    free(data);
    return path;
}

static void load(const char *path, Image *image)
{
    Err err = {ERR_NONE, ""};
    if (!image_load(path, image, &err)) fail_msg("%s", err.text);
}

static void levels_of_a_png_are_whole_numbers(void **state)
{
    (void)state;
    static uint16_t samples[COUNT];
    for (unsigned bits = 8; bits <= 16; bits += 8) {
        Image image;
        load(png_file("image.png", bits, samples), &image);
        assert_int_equal(image.width, WIDTH);
        assert_int_equal(image.height, HEIGHT);
        assert_true(image.white == 65535);
        for (int i = 0; i < COUNT; i++) assert_true(image.rgb[i] == samples[i]);
        image_free(&image);
        assert_null(image.rgb);
    }
}

static void floats_of_a_pfm_are_kept(void **state)
{
    (void)state;
    static float rgb[COUNT];
    Rng rng = rng_seed(SEED, 1);
    for (int i = 0; i < COUNT; i++) rgb[i] = (float)rng_u32(&rng) * 1e-9f - 1;
    uint8_t *data;
    size_t size;
    assert_true(pfm_encode(rgb, WIDTH, HEIGHT, &data, &size, NULL));
    /* the name doesn't matter */
    const char *path = test_file_bytes("floats.png", data, size);
    Image image;
    load(path, &image);
    assert_true(image.white == 1);
    assert_memory_equal(image.rgb, rgb, sizeof rgb);
    const uint32_t crop[4] = {7, 30, 90, 149};
    image_crop(&image, crop);
    assert_int_equal(image.width, 83);
    assert_int_equal(image.height, 119);
    for (size_t y = 0; y < 119; y++)
        assert_memory_equal(image.rgb + y * 83 * 3, rgb + ((y + 30) * WIDTH + 7) * 3, 83 * 3 * sizeof(float));
    image_free(&image);
    free(data);
}

static void assert_refused(const char *path, ErrKind kind, const char *expected)
{
    Image image;
    Err err = {ERR_NONE, ""};
    assert_false(image_load(path, &image, &err));
    assert_int_equal(err.kind, kind);
    assert_string_equal(err.text, expected);
    assert_null(image.rgb);
}

static void files_that_are_refused(void **state)
{
    (void)state;
    assert_refused("build/none.png", ERR_INPUT, "can't open build/none.png: No such file or directory");
    assert_refused("src", ERR_INPUT, "can't open src: Is a directory");
    assert_refused("/dev/zero", ERR_INPUT, "/dev/zero: neither a PNG nor a PFM");
    assert_refused("/dev/null", ERR_INPUT, "/dev/null: neither a PNG nor a PFM");
    assert_refused(test_file("x.ppm", "P6\n1 1\n255\nabc"), ERR_INPUT,
                   test_message("", "x.ppm", ": neither a PNG nor a PFM"));
    assert_refused(test_file("x.pfm", "PF\n2 2\n-1\nabc"), ERR_INPUT, test_message("", "x.pfm", ": the file is cut off"));
    assert_refused(test_file("x.pfm", "PF\n-2 2\n-1\nabc"), ERR_INPUT,
                   test_message("", "x.pfm", ": '-2 2' is no size of a picture"));
    /* a megabyte behind the pixels isn't read to the end */
    char *much = calloc(1, 1 << 20);
    assert_non_null(much);
    memcpy(much, "Pf 1 1 1 ", 9);
    assert_refused(test_file_bytes("x.pfm", much, 1 << 20), ERR_INPUT,
                   test_message("", "x.pfm", ": more bytes than its pixels need"));
    free(much);
}

static void every_allocation_may_fail(void **state)
{
    (void)state;
    static uint16_t samples[COUNT];
    const char *path = png_file("image.png", 16, samples);
    for (long n = 1;; n++) {
        Image image;
        Err err = {ERR_NONE, ""};
        alloc_fail_at(n);
        bool done = image_load(path, &image, &err);
        bool failed = alloc_fail_stop();
        assert_true(failed == !done);
        image_free(&image);
        if (!failed) {
            assert_true(n > 3);
            break;
        }
        assert_int_equal(err.kind, ERR_LIMIT);
        assert_string_equal(err.text, test_message("out of memory for ", "image.png", ""));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(levels_of_a_png_are_whole_numbers),
        cmocka_unit_test(floats_of_a_pfm_are_kept),
        cmocka_unit_test(files_that_are_refused),
        cmocka_unit_test(every_allocation_may_fail),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
