/* What is asked of a render. */
#ifndef RT_RENDER_SETTINGS_H
#define RT_RENDER_SETTINGS_H

#include <stdbool.h>
#include <stdint.h>

#include "common/colour.h"
#include "render/film.h"

typedef struct {
    uint32_t width, height;     /* of the whole picture */
    uint32_t x0, y0, x1, y1;    /* what is rendered of it: origin at the top left, x1 and y1 exclusive */
    uint32_t samples;           /* of each pixel; 0: as many as the goals want */
    uint32_t max_depth;
    uint64_t seed;
    double error_goal;          /* RMSE whose 95 % interval ends here or below; 0: none */
    double start_s, deadline_s; /* by cpu_wall_s: when the process began, and when it must end; 0: no such limit */
    bool audits;                /* measure the error by fresh samples */
    const float *reference;     /* the same part of the picture as it should be, linear, 3 a pixel; NULL: not known */
    bool has_background;
    Rgb background;             /* otherwise the gradient */
    FilmFormat format;
    bool srgb;                  /* encode, unless the format is FILM_FLOAT */
    uint32_t threads;           /* >= 1 */
    /* Called from one thread at a time, now and then, with the share done in [0,1]; NULL: not at all. */
    void (*progress)(void *context, double share);
    void *progress_context;
} RenderSettings;

#endif
