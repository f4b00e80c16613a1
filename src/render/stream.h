/* Samples of pixels on their way through the renderer: they are gathered into a stream, traced together when it is full,
 * and handed to whoever asked for them. A sample's colour depends on pixel, replicate and index only. */
#ifndef RT_RENDER_STREAM_H
#define RT_RENDER_STREAM_H

#include <stdbool.h>
#include <stdint.h>

#include "common/ray.h"
#include "common/scratch.h"
#include "render/settings.h"
#include "render/shade.h"
#include "scene/world.h"

/* Which sample of which pixel of the whole picture. */
typedef struct {
    uint32_t x, y;
    uint32_t slot;       /* for the taker's use */
    uint32_t number;     /* its number among those that `total` samples draw: all of replicate A, then all of B */
    uint32_t total;
} SampleName;

typedef struct SampleStream SampleStream;

/* Takes the stream's `count` samples in the order in which they came: name[i] has colour[i]. */
typedef void StreamTaker(void *context, const SampleStream *stream);

struct SampleStream {
    const World *world;
    const RenderSettings *settings;
    StreamTaker *take;
    void *context;               /* of take */
    Shader *shader;
    Scratch scratch;
    RenderStats stats;
    Ray ray[STREAM_RAYS];
    Rgb missed[STREAM_RAYS];
    double colour[STREAM_RAYS][3];   /* finite: one that isn't is counted and becomes black */
    SampleName name[STREAM_RAYS];
    uint32_t count;
};

/* NULL without memory. Owned by the caller; stream_destroy takes NULL too. */
SampleStream *stream_create(const World *world, const RenderSettings *settings);
void stream_destroy(SampleStream *stream);

/* Who gets the samples from here on; the stream must be empty. */
void stream_set_taker(SampleStream *stream, StreamTaker *take, void *context);

/* Samples [first, end) of one replicate of a pixel. `name` is that of the first. */
void stream_add_replicate(SampleStream *stream, SampleName name, uint64_t seed, uint32_t replicate, uint32_t first,
                          uint32_t end);

/* The `samples` samples of a pixel with a fixed number: those of replicate A, then those of B; one is the centre. */
void stream_add_pixel(SampleStream *stream, uint32_t x, uint32_t y, uint32_t slot, uint32_t samples);

/* Traces what was added and hands it over. */
void stream_flush(SampleStream *stream);

/* Adds what was counted to *sum. */
void stats_add(RenderStats *sum, const RenderStats *stats);

#endif
