/* What a colour becomes in each format of the film. */
#include "render/film.h"

#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

static void bytes_are_clamped_and_rounded(void **state)
{
    (void)state;
    uint8_t film[6] = {9, 9, 9, 9, 9, 9};
    film_put(FILM_8, false, film, 1, (const double[]){-1, 0.5, 1e30});
    assert_memory_equal(film, ((const uint8_t[]){9, 9, 9, 0, 128, 255}), 6);
    for (unsigned k = 0; k <= 255; k++) {
        film_put(FILM_8, false, film, 0, (const double[]){k / 255.0, (k - 0.49) / 255, (k + 0.49) / 255});
        assert_memory_equal(film, ((const uint8_t[]){(uint8_t)k, (uint8_t)k, (uint8_t)k}), 3);
    }
}

static void deep_samples_have_the_high_byte_first(void **state)
{
    (void)state;
    uint8_t film[12] = {0};
    film_put(FILM_16, false, film, 1, (const double[]){-1, 4660 / 65535.0, 2});
    assert_memory_equal(film, ((const uint8_t[]){0, 0, 0, 0, 0, 0, 0, 0, 0x12, 0x34, 255, 255}), 12);
    for (unsigned k = 0; k <= 65535; k++) {
        film_put(FILM_16, false, film, 0, (const double[]){k / 65535.0, (k - 0.49) / 65535, (k + 0.49) / 65535});
        for (int c = 0; c < 3; c++) assert_int_equal(film[2 * c] << 8 | film[2 * c + 1], k);
    }
}

/* sRGB's curve at its corner points and at 0.5 (0.735356983052449). */
static void integers_are_encoded(void **state)
{
    (void)state;
    uint8_t film[6];
    film_put(FILM_8, true, film, 0, (const double[]){0, 0.5, 1});
    assert_memory_equal(film, ((const uint8_t[]){0, 188, 255}), 3);
    film_put(FILM_16, true, film, 0, (const double[]){0.0031308, 0.5, 1});
    assert_int_equal(film[0] << 8 | film[1], (int)(12.92 * 0.0031308 * 65535 + 0.5));
    assert_int_equal(film[2] << 8 | film[3], (int)(0.735356983052449 * 65535 + 0.5));
    assert_int_equal(film[4] << 8 | film[5], 65535);
}

static void floats_are_as_they_are(void **state)
{
    (void)state;
    float film[6] = {0};
    for (int srgb = 0; srgb < 2; srgb++) {
        film_put(FILM_FLOAT, srgb, film, 1, (const double[]){-0.25, 1234.5, 0.1});
        assert_true(film[3] == -0.25f && film[4] == 1234.5f && film[5] == 0.1f && film[0] == 0);
    }
    film_put(FILM_FLOAT, false, film, 0, (const double[]){1e300, -1e39, 1e-300});
    assert_true(film[0] == FLT_MAX && film[1] == -FLT_MAX && film[2] == 0);
}

static void sizes(void **state)
{
    (void)state;
    assert_int_equal(film_pixel_bytes(FILM_8), 3);
    assert_int_equal(film_pixel_bytes(FILM_16), 6);
    assert_int_equal(film_pixel_bytes(FILM_FLOAT), 12);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bytes_are_clamped_and_rounded),
        cmocka_unit_test(deep_samples_have_the_high_byte_first),
        cmocka_unit_test(integers_are_encoded),
        cmocka_unit_test(floats_are_as_they_are),
        cmocka_unit_test(sizes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
