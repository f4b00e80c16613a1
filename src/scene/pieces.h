/* Long objects that lie askew, in the tree over objects: a rod's box along the axes is nearly empty, and every ray through
 * it would have the rod tested. It is cut into pieces across its greatest length, each with a box of its own that leads to
 * the same object (as "early split clipping" does with triangles: Ernst, Greiner 2007). What a ray hits doesn't change;
 * where it meets two boxes of an object, that is tested twice. */
#ifndef RT_SCENE_PIECES_H
#define RT_SCENE_PIECES_H

#include <stdbool.h>
#include <stdint.h>

#include "accel/bvh.h"
#include "common/err.h"
#include "scene/world.h"

/* (*ref)[i], malloc'ed, is the box of object[i]. Replaces them by the boxes of the pieces, *count in all, where there is
 * something to cut. False and *err without memory. */
bool pieces_cut(const Object *object, BvhRef **ref, uint32_t *count, Err *err);

#endif
