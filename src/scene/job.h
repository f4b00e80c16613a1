/* One call of gr.render: what the script wants drawn. Built by scene_lua.c, consumed by a sink that Main.c supplies. */
#ifndef RT_SCENE_JOB_H
#define RT_SCENE_JOB_H

#include <stdbool.h>
#include <stdint.h>

#include "common/colour.h"
#include "common/err.h"
#include "common/picture.h"
#include "common/vec.h"
#include "node/light.h"
#include "node/node.h"

/* Options that a script or the command line may give; `given` says which were. A new option is a field and a bit here,
 * a row of the table in scene_lua.c and one in Main.c. */
enum {
    OPTION_SAMPLES = 1 << 0,
    OPTION_MAX_DEPTH = 1 << 1,
    OPTION_BACKGROUND = 1 << 2,
    OPTION_SEED = 1 << 3,
};

typedef struct {
    unsigned given;
    uint32_t samples;    /* per pixel, >= 1 */
    uint32_t max_depth;  /* mirror bounces, >= 0 */
    Rgb background;
    uint64_t seed;       /* of the samples; never changes the geometry */
} RenderOptions;

enum { DEFAULT_SAMPLES = 9, DEFAULT_MAX_DEPTH = 4, MAX_SAMPLES = 65536, MAX_MAX_DEPTH = 1000 };

typedef struct {
    Scene *scene;
    Node *root;
    const char *where;     /* "temple.lua:41: " */
    const char *file;      /* the picture's path as the script gave it */
    uint32_t width, height;
    Vec3 eye, view, up;    /* view is a direction; neither it nor up is 0, and they aren't parallel */
    double fov_deg;        /* the full vertical angle, in (0, 180) */
    Rgb ambient;
    const Light *lights;
    uint32_t light_count;
    RenderOptions options;
} RenderJob;

/* Who gets the jobs. False and *err end the script with that error (where is already in err->text if it is wanted). */
typedef struct {
    bool (*render)(void *context, const RenderJob *job, Err *err);
    void (*warn)(void *context, const char *text);  /* one line without newline, with its place in front */
    void *context;
} RenderSink;

#endif
