#include "node/csg/segment.h"

#include <string.h>

bool seg_list_add(SegList *list, Edge in, Edge out)
{
    if (list->count == list->capacity) {
        uint32_t capacity = list->capacity ? 2 * list->capacity : 16;
        Seg *seg = arena_alloc(list->scratch->arena, capacity * sizeof *seg);
        if (!seg) {
            list->scratch->out_of_memory = true;
            return false;
        }
        if (list->count) memcpy(seg, list->seg, list->count * sizeof *seg);
        list->seg = seg;
        list->capacity = capacity;
    }
    list->seg[list->count++] = (Seg){in, out};
    return true;
}
