/* Loops whose turns run on several threads. */
#ifndef RT_COMMON_PARALLEL_H
#define RT_COMMON_PARALLEL_H

#include <stdint.h>

enum { PARALLEL_MAX_THREADS = 1024 };

/* The i-th turn; `worker`, below the number of threads, is the same for no two turns that run at once. */
typedef void (*ParallelTurn)(void *context, uint32_t i, uint32_t worker);

/* Calls turn(context, i, worker) once for each i below `count`, in no order, and returns when all are done. The calling
 * thread is worker 0; up to `threads` - 1 more are started, at most PARALLEL_MAX_THREADS in all and none without a turn
 * to take. If the system grants fewer threads than wanted, fewer it is. Returns the number that ran, at least 1. */
uint32_t parallel_for(uint32_t threads, uint32_t count, ParallelTurn turn, void *context);

/* Loops over items go by chunks of a fixed size, so that what they yield doesn't depend on the threads. */
enum { PARALLEL_CHUNK = 4096 };

static inline uint32_t parallel_chunks(uint32_t items)
{
    return items / PARALLEL_CHUNK + (items % PARALLEL_CHUNK > 0);
}

/* The chunk's items are those from PARALLEL_CHUNK * chunk up to this one. */
static inline uint32_t parallel_chunk_end(uint32_t chunk, uint32_t items)
{
    uint32_t first = chunk * PARALLEL_CHUNK;
    return items - first < PARALLEL_CHUNK ? items : first + PARALLEL_CHUNK;
}

#endif
