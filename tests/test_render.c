/* What SPEC 5 says about colours, by hand for single pixels; and what never changes a picture: threads, crops. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "node/primitive/primitive.h"
#include "support/world_fixture.h"

static uint8_t level(double c) { return (uint8_t)(fmin(fmax(c, 0), 1) * 255 + 0.5); }

/* Off by one level: the product of the hand computation may round the other way. */
static void assert_pixel(const uint8_t *rgb, uint32_t x, uint32_t y, uint32_t width, double r, double g, double b)
{
    const uint8_t *p = rgb + 3 * ((size_t)y * width + x);
    const double want[3] = {r, g, b};
    for (int k = 0; k < 3; k++)
        if (abs(p[k] - level(want[k])) > 1)
            fail_msg("pixel %u,%u channel %d: %d, not %d", x, y, k, p[k], level(want[k]));
}

/* A picture of odd size, so that the middle pixel's centre is on the axis. */
static void odd(WorldFixture *f)
{
    f->job.width = 63;
    f->job.height = 47;
}

static void background_gradient(void **state)
{
    (void)state;
    WorldFixture f;
    fixture_create(&f);
    assert_true(fixture_compile(&f));
    RenderSettings s = fixture_settings(&f);
    s.has_background = false;
    uint8_t *rgb = fixture_render(&f, &s, NULL);
    assert_pixel(rgb, 5, 0, 64, 0.5, 0.3, 1 - 47.0 / 48);
    assert_pixel(rgb, 5, 47, 64, 0.5, 0.3, 1);
    free(rgb);
    fixture_destroy(&f);
}

static void phong_by_hand(void **state)
{
    (void)state;
    WorldFixture f;
    fixture_create(&f);
    odd(&f);
    fixture_prim(&f, NULL, sphere_create(), rgb(0.5f, 0.4f, 0.2f), rgb(0.3f, 0.3f, 0.3f), 10, 0);
    f.job.ambient = rgb(0.1f, 0.2f, 0.3f);
    /* At (0,0,1), n = v = z; the light comes at 45 degrees from a distance of sqrt(32). */
    fixture_light(&f, vec3_make(4, 0, 5), rgb(0.9f, 0.8f, 0.7f), 1, 0.01, 0.002);
    assert_true(fixture_compile(&f));
    RenderSettings s = fixture_settings(&f);
    uint8_t *rgb8 = fixture_render(&f, &s, NULL);
    double d = sqrt(32), fall = 1 + 0.01 * d + 0.002 * d * d, c = sqrt(0.5), spec = 0.3 * pow(c, 10);
    assert_pixel(rgb8, 31, 23, 63, 0.1 * 0.5 + (0.5 * c + spec) * 0.9 / fall, 0.2 * 0.4 + (0.4 * c + spec) * 0.8 / fall,
                 0.3 * 0.2 + (0.2 * c + spec) * 0.7 / fall);
    free(rgb8);
    fixture_destroy(&f);
}

static void shadows_end_at_the_light(void **state)
{
    (void)state;
    for (int beyond = 0; beyond < 2; beyond++) {
        WorldFixture f;
        fixture_create(&f);
        odd(&f);
        fixture_prim(&f, NULL, sphere_create(), rgb(1, 1, 1), rgb(0, 0, 0), 1, 0);
        Node *blocker = fixture_prim(&f, NULL, sphere_create(), rgb(1, 1, 1), rgb(0, 0, 0), 1, 0);
        Affine place = affine_translate(beyond ? 6 : 3, 0, beyond ? 7 : 4);
        Affine small = affine_scale(0.5, 0.5, 0.5);
        node_transform(blocker, &small, false);
        node_transform(blocker, &place, false);
        fixture_light(&f, vec3_make(4, 0, 5), rgb(0.5f, 0.5f, 0.5f), 1, 0, 0);
        assert_true(fixture_compile(&f));
        RenderSettings s = fixture_settings(&f);
        uint8_t *rgb8 = fixture_render(&f, &s, NULL);
        double c = beyond ? 0.5 * sqrt(0.5) : 0;
        assert_pixel(rgb8, 31, 23, 63, c, c, c);
        free(rgb8);
        fixture_destroy(&f);
    }
}

/* Two parallel mirrors of share r and ambient colour a: after k bounces the sum (1-r) a (1 + r + ... ) + r^k a = a, so
 * the colours are told apart by giving the far wall another one. */
static void mirrors_sum_geometrically(void **state)
{
    (void)state;
    for (uint32_t depth = 0; depth <= 50; depth += 5) {
        WorldFixture f;
        fixture_create(&f);
        odd(&f);
        f.job.ambient = rgb(1, 1, 1);
        f.job.eye = vec3_make(0, 0, 0.5);
        const Rgb colour[2] = {{{0.8f, 0, 0}}, {{0, 0.6f, 0}}};
        for (int i = 0; i < 2; i++) {
            Node *wall = fixture_prim(&f, NULL, cube_create(), colour[i], rgb(0, 0, 0), 1, 0.5);
            Affine size = affine_scale(100, 100, 1), place = affine_translate(-50, -50, i ? 1 : -1);
            node_transform(wall, &size, false);
            node_transform(wall, &place, false);
        }
        assert_true(fixture_compile(&f));
        RenderSettings s = fixture_settings(&f);
        s.max_depth = depth;
        uint8_t *rgb8 = fixture_render(&f, &s, NULL);
        double want[2] = {0, 0}, weight = 1;
        for (uint32_t k = 0; k < depth; k++, weight *= 0.5) want[k % 2] += weight * 0.5 * (k % 2 ? 0.6 : 0.8);
        want[depth % 2] += weight * (depth % 2 ? 0.6 : 0.8);
        assert_pixel(rgb8, 31, 23, 63, want[0], want[1], 0);
        free(rgb8);
        fixture_destroy(&f);
    }
}

static void mirror_that_misses_keeps_its_colour(void **state)
{
    (void)state;
    WorldFixture f;
    fixture_create(&f);
    odd(&f);
    f.job.ambient = rgb(1, 1, 1);
    fixture_prim(&f, NULL, sphere_create(), rgb(0.2f, 0.4f, 0.6f), rgb(0, 0, 0), 1, 1);
    assert_true(fixture_compile(&f));
    RenderSettings s = fixture_settings(&f);
    s.background = rgb(1, 0, 0);
    RenderStats stats;
    uint8_t *rgb8 = fixture_render(&f, &s, &stats);
    assert_pixel(rgb8, 31, 23, 63, 0.2, 0.4, 0.6);
    assert_true(stats.mirror_rays > 0);
    assert_int_equal(stats.camera_rays, 63 * 47);
    free(rgb8);
    fixture_destroy(&f);
}

/* A scene with everything that the shading loop branches on. */
static void busy(WorldFixture *f)
{
    fixture_create(f);
    f->job.ambient = rgb(0.2f, 0.2f, 0.2f);
    for (int i = 0; i < 9; i++) {
        Prim *prim = i % 3 == 0 ? sphere_create() : i % 3 == 1 ? cylinder_create() : torus_create(0.3);
        Node *n = fixture_prim(f, NULL, prim, rgb(0.1f * (float)i, 0.5f, 0.9f), rgb(0.5f, 0.5f, 0.5f), 20, i % 2 ? 0.4 : 0);
        Affine turn = affine_rotate(i % 3, 20 * i), place = affine_translate(2.2 * (i % 3 - 1), 2.2 * (i / 3 - 1), -i);
        node_transform(n, &turn, false);
        node_transform(n, &place, false);
    }
    fixture_light(f, vec3_make(10, 20, 30), rgb(0.7f, 0.7f, 0.7f), 1, 0, 0);
    fixture_light(f, vec3_make(-20, 5, 8), rgb(0.3f, 0.3f, 0.3f), 1, 0, 0);
    assert_true(fixture_compile(f));
}

static const FilmFormat formats[] = {FILM_8, FILM_16, FILM_FLOAT};

static void threads_change_nothing(void **state)
{
    (void)state;
    WorldFixture f;
    busy(&f);
    RenderSettings s = fixture_settings(&f);
    s.samples = 5;
    for (int k = 0; k < 3; k++) {
        s.format = formats[k];
        s.threads = 1;
        uint8_t *one = fixture_render(&f, &s, NULL);
        const uint32_t threads[] = {2, 7, 16};
        for (int i = 0; i < 3; i++) {
            s.threads = threads[i];
            uint8_t *more = fixture_render(&f, &s, NULL);
            assert_memory_equal(one, more, film_pixel_bytes(s.format) * 64 * 48);
            free(more);
        }
        free(one);
    }
    fixture_destroy(&f);
}

static void crop_is_part_of_the_whole(void **state)
{
    (void)state;
    WorldFixture f;
    busy(&f);
    for (int k = 0; k < 3; k++) {
        RenderSettings s = fixture_settings(&f);
        s.samples = 3;
        s.format = formats[k];
        uint8_t *whole = fixture_render(&f, &s, NULL);
        s.x0 = 13;
        s.y0 = 5;
        s.x1 = 50;
        s.y1 = 41;
        uint8_t *part = fixture_render(&f, &s, NULL);
        size_t bytes = film_pixel_bytes(s.format), row = bytes * (s.x1 - s.x0);
        for (uint32_t y = s.y0; y < s.y1; y++)
            assert_memory_equal(part + (y - s.y0) * row, whole + bytes * (y * 64 + s.x0), row);
        free(whole);
        free(part);
    }
    fixture_destroy(&f);
}

/* The three formats hold the same colours, each to half its step, with sRGB (that floats don't have) or without. */
static void formats_agree(void **state)
{
    (void)state;
    WorldFixture f;
    busy(&f);
    fixture_light(&f, vec3_make(0, 0, 30), rgb(3, 3, 3), 1, 0, 0);
    assert_true(fixture_compile(&f));
    RenderSettings s = fixture_settings(&f);
    s.samples = 4;
    s.background = rgb(-0.5f, 2, 0.25f);
    size_t above = 0;
    for (int srgb = 0; srgb < 2; srgb++) {
        uint8_t *film[3];
        s.srgb = srgb;
        for (int k = 0; k < 3; k++) {
            s.format = formats[k];
            film[k] = fixture_render(&f, &s, NULL);
        }
        for (size_t i = 0; i < 3 * 64 * 48; i++) {
            float x;
            memcpy(&x, film[2] + i * sizeof x, sizeof x);
            above += x > 1.5f;
            double c = fmin(fmax((double)x, 0), 1);
            if (srgb) c = srgb_encode(c);
            assert_true(fabs(film[0][i] - 255 * c) < 0.5 + 1e-4);
            assert_true(fabs((film[1][2 * i] << 8 | film[1][2 * i + 1]) - 65535 * c) < 0.5 + 0.05);
        }
        for (int k = 0; k < 3; k++) free(film[k]);
    }
    assert_true(above > 2000);  /* floats aren't clamped */
    fixture_destroy(&f);
}

/* Scaling the scene by a power of two, lights and falloffs along, is the same picture (NUMERICS 7). */
static void power_of_two_scale_changes_nothing(void **state)
{
    (void)state;
    WorldFixture f;
    busy(&f);
    RenderSettings s = fixture_settings(&f);
    uint8_t *one = fixture_render(&f, &s, NULL);
    const int exponents[] = {-300, -40, 3, 300};
    for (int i = 0; i < 4; i++) {
        WorldFixture g;
        busy(&g);
        double k = ldexp(1, exponents[i]);
        Affine scale = affine_scale(k, k, k);
        node_transform(g.root, &scale, false);
        g.job.eye = vec3_scale(g.job.eye, k);
        for (uint32_t j = 0; j < g.job.light_count; j++) g.light[j].position = vec3_scale(g.light[j].position, k);
        assert_true(fixture_compile(&g));
        uint8_t *scaled = fixture_render(&g, &s, NULL);
        assert_memory_equal(one, scaled, 3 * 64 * 48);
        free(scaled);
        fixture_destroy(&g);
    }
    free(one);
    fixture_destroy(&f);
}

/* A light without a number, which no script can make, gives no number where it shines: those samples are counted and the
 * first is named, from however many threads. */
static void what_is_no_number_is_counted(void **state)
{
    (void)state;
    WorldFixture f;
    fixture_create(&f);
    odd(&f);
    fixture_prim(&f, NULL, sphere_create(), rgb(1, 1, 1), rgb(0, 0, 0), 1, 0);
    f.job.ambient = rgb(0.5f, 0.5f, 0.5f);
    fixture_light(&f, vec3_make(0, 0, 10), rgb(NAN, 0, 0), 1, 0, 0);
    assert_true(fixture_compile(&f));
    RenderSettings s = fixture_settings(&f);
    s.samples = 2;
    for (s.threads = 1; s.threads <= 4; s.threads += 3) {
        RenderStats stats;
        uint8_t *rgb8 = fixture_render(&f, &s, &stats);
        assert_true(stats.not_finite > 100);
        uint32_t first = 0;  /* the first pixel of the sphere: half of it black where one sample has no number */
        while (rgb8[3 * first + 1] == 0 && first < stats.first_y * 63 + stats.first_x) first++;
        assert_int_equal(first, stats.first_y * 63 + stats.first_x);
        assert_true(stats.first_y > 10 && stats.first_y < 23 && stats.first_sample < 2);
        assert_pixel(rgb8, 31, 23, 63, 0, 0, 0);
        free(rgb8);
        /* drawn alone it is the same */
        RenderSettings one = s;
        one.x0 = stats.first_x, one.x1 = stats.first_x + 1, one.y0 = stats.first_y, one.y1 = stats.first_y + 1;
        RenderStats alone;
        free(fixture_render(&f, &one, &alone));
        assert_true(alone.not_finite > 0);
        assert_int_equal(alone.first_sample, stats.first_sample);
    }
    fixture_destroy(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(background_gradient),
        cmocka_unit_test(phong_by_hand),
        cmocka_unit_test(shadows_end_at_the_light),
        cmocka_unit_test(mirrors_sum_geometrically),
        cmocka_unit_test(mirror_that_misses_keeps_its_colour),
        cmocka_unit_test(threads_change_nothing),
        cmocka_unit_test(crop_is_part_of_the_whole),
        cmocka_unit_test(formats_agree),
        cmocka_unit_test(power_of_two_scale_changes_nothing),
        cmocka_unit_test(what_is_no_number_is_counted),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
