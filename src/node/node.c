#include "node/node.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

enum { FIRST_CHILDREN = 4, FIRST_SLOTS = 16, FIRST_STACK = 64 };

typedef struct Owned {
    struct Owned *next;
    void *thing;
    void (*destroy)(void *thing);
} Owned;

/* Sources by path: open addressing, never more than half full. */
typedef struct { const char *path; void *source; } Slot;
typedef struct { Slot *slot; uint32_t count, capacity; } SourceTable;

struct Scene {
    Arena *arena;
    Owned *owned;
    const char *last_where, *last_name;  /* for reuse: a script makes many nodes on one line */
    uint32_t node_count, mesh_source_count;
    uint32_t last_mark;
    bool told_coarse;
    SourceTable meshes, textures, grammars;
};

Scene *scene_create(void)
{
    Scene *scene = calloc(1, sizeof *scene);
    if (!scene) return NULL;
    scene->arena = arena_create();
    if (scene->arena) return scene;
    free(scene);
    return NULL;
}

void scene_destroy(Scene *scene)
{
    if (!scene) return;
    for (Owned *o = scene->owned; o; o = o->next) o->destroy(o->thing);
    free(scene->meshes.slot);
    free(scene->textures.slot);
    free(scene->grammars.slot);
    arena_destroy(scene->arena);
    free(scene);
}

bool scene_own(Scene *scene, void *thing, void (*destroy)(void *thing))
{
    Owned *o = arena_alloc(scene->arena, sizeof *o);
    if (!o) {
        destroy(thing);
        return false;
    }
    *o = (Owned){scene->owned, thing, destroy};
    scene->owned = o;
    return true;
}

/* ---- nodes ---- */

/* A copy in the arena, or the last one if it has the same text. NULL without memory. */
static const char *keep_text(Scene *scene, const char **last, const char *text)
{
    if (!*last || strcmp(*last, text) != 0) {
        const char *copy = arena_strdup(scene->arena, text);
        if (!copy) return NULL;
        *last = copy;
    }
    return *last;
}

Node *scene_add_node(Scene *scene, NodeKind kind, const char *name, const char *where)
{
    Node *node = arena_alloc_zero(scene->arena, sizeof *node);
    if (!node) return NULL;
    node->kind = kind;
    node->name = keep_text(scene, &scene->last_name, name);
    node->where = keep_text(scene, &scene->last_where, where);
    if (!node->name || !node->where) return NULL;
    node->transform = node->base = affine_identity();
    node->index = scene->node_count++;
    return node;
}

void node_transform(Node *node, const Affine *t, bool post)
{
    node->transform = post ? affine_mul(&node->transform, t) : affine_mul(t, &node->transform);
}

/* Nodes still to be visited. */
typedef struct {
    Node **node;
    size_t count, capacity;
} Stack;

/* Marks a node and puts it on the stack, unless it was marked already. False without memory. */
static bool push(Stack *stack, Node *node, uint32_t mark)
{
    if (!node || node->mark == mark) return true;
    node->mark = mark;
    if (stack->count == stack->capacity) {
        size_t capacity = stack->capacity ? 2 * stack->capacity : FIRST_STACK;
        Node **more = realloc(stack->node, capacity * sizeof *more);
        if (!more) return false;
        stack->node = more;
        stack->capacity = capacity;
    }
    stack->node[stack->count++] = node;
    return true;
}

static bool push_below(Stack *stack, const Node *node, uint32_t mark)
{
    for (uint32_t i = 0; i < node->child_count; i++)
        if (!push(stack, node->children[i], mark)) return false;
    return push(stack, node->csg.a, mark) && push(stack, node->csg.b, mark) && push(stack, node->tree.trunk, mark) &&
           push(stack, node->tree.leaf, mark);
}

static bool has_below(const Node *node)
{
    return node->child_count > 0 || node->csg.a || node->csg.b || node->tree.trunk || node->tree.leaf;
}

/* Whether `sought` is below `top`. With a stack of its own: chains may be a million nodes deep. False without memory. */
static bool find_below(Scene *scene, Node *top, const Node *sought, bool *found)
{
    Stack stack = {0};
    uint32_t mark = ++scene->last_mark;
    *found = false;
    bool ok = push(&stack, top, mark);
    while (ok && !*found && stack.count > 0) {
        Node *node = stack.node[--stack.count];
        *found = node == sought;
        ok = push_below(&stack, node, mark);
    }
    free(stack.node);
    return ok;
}

static bool append_child(Scene *scene, Node *parent, Node *child)
{
    if (parent->child_count == parent->child_capacity) {
        if (parent->child_capacity > UINT32_MAX / 2) return false;
        uint32_t capacity = parent->child_capacity ? 2 * parent->child_capacity : FIRST_CHILDREN;
        Node **more = arena_alloc(scene->arena, capacity * sizeof(Node *));
        if (!more) return false;
        if (parent->child_count) memcpy(more, parent->children, parent->child_count * sizeof(Node *));
        parent->children = more;
        parent->child_capacity = capacity;
    }
    parent->children[parent->child_count++] = child;
    child->has_parent = true;
    return true;
}

bool node_add_child(Scene *scene, Node *parent, Node *child, Err *err)
{
    if (child == parent) return err_set(err, ERR_SCENE, "'%s' can't be its own child", child->name);
    bool cycle = false;
    if (parent->has_parent && has_below(child) && !find_below(scene, child, parent, &cycle))
        return err_memory(err, "the search for cycles");
    if (cycle)
        return err_set(err, ERR_SCENE, "'%s' can't be a child of '%s', which is below it", child->name, parent->name);
    return append_child(scene, parent, child) || err_memory(err, "a node's children");
}

/* ---- sources ---- */

static uint64_t hash_text(const char *text)
{
    uint64_t h = 0xcbf29ce484222325u;  /* FNV-1a */
    for (; *text; text++) h = (h ^ (unsigned char)*text) * 0x100000001b3u;
    return h;
}

/* The slot of a path, which is empty if the path is new. The table must have an empty slot. */
static Slot *find_slot(const SourceTable *table, const char *path)
{
    uint32_t mask = table->capacity - 1, at = (uint32_t)hash_text(path) & mask;
    while (table->slot[at].path && strcmp(table->slot[at].path, path) != 0) at = (at + 1) & mask;
    return &table->slot[at];
}

static bool make_slot(SourceTable *table)
{
    if (2 * (table->count + 1) <= table->capacity) return true;
    SourceTable larger = {.count = table->count, .capacity = table->capacity ? 2 * table->capacity : FIRST_SLOTS};
    larger.slot = calloc(larger.capacity, sizeof *larger.slot);
    if (!larger.slot) return false;
    for (uint32_t i = 0; i < table->capacity; i++)
        if (table->slot[i].path) *find_slot(&larger, table->slot[i].path) = table->slot[i];
    free(table->slot);
    *table = larger;
    return true;
}

typedef void *(*MakeSource)(Scene *scene, const char *path);

/* The source of a path, made if it is new; `make` gets a copy of the path that lives as long as the scene. */
static void *find_source(Scene *scene, SourceTable *table, const char *path, MakeSource make)
{
    if (!make_slot(table)) return NULL;
    Slot *slot = find_slot(table, path);
    if (slot->path) return slot->source;
    const char *copy = arena_strdup(scene->arena, path);
    void *source = copy ? make(scene, copy) : NULL;
    if (!source) return NULL;
    *slot = (Slot){copy, source};
    table->count++;
    return source;
}

static void destroy_mesh_source(void *thing)
{
    MeshSource *source = thing;
    mesh_destroy(source->loaded);
    texture_destroy(source->height_bands);
}

static void destroy_texture_source(void *thing) { texture_destroy(((TextureSource *)thing)->loaded); }
static void destroy_grammar_source(void *thing) { grammar_destroy(((GrammarSource *)thing)->loaded); }

MeshSource *scene_mesh_made(Scene *scene, MeshKind kind)
{
    MeshSource *source = arena_alloc_zero(scene->arena, sizeof *source);
    if (!source || !scene_own(scene, source, destroy_mesh_source)) return NULL;
    source->kind = kind;
    source->index = scene->mesh_source_count++;
    return source;
}

static void *make_mesh_file(Scene *scene, const char *path)
{
    MeshSource *source = scene_mesh_made(scene, MESH_FILE);
    if (source) source->path = path;
    return source;
}

static void *make_texture_file(Scene *scene, const char *path)
{
    TextureSource *source = arena_alloc_zero(scene->arena, sizeof *source);
    if (!source || !scene_own(scene, source, destroy_texture_source)) return NULL;
    source->path = path;
    source->index = scene->textures.count;
    return source;
}

static void *make_grammar_file(Scene *scene, const char *path)
{
    GrammarSource *source = arena_alloc_zero(scene->arena, sizeof *source);
    if (!source || !scene_own(scene, source, destroy_grammar_source)) return NULL;
    source->path = path;
    return source;
}

MeshSource *scene_mesh_file(Scene *scene, const char *path)
{
    return find_source(scene, &scene->meshes, path, make_mesh_file);
}

TextureSource *scene_texture_file(Scene *scene, const char *path)
{
    return find_source(scene, &scene->textures, path, make_texture_file);
}

GrammarSource *scene_grammar_file(Scene *scene, const char *path)
{
    return find_source(scene, &scene->grammars, path, make_grammar_file);
}

uint32_t scene_mesh_count(const Scene *scene) { return scene->meshes.count; }
uint32_t scene_texture_count(const Scene *scene) { return scene->textures.count; }

bool scene_first_coarse(Scene *scene)
{
    bool first = !scene->told_coarse;
    scene->told_coarse = true;
    return first;
}
