/* A scene that is moved 1e9 ... 1e15 from the origin: hits may be off by the spacing of the numbers there,
 * no more. */
#include <math.h>
#include <stdio.h>

#include "accel/accel.h"
#include "common/arena.h"
#include "stability/quad_scene.h"
#include "stability/ray_check.h"
#include "support/check.h"
#include "support/world_fixture.h"

static double spacing_at(double x) { return ldexp(1, ilogb(x) - 52); }

static double far_away(Rng *rng) { return pow(10, uniform(rng, 9, 15)) * (rng_u32(rng) % 2 ? 1 : -1); }

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
    for (uint64_t i = 0; i < trials / RAYS; i++) shoot(row, &rng, &shapes[i % 5], i, &scratch);
    arena_destroy(scratch.arena);
}

const StabilityCase far_cases[] = {
    {10, "hits 1e9 ... 1e15 from the origin", "interval", "", 40000, 2000000, 20000000, hits_far_away},
    {0},
};
