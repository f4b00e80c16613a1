/* How much memory this process may use, and memory for large arrays. */
#ifndef RT_COMMON_MEMORY_H
#define RT_COMMON_MEMORY_H

#include <stddef.h>
#include <stdint.h>

/* The least of the machine's memory, the cgroup's limit (v1 and v2) and RLIMIT_AS, in bytes. */
uint64_t memory_limit_bytes(void);

/* An array that begins at a cache line, to be freed with free; NULL without memory. A large one gets large pages where the
 * system grants them: rays that jump about in it then miss the page tables' cache less often. */
void *memory_array(size_t count, size_t size);

#endif
