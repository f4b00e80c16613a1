#include "render/crew.h"

#include <stdlib.h>

#include "common/parallel.h"

bool crew_create(Crew *crew, const World *world, const RenderSettings *settings, uint32_t threads, Err *err)
{
    *crew = (Crew){.stream = calloc(threads, sizeof *crew->stream)};
    if (!crew->stream) return err_memory(err, "the render threads");
    while (crew->count < threads && (crew->stream[crew->count] = stream_create(world, settings))) crew->count++;
    if (crew->count > 0) return true;
    crew_destroy(crew);
    return err_memory(err, "the render threads");
}

void crew_destroy(Crew *crew)
{
    for (uint32_t i = 0; i < crew->count; i++) stream_destroy(crew->stream[i]);
    free(crew->stream);
}

typedef struct { Crew *crew; CrewTurn *turn; void *context; } Loop;

static void take_turn(void *context, uint32_t i, uint32_t worker)
{
    Loop *loop = context;
    Crew *crew = loop->crew;
    if (atomic_load_explicit(&crew->failed, memory_order_relaxed)) return;
    loop->turn(loop->context, i, crew->stream[worker], worker == 0);
    if (crew->stream[worker]->scratch.out_of_memory) atomic_store_explicit(&crew->failed, true, memory_order_relaxed);
}

bool crew_run(Crew *crew, uint32_t count, CrewTurn *turn, void *context, Err *err)
{
    Loop loop = {crew, turn, context};
    uint32_t threads = parallel_for(crew->count, count, take_turn, &loop);
    if (threads > crew->threads) crew->threads = threads;
    return !atomic_load(&crew->failed) || err_memory(err, "the rays' scratch memory");
}

RenderStats crew_take_stats(Crew *crew)
{
    RenderStats sum = {0};
    for (uint32_t i = 0; i < crew->count; i++) {
        stats_add(&sum, &crew->stream[i]->stats);
        crew->stream[i]->stats = (RenderStats){0};
    }
    return sum;
}
