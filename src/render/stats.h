/* What a render counted; kept per worker and summed at the end. */
#ifndef RT_RENDER_STATS_H
#define RT_RENDER_STATS_H

#include <stdint.h>

typedef struct {
    uint64_t camera_rays, shadow_rays, mirror_rays;
    uint64_t samples;
    uint32_t threads;            /* that took part */
    uint64_t not_finite;         /* samples whose colour wasn't finite; they count as black */
    uint32_t first_x, first_y, first_sample;  /* the first of those, by row, column and sample of the whole picture */
    double wall_s, cpu_s;
} RenderStats;

#endif
