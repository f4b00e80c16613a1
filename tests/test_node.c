/* The scene tree: who owns what, sources by path, cycles. */
#include "node/node.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "node/primitive/prim.h"
#include "support/alloc_fail.h"
#include "support/test_file.h"

static int destroyed;

static void count_destroyed(void *thing)
{
    destroyed++;
    free(thing);
}

static Node *add(Scene *scene, const char *name)
{
    Node *node = scene_add_node(scene, NODE_GROUP, name, "scene.lua:1: ");
    assert_non_null(node);
    return node;
}

static void link_nodes(Scene *scene, Node *parent, Node *child)
{
    Err err = {ERR_NONE, ""};
    if (!node_add_child(scene, parent, child, &err)) fail_msg("%s", err.text);
}

static void assert_cycle(Scene *scene, Node *parent, Node *child, const char *expected)
{
    Err err = {ERR_NONE, ""};
    uint32_t before = parent->child_count;
    assert_false(node_add_child(scene, parent, child, &err));
    assert_int_equal(err.kind, ERR_SCENE);
    assert_string_equal(err.text, expected);
    assert_int_equal(parent->child_count, before);
}

static void a_new_node(void **state)
{
    (void)state;
    Scene *scene = scene_create();
    assert_non_null(scene);
    char name[] = "ball", where[] = "a.lua:3: ";
    Node *a = scene_add_node(scene, NODE_PRIM, name, where);
    Node *b = scene_add_node(scene, NODE_GROUP, "other", where);
    name[0] = where[0] = 'x';
    assert_string_equal(a->name, "ball");
    assert_string_equal(a->where, "a.lua:3: ");
    assert_ptr_equal(a->where, b->where);
    assert_int_equal(a->kind, NODE_PRIM);
    assert_int_equal(a->index, 0);
    assert_int_equal(b->index, 1);
    assert_true(!a->has_parent && a->child_count == 0 && !a->material && !a->texture && !a->bump);
    Affine one = affine_identity();
    assert_memory_equal(&a->transform, &one, sizeof one);
    assert_memory_equal(&a->base, &one, sizeof one);
    scene_destroy(scene);
    scene_destroy(NULL);
}

static void transforms_multiply_from_either_side(void **state)
{
    (void)state;
    Scene *scene = scene_create();
    Node *pre = add(scene, "pre"), *post = add(scene, "post");
    Affine move = affine_translate(1, 2, 3), grow = affine_scale(10, 10, 10);
    node_transform(pre, &move, false);
    node_transform(pre, &grow, false);
    node_transform(post, &move, true);
    node_transform(post, &grow, true);
    Vec3 p = affine_point(&pre->transform, vec3_make(1, 0, 0)), q = affine_point(&post->transform, vec3_make(1, 0, 0));
    assert_true(p.x == 20 && p.y == 20 && p.z == 30);
    assert_true(q.x == 11 && q.y == 2 && q.z == 3);
    scene_destroy(scene);
}

static void children_keep_their_order_and_may_repeat(void **state)
{
    (void)state;
    Scene *scene = scene_create();
    Node *parent = add(scene, "parent"), *child[100];
    for (int i = 0; i < 100; i++) {
        child[i] = add(scene, "child");
        link_nodes(scene, parent, child[i]);
    }
    link_nodes(scene, parent, child[5]);
    assert_int_equal(parent->child_count, 101);
    for (int i = 0; i < 100; i++) assert_ptr_equal(parent->children[i], child[i]);
    assert_ptr_equal(parent->children[100], child[5]);
    assert_true(child[0]->has_parent);
    scene_destroy(scene);
}

static void cycles_are_refused(void **state)
{
    (void)state;
    Scene *scene = scene_create();
    Node *a = add(scene, "a"), *b = add(scene, "b"), *c = add(scene, "c"), *d = add(scene, "d");
    assert_cycle(scene, a, a, "'a' can't be its own child");
    link_nodes(scene, a, b);
    link_nodes(scene, b, c);
    link_nodes(scene, a, d);
    link_nodes(scene, d, c);
    assert_cycle(scene, b, a, "'a' can't be a child of 'b', which is below it");
    assert_cycle(scene, c, a, "'a' can't be a child of 'c', which is below it");
    assert_cycle(scene, c, d, "'d' can't be a child of 'c', which is below it");
    link_nodes(scene, d, b);
    link_nodes(scene, a, c);
    assert_cycle(scene, b, d, "'d' can't be a child of 'b', which is below it");
    scene_destroy(scene);
}

static void operands_and_trunks_count(void **state)
{
    (void)state;
    Scene *scene = scene_create();
    Node *a = add(scene, "a"), *b = add(scene, "b"), *both = scene_add_node(scene, NODE_CSG, "both", "");
    both->csg.a = a;
    both->csg.b = b;
    a->has_parent = b->has_parent = true;
    assert_cycle(scene, a, both, "'both' can't be a child of 'a', which is below it");
    assert_cycle(scene, b, both, "'both' can't be a child of 'b', which is below it");
    Node *tree = scene_add_node(scene, NODE_TREE, "tree", ""), *inner = add(scene, "inner");
    tree->tree.trunk = both;
    tree->tree.leaf = inner;
    both->has_parent = inner->has_parent = true;
    assert_cycle(scene, inner, tree, "'tree' can't be a child of 'inner', which is below it");
    assert_cycle(scene, b, tree, "'tree' can't be a child of 'b', which is below it");
    scene_destroy(scene);
}

/* A chain of a million nodes, closed at its end: found without recursion. */
static void long_chains(void **state)
{
    (void)state;
    enum { N = 1000000 };
    Scene *scene = scene_create();
    Node *top = add(scene, "node"), *last = top;
    for (int i = 1; i < N; i++) {
        Node *next = add(scene, "node");
        link_nodes(scene, last, next);
        last = next;
    }
    assert_cycle(scene, last, top, "'node' can't be a child of 'node', which is below it");
    scene_destroy(scene);
}

/* 64 levels of two links each to the next: 2^63 paths, but 64 nodes. */
static void shared_nodes_are_visited_once(void **state)
{
    (void)state;
    enum { LEVELS = 64 };
    Scene *scene = scene_create();
    Node *level[LEVELS];
    for (int i = 0; i < LEVELS; i++) level[i] = add(scene, "level");
    for (int i = LEVELS - 1; i > 0; i--) {
        link_nodes(scene, level[i - 1], level[i]);
        link_nodes(scene, level[i - 1], level[i]);
    }
    assert_cycle(scene, level[LEVELS - 1], level[0], "'level' can't be a child of 'level', which is below it");
    scene_destroy(scene);
}

static void the_scene_frees_what_it_owns(void **state)
{
    (void)state;
    Scene *scene = scene_create();
    destroyed = 0;
    for (int i = 0; i < 1000; i++) assert_true(scene_own(scene, malloc(16), count_destroyed));
    assert_int_equal(destroyed, 0);
    scene_destroy(scene);
    assert_int_equal(destroyed, 1000);
}

static void sources_are_made_once_per_path(void **state)
{
    (void)state;
    Scene *scene = scene_create();
    MeshSource *made = scene_mesh_made(scene, MESH_MOUNTAIN);
    char path[32];
    MeshSource *mesh[200];
    for (int i = 0; i < 200; i++) {
        snprintf(path, sizeof path, "mesh-%d.obj", i);
        mesh[i] = scene_mesh_file(scene, path);
        assert_string_equal(mesh[i]->path, path);
        assert_int_equal(mesh[i]->kind, MESH_FILE);
        assert_int_equal(mesh[i]->index, made->index + 1 + (uint32_t)i);
        assert_null(mesh[i]->loaded);
    }
    for (int i = 0; i < 200; i++) {
        snprintf(path, sizeof path, "mesh-%d.obj", i);
        assert_ptr_equal(scene_mesh_file(scene, path), mesh[i]);
    }
    TextureSource *t = scene_texture_file(scene, "mesh-1.obj");
    GrammarSource *g = scene_grammar_file(scene, "mesh-1.obj");
    assert_ptr_equal(scene_texture_file(scene, "mesh-1.obj"), t);
    assert_ptr_equal(scene_grammar_file(scene, "mesh-1.obj"), g);
    assert_ptr_not_equal(scene_texture_file(scene, "b"), t);
    assert_int_equal(scene_mesh_count(scene), 200);
    assert_int_equal(scene_texture_count(scene), 2);
    scene_destroy(scene);
}

static void loaded_sources_are_freed(void **state)
{
    (void)state;
    Scene *scene = scene_create();
    MeshSource *mountain = scene_mesh_made(scene, MESH_MOUNTAIN);
    mountain->mountain.width = mountain->mountain.height = mountain->mountain.length = 1;
    mountain->mountain.subdivisions = 1;
    assert_true(mesh_source_load(mountain, NULL));
    assert_true(grammar_source_load(scene_grammar_file(scene, "tests/data/branching.grammar"), NULL));
    MeshSource *file = scene_mesh_file(scene, test_file("node.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"));
    assert_true(mesh_source_load(file, NULL));
    scene_destroy(scene);  /* the leak checker has the last word */
}

static bool build(Scene *scene, Node *parent)
{
    Err err = {ERR_NONE, ""};
    static const char *const names[] = {"one", "two"};
    for (int i = 0; i < 400; i++) {
        Node *node = scene_add_node(scene, NODE_GROUP, names[i % 2], "");
        if (!node) return false;
        Node *below = scene_add_node(scene, NODE_GROUP, "below", "");
        if (!below || !node_add_child(scene, node, below, &err)) return false;
        if (!node_add_child(scene, parent, node, &err)) {
            assert_int_equal(err.kind, ERR_LIMIT);
            return false;
        }
    }
    void *thing = calloc(1, 8);
    if (!thing || !scene_own(scene, thing, free)) return false;
    return scene_mesh_file(scene, "a") && scene_texture_file(scene, "a") && scene_grammar_file(scene, "a");
}

static void every_allocation_may_fail(void **state)
{
    (void)state;
    for (long n = 1, failed = true; failed; n++) {
        alloc_fail_at(n);
        Scene *scene = scene_create();
        Node *root = scene ? scene_add_node(scene, NODE_GROUP, "root", "") : NULL;
        bool done = false;
        if (root) {
            root->has_parent = true;  /* so that cycles are looked for */
            done = build(scene, root);
        }
        failed = alloc_fail_stop();
        assert_true(done == !failed);
        scene_destroy(scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_new_node),
        cmocka_unit_test(transforms_multiply_from_either_side),
        cmocka_unit_test(children_keep_their_order_and_may_repeat),
        cmocka_unit_test(cycles_are_refused),
        cmocka_unit_test(operands_and_trunks_count),
        cmocka_unit_test(long_chains),
        cmocka_unit_test(shared_nodes_are_visited_once),
        cmocka_unit_test(the_scene_frees_what_it_owns),
        cmocka_unit_test(sources_are_made_once_per_path),
        cmocka_unit_test(loaded_sources_are_freed),
        cmocka_unit_test(every_allocation_may_fail),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
