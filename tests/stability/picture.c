#include "stability/picture.h"

#include <stdio.h>
#include <stdlib.h>

#include "render.h"
#include "scene/compile.h"
#include "scene_lua.h"
#include "support/check.h"
#include "support/test_file.h"

static void note_warning(void *context, const char *text)
{
    Picture *picture = context;
    picture->warnings++;
    snprintf(picture->warning, sizeof picture->warning, "%s", text);
}

static bool draw(void *context, const RenderJob *job, Err *err)
{
    Picture *picture = context;
    CompileSettings compile = {.warn = note_warning, .warn_context = picture};
    CompileStats compile_stats;
    World *world = world_compile(job, &compile, &compile_stats, err);
    if (!world) return false;
    const RenderOptions *o = &job->options;
    RenderSettings s = {.width = job->width, .height = job->height, .x1 = job->width, .y1 = job->height, .samples = 1,
                        .max_depth = o->given & OPTION_MAX_DEPTH ? o->max_depth : DEFAULT_MAX_DEPTH,
                        .has_background = true, .threads = 1};
    if (o->given & OPTION_BACKGROUND) s.background = o->background;
    free(picture->rgb);
    picture->width = job->width;
    picture->height = job->height;
    picture->rgb = malloc((size_t)3 * job->width * job->height);
    CHECK(picture->rgb != NULL);
    RenderStats stats;
    RenderOutcome outcome;
    bool ok = render(world, &s, picture->rgb, &stats, &outcome, err);
    if (ok) outcome_destroy(&outcome);
    if (ok && stats.not_finite > 0) ok = err_set(err, ERR_SCENE, "a sample is no number");
    world_destroy(world);
    return ok;
}

Picture picture_run(const char *name, const char *script, const char *const *words)
{
    Picture picture = {.rgb = NULL};
    SceneScript s = {.script = test_file(name, script), .args = words};
    while (words && words[s.arg_count]) s.arg_count++;
    const RenderSink sink = {draw, note_warning, &picture};
    if (!scene_lua_run(&s, &sink, &picture.err)) {
        CHECK(picture.err.kind != ERR_NONE);
        free(picture.rgb);
        picture.rgb = NULL;
    }
    return picture;
}

void picture_free(Picture *picture)
{
    free(picture->rgb);
    picture->rgb = NULL;
}

static int difference(const uint8_t *a, const uint8_t *b)
{
    int most = 0;
    for (int k = 0; k < 3; k++)
        if (abs(a[k] - b[k]) > most) most = abs(a[k] - b[k]);
    return most;
}

void picture_compare(Row *row, const Picture *a, const Picture *b, bool mirrored, unsigned allowed, const char *what)
{
    if (!a->rgb || !b->rgb || a->width != b->width || a->height != b->height) {
        row_trial(row, false, "%.40s: no picture: %.100s", what, a->rgb ? b->err.text : a->err.text);
        return;
    }
    unsigned differing = 0;
    for (int pass = 0; pass < 2; pass++)
        for (uint32_t y = 0; y < a->height; y++)
            for (uint32_t x = 0; x < a->width; x++) {
                const uint8_t *p = a->rgb + 3 * ((size_t)y * a->width + x);
                const uint8_t *q = b->rgb + 3 * ((size_t)y * a->width + (mirrored ? a->width - 1 - x : x));
                int d = difference(p, q);
                if (pass == 0)
                    differing += d > 0;
                else
                    row_trial(row, d == 0 || (d == 1 && differing <= allowed),
                              "%.60s: pixel %u,%u: %d,%d,%d, not %d,%d,%d; %u differ", what, x, y, q[0], q[1], q[2],
                              p[0], p[1], p[2], differing);
            }
}
