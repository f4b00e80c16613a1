#include "bench/kernels/shapes.h"

#include <stdlib.h>
#include <string.h>

#include "common/rng.h"
#include "support/check.h"

enum { SEED = 20261125 };

static double uniform(Rng *rng, double low, double high) { return low + (high - low) * rng_double(rng); }

static double to_float(double x) { return (double)(float)x; }

/* ---- noise ---- */

static double lattice(double x, double y, double z)
{
    uint64_t key = hash64((uint64_t)(int64_t)x ^ hash64((uint64_t)(int64_t)y ^ hash64((uint64_t)(int64_t)z ^ SEED)));
    return (double)(key >> 11) * 0x1p-52 - 1;
}

static double mix(double a, double b, double t) { return a + (b - a) * (t * t * (3 - 2 * t)); }

/* Value noise: smooth, in [-1, 1], one value for each point with whole coordinates. */
static double noise(Vec3 p)
{
    double x = floor(p.x), y = floor(p.y), z = floor(p.z), plane[2];
    for (int k = 0; k < 2; k++)
        plane[k] = mix(mix(lattice(x, y, z + k), lattice(x + 1, y, z + k), p.x - x),
                       mix(lattice(x, y + 1, z + k), lattice(x + 1, y + 1, z + k), p.x - x), p.y - y);
    return mix(plane[0], plane[1], p.z - z);
}

static double fractal(Vec3 p, int octaves, double gain)
{
    double sum = 0, size = 1;
    for (int i = 0; i < octaves; i++) {
        sum += size * noise(p);
        size *= gain;
        p = vec3_add(vec3_scale(p, 2), vec3_make(17.3, 31.7, 5.1));
    }
    return sum;
}

/* ---- surfaces made of grids ---- */

typedef struct { Mesh *mesh; uint64_t position_capacity, triangle_capacity; } Builder;

/* The point of a surface at (u, v) in [0, 1]^2. */
typedef Vec3 At(const void *context, double u, double v);

static void *grown(void *p, size_t item, uint64_t least, uint64_t *capacity)
{
    if (least <= *capacity) return p;
    *capacity = least + least / 2;
    p = realloc(p, (size_t)*capacity * item);
    CHECK(p);
    return p;
}

/* rows x columns squares, two triangles each. */
static void add_grid(Builder *b, uint32_t rows, uint32_t columns, At *at, const void *context)
{
    Mesh *m = b->mesh;
    uint64_t points = (rows + (uint64_t)1) * (columns + 1), triangles = (uint64_t)2 * rows * columns;
    m->position = grown(m->position, sizeof *m->position, m->position_count + points, &b->position_capacity);
    m->triangle = grown(m->triangle, sizeof *m->triangle, m->triangle_count + triangles, &b->triangle_capacity);
    uint32_t first = m->position_count;
    for (uint32_t i = 0; i <= rows; i++)
        for (uint32_t j = 0; j <= columns; j++) {
            Vec3 p = at(context, (double)i / rows, (double)j / columns);
            m->position[m->position_count++] = vec3_make(to_float(p.x), to_float(p.y), to_float(p.z));
        }
    for (uint32_t i = 0; i < rows; i++)
        for (uint32_t j = 0; j < columns; j++) {
            uint32_t k = first + i * (columns + 1) + j, l = k + columns + 1;
            uint32_t t[2][3] = {{k, k + 1, l}, {l, k + 1, l + 1}};
            memcpy(m->triangle[m->triangle_count], t, sizeof t);
            m->triangle_count += 2;
        }
}

typedef struct { Vec3 corner, along_u, along_v; } Flat;

static Vec3 flat_at(const void *context, double u, double v)
{
    const Flat *f = context;
    return vec3_at(vec3_at(f->corner, u, f->along_u), v, f->along_v);
}

static void add_box(Builder *b, Vec3 low, Vec3 high, uint32_t squares)
{
    Vec3 size = vec3_sub(high, low);
    Vec3 edge[3] = {vec3_make(size.x, 0, 0), vec3_make(0, size.y, 0), vec3_make(0, 0, size.z)};
    for (int a = 0; a < 3; a++) {
        Vec3 u = edge[(a + 1) % 3], v = edge[(a + 2) % 3];
        Flat near = {low, v, u}, far = {vec3_add(low, edge[a]), u, v};
        add_grid(b, squares, squares, flat_at, &near);
        add_grid(b, squares, squares, flat_at, &far);
    }
}

/* ---- terrain ---- */

static Vec3 terrain_at(const void *context, double u, double v)
{
    (void)context;
    double x = 16 * u - 8, z = 16 * v - 8;
    double ridge = 1 - fabs(fractal(vec3_make(0.22 * x, 3.5, 0.22 * z), 3, 0.5));
    return vec3_make(x, 1.6 * ridge * ridge + 0.5 * fractal(vec3_make(0.7 * x, 9.5, 0.7 * z), 11, 0.48) - 1.2, z);
}

static void make_terrain(Shape *s, Builder *b, uint32_t triangles)
{
    uint32_t side = (uint32_t)lround(sqrt(triangles / 2.0));
    add_grid(b, side, side, terrain_at, NULL);
    s->eye = vec3_make(0.5, 4, 9);
    s->view = vec3_make(0, -0.55, -1);
    s->light = vec3_make(-6, 9, 5);
    s->fov_deg = 50;
}

/* ---- a thing that was scanned ---- */

/* Where the triangles are small: the sphere's points are moved this way and put back onto the sphere. */
static const Vec3 dense = {0.35, 0.5, -0.2};

typedef struct { int axis; double side; } Face;

/* A face of the cube, blown up to a sphere, unevenly, and given bumps. Faces share the points of their edges. */
static Vec3 scan_at(const void *context, double u, double v)
{
    const Face *face = context;
    double p[3];
    p[face->axis] = face->side;
    p[(face->axis + 1) % 3] = 2 * (face->side > 0 ? u : v) - 1;
    p[(face->axis + 2) % 3] = 2 * (face->side > 0 ? v : u) - 1;
    Vec3 q = vec3_normalize(vec3_add(vec3_normalize(vec3_make(p[0], p[1], p[2])), dense));
    double r = 1 + 0.22 * fractal(vec3_scale(q, 1.9), 3, 0.5) + 0.025 * fractal(vec3_scale(q, 13), 5, 0.55);
    return vec3_scale(q, 5 * r);
}

static void make_scan(Shape *s, Builder *b, uint32_t triangles)
{
    uint32_t side = (uint32_t)lround(sqrt(triangles / 12.0));
    for (int k = 0; k < 6; k++) {
        Face face = {k % 3, k < 3 ? 1 : -1};
        add_grid(b, side, side, scan_at, &face);
    }
    s->eye = vec3_make(6, 5, 15);
    s->view = vec3_make(-6, -5, -15);
    s->light = vec3_make(-12, 20, 14);
    s->fov_deg = 42;
}

/* ---- a room ---- */

typedef struct { Vec3 centre; double radius, squash; } Pebble;

static Vec3 pebble_at(const void *context, double u, double v)
{
    const Pebble *p = context;
    double a = M_PI * u, b = 2 * M_PI * (v < 1 ? v : 0);
    Vec3 n = vec3_make(sin(a) * sin(b), cos(a), sin(a) * cos(b));
    if (u == 0 || u == 1) n = vec3_make(0, u == 0 ? 1 : -1, 0);
    double r = p->radius * (1 + 0.12 * fractal(vec3_add(vec3_scale(n, 2), p->centre), 3, 0.5));
    return vec3_add(p->centre, vec3_make(r * n.x, r * n.y * p->squash, r * n.z));
}

static Vec3 curtain_at(const void *context, double u, double v)
{
    (void)context;
    return vec3_make(7.85 + 0.1 * sin(40 * v) * (1.2 - 0.6 * u), 2.8 - 2.6 * u, 1 + 4 * v + 0.05 * sin(9 * u + 20 * v));
}

static void add_on_legs(Builder *b, Vec3 low, Vec3 high, double thickness)
{
    add_box(b, vec3_make(low.x, high.y - thickness, low.z), high, 1);
    for (int k = 0; k < 4; k++) {
        Vec3 foot = vec3_make(k % 2 ? high.x - thickness : low.x, low.y, k / 2 ? high.z - thickness : low.z);
        add_box(b, foot, vec3_add(foot, vec3_make(thickness, high.y - low.y - thickness, thickness)), 1);
    }
}

static void make_room(Shape *s, Builder *b, uint32_t triangles)
{
    enum { TABLES = 5, SHELVES = 6, THINGS = 480 };
    Rng rng = rng_seed(SEED, 1);
    add_box(b, vec3_make(0, 0, 0), vec3_make(8, 3, 6), 6);
    Vec3 place[THINGS];
    for (int i = 0; i < TABLES; i++) {
        Vec3 at = vec3_make(1.6 + 1.25 * i, 0, 1.6 + 2.2 * (i % 2));
        add_on_legs(b, at, vec3_add(at, vec3_make(0.9, 0.75, 1.4)), 0.05);
        for (int k = 0; k < 2; k++) {
            Vec3 seat = vec3_add(at, vec3_make(0.25 + 0.1 * k, 0, k ? 1.5 : -0.5));
            add_on_legs(b, seat, vec3_add(seat, vec3_make(0.4, 0.45, 0.4)), 0.035);
            Vec3 back = vec3_add(seat, vec3_make(0, 0.45, k ? 0.36 : 0));
            add_box(b, back, vec3_add(back, vec3_make(0.4, 0.5, 0.04)), 1);
        }
    }
    for (int i = 0; i < SHELVES; i++)
        add_box(b, vec3_make(2, 0.4 + 0.4 * i, 5.6), vec3_make(7, 0.43 + 0.4 * i, 6), 1);
    for (int i = 0; i < THINGS; i++) {  /* on tables, shelves, the floor */
        int k = i % 3 == 0 ? i / 3 % TABLES : i / 3 % SHELVES;
        double x = rng_double(&rng), z = rng_double(&rng);
        place[i] = i % 3 == 0   ? vec3_make(1.7 + 1.25 * k + 0.7 * x, 0.75, 1.7 + 2.2 * (k % 2) + 1.2 * z)
                   : i % 3 == 1 ? vec3_make(2.1 + 4.8 * x, 0.43 + 0.4 * k, 5.65 + 0.3 * z)
                                : vec3_make(0.8 + 6.7 * x, 0, 0.8 + 4.6 * z);
    }
    double left = triangles > b->mesh->triangle_count ? triangles - b->mesh->triangle_count : 0;
    uint32_t fold = (uint32_t)lround(sqrt(0.1 * left / 8)) + 1;
    add_grid(b, fold, 4 * fold, curtain_at, NULL);
    uint32_t rows = (uint32_t)lround(sqrt(0.9 * left / THINGS / 4)) + 1;
    uint32_t columns = (uint32_t)lround(0.9 * left / THINGS / 2 / (rows - 1));
    for (int i = 0; i < THINGS; i++) {
        double size = uniform(&rng, 0.2, 1), squash = uniform(&rng, 0.6, 1.4), radius = 0.03 + 0.15 * size * size;
        Pebble p = {vec3_add(place[i], vec3_make(0, radius * squash, 0)), radius, squash};
        add_grid(b, rows, columns < 3 ? 3 : columns, pebble_at, &p);
    }
    s->eye = vec3_make(0.7, 1.4, 0.9);
    s->view = vec3_make(1, -0.25, 0.7);
    s->light = vec3_make(4.2, 2.85, 3);
    s->fov_deg = 65;
}

/* ---- blades ---- */

typedef struct { Vec3 root, lean; double height, radius, turn; } Blade;

/* A three-sided tube that bends over and tapers; u runs along it, v around. */
static Vec3 blade_at(const void *context, double u, double v)
{
    const Blade *b = context;
    double a = b->turn + 2 * M_PI * (v < 1 ? v : 0), r = b->radius * (1 - 0.85 * u);
    Vec3 p = vec3_add(vec3_at(b->root, u * u, b->lean), vec3_make(0, b->height * u, 0));
    return vec3_add(p, vec3_make(r * sin(a), 0, r * cos(a)));
}

static void make_thin(Shape *s, Builder *b, uint32_t triangles)
{
    enum { SIDES = 3, PIECES = 3 };
    Rng rng = rng_seed(SEED, 2);
    Flat ground = {vec3_make(-4, 0, -4), vec3_make(0, 0, 8), vec3_make(8, 0, 0)};
    add_grid(b, 1, 1, flat_at, &ground);
    uint32_t blades = triangles / (2 * SIDES * PIECES);
    for (uint32_t i = 0; i < blades; i++) {
        Blade blade = {.radius = uniform(&rng, 0.003, 0.007)};  /* one draw after the other, in this order */
        blade.root.x = uniform(&rng, -4, 4);
        blade.root.z = uniform(&rng, -4, 4);
        blade.lean.x = uniform(&rng, -0.5, 0.5);
        blade.lean.z = uniform(&rng, -0.5, 0.5);
        blade.height = uniform(&rng, 0.7, 1.5);
        blade.turn = uniform(&rng, 0, 2 * M_PI);
        add_grid(b, PIECES, SIDES, blade_at, &blade);
    }
    s->eye = vec3_make(0.3, 2, 6.5);
    s->view = vec3_make(0, -0.3, -1);
    s->light = vec3_make(3, 8, 4);
    s->fov_deg = 45;
}

void shape_make(Shape *shape, const char *name, uint32_t triangles)
{
    static const struct { const char *name; void (*make)(Shape *, Builder *, uint32_t); } makers[] = {
        {"terrain", make_terrain}, {"scan", make_scan}, {"room", make_room}, {"thin", make_thin}};
    Builder b = {.mesh = calloc(1, sizeof *b.mesh)};
    CHECK(b.mesh);
    for (size_t i = 0; i < sizeof makers / sizeof *makers; i++)
        if (strcmp(name, makers[i].name) == 0) makers[i].make(shape, &b, triangles);
    CHECK(b.mesh->triangle_count > 0);
    mesh_drop_degenerate(b.mesh);
    shape->mesh = b.mesh;
}
