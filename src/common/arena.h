/* A bump allocator over chunks: many small allocations, freed together.
 * An Arena belongs to one thread at a time. All memory is zeroed only by arena_alloc_zero. */
#ifndef RT_COMMON_ARENA_H
#define RT_COMMON_ARENA_H

#include <stddef.h>

typedef struct Arena Arena;

/* An empty arena; NULL without memory. The caller owns it. */
Arena *arena_create(void);

/* Frees everything that came from the arena, and the arena. NULL is allowed. */
void arena_destroy(Arena *arena);

/* size bytes aligned for any type and to 64 bytes if size is at least 64; NULL without memory. */
void *arena_alloc(Arena *arena, size_t size);
void *arena_alloc_zero(Arena *arena, size_t size);

/* A copy of a string; NULL without memory. */
char *arena_strdup(Arena *arena, const char *s);

/* Forgets everything allocated, but keeps the memory for the next use (scratch arenas, once a ray). */
void arena_reset(Arena *arena);

/* Bytes obtained from the system. */
size_t arena_bytes(const Arena *arena);

#endif
