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

/* Samples of one pixel of the whole picture that follow each other. */
typedef struct {
    uint32_t x, y;
    uint32_t slot;         /* for the taker's use */
    uint32_t number;       /* of the first among those that `total` samples draw: all of replicate A, then all of B */
    uint32_t total;
    uint32_t begin, end;   /* in the stream */
    bool centre;           /* one sample, at the pixel's centre */
} SampleRun;

typedef struct SampleStream SampleStream;

/* Takes the stream's runs, in the order in which they came; a run's colours are those from its `begin` to before `end`. */
typedef void StreamTaker(void *context, const SampleStream *stream);

struct SampleStream {
    const World *world;
    const RenderSettings *settings;
    StreamTaker *take;
    void *context;               /* of take */
    Shader *shader;
    Scratch scratch;
    RenderStats stats;
    uint32_t low[STREAM_RAYS], high[STREAM_RAYS], index[STREAM_RAYS];   /* of each sample's place (sample.h) */
    double x[STREAM_RAYS], y[STREAM_RAYS];                              /* and that in its pixel, then in the picture */
    Ray ray[STREAM_RAYS];
    Rgb missed[STREAM_RAYS];
    double colour[STREAM_RAYS][3];   /* finite: one that isn't is counted and becomes black */
    SampleRun run[STREAM_RAYS];
    uint32_t count, runs;
};

/* NULL without memory. Owned by the caller; stream_destroy takes NULL too. */
SampleStream *stream_create(const World *world, const RenderSettings *settings);
void stream_destroy(SampleStream *stream);

/* Who gets the samples from here on; the stream must be empty. */
void stream_set_taker(SampleStream *stream, StreamTaker *take, void *context);

/* Samples [first, end) of one replicate of a pixel; the runs are like this one but for their place in the stream. */
void stream_add_replicate(SampleStream *stream, SampleRun like, uint64_t seed, uint32_t replicate, uint32_t first,
                          uint32_t end);

/* The `samples` samples of a pixel with a fixed number: those of replicate A, then those of B; one is the centre. */
void stream_add_pixel(SampleStream *stream, uint32_t x, uint32_t y, uint32_t slot, uint32_t samples);

/* Traces what was added and hands it over. */
void stream_flush(SampleStream *stream);

/* Adds what was counted to *sum. */
void stats_add(RenderStats *sum, const RenderStats *stats);

#endif
