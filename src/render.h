/* Renders a World into a picture: threads take tiles off one atomic counter, each tile's rays move in streams. */
#ifndef RT_RENDER_H
#define RT_RENDER_H

#include <stdbool.h>
#include <stdint.h>

#include "common/err.h"
#include "render/film.h"
#include "render/stats.h"
#include "scene/world.h"

typedef struct {
    uint32_t width, height;     /* of the whole picture */
    uint32_t x0, y0, x1, y1;    /* what is rendered of it: origin at the top left, x1 and y1 exclusive */
    uint32_t samples, max_depth;
    uint64_t seed;
    bool has_background;
    Rgb background;             /* otherwise the gradient */
    FilmFormat format;
    bool srgb;                  /* encode, unless the format is FILM_FLOAT */
    uint32_t threads;           /* >= 1 */
    /* Called from one thread at a time, now and then, with the share done in [0,1]; NULL: not at all. */
    void (*progress)(void *context, double share);
    void *progress_context;
} RenderSettings;

/* Fills film, rows of (x1 - x0) pixels of the format from the top, and *stats.
 * False and *err (ERR_LIMIT) without memory or threads. */
bool render(const World *world, const RenderSettings *settings, void *film, RenderStats *stats, Err *err);

#endif
