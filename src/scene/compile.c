/* From the scene tree to the World:
 *   1. walk    every path from the root to a geometry gives an Object with its matrix; trees draw their symbols here;
 *              what is met for the first time is loaded and checked (Geometry);
 *   2. bake    meshes that are small, used once and look no different for it become one triangle set in world space;
 *   3. scale   everything is divided by the power of two that brings it to about [-1, 1];
 *   4. build   inverses, shadings, BVHs. */
#include "scene/compile.h"

#include <float.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "accel/accel.h"
#include "accel/mesh_prim.h"
#include "common/cpu.h"
#include "common/memory.h"
#include "common/place.h"
#include "node/tree/lsystem.h"
#include "scene/pieces.h"

/* A mesh all of whose places together have up to BAKE_TRIANGLES is baked: beyond that, mapping the rays costs less than
 * copying it and building over the copies. So many are baked in the whole scene, a hundred megabytes. */
enum { BAKE_TRIANGLES = 65536, BAKE_TRIANGLES_ALL = 1 << 20 };

/* A light 2^this times the scene's extent away: to a double's roundings its rays are parallel, its distance is the same
 * everywhere. Farther ones would overflow when squared. */
enum { FAR_LIGHT = 64 };

enum {
    TREE_NESTING = 16,    /* trees whose trunks or leaves hold trees */
    OBJECT_LEAF = 1,      /* objects in a leaf of the BVH */
};

/* The share of the memory limit that objects may take, and what one costs at the peak of the build: itself, its box for
 * the builder, parts of the binary tree and of the wide nodes, which hold at least one object a place. */
#define OBJECT_MEMORY_SHARE 0.75
#define OBJECT_BYTES (sizeof(Object) + sizeof(ObjectView) + sizeof(BvhRef) + 96)

/* Meshes whose greatest coordinate is beyond 2^+-this are divided by a power of two: boxes and the first test of
 * triangles are in floats, whose products would overflow or vanish. */
#define MESH_EXPONENT 32

/* By how many spacings of the numbers at its coordinates an object's surface may seem to be off: the inverse's translation
 * (7 roundings of products that add up to the coordinate), the ray's origin carried by it (4, of twice the coordinate) and
 * the hit carried back (4, of twice): 23 roundings, each half a spacing or less; sqrt(3) for three axes makes 20. */
#define PLACE_SPACINGS 20.0

/* Testing an object in its place against testing eight boxes. */
#define OBJECT_COST 4.0f

/* A geometry node, however often it is used. */
typedef struct {
    Node *node;
    Prim *prim;              /* what its objects use; NULL while it is to be baked or placed */
    bool csg;                /* prim was made here */
    const Mesh *mesh;        /* of a mesh node */
    int exponent;            /* mesh is the node's divided by 2^this */
    const Node **leaf_node;  /* CSG: the node of each leaf, in the leaves' order */
    uint32_t leaf_count;     /* number of its shadings */
    uint32_t shading;        /* index of the first */
    uint64_t uses;
    bool bake;               /* all its places are parts of the baked primitive */
    bool place;              /* its only one has a primitive in world space */
} Geometry;

/* A mesh primitive made so far. */
typedef struct { const Mesh *mesh; Prim *prim; } MadeMesh;  /* mesh: NULL if it is placed */

/* A mesh divided by 2^exponent: all but the positions is borrowed from `from`. */
typedef struct ScaledMesh {
    struct ScaledMesh *next;
    const Mesh *from;
    Mesh mesh;
    int exponent;
    Texture *height_bands;   /* of a mountain */
    Vec3 position[];
} ScaledMesh;

struct WorldMemory {
    Object *objects;
    ObjectView *views;
    Shading *shadings;
    Light *lights;
    Geometry *geometry;
    uint32_t geometry_count;
    MadeMesh *made;
    uint32_t made_count;
    ScaledMesh *scaled;      /* a list */
    Prim *baked;
    uint32_t *part_geometry; /* of each part of it: the index */
    uint32_t part_count;
    Material *plain;         /* for mountains that were given no material */
};

typedef struct { const Node *node; Affine to_world; } Visit;

/* Which indices have been met. */
typedef struct { bool *met; uint64_t capacity; } IndexSet;

typedef struct {
    const RenderJob *job;
    const CompileSettings *settings;
    CompileStats *stats;
    Err *err;
    struct WorldMemory *memory;

    Object *objects;
    uint64_t object_count, object_capacity, object_limit;
    Visit *visits;                   /* the stack of the walk */
    size_t visit_count, visit_capacity;
    uint32_t *geometry_of;           /* node index -> index of its Geometry + 1 */
    uint64_t node_capacity;
    IndexSet nodes, meshes, textures;
    uint32_t geometry_capacity;
    MadeMesh *made;
    uint32_t made_count, made_capacity;
    uint32_t shading_count;
    uint32_t nesting;                /* of trees being drawn */
    bool beyond_floats;              /* an object's own coordinates are: of a CSG solid or a torus */
} Compile;

/* Grows *array to hold at least `least` items. */
static bool grow(void *array, size_t item, uint64_t least, uint64_t *capacity)
{
    if (least <= *capacity) return true;
    uint64_t n = *capacity + *capacity / 2 + 64;
    if (n < least) n = least;
    void *p;
    memcpy(&p, array, sizeof p);
    p = n <= SIZE_MAX / item ? realloc(p, (size_t)n * item) : NULL;
    if (!p) return false;
    memcpy(array, &p, sizeof p);
    *capacity = n;
    return true;
}

/* Adds an index to the set; *first tells whether it is new. False without memory. */
static bool index_set_add(IndexSet *set, uint32_t index, bool *first)
{
    uint64_t before = set->capacity;
    if (!grow(&set->met, sizeof *set->met, index + (uint64_t)1, &set->capacity)) return false;
    memset(set->met + before, 0, (size_t)(set->capacity - before) * sizeof *set->met);
    *first = !set->met[index];
    set->met[index] = true;
    return true;
}

static bool out_of_memory(Compile *c) { return err_memory(c->err, "the scene"); }

/* What a node is, for messages. */
static const char *noun(const Node *node)
{
    switch (node->kind) {
    case NODE_GROUP: return "node";
    case NODE_PRIM: return node->prim->ops->name;
    case NODE_MESH: return node->mesh->kind == MESH_MOUNTAIN ? "mountain" : "mesh";
    case NODE_CSG: return "CSG solid";
    case NODE_TREE: return "tree";
    }
    return "node";
}

/* An error that a node is to blame for: its line goes in front. */
static bool blame(Compile *c, const Node *node, ErrKind kind, const char *what)
{
    err_set(c->err, kind, "%s '%s' %s", noun(node), node->name, what);
    return err_prefix(c->err, node->where);
}

/* What has no line yet gets the script's; what is wrong in an OBJ or a grammar has the file's own. */
static bool blame_file(Compile *c, const Node *node)
{
    return place_length(c->err->text) == 0 ? err_prefix(c->err, node->where) : false;
}

typedef struct { double wall_s, cpu_s; } Stopwatch;

static Stopwatch stopwatch(void) { return (Stopwatch){cpu_wall_s(), cpu_time_s()}; }

static void stop(Stopwatch w, double *wall_s, double *cpu_s)
{
    *wall_s += cpu_wall_s() - w.wall_s;
    *cpu_s += cpu_time_s() - w.cpu_s;
}

/* What a tree's drawing loads is in the tree's own time. */
static void stop_load(Compile *c, Stopwatch w)
{
    if (c->nesting == 0) stop(w, &c->stats->load_wall_s, &c->stats->load_cpu_s);
}

/* ---- geometry ---- */

/* Whether rounding moves the surface by more than a pixel of a picture that the object fills: then it may show. */
static bool is_coarse(const RenderJob *job, double extent, double spacing)
{
    uint32_t pixels = job->width > job->height ? job->width : job->height;
    return PLACE_SPACINGS * spacing * pixels > extent;
}

/* Tells, once in a script, of an object that is so small for its distance from the origin that it is drawn coarsely.
 * The eye's distance is no matter: rays and objects meet where the objects are. */
static void note_coarse(Compile *c, const Node *node, Box b)
{
    double reach = box_reach(b), extent = vec3_max(vec3_sub(b.hi, b.lo));
    if (!(extent > 0)) return;
    double spacing = ldexp(1, ilogb(reach) - (DBL_MANT_DIG - 1));
    if (!is_coarse(c->job, extent, spacing) || !c->settings->warn || !scene_first_coarse(c->job->scene)) return;
    char text[512];
    snprintf(text, sizeof text,
             "%s%s '%s' is %.3g across, but numbers as great as its coordinates, %.3g, are %.2g apart: "
             "it is drawn that coarsely",
             node->where, noun(node), node->name, extent, reach, spacing);
    c->settings->warn(c->settings->warn_context, text);
}

/* Counts a mesh that this compile meets for the first time, and tells of what was left out of it. */
static bool note_mesh(Compile *c, const Node *node)
{
    const Mesh *mesh = node->mesh->loaded;
    bool first;
    if (!index_set_add(&c->meshes, node->mesh->index, &first)) return out_of_memory(c);
    if (!first) return true;
    note_coarse(c, node, mesh_bounds(mesh));
    c->stats->triangles += mesh->triangle_count;
    c->stats->dropped_triangles += mesh->dropped;
    if (node->mesh->kind == MESH_FILE) c->stats->meshes_loaded++;
    if (mesh->dropped && !node->mesh->told_dropped && c->settings->warn) {
        char text[512];
        node->mesh->told_dropped = true;
        snprintf(text, sizeof text, "%smesh '%s': %" PRIu32 " degenerate triangle%s left out", node->where, node->name,
                 mesh->dropped, mesh->dropped == 1 ? "" : "s");
        c->settings->warn(c->settings->warn_context, text);
    }
    return true;
}

static bool load_mesh(Compile *c, const Node *node)
{
    if (!node->mesh->loaded) {
        Stopwatch w = stopwatch();
        bool ok = mesh_source_load(node->mesh, c->err);
        stop_load(c, w);
        if (!ok) return blame_file(c, node);
    }
    return note_mesh(c, node);
}

static bool load_texture(Compile *c, const Node *node)
{
    if (!node->texture) return true;
    if (!node->texture->loaded) {
        Stopwatch w = stopwatch();
        bool ok = texture_source_load(node->texture, c->settings->srgb, c->err);
        stop_load(c, w);
        if (!ok) return blame_file(c, node);
    }
    bool first;
    if (!index_set_add(&c->textures, node->texture->index, &first)) return out_of_memory(c);
    c->stats->textures_loaded += first;
    return true;
}

static bool is_mountain(const Node *node) { return node->kind == NODE_MESH && node->mesh->kind == MESH_MOUNTAIN; }

static const ScaledMesh *scaled_mesh(const Compile *c, const Mesh *from)
{
    const ScaledMesh *s = c->memory->scaled;
    while (s && s->from != from) s = s->next;
    return s;
}

/* How a node's own surface looks. */
static Shading shading_of(const Compile *c, const Node *node)
{
    Shading s = {node->material, node->texture ? node->texture->loaded : NULL, node->bump};
    if (is_mountain(node)) {
        if (!s.material) s.material = c->memory->plain;
        const ScaledMesh *scaled = scaled_mesh(c, node->mesh->loaded);
        if (!s.texture) s.texture = scaled ? scaled->height_bands : node->mesh->height_bands;
    }
    return s;
}

static bool check_look(Compile *c, const Node *node)
{
    if (!node->material && !is_mountain(node)) return blame(c, node, ERR_SCENE, "has no material");
    return load_texture(c, node);
}

static Vec3 vec3_ldexp(Vec3 a, int e) { return vec3_make(ldexp(a.x, e), ldexp(a.y, e), ldexp(a.z, e)); }

/* The mesh divided by 2^exponent, and a mountain's colours, which go by its heights, with it. NULL without memory. */
static const ScaledMesh *scale_mesh(Compile *c, const Node *node, Box bounds, int exponent)
{
    const Mesh *from = node->mesh->loaded;
    ScaledMesh *s = malloc(sizeof *s + from->position_count * sizeof *s->position);
    Texture *bands = is_mountain(node) ? height_texture_create(ldexp(bounds.hi.y, -exponent)) : NULL;
    if (!s || (is_mountain(node) && !bands)) {
        texture_destroy(bands);
        free(s);
        out_of_memory(c);
        return NULL;
    }
    *s = (ScaledMesh){c->memory->scaled, from, *from, exponent, bands};
    for (uint32_t i = 0; i < from->position_count; i++) s->position[i] = vec3_ldexp(from->position[i], -exponent);
    s->mesh.position = s->position;
    c->memory->scaled = s;
    return s;
}

/* The node's mesh in floats' range, and the power of two that its objects' matrices must be multiplied by. NULL without
 * memory. */
static const Mesh *mesh_in_range(Compile *c, const Node *node, int *exponent)
{
    const Mesh *from = node->mesh->loaded;
    *exponent = 0;
    Box b = mesh_bounds(from);
    if (box_is_empty(b)) return from;
    double reach = box_reach(b);
    if (!(reach > 0) || !isfinite(reach) || abs(ilogb(reach)) <= MESH_EXPONENT) return from;
    const ScaledMesh *s = scaled_mesh(c, from);
    if (!s) s = scale_mesh(c, node, b, ilogb(reach));
    if (!s) return NULL;
    *exponent = s->exponent;
    return &s->mesh;
}

static Affine times_power(Affine a, int exponent)
{
    if (exponent == 0) return a;
    double s = ldexp(1, exponent);
    Affine scale = affine_scale(s, s, s);
    return affine_mul(&a, &scale);
}

static MeshSettings mesh_settings(const Compile *c)
{
    return (MeshSettings){.threads = c->settings->threads, .split = c->settings->split};
}

static Prim *made_mesh(const Compile *c, const Mesh *mesh, bool closed)
{
    for (uint32_t i = 0; i < c->made_count; i++)
        if (c->made[i].mesh == mesh && (c->made[i].prim->ops->closed || !closed)) return c->made[i].prim;
    return NULL;
}

/* Makes room for one more. */
static bool grow_made(Compile *c)
{
    uint64_t capacity = c->made_capacity;
    if (!grow(&c->made, sizeof *c->made, c->made_count + (uint64_t)1, &capacity)) return out_of_memory(c);
    c->made_capacity = (uint32_t)capacity;
    return true;
}

/* The primitive of a mesh, made once; again only if it was made without knowing that the mesh is closed. */
static Prim *mesh_prim(Compile *c, const Mesh *mesh, bool closed)
{
    Prim *made = made_mesh(c, mesh, closed);
    if (made) return made;
    if (!grow_made(c)) return NULL;
    Stopwatch w = stopwatch();
    MeshSettings settings = mesh_settings(c);
    Prim *prim = mesh_prim_create(mesh, closed, &settings, c->err);
    stop(w, &c->stats->bvh_wall_s, &c->stats->bvh_cpu_s);
    if (prim) c->made[c->made_count++] = (MadeMesh){mesh, prim};
    return prim;
}

/* One step of the walk over a CSG tree: an operand with the matrix that leads to the CSG node's space, or, on the way
 * back, the operator to append. */
typedef struct { const Node *node; Affine to_csg; bool operands_done; } CsgVisit;

typedef struct {
    CsgToken *token;
    const Node **leaf_node;
    CsgVisit *stack;
    uint64_t token_count, token_capacity, leaf_count, leaf_capacity, stack_count, stack_capacity;
} CsgWalk;

static bool push_operand(CsgWalk *w, const Node *operand, const Affine *to_csg)
{
    if (!grow(&w->stack, sizeof *w->stack, w->stack_count + 1, &w->stack_capacity)) return false;
    w->stack[w->stack_count++] = (CsgVisit){operand, affine_mul(to_csg, &operand->transform), false};
    return true;
}

static bool csg_leaf(Compile *c, CsgWalk *w, const CsgVisit *v)
{
    const Node *node = v->node;
    const Prim *prim = node->prim;
    int exponent = 0;
    if (node->kind == NODE_MESH) {
        if (is_mountain(node)) return blame(c, node, ERR_SCENE, "is open and can't be a CSG operand");
        if (!load_mesh(c, node)) return false;
        const Mesh *mesh = mesh_in_range(c, node, &exponent);
        if (!mesh) return false;
        Err open;
        if (!made_mesh(c, mesh, true) && !mesh_is_closed(node->mesh->loaded, &open)) {
            if (open.kind != ERR_SCENE) {
                *c->err = open;
                return false;
            }
            char what[700];
            snprintf(what, sizeof what, "can't be a CSG operand: %.600s", open.text);
            return blame(c, node, ERR_SCENE, what);
        }
        prim = mesh_prim(c, mesh, true);
        if (!prim) return false;
    } else if (node->kind != NODE_PRIM || !prim->ops->closed) {
        return blame(c, node, ERR_SCENE, "can't be a CSG operand: it is no closed solid");
    }
    if (!grow(&w->token, sizeof *w->token, w->token_count + 1, &w->token_capacity)) return out_of_memory(c);
    if (!grow(&w->leaf_node, sizeof *w->leaf_node, w->leaf_count + 1, &w->leaf_capacity)) return out_of_memory(c);
    Affine to_csg = affine_mul(&v->to_csg, &node->base);
    w->token[w->token_count++] = (CsgToken){true, CSG_UNION, prim, times_power(to_csg, exponent)};
    w->leaf_node[w->leaf_count++] = node;
    return true;
}

static bool csg_tokens(Compile *c, const Node *csg, CsgWalk *w)
{
    CsgVisit root = {csg, affine_identity(), false};
    if (!grow(&w->stack, sizeof *w->stack, 1, &w->stack_capacity)) return out_of_memory(c);
    w->stack[w->stack_count++] = root;
    while (w->stack_count > 0) {
        CsgVisit *top = &w->stack[w->stack_count - 1], v = *top;
        if (v.node != csg && v.node->child_count > 0)
            return blame(c, v.node, ERR_SCENE, "is a CSG operand and can't have children");
        if (v.node->kind != NODE_CSG) {
            w->stack_count--;
            if (!csg_leaf(c, w, &v)) return false;
        } else if (v.operands_done) {
            w->stack_count--;
            if (!grow(&w->token, sizeof *w->token, w->token_count + 1, &w->token_capacity)) return out_of_memory(c);
            w->token[w->token_count++] = (CsgToken){.is_leaf = false, .op = v.node->csg.op};
        } else {
            top->operands_done = true;  /* the left one ends on top, so that it comes first */
            if (!push_operand(w, v.node->csg.b, &v.to_csg) || !push_operand(w, v.node->csg.a, &v.to_csg))
                return out_of_memory(c);
        }
    }
    return true;
}

/* Puts a line before the error: that of the operand with the token `bad`, or of the whole if there is none. */
static void blame_operand(Compile *c, const Node *csg, const CsgWalk *w, size_t bad)
{
    if (bad >= w->token_count) {
        err_prefix(c->err, csg->where);
        return;
    }
    uint64_t leaf = 0;
    for (size_t i = 0; i < bad; i++) leaf += w->token[i].is_leaf;
    blame(c, w->leaf_node[leaf], ERR_SCENE, "has, as an operand, a singular matrix, or one too extreme to be inverted");
}

static bool make_csg(Compile *c, Geometry *g)
{
    CsgWalk w = {0};
    bool ok = csg_tokens(c, g->node, &w);
    if (ok) {
        size_t bad = SIZE_MAX;
        g->prim = csg_create(w.token, w.token_count, &bad, c->err);
        g->csg = true;
        ok = g->prim != NULL;
        if (!ok) blame_operand(c, g->node, &w, bad);
    }
    if (ok) {
        g->leaf_node = w.leaf_node;
        g->leaf_count = (uint32_t)w.leaf_count;
        w.leaf_node = NULL;
        for (uint32_t i = 0; ok && i < g->leaf_count; i++)
            ok = check_look(c, g->leaf_node[csg_shown_leaf(g->prim, i)]);
    }
    free(w.token);
    free(w.leaf_node);
    free(w.stack);
    return ok;
}

/* The Geometry of a node, made when it is met first. */
static Geometry *geometry(Compile *c, const Node *node)
{
    uint32_t *slot = &c->geometry_of[node->index];
    if (*slot) return &c->memory->geometry[*slot - 1];
    uint64_t capacity = c->geometry_capacity;
    if (!grow(&c->memory->geometry, sizeof *c->memory->geometry, c->memory->geometry_count + (uint64_t)1, &capacity)) {
        out_of_memory(c);
        return NULL;
    }
    c->geometry_capacity = (uint32_t)capacity;
    Geometry *g = &c->memory->geometry[c->memory->geometry_count++];
    *g = (Geometry){.node = (Node *)node, .leaf_count = 1};
    bool ok = true;
    switch (node->kind) {
    case NODE_PRIM:
        g->prim = (Prim *)node->prim;
        ok = check_look(c, node);
        break;
    case NODE_MESH:
        ok = check_look(c, node) && load_mesh(c, node);
        if (ok) g->mesh = mesh_in_range(c, node, &g->exponent);
        ok = ok && g->mesh;
        break;
    case NODE_CSG:
        ok = make_csg(c, g);
        break;
    case NODE_GROUP:
    case NODE_TREE:
        break;
    }
    if (!ok) return NULL;
    *slot = c->memory->geometry_count;
    return g;
}

/* ---- the walk ---- */

static bool note_node(Compile *c, const Node *node)
{
    uint64_t before = c->node_capacity;
    if (!grow(&c->geometry_of, sizeof *c->geometry_of, node->index + (uint64_t)1, &c->node_capacity))
        return out_of_memory(c);
    memset(c->geometry_of + before, 0, (size_t)(c->node_capacity - before) * sizeof *c->geometry_of);
    bool first;
    if (!index_set_add(&c->nodes, node->index, &first)) return out_of_memory(c);
    c->stats->nodes += first;
    return true;
}

static bool too_many(Compile *c, const Node *node)
{
    err_set(c->err, ERR_LIMIT, "the scene has more than %llu objects, the limit by this machine's memory",
            (unsigned long long)c->object_limit);
    return err_prefix(c->err, node->where);
}

static bool add_object(Compile *c, const Node *node, const Affine *to_world)
{
    if (c->object_count >= c->object_limit) return too_many(c, node);
    Geometry *g = geometry(c, node);
    if (!g) return false;
    if (!grow(&c->objects, sizeof *c->objects, c->object_count + 1, &c->object_capacity)) return out_of_memory(c);
    Affine place = times_power(affine_mul(to_world, &node->base), g->exponent);
    if (!affine_is_finite(&place)) return blame(c, node, ERR_SCENE, "reaches beyond the range of numbers");
    g->uses++;
    /* The shading's place holds the geometry's index until the shadings are made. */
    Object *o = &c->objects[c->object_count++];
    o->to_world = place;
    o->prim = g->prim;
    o->shading = (uint32_t)(g - c->memory->geometry);
    o->in_world = false;
    return true;
}

static bool push(Compile *c, const Node *node, const Affine *to_parent)
{
    uint64_t capacity = c->visit_capacity;
    if (!grow(&c->visits, sizeof *c->visits, c->visit_count + 1, &capacity)) return out_of_memory(c);
    c->visit_capacity = (size_t)capacity;
    c->visits[c->visit_count++] = (Visit){node, affine_mul(to_parent, &node->transform)};
    return true;
}

static bool walk(Compile *c, size_t bottom);

typedef struct { Compile *c; const Node *tree; Affine to_world; } TreeWalk;

static bool draw_symbol(void *context, SymbolMeaning meaning, const Affine *place)
{
    TreeWalk *t = context;
    const Node *node = meaning == SYMBOL_TRUNK ? t->tree->tree.trunk : t->tree->tree.leaf;
    Affine to_world = affine_mul(&t->to_world, place);
    size_t bottom = t->c->visit_count;
    return push(t->c, node, &to_world) && walk(t->c, bottom);
}

/* Symbols of a tree's string for each that may be drawn: the rest are brackets and symbols that only grow. */
enum { SYMBOLS_PER_OBJECT = 16 };

typedef struct { uint64_t count, limit; } SymbolCount;

static bool count_symbol(void *context, SymbolMeaning meaning, const Affine *place)
{
    (void)meaning, (void)place;
    SymbolCount *n = context;
    return ++n->count <= n->limit;
}

/* A tree that is far too large for certain ends at once. For others counting takes a tenth of the time that drawing takes,
 * and no memory. */
static bool count_tree(Compile *c, const Node *node)
{
    SymbolCount n = {0, c->object_limit - c->object_count};
    *c->err = (Err){0};
    LsystemCount fewest;
    if (!lsystem_fewest(node->tree.grammar->loaded, node->tree.depth, &fewest, c->err)) return blame_file(c, node);
    if (fewest.drawn > n.limit) return too_many(c, node);
    if (lsystem_walk(node->tree.grammar->loaded, node->tree.depth, node->tree.seed,
                     SYMBOLS_PER_OBJECT * c->object_limit, count_symbol, &n, c->err))
        return true;
    return c->err->kind ? blame_file(c, node) : too_many(c, node);
}

static bool draw_tree(Compile *c, const Node *node, const Affine *to_world)
{
    if (c->nesting >= TREE_NESTING) {
        err_set(c->err, ERR_LIMIT, "trees are nested more than %d deep", TREE_NESTING);
        return err_prefix(c->err, node->where);
    }
    Stopwatch w = stopwatch();
    if (!grammar_source_load(node->tree.grammar, c->err)) return blame_file(c, node);
    if (!count_tree(c, node)) return false;
    TreeWalk t = {c, node, *to_world};
    c->nesting++;
    bool ok = lsystem_walk(node->tree.grammar->loaded, node->tree.depth, node->tree.seed,
                           SYMBOLS_PER_OBJECT * c->object_limit, draw_symbol, &t, c->err);
    c->nesting--;
    stop_load(c, w);
    return ok || blame_file(c, node);
}

/* Visits what was pushed above `bottom`, depth first, in the order of the children. */
static bool walk(Compile *c, size_t bottom)
{
    while (c->visit_count > bottom) {
        Visit v = c->visits[--c->visit_count];
        if (!note_node(c, v.node)) return false;
        switch (v.node->kind) {
        case NODE_GROUP:
            break;
        case NODE_PRIM:
        case NODE_MESH:
        case NODE_CSG:
            if (!add_object(c, v.node, &v.to_world)) return false;
            break;
        case NODE_TREE:
            if (!draw_tree(c, v.node, &v.to_world)) return false;
            break;
        }
        for (uint32_t i = v.node->child_count; i-- > 0;)
            if (!push(c, v.node->children[i], &v.to_world)) return false;
    }
    return true;
}

/* ---- baking ---- */

/* Whether any other geometry uses the mesh, or a CSG tree. */
static bool is_shared(const Compile *c, const Geometry *g)
{
    for (uint32_t i = 0; i < c->memory->geometry_count; i++)
        if (&c->memory->geometry[i] != g && c->memory->geometry[i].mesh == g->mesh) return true;
    return made_mesh(c, g->mesh, false) != NULL;
}

/* Meshes that aren't to be baked or placed get their primitives: mountains, too, as corners of theirs that lie on other
 * faces' edges would be rounded off them. */
static bool make_mesh_prims(Compile *c)
{
    uint64_t left = BAKE_TRIANGLES_ALL;
    for (uint32_t i = 0; i < c->memory->geometry_count; i++) {
        Geometry *g = &c->memory->geometry[i];
        if (!g->mesh) continue;
        uint64_t most = left < BAKE_TRIANGLES ? left : BAKE_TRIANGLES, size = g->mesh->triangle_count;
        bool may = !is_mountain(g->node);
        g->bake = may && size * g->uses <= most;
        g->place = may && !g->bake && size > BAKE_TRIANGLES && g->uses == 1 && !is_shared(c, g);
        if (g->bake) left -= size * g->uses;
        if (g->bake || g->place) continue;
        g->prim = mesh_prim(c, g->mesh, false);
        if (!g->prim) return false;
    }
    return true;
}

/* The mesh of an object, and how it is brought to the world. */
static bool baked_mesh(Compile *c, const Object *o, BakedMesh *baked)
{
    const Geometry *g = &c->memory->geometry[o->shading];
    *baked = (BakedMesh){.mesh = g->mesh, .to_world = o->to_world};
    return affine_inverse(&o->to_world, &baked->to_object) ||
           blame(c, g->node, ERR_SCENE, "has a singular matrix, or one too extreme to be inverted");
}

static Prim *make_baked(Compile *c, const BakedMesh *baked, uint32_t count)
{
    Stopwatch w = stopwatch();
    MeshSettings settings = mesh_settings(c);
    Prim *prim = mesh_prim_bake(baked, count, &settings, c->err);
    stop(w, &c->stats->bvh_wall_s, &c->stats->bvh_cpu_s);
    return prim;
}

static bool place_mesh(Compile *c, Object *o)
{
    BakedMesh baked;
    if (!baked_mesh(c, o, &baked) || !grow_made(c)) return false;
    o->prim = make_baked(c, &baked, 1);
    o->to_world = affine_identity();
    if (o->prim) c->made[c->made_count++] = (MadeMesh){NULL, (Prim *)o->prim};
    return o->prim != NULL;
}

/* Takes the objects that are to be baked out of the list and puts one with all their triangles at its end. Their shadings
 * are the first ones, in the same order. */
static bool bake_parts(Compile *c, BakedMesh *baked)
{
    struct WorldMemory *m = c->memory;
    uint64_t kept = 0;
    uint32_t n = 0;
    for (uint64_t i = 0; i < c->object_count; i++) {
        Object *o = &c->objects[i];
        const Geometry *g = &m->geometry[o->shading];
        if (!g->bake) {
            if (g->place && !place_mesh(c, o)) return false;
            c->objects[kept++] = *o;
            continue;
        }
        m->part_geometry[n] = o->shading;
        if (!baked_mesh(c, o, &baked[n++])) return false;
    }
    c->object_count = kept;
    if (n == 0) return true;
    m->baked = make_baked(c, baked, n);
    c->objects[c->object_count++] = (Object){.to_world = affine_identity(), .prim = m->baked, .shading = 0};
    return m->baked != NULL;
}

static bool bake(Compile *c)
{
    struct WorldMemory *m = c->memory;
    for (uint32_t i = 0; i < m->geometry_count; i++)
        if (m->geometry[i].bake) m->part_count += (uint32_t)m->geometry[i].uses;
    BakedMesh *baked = memory_array(m->part_count + (size_t)1, sizeof *baked);
    m->part_geometry = memory_array(m->part_count + (size_t)1, sizeof *m->part_geometry);
    bool ok = baked && m->part_geometry ? bake_parts(c, baked) : out_of_memory(c);
    free(baked);
    return ok;
}

/* ---- shadings ---- */

/* Objects get the index of their first shading for that of their geometry; the baked one, last, has it already. */
static bool make_shadings(Compile *c, World *world)
{
    struct WorldMemory *m = c->memory;
    c->shading_count = m->part_count;
    for (uint32_t i = 0; i < m->geometry_count; i++) {
        m->geometry[i].shading = c->shading_count;
        c->shading_count += m->geometry[i].leaf_count;
    }
    m->shadings = malloc((c->shading_count + (size_t)1) * sizeof *m->shadings);
    if (!m->shadings) return out_of_memory(c);
    for (uint32_t i = 0; i < m->geometry_count; i++) {
        const Geometry *g = &m->geometry[i];
        for (uint32_t j = 0; j < g->leaf_count; j++) {
            Shading *s = &m->shadings[g->shading + j];
            if (!g->leaf_node) {
                *s = shading_of(c, g->node);
            } else {
                uint32_t shown = csg_shown_leaf(g->prim, j);
                *s = shading_of(c, g->leaf_node[shown]);
                if (shown != j) {  /* carved: the texture's and the bumps' coordinates are another shape's */
                    s->texture = NULL;
                    s->bump = NULL;
                }
            }
            if (s->texture) world->features |= FEATURE_TEXTURE;
            if (s->bump) world->features |= FEATURE_BUMP;
            if (s->material->mirror > 0) world->features |= FEATURE_MIRROR;
        }
    }
    for (uint32_t i = 0; i < m->part_count; i++)
        m->shadings[i] = m->shadings[m->geometry[m->part_geometry[i]].shading];
    for (uint64_t i = 0; i < c->object_count; i++)
        if (c->objects[i].prim != m->baked)
            c->objects[i].shading = m->geometry[c->objects[i].shading].shading;
    world->shadings = m->shadings;
    return true;
}

/* ---- scale, inverses, boxes ---- */

static bool finite_box(Box b) { return isfinite(box_reach(b)); }

/* Whom to blame for an object that has not got its shading yet. */
static const Node *node_of(const Compile *c, const Object *o)
{
    return o->prim && o->prim == c->memory->baked ? c->job->root : c->memory->geometry[o->shading].node;
}

/* Divides everything by the power of two that brings the greatest coordinate, the eye's included, below 1. */
static bool scale_objects(Compile *c, World *world)
{
    double reach = vec3_max(vec3_abs(c->job->eye));
    for (uint64_t i = 0; i < c->object_count; i++) {
        Object *o = &c->objects[i];
        const Geometry *g = &c->memory->geometry[o->shading];
        o->prim = g->prim;
        Box b = !g->prim ? affine_box(&o->to_world, mesh_bounds(g->mesh)) : prim_bounds_in(g->prim, &o->to_world);
        if (box_is_empty(b)) continue;
        if (!finite_box(b)) return blame(c, g->node, ERR_SCENE, "reaches beyond the range of numbers");
        note_coarse(c, g->node, b);
        reach = fmax(reach, box_reach(b));
    }
    world->exponent = reach > 0 ? ilogb(reach) + 1 : 0;
    for (uint64_t i = 0; i < c->object_count; i++)
        c->objects[i].to_world = affine_ldexp(&c->objects[i].to_world, -world->exponent);
    return true;
}

/* Inverses and boxes; objects without any extent are left out. */
static bool place_objects(Compile *c, BvhRef *ref)
{
    Affine identity = affine_identity();
    uint64_t kept = 0;
    for (uint64_t i = 0; i < c->object_count; i++) {
        Object o = c->objects[i];
        Box b = prim_bounds_in(o.prim, &o.to_world);
        if (box_is_empty(b)) continue;
        if (!affine_inverse(&o.to_world, &o.to_object))
            return blame(c, node_of(c, &o), ERR_SCENE, "has a singular matrix, or one too extreme to be inverted");
        double own = box_reach(o.prim->ops->bounds(o.prim));
        c->beyond_floats = c->beyond_floats || (own > 0 && abs(ilogb(own)) > MESH_EXPONENT);
        o.in_world = memcmp(&o.to_world, &identity, sizeof identity) == 0;
        c->objects[kept] = o;
        ref[kept] = bvh_ref(boxf_from_box(b), (uint32_t)kept);
        kept++;
    }
    c->object_count = kept;
    return true;
}

static ObjectView view_object(const Object *o)
{
    Box b = o->prim->ops->bounds(o->prim);
    BoxF box = boxf_from_box(b);
    ObjectView v = {.reach = boxf_up(box_reach(b))};
    for (int a = 0; a < 3; a++) {
        const double *m = o->to_object.m[a];
        double size = fabs(m[0]) + fabs(m[1]) + fabs(m[2]);
        for (int j = 0; j < 4; j++) v.m[a][j] = (float)m[j];
        v.lo[a] = box.lo[a];
        v.hi[a] = box.hi[a];
        v.size = fmaxf(v.size, boxf_up(size * (1 + GAMMA(2))));
        v.offset = fmaxf(v.offset, boxf_up(fabs(m[3])));
        v.least_d[a] = fmaxf(VIEW_PARALLEL * (float)size, 0x1p-100f);
    }
    return v;
}

static bool view_objects(Compile *c)
{
    c->memory->views = memory_array((size_t)c->object_count + 1, sizeof *c->memory->views);
    if (!c->memory->views) return out_of_memory(c);
    for (uint64_t i = 0; i < c->object_count; i++) c->memory->views[i] = view_object(&c->objects[i]);
    return true;
}

/* ab - cd to 1.5 units in the last place, however much of it cancels (Kahan; Jeannerod, Louvet, Muller 2013). */
static double products_difference(double a, double b, double c, double d)
{
    double cd = c * d;
    return fma(a, b, -cd) + fma(-c, d, cd);
}

/* The cross product of vectors of any length times a power of two, to a few roundings however near to parallel they are. */
static Vec3 cross_of_any(Vec3 a, Vec3 b)
{
    a = vec3_scale(a, vec3_pow2_scale(a));
    b = vec3_scale(b, vec3_pow2_scale(b));
    return vec3_make(products_difference(a.y, b.z, a.z, b.y), products_difference(a.z, b.x, a.x, b.z),
                     products_difference(a.x, b.y, a.y, b.x));
}

static void place_camera(const Compile *c, World *world)
{
    const RenderJob *job = c->job;
    Vec3 forward = vec3_normalize(job->view);
    Vec3 right = vec3_normalize(cross_of_any(job->view, job->up));
    Vec3 up = vec3_cross(right, forward);
    double half = tan(job->fov_deg * (M_PI / 360));
    double aspect = (double)job->width / (double)job->height;
    world->camera.eye = vec3_ldexp(job->eye, -world->exponent);
    world->camera.forward = forward;
    world->camera.right = vec3_scale(right, half * aspect);
    world->camera.up = vec3_scale(up, half);
}

/* A light in world units. One beyond FAR_LIGHT is put there, with the falloff that it has at the scene. */
static Light place_light(Light l, int exponent)
{
    double reach = vec3_max(vec3_abs(l.position));
    if (reach == 0 || ilogb(reach) - exponent < FAR_LIGHT) {
        l.position = vec3_ldexp(l.position, -exponent);
        l.falloff[1] = ldexp(l.falloff[1], exponent);
        l.falloff[2] = ldexp(l.falloff[2], 2 * exponent);
        return l;
    }
    Vec3 toward = vec3_normalize(l.position);
    double d = vec3_dot(l.position, toward);
    if (l.falloff[1] != 0) l.falloff[0] += l.falloff[1] * d;
    if (l.falloff[2] != 0) l.falloff[0] += l.falloff[2] * d * d;
    l.falloff[1] = l.falloff[2] = 0;
    l.position = vec3_scale(toward, ldexp(1, FAR_LIGHT));
    return l;
}

static bool place_lights(Compile *c, World *world)
{
    uint32_t n = c->job->light_count;
    c->memory->lights = malloc((n + (size_t)1) * sizeof *c->memory->lights);
    if (!c->memory->lights) return out_of_memory(c);
    for (uint32_t i = 0; i < n; i++) c->memory->lights[i] = place_light(c->job->lights[i], world->exponent);
    world->lights = c->memory->lights;
    world->light_count = n;
    world->ambient = c->job->ambient;
    return true;
}

static bool build_bvh(Compile *c, World *world)
{
    BvhRef *ref = memory_array((size_t)c->object_count + 1, sizeof *ref);
    if (!ref) return out_of_memory(c);
    bool ok = place_objects(c, ref);
    if (ok) {
        Stopwatch w = stopwatch();
        BvhSettings settings = {.max_leaf = OBJECT_LEAF, .block = 1, .block_cost = OBJECT_COST,
                                .threads = c->settings->threads};
        uint32_t count = (uint32_t)c->object_count;
        ok = pieces_cut(c->objects, &ref, &count, c->err) && bvh_build(&world->bvh, ref, count, &settings, c->err);
        if (ok) bvh_name_items(&world->bvh);
        stop(w, &c->stats->bvh_wall_s, &c->stats->bvh_cpu_s);
    }
    free(ref);
    return ok;
}

/* ---- all of it ---- */

static bool compile(Compile *c, World *world)
{
    Affine identity = affine_identity();
    c->memory->plain = phong_create(rgb(1, 1, 1), rgb(0, 0, 0), 1, 0);
    if (!c->memory->plain) return out_of_memory(c);
    if (!push(c, c->job->root, &identity) || !walk(c, 0)) return false;
    if (!make_mesh_prims(c) || !scale_objects(c, world) || !bake(c)) return false;
    if (!build_bvh(c, world) || !view_objects(c) || !make_shadings(c, world)) return false;
    if (!place_lights(c, world)) return false;
    place_camera(c, world);
    c->stats->objects = c->object_count;
    /* The others map rays to an object in float, products of which overflow there. The hits are the same. */
    world->kernel = kernel_best(c->beyond_floats ? "scalar" : c->settings->cpu);
    world->objects = c->objects;
    world->views = c->memory->views;
    world->object_count = (uint32_t)c->object_count;
    return true;
}

/* Files that the script named, needed or not. */
static void count_named(const RenderJob *job, CompileStats *stats)
{
    stats->meshes_named = scene_mesh_count(job->scene);
    stats->textures_named = scene_texture_count(job->scene);
}

World *world_compile(const RenderJob *job, const CompileSettings *settings, CompileStats *stats, Err *err)
{
    Stopwatch all = stopwatch();
    *stats = (CompileStats){0};
    count_named(job, stats);
    Compile c = {.job = job, .settings = settings, .stats = stats, .err = err};
    double share = OBJECT_MEMORY_SHARE * (double)memory_limit_bytes() / (double)OBJECT_BYTES;
    c.object_limit = share < (double)(UINT32_MAX / 2) ? (uint64_t)share : UINT32_MAX / 2;
    World *world = calloc(1, sizeof *world);
    c.memory = calloc(1, sizeof *c.memory);
    bool ok = world && c.memory;
    if (ok) {
        world->memory = c.memory;
        ok = compile(&c, world);
        c.memory->objects = c.objects;
        c.memory->made = c.made;
        c.memory->made_count = c.made_count;
    } else {
        err_memory(err, "the scene");
        free(c.memory);
    }
    free(c.visits);
    free(c.geometry_of);
    free(c.nodes.met);
    free(c.meshes.met);
    free(c.textures.met);
    stop(all, &stats->compile_wall_s, &stats->compile_cpu_s);
    stats->compile_wall_s -= stats->load_wall_s + stats->bvh_wall_s;
    stats->compile_cpu_s -= stats->load_cpu_s + stats->bvh_cpu_s;
    if (ok) return world;
    if (world && world->memory)
        world_destroy(world);
    else
        free(world);
    return NULL;
}

void world_destroy(World *world)
{
    if (!world) return;
    struct WorldMemory *m = world->memory;
    bvh_free(&world->bvh);
    for (uint32_t i = 0; i < m->geometry_count; i++) {
        if (m->geometry[i].csg) prim_destroy(m->geometry[i].prim);
        free(m->geometry[i].leaf_node);
    }
    for (uint32_t i = 0; i < m->made_count; i++) prim_destroy(m->made[i].prim);
    prim_destroy(m->baked);
    for (ScaledMesh *s = m->scaled, *next; s; s = next) {
        next = s->next;
        texture_destroy(s->height_bands);
        free(s);
    }
    free(m->made);
    free(m->geometry);
    free(m->objects);
    free(m->views);
    free(m->shadings);
    free(m->lights);
    free(m->part_geometry);
    free(m->plain);
    free(m);
    free(world);
}
