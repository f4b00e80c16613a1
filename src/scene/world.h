/* The frozen scene: what the renderer traces. Const after compile, shared by all threads.
 *
 * World coordinates are the script's divided by 2^exponent, so that the scene, its eye and its lights lie within about
 * [-1, 1] and no scale overflows a float box or a double square; t is affected likewise. */
#ifndef RT_SCENE_WORLD_H
#define RT_SCENE_WORLD_H

#include <stdbool.h>
#include <stdint.h>

#include "accel/bvh.h"
#include "common/affine.h"
#include "common/colour.h"
#include "common/ray.h"
#include "common/scratch.h"
#include "node/bumping/bump.h"
#include "node/light.h"
#include "node/material/material.h"
#include "node/primitive/prim.h"
#include "node/texture/texture.h"

/* How a surface looks. */
typedef struct {
    const Material *material;
    const Texture *texture;  /* NULL: none */
    const Bump *bump;        /* NULL: none */
} Shading;

/* A primitive in its place. */
typedef struct {
    Affine to_object, to_world;
    const Prim *prim;
    uint32_t shading;   /* index of its first Shading; Hit.leaf is added */
    bool in_world;      /* both maps are the identity: rays need no transform */
} Object;

/* An object as kernels see it that first ask in float whether rays may meet its box. */
typedef struct {
    float m[3][4];          /* Object.to_object, rounded */
    float lo[3], hi[3];     /* the primitive's box in its own space, rounded outward */
    float reach;            /* its greatest coordinate, rounded up, as are the next two */
    float size, offset;     /* the greatest sum of a row's magnitudes in the linear part; the greatest in the last column */
    float least_d[3];       /* directions whose components there are less count as that: VIEW_PARALLEL of the row's sum */
} ObjectView;

/* Over the way through the world it moves a point by less than a double's rounding. */
#define VIEW_PARALLEL 0x1p-60f

/* What the scene needs; the render loop is chosen by it. */
enum {
    FEATURE_TEXTURE = 1 << 0,
    FEATURE_BUMP = 1 << 1,
    FEATURE_MIRROR = 1 << 2,
    FEATURE_ALL = (1 << 3) - 1,
};

struct Kernel;

typedef struct World {
    const struct Kernel *kernel;  /* what traces its rays: kernel_best, or another for a test */
    const Object *objects;
    const ObjectView *views; /* of each object */
    uint32_t object_count;
    Bvh bvh;                 /* over the objects' boxes */
    const Shading *shadings;
    const Light *lights;     /* positions and falloffs in world units */
    uint32_t light_count;
    Rgb ambient;
    unsigned features;
    int exponent;
    struct { Vec3 eye, right, up, forward; } camera;  /* right and up reach from the picture's middle to its edges */
    struct WorldMemory *memory;  /* private to compile.c */
} World;

#endif
