/* The fractal mountain: a pyramid whose faces are subdivided, each midpoint but the base's being lifted at random by a
 * share of its edge. The six new faces of a face (v1, v2, v3), with its midpoints m1, m2, m3:
 *
 *              v3
 *             /  \            (v3,v1,m3) and (v3,m2,v2) stand between the old edges and the lifted midpoints, so that
 *           m3 -- m2          neighbours, which lift theirs differently, still meet along the old edges. m1 lies on
 *          /  \  /  \         its edge: the subdivided neighbour below has none of its points there.
 *        v1 -- m1 -- v2
 *
 * That m1 is a corner on one side of its edge and none on the other is harmless if it lies on the edge exactly: then the
 * signs by which rays pass edges (accel/triangle.h) are the same for the edge and its halves, and no ray slips through or
 * meets both sides. So coordinates have as few bits as all halvings leave room for: see on_grid. */
#include "node/primitive/mesh.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "common/rng.h"

enum {
    MAX_SUBDIVISIONS = 9,  /* 40 million faces; each more is six times the memory */
    BASE_CORNERS = 4,
    PEAK = BASE_CORNERS,
    START_POINTS = 5,
    START_FACES = 4,
    NEW_POINTS = 3,
    NEW_FACES = 6,
    RNG_STREAM = 7,        /* any number, but always the same */
};

#define LIFT_LIMIT 1.5
#define PEAK_FACTOR 1.01

typedef uint32_t Face[3];

typedef struct {
    Mesh *mesh;
    uint32_t (*ends)[2];  /* of the edge of every m1, in the order of creation */
    uint32_t split_count;
    double roughness;
    Rng rng;
    double spare;         /* second number of the last pair of normal deviates */
    bool has_spare;
} Builder;

/* Heights and coordinates stay finite whatever the arguments are. */
static double keep_finite(double x) { return fmin(fmax(x, -DBL_MAX), DBL_MAX); }

/* N(0,1) by Marsaglia's polar method (1964). */
static double normal_deviate(Builder *b)
{
    b->has_spare = !b->has_spare;
    if (!b->has_spare) return b->spare;
    double x, y, s;
    do {
        x = 2 * rng_double(&b->rng) - 1;
        y = 2 * rng_double(&b->rng) - 1;
        s = x * x + y * y;
    } while (s >= 1 || s == 0);
    double f = sqrt(-2 * log(s) / s);
    b->spare = y * f;
    return x * f;
}

/* Of x, of at most `reach` in size, the bits that `halvings` midpoints in a row leave room for, so that they are exact: a
 * midpoint of multiples of 2^k is one of 2^(k-1). Toward 0, so that nothing overflows. */
static double on_grid(double x, double reach, uint32_t halvings)
{
    if (reach == 0) return x;
    int grid = ilogb(reach) + 1 - DBL_MANT_DIG + (int)halvings;
    return ldexp(trunc(ldexp(x, -grid)), grid);
}

/* Halved first: the sum of two large coordinates could overflow. */
static Vec3 midpoint(Vec3 a, Vec3 b) { return vec3_add(vec3_scale(a, 0.5), vec3_scale(b, 0.5)); }

static double distance(Vec3 a, Vec3 b)
{
    Vec3 half = vec3_sub(vec3_scale(a, 0.5), vec3_scale(b, 0.5));
    return keep_finite(2 * hypot(hypot(half.x, half.y), half.z));
}

static Vec3 lifted_midpoint(Builder *b, Vec3 p, Vec3 q)
{
    double share = fmin(fmax(b->roughness * normal_deviate(b), -LIFT_LIMIT), LIFT_LIMIT);
    Vec3 m = midpoint(p, q);
    m.y = keep_finite(m.y + distance(p, q) * share);
    return m;
}

/* Writes the six faces that replace `old`, which they may overwrite: it is read first. */
static void subdivide(Builder *b, const uint32_t *old, Face *new)
{
    Vec3 *p = b->mesh->position;
    uint32_t v1 = old[0], v2 = old[1], v3 = old[2];
    uint32_t m1 = b->mesh->position_count, m2 = m1 + 1, m3 = m1 + 2;
    p[m1] = midpoint(p[v1], p[v2]);
    p[m2] = lifted_midpoint(b, p[v2], p[v3]);
    p[m3] = lifted_midpoint(b, p[v3], p[v1]);
    b->mesh->position_count += NEW_POINTS;
    b->ends[b->split_count][0] = v1;
    b->ends[b->split_count++][1] = v2;
    const Face face[NEW_FACES] = {{v3, v1, m3}, {v3, m3, m2}, {v3, m2, v2}, {v1, m1, m3}, {m3, m1, m2}, {m2, m1, v2}};
    for (int i = 0; i < NEW_FACES; i++)
        for (int k = 0; k < 3; k++) new[i][k] = face[i][k];
}

/* One level after the other, in one array: the old faces are moved to the end of the room for the new ones, which then
 * never reach an old one that hasn't been read. */
static void subdivide_all(Builder *b, uint32_t subdivisions)
{
    Face *face = b->mesh->triangle;
    uint32_t count = b->mesh->triangle_count;
    for (uint32_t n = 0; n < subdivisions; n++) {
        uint32_t next = count * NEW_FACES;
        memcpy(face + next - count, face, count * sizeof *face);
        for (uint32_t i = 0; i < count; i++) subdivide(b, face[next - count + i], face + i * NEW_FACES);
        count = next;
    }
    b->mesh->triangle_count = count;
}

/* The base counter-clockwise seen from below, so that every side (v1, v2, peak) is so seen from outside. */
static void start(Mesh *mesh, double width, double height, double length)
{
    const Vec3 point[START_POINTS] = {
        {0, 0, 0}, {0, 0, -length}, {width, 0, -length}, {width, 0, 0}, {0.5 * width, height, -0.5 * length}};
    memcpy(mesh->position, point, sizeof point);
    mesh->position_count = START_POINTS;
    for (uint32_t i = 0; i < START_FACES; i++) {
        mesh->triangle[i][0] = (i + 1) % BASE_CORNERS;
        mesh->triangle[i][1] = i;
        mesh->triangle[i][2] = PEAK;
    }
    mesh->triangle_count = START_FACES;
}

/* Raises the peak above everything else, and puts every m1 back onto its edge, whose ends may have moved. */
static double raise_peak(Builder *b, uint32_t subdivisions)
{
    Vec3 *p = b->mesh->position;
    double greatest = p[0].y, reach = 0;
    for (uint32_t i = 1; i < b->mesh->position_count; i++) greatest = fmax(greatest, p[i].y);
    p[PEAK].y = keep_finite(PEAK_FACTOR * greatest);
    for (uint32_t i = 0; i < b->mesh->position_count; i++) reach = fmax(reach, fabs(p[i].y));
    for (uint32_t i = 0; i < b->mesh->position_count; i++) p[i].y = on_grid(p[i].y, reach, subdivisions);
    for (uint32_t i = 0; i < b->split_count; i++)
        p[START_POINTS + NEW_POINTS * i] = midpoint(p[b->ends[i][0]], p[b->ends[i][1]]);
    return p[PEAK].y;
}

static float share_of(double x, double whole)
{
    double share = whole != 0 ? x / whole : 0;
    return (float)fmin(fmax(share, -1), 1);
}

static void set_uv(Mesh *mesh, double width, double length)
{
    mesh->uv_count = mesh->position_count;
    mesh->triangle_uv = mesh->triangle;
    for (uint32_t i = 0; i < mesh->position_count; i++) {
        mesh->uv[i][0] = share_of(mesh->position[i].x, width);
        mesh->uv[i][1] = share_of(mesh->position[i].z, length);
    }
}

Mesh *mountain_create(double width, double height, double length, double roughness, uint32_t subdivisions,
                      uint64_t seed, double *peak, Err *err)
{
    if (subdivisions > MAX_SUBDIVISIONS) {
        err_set(err, ERR_LIMIT, "%u subdivisions of a mountain; the limit is %d", (unsigned)subdivisions,
                MAX_SUBDIVISIONS);
        return NULL;
    }
    size_t faces = START_FACES, splits = 0;
    for (uint32_t i = 0; i < subdivisions; i++) {
        splits += faces;
        faces *= NEW_FACES;
    }
    size_t points = START_POINTS + NEW_POINTS * splits;
    Builder b = {.mesh = calloc(1, sizeof *b.mesh), .roughness = roughness, .rng = rng_seed(seed, RNG_STREAM)};
    if (!b.mesh) goto no_memory;
    b.mesh->position = malloc(points * sizeof *b.mesh->position);
    b.mesh->triangle = malloc(faces * sizeof *b.mesh->triangle);
    b.mesh->uv = malloc(points * sizeof *b.mesh->uv);
    b.ends = malloc((splits + 1) * sizeof *b.ends);
    if (!b.mesh->position || !b.mesh->triangle || !b.mesh->uv || !b.ends) goto no_memory;
    /* one more halving for the peak's place */
    width = on_grid(width, width, subdivisions + 1);
    length = on_grid(length, length, subdivisions + 1);
    start(b.mesh, width, height, length);
    subdivide_all(&b, subdivisions);
    *peak = raise_peak(&b, subdivisions);
    set_uv(b.mesh, width, length);
    mesh_drop_degenerate(b.mesh);
    b.mesh->dropped = 0;
    free(b.ends);
    return b.mesh;
no_memory:
    err_memory(err, "a mountain");
    free(b.ends);
    mesh_destroy(b.mesh);
    return NULL;
}
