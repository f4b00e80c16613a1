/* What a worker lends to the primitives while it traces: memory that is reset for every ray. */
#ifndef RT_COMMON_SCRATCH_H
#define RT_COMMON_SCRATCH_H

#include <stdbool.h>

#include "common/arena.h"

typedef struct {
    Arena *arena;        /* reset by the kernel before each ray; CSG keeps its events and segments here */
    bool out_of_memory;  /* set by whoever failed to allocate; the renderer ends with ERR_LIMIT */
} Scratch;

#endif
