/* Loops on several threads: every turn once, no two at once on the same worker, and as many threads as the system grants. */
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdlib.h>
#include <sys/resource.h>

#include <cmocka.h>

#include "common/parallel.h"

enum { TURNS = 5000, WORKERS = 8 };

typedef struct {
    atomic_uint turns[TURNS];
    uint32_t by_worker[WORKERS];   /* not atomic: a worker's turns follow each other */
    atomic_uint busy[WORKERS], clashes;
} Log;

static void note(void *context, uint32_t i, uint32_t worker)
{
    Log *log = context;
    if (atomic_fetch_add(&log->busy[worker], 1) != 0) atomic_fetch_add(&log->clashes, 1);
    log->by_worker[worker]++;
    atomic_fetch_add(&log->turns[i], 1);
    atomic_fetch_sub(&log->busy[worker], 1);
}

static void every_turn_once(void **state)
{
    (void)state;
    static const uint32_t threads[] = {0, 1, 2, 3, WORKERS}, counts[] = {0, 1, 2, 7, TURNS};
    for (int t = 0; t < 5; t++)
        for (int c = 0; c < 5; c++) {
            Log *log = calloc(1, sizeof *log);
            uint32_t ran = parallel_for(threads[t], counts[c], note, log), sum = 0;
            assert_true(ran >= 1 && (ran <= threads[t] || ran == 1) && (ran <= counts[c] || ran == 1));
            for (uint32_t i = 0; i < TURNS; i++) assert_int_equal(log->turns[i], i < counts[c]);
            for (uint32_t i = 0; i < WORKERS; i++) {
                sum += log->by_worker[i];
                if (i >= ran) assert_int_equal(log->by_worker[i], 0);
            }
            assert_int_equal(sum, counts[c]);
            assert_int_equal(log->clashes, 0);
            free(log);
        }
}

/* Stacks that don't fit into the address space that is left: no thread can be had, and the caller does it all. */
static void without_threads(void **state)
{
    (void)state;
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    skip();  /* they reserve more address space than any limit */
#else
    struct rlimit before, none;
    assert_int_equal(getrlimit(RLIMIT_AS, &before), 0);
    Log *log = calloc(1, sizeof *log);
    none = before;
    none.rlim_cur = 1 << 20;
    assert_int_equal(setrlimit(RLIMIT_AS, &none), 0);
    uint32_t ran = parallel_for(WORKERS, TURNS, note, log);
    setrlimit(RLIMIT_AS, &before);
    assert_int_equal(ran, 1);
    assert_int_equal(log->by_worker[0], TURNS);
    free(log);
#endif
}

static void chunks_cover_the_items(void **state)
{
    (void)state;
    static const uint32_t items[] = {0, 1, PARALLEL_CHUNK - 1, PARALLEL_CHUNK, PARALLEL_CHUNK + 1, 1000000, UINT32_MAX};
    for (int k = 0; k < 7; k++) {
        uint32_t chunks = parallel_chunks(items[k]);
        uint64_t sum = 0;
        for (uint32_t i = 0; i < chunks; i++) {
            uint32_t begin = i * PARALLEL_CHUNK, end = parallel_chunk_end(i, items[k]);
            assert_true(end > begin && end - begin <= PARALLEL_CHUNK);
            assert_int_equal(begin, sum);
            sum += end - begin;
        }
        assert_int_equal(sum, items[k]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(without_threads),  /* first: no stack of an ended thread may be there to be used again */
        cmocka_unit_test(every_turn_once),
        cmocka_unit_test(chunks_cover_the_items),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
