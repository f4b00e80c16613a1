/* Affine maps: exact right angles, inverses of every scale, mirrors, boxes that contain, error bounds that hold. */
#include "common/affine.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "common/numeric.h"
#include "common/rng.h"

__extension__ typedef __float128 Quad;

enum { SEED = 2024 };

static double between(Rng *rng, double lo, double hi) { return lo + (hi - lo) * rng_double(rng); }

static Vec3 random_vec(Rng *rng, double reach)
{
    double x = between(rng, -reach, reach), y = between(rng, -reach, reach);
    return vec3_make(x, y, between(rng, -reach, reach));
}

/* Scales, rotations and translations in a random order. */
static Affine random_affine(Rng *rng, int steps)
{
    Affine a = affine_identity();
    for (int i = 0; i < steps; i++) {
        double sign = rng_u32(rng) % 2 ? 1 : -1;
        Affine s = affine_scale(sign * between(rng, 0.1, 3), between(rng, 0.1, 3), between(rng, 0.1, 3));
        Affine r = affine_rotate((int)(rng_u32(rng) % 3), between(rng, -360, 360));
        Vec3 v = random_vec(rng, 5);
        Affine t = affine_translate(v.x, v.y, v.z);
        a = affine_mul(&s, &a);
        a = affine_mul(&r, &a);
        a = affine_mul(&t, &a);
    }
    return a;
}

static void assert_point(Vec3 p, double x, double y, double z)
{
    if (!(p.x == x && p.y == y && p.z == z)) fail_msg("(%g, %g, %g) instead of (%g, %g, %g)", p.x, p.y, p.z, x, y, z);
}

static void simple_maps(void **state)
{
    (void)state;
    Vec3 p = {1, 2, 3};
    Affine one = affine_identity(), s = affine_scale(2, -3, 0.5), t = affine_translate(10, 20, 30);
    assert_point(affine_point(&one, p), 1, 2, 3);
    assert_point(affine_point(&s, p), 2, -6, 1.5);
    assert_point(affine_point(&t, p), 11, 22, 33);
    assert_point(affine_vector(&t, p), 1, 2, 3);
    Affine st = affine_mul(&s, &t), ts = affine_mul(&t, &s);
    assert_point(affine_point(&st, p), 22, -66, 16.5);  /* the right one first */
    assert_point(affine_point(&ts, p), 12, 14, 31.5);
}

/* "A rotation by +90 about z takes +x to +y." Multiples of 90 degrees are exact. */
static void right_angles_are_exact(void **state)
{
    (void)state;
    Affine z = affine_rotate(2, 90), x = affine_rotate(0, 90), y = affine_rotate(1, 90);
    assert_point(affine_point(&z, vec3_make(1, 0, 0)), 0, 1, 0);
    assert_point(affine_point(&x, vec3_make(0, 1, 0)), 0, 0, 1);
    assert_point(affine_point(&y, vec3_make(0, 0, 1)), 1, 0, 0);
    for (int axis = 0; axis < 3; axis++) {
        for (int k = -9; k <= 9; k++) {
            Affine r = affine_rotate(axis, 90.0 * k);
            for (int i = 0; i < 3; i++)
                for (int j = 0; j < 3; j++) assert_true(r.m[i][j] == 0 || fabs(r.m[i][j]) == 1);
        }
        Affine many = affine_rotate(axis, 360e6 + 30), few = affine_rotate(axis, 30);
        assert_memory_equal(&many, &few, sizeof many);
    }
    Affine r = affine_rotate(2, 30);
    assert_true(fabs(r.m[1][0] - 0.5) < 2e-16 && fabs(r.m[0][0] - sqrt(0.75)) < 2e-16);
}

static void inverses(void **state)
{
    (void)state;
    Rng rng = rng_seed(SEED, 0);
    for (int i = 0; i < 5000; i++) {
        Affine a = random_affine(&rng, 3), b;
        assert_true(affine_inverse(&a, &b));
        Vec3 p = random_vec(&rng, 10), q = affine_point(&a, p), back = affine_point(&b, q);
        Vec3 error = vec3_abs(vec3_sub(back, p));
        if (vec3_max(error) > 1e-9) fail_msg("seed %d, map %d: off by %g", SEED, i, vec3_max(error));
    }
}

/* Scaling rows and columns by powers of two scales the inverse likewise, bit by bit, as far as doubles reach. */
static void inverses_lose_nothing_by_scale(void **state)
{
    (void)state;
    Rng rng = rng_seed(SEED, 1);
    for (int i = 0; i < 2000; i++) {
        Affine a = random_affine(&rng, 2), b, big, inverse;
        for (int k = 0; k < 3; k++) a.m[k][3] = 0;
        assert_true(affine_inverse(&a, &b));
        int row[3], column[3];
        for (int k = 0; k < 3; k++) {
            row[k] = (int)(rng_u32(&rng) % 400) - 200;
            column[k] = (int)(rng_u32(&rng) % 400) - 200;
        }
        big = affine_identity();
        for (int r = 0; r < 3; r++)
            for (int c = 0; c < 3; c++) big.m[r][c] = ldexp(a.m[r][c], row[r] + column[c]);
        if (!affine_inverse(&big, &inverse)) fail_msg("seed %d, map %d: no inverse", SEED, i);
        for (int r = 0; r < 3; r++) {
            for (int c = 0; c < 3; c++) {
                double expected = ldexp(b.m[r][c], -column[r] - row[c]), scale = 0;
                for (int k = 0; k < 3; k++) scale = fmax(scale, fabs(ldexp(b.m[r][k], -column[r] - row[c])));
                if (fabs(inverse.m[r][c] - expected) > 1e-10 * scale)
                    fail_msg("seed %d, map %d: %g instead of %g", SEED, i, inverse.m[r][c], expected);
            }
        }
    }
    Affine tiny = affine_scale(1e-150, 1e150, 1), back;
    assert_true(affine_inverse(&tiny, &back));
    assert_true(fabs(back.m[0][0] / 1e150 - 1) < 1e-15 && fabs(back.m[1][1] / 1e-150 - 1) < 1e-15);
}

static void what_has_no_inverse(void **state)
{
    (void)state;
    const Affine singular[] = {
        affine_scale(0, 1, 1), affine_scale(1, 1, 0), affine_scale(0, 0, 0),
        {{{1, 2, 3, 0}, {2, 4, 6, 0}, {0, 0, 1, 0}}},
        {{{1, 2, 3, 0}, {4, 5, 6, 0}, {7, 8, 9, 0}}},
        {{{0.1, 0.2, 0.3, 0}, {0.4, 0.5, 0.6, 0}, {0.7, 0.8, 0.9, 0}}},
        affine_scale(NAN, 1, 1), affine_scale(INFINITY, 1, 1), affine_scale(1e-310, 1, 1),
        affine_translate(NAN, 0, 0), affine_translate(INFINITY, 0, 0),
    };
    for (size_t i = 0; i < sizeof singular / sizeof *singular; i++) {
        Affine inverse = affine_identity(), one = affine_identity();
        if (affine_inverse(&singular[i], &inverse)) fail_msg("map %zu has an inverse", i);
        assert_memory_equal(&inverse, &one, sizeof one);
    }
}

static void powers_of_two(void **state)
{
    (void)state;
    Affine a = {{{1, 2, 3, 4}, {5, 6, 7, 8}, {9, 10, 11, 12}}}, b = affine_ldexp(&a, -3);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++) assert_true(b.m[i][j] == a.m[i][j] / 8);
}

/* Any number, subnormal ones too, by any power of two, those beyond the range of numbers too: rounded once. */
static void powers_of_two_round_as_ldexp(void **state)
{
    (void)state;
    Rng rng = rng_seed(SEED, 6);
    for (int i = 0; i < 1000000; i++) {
        uint64_t bits = (uint64_t)rng_u32(&rng) << 32 | rng_u32(&rng);
        if (i % 4 == 0) bits &= ~((uint64_t)0x7ff << 52);
        int exponent = (int)(rng_u32(&rng) % 4400) - 2200;
        Affine a = affine_identity();
        memcpy(&a.m[1][2], &bits, sizeof bits);
        if (!isfinite(a.m[1][2])) continue;
        double expected = ldexp(a.m[1][2], exponent);
        Affine b = affine_ldexp(&a, exponent);
        assert_memory_equal(&b.m[1][2], &expected, sizeof expected);
    }
}

/* The error of affine_point stays within its bound; the true image comes from quadruple precision. */
static void error_bounds_hold(void **state)
{
    (void)state;
    Rng rng = rng_seed(SEED, 3);
    for (int i = 0; i < 20000; i++) {
        Affine a = random_affine(&rng, 3);
        Vec3 p = random_vec(&rng, 100), off = random_vec(&rng, 1e-12);
        Vec3 image = affine_point(&a, p), bound = affine_point_error(&a, p, vec3_abs(off));
        const double got[3] = {image.x, image.y, image.z}, most[3] = {bound.x, bound.y, bound.z};
        for (int k = 0; k < 3; k++) {
            const double *m = a.m[k];
            Quad truth = (Quad)m[0] * ((Quad)p.x + off.x) + (Quad)m[1] * ((Quad)p.y + off.y) +
                         (Quad)m[2] * ((Quad)p.z + off.z) + m[3];
            Quad error = truth - got[k];
            if (error < 0) error = -error;
            if (error > most[k]) fail_msg("seed %d, point %d: error %g above %g", SEED, i, (double)error, most[k]);
        }
    }
}

static void boxes_contain_their_images(void **state)
{
    (void)state;
    Rng rng = rng_seed(SEED, 4);
    for (int i = 0; i < 3000; i++) {
        Affine a = random_affine(&rng, 2);
        Box box = box_add_point(box_add_point(box_empty(), random_vec(&rng, 10)), random_vec(&rng, 10));
        Box image = affine_box(&a, box), tight = box_empty();
        for (int c = 0; c < 8; c++) {
            Vec3 p = {c & 1 ? box.hi.x : box.lo.x, c & 2 ? box.hi.y : box.lo.y, c & 4 ? box.hi.z : box.lo.z};
            tight = box_add_point(tight, affine_point(&a, p));
        }
        Vec3 lo = vec3_sub(tight.lo, image.lo), hi = vec3_sub(image.hi, tight.hi);
        if (lo.x < 0 || lo.y < 0 || lo.z < 0 || hi.x < 0 || hi.y < 0 || hi.z < 0)
            fail_msg("seed %d, box %d: a corner is outside", SEED, i);
        assert_true(fmax(vec3_max(lo), vec3_max(hi)) < 1e-10);
    }
    Affine one = affine_identity();
    assert_true(box_is_empty(affine_box(&one, box_empty())));
}

/* A normal carried by the inverse stays perpendicular to the carried surface. */
static void normals_stay_perpendicular(void **state)
{
    (void)state;
    Rng rng = rng_seed(SEED, 5);
    for (int i = 0; i < 3000; i++) {
        Affine a = random_affine(&rng, 2), inverse;
        assert_true(affine_inverse(&a, &inverse));
        Vec3 u = random_vec(&rng, 1), v = random_vec(&rng, 1), n = vec3_cross(u, v);
        Vec3 carried = vec3_normalize(affine_normal(&inverse, n));
        assert_true(fabs(vec3_dot(carried, vec3_normalize(affine_vector(&a, u)))) < 1e-10);
        assert_true(fabs(vec3_dot(carried, vec3_normalize(affine_vector(&a, v)))) < 1e-10);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(simple_maps),
        cmocka_unit_test(right_angles_are_exact),
        cmocka_unit_test(inverses),
        cmocka_unit_test(inverses_lose_nothing_by_scale),
        cmocka_unit_test(what_has_no_inverse),
        cmocka_unit_test(powers_of_two),
        cmocka_unit_test(powers_of_two_round_as_ldexp),
        cmocka_unit_test(error_bounds_hold),
        cmocka_unit_test(boxes_contain_their_images),
        cmocka_unit_test(normals_stay_perpendicular),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
