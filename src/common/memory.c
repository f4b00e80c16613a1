#include "common/memory.h"

#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

enum {
    CACHE_LINE = 64,
    LARGE_PAGE = 1 << 21,
    LARGE_PAGES = 4,        /* an array of so many is large: what rounding up to whole ones wastes is less than a quarter */
};

/* "max" and anything else that is no number count as no limit. */
static uint64_t limit_in_file(const char *path)
{
    unsigned long long bytes = 0;
    FILE *f = fopen(path, "r");
    if (!f) return UINT64_MAX;
    int n = fscanf(f, "%llu", &bytes);
    fclose(f);
    return n == 1 && bytes > 0 ? bytes : UINT64_MAX;
}

static uint64_t least(uint64_t a, uint64_t b) { return a < b ? a : b; }

uint64_t memory_limit_bytes(void)
{
    long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
    uint64_t limit = pages > 0 && page > 0 ? (uint64_t)pages * (uint64_t)page : UINT64_MAX;
    limit = least(limit, limit_in_file("/sys/fs/cgroup/memory.max"));
    limit = least(limit, limit_in_file("/sys/fs/cgroup/memory/memory.limit_in_bytes"));
    struct rlimit r;
    if (getrlimit(RLIMIT_AS, &r) == 0 && r.rlim_cur != RLIM_INFINITY) limit = least(limit, r.rlim_cur);
    return limit;
}

void *memory_array(size_t count, size_t size)
{
    if (size && count > (SIZE_MAX - LARGE_PAGE) / size) return NULL;
    size_t bytes = count * size, align = bytes >= (size_t)LARGE_PAGES * LARGE_PAGE ? LARGE_PAGE : CACHE_LINE;
    bytes = (bytes + align - 1) & ~(align - 1);
    void *array = aligned_alloc(align, bytes);
#ifdef MADV_HUGEPAGE
    if (array && align == LARGE_PAGE) madvise(array, bytes, MADV_HUGEPAGE);
#endif
    return array;
}
