#include "common/parallel.h"

#include <pthread.h>
#include <stdatomic.h>

typedef struct {
    ParallelTurn turn;
    void *context;
    uint32_t count;
    atomic_uint next;   /* turn to be taken; passes count by at most one for each thread */
} Loop;

typedef struct { Loop *loop; pthread_t thread; uint32_t number; } Worker;

static void *work(void *context)
{
    Worker *w = context;
    Loop *loop = w->loop;
    for (;;) {
        uint32_t i = atomic_fetch_add_explicit(&loop->next, 1, memory_order_relaxed);
        if (i >= loop->count) return NULL;
        loop->turn(loop->context, i, w->number);
    }
}

uint32_t parallel_for(uint32_t threads, uint32_t count, ParallelTurn turn, void *context)
{
    Loop loop = {.turn = turn, .context = context, .count = count};
    Worker worker[PARALLEL_MAX_THREADS];
    uint32_t wanted = threads < count ? threads : count, n = 1;
    if (wanted > PARALLEL_MAX_THREADS) wanted = PARALLEL_MAX_THREADS;
    worker[0] = (Worker){.loop = &loop};
    for (; n < wanted; n++) {
        worker[n] = (Worker){.loop = &loop, .number = n};
        if (pthread_create(&worker[n].thread, NULL, work, &worker[n]) != 0) break;
    }
    work(&worker[0]);
    for (uint32_t i = 1; i < n; i++) pthread_join(worker[i].thread, NULL);
    return n;
}
