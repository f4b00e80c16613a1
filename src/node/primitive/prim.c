#include "node/primitive/prim.h"

#include <stdlib.h>

Box prim_bounds_in(const Prim *prim, const Affine *map)
{
    return prim->ops->bounds_in ? prim->ops->bounds_in(prim, map) : affine_box(map, prim->ops->bounds(prim));
}

void prim_destroy(Prim *prim)
{
    if (!prim) return;
    if (prim->ops->destroy)
        prim->ops->destroy(prim);
    else
        free(prim);
}
