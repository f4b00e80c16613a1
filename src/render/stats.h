/* What a render counted; kept per worker and summed at the end. */
#ifndef RT_RENDER_STATS_H
#define RT_RENDER_STATS_H

#include <math.h>
#include <stdint.h>

/* Weights of paths are summed in integers of this step, so that the sum doesn't depend on the order. */
#define WEIGHT_UNIT 0x1p-20

typedef struct {
    uint64_t camera_rays, shadow_rays, mirror_rays;
    uint64_t samples;
    uint64_t dropped;            /* weight of the mirrors that the greatest depth left out, in WEIGHT_UNIT of a sample */
    uint64_t audit_rays, audit_samples;   /* those that measured the finished picture; not among the others */
    uint32_t threads;            /* that took part */
    uint64_t not_finite;         /* samples whose colour wasn't finite; they count as black */
    uint32_t first_x, first_y;   /* the pixel of the first of those, by row and column of the whole picture, */
    uint32_t first_sample;       /* its number there, */
    uint32_t first_total;        /* among so many samples */
    double wall_s, cpu_s;
} RenderStats;

/* Rounded up: what is summed is a bound. */
static inline uint64_t weight_units(float weight) { return (uint64_t)ceilf(weight * (float)(1 / WEIGHT_UNIT)); }

static inline uint64_t stats_rays(const RenderStats *s) { return s->camera_rays + s->shadow_rays + s->mirror_rays; }

#endif
