#include "bench/kernels/workers.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdlib.h>
#include <time.h>

#include "common/cpu.h"
#include "support/check.h"

typedef struct {
    Workers *all;
    pthread_t thread;
    uint32_t index;
    double cpu_s;      /* of the last run */
} Worker;

struct Workers {
    uint32_t threads;
    bool end;
    pthread_barrier_t start, done;  /* the workers and who runs them */
    Work *work;
    void *context;
    size_t items;
    atomic_size_t next;
    Worker worker[];
};

static double thread_time_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}

static void *labour(void *context)
{
    Worker *w = context;
    Workers *all = w->all;
    for (;;) {
        pthread_barrier_wait(&all->start);
        if (all->end) return NULL;
        double begin = thread_time_s();
        for (;;) {
            size_t first = atomic_fetch_add(&all->next, WORK_CHUNK);
            if (first >= all->items) break;
            size_t left = all->items - first;
            all->work(all->context, first, left < WORK_CHUNK ? left : WORK_CHUNK, w->index);
        }
        w->cpu_s = thread_time_s() - begin;
        pthread_barrier_wait(&all->done);
    }
}

Workers *workers_create(uint32_t threads)
{
    Workers *all = calloc(1, sizeof *all + threads * sizeof *all->worker);
    CHECK(all);
    all->threads = threads;
    CHECK(pthread_barrier_init(&all->start, NULL, threads + 1) == 0);
    CHECK(pthread_barrier_init(&all->done, NULL, threads + 1) == 0);
    for (uint32_t i = 0; i < threads; i++) {
        all->worker[i].all = all;
        all->worker[i].index = i;
        CHECK(pthread_create(&all->worker[i].thread, NULL, labour, &all->worker[i]) == 0);
    }
    return all;
}

void workers_destroy(Workers *all)
{
    all->end = true;
    pthread_barrier_wait(&all->start);
    for (uint32_t i = 0; i < all->threads; i++) pthread_join(all->worker[i].thread, NULL);
    pthread_barrier_destroy(&all->start);
    pthread_barrier_destroy(&all->done);
    free(all);
}

WorkTime workers_run(Workers *all, Work *work, void *context, size_t items)
{
    all->work = work;
    all->context = context;
    all->items = items;
    atomic_store(&all->next, 0);
    double begin = cpu_wall_s();
    pthread_barrier_wait(&all->start);
    pthread_barrier_wait(&all->done);
    WorkTime time = {.wall_s = cpu_wall_s() - begin};
    for (uint32_t i = 0; i < all->threads; i++) time.cpu_s += all->worker[i].cpu_s / all->threads;
    return time;
}
