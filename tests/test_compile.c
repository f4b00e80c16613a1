/* Freezing a scene: what is reached, shared, baked, refused. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "node/primitive/primitive.h"
#include "support/world_fixture.h"

static const Rgb grey = {{0.5f, 0.5f, 0.5f}}, black = {{0, 0, 0}};

static void every_path_is_an_object(void **state)
{
    (void)state;
    WorldFixture f;
    fixture_create(&f);
    Node *a = fixture_node(&f, NULL, NODE_GROUP, "a"), *b = fixture_node(&f, NULL, NODE_GROUP, "b");
    Node *shared = fixture_prim(&f, a, sphere_create(), grey, black, 1, 0);
    assert_true(node_add_child(f.scene, b, shared, NULL));
    assert_true(node_add_child(f.scene, b, shared, NULL));
    assert_true(fixture_compile(&f));
    assert_int_equal(f.world->object_count, 3);
    assert_ptr_equal(f.world->objects[0].prim, f.world->objects[1].prim);
    assert_int_equal(f.stats.nodes, 4);
    fixture_destroy(&f);
}

static void transforms_multiply_from_the_root(void **state)
{
    (void)state;
    WorldFixture f;
    fixture_create(&f);
    f.job.eye = vec3_make(0, 0, 0.5);
    Node *a = fixture_node(&f, NULL, NODE_GROUP, "a");
    Node *s = fixture_prim(&f, a, sphere_create(), grey, black, 1, 0);
    Affine move = affine_translate(1, 0, 0), turn = affine_rotate(2, 90);
    node_transform(s, &move, false);   /* the centre to (1,0,0), */
    node_transform(a, &turn, false);   /* then to (0,1,0) */
    assert_true(fixture_compile(&f));
    const Object *o = &f.world->objects[0];
    double k = ldexp(1, f.world->exponent);
    assert_true(o->to_world.m[0][3] == 0 && o->to_world.m[1][3] * k == 1 && o->to_world.m[2][3] == 0);
    fixture_destroy(&f);
}

static void refuses(WorldFixture *f, const char *text)
{
    assert_false(fixture_compile(f));
    assert_int_equal(f->err.kind, ERR_SCENE);
    assert_string_equal(f->err.text, text);
    fixture_destroy(f);
}

static void errors_name_the_line(void **state)
{
    (void)state;
    WorldFixture f;
    fixture_create(&f);
    fixture_prim(&f, NULL, torus_create(0.5), grey, black, 1, 0)->material = NULL;
    refuses(&f, "scene.lua:2: torus 'thing' has no material");

    fixture_create(&f);
    Affine flat = affine_scale(1, 0, 1);
    node_transform(fixture_prim(&f, NULL, sphere_create(), grey, black, 1, 0), &flat, false);
    refuses(&f, "scene.lua:2: sphere 'thing' has a singular matrix, or one too extreme to be inverted");
}

static Node *csg_node(WorldFixture *f, CsgOp op, Node *a, Node *b)
{
    Node *n = fixture_node(f, NULL, NODE_CSG, "cut");
    n->csg.op = op;
    n->csg.a = a;
    n->csg.b = b;
    return n;
}

/* An operand, in no group. */
static Node *operand(WorldFixture *f, Prim *prim, Rgb kd)
{
    Node *parent = scene_add_node(f->scene, NODE_GROUP, "", "");
    return fixture_prim(f, parent, prim, kd, black, 1, 0);
}

static void csg_needs_material_where_it_shows(void **state)
{
    (void)state;
    WorldFixture f;
    fixture_create(&f);
    Node *a = operand(&f, sphere_create(), grey), *b = operand(&f, cube_create(), grey);
    b->material = NULL;
    csg_node(&f, CSG_DIFF, a, b);
    assert_true(fixture_compile(&f));
    assert_int_equal(f.world->object_count, 1);
    const Shading *s = &f.world->shadings[f.world->objects[0].shading];
    assert_ptr_equal(s[0].material, a->material);
    assert_ptr_equal(s[1].material, a->material);
    csg_node(&f, CSG_UNION, a, b);
    refuses(&f, "scene.lua:2: cube 'thing' has no material");
}

static void operands_have_no_children(void **state)
{
    (void)state;
    WorldFixture f;
    fixture_create(&f);
    Node *a = operand(&f, sphere_create(), grey), *b = operand(&f, cube_create(), grey);
    csg_node(&f, CSG_DIFF, a, b);
    assert_true(node_add_child(f.scene, b, operand(&f, sphere_create(), grey), NULL));
    refuses(&f, "scene.lua:2: cube 'thing' is a CSG operand and can't have children");
}

static void features_are_those_of_the_scene(void **state)
{
    (void)state;
    WorldFixture f;
    fixture_create(&f);
    fixture_prim(&f, NULL, sphere_create(), grey, black, 1, 0);
    assert_true(fixture_compile(&f));
    assert_int_equal(f.world->features, 0);
    fixture_prim(&f, NULL, sphere_create(), grey, black, 1, 0.1);
    assert_true(fixture_compile(&f));
    assert_int_equal(f.world->features, FEATURE_MIRROR);
    fixture_destroy(&f);
}

static Mesh *strip(uint32_t triangles)
{
    Mesh *m = calloc(1, sizeof *m);
    assert_non_null(m);
    m->position = malloc((triangles + 2) * sizeof *m->position);
    m->triangle = malloc(triangles * sizeof *m->triangle);
    assert_true(m->position && m->triangle);
    for (uint32_t i = 0; i < triangles + 2; i++) m->position[m->position_count++] = vec3_make(i, i % 2, 0);
    for (uint32_t i = 0; i < triangles; i++)
        for (uint32_t k = 0; k < 3; k++) m->triangle[i][k] = i + k;
    m->triangle_count = triangles;
    return m;
}

static Node *strip_node(WorldFixture *f, Node *parent, MeshSource *source)
{
    Node *node = fixture_node(f, parent, NODE_MESH, "strip");
    node->mesh = source;
    node->material = fixture_material(f, grey, black, 1, 0);
    return node;
}

/* What is small in all its places is baked into one object in the world; a large mesh that stands but once gets an object
 * there; others are mapped. */
static void meshes_are_baked_and_placed(void **state)
{
    (void)state;
    static const struct { uint32_t triangles, places, nodes, objects; bool in_world; } rows[] = {
        {100, 1, 1, 1, true},   {100, 600, 1, 1, true},    {100, 700, 1, 700, false}, {65536, 1, 1, 1, true},
        {65537, 1, 1, 1, true}, {65537, 2, 1, 2, false},   {65537, 1, 2, 2, false},   {60000, 1, 20, 4, true},
    };
    for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
        WorldFixture f;
        fixture_create(&f);
        MeshSource *source = scene_mesh_made(f.scene, MESH_TABLE);
        assert_non_null(source);
        source->loaded = strip(rows[r].triangles);
        for (uint32_t n = 0; n < rows[r].nodes; n++) {
            Node *node = NULL;
            for (uint32_t i = 0; i < rows[r].places; i++) {
                Node *place = fixture_node(&f, NULL, NODE_GROUP, "place");
                Affine move = affine_translate(0, 2 * (n * rows[r].places + i), -3), size = affine_scale(0.1, 0.3, 0.7);
                node_transform(place, &size, false);
                node_transform(place, &move, false);
                if (node)
                    assert_true(node_add_child(f.scene, place, node, NULL));
                else
                    node = strip_node(&f, place, source);
            }
        }
        assert_true(fixture_compile(&f));
        assert_int_equal(f.world->object_count, rows[r].objects);
        assert_int_equal(f.world->objects[rows[r].objects - 1].in_world, rows[r].in_world);
        fixture_destroy(&f);
    }
}

/* A chain of a million nodes is walked without recursion. */
static void deep_chains(void **state)
{
    (void)state;
    WorldFixture f;
    fixture_create(&f);
    Node *at = f.root;
    for (int i = 0; i < 1000000; i++) {
        Node *next = scene_add_node(f.scene, NODE_GROUP, "n", "");
        assert_true(node_add_child(f.scene, at, next, NULL));
        at = next;
    }
    fixture_prim(&f, at, sphere_create(), grey, black, 1, 0);
    assert_true(fixture_compile(&f));
    assert_int_equal(f.world->object_count, 1);
    fixture_destroy(&f);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(meshes_are_baked_and_placed),
        cmocka_unit_test(every_path_is_an_object),
        cmocka_unit_test(transforms_multiply_from_the_root),
        cmocka_unit_test(errors_name_the_line),
        cmocka_unit_test(csg_needs_material_where_it_shows),
        cmocka_unit_test(operands_have_no_children),
        cmocka_unit_test(features_are_those_of_the_scene),
        cmocka_unit_test(deep_chains),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
