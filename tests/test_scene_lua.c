/* Tests of the scene language with a sink that looks at each job instead of rendering it. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include <cmocka.h>

#include "scene_lua.h"
#include "support/alloc_fail.h"

#define FOLDER "build/test-tmp/scene_lua/"
#define SCRIPT FOLDER "s.lua"

/* The call of gr.render that a test is not about, and what it needs. */
#define LIGHT "gr.light({1,2,3},{1,1,1},{1,0,0})"
#define VIEW "{0,0,9},{0,0,-1},{0,1,0},50,{1,1,1}"
#define RENDER "gr.render(root, 'o.png', 8, 8, " VIEW ", {" LIGHT "})\n"
#define ROOT "root = gr.node('root')\n"

/* What the sink saw; the jobs themselves are looked at by `check` while they live. */
static struct {
    void (*check)(const RenderJob *job);
    int renders, warnings;
    char warning[256];   /* the last one */
    ErrKind fail;        /* what the sink ends with */
} seen;

static bool record(void *context, const RenderJob *job, Err *err)
{
    (void)context;
    seen.renders++;
    if (seen.check) seen.check(job);
    return seen.fail == ERR_NONE || err_set(err, seen.fail, "the sink failed");
}

static void record_warning(void *context, const char *text)
{
    (void)context;
    seen.warnings++;
    snprintf(seen.warning, sizeof seen.warning, "%s", text);
}

static void make_folders(const char *path)
{
    char part[1024];
    snprintf(part, sizeof part, "%s", path);
    for (char *slash = strchr(part, '/'); slash; slash = strchr(slash + 1, '/')) {
        *slash = '\0';
        mkdir(part, 0777);
        *slash = '/';
    }
}

static void put(const char *path, const char *text)
{
    make_folders(path);
    FILE *file = fopen(path, "w");
    assert_non_null(file);
    fputs(text, file);
    assert_int_equal(fclose(file), 0);
}

static int start(void **state)
{
    (void)state;
    memset(&seen, 0, sizeof seen);
    return system("rm -rf " FOLDER);
}

static bool run_with(SceneScript script, Err *err)
{
    const RenderSink sink = {.render = record, .warn = record_warning};
    *err = (Err){ERR_NONE, ""};
    return scene_lua_run(&script, &sink, err);
}

static bool run(const char *text, Err *err)
{
    put(SCRIPT, text);
    return run_with((SceneScript){.script = SCRIPT}, err);
}

/* The script runs to its end. */
static void run_ok(const char *text)
{
    Err err;
    if (!run(text, &err)) fail_msg("%s\n%s", err.text, text);
}

static void run_legacy(const char *text)
{
    Err err;
    put(SCRIPT, text);
    if (!run_with((SceneScript){.script = SCRIPT, .legacy = true}, &err)) fail_msg("%s\n%s", err.text, text);
}

/* The script renders once, and `check` looks at the job. */
static void run_job(const char *text, void (*check)(const RenderJob *job))
{
    seen.renders = 0;
    seen.check = check;
    run_ok(text);
    assert_int_equal(seen.renders, 1);
}

static void run_fails(const char *text, ErrKind kind, const char *message)
{
    Err err;
    bool ok = run(text, &err);
    if (ok || err.kind != kind || strcmp(err.text, message) != 0)
        fail_msg("%s\n  gave %d %s\n  not  %d %s", text, (int)err.kind, ok ? "success" : err.text, (int)kind, message);
}

/* ---- commands ---- */

static const Node *child(const RenderJob *job, uint32_t i)
{
    assert_true(i < job->root->child_count);
    return job->root->children[i];
}

static void check_primitives(const RenderJob *job)
{
    const char *const names[] = {"sphere", "cube", "cylinder", "cone", "torus", "sphere", "cube", "sphere"};
    assert_int_equal(job->root->kind, NODE_GROUP);
    assert_string_equal(job->root->name, "root");
    assert_string_equal(job->root->where, SCRIPT ":1: ");
    assert_int_equal(job->root->child_count, 10);
    for (uint32_t i = 0; i < 8; i++) {
        assert_int_equal(child(job, i)->kind, NODE_PRIM);
        assert_string_equal(child(job, i)->prim->ops->name, names[i]);
    }
    assert_ptr_equal(child(job, 0)->prim, child(job, 7)->prim);
    const Affine ball = {{{2, 0, 0, 1}, {0, 2, 0, -3}, {0, 0, 2, 5}}}, box = {{{4, 0, 0, 1}, {0, 4, 0, 2}, {0, 0, 4, 3}}};
    assert_memory_equal(&child(job, 5)->base, &ball, sizeof ball);
    assert_memory_equal(&child(job, 6)->base, &box, sizeof box);
    assert_int_equal(child(job, 8)->kind, NODE_GROUP);
    assert_ptr_equal(child(job, 8), child(job, 9));
}

static void primitives_become_nodes(void **state)
{
    (void)state;
    run_job(ROOT "local j = gr.joint('j', {-1, 0, 1}, {-90, 0, 90})\n"
                 "for _, n in ipairs {gr.sphere('s'), gr.cube('c'), gr.cylinder('y'), gr.cone('o'), gr.torus('t', 0.25),\n"
                 "    gr.nh_sphere('ns', {1, -3, 5}, 2), gr.nh_box('nb', {1, 2, 3}, 4), gr.sphere(7), j, j} do\n"
                 "  root:add_child(n)\n"
                 "end\n" RENDER,
            check_primitives);
    assert_int_equal(seen.warnings, 0);
}

static void check_meshes(const RenderJob *job)
{
    const MeshSource *file = child(job, 0)->mesh, *table = child(job, 2)->mesh, *mountain = child(job, 3)->mesh;
    assert_int_equal(file->kind, MESH_FILE);
    assert_string_equal(file->path, FOLDER "a.obj");
    assert_ptr_equal(file, child(job, 1)->mesh);
    assert_null(file->loaded);
    assert_int_equal(table->kind, MESH_TABLE);
    assert_int_equal(table->loaded->position_count, 4);
    assert_int_equal(table->loaded->triangle_count, 3);
    assert_true(table->loaded->position[2].y == 1.5);
    assert_int_equal(mountain->kind, MESH_MOUNTAIN);
    assert_true(mountain->mountain.width == 1 && mountain->mountain.height == 2 && mountain->mountain.length == 3);
    assert_true(mountain->mountain.roughness == 0.1);
    assert_int_equal(mountain->mountain.subdivisions, 3);
    assert_int_equal(mountain->mountain.seed, 77);
    assert_int_equal(child(job, 4)->mesh->mountain.seed, 0);
    assert_string_equal(child(job, 5)->mesh->path, "missing.obj");
    assert_int_equal(scene_mesh_count(job->scene), 2);
}

static void meshes_have_a_source(void **state)
{
    (void)state;
    put(FOLDER "a.obj", "");
    run_job(ROOT "local v = {{0, 0, 0}, {1, 0, 0}, {'1', 1.5, 0}, {0, 1, 0}}\n"
                 "for _, n in ipairs {gr.mesh('m', 'a.obj'), gr.mesh('n', 'a.obj'), gr.mesh('t', v, {{0, 1, 2, 3}, {2.0, 1, 0}}),\n"
                 "    gr.fractal_mountain('f', {1, 2, 3}, 0.1, 3, 77), gr.fractal_mountain('g', {1, 1, 1}, 0, 0),\n"
                 "    gr.mesh('x', 'missing.obj')} do\n"
                 "  root:add_child(n)\n"
                 "end\n" RENDER,
            check_meshes);
}

static void check_csg(const RenderJob *job)
{
    const CsgOp ops[] = {CSG_UNION, CSG_DIFF, CSG_DIFF, CSG_INTERSECT, CSG_INTERSECT};
    for (uint32_t i = 0; i < 5; i++) {
        assert_int_equal(child(job, i)->kind, NODE_CSG);
        assert_int_equal(child(job, i)->csg.op, ops[i]);
        assert_string_equal(child(job, i)->csg.a->name, "a");
        assert_string_equal(child(job, i)->csg.b->name, "b");
    }
    const Node *tree = child(job, 5);
    assert_int_equal(tree->kind, NODE_TREE);
    assert_string_equal(tree->tree.grammar->path, FOLDER "t.grammar");
    assert_int_equal(tree->tree.depth, 4);
    assert_int_equal(tree->tree.seed, 9);
    assert_string_equal(tree->tree.trunk->name, "a");
    assert_string_equal(tree->tree.leaf->name, "b");
}

static void csg_and_trees_keep_their_parts(void **state)
{
    (void)state;
    put(FOLDER "t.grammar", "");
    run_job(ROOT "local a, b = gr.sphere('a'), gr.union('b', gr.cube('c'), gr.cone('d'))\n"
                 "for _, n in ipairs {gr.union('1', a, b), gr.diff('2', a, b), gr.difference('3', a, b),\n"
                 "    gr.intersect('4', a, b), gr.intersection('5', a, b), gr.tree('6', 't.grammar', 4, a, b, 9)} do\n"
                 "  root:add_child(n)\n"
                 "end\n" RENDER,
            check_csg);
}

static void check_looks(const RenderJob *job)
{
    const Node *a = child(job, 0), *b = child(job, 1), *c = child(job, 2);
    assert_true(a->material->kd.r == 0.25f && a->material->kd.b == 0.75f && a->material->mirror == 0);
    assert_true(b->material->mirror == 0.5f);
    assert_string_equal(a->texture->path, FOLDER "a.png");
    assert_ptr_equal(a->texture, b->texture);
    assert_null(a->texture->loaded);
    assert_null(a->bump);
    assert_non_null(c->bump);
    assert_null(c->material);
}

static void materials_textures_and_bumps_are_given(void **state)
{
    (void)state;
    put(FOLDER "a.png", "");
    run_job(ROOT "local a, b, c = gr.sphere('a'), gr.mesh('b', 'x.obj'), gr.mesh('c', 'x.obj')\n"
                 "a:set_material(gr.material({0.25, 0.5, 0.75}, {0, 0, 0}, 0))\n"
                 "b:set_material(gr.reflective_material({1, 1, 1}, {1, 1, 1}, 5, 0.5))\n"
                 "a:add_texture('a.png')\n"
                 "b:set_texture(gr.texture('a.png'))\n"
                 "c:mesh_add_bumps({0.5, 0.5}, 3, 0.1)\n"
                 "for _, n in ipairs {a, b, c} do root:add_child(n) end\n" RENDER,
            check_looks);
}

/* ---- transforms ---- */

static void check_moved(const RenderJob *job)
{
    const Affine m = {{{0, -2, 0, 1}, {1, 0, 0, 2}, {0, 0, 3, 3}}};
    assert_memory_equal(&job->root->transform, &m, sizeof m);
}

static void transforms_apply_in_the_order_written(void **state)
{
    (void)state;
    run_job(ROOT "root:scale(1, 2, 3)\nroot:rotate('z', 90)\nroot:translate(1, 2, 3)\n" RENDER, check_moved);
    run_job(ROOT "root:scale(1, 2, 3)\nroot:rotate('Z', 90)\nroot:translate(1, 2, 3)\n" RENDER, check_moved);
    seen.check = check_moved;
    run_legacy(ROOT "root:translate(1, 2, 3)\nroot:rotate('z', 90)\nroot:scale(1, 2, 3)\n" RENDER);
}

static void check_turned(const RenderJob *job)
{
    const Affine x = affine_rotate(0, 30), y = affine_rotate(1, 30);
    assert_memory_equal(&child(job, 0)->transform, &x, sizeof x);
    assert_memory_equal(&child(job, 1)->transform, &y, sizeof y);
    assert_true(child(job, 2)->transform.m[0][0] == -1 && child(job, 2)->transform.m[0][3] == 0);
}

static void axes_and_negative_scales(void **state)
{
    (void)state;
    run_job(ROOT "local x, y, s = gr.node('x'), gr.node('y'), gr.node('s')\n"
                 "x:rotate('X', 30)\ny:rotate('y', 30)\ns:scale(-1, 1, 1)\n"
                 "for _, n in ipairs {x, y, s} do root:add_child(n) end\n" RENDER,
            check_turned);
}

static void a_refused_transform_leaves_the_node_alone(void **state)
{
    (void)state;
    run_job(ROOT "root:scale(1, 2, 3)\nroot:rotate('z', 90)\nroot:translate(1, 2, 3)\n"
                 "for _, s in ipairs {0, 1e-320, 1e308, 0/0, 1/0} do assert(not pcall(root.scale, root, 1e10, s, 1)) end\n" RENDER,
            check_moved);
}

/* ---- gr.render ---- */

static void check_plain_job(const RenderJob *job)
{
    assert_string_equal(job->where, SCRIPT ":2: ");
    assert_string_equal(job->file, "out/o.png");
    assert_int_equal(job->width, 640);
    assert_int_equal(job->height, 480);
    assert_true(job->eye.x == 1 && job->eye.y == 2 && job->eye.z == 3);
    assert_true(job->view.z == -10 && job->up.y == 5 && job->fov_deg == 50);
    assert_true(job->ambient.r == 0.5f && job->ambient.g == 0.25f && job->ambient.b == 0);
    assert_int_equal(job->light_count, 2);
    assert_true(job->lights[1].position.x == 4 && job->lights[1].colour.g == 0.5f && job->lights[1].falloff[2] == 3);
    assert_int_equal(job->options.given, 0);
}

static void check_options(const RenderJob *job)
{
    assert_int_equal(job->options.given, OPTION_SAMPLES | OPTION_MAX_DEPTH | OPTION_BACKGROUND | OPTION_SEED);
    assert_int_equal(job->options.samples, 16);
    assert_int_equal(job->options.max_depth, 0);
    assert_true(job->options.background.g == 0.5f);
    assert_int_equal(job->options.seed, 12345);
}

static void check_one_option(const RenderJob *job)
{
    assert_int_equal(job->options.given, OPTION_SEED);
    assert_int_equal(job->options.seed, 3);
    assert_int_equal(job->light_count, 1);
}

static void render_passes_everything_on(void **state)
{
    (void)state;
    run_job(ROOT "gr.render(root, 'out/o.png', 640.9, 480, {1,2,3}, {0,0,-10}, {0,5,1}, 50, {0.5,0.25,0}, "
                 "{" LIGHT ", gr.light({4,5,6}, {0.25,0.5,1}, {1,2,3})})",
            check_plain_job);
    run_job(ROOT "gr.render(root, 'o.png', 8, 8, " VIEW ", {" LIGHT "}, "
                 "{samples = 16, max_depth = 0, background = {1, 0.5, 0}, seed = 12345})",
            check_options);
    run_job(ROOT "root:render('o.png', 8, 8, " VIEW ", {" LIGHT "}, {seed = 3})", check_one_option);
    assert_int_equal(seen.warnings, 0);
}

static void a_script_may_render_often(void **state)
{
    (void)state;
    run_ok(ROOT "for i = 1, 5 do root:translate(1, 0, 0)\n" RENDER " end");
    assert_int_equal(seen.renders, 5);
}

static void check_one_light(const RenderJob *job) { assert_int_equal(job->light_count, 1); }
static void check_no_light(const RenderJob *job) { assert_int_equal(job->light_count, 0); }

static void nil_ends_the_lights(void **state)
{
    (void)state;
    run_job(ROOT "gr.render(root, 'o.png', 8, 8, " VIEW ", {" LIGHT ", undefined})", check_one_light);
    run_job(ROOT "gr.render(root, 'o.png', 8, 8, " VIEW ", {" LIGHT ", nil, " LIGHT "})", check_one_light);
    assert_int_equal(seen.warnings, 0);
    run_job(ROOT "gr.render(root, 'o.png', 8, 8, " VIEW ", {undefined, " LIGHT "})", check_no_light);
    assert_string_equal(seen.warning, SCRIPT ":2: gr.render: the list of lights is empty: ambient light only");
    seen.check = NULL;
    seen.warnings = 0;
    run_ok(ROOT "for i = 1, 3 do gr.render(root, 'o.png', 8, 8, " VIEW ", {}) end");
    assert_int_equal(seen.warnings, 1);
}

static void surplus_arguments_are_warned_of_once(void **state)
{
    (void)state;
    run_ok(ROOT "for i = 1, 3 do gr.sphere('s', 1, 2) end\n" RENDER);
    assert_int_equal(seen.warnings, 1);
    assert_string_equal(seen.warning, SCRIPT ":2: gr.sphere: 2 surplus arguments ignored");
    seen.warnings = 0;
    run_ok(ROOT "root:translate(1, 2, 3, 4)\ngr.material({1,1,1}, {1,1,1}, 5, 0.5)\ngr.mesh('m', 'x.obj', 'z')\n"
                "gr.sphere('s', nil, nil)\n"
                "root:render('o.png', 8, 8, " VIEW ", {" LIGHT "}, 3)\n"
                "gr.render(root, 'o.png', 8, 8, " VIEW ", {" LIGHT "}, {}, 3)");
    assert_int_equal(seen.warnings, 5);
    assert_string_equal(seen.warning, SCRIPT ":7: gr.render: 1 surplus argument ignored");
}

static void a_script_without_a_picture_is_warned_of(void **state)
{
    (void)state;
    run_ok("local n = gr.node('n')");
    assert_int_equal(seen.warnings, 1);
    assert_string_equal(seen.warning, SCRIPT " never calls gr.render: there is no picture");
}

static void the_sinks_error_ends_the_script(void **state)
{
    (void)state;
    seen.fail = ERR_OUTPUT;
    run_fails(ROOT RENDER, ERR_OUTPUT, "the sink failed");
    assert_int_equal(seen.renders, 1);
    seen.renders = 0;
    run_fails(ROOT "pcall(gr.render, root, 'o.png', 8, 8, " VIEW ", {})\npcall(function() " RENDER " end)\nerror('later')",
              ERR_OUTPUT, "the sink failed");
    assert_int_equal(seen.renders, 1);
}

static void a_material_on_a_group_is_warned_of(void **state)
{
    (void)state;
    run_ok(ROOT "root:set_material(gr.material({1,1,1}, {1,1,1}, 5))\n" RENDER);
    assert_string_equal(seen.warning, SCRIPT ":2: node:set_material: 'root' is a group and has no surface of its own");
}

/* ---- mistakes ---- */

#define AT1 SCRIPT ":1: "

static void mistakes_name_the_line_and_what(void **state)
{
    (void)state;
    static const struct { const char *script, *message; } rows[] = {
        {"gr.spere('x')", "unknown command gr.spere (did you mean gr.sphere?)"},
        {"gr.teapot('x')", "unknown command gr.teapot"},
        {"gr.node('x'):add_chlid()", "unknown method node:add_chlid (did you mean node:add_child?)"},
        {"gr.node('x'):fly()", "unknown method node:fly"},
        {"gr.node()", "gr.node: name must be a string, but is missing"},
        {"gr.sphere({})", "gr.sphere: name must be a string, but is a table"},
        {"gr.cube(gr.node('x'))", "gr.cube: name must be a string, but is a node"},
        {"gr.cone('a\\0b')", "gr.cone: name has a zero byte in it"},
        {"gr.cylinder(true)", "gr.cylinder: name must be a string, but is a boolean"},
        {"gr.joint('j', {1, 2}, {1, 2, 3})", "gr.joint: x range must be a table of 3 numbers, but has 2"},
        {"gr.joint('j', {1, 2, 3}, 4)", "gr.joint: y range must be a table of 3 numbers, but is 4"},
        {"gr.nh_sphere('s', {0, 0, 0}, -1)", "gr.nh_sphere: radius must be a positive number, but is -1"},
        {"gr.nh_sphere('s', {0, 0, 0}, 0)", "gr.nh_sphere: radius must be a positive number, but is 0"},
        {"gr.nh_sphere('s', {0, 0, 0})", "gr.nh_sphere: radius must be a number, but is missing"},
        {"gr.nh_sphere('s', {0, 0}, 1)", "gr.nh_sphere: point must be a table of 3 numbers, but has 2"},
        {"gr.nh_sphere('s', {0, 0, 0}, 1e-320)", "gr.nh_sphere: radius must be a size that can be inverted, but is "
                                                 "9.9998886718268e-321"},
        {"gr.nh_box('b', {0, 'x', 0}, 1)", "gr.nh_box: point[2] must be a number, but is 'x'"},
        {"gr.nh_box('b', {0, 0, 0}, 0/0)", "gr.nh_box: size must be a finite number, but is nan"},
        {"gr.torus('t', 0)", "gr.torus: minor radius must be a positive number, but is 0"},
        {"gr.torus('t', 1/0)", "gr.torus: minor radius must be a finite number, but is inf"},
        {"gr.mesh('m', 5)", "gr.mesh: mesh must be the path of an OBJ file or a table of vertices, but is 5"},
        {"gr.mesh('m', '')", "gr.mesh: file is empty"},
        {"gr.mesh('m', {{0,0,0}})", "gr.mesh: faces must be a table, but is missing"},
        {"gr.mesh('m', {{0,0,0},{1,0}}, {})", "gr.mesh: vertices[2] must be a table of 3 numbers, but has 2"},
        {"gr.mesh('m', {{0,0,0},{1,0,0/0}}, {})", "gr.mesh: vertices[2][3] must be a finite number, but is nan"},
        {"gr.mesh('m', {7}, {})", "gr.mesh: vertices[1] must be a table of 3 numbers, but is 7"},
        {"gr.mesh('m', {{0,0,0}}, {{0,0,0}, 3})", "gr.mesh: faces[2] must be a table, but is 3"},
        {"gr.mesh('m', {{0,0,0}}, {{0,-1,0}})", "gr.mesh: faces[1][2] must be the number of a vertex, counted from 0, but is -1"},
        {"gr.mesh('m', {{0,0,0}}, {{0,0.5,0}})",
         "gr.mesh: faces[1][2] must be the number of a vertex, counted from 0, but is 0.5"},
        {"gr.mesh('m', {{0,0,0}}, {{0,0,1}})", "gr.mesh: face 1: vertex 1 of 1"},
        {"gr.fractal_mountain('f', {1,1,0}, 0, 1)", "gr.fractal_mountain: size must be three positive numbers"},
        {"gr.fractal_mountain('f', {1,1,1}, -1, 1)", "gr.fractal_mountain: roughness must be a number of at least 0, but is -1"},
        {"gr.fractal_mountain('f', {1,1,1}, 0, 1.5)",
         "gr.fractal_mountain: number of subdivisions must be an integer of at least 0, but is 1.5"},
        {"gr.fractal_mountain('f', {1,1,1}, 0, 1, 'x')", "gr.fractal_mountain: seed must be an integer, but is 'x'"},
        {"gr.tree('t', 'a.grammar', -1)", "gr.tree: depth must be an integer of at least 0, but is -1"},
        {"gr.tree('t', 'a.grammar', 1, gr.cube('c'))", "gr.tree: leaf must be a node, but is missing"},
        {"gr.tree('t', 'a.grammar', 1, 'x')", "gr.tree: trunk must be a node, but is 'x'"},
        {"gr.union('u', gr.node('a'), gr.cube('b'))", "gr.union: operand A, 'a', is a group, not a solid"},
        {"local b = gr.cube('b') b:add_child(gr.node('n')) gr.diff('u', gr.cube('a'), b)",
         "gr.diff: operand B, 'b', has children"},
        {"gr.intersect('u', gr.cube('a'), gr.fractal_mountain('m', {1,1,1}, 0, 0))",
         "gr.intersect: operand B, 'm', is a mountain, which has no bottom"},
        {"local c = gr.cube('c') gr.union('u', gr.tree('t', 'g', 1, c, c), c)",
         "gr.union: operand A, 't', is a tree, not a solid"},
        {"gr.union('u', gr.cube('a'))", "gr.union: operand B must be a node, but is missing"},
        {"gr.material({1,1}, {1,1,1}, 1)", "gr.material: kd must be a table of 3 numbers, but has 2"},
        {"gr.material({1,1,1}, {1,1,1e39}, 1)", "gr.material: ks has a number over 3.4e38"},
        {"gr.material({1,1,1}, {1,1,1}, -1)", "gr.material: exponent must be a number of at least 0, but is -1"},
        {"gr.material({1,1,1}, {1,1,1})", "gr.material: exponent must be a number, but is missing"},
        {"gr.reflective_material({1,1,1}, {1,1,1}, 1, 1.5)",
         "gr.reflective_material: reflected share must be a number from 0 to 1, but is 1.5"},
        {"gr.light({1,2,3}, {1,1,1}, {0,0,0})",
         "gr.light: falloff must not be {0, 0, 0}: the light would be infinitely bright"},
        {"gr.light({1,2,3,4}, {1,1,1}, {1,0,0})", "gr.light: position must be a table of 3 numbers, but has 4"},
        {"gr.texture()", "gr.texture: file must be a string, but is missing"},
        {"gr.sphere('s'):set_texture('a.png')", "node:set_texture: texture must be a texture that gr.texture made, but is 'a.png'"},
        {"gr.node('g'):add_texture('a.png')", "node:add_texture: 'g' is a group and has no surface of its own"},
        {"local c = gr.cube('c') gr.tree('t', 'g', 1, c, c):add_texture('a.png')",
         "node:add_texture: 't' is a tree: give its trunk and leaf textures"},
        {"local c = gr.cube('c') gr.union('u', c, c):set_texture(gr.texture('a.png'))",
         "node:set_texture: 'u' is CSG: give its operands textures"},
        {"local c = gr.cube('c') gr.union('u', c, c):set_material(gr.material({1,1,1},{1,1,1},1))",
         "node:set_material: 'u' is CSG: its surface has the materials of its operands"},
        {"gr.cube('c'):set_material(gr.node('x'))", "node:set_material: material must be a material, but is a node"},
        {"gr.cube('c'):mesh_add_bumps({0,0}, 1, 1)", "node:mesh_add_bumps: 'c' is not a mesh"},
        {"gr.mesh('m', 'x'):mesh_add_bumps({0,0,0}, 1, 1)", "node:mesh_add_bumps: centre must be a table of 2 numbers, but has 3"},
        {"gr.mesh('m', 'x'):mesh_add_bumps({0,0}, 1, 0)", "node:mesh_add_bumps: period must be a positive number, but is 0"},
        {"gr.mesh('m', 'x'):mesh_add_bumps({0,0}, -1, 1)",
         "node:mesh_add_bumps: number of periods must be a number of at least 0, but is -1"},
        {"gr.node('n'):scale(1, 0, 1)", "node:scale: y is 0: nothing would be left of 'n'"},
        {"gr.node('n'):scale(1, 1)", "node:scale: z must be a number, but is missing"},
        {"gr.node('n'):scale(1, 1, 1e-320)", "node:scale: the matrix of 'n' can't be inverted or represented then"},
        {"local n = gr.node('n') n:scale(1e300, 1, 1) n:scale(1e300, 1, 1)",
         "node:scale: the matrix of 'n' can't be inverted or represented then"},
        {"gr.node('n'):rotate('w', 1)", "node:rotate: axis must be 'x', 'y' or 'z', but is 'w'"},
        {"gr.node('n'):rotate('', 1)", "node:rotate: axis must be 'x', 'y' or 'z', but is ''"},
        {"gr.node('n'):rotate(1, 1)", "node:rotate: axis must be 'x', 'y' or 'z', but is 1"},
        {"gr.node('n'):rotate('x', 1/0)", "node:rotate: angle must be a finite number, but is inf"},
        {"gr.node('n'):translate(1, {}, 1)", "node:translate: y must be a number, but is a table"},
        {"gr.node('n').translate(1, 2, 3)", "node:translate: is called with ':' on a node, not on 1"},
        {"local n = gr.node('n') n:add_child(n)", "node:add_child: 'n' can't be its own child"},
        {"gr.node('n'):add_child('x')", "node:add_child: child must be a node, but is 'x'"},
        {"gr.node('n'):add_child()", "node:add_child: child must be a node, but is missing"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        char message[512];
        snprintf(message, sizeof message, AT1 "%s", rows[i].message);
        run_fails(rows[i].script, ERR_SCENE, message);
    }
}

static void cycles_are_refused(void **state)
{
    (void)state;
    static const char *const scripts[] = {
        "local a, b, c = gr.node('a'), gr.node('b'), gr.node('c')\na:add_child(b) b:add_child(c)\nc:add_child(a)",
        "local a, c = gr.sphere('a'), gr.node('c')\nc:add_child(gr.union('u', a, a))\na:add_child(c)",
        "local a, c = gr.sphere('a'), gr.node('c')\nc:add_child(gr.tree('t', 'g', 1, a, a))\na:add_child(c)",
    };
    for (size_t i = 0; i < sizeof scripts / sizeof scripts[0]; i++) {
        Err err;
        assert_false(run(scripts[i], &err));
        assert_int_equal(err.kind, ERR_SCENE);
        assert_memory_equal(err.text, SCRIPT ":3: node:add_child: ", strlen(SCRIPT ":3: node:add_child: "));
    }
}

static void renders_arguments_are_checked(void **state)
{
    (void)state;
    static const struct { const char *args; ErrKind kind; const char *message; } rows[] = {
        {"'x'", ERR_SCENE, "root must be a node, but is 'x'"},
        {"root, {}", ERR_SCENE, "file must be a string, but is a table"},
        {"root, ''", ERR_SCENE, "file is empty"},
        {"root, 'o', 0, 8", ERR_SCENE, "width must be at least 1, but is 0"},
        {"root, 'o', 8, 0.5", ERR_SCENE, "height must be at least 1, but is 0.5"},
        {"root, 'o', 8, -8", ERR_SCENE, "height must be at least 1, but is -8"},
        {"root, 'o', 8, 'x'", ERR_SCENE, "height must be a number, but is 'x'"},
        {"root, 'o', 1000000, 8", ERR_LIMIT, "width is 1000000: the limit is 65535 pixels"},
        {"root, 'o', 8, 65536", ERR_LIMIT, "height is 65536: the limit is 65535 pixels"},
        {"root, 'o', 65535, 65535", ERR_LIMIT, "65535 x 65535: the limit is 268435456 pixels"},
        {"root, 'o', 8, 8, {0,0}", ERR_SCENE, "eye must be a table of 3 numbers, but has 2"},
        {"root, 'o', 8, 8, {0,0,0/0}", ERR_SCENE, "eye[3] must be a finite number, but is nan"},
        {"root, 'o', 8, 8, {0,0,0}, {0,0,0}, {0,1,0}, 50", ERR_SCENE, "view is the zero vector"},
        {"root, 'o', 8, 8, {0,0,0}, {0,0,1}, {0,0,0}, 50", ERR_SCENE, "up is the zero vector"},
        {"root, 'o', 8, 8, {0,0,0}, {1e200,2e200,3e200}, {-0.1,-0.2,-0.3}, 50", ERR_SCENE, "up is parallel to view"},
        {"root, 'o', 8, 8, {0,0,0}, {0,0,1}, {0,1,0}, 0", ERR_SCENE, "fov must be an angle between 0 and 180 degrees, but is 0"},
        {"root, 'o', 8, 8, {0,0,0}, {0,0,1}, {0,1,0}, 180", ERR_SCENE,
         "fov must be an angle between 0 and 180 degrees, but is 180"},
        {"root, 'o', 8, 8, {0,0,0}, {0,0,1}, {0,1,0}, 50", ERR_SCENE, "ambient must be a table of 3 numbers, but is missing"},
        {"root, 'o', 8, 8, " VIEW, ERR_SCENE, "lights must be a table, but is missing"},
        {"root, 'o', 8, 8, " VIEW ", {" LIGHT ", 5}", ERR_SCENE, "lights[2] must be a light, but is 5"},
        {"root, 'o', 8, 8, " VIEW ", {}, {samples = 0}", ERR_SCENE,
         "options.samples must be an integer from 1 to 65536, but is 0"},
        {"root, 'o', 8, 8, " VIEW ", {}, {samples = '9x'}", ERR_SCENE,
         "options.samples must be an integer from 1 to 65536, but is '9x'"},
        {"root, 'o', 8, 8, " VIEW ", {}, {max_depth = -1}", ERR_SCENE,
         "options.max_depth must be an integer from 0 to 1000, but is -1"},
        {"root, 'o', 8, 8, " VIEW ", {}, {background = 1}", ERR_SCENE,
         "options.background must be a table of 3 numbers, but is 1"},
        {"root, 'o', 8, 8, " VIEW ", {}, {background = {1, 1, true}}", ERR_SCENE,
         "options.background[3] must be a number, but is a boolean"},
        {"root, 'o', 8, 8, " VIEW ", {}, {seed = 1.5}", ERR_SCENE, "options.seed must be an integer, but is 1.5"},
        {"root, 'o', 8, 8, " VIEW ", {}, {sample = 5}", ERR_SCENE, "unknown option 'sample' (did you mean 'samples'?)"},
        {"root, 'o', 8, 8, " VIEW ", {}, {colourful = true}", ERR_SCENE, "unknown option 'colourful'"},
        {"root, 'o', 8, 8, " VIEW ", {}, {5}", ERR_SCENE, "unknown option '1'"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        char script[512], message[512];
        snprintf(script, sizeof script, ROOT "gr.render(%s)", rows[i].args);
        snprintf(message, sizeof message, SCRIPT ":2: gr.render: %s", rows[i].message);
        run_fails(script, rows[i].kind, message);
    }
    assert_int_equal(seen.renders, 0);
}

static void errors_of_lua_are_one_line_with_its_place(void **state)
{
    (void)state;
    run_fails("x = = 3", ERR_SCENE, AT1 "unexpected symbol near '='");
    run_fails("\n\nspere()", ERR_SCENE, SCRIPT ":3: attempt to call a nil value (global 'spere')");
    run_fails("error('own')", ERR_SCENE, AT1 "own");
    run_fails("error('own', 0)", ERR_SCENE, AT1 "own");
    run_fails("error('two\\nlines')", ERR_SCENE, AT1 "two?lines");
    run_fails("error()", ERR_SCENE, AT1 "the script raised an error that is no text but nil");
    run_fails("error({})", ERR_SCENE, AT1 "the script raised an error that is no text but a table value");
    run_fails("error(42)", ERR_SCENE, AT1 "42");
    run_fails("error(setmetatable({}, {__tostring = function() return 'mine' end}))", ERR_SCENE, AT1 "mine");
    run_fails("string.rep()", ERR_SCENE, AT1 "bad argument #1 to 'rep' (string expected, got no value)");
    run_fails("coroutine.wrap(function()\ngr.node() end)()", ERR_SCENE,
              SCRIPT ":2: gr.node: name must be a string, but is missing");
    run_fails("local ok, e = pcall(dofile, 'none.lua') assert(not ok) error(e, 0)", ERR_INPUT,
              AT1 "can't open none.lua: No such file or directory");
    run_fails("local ok, e = pcall(dofile, 'none.lua') assert(not ok) error('other')", ERR_SCENE, AT1 "other");
}

static void a_stack_overflow_is_one_line(void **state)
{
    (void)state;
    run_fails("local function f() return 1 + f() end\nf()", ERR_SCENE, AT1 "stack overflow");
    Err err;
    assert_false(run("local t = setmetatable({}, {__index = function(t, k) return t[k + 1] end}) print(t[1])", &err));
    assert_int_equal(err.kind, ERR_SCENE);
    assert_non_null(strstr(err.text, "stack overflow"));
    assert_null(strchr(err.text, '\n'));
}

static void long_paths_stay_whole(void **state)
{
    (void)state;
    char path[600] = FOLDER;
    for (int i = 0; i < 20; i++) strcat(path, "a_folder_of_some_length/");
    strcat(path, "s.lua");
    const char *const scripts[] = {"x = = 3", "spere()", "gr.spere()", "string.rep()", "error('own')"};
    for (size_t i = 0; i < sizeof scripts / sizeof scripts[0]; i++) {
        Err err;
        put(path, scripts[i]);
        assert_false(run_with((SceneScript){.script = path}, &err));
        assert_memory_equal(err.text, path, strlen(path));
        assert_memory_equal(err.text + strlen(path), ":1: ", 4);
    }
}

static void what_is_missing_is_an_input_error(void **state)
{
    (void)state;
    Err err;
    assert_false(run_with((SceneScript){.script = FOLDER "none.lua"}, &err));
    assert_int_equal(err.kind, ERR_INPUT);
    assert_string_equal(err.text, "can't open " FOLDER "none.lua: No such file or directory");
    assert_false(run_with((SceneScript){.script = "build/"}, &err));
    assert_int_equal(err.kind, ERR_INPUT);
    run_fails("dofile('none.lua')", ERR_INPUT, AT1 "can't open none.lua: No such file or directory");
    run_fails("require 'some.module'", ERR_INPUT, AT1 "can't find the module 'some.module' as some/module.lua");
    run_fails("for l in io.lines('none.txt') do end", ERR_INPUT, AT1 "can't open none.txt: No such file or directory");
}

static void errors_in_other_files_name_those(void **state)
{
    (void)state;
    put(FOLDER "lib/inner.lua", "local function f()\n  gr.sphere()\nend\nf()\n");
    put(FOLDER "lib/broken.lua", "x =\n");
    run_fails("dofile('lib/inner.lua')", ERR_SCENE, FOLDER "lib/inner.lua:2: gr.sphere: name must be a string, but is missing");
    run_fails("require('lib.inner')", ERR_SCENE, FOLDER "lib/inner.lua:2: gr.sphere: name must be a string, but is missing");
    run_fails("dofile('lib/broken.lua')", ERR_SCENE, FOLDER "lib/broken.lua:2: unexpected symbol near <eof>");
}

/* ---- paths ---- */

static const char *expected_path;

static void check_path(const RenderJob *job) { assert_string_equal(child(job, 0)->mesh->path, expected_path); }

#define MESH_OF(path) "root:add_child(gr.mesh('m', '" path "'))\n"

static void inputs_are_looked_up_in_order(void **state)
{
    (void)state;
    Err err;
    const char *const include[] = {FOLDER "one", FOLDER "two/"};
    SceneScript script = {.script = SCRIPT, .include = include, .include_count = 2};
    seen.check = check_path;
    put(SCRIPT, ROOT MESH_OF("x.obj") RENDER);

    expected_path = "x.obj";
    assert_true(run_with(script, &err));
    put(FOLDER "two/x.obj", "");
    expected_path = FOLDER "two/x.obj";
    assert_true(run_with(script, &err));
    put(FOLDER "one/x.obj", "");
    expected_path = FOLDER "one/x.obj";
    assert_true(run_with(script, &err));
    put(FOLDER "x.obj", "");
    expected_path = FOLDER "x.obj";
    assert_true(run_with(script, &err));

    /* In the working directory; a folder is no file. */
    put(SCRIPT, ROOT MESH_OF("tests/test_scene_lua.c") RENDER);
    put(FOLDER "one/tests/test_scene_lua.c", "");
    expected_path = "tests/test_scene_lua.c";
    assert_true(run_with(script, &err));
    put(SCRIPT, ROOT MESH_OF("tests") RENDER);
    put(FOLDER "one/tests/x", "");
    expected_path = "tests";
    assert_true(run_with(script, &err));
    put(SCRIPT, ROOT MESH_OF("/nowhere/x.obj") RENDER);
    expected_path = "/nowhere/x.obj";
    assert_true(run_with(script, &err));
    assert_int_equal(seen.renders, 7);
}

static void inputs_lie_beside_the_file_that_names_them(void **state)
{
    (void)state;
    put(FOLDER "lib/part.lua", "function part() " MESH_OF("x.obj") " end\nreturn 5, 6\n");
    put(FOLDER "lib/x.obj", "");
    put(FOLDER "x.obj", "");
    expected_path = FOLDER "lib/x.obj";
    run_job(ROOT "local a, b = dofile('lib/part.lua')\nassert(a == 5 and b == 6)\npart()\n" RENDER, check_path);
    expected_path = FOLDER "x.obj";
    run_job(ROOT "dofile('lib/part.lua')\n" MESH_OF("x.obj") RENDER, check_path);

    /* A library opens what a scene names. */
    put(FOLDER "lib/reader.lua", "function first_line(path) for l in io.lines(path) do return l end end\n");
    put(FOLDER "data.txt", "here\n");
    run_ok("require('lib/reader')\nassert(first_line('data.txt') == 'here')");
}

static void modules_are_required_once(void **state)
{
    (void)state;
    put(FOLDER "m.lua", "count = (count or 0) + 1\nlocal name, path = ...\nreturn {name = name, path = path}\n");
    put(FOLDER "n/init.lua", "in_n = true\n");
    put(FOLDER "other/p.lua", "return 'p'\n");
    run_ok("local m, path = require('m')\n"
           "assert(require 'm' == m and count == 1 and m.name == 'm')\n"
           "assert(m.path == '" FOLDER "m.lua' and path == m.path)\n"
           "assert(package.loaded.m == m and require('string') == string)\n"
           "assert(require 'n' == true and in_n)\n"
           "package.loaded.m = nil\nassert(require('m') ~= m and count == 2)\n"
           "package.path = package.path .. ';other/?.lua'\nassert(require('p') == 'p')\n"
           "package.preload.q = function(...) return select('#', ...) end\nassert(require('q') == 2)\n");
}

/* ---- what a script has ---- */

static void libraries_are_an_explicit_list(void **state)
{
    (void)state;
    put(FOLDER "data.txt", "1\ntwo\n");
    run_ok("for _, n in ipairs {'table', 'string', 'math', 'utf8', 'coroutine', 'io', 'os', 'package'} do\n"
           "  assert(type(_G[n]) == 'table', n)\n  assert(package.loaded[n] == _G[n], n)\nend\n"
           "assert(debug == nil and package.loadlib == nil and package.searchers == nil)\n"
           "for _, n in ipairs {'execute', 'remove', 'rename', 'exit', 'tmpname', 'setlocale'} do assert(os[n] == nil, n) end\n"
           "for _, n in ipairs {'clock', 'date', 'time', 'difftime', 'getenv'} do assert(os[n], n) end\n"
           "for _, n in ipairs {'popen', 'output', 'tmpfile'} do assert(io[n] == nil, n) end\n"
           "local f = assert(io.open('data.txt'))\n"
           "assert(f:read('*n') == 1 and f:read('*l') == '' and f:read('*a') == 'two\\n')\nf:close()\n"
           "io.input('data.txt')\nassert(io.read() == '1')\nassert(io.type(io.stderr) == 'file')\n"
           "assert(io.open('none.txt') == nil)\n"
           "assert(load('return 7')() == 7 and load(string.dump(function() end)) == nil)\n"
           "assert(load('return x', 'n', 't', {x = 3})() == 3)\n"
           "assert(loadfile('none.lua') == nil)\n");
    run_fails("io.open('x', 'w')", ERR_SCENE, AT1 "io.open: a scene can't write files (mode 'w')");
    run_fails("io.open('x', 'r+b')", ERR_SCENE, AT1 "io.open: a scene can't write files (mode 'r+b')");
}

static void words_for_the_script_are_its_arguments(void **state)
{
    (void)state;
    Err err;
    const char *const args[] = {"a b", "", "-x"};
    put(SCRIPT, "local a, b, c, d = ...\nassert(a == 'a b' and b == '' and c == '-x' and d == nil)\n"
                "assert(#arg == 3 and arg[1] == a and arg[3] == c and arg[0] == '" SCRIPT "')\n");
    if (!run_with((SceneScript){.script = SCRIPT, .args = args, .arg_count = 3}, &err)) fail_msg("%s", err.text);
}

static void random_numbers_are_the_same_in_every_run(void **state)
{
    (void)state;
    Err first, second, seeded;
    assert_false(run("error('' .. math.random(1 << 40))", &first));
    assert_false(run("error('' .. math.random(1 << 40))", &second));
    assert_string_equal(first.text, second.text);
    assert_false(run("math.randomseed(77) error('' .. math.random(1 << 40))", &seeded));
    assert_string_not_equal(first.text, seeded.text);
}

static void legacy_names_exist_only_in_legacy_scripts(void **state)
{
    (void)state;
    run_legacy("assert(unpack({1, 2, 3}) == 1 and table.getn {5, 6} == 2 and math.pow(2, 10) == 1024)\n"
               "assert(math.mod(7, 4) == 3 and loadstring('return 3')() == 3)\n"
               "local n = 0 for w in string.gfind('a b c', '%a') do n = n + 1 end assert(n == 3)\n"
               "local s = '' table.foreach({a = 1, b = 2}, function(k, v) s = s .. k .. v end) assert(s == 'a1b2')\n"
               "assert(table.foreachi({4, 5, 6}, function(i, v) if v == 5 then return i end end) == 2)\n");
    run_ok("assert(unpack == nil and table.getn == nil and string.gfind == nil and loadstring == nil)");
}

/* ---- the order of pairs and next ---- */

static void pairs_goes_in_a_fixed_order(void **state)
{
    (void)state;
    run_ok("local function list(t)\n  local s = {}\n  for k in pairs(t) do s[#s + 1] = tostring(k) end\n"
           "  return table.concat(s, ' ')\nend\n"
           "local t = {b = 1, a = 1, B = 1, aa = 1, [''] = 1, [3] = 1, [1] = 1, [-2] = 1, [2.5] = 1, [1e300] = 1,\n"
           "  [math.maxinteger] = 1, [math.mininteger] = 1, [2^53] = 1, [2^53 + 1] = 1, [1/0] = 1, [-1/0] = 1,\n"
           "  [true] = 1, [false] = 1, ['\\xff'] = 1, ['a\\0b'] = 1, [gr.node('n2')] = 1}\n"
           "local got = list(t)\n"
           "local want = '-inf -9223372036854775808 -2 1 2.5 3 9007199254740992 9223372036854775807 1e+300 inf  '\n"
           "  .. 'B a a\\0b aa b \\xff ' .. \"node 'n2'\" .. ' false true'\n"
           "assert(got == want, got)\n"
           "assert(list({10, 20, 30, nil, 50}) == '1 2 3 5')\n"
           "assert(list({}) == '')\n"
           "local nodes, names = {}, {}\n"
           "for i = 1, 50 do names[i] = gr.node(string.format('%02d', i)) end\n"
           "for i = 50, 1, -1 do nodes[names[i]] = i end\n"
           "local i = 0\nfor n, v in pairs(nodes) do i = i + 1 assert(n == names[i] and v == i) end\nassert(i == 50)\n"
           "local keys = {}\nfor i = 1, 20 do keys[{}] = i keys[function() return i end] = i end\n"
           "i = 0 for _ in pairs(keys) do i = i + 1 end assert(i == 40)\n");
}

static void fields_may_change_during_a_traversal(void **state)
{
    (void)state;
    run_ok("local function new() local t = {} for i = 1, 100 do t['k' .. i] = i end return t end\n"
           "local t, n = new(), 0\n"
           "for k in pairs(t) do t[k] = nil n = n + 1 end\nassert(n == 100 and next(t) == nil)\n"
           "t, n = new(), 0\n"
           "for k, v in pairs(t) do t[k] = v + 1 n = n + v end\nassert(n == 5050)\n"
           "t, n = new(), 0\n"
           "for k in pairs(t) do for j in pairs(t) do n = n + 1 end end\nassert(n == 10000)\n"
           "t, n = new(), 0\n"
           "for k in pairs(t) do for j in pairs(t) do if j ~= k then t[j] = nil end end n = n + 1 end\nassert(n == 1)\n"
           "t, n = new(), 0\n"
           "for k in pairs(t) do t['k50'] = nil n = n + 1 collectgarbage() if n == 3 then break end end\n"
           "t.new = 1\nlocal found\nfor k in pairs(t) do found = found or k == 'new' end\nassert(found)\n");
}

static void next_follows_the_same_order(void **state)
{
    (void)state;
    run_ok("local t = {z = 1, y = 2, 7, 8}\n"
           "assert(next({}) == nil and next({nil}) == nil)\n"
           "local k, v = next(t) assert(k == 1 and v == 7)\n"
           "assert(next(t, 1) == 2 and next(t, 2) == 'y' and next(t, 'y') == 'z' and next(t, 'z') == nil)\n"
           "assert(next(t, 1) == 2)\n"
           "local s = '' for k, v in next, t do s = s .. k .. v end assert(s == '1728y2z1', s)\n"
           "t.y = nil assert(next(t, 'y') == 'z')\n"
           "assert(select('#', next({})) == 1)\n"
           "assert(not pcall(next) and not pcall(next, 5) and not pcall(pairs))\n");
}

static void a_pairs_metamethod_is_called(void **state)
{
    (void)state;
    run_ok("local t = setmetatable({}, {__pairs = function(t) return function(_, k) if not k then return 1, 2 end end, t end})\n"
           "local n = 0 for k, v in pairs(t) do n = n + k + v end assert(n == 3)\n"
           "local p = setmetatable({a = 1}, {__index = {b = 2}})\n"
           "n = 0 for k, v in pairs(p) do n = n + v end assert(n == 1)\n");
}

/* Were a step to cost a search through the table, this would take hours. */
static void a_long_traversal_takes_little_time(void **state)
{
    (void)state;
    run_ok("local t = {} for i = 1, 100000 do t['k' .. i] = i end\n"
           "local n = 0 for k, v in pairs(t) do n = n + v end assert(n == 5000050000)\n"
           "for k, v in next, t do n = n - v t[k] = nil end assert(n == 0 and next(t) == nil)\n");
}

/* ---- memory ---- */

static const char everything[] =
    ROOT "local m, r = gr.material({1,1,1}, {1,1,1}, 5), gr.reflective_material({1,1,1}, {1,1,1}, 5, 0.5)\n"
         "local all = {gr.sphere('s'), gr.cube('c'), gr.cylinder('y'), gr.cone('o'), gr.torus('t', 0.25),\n"
         "  gr.nh_sphere('ns', {1, 2, 3}, 4), gr.nh_box('nb', {1, 2, 3}, 4), gr.joint('j', {0, 0, 0}, {0, 0, 0}),\n"
         "  gr.mesh('f', 'x.obj'), gr.mesh('v', {{0,0,0}, {1,0,0}, {0,1,0}}, {{0,1,2}}), gr.fractal_mountain('m', {1,1,1}, 0, 1),\n"
         "  gr.tree('g', 'x.grammar', 1, gr.cube('a'), gr.cube('b')), gr.union('u', gr.cube('a'), gr.cone('b'))}\n"
         "for k, n in pairs(all) do root:add_child(n) n:translate(k, 0, 0) end\n"
         "for k, n in pairs {x = all[1], y = all[2]} do n:set_material(m) n:add_texture('x.png') end\n"
         "all[9]:mesh_add_bumps({0, 0}, 1, 1)\nall[10]:set_material(r)\nall[10]:set_texture(gr.texture('y.png'))\n" RENDER;

static void every_failed_allocation_is_handled(void **state)
{
    (void)state;
    run_ok(everything);
    for (int only = 0; only < 2; only++) {
        for (long n = 1;; n++) {
            Err err = {ERR_NONE, ""};
            (only ? alloc_fail_only : alloc_fail_at)(n);
            bool ok = run_with((SceneScript){.script = SCRIPT}, &err);
            if (!alloc_fail_stop()) {
                assert_true(ok);
                break;
            }
            if (!ok && err.kind != ERR_LIMIT) fail_msg("allocation %ld: %d %s", n, (int)err.kind, err.text);
        }
    }
}

static void a_script_that_takes_all_memory_meets_a_limit(void **state)
{
    (void)state;
    Err err;
    put(SCRIPT, "local t = {} for i = 1, 1e9 do t[i] = {} end");
    alloc_fail_at(20000);
    bool ok = run_with((SceneScript){.script = SCRIPT}, &err);
    assert_true(alloc_fail_stop());
    assert_false(ok);
    assert_int_equal(err.kind, ERR_LIMIT);
    assert_string_equal(err.text, "out of memory for " SCRIPT);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup(primitives_become_nodes, start),
        cmocka_unit_test_setup(meshes_have_a_source, start),
        cmocka_unit_test_setup(csg_and_trees_keep_their_parts, start),
        cmocka_unit_test_setup(materials_textures_and_bumps_are_given, start),
        cmocka_unit_test_setup(transforms_apply_in_the_order_written, start),
        cmocka_unit_test_setup(axes_and_negative_scales, start),
        cmocka_unit_test_setup(a_refused_transform_leaves_the_node_alone, start),
        cmocka_unit_test_setup(render_passes_everything_on, start),
        cmocka_unit_test_setup(a_script_may_render_often, start),
        cmocka_unit_test_setup(nil_ends_the_lights, start),
        cmocka_unit_test_setup(surplus_arguments_are_warned_of_once, start),
        cmocka_unit_test_setup(a_script_without_a_picture_is_warned_of, start),
        cmocka_unit_test_setup(the_sinks_error_ends_the_script, start),
        cmocka_unit_test_setup(a_material_on_a_group_is_warned_of, start),
        cmocka_unit_test_setup(mistakes_name_the_line_and_what, start),
        cmocka_unit_test_setup(cycles_are_refused, start),
        cmocka_unit_test_setup(renders_arguments_are_checked, start),
        cmocka_unit_test_setup(errors_of_lua_are_one_line_with_its_place, start),
        cmocka_unit_test_setup(a_stack_overflow_is_one_line, start),
        cmocka_unit_test_setup(long_paths_stay_whole, start),
        cmocka_unit_test_setup(what_is_missing_is_an_input_error, start),
        cmocka_unit_test_setup(errors_in_other_files_name_those, start),
        cmocka_unit_test_setup(inputs_are_looked_up_in_order, start),
        cmocka_unit_test_setup(inputs_lie_beside_the_file_that_names_them, start),
        cmocka_unit_test_setup(modules_are_required_once, start),
        cmocka_unit_test_setup(libraries_are_an_explicit_list, start),
        cmocka_unit_test_setup(words_for_the_script_are_its_arguments, start),
        cmocka_unit_test_setup(random_numbers_are_the_same_in_every_run, start),
        cmocka_unit_test_setup(legacy_names_exist_only_in_legacy_scripts, start),
        cmocka_unit_test_setup(pairs_goes_in_a_fixed_order, start),
        cmocka_unit_test_setup(fields_may_change_during_a_traversal, start),
        cmocka_unit_test_setup(next_follows_the_same_order, start),
        cmocka_unit_test_setup(a_pairs_metamethod_is_called, start),
        cmocka_unit_test_setup(a_long_traversal_takes_little_time, start),
        cmocka_unit_test_setup(every_failed_allocation_is_handled, start),
        cmocka_unit_test_setup(a_script_that_takes_all_memory_meets_a_limit, start),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
