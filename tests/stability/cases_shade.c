/* Light, shadow and mirrors: pictures against SPEC 5 in quad. */
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "stability/quad_scene.h"
#include "stability/ray_check.h"

enum { WIDTH = 96, HEIGHT = 72, CAVITY_WIDTH = 32, CAVITY_HEIGHT = 24 };

/* Of a row's pixels, those on an edge to within roundings. */
#define UNDECIDED 0.001

/* A floor whose top is y = 0, a sphere over it, and a smaller one. */
static QuadScene ball_on_floor(Rng *rng)
{
    QuadScene s = {.solids = 3, .ambient = {0.02, 0.02, 0.02}, .background = {0, 0, 0.5}, .up = {0, 1, 0},
                   .fov_deg = 40, .width = WIDTH, .height = HEIGHT, .max_depth = 4, .slack = QUAD_SPACINGS * 0x1p-49};
    double r = uniform(rng, 0.5, 1.5);
    s.solid[0] = quad_box(-6, -1, -6, 12, 1, 12);
    s.solid[1] = quad_sphere(uniform(rng, -1, 1), r + uniform(rng, 0, 0.5), uniform(rng, -1, 1), r);
    s.solid[2] = quad_sphere(uniform(rng, -3, 3), 0.25, uniform(rng, 1.5, 4), 0.25);
    s.solid[0].making = rng_u32(rng) % 3;
    s.solid[1].making = rng_u32(rng) % 2 ? MADE_PLAIN : MADE_CSG;
    quad_set3(s.eye, uniform(rng, -4, 4), uniform(rng, 0.5, 5), uniform(rng, 5, 7));
    return s;
}

static Vec3 centre(const QuadSolid *s) { return vec3_make(s->at[0], s->at[1], s->at[2]); }

static uint64_t pictures(uint64_t trials) { return (trials + WIDTH * HEIGHT - 1) / (WIDTH * HEIGHT); }

/* The camera looks from outside at a point of the sphere where the light grazes it. Light of up to 1e10 makes a cosine of
 * 1e-10 a bright pixel, so that a speck in the shade or in the light shows however grazing it is. */
static void terminator(Row *row, uint64_t trials)
{
    Rng rng = rng_seed(36, 1);
    uint64_t undecided = 0;
    for (uint64_t i = 0, n = pictures(trials); i < n; i++) {
        QuadScene s = ball_on_floor(&rng);
        const QuadSolid *ball = &s.solid[1];
        Vec3 toward = random_direction(&rng);
        if (toward.y < 0) toward.y = -toward.y;
        double r = ball->size[0], far = uniform(&rng, 2, 8), brightness = pow(10, uniform(&rng, 0, 10));
        Vec3 light = vec3_at(centre(ball), r + far, toward);
        quad_add_light(&s, light, brightness, 1, 0, 0);
        /* n with n.(light - p) = 0: the light's cosine at the centre is r / distance. */
        Vec3 side = vec3_normalize(vec3_cross(toward, random_direction(&rng)));
        double cosine = r / (r + far), sine = sqrt(1 - cosine * cosine);
        Vec3 normal = vec3_add(vec3_scale(toward, cosine), vec3_scale(side, sine));
        Vec3 p = vec3_at(centre(ball), r, normal);
        Vec3 off = vec3_normalize(vec3_add(normal, vec3_scale(random_direction(&rng), 0.7)));
        quad_set_vec(s.eye, vec3_at(p, uniform(&rng, 0.5, 5), off));
        if (s.eye[1] < 0.01) s.eye[1] = 0.01;
        quad_look_at(&s, p);
        s.fov_deg = pow(10, uniform(&rng, -4, 1.7));
        s.turn = s.slack;
        char what[100];
        snprintf(what, sizeof what, "picture %llu, light %.1e, fov %.1e", (unsigned long long)i, brightness, s.fov_deg);
        quad_scene_check(row, &s, &undecided, what);
    }
    quad_scene_decided(row, undecided, UNDECIDED);
}

/* A light on a surface lights what it sees from there, one inside a solid lights nothing outside. */
static void light_in_odd_place(Row *row, uint64_t trials)
{
    Rng rng = rng_seed(36, 2);
    uint64_t undecided = 0;
    for (uint64_t i = 0, n = pictures(trials); i < n; i++) {
        QuadScene s = ball_on_floor(&rng);
        const QuadSolid *ball = &s.solid[1];
        double r = ball->size[0];
        static const char *const places[] = {"on top of the ball", "on the ball", "on the floor", "in the ball",
                                             "in the floor", "at the ball's centre"};
        Vec3 on = random_direction(&rng), c = centre(ball);
        Vec3 at = i % 6 == 0 ? vec3_make(c.x, c.y + r, c.z)
                  : i % 6 == 1 ? vec3_at(c, r, on)
                  : i % 6 == 2 ? vec3_make(uniform(&rng, -3, 3), 0, uniform(&rng, 1, 5))
                  : i % 6 == 3 ? vec3_at(c, r * uniform(&rng, 0.1, 0.999), on)
                  : i % 6 == 4 ? vec3_make(on.x, -0.5 + on.y * 0.4, on.z)
                               : c;
        quad_add_light(&s, at, 1, uniform(&rng, 0.5, 1), 0, uniform(&rng, 0, 0.1));
        quad_look_at(&s, vec3_add(c, vec3_scale(random_direction(&rng), 0.3)));
        s.turn = s.slack;
        char what[100];
        snprintf(what, sizeof what, "picture %llu, light %s", (unsigned long long)i, places[i % 6]);
        quad_scene_check(row, &s, &undecided, what);
    }
    quad_scene_decided(row, undecided, UNDECIDED);
}

/* A light 10^-12 ... 10^-3 above the floor or the ball, and one 10^3 ... 10^250 away. */
static void light_near_or_far(Row *row, uint64_t trials)
{
    Rng rng = rng_seed(36, 3);
    uint64_t undecided = 0;
    for (uint64_t i = 0, n = pictures(trials); i < n; i++) {
        QuadScene s = ball_on_floor(&rng);
        const QuadSolid *ball = &s.solid[1];
        double height = pow(10, i == 0 ? -12 : uniform(&rng, -12, -3));
        double far = pow(10, i == 2 ? 12 : i % 6 < 3 ? uniform(&rng, 3, 12) : uniform(&rng, 12, 250));
        Vec3 on = random_direction(&rng);
        if (on.y < 0) on.y = -on.y;
        if (i % 3 == 0)
            quad_add_light(&s, vec3_make(uniform(&rng, -2, 2), height, uniform(&rng, 1, 4)), 0.01 / height, 1, 0, 0);
        else if (i % 3 == 1)
            quad_add_light(&s, vec3_at(centre(ball), ball->size[0] + height, on), 1, 0, 0, i % 2 ? 1 : 0.001);
        else
            quad_add_light(&s, vec3_scale(on, far), 1, 1, i % 2 ? 0 : 1 / far, 0);
        quad_look_at(&s, centre(ball));
        s.turn = s.slack;
        char what[100];
        snprintf(what, sizeof what, "picture %llu, light %.1e %s", (unsigned long long)i, i % 3 == 2 ? far : height,
                 i % 3 == 2 ? "away" : "off");
        quad_scene_check(row, &s, &undecided, what);
    }
    quad_scene_decided(row, undecided, UNDECIDED);
}

/* ---- mirrors ---- */

/* Two walls that face each other, of share r and colours A and B, the eye between them looking square at A. What it must
 * see is the sum over k < depth of (1 - r) r^k I_k, and r^depth I_depth, I alternating between A and B. */
static void parallel_mirrors(Row *row, uint64_t trials)
{
    Rng rng = rng_seed(37, 1);
    for (uint64_t i = 0; i < trials / 64; i++) {
        double r = i % 8 == 0 ? 1 : i % 8 == 1 ? 0x1.ffffffp-1 : uniform(&rng, 0, 1);
        QuadScene s = {.solids = 2, .ambient = {1, 1, 1}, .background = {1, 0, 1}, .eye = {0, 0, 0}, .view = {1, 0, 0},
                       .up = {0, 1, 0}, .fov_deg = 1, .width = 8, .height = 8,
                       .max_depth = i % 2 ? 50 : rng_u32(&rng) % 51};
        s.solid[0] = quad_box(uniform(&rng, 1, 9), -1e6, -1e6, 1, 2e6, 2e6);
        s.solid[1] = quad_box(-uniform(&rng, 2, 9), -1e6, -1e6, 1, 2e6, 2e6);
        for (int k = 0; k < 3; k++) {
            s.solid[0].kd[k] = uniform(&rng, 0, 1);
            s.solid[1].kd[k] = uniform(&rng, 0, 1);
        }
        s.solid[0].mirror = s.solid[1].mirror = r;
        Picture picture = quad_scene_picture(&s);
        Quad share = (Quad)(float)r, sum[3] = {0, 0, 0}, weight = 1;
        for (uint32_t k = 0; k <= s.max_depth; k++, weight *= share)
            for (int j = 0; j < 3; j++)
                sum[j] += s.solid[k % 2].kd[j] * weight * (k < s.max_depth ? 1 - share : 1);
        for (uint32_t p = 0; p < s.width * s.height; p++) {
            const uint8_t *rgb = picture.rgb ? picture.rgb + 3 * p : NULL;
            bool ok = rgb;
            for (int j = 0; ok && j < 3; j++) ok = fabs(rgb[j] - 255 * (double)sum[j]) <= 0.5 + 255 * 0x1p-18;
            row_trial(row, ok, "share %.9g, depth %u, pixel %u: %d, not %.4f %s", r, s.max_depth, p, rgb ? rgb[0] : -1,
                      255 * (double)sum[0], picture.err.text);
        }
        picture_free(&picture);
    }
}

/* A room of mirrors, and a sphere of mirror, seen and lit from inside: no ray ever leaves. */
static void mirror_cavity(Row *row, uint64_t trials)
{
    Rng rng = rng_seed(37, 2);
    uint64_t undecided = 0;
    for (uint64_t i = 0; row->trials < trials; i++) {
        QuadScene s = {.solids = 1, .ambient = {0.3, 0.3, 0.3}, .background = {1, 0, 1}, .up = {0, 1, 0},
                       .fov_deg = uniform(&rng, 10, 120), .width = CAVITY_WIDTH, .height = CAVITY_HEIGHT,
                       .max_depth = i % 8 < 2 ? 50 : rng_u32(&rng) % 16,
                       .slack = QUAD_SPACINGS * 0x1p-50};
        bool room = i % 2 == 0;
        if (room) {
            s.solids = 6;
            for (int side = 0; side < 6; side++) {
                double at[3] = {-3, -3, -3}, size[3] = {6, 6, 6};
                at[side / 2] = side % 2 ? 2 : -3;
                size[side / 2] = 1;
                s.solid[side] = quad_box(at[0], at[1], at[2], size[0], size[1], size[2]);
                for (int k = 0; k < 3; k++) s.solid[side].kd[k] = uniform(&rng, 0, 1);
            }
        } else {
            s.solid[0] = quad_sphere(0, 0, 0, 2);
        }
        double mirror = i % 3 < 2 ? uniform(&rng, 0.8, 1) : 1;
        for (int k = 0; k < s.solids; k++) s.solid[k].mirror = (float)mirror;
        quad_set_vec(s.eye, vec3_scale(random_direction(&rng), 1.5));
        quad_set_vec(s.view, random_direction(&rng));
        quad_add_light(&s, vec3_scale(random_direction(&rng), 1), 0.7, 0.5, 0, 0.1);
        /* What is off by the slack at first is off by 100 times that after 50 mirrors. */
        s.slack *= 100;
        s.turn = s.slack;
        char what[100];
        snprintf(what, sizeof what, "picture %llu, %s, share %.6g", (unsigned long long)i, room ? "room" : "sphere", mirror);
        quad_scene_check(row, &s, &undecided, what);
    }
    quad_scene_decided(row, undecided, UNDECIDED);
}

#define PICTURES(n) ((uint64_t)(n) * WIDTH * HEIGHT)

const StabilityCase shade_cases[] = {
    {36, "shadow terminator at grazing light", "quad", "", PICTURES(8), PICTURES(150), PICTURES(1500), terminator},
    {36, "light on a surface, inside a solid", "quad", "", PICTURES(12), PICTURES(150), PICTURES(1500),
     light_in_odd_place},
    {36, "light 1e-12 off a surface, 1e3 ... 1e250 away", "quad", "", PICTURES(12), PICTURES(150), PICTURES(1500),
     light_near_or_far},
    {37, "two parallel mirrors, depth to 50", "analytic", "", 64 * 250, 64 * 15625, 64 * 100000, parallel_mirrors},
    {37, "room of mirrors, sphere of mirror, depth 50", "quad", "", 3000, 1000000, 10000000,
     mirror_cavity},
    {0},
};
