/* Renders a World into a picture: threads take tiles off one atomic counter, each tile's rays move in streams. */
#ifndef RT_RENDER_H
#define RT_RENDER_H

#include <stdbool.h>
#include <stdint.h>

#include "common/err.h"
#include "render/outcome.h"
#include "render/settings.h"
#include "render/stats.h"
#include "scene/world.h"

/* Fills film, rows of (x1 - x0) pixels of the format from the top, *stats and *outcome, which the caller destroys.
 * False and *err (ERR_LIMIT) without memory or threads; *outcome needs no destroying then. */
bool render(const World *world, const RenderSettings *settings, void *film, RenderStats *stats, RenderOutcome *outcome,
            Err *err);

#endif
