/* Whitted, "An improved illumination model for shaded display" (1980), by streams: the hits of a level are shaded
 * together, light by light with a stream of shadow rays each; their mirror rays are the stream of the next level. */
#include "render/shade.h"

#include <stdlib.h>

#include "accel/accel.h"
#include "common/numeric.h"

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

/* A hit that is being shaded, in world space. */
typedef struct {
    Vec3 p;
    Vec3 n;           /* shading normal, unit, on the viewer's side */
    Vec3 ng;          /* geometric normal, unit, toward the viewer */
    Vec3 v;           /* toward the viewer, unit */
    Vec3 off;         /* from p to where rays start that leave on the viewer's side */
    double reach;     /* greatest coordinate of p */
    LeftFace face;    /* what it lies on, if that is plane */
    const Object *object;
    Vec3 face_n;      /* the face's normal in the object's space, on the side of ng */
    const Material *material;
    Rgb kd;
    Rgb sum;
    Path path;
    Vec3 d;           /* of the ray that came here */
} Point;

struct Shader {
    Hit hit[STREAM_RAYS];
    Path path[STREAM_RAYS];
    Point point[STREAM_RAYS];
    Ray shadow[STREAM_RAYS];
    LeftFace left[STREAM_RAYS];      /* by shadow[i], or by the mirror rays of the next level */
    Rgb light[STREAM_RAYS];          /* what shadow[i] brings if nothing is in its way */
    uint32_t lit[STREAM_RAYS];       /* to which point */
    bool blocked[STREAM_RAYS];
};

Shader *shader_create(void) { return aligned_alloc(64, (sizeof(Shader) + 63) / 64 * 64); }
void shader_destroy(Shader *shader) { free(shader); }

/* Bound on the distance of the world-space point from the world-space surface: what the object's own bound becomes, the
 * roundings of the way there, and, since rays will be carried back by to_object, which is not to_world's exact inverse,
 * how far that leads from where it came. */
static Vec3 world_error(const Object *object, const Surface *s, Vec3 p)
{
    Vec3 back = affine_point(&object->to_object, p);
    Vec3 err = vec3_add(affine_point_rounding(&object->to_object, p), vec3_abs(vec3_sub(back, s->p)));
    return affine_point_error(&object->to_world, s->p, vec3_add(s->p_err, err));
}

/* A ray that leaves p starts just outside the error bound, along ng (pbrt, 3rd ed., 3.9.5); the rounding of the sum itself
 * is part of the distance. */
static Vec3 leaving_offset(Vec3 p, Vec3 p_err, Vec3 ng)
{
    Vec3 slack = vec3_add(p_err, vec3_scale(vec3_abs(p), 4 * UNIT_ROUNDOFF));
    return vec3_scale(ng, vec3_dot(vec3_abs(ng), slack) * (1 + 8 * UNIT_ROUNDOFF));
}

/* On which side of the surface a ray toward d starts: on d's. */
static bool leaves_above(const Point *point, Vec3 d) { return !(vec3_dot(d, point->ng) < 0); }

static Vec3 leaving_origin(const Point *point, bool above)
{
    return above ? vec3_add(point->p, point->off) : vec3_sub(point->p, point->off);
}

/* The slope of a direction against a plane face has the right sign if it is more than this, relative to the direction's
 * greatest component and the sum of the normal's: the normal is off by 30 roundings as an angle (triangle_normal) and two
 * of its scaling, times sqrt(3) for the direction's length, and the product by three. */
#define SLOPE_ROUNDINGS 60

/* The face that a ray along d leaves on a side, or none if it isn't sure that it leads away from it. The kernels map the
 * direction in the same way. */
static LeftFace left_face(const Point *point, bool above, Vec3 d)
{
    const LeftFace none = {HIT_NONE, 0};
    if (point->face.object == HIT_NONE) return none;
    if (!point->object->in_world) d = affine_vector(&point->object->to_object, d);
    Vec3 n = vec3_abs(point->face_n);
    double slope = vec3_dot(d, point->face_n), size = vec3_max(vec3_abs(d)) * (n.x + n.y + n.z);
    return (above ? slope : -slope) > GAMMA(SLOPE_ROUNDINGS) * size + 0x1p-900 ? point->face : none;
}

static bool are_equal(Vec3 a, Vec3 b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

static inline __attribute__((always_inline)) void make_point(const World *world, const Ray *ray, const Hit *hit,
                                                             Point *point, unsigned features)
{
    const Object *object = &world->objects[hit->object];
    Ray local = *ray;
    if (!object->in_world) {
        local.o = affine_point(&object->to_object, ray->o);
        local.d = affine_vector(&object->to_object, ray->d);
    }
    const Shading *shading = &world->shadings[object->shading + hit->leaf];
    bool uv = ((features & FEATURE_TEXTURE) && shading->texture) || ((features & FEATURE_BUMP) && shading->bump);
    Surface s = {.plane = false};
    object->prim->ops->surface(object->prim, &local, hit, uv, &s);
    point->material = shading->material;
    point->kd = shading->material->kd;
    if ((features & FEATURE_TEXTURE) && shading->texture) {
        Vec3 at = s.p;
        if (shading->texture->ops->by_place && object->prim->ops->own) object->prim->ops->own(object->prim, hit, &at, NULL);
        point->kd = shading->texture->ops->colour(shading->texture, s.u, s.v, at);
    }
    if ((features & FEATURE_BUMP) && shading->bump) {
        const Affine *own = object->prim->ops->own ? object->prim->ops->own(object->prim, hit, NULL, &s.ns) : NULL;
        s.ns = shading->bump->ops->bend(shading->bump, s.u, s.v, s.ns);
        if (own) s.ns = affine_normal(own, s.ns);
    }
    point->d = ray->d;
    point->v = vec3_neg(vec3_normalize(ray->d));
    bool flat = are_equal(s.n, s.ns);
    point->object = object;
    point->face = (LeftFace){s.plane ? hit->object : HIT_NONE, hit->part};
    point->face_n = s.n;
    Vec3 p_err = s.p_err;
    point->p = s.p;
    if (!object->in_world) {
        point->p = affine_point(&object->to_world, s.p);
        p_err = world_error(object, &s, point->p);
        s.n = affine_normal(&object->to_object, s.n);
        if (!flat) s.ns = affine_normal(&object->to_object, s.ns);
    }
    point->ng = vec3_normalize(s.n);
    if (vec3_dot(point->ng, point->v) < 0) {
        point->ng = vec3_neg(point->ng);
        point->face_n = vec3_neg(point->face_n);
    }
    point->n = point->ng;
    if (!flat) {
        point->n = vec3_normalize(s.ns);
        if (vec3_dot(point->n, point->ng) < 0) point->n = vec3_neg(point->n);
    }
    point->reach = vec3_max(vec3_abs(point->p));
    point->off = leaving_offset(point->p, p_err, point->ng);
    point->sum = glms_vec3_mul(world->ambient, point->kd);
}

/* 1 / falloff at distance d. */
static float light_scale(const Light *light, double d)
{
    double fall = light->falloff[0] + light->falloff[1] * d + light->falloff[2] * (d * d);
    double scale = 1 / fall;
    if (fabs(scale) > BRIGHTEST) scale = copysign(BRIGHTEST, scale);
    return (float)scale;
}

/* A light, and what is the same of it for all points. */
typedef struct {
    const Light *light;
    double reach;     /* greatest coordinate */
    bool even;        /* the same at all distances: `scale` */
    float scale;
} LightView;

static LightView view_light(const Light *light)
{
    return (LightView){light, vec3_max(vec3_abs(light->position)), light->falloff[1] == 0 && light->falloff[2] == 0,
                       light_scale(light, 0)};
}

/* What the light brings to the point if nothing is in its way, and the ray that finds that out; false if nothing. */
static bool light_point(const LightView *view, const Point *point, Rgb *brings, Ray *shadow, LeftFace *left)
{
    const Light *light = view->light;
    Vec3 to_light = vec3_sub(light->position, point->p);
    double d = vec3_length(to_light), inverse = 1 / d;
    Vec3 l = d > 1e-100 && d < 1e100 ? vec3_scale(to_light, inverse) : vec3_normalize(to_light);
    double n_l = vec3_dot(point->n, l);
    if (!(n_l > 0)) return false;
    Vec3 r = vec3_sub(vec3_scale(point->n, 2 * n_l), l);
    double r_v = vec3_dot(r, point->v);
    Rgb share = point->material->ops->reflect_light(point->material, point->kd, (float)n_l, (float)r_v);
    float scale = view->even ? view->scale : light_scale(light, d);
    *brings = glms_vec3_scale(glms_vec3_mul(share, light->colour), scale);
    if (brings->x == 0 && brings->y == 0 && brings->z == 0) return false;
    bool above = leaves_above(point, l);
    Vec3 o = leaving_origin(point, above);
    double at_light = GAMMA(LIGHT_ROUNDINGS) * (view->reach + point->reach);
    *shadow = (Ray){o, vec3_sub(light->position, o), 0, 1 - at_light * inverse};
    *left = left_face(point, above, shadow->d);
    return true;
}

static void add_light(const World *world, const Light *light, Shader *s, uint32_t points, RenderStats *stats,
                      Scratch *scratch)
{
    LightView view = view_light(light);
    uint32_t n = 0;
    for (uint32_t i = 0; i < points; i++) {
        if (!light_point(&view, &s->point[i], &s->light[n], &s->shadow[n], &s->left[n])) continue;
        s->lit[n++] = i;
    }
    world_occluded(world, s->shadow, s->left, s->blocked, n, scratch);
    stats->shadow_rays += n;
    for (uint32_t i = 0; i < n; i++)
        if (!s->blocked[i]) s->point[s->lit[i]].sum = glms_vec3_add(s->point[s->lit[i]].sum, s->light[i]);
}

static void add_colour(double colour[3], float weight, Rgb c)
{
    colour[0] += (double)(weight * c.x);
    colour[1] += (double)(weight * c.y);
    colour[2] += (double)(weight * c.z);
}

/* The mirror direction D - 2 (D.n) n; one that would go below the surface takes the geometric normal instead. */
static Ray mirror_ray(const Point *point, LeftFace *left)
{
    Vec3 d = vec3_at(point->d, -2 * vec3_dot(point->d, point->n), point->n);
    if (!(vec3_dot(d, point->ng) > 0)) d = vec3_at(point->d, -2 * vec3_dot(point->d, point->ng), point->ng);
    bool above = leaves_above(point, d);
    *left = left_face(point, above, d);
    return (Ray){leaving_origin(point, above), d, 0, INFINITY};
}

/* What is known once a level's rays have their hits: misses end their paths, hits become points. */
static inline __attribute__((always_inline)) uint32_t sort_hits(const World *world, Shader *s, const Ray *rays,
                                                                const Rgb *missed, uint32_t n, uint32_t depth,
                                                                double (*colour)[3], unsigned features)
{
    uint32_t points = 0;
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
        Point *point = &s->point[points++];
        make_point(world, &rays[i], &s->hit[i], point, features);
        point->path = path;
    }
    return points;
}

static inline __attribute__((always_inline)) void shade(const World *world, Shader *s, Ray *rays, const Rgb *missed,
                                                        uint32_t n, uint32_t max_depth, double (*colour)[3],
                                                        RenderStats *stats, Scratch *scratch, unsigned features)
{
    for (uint32_t i = 0; i < n; i++) {
        s->path[i] = (Path){.slot = i, .weight = 1};
        colour[i][0] = colour[i][1] = colour[i][2] = 0;
    }
    stats->camera_rays += n;
    for (uint32_t depth = 0; n > 0; depth++) {
        world_intersect(world, rays, depth > 0 ? s->left : NULL, s->hit, n, scratch);
        uint32_t points = sort_hits(world, s, rays, missed, n, depth, colour, features);
        for (uint32_t i = 0; i < world->light_count; i++) add_light(world, &world->lights[i], s, points, stats, scratch);
        n = 0;
        for (uint32_t i = 0; i < points; i++) {
            const Point *point = &s->point[i];
            if ((features & FEATURE_MIRROR) && point->material->mirror > 0 && depth < max_depth) {
                rays[n] = mirror_ray(point, &s->left[n]);
                s->path[n++] = (Path){point->path.slot, point->path.weight, point->material->mirror, point->sum};
            } else {
                add_colour(colour[point->path.slot], point->path.weight, point->sum);
                if (features & FEATURE_MIRROR) stats->dropped += weight_units(point->path.weight * point->material->mirror);
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
