/* Whitted, "An improved illumination model for shaded display" (1980), by streams: the hits of a level are shaded
 * together, light by light with a stream of shadow rays each; their mirror rays are the stream of the next level. */
#include "render/shade.h"

#include <stdlib.h>

#include "accel/accel.h"
#include "common/numeric.h"
#include "common/wide.h"

/* The greatest factor that nearness to a light gives: it leaves colours and their sums 2^32 to the end of float. A pixel is
 * white long before. */
#define BRIGHTEST 0x1p96

/* A light may lie on a surface, as far as roundings let it: its own coordinates have one, the surface's there have those of
 * two affine maps (gamma_4 each) and of the primitive's t and point. Shadow rays end so many roundings of the coordinates
 * before the light; what is nearer lies at it, and does not shade. Rays along that surface may still meet it earlier. */
#define LIGHT_ROUNDINGS 32

/* A sample on its way through the mirrors. */
typedef struct {
    uint32_t slot;    /* index of its camera ray */
    float weight;     /* of what the path brings to the sample */
    float mirror;     /* share of the mirror's colour in the surface it left last */
    Rgb local;        /* that surface's own colour */
} Path;

/* A cache line more than a stream: rows a power of two long would all fall on the same lines of the L1 cache. */
enum { ROW = STREAM_RAYS + 16 };

/* Vectors of the points of a level. */
typedef struct { double x[ROW], y[ROW], z[ROW]; } Vecs;

/* The hits that are being shaded, in world space, one array for each number: loops over them become vectors. */
typedef struct {
    Vecs p;
    Vecs n;                          /* shading normals, unit, on the viewer's side */
    Vecs ng;                         /* geometric normals, unit, toward the viewer; before that the surface's own */
    Vecs d, v;                       /* of the rays that came here; toward the viewer, unit */
    Vecs off;                        /* from p to where rays start that leave on the viewer's side; before that p's error */
    double side[ROW];        /* of the surface's own normal, that the viewer is on: 1 or -1 */
    double reach[ROW];       /* greatest coordinate of p */
    float kd[3][ROW];
    Rgb sum[ROW];
    LeftFace face[ROW];      /* what they lie on, if that is plane, */
    Vec3 face_n[ROW];        /* and its normal in the object's space */
    const Object *object[ROW];
    const Material *material[ROW];
    Path path[ROW];
    uint32_t bent[ROW];      /* those with shading normals of their own, */
    Vec3 bent_n[ROW];        /* of any length */
    uint32_t count, bents;
} Points;

/* A light at all points. */
typedef struct {
    Vecs o, d;                       /* shadow rays */
    double tmax[ROW];
    double above[ROW];       /* they start on the viewer's side: 1, or -1 */
    float n_l[ROW], r_v[ROW];
    float scale[ROW];
    float share[3][ROW];     /* what the material makes of it, then what it brings if nothing is in its way */
} Lighting;

struct Shader {
    Hit hit[STREAM_RAYS];
    Path path[STREAM_RAYS];
    Points point;
    Lighting lighting;
    Ray shadow[STREAM_RAYS];
    LeftFace left[STREAM_RAYS];      /* by shadow[i], or by the mirror rays of the next level */
    uint32_t lit[STREAM_RAYS];       /* the point of shadow[i] */
    bool blocked[STREAM_RAYS];
};

static inline Vec3 get(const Vecs *v, uint32_t i) { return vec3_make(v->x[i], v->y[i], v->z[i]); }
static inline void put(Vecs *v, uint32_t i, Vec3 a)
{
    v->x[i] = a.x;
    v->y[i] = a.y;
    v->z[i] = a.z;
}

Shader *shader_create(void) { return aligned_alloc(64, (sizeof(Shader) + 63) / 64 * 64); }
void shader_destroy(Shader *shader) { free(shader); }

/* Bound on the distance of the world-space point from the world-space surface: what the object's own bound becomes, the
 * roundings of the way there, and, since rays will be carried back by to_object, which is not to_world's exact inverse,
 * how far that leads from where it came. */
static inline Vec3 world_error(const Affine *to_world, const Affine *to_object, Vec3 own, Vec3 own_err, Vec3 p)
{
    Vec3 back = affine_point(to_object, p);
    Vec3 err = vec3_add(affine_point_rounding(to_object, p), vec3_abs(vec3_sub(back, own)));
    return affine_point_error(to_world, own, vec3_add(own_err, err));
}

/* A ray that leaves p starts just outside the error bound, along ng (pbrt, 3rd ed., 3.9.5); the rounding of the sum itself
 * is part of the distance. */
static inline Vec3 leaving_offset(Vec3 p, Vec3 p_err, Vec3 ng)
{
    Vec3 slack = vec3_add(p_err, vec3_scale(vec3_abs(p), 4 * UNIT_ROUNDOFF));
    return vec3_scale(ng, vec3_dot(vec3_abs(ng), slack) * (1 + 8 * UNIT_ROUNDOFF));
}

/* On which side of the surface a ray toward d starts, on d's: 1 on the viewer's. */
static inline double leaving_side(Vec3 d, Vec3 ng) { return vec3_dot(d, ng) < 0 ? -1 : 1; }

/* The slope of a direction against a plane face has the right sign if it is more than this, relative to the direction's
 * greatest component and the sum of the normal's: the normal is off by 30 roundings as an angle (triangle_normal) and two
 * of its scaling, times sqrt(3) for the direction's length, and the product by three. */
#define SLOPE_ROUNDINGS 60

/* The face that a ray along d leaves on a side, or none if it isn't sure that it leads away from it. The kernels map the
 * direction in the same way. */
static LeftFace left_face(const Points *s, uint32_t i, double above, Vec3 d)
{
    const LeftFace none = {HIT_NONE, 0};
    if (s->face[i].object == HIT_NONE) return none;
    if (!s->object[i]->in_world) d = affine_vector(&s->object[i]->to_object, d);
    Vec3 n = vec3_abs(s->face_n[i]);
    double slope = above * s->side[i] * vec3_dot(d, s->face_n[i]), size = vec3_max(vec3_abs(d)) * (n.x + n.y + n.z);
    return slope > GAMMA(SLOPE_ROUNDINGS) * size + 0x1p-900 ? s->face[i] : none;
}

static bool are_equal(Vec3 a, Vec3 b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

/* Adds a hit: its surface, in the object's space. */
static inline __attribute__((always_inline)) void add_point(const World *world, const Ray *ray, const Hit *hit,
                                                            Points *points, unsigned features)
{
    const Object *object = &world->objects[hit->object];
    uint32_t i = points->count++;
    Ray local = *ray;
    if (!object->in_world) {
        local.o = affine_point(&object->to_object, ray->o);
        local.d = affine_vector(&object->to_object, ray->d);
    }
    const Shading *shading = &world->shadings[object->shading + hit->leaf];
    bool uv = ((features & FEATURE_TEXTURE) && shading->texture) || ((features & FEATURE_BUMP) && shading->bump);
    Surface s = {.plane = false};
    object->prim->ops->surface(object->prim, &local, hit, uv, &s);
    Rgb kd = shading->material->kd;
    if ((features & FEATURE_TEXTURE) && shading->texture) {
        Vec3 at = s.p;
        if (shading->texture->ops->by_place && object->prim->ops->own) object->prim->ops->own(object->prim, hit, &at, NULL);
        kd = shading->texture->ops->colour(shading->texture, s.u, s.v, at);
    }
    if ((features & FEATURE_BUMP) && shading->bump) {
        const Affine *own = object->prim->ops->own ? object->prim->ops->own(object->prim, hit, NULL, &s.ns) : NULL;
        s.ns = shading->bump->ops->bend(shading->bump, s.u, s.v, s.ns);
        if (own) s.ns = affine_normal(own, s.ns);
    }
    points->object[i] = object;
    points->material[i] = shading->material;
    for (int k = 0; k < 3; k++) points->kd[k][i] = kd.raw[k];
    points->sum[i] = glms_vec3_mul(world->ambient, kd);
    points->face[i] = (LeftFace){s.plane ? hit->object : HIT_NONE, hit->part};
    points->face_n[i] = s.n;
    put(&points->d, i, ray->d);
    put(&points->p, i, s.p);
    put(&points->off, i, s.p_err);
    put(&points->ng, i, s.n);
    if (are_equal(s.n, s.ns)) return;
    points->bent[points->bents] = i;
    points->bent_n[points->bents++] = object->in_world ? s.ns : affine_normal(&object->to_object, s.ns);
}

/* Takes points of one object from its space to the world. */
WIDE static void place_points(Points *s, const Object *object, uint32_t begin, uint32_t end)
{
    const Affine to_world = object->to_world, to_object = object->to_object;
    for (uint32_t i = begin; i < end; i++) {
        Vec3 own = get(&s->p, i), own_err = get(&s->off, i), n = get(&s->ng, i), p = affine_point(&to_world, own);
        put(&s->p, i, p);
        put(&s->off, i, world_error(&to_world, &to_object, own, own_err, p));
        put(&s->ng, i, affine_normal(&to_object, n));
    }
}

/* Squares of lengths between which vec3_normalize does nothing special. */
static inline bool is_usual(double squares) { return (squares > 1e-200) & (squares < 1e200); }

static inline Vec3 unit(Vec3 a, bool usual)
{
    return usual ? vec3_scale(a, 1.0 / sqrt(vec3_dot(a, a))) : vec3_normalize(a);
}

static inline __attribute__((always_inline)) void face_viewer(Points *s, uint32_t i, bool usual)
{
    Vec3 ng = unit(get(&s->ng, i), usual), v = vec3_neg(unit(get(&s->d, i), usual)), p = get(&s->p, i);
    double side = vec3_dot(ng, v) < 0 ? -1 : 1;
    ng = vec3_scale(ng, side);
    s->side[i] = side;
    s->reach[i] = vec3_max(vec3_abs(p));
    put(&s->v, i, v);
    put(&s->ng, i, ng);
    put(&s->n, i, ng);
    put(&s->off, i, leaving_offset(p, get(&s->off, i), ng));
}

WIDE static void face_viewers(Points *s)
{
    const uint32_t count = s->count;
    uint64_t odd = 0;
    for (uint32_t i = 0; i < count; i++) {
        Vec3 n = get(&s->ng, i), d = get(&s->d, i);
        unsigned usual_n = is_usual(vec3_dot(n, n)), usual_d = is_usual(vec3_dot(d, d));
        odd |= (usual_n & usual_d) ^ 1;
    }
    if (odd)
        for (uint32_t i = 0; i < count; i++) face_viewer(s, i, false);
    else
        for (uint32_t i = 0; i < count; i++) face_viewer(s, i, true);
}

/* What was added becomes points in the world, object by object. */
static void finish_points(Points *s)
{
    for (uint32_t begin = 0, end; begin < s->count; begin = end) {
        for (end = begin + 1; end < s->count && s->object[end] == s->object[begin];) end++;
        if (!s->object[begin]->in_world) place_points(s, s->object[begin], begin, end);
    }
    face_viewers(s);
    for (uint32_t k = 0; k < s->bents; k++) {
        uint32_t i = s->bent[k];
        Vec3 n = vec3_normalize(s->bent_n[k]);
        put(&s->n, i, vec3_dot(n, get(&s->ng, i)) < 0 ? vec3_neg(n) : n);
    }
}

/* 1 / falloff at distance d. */
static inline float light_scale(const double falloff[3], double d)
{
    double scale = 1 / (falloff[0] + falloff[1] * d + falloff[2] * (d * d));
    scale = scale > BRIGHTEST ? BRIGHTEST : scale;
    return (float)(scale < -BRIGHTEST ? -BRIGHTEST : scale);
}

/* Distances between which a difference's length is found without scaling it. */
#define NEAREST_USUAL 1e-100
#define FARTHEST_USUAL 1e100

static inline __attribute__((always_inline)) void light_point(const Light *light, double light_reach, const Points *s,
                                                              Lighting *lit, uint32_t i, bool usual)
{
    Vec3 p = get(&s->p, i), n = get(&s->n, i), off = get(&s->off, i), to_light = vec3_sub(light->position, p);
    double d = vec3_length(to_light), inverse = 1 / d;
    Vec3 l = usual || (d > NEAREST_USUAL && d < FARTHEST_USUAL) ? vec3_scale(to_light, inverse) : vec3_normalize(to_light);
    double n_l = vec3_dot(n, l), above = leaving_side(l, get(&s->ng, i));
    Vec3 r = vec3_sub(vec3_scale(n, 2 * n_l), l), o = vec3_at(p, above, off);
    lit->n_l[i] = (float)n_l;
    lit->r_v[i] = (float)vec3_dot(r, get(&s->v, i));
    lit->scale[i] = light_scale(light->falloff, d);
    lit->above[i] = above;
    lit->tmax[i] = 1 - GAMMA(LIGHT_ROUNDINGS) * (light_reach + s->reach[i]) * inverse;
    put(&lit->o, i, o);
    put(&lit->d, i, vec3_sub(light->position, o));
}

WIDE static void light_points(const Light *given, const Points *restrict s, Lighting *restrict lit)
{
    const uint32_t n = s->count;
    const Light light = *given;
    double reach = vec3_max(vec3_abs(light.position));
    uint64_t odd = 0;
    for (uint32_t i = 0; i < n; i++) {
        Vec3 to_light = vec3_sub(light.position, get(&s->p, i));
        double squares = vec3_dot(to_light, to_light);
        unsigned far = squares > 2 * NEAREST_USUAL * NEAREST_USUAL, near = squares < FARTHEST_USUAL * FARTHEST_USUAL / 2;
        odd |= (far & near) ^ 1;
    }
    if (odd)
        for (uint32_t i = 0; i < n; i++) light_point(&light, reach, s, lit, i, false);
    else
        for (uint32_t i = 0; i < n; i++) light_point(&light, reach, s, lit, i, true);
}

/* What the materials reflect of it. */
WIDE static void scale_light(Rgb colour, Lighting *lit, uint32_t n)
{
    const float r = colour.r, g = colour.g, b = colour.b;
    for (uint32_t i = 0; i < n; i++) {
        lit->share[0][i] = lit->share[0][i] * r * lit->scale[i];
        lit->share[1][i] = lit->share[1][i] * g * lit->scale[i];
        lit->share[2][i] = lit->share[2][i] * b * lit->scale[i];
    }
}

static void reflect(const Points *s, Lighting *lit)
{
    for (uint32_t begin = 0, end; begin < s->count; begin = end) {
        const Material *material = s->material[begin];
        for (end = begin + 1; end < s->count && s->material[end] == material;) end++;
        const float *kd[3] = {s->kd[0] + begin, s->kd[1] + begin, s->kd[2] + begin};
        float *share[3] = {lit->share[0] + begin, lit->share[1] + begin, lit->share[2] + begin};
        material->ops->reflect_light(material, kd, lit->n_l + begin, lit->r_v + begin, share, end - begin);
    }
}

/* Adds the light to the points that it reaches. */
static void add_light(const World *world, const Light *light, Shader *s, RenderStats *stats, Scratch *scratch)
{
    Points *points = &s->point;
    Lighting *lit = &s->lighting;
    light_points(light, points, lit);
    reflect(points, lit);
    scale_light(light->colour, lit, points->count);
    uint32_t n = 0;
    for (uint32_t i = 0; i < points->count; i++) {
        if (!(lit->n_l[i] > 0) || (lit->share[0][i] == 0 && lit->share[1][i] == 0 && lit->share[2][i] == 0)) continue;
        s->shadow[n] = (Ray){get(&lit->o, i), get(&lit->d, i), 0, lit->tmax[i]};
        s->left[n] = left_face(points, i, lit->above[i], s->shadow[n].d);
        s->lit[n++] = i;
    }
    world_occluded(world, s->shadow, s->left, s->blocked, n, scratch);
    stats->shadow_rays += n;
    for (uint32_t k = 0; k < n; k++) {
        uint32_t i = s->lit[k];
        if (s->blocked[k]) continue;
        points->sum[i] = glms_vec3_add(points->sum[i], rgb(lit->share[0][i], lit->share[1][i], lit->share[2][i]));
    }
}

static void add_colour(double colour[3], float weight, Rgb c)
{
    colour[0] += (double)(weight * c.x);
    colour[1] += (double)(weight * c.y);
    colour[2] += (double)(weight * c.z);
}

/* The mirror direction D - 2 (D.n) n; one that would go below the surface takes the geometric normal instead. */
static Ray mirror_ray(const Points *s, uint32_t i, LeftFace *left)
{
    Vec3 from = get(&s->d, i), n = get(&s->n, i), ng = get(&s->ng, i);
    Vec3 d = vec3_at(from, -2 * vec3_dot(from, n), n);
    if (!(vec3_dot(d, ng) > 0)) d = vec3_at(from, -2 * vec3_dot(from, ng), ng);
    double above = leaving_side(d, ng);
    *left = left_face(s, i, above, d);
    return (Ray){vec3_at(get(&s->p, i), above, get(&s->off, i)), d, 0, INFINITY};
}

/* What is known once a level's rays have their hits: misses end their paths, hits become points. */
static inline __attribute__((always_inline)) void sort_hits(const World *world, Shader *s, const Ray *rays,
                                                            const Rgb *missed, uint32_t n, uint32_t depth,
                                                            double (*colour)[3], unsigned features)
{
    s->point.count = s->point.bents = 0;
    for (uint32_t i = 0; i < n; i++) {
        Path path = s->path[i];
        if (s->hit[i].object == HIT_NONE) {
            add_colour(colour[path.slot], path.weight, depth == 0 ? missed[path.slot] : path.local);
            continue;
        }
        if (depth > 0) {
            add_colour(colour[path.slot], path.weight * (1 - path.mirror), path.local);
            path.weight *= path.mirror;
        }
        s->point.path[s->point.count] = path;
        add_point(world, &rays[i], &s->hit[i], &s->point, features);
    }
    finish_points(&s->point);
}

static inline __attribute__((always_inline)) void shade(const World *world, Shader *s, Ray *rays, const Rgb *missed,
                                                        uint32_t n, uint32_t max_depth, double (*colour)[3],
                                                        RenderStats *stats, Scratch *scratch, unsigned features)
{
    Points *points = &s->point;
    for (uint32_t i = 0; i < n; i++) {
        s->path[i] = (Path){.slot = i, .weight = 1};
        colour[i][0] = colour[i][1] = colour[i][2] = 0;
    }
    stats->camera_rays += n;
    for (uint32_t depth = 0; n > 0; depth++) {
        world_intersect(world, rays, depth > 0 ? s->left : NULL, s->hit, n, scratch);
        sort_hits(world, s, rays, missed, n, depth, colour, features);
        for (uint32_t i = 0; i < world->light_count && points->count; i++)
            add_light(world, &world->lights[i], s, stats, scratch);
        n = 0;
        for (uint32_t i = 0; i < points->count; i++) {
            Path path = points->path[i];
            float mirror = points->material[i]->mirror;
            if ((features & FEATURE_MIRROR) && mirror > 0 && depth < max_depth) {
                rays[n] = mirror_ray(points, i, &s->left[n]);
                s->path[n++] = (Path){path.slot, path.weight, mirror, points->sum[i]};
            } else {
                add_colour(colour[path.slot], path.weight, points->sum[i]);
                if (features & FEATURE_MIRROR) stats->dropped += weight_units(path.weight * mirror);
            }
        }
        stats->mirror_rays += n;
    }
}

/* One loop for each set of features, so that a scene pays for none that it lacks. */
typedef void ShadeLoop(const World *, Shader *, Ray *, const Rgb *, uint32_t, uint32_t, double (*)[3], RenderStats *,
                       Scratch *);

#define SHADE_LOOP(features)                                                                                         \
    static void shade_##features(const World *world, Shader *shader, Ray *rays, const Rgb *missed, uint32_t n,       \
                                 uint32_t max_depth, double (*colour)[3], RenderStats *stats, Scratch *scratch)      \
    {                                                                                                                \
        shade(world, shader, rays, missed, n, max_depth, colour, stats, scratch, features);                          \
    }

SHADE_LOOP(0)
SHADE_LOOP(1)
SHADE_LOOP(2)
SHADE_LOOP(3)
SHADE_LOOP(4)
SHADE_LOOP(5)
SHADE_LOOP(6)
SHADE_LOOP(7)

static ShadeLoop *const loops[FEATURE_ALL + 1] = {shade_0, shade_1, shade_2, shade_3,
                                                  shade_4, shade_5, shade_6, shade_7};

void shade_stream(const World *world, Shader *shader, Ray *rays, const Rgb *missed, uint32_t n, uint32_t max_depth,
                  double (*colour)[3], RenderStats *stats, Scratch *scratch)
{
    loops[world->features & FEATURE_ALL](world, shader, rays, missed, n, max_depth, colour, stats, scratch);
}
