#include "node/primitive/mesh.h"

#include <float.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "common/numeric.h"
#include "common/rng.h"
#include "tools/obj.h"

#define NO_SLOT UINT32_MAX

void mesh_destroy(Mesh *mesh)
{
    if (!mesh) return;
    free(mesh->position);
    if (mesh->triangle_uv != mesh->triangle) free(mesh->triangle_uv);
    free(mesh->triangle);
    free(mesh->uv);
    free(mesh->normal);
    free(mesh->triangle_normal);
    free(mesh);
}

/* ---- degenerate triangles ---- */

/* Whether the sum of the terms is exactly zero: they are added to an expansion of doubles that don't overlap
 * (Shewchuk 1997, grow-expansion with zero elimination). */
static bool sums_to_zero(const double *term, int count)
{
    double expansion[16];
    int size = 0;
    for (int i = 0; i < count; i++) {
        double carry = term[i];
        int kept = 0;
        for (int j = 0; j < size; j++) {
            double sum = carry + expansion[j], part = sum - carry;
            double rest = (carry - (sum - part)) + (expansion[j] - part);
            carry = sum;
            if (rest != 0) expansion[kept++] = rest;
        }
        if (carry != 0) expansion[kept++] = carry;
        size = kept;
    }
    return size == 0;
}

/* Whether (a, b, c) lie on one line in this projection, exactly: ax by - ay bx + bx cy - by cx + cx ay - cy ax = 0. */
static bool collinear_2d(double ax, double ay, double bx, double by, double cx, double cy)
{
    const double factor[6][2] = {{ax, by}, {-ay, bx}, {bx, cy}, {-by, cx}, {cx, ay}, {-cy, ax}};
    double term[12];
    for (int i = 0; i < 6; i++) {
        double product = factor[i][0] * factor[i][1];
        term[2 * i] = product;
        term[2 * i + 1] = fma(factor[i][0], factor[i][1], -product);
    }
    return sums_to_zero(term, 12);
}

static bool collinear(Vec3 a, Vec3 b, Vec3 c)
{
    return collinear_2d(a.x, a.y, b.x, b.y, c.x, c.y) && collinear_2d(a.y, a.z, b.y, b.z, c.y, c.z) &&
           collinear_2d(a.z, a.x, b.z, b.x, c.z, c.x);
}

/* No area: equal corners, or an edge shorter than the least normal number, or corners on one line. The cross product of
 * two edges, in floating point, settles nearly every case; where it is no larger than its own rounding error, exact
 * arithmetic decides. A triangle whose computed cross product is 0 has no normal and goes too. */
static bool is_degenerate(Vec3 a, Vec3 b, Vec3 c)
{
    double scale = vec3_pow2_scale(vec3_make(vec3_max(vec3_abs(a)), vec3_max(vec3_abs(b)), vec3_max(vec3_abs(c))));
    Vec3 ab = vec3_sub(b, a), ac = vec3_sub(c, a), bc = vec3_sub(c, b);
    if (vec3_max(vec3_abs(ab)) < DBL_MIN || vec3_max(vec3_abs(ac)) < DBL_MIN || vec3_max(vec3_abs(bc)) < DBL_MIN)
        return true;
    a = vec3_scale(a, scale);
    b = vec3_scale(b, scale);
    c = vec3_scale(c, scale);
    ab = vec3_sub(b, a);
    ac = vec3_sub(c, a);
    Vec3 n = vec3_cross(ab, ac), p = vec3_abs(ab), q = vec3_abs(ac);
    /* each difference is off by u, each product by another, and the last difference by one more */
    Vec3 bound = vec3_scale(vec3_make(p.y * q.z + p.z * q.y, p.z * q.x + p.x * q.z, p.x * q.y + p.y * q.x), GAMMA(5));
    if (fabs(n.x) > bound.x || fabs(n.y) > bound.y || fabs(n.z) > bound.z) return false;
    double s = vec3_pow2_scale(ab), t = vec3_pow2_scale(ac);  /* so that short edges don't underflow */
    n = vec3_cross(vec3_scale(ab, s), vec3_scale(ac, t));
    return vec3_max(vec3_abs(n)) == 0 || collinear(a, b, c);
}

static uint32_t (*shrink(uint32_t (*array)[3], uint32_t count))[3]
{
    void *less = array && count ? realloc(array, count * sizeof *array) : NULL;
    return less ? less : array;
}

void mesh_drop_degenerate(Mesh *mesh)
{
    uint32_t kept = 0, count = mesh->triangle_count;
    bool own_uv = mesh->triangle_uv && mesh->triangle_uv != mesh->triangle;
    for (uint32_t i = 0; i < count; i++) {
        const uint32_t *t = mesh->triangle[i];
        if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0] ||
            is_degenerate(mesh->position[t[0]], mesh->position[t[1]], mesh->position[t[2]]))
            continue;
        if (kept != i) {
            memcpy(mesh->triangle[kept], mesh->triangle[i], sizeof *mesh->triangle);
            if (own_uv) memcpy(mesh->triangle_uv[kept], mesh->triangle_uv[i], sizeof *mesh->triangle_uv);
            if (mesh->triangle_normal)
                memcpy(mesh->triangle_normal[kept], mesh->triangle_normal[i], sizeof *mesh->triangle_normal);
        }
        kept++;
    }
    mesh->triangle_count = kept;
    mesh->dropped = count - kept;
    if (kept == count) return;
    bool shared_uv = mesh->triangle_uv && !own_uv;
    mesh->triangle = shrink(mesh->triangle, kept);
    mesh->triangle_uv = shared_uv ? mesh->triangle : shrink(mesh->triangle_uv, kept);
    mesh->triangle_normal = shrink(mesh->triangle_normal, kept);
}

/* ---- from a file, from a table ---- */

Mesh *mesh_load_obj(const char *path, Err *err)
{
    Mesh *mesh = calloc(1, sizeof *mesh);
    if (!mesh) {
        err_memory(err, path);
        return NULL;
    }
    Obj obj;
    if (!obj_load(path, &obj, err)) {
        free(mesh);
        return NULL;
    }
    *mesh = (Mesh){.position = obj.position, .position_count = obj.position_count,
                   .triangle = obj.triangle, .triangle_count = obj.triangle_count,
                   .uv = obj.uv, .triangle_uv = obj.triangle_uv, .uv_count = obj.uv_count,
                   .normal = obj.normal, .triangle_normal = obj.triangle_normal, .normal_count = obj.normal_count};
    mesh_drop_degenerate(mesh);
    if (mesh->triangle_count > 0) return mesh;
    err_set(err, ERR_INPUT, "%s: no face has an area", path);
    mesh_destroy(mesh);
    return NULL;
}

/* False if a face or a vertex is wrong; otherwise adds the number of the fans' triangles to *triangles. */
static bool check_faces(const Vec3 *position, uint32_t position_count, const uint32_t *face_size, uint32_t face_count,
                        const uint32_t *index, uint64_t *triangles, Err *err)
{
    for (uint32_t i = 0; i < position_count; i++)
        if (!isfinite(position[i].x) || !isfinite(position[i].y) || !isfinite(position[i].z))
            return err_set(err, ERR_SCENE, "vertex %" PRIu32 " isn't finite", i);
    if (face_count == 0) return err_set(err, ERR_SCENE, "no faces");
    for (uint32_t f = 0; f < face_count; f++) {
        if (face_size[f] < 3)
            return err_set(err, ERR_SCENE, "face %" PRIu32 " has %" PRIu32 " %s", f + 1, face_size[f],
                           face_size[f] == 1 ? "vertex" : "vertices");
        for (uint32_t k = 0; k < face_size[f]; k++, index++)
            if (*index >= position_count)
                return err_set(err, ERR_SCENE, "face %" PRIu32 ": vertex %" PRIu32 " of %" PRIu32, f + 1, *index,
                               position_count);
        *triangles += face_size[f] - 2;
    }
    return *triangles < UINT32_MAX ||
           err_set(err, ERR_LIMIT, "more than the limit of %u triangles", (unsigned)UINT32_MAX - 1);
}

Mesh *mesh_from_faces(const Vec3 *position, uint32_t position_count, const uint32_t *face_size, uint32_t face_count,
                      const uint32_t *index, Err *err)
{
    uint64_t triangles = 0;
    if (!check_faces(position, position_count, face_size, face_count, index, &triangles, err)) return NULL;
    Mesh *mesh = calloc(1, sizeof *mesh);
    if (!mesh) goto no_memory;
    mesh->position = malloc(position_count * sizeof *mesh->position);
    mesh->triangle = malloc(triangles * sizeof *mesh->triangle);
    if (!mesh->position || !mesh->triangle) goto no_memory;
    memcpy(mesh->position, position, position_count * sizeof *position);
    mesh->position_count = position_count;
    for (uint32_t f = 0; f < face_count; index += face_size[f++]) {
        for (uint32_t k = 2; k < face_size[f]; k++) {
            uint32_t *t = mesh->triangle[mesh->triangle_count++];
            t[0] = index[0];
            t[1] = index[k - 1];
            t[2] = index[k];
        }
    }
    mesh_drop_degenerate(mesh);
    if (mesh->triangle_count > 0) return mesh;
    err_set(err, ERR_SCENE, "no face has an area");
    mesh_destroy(mesh);
    return NULL;
no_memory:
    err_memory(err, "a mesh");
    mesh_destroy(mesh);
    return NULL;
}

/* ---- bounds and closedness ---- */

Box mesh_bounds(const Mesh *mesh)
{
    Box box = box_empty();
    for (uint32_t i = 0; i < mesh->triangle_count; i++)
        for (int k = 0; k < 3; k++) box = box_add_point(box, mesh->position[mesh->triangle[i][k]]);
    return box;
}

static uint64_t hash_position(Vec3 p)
{
    double x[3] = {p.x + 0.0, p.y + 0.0, p.z + 0.0};  /* -0 becomes 0: they are equal */
    uint64_t bits[3];
    memcpy(bits, x, sizeof bits);
    return hash64(hash64(hash64(bits[0]) ^ bits[1]) ^ bits[2]);
}

/* For each position the index of the first that equals it (malloc'ed); NULL without memory. */
static uint32_t *weld(const Mesh *mesh)
{
    uint64_t slots = 16;
    while (slots < 2 * (uint64_t)mesh->position_count) slots *= 2;
    uint32_t *slot = malloc(slots * sizeof *slot);
    uint32_t *first = malloc((size_t)mesh->position_count * sizeof *first);
    if (!slot || !first) {
        free(slot);
        free(first);
        return NULL;
    }
    memset(slot, 0xff, slots * sizeof *slot);  /* NO_SLOT */
    for (uint32_t i = 0; i < mesh->position_count; i++) {
        Vec3 p = mesh->position[i];
        uint64_t at = hash_position(p) & (slots - 1);
        for (; slot[at] != NO_SLOT; at = (at + 1) & (slots - 1)) {
            Vec3 q = mesh->position[slot[at]];
            if (p.x == q.x && p.y == q.y && p.z == q.z) break;
        }
        if (slot[at] == NO_SLOT) slot[at] = i;
        first[i] = slot[at];
    }
    free(slot);
    return first;
}

/* An edge of a triangle as its lesser corner's list has it. */
typedef struct {
    uint32_t other;
    int32_t step;  /* 1 if it runs from the lesser corner to the other, -1 if back */
} EdgeEnd;

static int compare_edge_ends(const void *a, const void *b)
{
    const EdgeEnd *p = a, *q = b;
    return (p->other > q->other) - (p->other < q->other);
}

/* The first other end that is reached more often in one direction than in the other; NO_SLOT if there is none. */
static uint32_t find_unbalanced(EdgeEnd *edge, size_t count)
{
    qsort(edge, count, sizeof *edge, compare_edge_ends);
    for (size_t i = 0; i < count;) {
        uint32_t other = edge[i].other;
        int64_t balance = 0;
        for (; i < count && edge[i].other == other; i++) balance += edge[i].step;
        if (balance != 0) return other;
    }
    return NO_SLOT;
}

/* Edge k of triangle i: returns its lesser corner, and in *end the other one with the direction. */
static uint32_t edge_of(const Mesh *mesh, const uint32_t *first, uint32_t i, int k, EdgeEnd *end)
{
    uint32_t a = first[mesh->triangle[i][k]], b = first[mesh->triangle[i][(k + 1) % 3]];
    *end = a < b ? (EdgeEnd){b, 1} : (EdgeEnd){a, -1};
    return a < b ? a : b;
}

bool mesh_is_closed(const Mesh *mesh, Err *err)
{
    bool closed = false;
    uint32_t *first = weld(mesh);
    /* list[v] to list[v + 1] are the edges whose lesser corner is v */
    size_t *list = calloc((size_t)mesh->position_count + 2, sizeof *list);
    EdgeEnd *edge = malloc(((size_t)mesh->triangle_count * 3 + 1) * sizeof *edge), end;
    if (!first || !list || !edge) {
        err_memory(err, "the edges of a mesh");
        goto done;
    }
    for (uint32_t i = 0; i < mesh->triangle_count; i++)
        for (int k = 0; k < 3; k++) list[edge_of(mesh, first, i, k, &end) + 2]++;
    for (size_t v = 2; v < (size_t)mesh->position_count + 2; v++) list[v] += list[v - 1];
    for (uint32_t i = 0; i < mesh->triangle_count; i++) {
        for (int k = 0; k < 3; k++) {
            uint32_t v = edge_of(mesh, first, i, k, &end);
            edge[list[v + 1]++] = end;
        }
    }
    for (uint32_t v = 0; v < mesh->position_count; v++) {
        uint32_t other = find_unbalanced(edge + list[v], list[v + 1] - list[v]);
        if (other == NO_SLOT) continue;
        Vec3 a = mesh->position[v], b = mesh->position[other];
        err_set(err, ERR_SCENE, "open edge from (%.9g, %.9g, %.9g) to (%.9g, %.9g, %.9g)", a.x, a.y, a.z, b.x, b.y, b.z);
        goto done;
    }
    closed = true;
done:
    free(first);
    free(list);
    free(edge);
    return closed;
}

/* ---- sources ---- */

bool mesh_source_load(MeshSource *source, Err *err)
{
    if (source->loaded) return true;
    switch (source->kind) {
    case MESH_FILE:
        source->loaded = mesh_load_obj(source->path, err);
        break;
    case MESH_TABLE:
        return err_set(err, ERR_SCENE, "a mesh without faces");
    case MESH_MOUNTAIN: {
        double peak;
        Mesh *mesh = mountain_create(source->mountain.width, source->mountain.height, source->mountain.length,
                                     source->mountain.roughness, source->mountain.subdivisions, source->mountain.seed,
                                     &peak, err);
        if (!mesh) return false;
        if (!source->height_bands) source->height_bands = height_texture_create(peak);
        if (!source->height_bands) {
            mesh_destroy(mesh);
            return err_memory(err, "a mountain's colours");
        }
        source->loaded = mesh;
        break;
    }
    }
    return source->loaded != NULL;
}
