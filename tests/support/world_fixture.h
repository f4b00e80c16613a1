/* Small scenes built without a script, for tests of compile and render. */
#ifndef RT_SUPPORT_WORLD_FIXTURE_H
#define RT_SUPPORT_WORLD_FIXTURE_H

#include "render.h"
#include "scene/compile.h"
#include "scene/job.h"

typedef struct {
    Scene *scene;
    Node *root;
    Light light[4];
    RenderJob job;
    World *world;
    CompileStats stats;
    Err err;
} WorldFixture;

/* An empty scene seen from (0,0,10) toward -z at 45 degrees, 64 x 48 pixels, no light, ambient 0. */
void fixture_create(WorldFixture *f);
void fixture_destroy(WorldFixture *f);

/* A child of `parent` (NULL: the root) with a primitive; the fixture's scene owns it. */
Node *fixture_prim(WorldFixture *f, Node *parent, Prim *prim, Rgb kd, Rgb ks, double exponent, double mirror);
Node *fixture_node(WorldFixture *f, Node *parent, NodeKind kind, const char *name);
const Material *fixture_material(WorldFixture *f, Rgb kd, Rgb ks, double exponent, double mirror);
void fixture_light(WorldFixture *f, Vec3 position, Rgb colour, double c0, double c1, double c2);

/* True if it compiles; otherwise f->err says why. */
bool fixture_compile(WorldFixture *f);

/* Settings for the whole picture of 8 bits with one sample, one thread and a black background. */
RenderSettings fixture_settings(const WorldFixture *f);

/* Renders (it must work) into a new film of the settings' format that the caller frees. */
uint8_t *fixture_render(WorldFixture *f, const RenderSettings *settings, RenderStats *stats);

#endif
