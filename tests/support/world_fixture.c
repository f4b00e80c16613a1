#include "support/world_fixture.h"

#include <stdlib.h>

#include "support/check.h"

void fixture_create(WorldFixture *f)
{
    *f = (WorldFixture){.scene = scene_create()};
    CHECK(f->scene);
    f->root = scene_add_node(f->scene, NODE_GROUP, "root", "scene.lua:1: ");
    CHECK(f->root);
    f->job = (RenderJob){.scene = f->scene, .root = f->root, .where = "scene.lua:9: ", .file = "out.png", .width = 64,
                         .height = 48, .eye = {0, 0, 10}, .view = {0, 0, -1}, .up = {0, 1, 0}, .fov_deg = 45,
                         .lights = f->light};
}

void fixture_destroy(WorldFixture *f)
{
    world_destroy(f->world);
    scene_destroy(f->scene);
}

const Material *fixture_material(WorldFixture *f, Rgb kd, Rgb ks, double exponent, double mirror)
{
    Material *m = phong_create(kd, ks, exponent, mirror);
    CHECK(m && scene_own(f->scene, m, free));
    return m;
}

Node *fixture_node(WorldFixture *f, Node *parent, NodeKind kind, const char *name)
{
    Node *node = scene_add_node(f->scene, kind, name, "scene.lua:2: ");
    CHECK(node && node_add_child(f->scene, parent ? parent : f->root, node, NULL));
    return node;
}

static void free_prim(void *prim) { prim_destroy(prim); }

Node *fixture_prim(WorldFixture *f, Node *parent, Prim *prim, Rgb kd, Rgb ks, double exponent, double mirror)
{
    CHECK(prim && scene_own(f->scene, prim, free_prim));
    Node *node = fixture_node(f, parent, NODE_PRIM, "thing");
    node->prim = prim;
    node->material = fixture_material(f, kd, ks, exponent, mirror);
    return node;
}

void fixture_light(WorldFixture *f, Vec3 position, Rgb colour, double c0, double c1, double c2)
{
    f->light[f->job.light_count++] = (Light){position, colour, {c0, c1, c2}};
}

bool fixture_compile(WorldFixture *f)
{
    world_destroy(f->world);
    CompileSettings settings = {0};
    f->world = world_compile(&f->job, &settings, &f->stats, &f->err);
    return f->world != NULL;
}

RenderSettings fixture_settings(const WorldFixture *f)
{
    return (RenderSettings){.width = f->job.width, .height = f->job.height, .x1 = f->job.width, .y1 = f->job.height,
                            .samples = 1, .max_depth = DEFAULT_MAX_DEPTH, .has_background = true, .threads = 1};
}

uint8_t *fixture_render(WorldFixture *f, const RenderSettings *s, RenderStats *stats)
{
    RenderStats own;
    uint8_t *film = malloc(film_pixel_bytes(s->format) * (s->x1 - s->x0) * (s->y1 - s->y0));
    RenderOutcome outcome;
    CHECK(film && render(f->world, s, film, stats ? stats : &own, &outcome, &f->err));
    outcome_destroy(&outcome);
    return film;
}
