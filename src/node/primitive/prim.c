#include "node/primitive/prim.h"

#include <stdlib.h>

void prim_destroy(Prim *prim)
{
    if (!prim) return;
    if (prim->ops->destroy)
        prim->ops->destroy(prim);
    else
        free(prim);
}
