/* Primitives and random CSG trees, in which faces often coincide: every kernel has the scalar one's hits, bit by bit, for
 * rays from afar, between round places, nearly tangent, and leaving the surfaces that they hit. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "accel/accel.h"
#include "accel/kernel.h"
#include "common/numeric.h"
#include "common/rng.h"
#include "node/primitive/primitive.h"
#include "support/check.h"
#include "support/world_fixture.h"

enum { WORLDS = 60, SOLIDS = 6, STREAM = 400, KINDS = 5, DEEPEST = 3 };

static const Rgb grey = {{0.5f, 0.5f, 0.5f}};

static double uniform(Rng *rng, double low, double high) { return low + (high - low) * rng_double(rng); }
static uint32_t pick(Rng *rng, uint32_t n) { return rng_u32(rng) % n; }
static Vec3 random_vector(Rng *rng) { return vec3_make(uniform(rng, -1, 1), uniform(rng, -1, 1), uniform(rng, -1, 1)); }

/* Multiples of a quarter within [-limit, limit]. */
static Vec3 round_place(Rng *rng, uint32_t limit)
{
    uint32_t n = 8 * limit + 1;
    double shift = limit;
    return vec3_make(0.25 * pick(rng, n) - shift, 0.25 * pick(rng, n) - shift, 0.25 * pick(rng, n) - shift);
}

static void turn(Node *node, Rng *rng, bool straight)
{
    for (int axis = 0; axis < 3; axis++) {
        Affine rotation = affine_rotate(axis, straight ? 90 * pick(rng, 4) : uniform(rng, 0, 360));
        node_transform(node, &rotation, false);
    }
}

static void shift(Node *node, Vec3 by)
{
    Affine translation = affine_translate(by.x, by.y, by.z);
    node_transform(node, &translation, false);
}

static Node *leaf(WorldFixture *f, Node *parent, Rng *rng)
{
    Prim *(*const make[])(void) = {sphere_create, cube_create, cylinder_create, cone_create};
    uint32_t shape = pick(rng, 9);
    Prim *prim = shape == 8 ? torus_create(pick(rng, 2) ? 0.25 : 1.25) : make[shape % 4]();
    Node *node = fixture_prim(f, parent, prim, grey, grey, 10, 0);
    static const double size[] = {0.5, 1, 1, 1.5};
    double x = size[pick(rng, 4)], z = pick(rng, 2) ? x : size[pick(rng, 4)];
    Affine scale = affine_scale(x, size[pick(rng, 4)], pick(rng, 8) ? z : 1e-3);
    node_transform(node, &scale, false);
    turn(node, rng, pick(rng, 4) > 0);
    if (pick(rng, 3)) shift(node, round_place(rng, 1));
    return node;
}

static Node *solid(WorldFixture *f, Node *parent, Node *aside, Rng *rng, uint32_t depth)
{
    if (depth == 0 || pick(rng, 5) == 0) return leaf(f, parent, rng);
    Node *node = fixture_node(f, parent, NODE_CSG, "solid");
    node->csg.op = (CsgOp)pick(rng, 3);
    node->csg.a = solid(f, aside, aside, rng, depth - 1);
    node->csg.b = solid(f, aside, aside, rng, depth - 1);
    return node;
}

static void make_world(WorldFixture *f, Rng *rng)
{
    fixture_create(f);
    Node *aside = scene_add_node(f->scene, NODE_GROUP, "", "");
    CHECK(aside);
    for (int i = 0; i < SOLIDS; i++) {
        Node *node = solid(f, NULL, aside, rng, pick(rng, DEEPEST + 1));
        turn(node, rng, pick(rng, 2));
        shift(node, pick(rng, 2) ? round_place(rng, 2) : vec3_scale(random_vector(rng), 2));
    }
    CHECK(fixture_compile(f));
}

/* Rays of one kind in the script's coordinates: 0 from afar, 1 between round places, 2 all ways from among the solids,
 * 3 past a unit ball at a round place, nearly tangent, 4 as 1, but nearly along an axis. */
static Ray make_ray(Rng *rng, int kind, Vec3 eye, int i)
{
    double tmax = pick(rng, 3) ? INFINITY : uniform(rng, 0.5, 1.5);
    Vec3 from = round_place(rng, 4), to = round_place(rng, 2), d = random_vector(rng);
    switch (kind) {
    case 0: return (Ray){eye, vec3_sub(vec3_make(0.2 * (i % 20) - 2, 0.2 * (i / 20) - 2, 0), eye), 0, INFINITY};
    case 1: return (Ray){from, vec3_sub(to, from), 0, tmax};
    case 2: return (Ray){vec3_scale(d, 3), random_vector(rng), 0, tmax};
    case 4: {
        Vec3 along[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
        return (Ray){from, vec3_at(along[pick(rng, 3)], ldexp(1, -(int)pick(rng, 60)), d), 0, tmax};
    }
    default: {
        Vec3 side = vec3_normalize(vec3_cross(d, random_vector(rng)));
        Vec3 touch = vec3_at(to, 1 + ldexp(pick(rng, 2) ? 1 : -1, -(int)pick(rng, 50)), side);
        return (Ray){vec3_at(touch, -3, d), d, 0, INFINITY};
    }
    }
}

static bool equal(const Hit *a, const Hit *b)
{
    if (a->object != b->object) return false;
    return a->object == HIT_NONE ||
           (a->t == b->t && a->u == b->u && a->v == b->v && a->part == b->part && a->leaf == b->leaf);
}

typedef struct {
    const Kernel *list[3];
    uint32_t count, hits, blocked;
    Hit want[STREAM], got[STREAM];
    bool stopped[STREAM], as[STREAM];
} Comparison;

static void compare(Comparison *c, const World *world, const Ray *ray, int n, int number, int kind, Scratch *scratch)
{
    kernel_scalar.intersect(world, ray, NULL, c->want, (size_t)n, scratch);
    kernel_scalar.occluded(world, ray, NULL, c->stopped, (size_t)n, scratch);
    for (uint32_t k = 0; k < c->count; k++) {
        c->list[k]->intersect(world, ray, NULL, c->got, (size_t)n, scratch);
        c->list[k]->occluded(world, ray, NULL, c->as, (size_t)n, scratch);
        for (int i = 0; i < n; i++) {
            if (equal(&c->want[i], &c->got[i]) && c->stopped[i] == c->as[i]) continue;
            const Hit *want = &c->want[i], *got = &c->got[i];
            fail_msg("%s, world %d, kind %d, ray %d: object %u leaf %u part %u t %.17g %d, not %u %u %u %.17g %d",
                     c->list[k]->name, number, kind, i, got->object, got->leaf, got->part, got->t, c->as[i], want->object,
                     want->leaf, want->part, want->t, c->stopped[i]);
        }
    }
    for (int i = 0; i < n; i++) {
        c->hits += c->want[i].object != HIT_NONE;
        c->blocked += c->stopped[i];
    }
}

/* From the points that were hit, from about the bound on their error above the surface or below it, all ways. */
static int leave(const World *world, const Ray *ray, const Hit *hit, int n, Rng *rng, Ray *leaving)
{
    int count = 0;
    for (int i = 0; i < n; i++) {
        if (hit[i].object == HIT_NONE) continue;
        const Object *object = &world->objects[hit[i].object];
        Ray local = ray_to_object(object, &ray[i]);
        Surface s;
        object->prim->ops->surface(object->prim, &local, &hit[i], false, &s);
        Vec3 p = affine_point(&object->to_world, s.p), normal = vec3_normalize(affine_normal(&object->to_object, s.n));
        Vec3 err = affine_point_error(&object->to_world, s.p, s.p_err);
        double off = vec3_dot(vec3_abs(normal), err) * ldexp(1, (int)pick(rng, 5)) * (pick(rng, 5) ? 1 : -1);
        leaving[count++] = (Ray){vec3_at(p, off, normal), random_vector(rng), 0, pick(rng, 2) ? INFINITY : 1};
    }
    return count;
}

static void equal_to_the_scalar_one(void **state)
{
    (void)state;
    static const char *const names[] = {"sse2", "avx2", "avx512"};
    static Comparison c;
    static Ray ray[STREAM], leaving[STREAM];
    Scratch scratch = {arena_create(), false};
    for (int i = 0; i < 3; i++) {
        const Kernel *k = kernel_best(names[i]);
        if (k && strcmp(kernel_name(k), names[i]) == 0) c.list[c.count++] = k;
    }
    for (int number = 0; number < WORLDS; number++) {
        Rng rng = rng_seed(71, (uint64_t)number);
        WorldFixture f;
        make_world(&f, &rng);
        double k = ldexp(1, -f.world->exponent);
        Vec3 eye = vec3_make(uniform(&rng, -3, 3), uniform(&rng, -3, 3), pick(&rng, 2) ? 6 : 25);
        for (int kind = 0; kind < KINDS; kind++) {
            for (int i = 0; i < STREAM; i++) {
                ray[i] = make_ray(&rng, kind, eye, i);
                ray[i].o = vec3_scale(ray[i].o, k);
                ray[i].d = vec3_scale(ray[i].d, k);
            }
            compare(&c, f.world, ray, STREAM, number, kind, &scratch);
            int n = leave(f.world, ray, c.want, STREAM, &rng, leaving);
            compare(&c, f.world, leaving, n, number, kind + KINDS, &scratch);
        }
        fixture_destroy(&f);
    }
    print_message("%u hits, %u blocked\n", c.hits, c.blocked);
    assert_true(c.hits > 20000 && c.blocked > 20000);
    arena_destroy(scratch.arena);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(equal_to_the_scalar_one)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
