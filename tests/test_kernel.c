/* Every kernel against the scalar one, the truth: the same hits, bit by bit, on coherent, random and boundary rays over a
 * world of meshes (baked, instanced, turned), analytic primitives and CSG; and their speeds in the same run. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "accel/accel.h"
#include "accel/kernel.h"
#include "accel/mesh_data.h"
#include "common/cpu.h"
#include "common/rng.h"
#include "node/primitive/primitive.h"
#include "support/check.h"
#include "support/world_fixture.h"

enum { STREAM = 500, ROUNDS = 60 };

static const Rgb grey = {{0.5f, 0.5f, 0.5f}};

static double uniform(Rng *rng, double low, double high) { return low + (high - low) * rng_double(rng); }

static Vec3 random_vector(Rng *rng) { return vec3_make(uniform(rng, -1, 1), uniform(rng, -1, 1), uniform(rng, -1, 1)); }

/* A bumpy sheet of n x n squares over [-1,1]^2, its edges on round numbers. */
static Mesh *sheet(uint32_t n)
{
    Mesh *m = calloc(1, sizeof *m);
    CHECK(m);
    m->position = malloc((n + 1) * (n + 1) * sizeof *m->position);
    m->triangle = malloc(2 * n * n * sizeof *m->triangle);
    CHECK(m->position && m->triangle);
    for (uint32_t i = 0; i <= n; i++)
        for (uint32_t j = 0; j <= n; j++) {
            double x = 2.0 * i / n - 1, z = 2.0 * j / n - 1;
            m->position[m->position_count++] = vec3_make(x, 0.1 * sin(7 * x) * cos(5 * z), z);
        }
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t j = 0; j < n; j++) {
            uint32_t a = i * (n + 1) + j, b = a + n + 1, t[2][3] = {{a, a + 1, b}, {b, a + 1, b + 1}};
            memcpy(m->triangle[m->triangle_count], t, sizeof t);
            m->triangle_count += 2;
        }
    return m;
}

static Node *mesh_node(WorldFixture *f, Node *parent, MeshSource *source)
{
    Node *node = fixture_node(f, parent, NODE_MESH, "sheet");
    node->mesh = source;
    node->material = fixture_material(f, grey, grey, 10, 0);
    return node;
}

static void move(Node *node, Rng *rng, double size)
{
    Affine steps[] = {affine_scale(size * uniform(rng, 0.3, 1), size * uniform(rng, 0.3, 1), -size),
                      affine_rotate(0, uniform(rng, 0, 360)), affine_rotate(1, uniform(rng, 0, 360)),
                      affine_translate(uniform(rng, -3, 3), uniform(rng, -3, 3), uniform(rng, -3, 3))};
    for (size_t i = 0; i < sizeof steps / sizeof *steps; i++) node_transform(node, &steps[i], false);
}

static void make_world(WorldFixture *f)
{
    Rng rng = rng_seed(31, 0);
    fixture_create(f);
    for (uint32_t size = 1; size <= 40; size += 13) {
        MeshSource *shared = scene_mesh_made(f->scene, MESH_TABLE), *single = scene_mesh_made(f->scene, MESH_TABLE);
        CHECK(shared && single);
        shared->loaded = sheet(size);
        single->loaded = sheet(size);
        for (int i = 0; i < 3; i++) mesh_node(f, NULL, single);  /* in one place: ties */
        /* all places of the largest together are too much to be baked */
        Node *node = NULL;
        for (int i = 0; i < 40; i++) {
            Node *place = fixture_node(f, NULL, NODE_GROUP, "place");
            move(place, &rng, 0.5);
            if (node)
                CHECK(node_add_child(f->scene, place, node, NULL));
            else
                node = mesh_node(f, place, shared);
        }
    }
    Prim *(*const make[])(void) = {sphere_create, cube_create, cylinder_create, cone_create};
    for (int i = 0; i < 80; i++) {
        Prim *prim = i % 5 == 4 ? torus_create(0.3) : make[i % 5]();
        move(fixture_prim(f, NULL, prim, grey, grey, 10, 0), &rng, 0.4);
    }
    for (int i = 0; i < 10; i++) {
        Node *aside = scene_add_node(f->scene, NODE_GROUP, "", ""), *csg = fixture_node(f, NULL, NODE_CSG, "cut");
        CHECK(aside);
        csg->csg.op = CSG_DIFF;
        csg->csg.a = fixture_prim(f, aside, sphere_create(), grey, grey, 10, 0);
        csg->csg.b = fixture_prim(f, aside, cube_create(), grey, grey, 10, 0);
        move(csg, &rng, 0.5);
    }
    CHECK(fixture_compile(f));
    uint32_t instances = 0, in_world = 0;
    for (uint32_t i = 0; i < f->world->object_count; i++) {
        const Object *o = &f->world->objects[i];
        if (!mesh_prim_data(o->prim)) continue;
        instances += !o->in_world;
        in_world += o->in_world;
    }
    CHECK(instances == 40 && in_world == 1);
}

/* Rays of one kind: 0 camera, 1 toward a point light, 2 all ways, 3 axis-parallel on round numbers, 4 mixed scales and
 * intervals. Coordinates are the world's: divided by 2^exponent. */
static void make_rays(const World *world, int kind, Rng *rng, Ray *ray)
{
    double k = ldexp(1, -world->exponent);
    Vec3 corner = random_vector(rng);
    for (int i = 0; i < STREAM; i++) {
        Vec3 o = vec3_scale(random_vector(rng), 4), d = random_vector(rng);
        double tmax = INFINITY, tmin = 0;
        switch (kind) {
        case 0:
            o = vec3_make(0, 0, 10);
            d = vec3_make(0.4 * corner.x + 0.001 * (i % 23), 0.4 * corner.y + 0.001 * (i / 23), -1);
            break;
        case 1:
            o = vec3_add(vec3_scale(corner, 3), vec3_scale(random_vector(rng), 0.1));
            d = vec3_sub(vec3_make(20, 30, 25), o);
            tmin = i % 4 == 0 ? 0.5 * rng_double(rng) : 0;
            tmax = 1;
            break;
        case 3: {
            int axis = (int)(rng_u32(rng) % 3);
            o = vec3_scale(vec3_make(rng_u32(rng) % 33, rng_u32(rng) % 33, rng_u32(rng) % 33), 0.25);
            o = vec3_sub(o, vec3_make(4, 4, 4));
            double sign = rng_u32(rng) % 2 ? 1 : -1;
            d = vec3_make(axis == 0 ? sign : 0.0, axis == 1 ? sign : -0.0, axis == 2 ? sign : 0.0);
            break;
        }
        case 4:
            d = vec3_scale(d, ldexp(1, (int)(rng_u32(rng) % 80) - 40));
            tmin = rng_double(rng) / vec3_length(d) * k;
            tmax = tmin * (1 + 5 * rng_double(rng));
            break;
        default:
            break;
        }
        ray[i] = (Ray){vec3_scale(o, k), kind == 4 ? d : vec3_scale(d, k), tmin, tmax};
    }
}

/* Those that this processor runs, but for the scalar one. */
static uint32_t kernels(const Kernel *list[3])
{
    static const char *const names[] = {"sse2", "avx2", "avx512"};
    uint32_t n = 0;
    for (int i = 0; i < 3; i++) {
        const Kernel *k = kernel_best(names[i]);
        if (k && strcmp(kernel_name(k), names[i]) == 0) list[n++] = k;
    }
    return n;
}

static void same_hit(const Kernel *kernel, int kind, int round, int i, const Hit *want, const Hit *got)
{
    if (want->object == got->object &&
        (want->object == HIT_NONE || (want->t == got->t && want->u == got->u && want->v == got->v &&
                                      want->part == got->part && want->leaf == got->leaf)))
        return;
    fail_msg("%s, kind %d, round %d, ray %d: object %u part %u t %.17g, not object %u part %u t %.17g", kernel->name, kind,
             round, i, got->object, got->part, got->t, want->object, want->part, want->t);
}

static void equal_to_the_scalar_one(void **state)
{
    (void)state;
    WorldFixture f;
    make_world(&f);
    Scratch scratch = {arena_create(), false};
    Ray *ray = malloc(STREAM * sizeof *ray);
    Hit *want = malloc(STREAM * sizeof *want), *got = malloc(STREAM * sizeof *got);
    bool *blocked = malloc(STREAM), *as = malloc(STREAM);
    const Kernel *list[3];
    uint32_t n = kernels(list);
    static const char *const names[] = {"camera", "to a light", "all ways", "on planes", "mixed"};
    for (int kind = 0; kind < 5; kind++) {
        Rng rng = rng_seed(32, (uint64_t)kind);
        uint32_t hits = 0;
        double scalar_s = 0, s[3] = {0};
        for (int round = 0; round < ROUNDS; round++) {
            make_rays(f.world, kind, &rng, ray);
            size_t count = round % 7 == 0 ? (size_t)(round % STREAM) : STREAM;  /* short streams too */
            double start = cpu_time_s();
            kernel_scalar.intersect(f.world, ray, NULL, want, count, &scratch);
            kernel_scalar.occluded(f.world, ray, NULL, blocked, count, &scratch);
            scalar_s += cpu_time_s() - start;
            for (uint32_t k = 0; k < n; k++) {
                start = cpu_time_s();
                list[k]->intersect(f.world, ray, NULL, got, count, &scratch);
                list[k]->occluded(f.world, ray, NULL, as, count, &scratch);
                s[k] += cpu_time_s() - start;
                for (size_t i = 0; i < count; i++) {
                    same_hit(list[k], kind, round, (int)i, &want[i], &got[i]);
                    assert_int_equal(blocked[i], as[i]);
                }
            }
            for (size_t i = 0; i < count; i++) hits += want[i].object != HIT_NONE;
        }
        assert_true(hits > 500);
        print_message("%-10s: %5u hits; of the scalar kernel's time:", names[kind], hits);
        for (uint32_t k = 0; k < n; k++) print_message(" %s %.2f", list[k]->name, s[k] / scalar_s);
        print_message("\n");
    }
    free(ray);
    free(want);
    free(got);
    free(blocked);
    free(as);
    arena_destroy(scratch.arena);
    fixture_destroy(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(equal_to_the_scalar_one)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
