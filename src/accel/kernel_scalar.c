/* The reference kernel: one ray at a time through the tree of objects, in plain C. */
#include "accel/kernel.h"
#include "accel/traverse.h"
#include "scene/world.h"

Ray ray_to_object(const Object *object, const Ray *ray)
{
    if (object->in_world) return *ray;
    return (Ray){affine_point(&object->to_object, ray->o), affine_vector(&object->to_object, ray->d), ray->tmin,
                 ray->tmax};
}

typedef struct {
    const World *world;
    const Ray *ray;
    SlabRay slab;
    float tmax;
    Hit hit;         /* of the nearest; hit.t is where the next one must end */
    bool blocked;
    Scratch *scratch;
} Walk;

static bool nearest_leaf(void *context, uint32_t index)
{
    Walk *w = context;
    const Object *object = &w->world->objects[index];
    Ray local = ray_to_object(object, w->ray);
    local.tmax = w->hit.t;
    Hit hit;
    if (!object->prim->ops->intersect(object->prim, &local, &hit, w->scratch)) return true;
    if (hit.t == w->hit.t && index > w->hit.object) return true;
    hit.object = index;
    w->hit = hit;
    w->tmax = slab_t_up(&w->slab, hit.t);
    return true;
}

/* What a ray has left it can't meet: it is tested here all the same. */
static void intersect(const World *world, const Ray *rays, const LeftFace *left, Hit *hits, size_t n, Scratch *scratch)
{
    (void)left;
    for (size_t i = 0; i < n; i++) {
        Walk w = {.world = world, .ray = &rays[i], .scratch = scratch};
        w.hit = (Hit){.t = rays[i].tmax, .object = HIT_NONE};
        slab_ray_init(&w.slab, &rays[i]);
        w.tmax = slab_t_up(&w.slab, rays[i].tmax);
        arena_reset(scratch->arena);
        slab_walk(&world->bvh, &w.slab, fmaxf(0, slab_t_down(&w.slab, rays[i].tmin)), &w.tmax, nearest_leaf, &w);
        hits[i] = w.hit;
    }
}

static bool blocking_leaf(void *context, uint32_t index)
{
    Walk *w = context;
    const Object *object = &w->world->objects[index];
    const PrimOps *ops = object->prim->ops;
    Ray local = ray_to_object(object, w->ray);
    Hit hit;
    w->blocked = ops->occluded ? ops->occluded(object->prim, &local, w->scratch)
                               : ops->intersect(object->prim, &local, &hit, w->scratch);
    return !w->blocked;
}

static void occluded(const World *world, const Ray *rays, const LeftFace *left, bool *blocked, size_t n, Scratch *scratch)
{
    (void)left;
    for (size_t i = 0; i < n; i++) {
        Walk w = {.world = world, .ray = &rays[i], .scratch = scratch};
        slab_ray_init(&w.slab, &rays[i]);
        w.tmax = slab_t_up(&w.slab, rays[i].tmax);
        arena_reset(scratch->arena);
        slab_walk(&world->bvh, &w.slab, fmaxf(0, slab_t_down(&w.slab, rays[i].tmin)), &w.tmax, blocking_leaf, &w);
        blocked[i] = w.blocked;
    }
}

const Kernel kernel_scalar = {"scalar", intersect, occluded};
