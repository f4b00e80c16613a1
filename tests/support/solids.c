#include "support/solids.h"

#include <stdio.h>
#include <stdlib.h>

#include "accel/mesh_prim.h"
#include "common/numeric.h"
#include "node/primitive/primitive.h"
#include "support/check.h"
#include "support/mesh_sphere.h"

Prim *solid_shape[SHAPES];
Scratch solid_scratch;
const char *const SOLID_RAY_NAMES[] = {"random", "axis-parallel", "at edges", "far"};

static Mesh *mesh;

/* -- solids to write down -- */

static const double TORUS_MINOR = 0.375;

/* The two ends of a part where lists differ may each be off by their bound, in each list. */
static const double BOUNDS_SLACK = 2;

/* A part so thin for its length runs along a surface. */
static const double ALONG_SURFACE = 0x1p-10;

Expr solid_leaf(int kind, Affine m)
{
    return (Expr){.token = {{.is_leaf = true, .prim = solid_shape[kind], .to_csg = m}}, .count = 1};
}

Expr solid_op(CsgOp o, Expr a, Expr b)
{
    CHECK(a.count + b.count < MAX_TOKENS);
    memcpy(a.token + a.count, b.token, b.count * sizeof *b.token);
    a.count += b.count;
    a.token[a.count++] = (CsgToken){.op = o};
    return a;
}

Expr solid_unite(Expr a, Expr b) { return solid_op(CSG_UNION, a, b); }
Expr solid_minus(Expr a, Expr b) { return solid_op(CSG_DIFF, a, b); }
Expr solid_meet(Expr a, Expr b) { return solid_op(CSG_INTERSECT, a, b); }

Affine solid_then(Affine first, Affine second) { return affine_mul(&second, &first); }

/* All leaves moved by one more matrix. */
Expr solid_moved(Expr e, Affine m)
{
    for (size_t i = 0; i < e.count; i++)
        if (e.token[i].is_leaf) e.token[i].to_csg = solid_then(e.token[i].to_csg, m);
    return e;
}

Expr solid_box(double x0, double y0, double z0, double x1, double y1, double z1)
{
    return solid_leaf(CUBE, solid_then(affine_scale(x1 - x0, y1 - y0, z1 - z0), affine_translate(x0, y0, z0)));
}

Expr solid_rod(double radius, double y0, double y1)
{
    return solid_leaf(CYLINDER, solid_then(affine_scale(radius, (y1 - y0) / 2, radius), affine_translate(0, (y0 + y1) / 2, 0)));
}

Prim *solid_prim(const Expr *e)
{
    size_t bad;
    Err err = {0};
    Prim *prim = csg_create(e->token, e->count, &bad, &err);
    CHECK(prim);
    return prim;
}

/* -- the laws of sets -- */

const char *const SOLID_LAW_NAMES[] = {
    "A - A = 0", "A x A = A", "A + A = A", "A - A' = 0", "A x A' = A", "A + A' = A", "A - (A - B) = A x B",
    "U - (A + B) = (U - A) x (U - B)", "U - (A x B) = (U - A) + (U - B)", "A + B = B + A", "A x B = B x A",
    "(A + B) + C = A + (B + C)", "(A x B) x C = A x (B x C)", "(A - B) - C = A - (B + C)", "(A - B) + (A x B) = A",
    "(U - A) + A' = U", "(U - A) x A' = 0", "A + ((U - A') - B) = U - (B - A)"};

void solid_laws(Law law[SOLID_LAWS], Expr a, Expr a2, Expr b, Expr c)
{
    Expr u = solid_box(-8, -8, -8, 8, 8, 8), none = {.count = 0};
    Expr no_a = solid_minus(u, a), no_b = solid_minus(u, b);
    Law made[SOLID_LAWS] = {
        {solid_minus(a, a), none},
        {solid_meet(a, a), a},
        {solid_unite(a, a), a},
        {solid_minus(a, a2), none},
        {solid_meet(a, a2), a},
        {solid_unite(a, a2), a},
        {solid_minus(a, solid_minus(a, b)), solid_meet(a, b)},
        {solid_minus(u, solid_unite(a, b)), solid_meet(no_a, no_b)},
        {solid_minus(u, solid_meet(a, b)), solid_unite(no_a, no_b)},
        {solid_unite(a, b), solid_unite(b, a)},
        {solid_meet(a, b), solid_meet(b, a)},
        {solid_unite(solid_unite(a, b), c), solid_unite(a, solid_unite(b, c))},
        {solid_meet(solid_meet(a, b), c), solid_meet(a, solid_meet(b, c))},
        {solid_minus(solid_minus(a, b), c), solid_minus(a, solid_unite(b, c))},
        {solid_unite(solid_minus(a, b), solid_meet(a, b)), a},
        {solid_unite(no_a, a2), u},
        {solid_meet(no_a, a2), none},
        {solid_unite(a, solid_minus(solid_minus(u, a2), b)), solid_minus(u, solid_minus(b, a))},
    };
    memcpy(law, made, sizeof made);
}

/* -- random numbers, poses and rays -- */

double solid_uniform(Rng *rng, double lo, double hi) { return lo + (hi - lo) * rng_double(rng); }

Vec3 solid_random_point(Rng *rng, double reach)
{
    double x = solid_uniform(rng, -reach, reach), y = solid_uniform(rng, -reach, reach);
    return vec3_make(x, y, solid_uniform(rng, -reach, reach));
}

Affine solid_random_pose(Rng *rng)
{
    Affine m = affine_scale(solid_uniform(rng, 0.3, 1.5), solid_uniform(rng, 0.3, 1.5), solid_uniform(rng, 0.3, 1.5));
    for (int axis = 0; axis < 3; axis++) m = solid_then(m, affine_rotate(axis, solid_uniform(rng, 0, 360)));
    Vec3 by = solid_random_point(rng, 0.5);
    return solid_then(m, affine_translate(by.x, by.y, by.z));
}

/* The same place by other roundings. */
Affine solid_roundabout(Affine m, Rng *rng)
{
    static const double DEG[] = {17, 33, 51};
    double deg = DEG[rng_u32(rng) % 3];
    int axis = (int)(rng_u32(rng) % 3);
    m = solid_then(solid_then(m, affine_scale(1.0 / 3, 1.0 / 3, 1.0 / 3)), affine_rotate(axis, deg));
    return solid_then(solid_then(m, affine_rotate(axis, -deg)), affine_scale(3, 3, 3));
}

/* A coordinate that faces and axes of the test solids like to have. */
static double nice(Rng *rng) { return ((int)(rng_u32(rng) % 17) - 8) * 0.25; }

/* Aimed at a point of the leaf's edges, silhouette, apex or at a tangent, to within rounding. */
static Vec3 edge_point(Rng *rng, const CsgToken *token)
{
    Vec3 p = solid_random_point(rng, 1);
    double a = solid_uniform(rng, 0, 2 * M_PI), r = 1, y = p.y;
    if (token->prim == solid_shape[CUBE]) {
        p = vec3_make(rng_u32(rng) % 2, rng_u32(rng) % 2, rng_u32(rng) % 4 ? rng_double(rng) : rng_u32(rng) % 2);
        return affine_point(&token->to_csg, p);
    }
    if (token->prim == solid_shape[SPHERE]) return affine_point(&token->to_csg, vec3_normalize(p));
    if (token->prim == solid_shape[CYLINDER] && rng_u32(rng) % 2) y = y < 0 ? -1 : 1;
    if (token->prim == solid_shape[CONE]) {
        y = rng_u32(rng) % 2 ? -1 : -fabs(y);
        r = -y;
    }
    if (token->prim == solid_shape[CLOSED_MESH]) {
        const uint32_t *k = mesh->triangle[rng_u32(rng) % mesh->triangle_count];
        p = mesh->position[k[0]];
        if (rng_u32(rng) % 2) p = vec3_at(p, rng_double(rng), vec3_sub(mesh->position[k[1]], p));
        return affine_point(&token->to_csg, p);
    }
    if (token->prim == solid_shape[TORUS]) {
        double b = solid_uniform(rng, 0, 2 * M_PI);
        r = 1 + TORUS_MINOR * cos(b);
        y = TORUS_MINOR * sin(b);
    }
    return affine_point(&token->to_csg, vec3_make(r * cos(a), y, r * sin(a)));
}

Ray solid_random_ray(Rng *rng, int kind, const Expr *e)
{
    Vec3 target = solid_random_point(rng, 1.5), o = solid_random_point(rng, 6), d = {0, 0, 0};
    switch (kind) {
    case RAY_AXIS: {
        int axis = (int)(rng_u32(rng) % 3);
        double s = rng_u32(rng) % 2 ? 1 : -1;
        d = vec3_make(axis == 0 ? s : 0, axis == 1 ? s : 0, axis == 2 ? s : 0);
        if (rng_u32(rng) % 4 == 0) d = vec3_make(s, axis == 1 ? 0.25 * nice(rng) : 0, axis == 2 ? nice(rng) : 0);
        o = vec3_make(nice(rng), nice(rng), nice(rng));
        if (rng_u32(rng) % 2) o = vec3_add(o, solid_random_point(rng, 0.25));
        return (Ray){o, d, 0, INFINITY};
    }
    case RAY_EDGE: {
        const CsgToken *token;
        do token = &e->token[rng_u32(rng) % e->count];
        while (!token->is_leaf);
        target = edge_point(rng, token);
        if (rng_u32(rng) % 2) o = edge_point(rng, token);  /* from edge to edge, neighbours too: often within a face */
        break;
    }
    case RAY_FAR:
        o = vec3_scale(vec3_normalize(o), exp2(solid_uniform(rng, 4, 24)));
        break;
    default:
        break;
    }
    d = vec3_sub(target, o);
    if (!(vec3_length(d) > 0)) d = vec3_make(1, 0, 0);
    if (rng_u32(rng) % 4 == 0) d = vec3_scale(d, exp2((int)(rng_u32(rng) % 41) - 20));
    return (Ray){o, d, 0, INFINITY};
}

/* -- comparing -- */

SegList solid_segments(const Prim *prim, const Ray *ray)
{
    SegList list = seg_list(&solid_scratch);
    CHECK(prim->ops->segments(prim, ray, &list));
    for (uint32_t i = 0; i < list.count; i++) {
        CHECK(list.seg[i].in.t <= list.seg[i].out.t);
        if (i) CHECK(list.seg[i - 1].out.t <= list.seg[i].in.t);
    }
    return list;
}

const Edge *solid_edge(const SegList *list, uint32_t i)
{
    const Seg *seg = &list->seg[i / 2];
    return i % 2 ? &seg->out : &seg->in;
}

void solid_print_ray(const char *name, const Ray *ray)
{
    printf("%s: o (%a, %a, %a) d (%a, %a, %a)\n", name, ray->o.x, ray->o.y, ray->o.z, ray->d.x, ray->d.y, ray->d.z);
}

void solid_print_list(const char *name, const SegList *list)
{
    printf("  %s:", name);
    for (uint32_t i = 0; i < list->count; i++)
        printf(" [%.17g +- %.2g leaf %u, %.17g +- %.2g leaf %u]", list->seg[i].in.t, list->seg[i].in.t_err,
               list->seg[i].in.leaf, list->seg[i].out.t, list->seg[i].out.t_err, list->seg[i].out.leaf);
    printf("\n");
}

/* -- the oracle: solids as sets of points -- */

QAffine solid_q_inverse(const Affine *a)
{
    QAffine r;
    Quad c[3][3], det = 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            int r0 = (i + 1) % 3, r1 = (i + 2) % 3, c0 = (j + 1) % 3, c1 = (j + 2) % 3;
            c[i][j] = (Quad)a->m[r0][c0] * a->m[r1][c1] - (Quad)a->m[r0][c1] * a->m[r1][c0];
        }
    for (int j = 0; j < 3; j++) det += a->m[0][j] * c[0][j];
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) r.m[i][j] = c[j][i] / det;
        r.m[i][3] = -(r.m[i][0] * a->m[0][3] + r.m[i][1] * a->m[1][3] + r.m[i][2] * a->m[2][3]);
    }
    return r;
}

/* Positive inside; of the order of the distance to the surface near it. */
static Quad depth(const Prim *prim, const Quad p[3])
{
    Quad x = p[0], y = p[1], z = p[2], rr = x * x + z * z, d;
    if (prim == solid_shape[SPHERE]) return 1 - rr - y * y;
    if (prim == solid_shape[CUBE]) {
        d = 1;
        for (int i = 0; i < 3; i++) {
            if (p[i] < d) d = p[i];
            if (1 - p[i] < d) d = 1 - p[i];
        }
        return d;
    }
    if (prim == solid_shape[CYLINDER]) {
        d = 1 - rr;
        if (1 - y < d) d = 1 - y;
        return 1 + y < d ? 1 + y : d;
    }
    if (prim == solid_shape[CONE]) {
        d = y * y - rr;
        if (-y < d) d = -y;
        return 1 + y < d ? 1 + y : d;
    }
    d = rr + y * y + 1 - (Quad)TORUS_MINOR * TORUS_MINOR;
    return 4 * rr - d * d;
}

typedef enum { OUT, IN, UNSURE } Where;

static Where place(const Expr *e, const QAffine *inverse, const Ray *ray, Quad t)
{
    Where stack[MAX_TOKENS];
    int n = 0;
    double way = vec3_max(vec3_abs(ray->o)) + fabs((double)t) * vec3_max(vec3_abs(ray->d));
    double margin = 1e-12 + 256 * UNIT_ROUNDOFF * way;  /* t itself is rounded; the leaves are scaled by 0.3 and more */
    Quad p[3] = {ray->o.x + t * ray->d.x, ray->o.y + t * ray->d.y, ray->o.z + t * ray->d.z};
    for (size_t i = 0; i < e->count; i++) {
        const CsgToken *token = &e->token[i];
        if (token->is_leaf) {
            Quad q[3];
            for (int r = 0; r < 3; r++) {
                const Quad *m = inverse[i].m[r];
                q[r] = m[0] * p[0] + m[1] * p[1] + m[2] * p[2] + m[3];
            }
            Quad f = depth(token->prim, q);
            stack[n++] = f > margin ? IN : f < -margin ? OUT : UNSURE;
            continue;
        }
        Where b = stack[--n], a = stack[--n];
        if (token->op == CSG_DIFF) b = b == IN ? OUT : b == OUT ? IN : UNSURE;
        if (token->op == CSG_UNION)
            stack[n++] = a == IN || b == IN ? IN : a == OUT && b == OUT ? OUT : UNSURE;
        else
            stack[n++] = a == OUT || b == OUT ? OUT : a == IN && b == IN ? IN : UNSURE;
    }
    return stack[0];
}

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Between all crossings of all leaves, and at the middles of all segments and gaps of the result, the result must be
 * inside where the set of points is. */
bool solid_agrees(const Expr *e, const QAffine *inverse, const SegList *list, const Ray *ray)
{
    double cut[512];
    size_t n = 0;
    for (uint32_t i = 0; i < 2 * list->count; i++) cut[n++] = solid_edge(list, i)->t;
    for (size_t i = 0; i < e->count; i++) {
        if (!e->token[i].is_leaf) continue;
        Affine inv;
        CHECK(affine_inverse(&e->token[i].to_csg, &inv));
        Ray r = {affine_point(&inv, ray->o), affine_vector(&inv, ray->d), 0, INFINITY};
        SegList own = solid_segments(e->token[i].prim, &r);
        for (uint32_t k = 0; k < 2 * own.count; k++) cut[n++] = solid_edge(&own, k)->t;
    }
    if (n == 0) return true;
    qsort(cut, n, sizeof *cut, compare_doubles);
    for (size_t i = 0; i <= n; i++) {
        Quad t = i == 0 ? (Quad)cut[0] - 1 : i == n ? (Quad)cut[n - 1] + 1 : ((Quad)cut[i - 1] + cut[i]) / 2;
        Where truth = place(e, inverse, ray, t);
        bool inside = false;
        for (uint32_t k = 0; k < list->count; k++) inside |= t > list->seg[k].in.t && t < list->seg[k].out.t;
        if (truth != UNSURE && inside != (truth == IN)) return false;
    }
    return true;
}

/* -- how thick a difference is -- */

/* By Newton's steps from the double root: clang comes without libquadmath. */
static Quad quad_sqrt(Quad x)
{
    Quad r = sqrt((double)x);
    for (int k = 0; k < 2 && r > 0; k++) r = (r + x / r) / 2;
    return r;
}

static Quad quad_abs(Quad x) { return x < 0 ? -x : x; }

/* Signed distance of a point of leaf space to the surface of one smooth piece, in CSG space, to first order: f / |grad f|
 * where the gradient is carried by the transposed inverse. */
static Quad piece_distance(const QAffine *inverse, Quad f, const Quad grad[3])
{
    Quad square = 0;
    for (int j = 0; j < 3; j++) {
        Quad g = 0;
        for (int i = 0; i < 3; i++) g += inverse->m[i][j] * grad[i];
        square += g * g;
    }
    return f / quad_sqrt(square);
}

static Quad axis_distance(const QAffine *inverse, int axis, Quad f, int sign)
{
    Quad grad[3] = {0, 0, 0};
    grad[axis] = sign;
    return piece_distance(inverse, f, grad);
}

static Quad least(Quad a, Quad b) { return a < b ? a : b; }

/* How deep a point of CSG space lies in a leaf, negative outside: of all pieces the least distance, which near the
 * surface is that along the normal. The mesh is convex, so its planes will do. */
static Quad distance_inside(const Prim *prim, const QAffine *inverse, const Quad at[3])
{
    Quad p[3], d = INFINITY;
    for (int i = 0; i < 3; i++) {
        const Quad *m = inverse->m[i];
        p[i] = m[0] * at[0] + m[1] * at[1] + m[2] * at[2] + m[3];
    }
    Quad rho = quad_sqrt(p[0] * p[0] + p[2] * p[2]);
    Quad radial[3] = {rho > 0 ? p[0] / rho : 1, 0, rho > 0 ? p[2] / rho : 0};
    if (prim == solid_shape[SPHERE]) return piece_distance(inverse, (1 - rho * rho - p[1] * p[1]) / 2, p);
    if (prim == solid_shape[CUBE]) {
        for (int i = 0; i < 3; i++) {
            d = least(d, axis_distance(inverse, i, p[i], 1));
            d = least(d, axis_distance(inverse, i, 1 - p[i], -1));
        }
        return d;
    }
    if (prim == solid_shape[CYLINDER]) {
        d = least(axis_distance(inverse, 1, 1 - p[1], -1), axis_distance(inverse, 1, 1 + p[1], 1));
        return least(d, piece_distance(inverse, 1 - rho, radial));
    }
    if (prim == solid_shape[CONE]) {
        radial[1] = 1;
        return least(axis_distance(inverse, 1, 1 + p[1], 1), piece_distance(inverse, -p[1] - rho, radial));
    }
    if (prim == solid_shape[TORUS]) {
        Quad out = rho - 1, off = quad_sqrt(out * out + p[1] * p[1]);
        Quad grad[3] = {radial[0] * out / off, p[1] / off, radial[2] * out / off};
        return piece_distance(inverse, (Quad)TORUS_MINOR - off, grad);
    }
    for (uint32_t t = 0; t < mesh->triangle_count; t++) {
        const Vec3 *v[3];
        for (int k = 0; k < 3; k++) v[k] = &mesh->position[mesh->triangle[t][k]];
        Quad e[3], f[3], n[3], off = 0;
        for (int i = 0; i < 3; i++) {
            e[i] = (Quad)vec3_get(*v[1], i) - vec3_get(*v[0], i);
            f[i] = (Quad)vec3_get(*v[2], i) - vec3_get(*v[0], i);
        }
        for (int i = 0; i < 3; i++) {
            n[i] = e[(i + 1) % 3] * f[(i + 2) % 3] - e[(i + 2) % 3] * f[(i + 1) % 3];
            off += n[i] * (vec3_get(*v[0], i) - p[i]);
        }
        d = least(d, piece_distance(inverse, off, n));
    }
    return d;
}

Faces solid_faces(const Expr *a, const Expr *b)
{
    Faces faces = {.count = 0};
    for (int k = 0; k < 2; k++) {
        const Expr *e = k ? b : a;
        for (size_t i = 0; i < e->count; i++) {
            if (!e->token[i].is_leaf) continue;
            Box box = affine_box(&e->token[i].to_csg, e->token[i].prim->ops->bounds(e->token[i].prim));
            faces.reach = fmax(faces.reach, box_reach(box));
            faces.prim[faces.count] = e->token[i].prim;
            faces.inverse[faces.count++] = solid_q_inverse(&e->token[i].to_csg);
        }
    }
    return faces;
}

/* How far from all surfaces the line gets between t0 and t1, at some evenly spread places. */
static double part_thickness(const Faces *faces, const Ray *ray, double t0, double t1)
{
    enum { PLACES = 7 };
    Quad thickest = 0;
    for (int k = 0; k < PLACES; k++) {
        Quad t = t0 + ((Quad)t1 - t0) * (2 * k + 1) / (2 * PLACES), nearest = INFINITY;
        Quad p[3] = {ray->o.x + t * ray->d.x, ray->o.y + t * ray->d.y, ray->o.z + t * ray->d.z};
        for (size_t i = 0; i < faces->count; i++)
            nearest = least(nearest, quad_abs(distance_inside(faces->prim[i], &faces->inverse[i], p)));
        if (nearest > thickest) thickest = nearest;
    }
    return (double)thickest;
}

Difference solid_difference(const Faces *faces, const SegList *a, const SegList *b, const Ray *ray)
{
    Difference difference = {0, false};
    uint32_t i = 0, j = 0;
    const Edge *open = NULL;  /* where the lists began to differ */
    double step = vec3_length(ray->d);
    while (i < 2 * a->count || j < 2 * b->count) {
        bool first = j >= 2 * b->count || (i < 2 * a->count && solid_edge(a, i)->t <= solid_edge(b, j)->t);
        const Edge *edge = first ? solid_edge(a, i++) : solid_edge(b, j++);
        if (i % 2 != j % 2) {
            open = edge;
            continue;
        }
        if (!open) continue;
        double way = vec3_max(vec3_abs(ray->o)) + fmax(fabs(open->t), fabs(edge->t)) * vec3_max(vec3_abs(ray->d));
        double unit = UNIT_ROUNDOFF * fmax(way, faces->reach), length = (edge->t - open->t) * step;
        bool claimed = edge->t - open->t <= BOUNDS_SLACK * (edge->t_err + open->t_err);
        /* no part is thicker than long */
        if (!claimed || length > difference.thickness * unit) {
            double thickness = fmin(length, part_thickness(faces, ray, open->t, edge->t));
            difference.thickness = fmax(difference.thickness, thickness / unit);
            if (!claimed && !(thickness <= ALONG_SURFACE * length)) difference.unclaimed = true;
        }
        open = NULL;
    }
    return difference;
}

void solids_create(void)
{
    mesh = mesh_sphere(8, 12, vec3_make(0, 0, 0));
    solid_shape[SPHERE] = sphere_create();
    solid_shape[CUBE] = cube_create();
    solid_shape[CYLINDER] = cylinder_create();
    solid_shape[CONE] = cone_create();
    solid_shape[TORUS] = torus_create(TORUS_MINOR);
    solid_shape[CLOSED_MESH] = mesh_prim_create(mesh, true, NULL, NULL);
    for (int i = 0; i < SHAPES; i++) CHECK(solid_shape[i]);
    solid_scratch = (Scratch){.arena = arena_create()};
    CHECK(solid_scratch.arena);
}

void solids_destroy(void)
{
    for (int i = 0; i < SHAPES; i++) prim_destroy(solid_shape[i]);
    mesh_destroy(mesh);
    arena_destroy(solid_scratch.arena);
}
