/* The last line that a render prints: how wrong its picture is, what that took, and what half the error would take. */
#ifndef RT_RENDER_ERROR_LINE_H
#define RT_RENDER_ERROR_LINE_H

#include <stddef.h>

#include "render/outcome.h"

/* "RMSE 0.0048 [0.0042, 0.0055] in 12.3 s (CPU 24.1 s); 0.0024 would take about 50 s": the seconds of the whole process.
 * `render_s` of them were spent on the samples. */
void error_line(const RenderOutcome *outcome, double wall_s, double cpu_s, double render_s, char *text, size_t size);

#endif
