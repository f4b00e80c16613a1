/* A render with goals: rounds of samples for the pixels that need them, until the audit says that the error is as small as
 * was asked for, or the clock ends it. */
#ifndef RT_RENDER_ADAPTIVE_H
#define RT_RENDER_ADAPTIVE_H

#include "render/crew.h"
#include "render/outcome.h"

/* Fills film, *stats and *outcome, whose map has been created. With an error goal alone they depend on nothing but the
 * scene and the settings, threads aside. False and *err (ERR_LIMIT) without memory. */
bool render_adaptive(Crew *crew, const RenderSettings *settings, void *film, RenderStats *stats, RenderOutcome *outcome,
                     Err *err);

#endif
