/* A scene that is moved 1e9 ... 1e15 from the origin: it may be off by the spacing of the numbers there, no more, and the
 * program says when that shows. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "accel/accel.h"
#include "common/arena.h"
#include "stability/quad_scene.h"
#include "stability/ray_check.h"
#include "support/check.h"
#include "support/world_fixture.h"

enum { WIDTH = 96, HEIGHT = 72 };

static double spacing_at(double x) { return ldexp(1, ilogb(x) - 52); }

static double far_away(Rng *rng) { return pow(10, uniform(rng, 9, 15)) * (rng_u32(rng) % 2 ? 1 : -1); }

/* ---- hits ---- */

typedef struct {
    Prim *(*create)(void);
    OracleTruth *truth;
    OracleDistance *distance;
} Shape;

enum { TORUS_MINOR_EIGHTHS = 3 };

static Prim *create_torus(void) { return torus_create(TORUS_MINOR_EIGHTHS / 8.0); }

static const Shape shapes[] = {
    {sphere_create, sphere_truth, sphere_distance},       {cube_create, cube_truth, cube_distance},
    {cylinder_create, cylinder_truth, cylinder_distance}, {cone_create, cone_truth, cone_distance},
    {create_torus, torus_truth, torus_distance},
};

/* The ray in the object's own space: places are multiples of one spacing and differ by little, sizes powers of two, so
 * nothing is rounded. */
static Ray own_ray(Vec3 o, Vec3 d, Vec3 place, double size)
{
    return (Ray){vec3_scale(vec3_sub(o, place), 1 / size), vec3_scale(d, 1 / size), 0, INFINITY};
}

/* Whether the line of a ray gives the program's answer: a miss, or a first crossing that is nearer to t than the next. */
static bool gives(const Shape *shape, const Ray *ray, bool hits, double t)
{
    Truth truth;
    shape->truth(TORUS_MINOR_EIGHTHS / 8.0, ray, &truth);
    int first = 0;
    while (first < truth.n && truth.t[first] <= 0) first++;
    if (first == truth.n) return !hits;
    return hits && (first + 1 >= truth.n || q_abs(t - truth.t[first]) <= q_abs(t - truth.t[first + 1]));
}

/* Whether the true line, or one moved by `allowed` in one of 26 directions, does. */
static bool nearly_gives(const Shape *shape, const Ray *ray, bool hits, double t, double allowed)
{
    if (gives(shape, ray, hits, t)) return true;
    for (int k = 0; k < 27; k++) {
        Vec3 way = vec3_make(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
        Ray moved = *ray;
        if (k == 13) continue;
        moved.o = vec3_at(ray->o, allowed / vec3_length(way), way);
        if (gives(shape, &moved, hits, t)) return true;
    }
    return false;
}

/* The program's hit lies on the true surface, and its answer is that of a line as near as 20 spacings allow. */
static void judge(Row *row, const Shape *shape, const Ray *own, const Hit *hit, double allowed, uint64_t seed)
{
    bool hits = hit->object != HIT_NONE, near = nearly_gives(shape, own, hits, hits ? hit->t : 0, allowed);
    Quad off = 0;
    if (hits) {
        Surface s = {.p = vec3_at(own->o, hit->t, own->d)};
        off = shape->distance(TORUS_MINOR_EIGHTHS / 8.0, &s, hit->part);
    }
    row_trial(row, near && off <= allowed, "seed %llu: %s, %g off the surface%s; %g is allowed", (unsigned long long)seed,
              hits ? "hit" : "missed", (double)off, near ? "" : ", not the answer of any line so near", allowed);
}

enum { RAYS = 256 };

static void shoot(Row *row, Rng *rng, const Shape *shape, uint64_t seed, Scratch *scratch)
{
    WorldFixture f;
    fixture_create(&f);
    double t = far_away(rng), spacing = spacing_at(t) * 2, size = ldexp(spacing, 4 + (int)(rng_u32(rng) % 40));
    Vec3 place = vec3_make(t, rng_u32(rng) % 2 ? t : -t, rng_u32(rng) % 2 ? t : 0);
    place = vec3_make(rint(place.x / spacing) * spacing, rint(place.y / spacing) * spacing, rint(place.z / spacing) * spacing);
    Node *node = fixture_prim(&f, NULL, shape->create(), rgb(1, 1, 1), rgb(0, 0, 0), 1, 0);
    Affine scale = affine_scale(size, size, size), move = affine_translate(place.x, place.y, place.z);
    node_transform(node, &scale, false);
    node_transform(node, &move, false);
    CHECK(fixture_compile(&f));
    double world = ldexp(1, -f.world->exponent);
    Ray ray[RAYS];
    Vec3 origin[RAYS];
    Hit hit[RAYS];
    for (int i = 0; i < RAYS; i++) {
        Vec3 off = vec3_scale(random_direction(rng), uniform(rng, 2, 20));
        Vec3 aim = vec3_make(uniform(rng, -1.2, 1.2), uniform(rng, -1.2, 1.2), uniform(rng, -1.2, 1.2));
        Vec3 o = vec3_at(place, size, off);
        origin[i] = vec3_make(rint(o.x / spacing) * spacing, rint(o.y / spacing) * spacing, rint(o.z / spacing) * spacing);
        Vec3 d = vec3_sub(vec3_at(place, size, aim), origin[i]);
        ray[i] = (Ray){vec3_scale(origin[i], world), vec3_scale(d, world), 0, INFINITY};
    }
    world_intersect(f.world, ray, NULL, hit, RAYS, scratch);
    for (int i = 0; i < RAYS; i++) {
        Ray own = own_ray(origin[i], vec3_scale(ray[i].d, 1 / world), place, size);
        judge(row, shape, &own, &hit[i], QUAD_SPACINGS * spacing / size, seed);
    }
    fixture_destroy(&f);
}

static void hits_far_away(Row *row, uint64_t trials)
{
    Rng rng = rng_seed(10, 1);
    Scratch scratch = {.arena = arena_create()};
    CHECK(scratch.arena);
    for (uint64_t i = 0; i < (trials + RAYS - 1) / RAYS; i++) shoot(row, &rng, &shapes[i % 5], i, &scratch);
    arena_destroy(scratch.arena);
}

/* ---- pictures ---- */

/* a + b on the grid of the greatest coordinate, so that differences are exact. */
static double on_grid(double x, double spacing) { return rint(x / spacing) * spacing; }

static void move(QuadScene *s, double size, Vec3 t, double spacing)
{
    double by[3] = {t.x, t.y, t.z};
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < s->solids; i++) {
            QuadSolid *q = &s->solid[i];
            q->at[k] = on_grid(q->at[k] * size + by[k], spacing);
            q->size[k] = fmax(on_grid(q->size[k] * size, spacing), spacing);
        }
        s->eye[k] = on_grid(s->eye[k] * size + by[k], spacing);
        s->light[0].at[k] = on_grid(s->light[0].at[k] * size + by[k], spacing);
    }
}

/* Whether the rule of the warning says that the scene is drawn coarsely. A factor of 2 either way is left open. */
static int is_coarse(const QuadScene *s, double reach)
{
    double least = INFINITY;
    for (int i = 0; i < s->solids; i++) {
        const double *z = s->solid[i].size;
        least = fmin(least, s->solid[i].box ? fmax(z[0], fmax(z[1], z[2])) : 2 * z[0]);
    }
    double moved = QUAD_SPACINGS * spacing_at(reach) * WIDTH / least;
    return moved > 2 ? 1 : moved < 0.5 ? -1 : 0;
}

static void picture_far_away(Row *row, Rng *rng, uint64_t number)
{
    double t = far_away(rng), spacing = spacing_at(t) * 2;
    double size = spacing * pow(10, uniform(rng, 1.5, 10));
    QuadScene s = {.solids = 3, .ambient = {0.1, 0.1, 0.1}, .background = {0, 0, 0.5}, .up = {0, 1, 0}, .fov_deg = 40,
                   .width = WIDTH, .height = HEIGHT, .max_depth = 4, .slack = QUAD_SPACINGS * spacing,
                   .eye = {uniform(rng, -3, 3), uniform(rng, 1, 4), 6}};
    s.solid[0] = quad_box(-4, -1, -4, 8, 1, 8);
    s.solid[1] = quad_sphere(uniform(rng, -1, 1), 1.2, 0, 1);
    s.solid[2] = quad_box(uniform(rng, -2, 1), 0.25, 1.5, 0.5, 0.75, 1);
    s.solid[0].making = rng_u32(rng) % 3;
    s.solid[1].making = rng_u32(rng) % 2 ? MADE_PLAIN : MADE_CSG;
    s.solid[2].making = rng_u32(rng) % 3;
    quad_add_light(&s, vec3_make(uniform(rng, -4, 4), 5, 5), 0.8, 1, 0, 0);
    Vec3 place = vec3_make(t, rng_u32(rng) % 2 ? t : -t, rng_u32(rng) % 2 ? t : 0);
    move(&s, size, place, spacing);
    quad_look_at(&s, vec3_make(s.solid[1].at[0], s.solid[1].at[1], s.solid[1].at[2]));
    s.turn = s.slack / size;
    char what[100];
    snprintf(what, sizeof what, "picture %llu, %.2e from the origin, size %.2e", (unsigned long long)number, t, size);
    Picture picture = quad_scene_picture(&s);
    double n = (double)quad_scene_compare(row, &s, &picture, what);
    row_trial(row, n <= (0.02 + 20 * s.slack / size) * WIDTH * HEIGHT, "%s: %g pixels are undecided", what, n);
    int coarse = is_coarse(&s, fabs(t));
    bool told = picture.warnings == 1 && strstr(picture.warning, "stability_quad.lua:") && strstr(picture.warning, " apart: ");
    row_trial(row, coarse == 0 || (coarse > 0 ? told : picture.warnings == 0), "%.50s: %u warnings: %.60s", what,
              picture.warnings, picture.warning);
    picture_free(&picture);
}

static void pictures_far_away(Row *row, uint64_t trials)
{
    Rng rng = rng_seed(10, 2);
    for (uint64_t i = 0; i < (trials + WIDTH * HEIGHT - 1) / (WIDTH * HEIGHT); i++) picture_far_away(row, &rng, i);
}

#define PICTURES(n) ((uint64_t)(n) * WIDTH * HEIGHT)

const StabilityCase far_cases[] = {
    {10, "hits 1e9 ... 1e15 from the origin", "interval", "", 40000, 2000000, 20000000, hits_far_away},
    {10, "pictures 1e9 ... 1e15 from the origin, warned", "interval",
     "POV-Ray, by 1e10: 19,758 wrong pixels of 400x300", PICTURES(10), PICTURES(150), PICTURES(1500), pictures_far_away},
    {0},
};
