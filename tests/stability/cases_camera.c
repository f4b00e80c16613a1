/* Extreme cameras: which pixel sees what, by a camera in quad. The scenes are lit by ambient light alone, each solid in a
 * colour of its own. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "common/numeric.h"
#include "stability/quad_scene.h"
#include "stability/ray_check.h"

/* Of a row's pixels, those on an edge to within roundings. */
#define UNDECIDED 0.001

enum { WIDTH = 96, HEIGHT = 72, LONG_SIDE = 65535 };

static void size_of(uint64_t number, QuadScene *s)
{
    static const uint32_t sizes[][2] = {{1, 1}, {1, LONG_SIDE}, {LONG_SIDE, 1}, {3, 300}, {500, 2}};
    bool odd = number % 8 == 7;
    const uint32_t *size = sizes[number / 8 % 5];
    s->width = odd ? size[0] : WIDTH;
    s->height = odd ? size[1] : HEIGHT;
}

static double angle(Rng *rng, uint64_t number)
{
    static const double angles[] = {1e-6, 179.999, 1e-4, 170, 90, 1e-9, 179.9999999, 40};
    double small = pow(10, uniform(rng, -6, 2));
    return number % 2 == 0 ? angles[number / 2 % 8] : number % 4 == 1 ? small : 180 - small;
}

/* Spheres and boxes about the directions of random pixels, as large as a part of the picture is there. */
static void scatter(Rng *rng, QuadScene *s)
{
    Vec3 forward = vec3_normalize(vec3_make(s->view[0], s->view[1], s->view[2]));
    Vec3 up = vec3_make(s->up[0], s->up[1], s->up[2]), eye = vec3_make(s->eye[0], s->eye[1], s->eye[2]);
    Vec3 right = vec3_normalize(vec3_cross(forward, vec3_normalize(up)));
    double half = tan(s->fov_deg * (M_PI / 360)), wide = half * s->width / s->height;
    up = vec3_cross(right, forward);
    s->solids = 6;
    for (int i = 0; i < s->solids; i++) {
        Vec3 d = vec3_at(forward, uniform(rng, -1, 1) * half, up);
        d = vec3_at(d, uniform(rng, -1, 1) * wide, right);
        double length = vec3_length(d), distance = uniform(rng, 2, 20);
        double r = distance * fmin(fmax(half, wide) / length, 0.8) * uniform(rng, 0.1, 0.6);
        Vec3 c = vec3_at(eye, distance / length, d);
        s->solid[i] = i % 2 ? quad_sphere(c.x, c.y, c.z, r) : quad_box(c.x - r, c.y - r, c.z - r, 2 * r, 2 * r, 2 * r);
        for (int k = 0; k < 3; k++) s->solid[i].kd[k] = uniform(rng, 0.2, 1);
    }
}

static QuadScene camera(Rng *rng, uint64_t number)
{
    QuadScene s = {.ambient = {1, 1, 1}, .background = {0, 0, 0}, .max_depth = 0};
    size_of(number, &s);
    s.fov_deg = angle(rng, number);
    quad_set_vec(s.eye, vec3_scale(random_direction(rng), uniform(rng, 0, 2)));
    quad_set_vec(s.view, vec3_scale(random_direction(rng), pow(10, uniform(rng, -3, 3))));
    quad_set_vec(s.up, vec3_scale(random_direction(rng), pow(10, uniform(rng, -3, 3))));
    return s;
}

/* What is roundings' due: places up to 32 have spacings of 2^-48, a direction is off by 16 roundings of its greatest part. */
static void allow(QuadScene *s)
{
    double half = tan(s->fov_deg * (M_PI / 360));
    s->slack = QUAD_SPACINGS * 0x1p-48;
    s->turn = 16 * UNIT_ROUNDOFF * fmax(1, half * fmax(1, (double)s->width / s->height));
}

static void fields_of_view(Row *row, uint64_t trials)
{
    Rng rng = rng_seed(41, 1);
    uint64_t undecided = 0;
    for (uint64_t i = 0; row->trials < trials; i++) {
        QuadScene s = camera(&rng, i);
        scatter(&rng, &s);
        allow(&s);
        char what[100];
        snprintf(what, sizeof what, "picture %llu, fov %.10g, %u x %u", (unsigned long long)i, s.fov_deg, s.width, s.height);
        quad_scene_check(row, &s, &undecided, what);
    }
    quad_scene_decided(row, undecided, UNDECIDED);
}

/* Up is view times a number, and 10^-k across it, k = 0 ... 17: an image as long as the angle is more than roundings of the
 * script's numbers are, the error that they are parallel where it is less. */
static void up_near_view(Row *row, uint64_t trials)
{
    Rng rng = rng_seed(41, 2);
    uint64_t undecided = 0;
    for (uint64_t i = 0; row->trials < trials; i++) {
        QuadScene s = camera(&rng, 0);
        s.width = WIDTH;
        s.height = HEIGHT;
        s.fov_deg = uniform(&rng, 5, 100);
        Vec3 view = vec3_make(s.view[0], s.view[1], s.view[2]);
        Vec3 across = vec3_normalize(vec3_cross(view, random_direction(&rng)));
        double k = i % 18 == 17 ? INFINITY : (double)(i % 18);
        Vec3 up = vec3_at(view, pow(10, -k) * vec3_length(view), across);
        quad_set_vec(s.up, vec3_scale(up, ldexp(i % 2 ? 1 : -1, (int)(i % 40))));
        scatter(&rng, &s);
        allow(&s);
        char what[100];
        snprintf(what, sizeof what, "picture %llu, up 1e-%g from view", (unsigned long long)i, k);
        Picture picture = quad_scene_picture(&s);
        if (k > 14 && !picture.rgb)
            row_trial(row, strstr(picture.err.text, "stability_quad.lua:") && strstr(picture.err.text, ": up is parallel to view"),
                      "%s: %s", what, picture.err.text);
        else if (k > 15)
            row_trial(row, false, "%s: no error", what);
        else
            undecided += quad_scene_compare(row, &s, &picture, what);
        picture_free(&picture);
    }
    quad_scene_decided(row, undecided, UNDECIDED);
}

/* A sphere that nearly fills the picture from 1e2 to 1e12 radii away. The eye's coordinates are the largest. */
static void sphere_from_afar(Row *row, uint64_t trials)
{
    Rng rng = rng_seed(1, 1);
    uint64_t undecided = 0;
    for (uint64_t i = 0; row->trials < trials; i++) {
        double far = pow(10, 2 + (double)(i % 11)), radius = pow(2, uniform(&rng, -20, 20)), distance = far * radius;
        QuadScene s = {.solids = 1, .ambient = {1, 1, 1}, .width = WIDTH, .height = HEIGHT};
        s.solid[0] = quad_sphere(0, 0, 0, radius);
        quad_set_vec(s.eye, vec3_scale(random_direction(&rng), distance));
        quad_set_vec(s.up, random_direction(&rng));
        quad_look_at(&s, vec3_make(0, 0, 0));
        s.fov_deg = atan(uniform(&rng, 1.1, 2) / far) * (360 / M_PI);
        s.slack = QUAD_SPACINGS * ldexp(1, ilogb(distance) - 52);
        s.turn = 16 * UNIT_ROUNDOFF;
        char what[100];
        snprintf(what, sizeof what, "picture %llu, from 1e%g radii", (unsigned long long)i, log10(far));
        quad_scene_check(row, &s, &undecided, what);
    }
    quad_scene_decided(row, undecided, UNDECIDED);
}

#define PICTURES(n) ((uint64_t)(n) * WIDTH * HEIGHT)

const StabilityCase camera_cases[] = {
    {1, "the same in pictures", "quad", "", PICTURES(11), PICTURES(154), PICTURES(1540), sphere_from_afar},
    {41, "fov 1e-9 ... 179.9999999, 1 x 1, 1 x 65,535", "quad", "", PICTURES(16), PICTURES(200), PICTURES(2000),
     fields_of_view},
    {41, "up nearly parallel to view", "quad", "", PICTURES(17), PICTURES(150), PICTURES(1500), up_near_view},
    {0},
};
