/* The recursive part of the ray tracer, over streams: a stream of camera rays goes in, their colours come out. */
#ifndef RT_RENDER_SHADE_H
#define RT_RENDER_SHADE_H

#include <stdint.h>

#include "common/colour.h"
#include "common/ray.h"
#include "common/scratch.h"
#include "render/stats.h"
#include "scene/world.h"

/* Rays in a stream: enough to fill packets and to pay for a pass over them, few enough to stay in the L2 cache. */
enum { STREAM_RAYS = 512 };

/* The buffers of one worker. */
typedef struct Shader Shader;

/* NULL without memory. */
Shader *shader_create(void);
void shader_destroy(Shader *shader);

/* Traces n <= STREAM_RAYS camera rays and puts the colour of rays[i] into colour[i]; missed[i] is what it shows if it
 * hits nothing. The rays are used up. Counts into *stats. */
void shade_stream(const World *world, Shader *shader, Ray *rays, const Rgb *missed, uint32_t n, uint32_t max_depth,
                  double (*colour)[3], RenderStats *stats, Scratch *scratch);

#endif
