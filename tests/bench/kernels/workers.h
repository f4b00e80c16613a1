/* Threads that stay, and take chunks of an array off one atomic counter. */
#ifndef RT_BENCH_KERNELS_WORKERS_H
#define RT_BENCH_KERNELS_WORKERS_H

#include <stddef.h>
#include <stdint.h>

typedef struct Workers Workers;

/* Does items first to first + count - 1; `worker` is below the number of threads. */
typedef void Work(void *context, size_t first, size_t count, uint32_t worker);

/* What a run took: by the clock, and the processor time of the threads divided by their number. The latter isn't
 * lengthened by other programs that want the same processors; the two are equal on a quiet machine. */
typedef struct { double wall_s, cpu_s; } WorkTime;

/* Ends the program if threads can't be had. */
Workers *workers_create(uint32_t threads);
void workers_destroy(Workers *workers);

/* Chunks are WORK_CHUNK items, the last one less. Returns when all is done. */
enum { WORK_CHUNK = 4096 };
WorkTime workers_run(Workers *workers, Work *work, void *context, size_t items);

#endif
