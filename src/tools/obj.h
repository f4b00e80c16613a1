/* Wavefront OBJ files: polygon meshes as text. Polygons come out as fans of triangles; curves, lines, points, groups
 * and materials are passed over. */
#ifndef RT_TOOLS_OBJ_H
#define RT_TOOLS_OBJ_H

#include <stdbool.h>
#include <stdint.h>

#include "common/err.h"
#include "common/vec.h"

/* An index that a corner of a face doesn't have. */
#define OBJ_NONE UINT32_MAX

/* All arrays are malloc'ed. */
typedef struct {
    Vec3 *position;
    float (*uv)[2];                   /* NULL: none; finite */
    float (*normal)[3];               /* NULL: none; unit vectors, or 0 where the file has 0 */
    uint32_t position_count, uv_count, normal_count;

    uint32_t triangle_count;
    uint32_t (*triangle)[3];          /* indices of positions */
    uint32_t (*triangle_uv)[3];       /* NULL: no corner has one */
    uint32_t (*triangle_normal)[3];   /* NULL: no corner has one; OBJ_NONE also for normals of 0 */
} Obj;

/* Reads a file with at least one face. False and *err: ERR_INPUT "can't open PATH: why", "PATH:LINE: what" or
 * "PATH: no faces"; ERR_LIMIT. Numbers are rounded correctly whatever the locale is. */
bool obj_load(const char *path, Obj *obj, Err *err);
void obj_free(Obj *obj);

#endif
