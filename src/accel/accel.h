/* Tracing streams of rays. A kernel may loop over single rays or trace packets; nobody above knows. The result of a ray
 * never depends on its neighbours in the stream, on the number of threads or on the instruction set. */
#ifndef RT_ACCEL_ACCEL_H
#define RT_ACCEL_ACCEL_H

#include <stdbool.h>
#include <stddef.h>

#include "common/ray.h"
#include "common/scratch.h"

struct World;
struct Kernel;

/* The widest kernel that this machine's processor can run, none wider than the one named `widest` ("scalar", "sse2",
 * "avx2", "avx512"; NULL: any). NULL if there is none of that name. All give the same hits. */
const struct Kernel *kernel_best(const char *widest);
const char *kernel_name(const struct Kernel *kernel);

/* In both, left[i] is the face that rays[i] leaves; left may be NULL. It changes time only. */

/* hits[i] gets the nearest hit of rays[i]; hits[i].object is HIT_NONE where there is none. Of several hits with the same
 * t the one of the least object, then the least part, wins. */
void world_intersect(const struct World *world, const Ray *rays, const LeftFace *left, Hit *hits, size_t n,
                     Scratch *scratch);

/* blocked[i] tells whether anything lies on rays[i] with tmin < t <= tmax. */
void world_occluded(const struct World *world, const Ray *rays, const LeftFace *left, bool *blocked, size_t n,
                    Scratch *scratch);

#endif
