/* Long objects that lie askew are cut in the tree over objects: what rays hit is what they hit without any tree. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

#include "accel/accel.h"
#include "accel/kernel.h"
#include "common/rng.h"
#include "node/primitive/primitive.h"
#include "support/world_fixture.h"

enum { RODS = 60, RAYS = 64, ROUNDS = 400 };

static const Rgb grey = {{0.5f, 0.5f, 0.5f}};

static double uniform(Rng *rng, double low, double high) { return low + (high - low) * rng_double(rng); }
static Vec3 random_vector(Rng *rng) { return vec3_make(uniform(rng, -1, 1), uniform(rng, -1, 1), uniform(rng, -1, 1)); }

static Prim *form(int k)
{
    switch (k % 5) {
    case 0: return cylinder_create();
    case 1: return cube_create();
    case 2: return cone_create();
    case 3: return torus_create(0.3);
    default: return sphere_create();
    }
}

static void stretch(Node *node, Vec3 size) { node_transform(node, &(Affine){{{size.x}, {0, size.y}, {0, 0, size.z}}}, false); }

/* Thin ones that point anywhere, some mirrored. */
static void make_rods(WorldFixture *f, Rng *rng)
{
    fixture_create(f);
    for (int k = 0; k < RODS; k++) {
        Node *node = fixture_prim(f, NULL, form(k), grey, grey, 1, 0);
        double thin = exp2(-uniform(rng, 3, 10));
        double size[3] = {thin, thin * uniform(rng, 0.5, 2), k % 7 == 0 ? -thin : thin};
        size[k % 3] = uniform(rng, 0.5, 3);
        stretch(node, vec3_make(size[0], size[1], size[2]));
        for (int axis = 0; axis < 3; axis++) {
            Affine turn = affine_rotate(axis, uniform(rng, 0, 360));
            node_transform(node, &turn, false);
        }
        Vec3 to = random_vector(rng);
        Affine shift = affine_translate(to.x, to.y, to.z);
        node_transform(node, &shift, false);
    }
    assert_true(fixture_compile(f));
}

/* From anywhere to a place in the box of some object, which is thin: most pass near it. */
static Ray ray_to_some(const World *world, Rng *rng)
{
    const Object *object = &world->objects[rng_u32(rng) % world->object_count];
    Box b = object->prim->ops->bounds(object->prim);
    Vec3 own = vec3_make(uniform(rng, b.lo.x, b.hi.x), uniform(rng, b.lo.y, b.hi.y), uniform(rng, b.lo.z, b.hi.z));
    Vec3 from = random_vector(rng);
    return (Ray){from, vec3_sub(affine_point(&object->to_world, own), from), 0, INFINITY};
}

static Hit nearest_of_all(const World *world, const Ray *ray, Scratch *scratch)
{
    Hit best = {.t = ray->tmax, .object = HIT_NONE};
    for (uint32_t i = 0; i < world->object_count; i++) {
        const Object *object = &world->objects[i];
        Ray local = ray_to_object(object, ray);
        Hit hit;
        arena_reset(scratch->arena);
        local.tmax = best.t;
        if (!object->prim->ops->intersect(object->prim, &local, &hit, scratch)) continue;
        if (hit.t == best.t && best.object != HIT_NONE) continue;
        hit.object = i;
        best = hit;
    }
    return best;
}

static void hits_are_those_without_a_tree(void **state)
{
    (void)state;
    WorldFixture f;
    Rng rng = rng_seed(5, 0);
    make_rods(&f, &rng);
    World *world = f.world;
    assert_true(world->bvh.item_count > 4 * world->object_count);
    Scratch scratch = {.arena = arena_create()};
    static const char *const names[] = {"scalar", NULL};
    uint32_t hits = 0;
    for (int round = 0; round < ROUNDS; round++) {
        Ray ray[RAYS];
        Hit truth[RAYS], hit[RAYS];
        bool blocked[RAYS];
        Vec3 eye = random_vector(&rng);
        for (int i = 0; i < RAYS; i++) {
            ray[i] = ray_to_some(world, &rng);
            if (round % 2) ray[i] = (Ray){eye, vec3_sub(vec3_at(ray[i].o, 1, ray[i].d), eye), 0, INFINITY};
            truth[i] = nearest_of_all(world, &ray[i], &scratch);
            hits += truth[i].object != HIT_NONE;
        }
        for (int k = 0; k < 2; k++) {
            world->kernel = kernel_best(names[k]);
            world_intersect(world, ray, NULL, hit, RAYS, &scratch);
            world_occluded(world, ray, NULL, blocked, RAYS, &scratch);
            for (int i = 0; i < RAYS; i++) {
                assert_int_equal(hit[i].object, truth[i].object);
                assert_true(truth[i].object == HIT_NONE || hit[i].t == truth[i].t);
                assert_true(blocked[i] == (truth[i].object != HIT_NONE));
            }
        }
    }
    printf("%u boxes of %u objects; %u of %d rays hit\n", world->bvh.item_count, world->object_count, hits, RAYS * ROUNDS);
    assert_true(hits > RAYS * ROUNDS / 2);
    arena_destroy(scratch.arena);
    fixture_destroy(&f);
}

static void what_fills_its_box_stays_whole(void **state)
{
    (void)state;
    WorldFixture f;
    fixture_create(&f);
    for (int k = 0; k < 5; k++) {
        stretch(fixture_prim(&f, NULL, form(k), grey, grey, 1, 0), vec3_make(0.01, 3, 0.01));
        Affine turn = affine_rotate(0, 35);
        node_transform(fixture_prim(&f, NULL, form(k), grey, grey, 1, 0), &turn, false);
    }
    assert_true(fixture_compile(&f));
    assert_int_equal(f.world->bvh.item_count, f.world->object_count);
    fixture_destroy(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(hits_are_those_without_a_tree),
                                       cmocka_unit_test(what_fills_its_box_stays_whole)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
