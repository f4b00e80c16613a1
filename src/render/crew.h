/* The threads of a render, each with a stream of its own. */
#ifndef RT_RENDER_CREW_H
#define RT_RENDER_CREW_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

#include "common/err.h"
#include "render/stream.h"

typedef struct {
    SampleStream **stream;   /* one for each thread */
    uint32_t count;
    uint32_t threads;        /* the most that ran at once so far */
    atomic_bool failed;      /* out of memory: the turns that are left do nothing */
} Crew;

/* At most `threads` of them, at least one. False and *err without memory. */
bool crew_create(Crew *crew, const World *world, const RenderSettings *settings, uint32_t threads, Err *err);
void crew_destroy(Crew *crew);

/* One turn of a loop: i is its number, `first` tells whether the calling thread runs it. */
typedef void CrewTurn(void *context, uint32_t i, SampleStream *stream, bool first);

/* Takes turns 0 to count - 1, in no order. False and *err if memory ran out in this loop or before. */
bool crew_run(Crew *crew, uint32_t count, CrewTurn *turn, void *context, Err *err);

/* The sum of what the streams counted since they were last asked. */
RenderStats crew_take_stats(Crew *crew);

#endif
