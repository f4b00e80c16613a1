/* A triangle mesh as data: what an OBJ file, a table of the script or the mountain's generator gives.
 * Making it traceable is the acceleration layer's work (accel/mesh_prim.h). */
#ifndef RT_NODE_PRIMITIVE_MESH_H
#define RT_NODE_PRIMITIVE_MESH_H

#include <stdbool.h>
#include <stdint.h>

#include "common/box.h"
#include "common/err.h"
#include "common/vec.h"
#include "node/texture/texture.h"

typedef struct {
    Vec3 *position;
    uint32_t position_count;
    uint32_t (*triangle)[3];          /* indices of positions, counter-clockwise seen from outside */
    uint32_t triangle_count;

    float (*uv)[2];                   /* NULL: none */
    uint32_t (*triangle_uv)[3];       /* NULL: none; UINT32_MAX: that corner has none; may be `triangle` itself */
    uint32_t uv_count;
    float (*normal)[3];               /* NULL: none */
    uint32_t (*triangle_normal)[3];   /* NULL: none; UINT32_MAX: that corner has none */
    uint32_t normal_count;

    uint32_t dropped;                 /* degenerate triangles that were left out */
} Mesh;

void mesh_destroy(Mesh *mesh);

/* Reads a Wavefront OBJ file. NULL and *err: ERR_INPUT "file.obj:LINE: what", ERR_LIMIT. Degenerate triangles (two
 * equal corners, no area) are dropped and counted. */
Mesh *mesh_load_obj(const char *path, Err *err);

/* From vertices and convex faces of 0-based indices, as a fan each: face i has face_size[i] indices, one face after
 * the other in `index`. NULL and *err: ERR_SCENE "face 3: vertex 9 of 8", "face 2 has 2 vertices", ERR_LIMIT. */
Mesh *mesh_from_faces(const Vec3 *position, uint32_t position_count, const uint32_t *face_size, uint32_t face_count,
                      const uint32_t *index, Err *err);

/* The fractal mountain of SPEC 7. *peak gets the greatest height. Dropped triangles aren't counted.
 * NULL and *err: ERR_LIMIT naming the greatest number of subdivisions. */
Mesh *mountain_create(double width, double height, double length, double roughness, uint32_t subdivisions,
                      uint64_t seed, double *peak, Err *err);

/* Drops the triangles that have two equal corners or no area, and sets `dropped` to their number. */
void mesh_drop_degenerate(Mesh *mesh);

Box mesh_bounds(const Mesh *mesh);

/* True if every edge is shared by as many triangles in one direction as in the other, positions being compared by
 * value (OBJ writers repeat them). Otherwise *err (ERR_SCENE) names an open edge by its two ends. */
bool mesh_is_closed(const Mesh *mesh, Err *err);

/* What a script named or described, made when a scene that needs it is compiled. */
typedef enum { MESH_FILE, MESH_TABLE, MESH_MOUNTAIN } MeshKind;

typedef struct {
    MeshKind kind;
    const char *path;         /* MESH_FILE: as resolved */
    struct { double width, height, length, roughness; uint32_t subdivisions; uint64_t seed; } mountain;
    Mesh *loaded;             /* NULL until needed; owned */
    Texture *height_bands;    /* MESH_MOUNTAIN: made with it; owned */
    bool told_dropped;        /* a warning has told of its degenerate triangles */
    uint32_t index;           /* in order of creation, unique in the scene */
} MeshSource;

/* Makes it if that hasn't happened yet. False and *err on failure. */
bool mesh_source_load(MeshSource *source, Err *err);

#endif
