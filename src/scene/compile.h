/* Freezes a scene tree into a World: multiplies transforms out, finds what is reachable and what it needs, loads only
 * that, bakes small meshes that are used once, builds the BVHs. */
#ifndef RT_SCENE_COMPILE_H
#define RT_SCENE_COMPILE_H

#include "common/err.h"
#include "scene/job.h"
#include "scene/world.h"

typedef struct {
    bool srgb;            /* decode textures */
    const char *cpu;      /* no wider instructions than these (kernel_best); NULL: any */
    void (*warn)(void *context, const char *text);
    void *warn_context;
    uint32_t threads;     /* that build BVHs; 0 counts as 1 */
    bool split;           /* cut boxes of long triangles (accel/mesh_split.h) */
} CompileSettings;

/* Filled as compile goes, kept also when it fails. Times in seconds. */
typedef struct {
    double load_wall_s, load_cpu_s;        /* OBJ, PNG, grammar; generating mountains and trees */
    double compile_wall_s, compile_cpu_s;  /* without load and BVH */
    double bvh_wall_s, bvh_cpu_s;
    uint32_t nodes;            /* reachable, each once */
    uint64_t objects;
    uint64_t triangles;        /* stored, each once */
    uint64_t dropped_triangles;
    uint32_t meshes_named, meshes_loaded;      /* OBJ files that the script named; that the scene needed */
    uint32_t textures_named, textures_loaded;
} CompileStats;

/* NULL and *err on failure: ERR_SCENE, ERR_INPUT or ERR_LIMIT, with the script's line in front where a node is at
 * fault. The World borrows from job->scene, which must outlive it. */
World *world_compile(const RenderJob *job, const CompileSettings *settings, CompileStats *stats, Err *err);
void world_destroy(World *world);

#endif
