/* Textures, Phong's material and the waves: small parts with exact answers. */
#include "node/texture/texture.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <float.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "node/bumping/bump.h"
#include "node/material/material.h"
#include "support/alloc_fail.h"
#include "support/test_file.h"
#include "tools/png.h"

static const double PI = 3.14159265358979323846;

static Texture *picture(const uint8_t *bytes, uint32_t width, uint32_t height, bool srgb)
{
    uint8_t *data;
    size_t size;
    Err err = {ERR_NONE, ""};
    assert_true(png_encode(bytes, 8, width, height, &data, &size, &err));
    Texture *t = image_texture_load(test_file_bytes("texture.png", data, size), srgb, &err);
    free(data);
    if (!t) fail_msg("%s", err.text);
    return t;
}

static Rgb at(const Texture *t, double u, double v) { return t->ops->colour(t, u, v, vec3_make(0, 0, 0)); }

static void assert_rgb(Rgb c, double r, double g, double b)
{
    double e = 1e-6;
    if (fabs((double)c.r - r) > e || fabs((double)c.g - g) > e || fabs((double)c.b - b) > e)
        fail_msg("(%g, %g, %g) instead of (%g, %g, %g)", (double)c.r, (double)c.g, (double)c.b, r, g, b);
}

/* red green
 * blue white */
static const uint8_t four[12] = {255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255};

static void texels_stand_at_their_centres(void **state)
{
    (void)state;
    Texture *t = picture(four, 2, 2, false);
    assert_rgb(at(t, 0.25, 0.75), 1, 0, 0);
    assert_rgb(at(t, 0.75, 0.75), 0, 1, 0);
    assert_rgb(at(t, 0.25, 0.25), 0, 0, 1);
    assert_rgb(at(t, 0.75, 0.25), 1, 1, 1);
    texture_destroy(t);
}

static void between_centres_colours_blend(void **state)
{
    (void)state;
    Texture *t = picture(four, 2, 2, false);
    assert_rgb(at(t, 0.5, 0.75), 0.5, 0.5, 0);
    assert_rgb(at(t, 0.25, 0.5), 0.5, 0, 0.5);
    assert_rgb(at(t, 0.5, 0.5), 0.5, 0.5, 0.5);
    assert_rgb(at(t, 0.375, 0.75), 0.75, 0.25, 0);
    texture_destroy(t);
}

static void pictures_repeat(void **state)
{
    (void)state;
    Texture *t = picture(four, 2, 2, false);
    for (int i = -3; i <= 3; i++) {
        assert_rgb(at(t, 0.25 + i, 0.75), 1, 0, 0);
        assert_rgb(at(t, 0.25, 0.75 + i), 1, 0, 0);
        assert_rgb(at(t, i, 0.75), 0.5, 0.5, 0);  /* the edge is half one side and half the other */
        assert_rgb(at(t, 0.75, i), 0.5, 1, 0.5);
    }
    assert_rgb(at(t, 1e9 + 0.25, 0.75), 1, 0, 0);
    texture_destroy(t);
}

static void any_coordinate_gives_a_finite_colour(void **state)
{
    (void)state;
    static uint8_t row[3 * 65535];
    memset(row, 200, sizeof row);
    Texture *t[4] = {picture(four, 2, 2, false), picture(four, 1, 1, false), picture(row, 65535, 1, false),
                     picture(row, 1, 65535, false)};
    static const double hard[] = {0, 1, -0.0, 1e300, -1e300, 5e-324, -5e-324, -1e-17, 0x1p53, 0x1p52 + 0.5, DBL_MAX,
                                  -DBL_MAX, INFINITY, -INFINITY, NAN, 0.99999999999999989, 1.0000000000000002};
    for (int k = 0; k < 4; k++) {
        for (size_t i = 0; i < sizeof hard / sizeof *hard; i++) {
            for (size_t j = 0; j < sizeof hard / sizeof *hard; j++) {
                Rgb c = at(t[k], hard[i], hard[j]);
                assert_true(c.r >= 0 && c.r <= 1 && c.g >= 0 && c.g <= 1 && c.b >= 0 && c.b <= 1);
                if (k == 1) assert_rgb(c, 1, 0, 0);
                if (k > 1) assert_rgb(c, 200 / 255.0, 200 / 255.0, 200 / 255.0);
            }
        }
        texture_destroy(t[k]);
    }
}

static void bytes_are_values_or_srgb(void **state)
{
    (void)state;
    static const uint8_t bytes[3] = {10, 128, 255};
    Texture *t = picture(bytes, 1, 1, false);
    assert_rgb(at(t, 0, 0), 10 / 255.0, 128 / 255.0, 1);
    texture_destroy(t);
    t = picture(bytes, 1, 1, true);
    assert_rgb(at(t, 0, 0), 0.003035270, 0.215860531, 1);
    texture_destroy(t);
}

static void faults_name_the_file(void **state)
{
    (void)state;
    Err err;
    assert_null(image_texture_load("build/none.png", false, &err));
    assert_int_equal(err.kind, ERR_INPUT);
    assert_string_equal(err.text, "can't open build/none.png: No such file or directory");
    TextureSource source = {.path = "build/none.png"};
    assert_false(texture_source_load(&source, false, &err));
    assert_null(source.loaded);
    texture_destroy(NULL);
}

static void sources_load_once(void **state)
{
    (void)state;
    texture_destroy(picture(four, 2, 2, false));  /* leaves the file */
    TextureSource source = {.path = test_path("texture.png")};
    assert_true(texture_source_load(&source, false, NULL));
    Texture *first = source.loaded;
    assert_true(texture_source_load(&source, false, NULL));
    assert_ptr_equal(source.loaded, first);
    texture_destroy(first);
}

static void bands_by_height(void **state)
{
    (void)state;
    Texture *t = height_texture_create(10);
    static const struct { double y; float r, g, b; } band[] = {
        {-5, 0, 0.6f, 0}, {4.999, 0, 0.6f, 0}, {5, 0.8588f, 0.6745f, 0.2039f}, {7.999, 0.8588f, 0.6745f, 0.2039f},
        {8, 0.7f, 0.7f, 0.7f}, {10, 0.7f, 0.7f, 0.7f}};
    for (size_t i = 0; i < sizeof band / sizeof *band; i++) {
        Rgb c = t->ops->colour(t, 0.3, 0.4, vec3_make(1, band[i].y, 2));
        assert_true(c.r == band[i].r && c.g == band[i].g && c.b == band[i].b);
    }
    texture_destroy(t);
}

/* What a material makes of the light at one point. */
static Rgb reflected(const Material *m, Rgb kd, float n_l, float r_v)
{
    Rgb share;
    const float *from[3] = {&kd.x, &kd.y, &kd.z};
    float *to[3] = {&share.x, &share.y, &share.z};
    m->ops->reflect_light(m, from, &n_l, &r_v, to, 1);
    return share;
}

static void phong(void **state)
{
    (void)state;
    Rgb kd = rgb(0.5f, 0.25f, 0), ks = rgb(0.2f, 0.4f, 0.6f);
    Material *m = phong_create(rgb(1, 1, 1), ks, 2, 0.25);
    assert_true(m->mirror == 0.25f && m->kd.r == 1);
    assert_rgb(reflected(m, kd, 0.5f, 0.5f), 0.25 + 0.05, 0.125 + 0.1, 0.15);
    assert_rgb(reflected(m, kd, 0.5f, 0), 0.25, 0.125, 0);
    assert_rgb(reflected(m, kd, 0.5f, -0.5f), 0.25, 0.125, 0);
    free(m);
    m = phong_create(kd, ks, 0, 0);
    assert_rgb(reflected(m, kd, 1, 1e-6f), 0.7, 0.65, 0.6);
    assert_rgb(reflected(m, kd, 1, -1e-6f), 0.5, 0.25, 0);
    free(m);
    static const double large[] = {1e6, 1e38, 1e300};
    for (int i = 0; i < 3; i++) {
        m = phong_create(kd, ks, large[i], 0);
        assert_rgb(reflected(m, kd, 1, 1), 0.7, 0.65, 0.6);
        assert_rgb(reflected(m, kd, 1, 1.0000001f), 0.7, 0.65, 0.6);
        assert_rgb(reflected(m, kd, 1, 0.9f), 0.5, 0.25, 0);
        free(m);
    }
}

static void assert_vec(Vec3 a, double x, double y, double z)
{
    if (fabs(a.x - x) > 1e-12 || fabs(a.y - y) > 1e-12 || fabs(a.z - z) > 1e-12)
        fail_msg("(%g, %g, %g) instead of (%g, %g, %g)", a.x, a.y, a.z, x, y, z);
}

static void waves(void **state)
{
    (void)state;
    Vec3 up = {0, 1, 0}, n = {0.3, -2, 5};
    Bump *w = wave_create(0.5, 0.25, 3, 0.125);
    assert_vec(w->ops->bend(w, 0.5, 0.25, up), 0, 1, 0);                   /* the middle itself stays */
    assert_vec(w->ops->bend(w, 0.5, 0.375, up), 0, cos(1), sin(1));        /* a whole period: 1 radian */
    assert_vec(w->ops->bend(w, 0.5, 0.3125, up), 0, cos(1), -sin(1));      /* half: -1 */
    assert_vec(w->ops->bend(w, 0.53125, 0.25, up), 0, 1, 0);               /* a quarter: 0 */
    assert_vec(w->ops->bend(w, 0.875, 0.25, up), 0, cos(1), sin(1));       /* the third period's end */
    assert_vec(w->ops->bend(w, 0.876, 0.25, up), 0, 1, 0);                 /* beyond */
    double a = cos(2 * PI * sqrt(0.03 * 0.03 + 0.04 * 0.04) / 0.125);
    assert_vec(w->ops->bend(w, 0.53, 0.21, n), 0.3, -2 * cos(a) - 5 * sin(a), -2 * sin(a) + 5 * cos(a));
    assert_vec(w->ops->bend(w, NAN, 0, n), 0.3, -2, 5);
    assert_vec(w->ops->bend(w, INFINITY, 0, n), 0.3, -2, 5);
    free(w);
    w = wave_create(0, 0, 1e300, 1e-300);
    Vec3 b = w->ops->bend(w, 1e10, 1, up);
    assert_true(isfinite(b.y) && isfinite(b.z));
    free(w);
    w = wave_create(0, 0, 0, 0.1);
    assert_vec(w->ops->bend(w, 0.01, 0, up), 0, 1, 0);
    free(w);
}

static void every_allocation_may_fail(void **state)
{
    (void)state;
    texture_destroy(picture(four, 2, 2, false));  /* leaves the file */
    const char *path = test_path("texture.png");
    for (long n = 1, failed = true; failed; n++) {
        Err err = {ERR_NONE, ""};
        alloc_fail_at(n);
        Texture *t = image_texture_load(path, false, &err);
        failed = alloc_fail_stop();
        assert_true(!failed == !!t);
        texture_destroy(t);
        if (failed) assert_int_equal(err.kind, ERR_LIMIT);
    }
    alloc_fail_at(1);
    Texture *t = height_texture_create(1);
    Material *m = phong_create(rgb(1, 1, 1), rgb(1, 1, 1), 1, 0);
    Bump *b = wave_create(0, 0, 1, 1);
    assert_true(alloc_fail_stop());
    assert_true(!t && !m && !b);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(texels_stand_at_their_centres),
        cmocka_unit_test(between_centres_colours_blend),
        cmocka_unit_test(pictures_repeat),
        cmocka_unit_test(any_coordinate_gives_a_finite_colour),
        cmocka_unit_test(bytes_are_values_or_srgb),
        cmocka_unit_test(faults_name_the_file),
        cmocka_unit_test(sources_load_once),
        cmocka_unit_test(bands_by_height),
        cmocka_unit_test(phong),
        cmocka_unit_test(waves),
        cmocka_unit_test(every_allocation_may_fail),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
