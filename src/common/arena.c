#include "common/arena.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { CHUNK_BYTES = 64 * 1024, LINE = 64, SMALL = 16 };

typedef struct Chunk {
    struct Chunk *next;
    size_t size, used;  /* of data */
    unsigned char *data;
} Chunk;

struct Arena {
    Chunk *first, *now;
    size_t bytes;
};

Arena *arena_create(void) { return calloc(1, sizeof(Arena)); }

void arena_destroy(Arena *arena)
{
    if (!arena) return;
    for (Chunk *c = arena->first, *next; c; c = next) {
        next = c->next;
        free(c);
    }
    free(arena);
}

/* Chunks double up to 64 times the first, so that a large arena makes few system calls. */
static Chunk *chunk_create(Arena *arena, size_t least)
{
    size_t size = CHUNK_BYTES;
    while (size < arena->bytes / 4 && size < (size_t)64 * CHUNK_BYTES) size *= 2;
    if (size < least) size = least;
    if (size > SIZE_MAX - sizeof(Chunk) - LINE) return NULL;
    Chunk *c = malloc(sizeof(Chunk) + size + LINE);
    if (!c) return NULL;
    uintptr_t data = ((uintptr_t)(c + 1) + LINE - 1) & ~(uintptr_t)(LINE - 1);
    *c = (Chunk){.size = size, .data = (unsigned char *)data};
    arena->bytes += sizeof(Chunk) + size + LINE;
    return c;
}

void *arena_alloc(Arena *arena, size_t size)
{
    size_t align = size >= LINE ? LINE : SMALL;
    if (size == 0) size = 1;
    for (Chunk *c = arena->now; c; c = c->next) {
        size_t at = (c->used + align - 1) & ~(align - 1);
        if (at <= c->size && size <= c->size - at) {
            c->used = at + size;
            arena->now = c;
            return c->data + at;
        }
    }
    Chunk *c = chunk_create(arena, size);
    if (!c) return NULL;
    if (arena->now) {
        c->next = arena->now->next;
        arena->now->next = c;
    } else {
        arena->first = c;
    }
    arena->now = c;
    c->used = size;
    return c->data;
}

void *arena_alloc_zero(Arena *arena, size_t size)
{
    void *p = arena_alloc(arena, size);
    if (p) memset(p, 0, size);
    return p;
}

char *arena_strdup(Arena *arena, const char *s)
{
    size_t n = strlen(s) + 1;
    char *copy = arena_alloc(arena, n);
    if (copy) memcpy(copy, s, n);
    return copy;
}

void arena_reset(Arena *arena)
{
    for (Chunk *c = arena->first; c; c = c->next) c->used = 0;
    arena->now = arena->first;
}

size_t arena_bytes(const Arena *arena) { return arena->bytes; }
