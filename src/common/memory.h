/* How much memory this process may use. */
#ifndef RT_COMMON_MEMORY_H
#define RT_COMMON_MEMORY_H

#include <stdint.h>

/* The least of the machine's memory, the cgroup's limit (v1 and v2) and RLIMIT_AS, in bytes. */
uint64_t memory_limit_bytes(void);

#endif
