#include "support/alloc_fail.h"

#include <errno.h>
#include <limits.h>
#include <stdatomic.h>
#include <stddef.h>

void *__real_malloc(size_t size);
void *__real_calloc(size_t count, size_t size);
void *__real_realloc(void *old, size_t size);
void *__real_aligned_alloc(size_t align, size_t size);
void *__wrap_malloc(size_t size);
void *__wrap_calloc(size_t count, size_t size);
void *__wrap_realloc(void *old, size_t size);
void *__wrap_aligned_alloc(size_t align, size_t size);

static atomic_long first = LONG_MAX, last = LONG_MAX, count, failed;

static bool fails(void)
{
    long n = atomic_fetch_add(&count, 1) + 1;
    if (n < atomic_load(&first) || n > atomic_load(&last)) return false;
    atomic_fetch_add(&failed, 1);
    errno = ENOMEM;
    return true;
}

void *__wrap_malloc(size_t size) { return fails() ? NULL : __real_malloc(size); }
void *__wrap_calloc(size_t n, size_t size) { return fails() ? NULL : __real_calloc(n, size); }
void *__wrap_realloc(void *old, size_t size) { return fails() ? NULL : __real_realloc(old, size); }
void *__wrap_aligned_alloc(size_t align, size_t size) { return fails() ? NULL : __real_aligned_alloc(align, size); }

static void start(long from, long to)
{
    atomic_store(&count, 0);
    atomic_store(&failed, 0);
    atomic_store(&last, to);
    atomic_store(&first, from);
}

void alloc_fail_at(long n) { start(n, LONG_MAX); }
void alloc_fail_only(long n) { start(n, n); }

bool alloc_fail_stop(void)
{
    atomic_store(&first, LONG_MAX);
    return atomic_load(&failed) > 0;
}

long alloc_fail_count(void) { return atomic_load(&count); }
