/* The scene tree: what the script said, before anything is loaded or built. All nodes of a script live in one Scene
 * and are freed with it. Nodes may be shared (instancing); cycles are refused when a child is added. */
#ifndef RT_NODE_NODE_H
#define RT_NODE_NODE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "common/affine.h"
#include "common/arena.h"
#include "common/err.h"
#include "node/bumping/bump.h"
#include "node/csg/csg.h"
#include "node/material/material.h"
#include "node/primitive/mesh.h"
#include "node/primitive/prim.h"
#include "node/texture/texture.h"
#include "node/tree/grammar.h"

typedef enum {
    NODE_GROUP,     /* no geometry: gr.node, gr.joint */
    NODE_PRIM,      /* an analytic primitive */
    NODE_MESH,      /* a mesh, from a file, a table or a mountain's generator */
    NODE_CSG,
    NODE_TREE,      /* an L-system */
} NodeKind;

typedef struct Node Node;

struct Node {
    NodeKind kind;
    const char *name;   /* for messages only */
    const char *where;  /* "temple.lua:41: ", where the script made it; shared */
    Affine transform;   /* child coordinates to parent coordinates */
    Affine base;        /* geometry only (nh_sphere, nh_box): applied before transform, not to the children */
    Node **children;
    uint32_t child_count, child_capacity;
    uint32_t index;     /* in order of creation, unique in the scene */
    uint32_t mark;      /* of the walk that looks for cycles */
    bool has_parent;

    const Material *material;   /* NULL: none given */
    TextureSource *texture;     /* NULL: none */
    const Bump *bump;           /* NULL: none; meshes only */

    const Prim *prim;           /* NODE_PRIM */
    MeshSource *mesh;           /* NODE_MESH */
    struct { CsgOp op; Node *a, *b; } csg;
    struct { GrammarSource *grammar; uint32_t depth; Node *trunk, *leaf; uint64_t seed; } tree;
};

typedef struct Scene Scene;

/* NULL without memory. */
Scene *scene_create(void);
void scene_destroy(Scene *scene);

/* A node with identity matrices; name and where are copied (equal `where`s are stored once if they follow each other).
 * NULL without memory. */
Node *scene_add_node(Scene *scene, NodeKind kind, const char *name, const char *where);

/* Hands a primitive, mesh source, texture source, material or bump over to the scene, which frees it.
 * On failure (no memory) the thing is freed at once and false is returned. */
bool scene_own(Scene *scene, void *thing, void (*destroy)(void *thing));

/* Sources are made once per path: a second call with the same path returns the first's. NULL without memory. */
MeshSource *scene_mesh_file(Scene *scene, const char *path);
TextureSource *scene_texture_file(Scene *scene, const char *path);
GrammarSource *scene_grammar_file(Scene *scene, const char *path);

/* A source that is no file: the caller sets `loaded` of a table, or what describes a mountain. NULL without memory. */
MeshSource *scene_mesh_made(Scene *scene, MeshKind kind);

/* How many different mesh files and texture files there are. */
uint32_t scene_mesh_count(const Scene *scene);
uint32_t scene_texture_count(const Scene *scene);

/* True the first time: what is drawn coarsely for its coordinates is told of once in a script. */
bool scene_first_coarse(Scene *scene);

/* False with ERR_SCENE if the child is the parent or has the parent below it (children, CSG operands, trunk and leaf
 * count), ERR_LIMIT without memory. Whoever makes a node an operand, trunk or leaf must set its has_parent: it spares
 * the search below the child when the parent is below nothing. */
bool node_add_child(Scene *scene, Node *parent, Node *child, Err *err);

/* M <- T M, or M <- M T if post (scripts of 2015 and before). */
void node_transform(Node *node, const Affine *t, bool post);

#endif
