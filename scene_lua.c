/* The scene language: a Lua state with an explicit list of libraries, the table `gr`, and the methods of its nodes.
 *
 * Every command checks its arguments, allocates and returns. A mistake becomes a Lua error with the script's line in
 * front; Lua errors jump, so no function here holds memory of its own across a call of Lua: what a command needs for a
 * moment is a userdata of Lua's, what lives on belongs to the Scene.
 *
 * Errors of other kinds than the script's (a file that can't be opened, a limit) are plain strings too, so that scripts
 * may catch them; which kind the last of them had is remembered beside it. The sink's errors can't be caught for good:
 * the script's end is that error. */
#include "scene_lua.h"

#include <assert.h>
#include <errno.h>
#include <float.h>
#include <limits.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include <lauxlib.h>
#include <lua.h>
#include <lualib.h>

#include "common/numeric.h"
#include "common/place.h"
#include "node/primitive/primitive.h"
#include "tools/nearest.h"

/* gcc's form, which static checkers know better than _Noreturn. */
#define NORETURN __attribute__((noreturn))

/* Metatables of the userdata; messages take the name without "gr.". */
#define NODE "gr.node"
#define MATERIAL "gr.material"
#define LIGHT "gr.light"
#define TEXTURE "gr.texture"

/* What a run of a script needs; the Lua state's extra space points at it. */
typedef struct {
    const SceneScript *script;
    const RenderSink *sink;
    Scene *scene;
    Prim *sphere, *cube, *cylinder, *cone;  /* those without parameters are made once */
    bool told_no_lights;
    bool rendered;                          /* gr.render was called */
    ErrKind raised;                         /* kind of the error that is kept in the registry under &raised_key */
    Err sink_err;                           /* kind is ERR_NONE until the sink fails */
} Front;

/* A command of `gr` or a method of nodes: the name follows the mark '.' or ':' of its label. */
typedef struct {
    const char *label;
    lua_CFunction call;
    int args;  /* the most it takes, the node of a method included */
} Command;

/* How many callers are looked at: finding the n-th costs n steps, and a script that has overflowed its stack has many. */
enum { MAX_LEVELS = 100 };

static const char raised_key, order_key;  /* addresses are keys of Lua's registry */

static Front *front_of(lua_State *L) { return *(Front **)lua_getextraspace(L); }

static const char *command_name(const Command *command) { return strpbrk(command->label, ".:") + 1; }

/* -- Errors and places ------------------------------------------------------------------------------------------- */

/* The path of a chunk that came from a file; NULL for others. */
static const char *chunk_path(const lua_Debug *ar) { return ar->source[0] == '@' ? ar->source + 1 : NULL; }

/* Pushes "temple.lua:41: " for the innermost function of the script that is running, "" if none is. */
static const char *push_where(lua_State *L)
{
    lua_Debug ar;
    for (int level = 0; level < MAX_LEVELS && lua_getstack(L, level, &ar); level++) {
        lua_getinfo(L, "Sl", &ar);
        if (ar.currentline <= 0) continue;
        const char *path = chunk_path(&ar);
        return lua_pushfstring(L, "%s:%d: ", path ? path : ar.short_src, ar.currentline);
    }
    return lua_pushliteral(L, "");
}

/* Raises the error on top of the stack, of a kind that isn't the script's. */
static NORETURN void raise_kind(lua_State *L, ErrKind kind)
{
    front_of(L)->raised = kind;
    lua_pushvalue(L, -1);
    lua_rawsetp(L, LUA_REGISTRYINDEX, &raised_key);
    lua_error(L);
    __builtin_unreachable();
}

/* Raises an error with the script's line in front. */
static NORETURN void fail_kind(lua_State *L, ErrKind kind, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    push_where(L);
    lua_pushvfstring(L, format, args);
    va_end(args);
    lua_concat(L, 2);
    raise_kind(L, kind);
}

#define FAIL(L, ...) fail_kind(L, ERR_SCENE, __VA_ARGS__)

static NORETURN void fail_memory(lua_State *L, const char *what)
{
    fail_kind(L, ERR_LIMIT, "out of memory for %s", what);
}

static void warn(lua_State *L, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    push_where(L);
    lua_pushvfstring(L, format, args);
    va_end(args);
    lua_concat(L, 2);
    const RenderSink *sink = front_of(L)->sink;
    if (sink->warn) sink->warn(sink->context, lua_tostring(L, -1));
    lua_pop(L, 1);
}

/* Lua cuts a long path in its messages down to "..." and the path's end; puts the whole of `path` back if the message
 * on top of the stack begins with that. */
static void lengthen_path(lua_State *L, const char *path)
{
    enum { DOTS = 3, KEPT = LUA_IDSIZE - DOTS - 1 };
    const char *text = lua_tostring(L, -1);
    size_t length = strlen(path);
    if (length <= KEPT || strncmp(text, "...", DOTS) != 0) return;
    if (strncmp(text + DOTS, path + length - KEPT, KEPT) != 0) return;
    lua_pushfstring(L, "%s%s", path, text + DOTS + KEPT);
    lua_remove(L, -2);
}

/* Whether the string at index 1 is the error that was raised with a kind, or ends with it (coroutine.wrap puts a place
 * in front); pushes that error if so. */
static bool push_raised(lua_State *L)
{
    if (lua_type(L, 1) != LUA_TSTRING) return false;
    if (lua_rawgetp(L, LUA_REGISTRYINDEX, &raised_key) == LUA_TSTRING) {
        size_t length, raised_length;
        const char *text = lua_tolstring(L, 1, &length), *raised = lua_tolstring(L, -1, &raised_length);
        if (length >= raised_length && strcmp(text + length - raised_length, raised) == 0) return true;
    }
    lua_pop(L, 1);
    return false;
}

/* Makes one line with a place of whatever ends the script. */
static int on_error(lua_State *L)
{
    lua_settop(L, 1);
    if (push_raised(L)) return 1;
    if (!lua_isstring(L, 1) && !luaL_callmeta(L, 1, "__tostring"))
        lua_pushfstring(L, "the script raised an error that is no text but %s",
                        lua_isnil(L, 1) ? "nil" : lua_pushfstring(L, "a %s value", luaL_typename(L, 1)));
    lua_Debug ar;
    for (int level = 0; level < MAX_LEVELS && lua_getstack(L, level, &ar); level++) {
        lua_getinfo(L, "S", &ar);
        if (chunk_path(&ar)) lengthen_path(L, chunk_path(&ar));
    }
    if (place_length(lua_tostring(L, -1)) == 0) {
        push_where(L);
        lua_insert(L, -2);
        lua_concat(L, 2);
    }
    return 1;
}

/* -- Paths and files --------------------------------------------------------------------------------------------- */

/* Pushes folder/path and returns it if that is a file; pushes nothing and returns NULL otherwise. The folder is given
 * by its first `length` characters, its last slash included. */
static const char *push_if_file(lua_State *L, const char *folder, size_t length, const char *path)
{
    struct stat st;
    lua_pushlstring(L, folder, length);
    lua_pushfstring(L, "%s%s%s", lua_tostring(L, -1), length > 0 && folder[length - 1] != '/' ? "/" : "", path);
    lua_remove(L, -2);
    if (stat(lua_tostring(L, -1), &st) == 0 && !S_ISDIR(st.st_mode)) return lua_tostring(L, -1);
    lua_pop(L, 1);
    return NULL;
}

/* Length of a path's folder, its last slash included. */
static size_t folder_length(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? (size_t)(slash - path) + 1 : 0;
}

/* Pushes the first file of that name beside the script that is running, in the working directory, in the directories
 * given with -I, and last beside the scripts that called it (a library opens what a scene names). Pushes and returns
 * NULL's stead, nothing, if there is none. */
static const char *push_found(lua_State *L, const char *path)
{
    if (path[0] == '/') return push_if_file(L, "", 0, path);
    const SceneScript *script = front_of(L)->script;
    const char *found = NULL;
    bool innermost = true;
    lua_Debug ar;
    for (int level = 0; !found && level < MAX_LEVELS && lua_getstack(L, level, &ar); level++) {
        lua_getinfo(L, "S", &ar);
        const char *chunk = chunk_path(&ar);
        if (!chunk) continue;
        found = push_if_file(L, chunk, folder_length(chunk), path);
        if (!innermost || found) continue;
        innermost = false;
        found = push_if_file(L, "", 0, path);
        for (int i = 0; !found && i < script->include_count; i++)
            found = push_if_file(L, script->include[i], strlen(script->include[i]), path);
    }
    return found ? found : push_if_file(L, script->script, folder_length(script->script), path);
}

/* Pushes the path of an input, as it was given if no file is found: who opens it will say so. */
static const char *push_input(lua_State *L, const char *path)
{
    const char *found = push_found(L, path);
    return found ? found : lua_pushstring(L, path);
}

/* Pushes the function that a file holds. */
static void push_chunk(lua_State *L, const char *path)
{
    int status = luaL_loadfilex(L, path, "t");
    if (status == LUA_OK) return;
    if (status == LUA_ERRMEM) fail_memory(L, path);
    if (status == LUA_ERRFILE) {
        const char *text = lua_tostring(L, -1);
        if (strncmp(text, "cannot ", 7) == 0) text += 7;
        fail_kind(L, ERR_INPUT, "can't %s", text);
    }
    lengthen_path(L, path);
    if (place_length(lua_tostring(L, -1)) == 0) lua_pushfstring(L, "%s:1: %s", path, lua_tostring(L, -1));  /* bytecode */
    lua_error(L);
}

/* -- Arguments --------------------------------------------------------------------------------------------------- */

/* What a value is, for messages: "eye", "vertices[7]", "vertices[7][2]"; 0 stands for none. */
typedef struct {
    const char *what;
    lua_Integer item, part;
} Item;

static const char *push_item(lua_State *L, Item item)
{
    const char *text = lua_pushstring(L, item.what);
    if (item.item > 0) text = lua_pushfstring(L, "%s[%I]", text, (LUAI_UACINT)item.item);
    if (item.part > 0) text = lua_pushfstring(L, "%s[%I]", text, (LUAI_UACINT)item.part);
    return text;
}

static const char *push_description(lua_State *L, int index)
{
    switch (lua_type(L, index)) {
    case LUA_TNONE:
    case LUA_TNIL:
        return lua_pushliteral(L, "missing");
    case LUA_TNUMBER:
        return isnan(lua_tonumber(L, index)) ? lua_pushliteral(L, "nan") : luaL_tolstring(L, index, NULL);
    case LUA_TSTRING:
        return lua_pushfstring(L, "'%s'", lua_tostring(L, index));
    case LUA_TUSERDATA:
        if (luaL_getmetafield(L, index, "__name") == LUA_TSTRING) {
            const char *name = lua_tostring(L, -1);
            return lua_pushfstring(L, "a %s", strncmp(name, "gr.", 3) == 0 ? name + 3 : name);
        }
        return lua_pushliteral(L, "a userdata");
    default:
        return lua_pushfstring(L, "a %s", luaL_typename(L, index));
    }
}

/* The label of the command that is running: "gr.sphere". */
static const char *label(lua_State *L)
{
    const Command *command = lua_touserdata(L, lua_upvalueindex(1));
    return command->label;
}

static NORETURN void reject(lua_State *L, int index, Item item, const char *expected)
{
    const char *got = push_description(L, index);
    FAIL(L, "%s: %s must be %s, but is %s", label(L), push_item(L, item), expected, got);
}

static Item item(const char *what) { return (Item){what, 0, 0}; }

static double get_number(lua_State *L, int index, Item it)
{
    int is_number;
    double x = lua_tonumberx(L, index, &is_number);
    if (!is_number) reject(L, index, it, "a number");
    if (!isfinite(x)) reject(L, index, it, "a finite number");
    return x;
}

static double get_positive(lua_State *L, int index, const char *what)
{
    double x = get_number(L, index, item(what));
    if (!(x > 0)) reject(L, index, item(what), "a positive number");
    return x;
}

static double get_not_negative(lua_State *L, int index, const char *what)
{
    double x = get_number(L, index, item(what));
    if (!(x >= 0)) reject(L, index, item(what), "a number of at least 0");
    return x;
}

/* An integer in [least, most], `expected` in words; 3.0 and "3" are integers. */
static lua_Integer get_integer(lua_State *L, int index, Item it, lua_Integer least, lua_Integer most,
                               const char *expected)
{
    int is_integer;
    lua_Integer n = lua_tointegerx(L, index, &is_integer);
    if (!is_integer || n < least || n > most) reject(L, index, it, expected);
    return n;
}

static uint64_t get_seed(lua_State *L, int index)
{
    if (lua_isnil(L, index)) return 0;
    return (uint64_t)get_integer(L, index, item("seed"), LUA_MININTEGER, LUA_MAXINTEGER, "an integer");
}

/* Names and paths; a number is taken for its digits. */
static const char *get_text(lua_State *L, int index, const char *what)
{
    size_t length;
    const char *text = lua_tolstring(L, index, &length);
    if (!text) reject(L, index, item(what), "a string");
    if (strlen(text) != length) FAIL(L, "%s: %s has a zero byte in it", label(L), what);
    return text;
}

static const char *get_path(lua_State *L, int index, const char *what)
{
    const char *path = get_text(L, index, what);
    if (!*path) FAIL(L, "%s: %s is empty", label(L), what);
    return path;
}

/* A table of exactly n finite numbers. */
static void get_tuple(lua_State *L, int index, Item it, int n, double *out)
{
    index = lua_absindex(L, index);
    if (!lua_istable(L, index)) reject(L, index, it, lua_pushfstring(L, "a table of %d numbers", n));
    lua_Integer length = luaL_len(L, index);
    if (length != n)
        FAIL(L, "%s: %s must be a table of %d numbers, but has %I", label(L), push_item(L, it), n, (LUAI_UACINT)length);
    for (int i = 0; i < n; i++) {
        lua_geti(L, index, i + 1);
        out[i] = get_number(L, -1, it.item > 0 ? (Item){it.what, it.item, i + 1} : (Item){it.what, i + 1, 0});
        lua_pop(L, 1);
    }
}

static Vec3 get_vec3(lua_State *L, int index, Item it)
{
    double v[3];
    get_tuple(L, index, it, 3, v);
    return vec3_make(v[0], v[1], v[2]);
}

static Rgb get_rgb(lua_State *L, int index, Item it)
{
    double v[3];
    get_tuple(L, index, it, 3, v);
    for (int i = 0; i < 3; i++)
        if (fabs(v[i]) > (double)FLT_MAX) FAIL(L, "%s: %s has a number over 3.4e38", label(L), push_item(L, it));
    return rgb((float)v[0], (float)v[1], (float)v[2]);
}

/* Length of a list; its items are read with lua_geti. */
static uint32_t get_list(lua_State *L, int index, Item it)
{
    if (!lua_istable(L, index)) reject(L, index, it, "a table");
    lua_Integer n = luaL_len(L, index);
    if (n < 0 || n > INT_MAX) fail_kind(L, ERR_LIMIT, "%s: %s has too many items", label(L), push_item(L, it));
    return (uint32_t)n;
}

static Node *get_node(lua_State *L, int index, const char *what)
{
    Node **box = luaL_testudata(L, index, NODE);
    if (!box) reject(L, index, item(what), "a node");
    return *box;
}

/* The node of a method. */
static Node *get_self(lua_State *L)
{
    Node **box = luaL_testudata(L, 1, NODE);
    if (!box) FAIL(L, "%s: is called with ':' on a node, not on %s", label(L), push_description(L, 1));
    return *box;
}

/* Takes the arguments past the first n away and warns of them, once per command; fills up with nil to n. */
static void drop_surplus(lua_State *L, int n)
{
    int top = lua_gettop(L);
    while (top > n && lua_isnil(L, top)) top--;
    if (top > n && !lua_toboolean(L, lua_upvalueindex(2))) {
        lua_pushboolean(L, true);
        lua_replace(L, lua_upvalueindex(2));
        warn(L, "%s: %d surplus argument%s ignored", label(L), top - n, top - n == 1 ? "" : "s");
    }
    lua_settop(L, n);
}

/* -- Making nodes and what they carry ---------------------------------------------------------------------------- */

static void destroy_prim(void *prim) { prim_destroy(prim); }

/* Pushes a new node. */
static Node *push_node(lua_State *L, NodeKind kind, const char *name)
{
    Node **box = lua_newuserdatauv(L, sizeof *box, 0);
    *box = scene_add_node(front_of(L)->scene, kind, name, push_where(L));
    lua_pop(L, 1);
    if (!*box) fail_memory(L, "a node");
    luaL_setmetatable(L, NODE);
    return *box;
}

/* Hands a new thing to the scene; NULL stands for one that there was no memory for. */
static void *own(lua_State *L, void *thing, void (*destroy)(void *), const char *what)
{
    if (!thing || !scene_own(front_of(L)->scene, thing, destroy)) fail_memory(L, what);
    return thing;
}

static int push_prim_node(lua_State *L, const char *name, const Prim *prim)
{
    push_node(L, NODE_PRIM, name)->prim = prim;
    return 1;
}

/* A primitive without parameters, made at its first use. */
static const Prim *shared_prim(lua_State *L, Prim **prim, Prim *(*create)(void))
{
    if (!*prim) *prim = own(L, create(), destroy_prim, "a primitive");
    return *prim;
}

static const Prim *shared_sphere(lua_State *L) { return shared_prim(L, &front_of(L)->sphere, sphere_create); }
static const Prim *shared_cube(lua_State *L) { return shared_prim(L, &front_of(L)->cube, cube_create); }

/* -- Commands: nodes and primitives ------------------------------------------------------------------------------ */

static int gr_node(lua_State *L)
{
    push_node(L, NODE_GROUP, get_text(L, 1, "name"));
    return 1;
}

static int gr_joint(lua_State *L)
{
    double range[3];
    const char *name = get_text(L, 1, "name");
    get_tuple(L, 2, item("x range"), 3, range);
    get_tuple(L, 3, item("y range"), 3, range);
    push_node(L, NODE_GROUP, name);
    return 1;
}

static int gr_sphere(lua_State *L) { return push_prim_node(L, get_text(L, 1, "name"), shared_sphere(L)); }

static int gr_cube(lua_State *L) { return push_prim_node(L, get_text(L, 1, "name"), shared_cube(L)); }

static int gr_cylinder(lua_State *L)
{
    const char *name = get_text(L, 1, "name");
    return push_prim_node(L, name, shared_prim(L, &front_of(L)->cylinder, cylinder_create));
}

static int gr_cone(lua_State *L)
{
    const char *name = get_text(L, 1, "name");
    return push_prim_node(L, name, shared_prim(L, &front_of(L)->cone, cone_create));
}

static int gr_torus(lua_State *L)
{
    const char *name = get_text(L, 1, "name");
    double minor = get_positive(L, 2, "minor radius");
    return push_prim_node(L, name, own(L, torus_create(minor), destroy_prim, "a torus"));
}

/* The older primitives: place and size are a matrix of the geometry alone. */
static int push_placed(lua_State *L, const Prim *prim, const char *size_name)
{
    const char *name = get_text(L, 1, "name");
    Vec3 p = get_vec3(L, 2, item("point"));
    double size = get_positive(L, 3, size_name);
    Affine scale = affine_scale(size, size, size), move = affine_translate(p.x, p.y, p.z);
    Affine base = affine_mul(&move, &scale), inverse;
    if (!affine_inverse(&base, &inverse)) reject(L, 3, item(size_name), "a size that can be inverted");
    Node *node = push_node(L, NODE_PRIM, name);
    node->prim = prim;
    node->base = base;
    return 1;
}

static int gr_nh_sphere(lua_State *L) { return push_placed(L, shared_sphere(L), "radius"); }

static int gr_nh_box(lua_State *L) { return push_placed(L, shared_cube(L), "size"); }

/* -- Commands: meshes, mountains, trees -------------------------------------------------------------------------- */

/* A mesh that no file has. */
static MeshSource *new_mesh_source(lua_State *L, MeshKind kind)
{
    MeshSource *source = scene_mesh_made(front_of(L)->scene, kind);
    if (!source) fail_memory(L, "a mesh");
    return source;
}

/* Room for n things of a size, as a userdata that is pushed. */
static void *push_room(lua_State *L, uint64_t n, size_t size) { return lua_newuserdatauv(L, (size_t)n * size, 0); }

static Vec3 *push_vertices(lua_State *L, int index, uint32_t *count)
{
    *count = get_list(L, index, item("vertices"));
    Vec3 *vertex = push_room(L, *count, sizeof *vertex);
    for (uint32_t i = 0; i < *count; i++) {
        lua_geti(L, index, i + 1);
        vertex[i] = get_vec3(L, -1, (Item){"vertices", i + 1, 0});
        lua_pop(L, 1);
    }
    return vertex;
}

/* The sizes of the faces; *total gets their sum. */
static uint32_t *push_face_sizes(lua_State *L, int index, uint32_t *count, uint64_t *total)
{
    *count = get_list(L, index, item("faces"));
    *total = 0;
    uint32_t *size = push_room(L, *count, sizeof *size);
    for (uint32_t i = 0; i < *count; i++) {
        lua_geti(L, index, i + 1);
        size[i] = get_list(L, -1, (Item){"faces", i + 1, 0});
        *total += size[i];
        lua_pop(L, 1);
    }
    return size;
}

static uint32_t *push_face_indices(lua_State *L, int index, const uint32_t *size, uint32_t count, uint64_t total)
{
    uint32_t *vertex = push_room(L, total, sizeof *vertex), *next = vertex;
    for (uint32_t i = 0; i < count; i++) {
        lua_geti(L, index, i + 1);
        if (!lua_istable(L, -1)) reject(L, -1, (Item){"faces", i + 1, 0}, "a table");
        for (uint32_t j = 0; j < size[i]; j++) {
            lua_geti(L, -1, j + 1);
            *next++ = (uint32_t)get_integer(L, -1, (Item){"faces", i + 1, j + 1}, 0, UINT32_MAX - 1,
                                            "the number of a vertex, counted from 0");
            lua_pop(L, 1);
        }
        lua_pop(L, 1);
    }
    return vertex;
}

static MeshSource *get_mesh_tables(lua_State *L)
{
    uint32_t vertex_count, face_count;
    uint64_t index_count;
    const Vec3 *vertex = push_vertices(L, 2, &vertex_count);
    const uint32_t *size = push_face_sizes(L, 3, &face_count, &index_count);
    const uint32_t *index = push_face_indices(L, 3, size, face_count, index_count);
    MeshSource *source = new_mesh_source(L, MESH_TABLE);
    Err err = {ERR_NONE, ""};
    Mesh *mesh = mesh_from_faces(vertex, vertex_count, size, face_count, index, &err);
    if (!mesh) fail_kind(L, err.kind, "%s: %s", label(L), err.text);
    source->loaded = mesh;
    return source;
}

static int gr_mesh(lua_State *L)
{
    const char *name = get_text(L, 1, "name");
    MeshSource *source;
    if (lua_istable(L, 2)) {
        source = get_mesh_tables(L);
    } else if (lua_type(L, 2) == LUA_TSTRING) {
        drop_surplus(L, 2);
        source = scene_mesh_file(front_of(L)->scene, push_input(L, get_path(L, 2, "file")));
        if (!source) fail_memory(L, "a mesh");
    } else {
        reject(L, 2, item("mesh"), "the path of an OBJ file or a table of vertices");
    }
    push_node(L, NODE_MESH, name)->mesh = source;
    return 1;
}

static int gr_fractal_mountain(lua_State *L)
{
    const char *name = get_text(L, 1, "name");
    double size[3];
    get_tuple(L, 2, item("size"), 3, size);
    for (int i = 0; i < 3; i++)
        if (!(size[i] > 0)) FAIL(L, "%s: size must be three positive numbers", label(L));
    double roughness = get_not_negative(L, 3, "roughness");
    lua_Integer subdivisions =
        get_integer(L, 4, item("number of subdivisions"), 0, UINT32_MAX, "an integer of at least 0");
    uint64_t seed = get_seed(L, 5);
    MeshSource *source = new_mesh_source(L, MESH_MOUNTAIN);
    source->mountain.width = size[0];
    source->mountain.height = size[1];
    source->mountain.length = size[2];
    source->mountain.roughness = roughness;
    source->mountain.subdivisions = (uint32_t)subdivisions;
    source->mountain.seed = seed;
    push_node(L, NODE_MESH, name)->mesh = source;
    return 1;
}

static int gr_tree(lua_State *L)
{
    const char *name = get_text(L, 1, "name");
    const char *path = push_input(L, get_path(L, 2, "grammar"));
    lua_Integer depth = get_integer(L, 3, item("depth"), 0, UINT32_MAX, "an integer of at least 0");
    Node *trunk = get_node(L, 4, "trunk"), *leaf = get_node(L, 5, "leaf");
    uint64_t seed = get_seed(L, 6);
    GrammarSource *grammar = scene_grammar_file(front_of(L)->scene, path);
    if (!grammar) fail_memory(L, "a grammar");
    Node *node = push_node(L, NODE_TREE, name);
    node->tree.grammar = grammar;
    node->tree.depth = (uint32_t)depth;
    node->tree.trunk = trunk;
    node->tree.leaf = leaf;
    node->tree.seed = seed;
    trunk->has_parent = leaf->has_parent = true;
    return 1;
}

/* -- Commands: constructive solid geometry ----------------------------------------------------------------------- */

/* Why a node can't be an operand, as far as it can be known before anything is loaded; NULL if nothing is against it. */
static const char *operand_fault(const Node *node)
{
    if (node->child_count > 0) return "has children";
    switch (node->kind) {
    case NODE_GROUP:
        return "is a group, not a solid";
    case NODE_TREE:
        return "is a tree, not a solid";
    case NODE_MESH:
        return node->mesh->kind == MESH_MOUNTAIN ? "is a mountain, which has no bottom" : NULL;
    case NODE_PRIM:
        return node->prim->ops->closed ? NULL : "is not closed";
    case NODE_CSG:
        return NULL;
    }
    return NULL;
}

static Node *get_operand(lua_State *L, int index, const char *what)
{
    Node *node = get_node(L, index, what);
    const char *fault = operand_fault(node);
    if (fault) FAIL(L, "%s: %s, '%s', %s", label(L), what, node->name, fault);
    return node;
}

static int push_csg(lua_State *L, CsgOp op)
{
    const char *name = get_text(L, 1, "name");
    Node *a = get_operand(L, 2, "operand A"), *b = get_operand(L, 3, "operand B");
    Node *node = push_node(L, NODE_CSG, name);
    node->csg.op = op;
    node->csg.a = a;
    node->csg.b = b;
    a->has_parent = b->has_parent = true;
    return 1;
}

static int gr_union(lua_State *L) { return push_csg(L, CSG_UNION); }
static int gr_diff(lua_State *L) { return push_csg(L, CSG_DIFF); }
static int gr_intersect(lua_State *L) { return push_csg(L, CSG_INTERSECT); }

/* -- Commands: materials, textures, lights ----------------------------------------------------------------------- */

static int push_material(lua_State *L, double mirror)
{
    Rgb kd = get_rgb(L, 1, item("kd")), ks = get_rgb(L, 2, item("ks"));
    double exponent = get_not_negative(L, 3, "exponent");
    Material **box = lua_newuserdatauv(L, sizeof *box, 0);
    *box = own(L, phong_create(kd, ks, exponent, mirror), free, "a material");
    luaL_setmetatable(L, MATERIAL);
    return 1;
}

static int gr_material(lua_State *L) { return push_material(L, 0); }

static int gr_reflective_material(lua_State *L)
{
    double mirror = get_number(L, 4, item("reflected share"));
    if (!(mirror >= 0 && mirror <= 1)) reject(L, 4, item("reflected share"), "a number from 0 to 1");
    return push_material(L, mirror);
}

/* The texture that a path names: the same file is read once. */
static TextureSource *get_texture_file(lua_State *L, int index)
{
    TextureSource *source = scene_texture_file(front_of(L)->scene, push_input(L, get_path(L, index, "file")));
    if (!source) fail_memory(L, "a texture");
    return source;
}

static int gr_texture(lua_State *L)
{
    TextureSource *source = get_texture_file(L, 1);
    TextureSource **box = lua_newuserdatauv(L, sizeof *box, 0);
    *box = source;
    luaL_setmetatable(L, TEXTURE);
    return 1;
}

static int gr_light(lua_State *L)
{
    Light light = {.position = get_vec3(L, 1, item("position")), .colour = get_rgb(L, 2, item("colour"))};
    get_tuple(L, 3, item("falloff"), 3, light.falloff);
    if (light.falloff[0] == 0 && light.falloff[1] == 0 && light.falloff[2] == 0)
        FAIL(L, "%s: falloff must not be {0, 0, 0}: the light would be infinitely bright", label(L));
    Light *box = lua_newuserdatauv(L, sizeof *box, 0);
    *box = light;
    luaL_setmetatable(L, LIGHT);
    return 1;
}

/* -- Methods of nodes -------------------------------------------------------------------------------------------- */

static int gr_add_child(lua_State *L)
{
    Node *self = get_self(L), *child = get_node(L, 2, "child");
    Err err = {ERR_NONE, ""};
    if (!node_add_child(front_of(L)->scene, self, child, &err)) fail_kind(L, err.kind, "%s: %s", label(L), err.text);
    return 0;
}

static int gr_set_material(lua_State *L)
{
    Node *self = get_self(L);
    Material **material = luaL_testudata(L, 2, MATERIAL);
    if (!material) reject(L, 2, item("material"), "a material");
    if (self->kind == NODE_CSG)
        FAIL(L, "%s: '%s' is CSG: its surface has the materials of its operands", label(L), self->name);
    if (self->kind == NODE_GROUP || self->kind == NODE_TREE)
        warn(L, "%s: '%s' is a %s and has no surface of its own", label(L), self->name,
             self->kind == NODE_GROUP ? "group" : "tree");
    self->material = *material;
    return 0;
}

static int give_texture(lua_State *L, Node *self, TextureSource *texture)
{
    switch (self->kind) {
    case NODE_PRIM:
    case NODE_MESH:
        self->texture = texture;
        return 0;
    case NODE_CSG:
        FAIL(L, "%s: '%s' is CSG: give its operands textures", label(L), self->name);
    case NODE_GROUP:
        FAIL(L, "%s: '%s' is a group and has no surface of its own", label(L), self->name);
    case NODE_TREE:
        FAIL(L, "%s: '%s' is a tree: give its trunk and leaf textures", label(L), self->name);
    }
    return 0;
}

static int gr_add_texture(lua_State *L)
{
    Node *self = get_self(L);
    return give_texture(L, self, get_texture_file(L, 2));
}

static int gr_set_texture(lua_State *L)
{
    Node *self = get_self(L);
    TextureSource **texture = luaL_testudata(L, 2, TEXTURE);
    if (!texture) reject(L, 2, item("texture"), "a texture that gr.texture made");
    return give_texture(L, self, *texture);
}

static int gr_mesh_add_bumps(lua_State *L)
{
    Node *self = get_self(L);
    double centre[2];
    if (self->kind != NODE_MESH) FAIL(L, "%s: '%s' is not a mesh", label(L), self->name);
    get_tuple(L, 2, item("centre"), 2, centre);
    double periods = get_not_negative(L, 3, "number of periods");
    double period = get_positive(L, 4, "period");
    self->bump = own(L, wave_create(centre[0], centre[1], periods, period), free, "bumps");
    return 0;
}

static int transform(lua_State *L, Node *self, const Affine *t)
{
    Affine before = self->transform, inverse;
    node_transform(self, t, front_of(L)->script->legacy);
    if (affine_is_finite(&self->transform) && affine_inverse(&self->transform, &inverse)) return 0;
    self->transform = before;
    FAIL(L, "%s: the matrix of '%s' can't be inverted or represented then", label(L), self->name);
}

static int gr_scale(lua_State *L)
{
    static const char *const names[] = {"x", "y", "z"};
    Node *self = get_self(L);
    double s[3];
    for (int i = 0; i < 3; i++) {
        s[i] = get_number(L, i + 2, item(names[i]));
        if (s[i] == 0) FAIL(L, "%s: %s is 0: nothing would be left of '%s'", label(L), names[i], self->name);
    }
    Affine t = affine_scale(s[0], s[1], s[2]);
    return transform(L, self, &t);
}

static int gr_rotate(lua_State *L)
{
    Node *self = get_self(L);
    const char *axis = lua_type(L, 2) == LUA_TSTRING ? lua_tostring(L, 2) : "";
    const char *found = strlen(axis) == 1 ? strchr("xyzXYZ", *axis) : NULL;
    if (!found) reject(L, 2, item("axis"), "'x', 'y' or 'z'");
    double deg = get_number(L, 3, item("angle"));
    Affine t = affine_rotate((int)(strchr("xyz", *found | ('x' ^ 'X')) - "xyz"), deg);
    return transform(L, self, &t);
}

static int gr_translate(lua_State *L)
{
    Node *self = get_self(L);
    double x = get_number(L, 2, item("x")), y = get_number(L, 3, item("y")), z = get_number(L, 4, item("z"));
    Affine t = affine_translate(x, y, z);
    return transform(L, self, &t);
}

static int gr_tostring(lua_State *L)
{
    Node **box = luaL_checkudata(L, 1, NODE);
    lua_pushfstring(L, "node '%s'", (*box)->name);
    return 1;
}

/* -- Rendering --------------------------------------------------------------------------------------------------- */

static void set_samples(lua_State *L, int index, RenderOptions *options)
{
    options->samples = (uint32_t)get_integer(L, index, item("options.samples"), 1, MAX_SAMPLES,
                                             "an integer from 1 to 65536");
}

static void set_max_depth(lua_State *L, int index, RenderOptions *options)
{
    options->max_depth = (uint32_t)get_integer(L, index, item("options.max_depth"), 0, MAX_MAX_DEPTH,
                                               "an integer from 0 to 1000");
}

static void set_background(lua_State *L, int index, RenderOptions *options)
{
    options->background = get_rgb(L, index, item("options.background"));
}

static void set_seed(lua_State *L, int index, RenderOptions *options)
{
    options->seed = (uint64_t)get_integer(L, index, item("options.seed"), LUA_MININTEGER, LUA_MAXINTEGER, "an integer");
}

static const struct {
    const char *name;
    unsigned bit;
    void (*set)(lua_State *L, int index, RenderOptions *options);
} option_rows[] = {
    {"samples", OPTION_SAMPLES, set_samples},
    {"max_depth", OPTION_MAX_DEPTH, set_max_depth},
    {"background", OPTION_BACKGROUND, set_background},
    {"seed", OPTION_SEED, set_seed},
};

enum { OPTION_COUNT = sizeof option_rows / sizeof option_rows[0] };

static NORETURN void fail_unknown_option(lua_State *L, int key)
{
    const char *names[OPTION_COUNT];
    for (size_t i = 0; i < OPTION_COUNT; i++) names[i] = option_rows[i].name;
    const char *name = lua_type(L, key) == LUA_TSTRING ? lua_tostring(L, key) : push_description(L, key);
    const char *near = nearest_name(name, names, OPTION_COUNT);
    if (near) FAIL(L, "%s: unknown option '%s' (did you mean '%s'?)", label(L), name, near);
    FAIL(L, "%s: unknown option '%s'", label(L), name);
}

/* The options table at an absolute index. */
static RenderOptions get_options(lua_State *L, int index)
{
    RenderOptions options = {.given = 0};
    if (lua_isnil(L, index)) return options;
    for (size_t i = 0; i < OPTION_COUNT; i++) {
        if (lua_getfield(L, index, option_rows[i].name) != LUA_TNIL) {
            option_rows[i].set(L, lua_gettop(L), &options);
            options.given |= option_rows[i].bit;
        }
        lua_pop(L, 1);
    }
    for (lua_pushnil(L); lua_next(L, index); lua_pop(L, 1)) {
        size_t i = 0;
        while (i < OPTION_COUNT && (lua_type(L, -2) != LUA_TSTRING || strcmp(lua_tostring(L, -2), option_rows[i].name)))
            i++;
        if (i == OPTION_COUNT) fail_unknown_option(L, lua_absindex(L, -2));
    }
    return options;
}

/* Pushes the lights of a list as an array: nil ends the list. */
static const Light *push_lights(lua_State *L, int index, uint32_t *count)
{
    uint32_t most = get_list(L, index, item("lights"));
    Light *light = push_room(L, most, sizeof *light);
    *count = 0;
    while (*count < most && lua_geti(L, index, *count + 1) != LUA_TNIL) {
        const Light *box = luaL_testudata(L, -1, LIGHT);
        if (!box) reject(L, -1, (Item){"lights", *count + 1, 0}, "a light");
        light[(*count)++] = *box;
        lua_pop(L, 1);
    }
    Front *front = front_of(L);
    if (*count == 0 && !front->told_no_lights) {
        front->told_no_lights = true;
        warn(L, "%s: the list of lights is empty: ambient light only", label(L));
    }
    return light;
}

/* A side of the picture; a fraction is cut off. */
static uint32_t get_side(lua_State *L, int index, const char *what)
{
    double side = trunc(get_number(L, index, item(what)));
    if (side < 1) reject(L, index, item(what), "at least 1");
    if (side > MAX_SIDE)
        fail_kind(L, ERR_LIMIT, "%s: %s is %s: the limit is %d pixels", label(L), what, push_description(L, index),
                  (int)MAX_SIDE);
    return (uint32_t)side;
}

static void get_camera(lua_State *L, RenderJob *job)
{
    job->eye = get_vec3(L, 5, item("eye"));
    job->view = get_vec3(L, 6, item("view"));
    job->up = get_vec3(L, 7, item("up"));
    job->fov_deg = get_number(L, 8, item("fov"));
    if (vec3_max(vec3_abs(job->view)) == 0) FAIL(L, "%s: view is the zero vector", label(L));
    if (vec3_max(vec3_abs(job->up)) == 0) FAIL(L, "%s: up is the zero vector", label(L));
    /* Each component of the cross product of two computed unit vectors is off by less than gamma_16. */
    Vec3 right = vec3_cross(vec3_normalize(job->view), vec3_normalize(job->up));
    if (vec3_max(vec3_abs(right)) <= GAMMA(16)) FAIL(L, "%s: up is parallel to view", label(L));
    if (!(job->fov_deg > 0 && job->fov_deg < 180)) reject(L, 8, item("fov"), "an angle between 0 and 180 degrees");
}

static NORETURN void raise_sink_error(lua_State *L)
{
    Front *front = front_of(L);
    lua_pushstring(L, front->sink_err.text);
    raise_kind(L, front->sink_err.kind);
}

static int gr_render(lua_State *L)
{
    Front *front = front_of(L);
    if (front->sink_err.kind != ERR_NONE) raise_sink_error(L);
    if (!lua_isnil(L, 11) && !lua_istable(L, 11)) {
        drop_surplus(L, 10);
        lua_settop(L, 11);
    }
    RenderJob job = {.scene = front->scene, .root = get_node(L, 1, "root")};
    job.file = get_path(L, 2, "file");
    job.width = get_side(L, 3, "width");
    job.height = get_side(L, 4, "height");
    if ((uint64_t)job.width * job.height > MAX_AREA)
        fail_kind(L, ERR_LIMIT, "%s: %d x %d: the limit is %d pixels", label(L), (int)job.width, (int)job.height,
                  (int)MAX_AREA);
    get_camera(L, &job);
    job.ambient = get_rgb(L, 9, item("ambient"));
    job.options = get_options(L, 11);
    job.lights = push_lights(L, 10, &job.light_count);
    job.where = push_where(L);
    front->rendered = true;
    if (!front->sink->render(front->sink->context, &job, &front->sink_err)) {
        assert(front->sink_err.kind != ERR_NONE);
        raise_sink_error(L);
    }
    return 0;
}

/* -- The table of commands --------------------------------------------------------------------------------------- */

static const Command commands[] = {
    {"gr.node", gr_node, 1},
    {"gr.joint", gr_joint, 3},
    {"gr.sphere", gr_sphere, 1},
    {"gr.cube", gr_cube, 1},
    {"gr.nh_sphere", gr_nh_sphere, 3},
    {"gr.nh_box", gr_nh_box, 3},
    {"gr.cylinder", gr_cylinder, 1},
    {"gr.cone", gr_cone, 1},
    {"gr.torus", gr_torus, 2},
    {"gr.mesh", gr_mesh, 3},
    {"gr.fractal_mountain", gr_fractal_mountain, 5},
    {"gr.tree", gr_tree, 6},
    {"gr.union", gr_union, 3},
    {"gr.diff", gr_diff, 3},
    {"gr.difference", gr_diff, 3},
    {"gr.intersect", gr_intersect, 3},
    {"gr.intersection", gr_intersect, 3},
    {"gr.material", gr_material, 3},
    {"gr.reflective_material", gr_reflective_material, 4},
    {"gr.texture", gr_texture, 1},
    {"gr.light", gr_light, 3},
    {"gr.render", gr_render, 11},
    {"node:add_child", gr_add_child, 2},
    {"node:set_material", gr_set_material, 2},
    {"node:add_texture", gr_add_texture, 2},
    {"node:set_texture", gr_set_texture, 2},
    {"node:mesh_add_bumps", gr_mesh_add_bumps, 4},
    {"node:scale", gr_scale, 4},
    {"node:rotate", gr_rotate, 3},
    {"node:translate", gr_translate, 4},
    {"node:render", gr_render, 11},
};

enum { COMMAND_COUNT = sizeof commands / sizeof commands[0] };

/* What a script calls: upvalue 1 is the command, upvalue 2 tells whether surplus arguments have been warned of. */
static int call_command(lua_State *L)
{
    const Command *command = lua_touserdata(L, lua_upvalueindex(1));
    drop_surplus(L, command->args);
    return command->call(L);
}

/* __index of the commands (upvalue 1 is '.') and of the methods (':'). */
static int unknown_command(lua_State *L)
{
    char mark = (char)lua_tointeger(L, lua_upvalueindex(1));
    if (lua_type(L, 2) != LUA_TSTRING) return 0;
    const char *names[COMMAND_COUNT];
    size_t count = 0;
    for (size_t i = 0; i < COMMAND_COUNT; i++)
        if (strchr(commands[i].label, mark)) names[count++] = command_name(&commands[i]);
    const char *name = lua_tostring(L, 2), *near = nearest_name(name, names, count);
    const char *kind = mark == '.' ? "command" : "method", *owner = mark == '.' ? "gr." : "node:";
    if (near) FAIL(L, "unknown %s %s%s (did you mean %s%s?)", kind, owner, name, owner, near);
    FAIL(L, "unknown %s %s%s", kind, owner, name);
}

/* Pushes a table of the commands or methods; asking it for any other name is an error. */
static void push_commands(lua_State *L, char mark)
{
    lua_newtable(L);
    for (size_t i = 0; i < COMMAND_COUNT; i++) {
        if (!strchr(commands[i].label, mark)) continue;
        lua_pushlightuserdata(L, (void *)&commands[i]);
        lua_pushboolean(L, false);
        lua_pushcclosure(L, call_command, 2);
        lua_setfield(L, -2, command_name(&commands[i]));
    }
    lua_createtable(L, 0, 1);
    lua_pushinteger(L, mark);
    lua_pushcclosure(L, unknown_command, 1);
    lua_setfield(L, -2, "__index");
    lua_setmetatable(L, -2);
}

static void open_gr(lua_State *L)
{
    luaL_newmetatable(L, MATERIAL);
    luaL_newmetatable(L, TEXTURE);
    luaL_newmetatable(L, LIGHT);
    luaL_newmetatable(L, NODE);
    push_commands(L, ':');
    lua_setfield(L, -2, "__index");
    lua_pushcfunction(L, gr_tostring);
    lua_setfield(L, -2, "__tostring");
    push_commands(L, '.');
    lua_setglobal(L, "gr");
    lua_pop(L, 4);
}

/* -- A fixed order for pairs and next ---------------------------------------------------------------------------- */

/* A key of a table, taken out of Lua for sorting. Strings stay Lua's: the table keeps them. */
typedef struct {
    enum { KEY_NUMBER, KEY_STRING, KEY_NODE, KEY_BOOLEAN, KEY_OTHER } rank;
    long double number;    /* holds every integer and every float exactly */
    const char *text;
    size_t length;
    uint64_t identity;     /* a node's index, a boolean's truth, an address */
    lua_Integer position;  /* in the list being sorted */
} Key;

_Static_assert(LDBL_MANT_DIG >= 64, "a long double must hold every lua_Integer");

static Key key_at(lua_State *L, int index, lua_Integer position)
{
    Key key = {.rank = KEY_OTHER, .position = position};
    Node **box;
    switch (lua_type(L, index)) {
    case LUA_TNUMBER:
        key.rank = KEY_NUMBER;
        key.number = lua_isinteger(L, index) ? (long double)lua_tointeger(L, index) : (long double)lua_tonumber(L, index);
        break;
    case LUA_TSTRING:
        key.rank = KEY_STRING;
        key.text = lua_tolstring(L, index, &key.length);
        break;
    case LUA_TBOOLEAN:
        key.rank = KEY_BOOLEAN;
        key.identity = (uint64_t)lua_toboolean(L, index);
        break;
    default:
        box = luaL_testudata(L, index, NODE);
        if (box) key.rank = KEY_NODE;
        key.identity = box ? (*box)->index : (uint64_t)(uintptr_t)lua_topointer(L, index);
        break;
    }
    return key;
}

static int key_compare(const Key *a, const Key *b)
{
    if (a->rank != b->rank) return a->rank < b->rank ? -1 : 1;
    if (a->rank == KEY_NUMBER) return (a->number > b->number) - (a->number < b->number);
    if (a->rank == KEY_STRING) {
        int order = memcmp(a->text, b->text, a->length < b->length ? a->length : b->length);
        return order ? order : (a->length > b->length) - (a->length < b->length);
    }
    return (a->identity > b->identity) - (a->identity < b->identity);
}

static int compare_keys(const void *a, const void *b) { return key_compare(a, b); }

/* Pushes a list of the keys of the table at an absolute index, in order. */
static void push_sorted_keys(lua_State *L, int table)
{
    lua_Integer n = 0;
    Key last = {.rank = KEY_NUMBER, .number = -(long double)INFINITY};
    bool sorted = true;
    lua_newtable(L);
    int list = lua_gettop(L);
    for (lua_pushnil(L); lua_next(L, table); lua_pop(L, 1)) {
        Key key = key_at(L, -2, ++n);
        sorted = sorted && key_compare(&last, &key) <= 0;
        last = key;
        lua_pushvalue(L, -2);
        lua_rawseti(L, list, n);
    }
    if (sorted) return;
    Key *key = push_room(L, (uint64_t)n, sizeof *key);
    for (lua_Integer i = 0; i < n; i++) {
        lua_rawgeti(L, list, i + 1);
        key[i] = key_at(L, -1, i + 1);
        lua_pop(L, 1);
    }
    qsort(key, (size_t)n, sizeof *key, compare_keys);
    lua_createtable(L, n < INT_MAX ? (int)n : INT_MAX, 1);
    for (lua_Integer i = 0; i < n; i++) {
        lua_rawgeti(L, list, key[i].position);
        lua_rawseti(L, -2, i + 1);
    }
    lua_replace(L, list);
    lua_settop(L, list);
}

/* Pushes the least key of the table at an absolute index, or nil. */
static void push_least_key(lua_State *L, int table)
{
    Key least = {.position = 0};
    lua_pushnil(L);
    int found = lua_gettop(L);
    for (lua_pushnil(L); lua_next(L, table); lua_pop(L, 1)) {
        Key key = key_at(L, -2, 0);
        if (!lua_isnil(L, found) && key_compare(&least, &key) < 0) continue;
        least = key;
        lua_copy(L, -2, found);
    }
}

/* The position in a sorted list after the last key that is not above the one at `index`: a key that the script has
 * removed meanwhile has its successor too. */
static lua_Integer position_after(lua_State *L, int list, lua_Integer n, int index)
{
    Key key = key_at(L, index, 0);
    lua_Integer low = 1, high = n + 1;
    while (low < high) {
        lua_Integer middle = low + (high - low) / 2;
        lua_rawgeti(L, list, middle);
        Key other = key_at(L, -1, 0);
        lua_pop(L, 1);
        if (key_compare(&other, &key) <= 0)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* next(table [, key]). The first step of a traversal finds the least key; the second sorts the keys and keeps the list
 * until the traversal ends, in a table with weak keys, its own place in it at [0]. So a traversal takes O(n log n), and
 * asking whether a table is empty sorts nothing. */
static int fixed_next(lua_State *L)
{
    enum { TABLE = 1, KEY, LISTS, LIST };
    luaL_checktype(L, TABLE, LUA_TTABLE);
    lua_settop(L, KEY);
    lua_rawgetp(L, LUA_REGISTRYINDEX, &order_key);
    lua_pushvalue(L, TABLE);
    lua_rawget(L, LISTS);
    if (lua_isnil(L, KEY)) {
        push_least_key(L, TABLE);
    } else {
        if (lua_isnil(L, LIST)) {
            lua_pop(L, 1);
            push_sorted_keys(L, TABLE);
            lua_pushvalue(L, TABLE);
            lua_pushvalue(L, LIST);
            lua_rawset(L, LISTS);
        }
        lua_Integer n = (lua_Integer)lua_rawlen(L, LIST);
        lua_rawgeti(L, LIST, 0);
        lua_Integer at = lua_tointeger(L, -1);
        lua_rawgeti(L, LIST, at);
        at = at > 0 && lua_rawequal(L, -1, KEY) ? at + 1 : position_after(L, LIST, n, KEY);
        lua_pop(L, 2);
        for (; at <= n; at++) {
            lua_rawgeti(L, LIST, at);
            lua_pushvalue(L, -1);
            if (lua_rawget(L, TABLE) != LUA_TNIL) {
                lua_pushinteger(L, at);
                lua_rawseti(L, LIST, 0);
                return 2;
            }
            lua_pop(L, 2);
        }
        lua_pushnil(L);
    }
    bool starts = !lua_isnil(L, -1);
    if (!starts || !lua_isnil(L, LIST)) {
        lua_pushvalue(L, TABLE);
        lua_pushnil(L);
        lua_rawset(L, LISTS);
    }
    if (!starts) return 1;
    lua_pushvalue(L, -1);
    lua_rawget(L, TABLE);
    return 2;
}

static int fixed_pairs(lua_State *L)
{
    luaL_checkany(L, 1);
    if (luaL_getmetafield(L, 1, "__pairs") != LUA_TNIL) {
        lua_pushvalue(L, 1);
        lua_call(L, 1, 3);
        return 3;
    }
    lua_pushcfunction(L, fixed_next);
    lua_pushvalue(L, 1);
    lua_pushnil(L);
    return 3;
}

/* -- The libraries of a script ----------------------------------------------------------------------------------- */

static int finish_dofile(lua_State *L, int status, lua_KContext below)
{
    (void)status;
    return lua_gettop(L) - (int)below;
}

static int base_dofile(lua_State *L)
{
    push_chunk(L, push_input(L, luaL_checkstring(L, 1)));
    int below = lua_gettop(L) - 1;
    lua_callk(L, 0, LUA_MULTRET, below, finish_dofile);
    return finish_dofile(L, LUA_OK, below);
}

/* Calls upvalue 1, the library's own function, with all arguments. */
static int call_original(lua_State *L)
{
    lua_pushvalue(L, lua_upvalueindex(1));
    lua_insert(L, 1);
    lua_call(L, lua_gettop(L) - 1, LUA_MULTRET);
    return lua_gettop(L);
}

/* Sets the mode of load and loadfile, at `index`, to text: bytecode can crash the interpreter. */
static int call_with_text_mode(lua_State *L, int index)
{
    lua_settop(L, lua_gettop(L) > index ? index + 1 : index);
    lua_pushliteral(L, "t");
    lua_replace(L, index);
    return call_original(L);
}

static int base_load(lua_State *L) { return call_with_text_mode(L, 3); }

static int base_loadfile(lua_State *L)
{
    push_input(L, luaL_checkstring(L, 1));
    lua_replace(L, 1);
    return call_with_text_mode(L, 2);
}

/* Pushes the first file that the templates of package.path ("?.lua;lib/?.lua") give for a module; upvalue 1 is the
 * table `package`. */
static const char *push_module_path(lua_State *L, const char *name)
{
    const char *file = luaL_gsub(L, name, ".", "/");
    lua_getfield(L, lua_upvalueindex(1), "path");
    const char *template = lua_tostring(L, -1);
    if (!template) FAIL(L, "package.path must be a string");
    while (*template) {
        size_t length = strcspn(template, ";");
        const char *path = luaL_gsub(L, lua_pushlstring(L, template, length), "?", file);
        const char *found = *path ? push_found(L, path) : NULL;
        if (found) return found;
        lua_pop(L, 2);
        template += length + (template[length] == ';');
    }
    fail_kind(L, ERR_INPUT, "can't find the module '%s' as %s.lua", name, file);
}

/* Pushes a module's loader and where it comes from. */
static void push_loader(lua_State *L, const char *name)
{
    int top = lua_gettop(L);
    if (lua_getfield(L, lua_upvalueindex(1), "preload") == LUA_TTABLE && lua_getfield(L, -1, name) != LUA_TNIL) {
        lua_replace(L, top + 1);
        lua_pushliteral(L, ":preload:");
        return;
    }
    const char *path = push_module_path(L, name);
    lua_replace(L, top + 1);
    lua_settop(L, top + 1);
    push_chunk(L, path);
    lua_insert(L, top + 1);
}

/* require(name): from package.loaded, package.preload or a file of Lua. */
static int base_require(lua_State *L)
{
    enum { NAME = 1, LOADED, LOADER, PATH };
    const char *name = luaL_checkstring(L, NAME);
    lua_settop(L, NAME);
    lua_getfield(L, LUA_REGISTRYINDEX, LUA_LOADED_TABLE);
    if (lua_getfield(L, LOADED, name) != LUA_TNIL) return 1;
    lua_settop(L, LOADED);
    push_loader(L, name);
    lua_pushvalue(L, LOADER);
    lua_pushvalue(L, NAME);
    lua_pushvalue(L, PATH);
    lua_call(L, 2, 1);
    if (lua_isnil(L, -1)) lua_getfield(L, LOADED, name);  /* a module may have entered itself */
    if (lua_isnil(L, -1)) lua_pushboolean(L, true);
    lua_pushvalue(L, -1);
    lua_setfield(L, LOADED, name);
    lua_pushvalue(L, PATH);
    return 2;
}

/* io.open for reading alone. */
static int io_open(lua_State *L)
{
    const char *path = luaL_checkstring(L, 1), *mode = luaL_optstring(L, 2, "r");
    if (*mode != 'r' || strchr(mode, '+')) FAIL(L, "io.open: a scene can't write files (mode '%s')", mode);
    push_input(L, path);
    lua_replace(L, 1);
    return call_original(L);
}

/* io.lines and io.input, with a path or without. */
static int io_existing(lua_State *L)
{
    if (lua_type(L, 1) == LUA_TSTRING) {
        const char *path = lua_tostring(L, 1);
        if (!push_found(L, path)) fail_kind(L, ERR_INPUT, "can't open %s: %s", path, strerror(ENOENT));
        lua_replace(L, 1);
    }
    return call_original(L);
}

/* Pushes a global library cut down to the functions listed (a list that NULL ends) and all that is no function (the
 * standard streams), in place of the whole one. */
static void restrict_library(lua_State *L, const char *library, const char *const *keep)
{
    lua_getglobal(L, library);
    lua_newtable(L);
    for (lua_pushnil(L); lua_next(L, -3); lua_pop(L, 1)) {
        const char *const *name = keep;
        while (*name && (lua_type(L, -2) != LUA_TSTRING || strcmp(lua_tostring(L, -2), *name) != 0)) name++;
        if (lua_isfunction(L, -1) && !*name) continue;
        lua_pushvalue(L, -2);
        lua_pushvalue(L, -2);
        lua_rawset(L, -5);
    }
    lua_remove(L, -2);
    lua_getfield(L, LUA_REGISTRYINDEX, LUA_LOADED_TABLE);
    lua_pushvalue(L, -2);
    lua_setfield(L, -2, library);
    lua_pop(L, 1);
    lua_pushvalue(L, -1);
    lua_setglobal(L, library);
}

/* Puts a function of ours around one of the table on top of the stack. */
static void wrap(lua_State *L, const char *name, lua_CFunction function)
{
    lua_getfield(L, -1, name);
    lua_pushcclosure(L, function, 1);
    lua_setfield(L, -2, name);
}

static void open_package(lua_State *L)
{
    lua_newtable(L);
    lua_getfield(L, LUA_REGISTRYINDEX, LUA_LOADED_TABLE);
    lua_pushvalue(L, -2);
    lua_setfield(L, -2, "package");
    lua_setfield(L, -2, "loaded");
    lua_newtable(L);
    lua_setfield(L, -2, "preload");
    lua_pushliteral(L, "?.lua;?/init.lua");
    lua_setfield(L, -2, "path");
    lua_pushliteral(L, "");
    lua_setfield(L, -2, "cpath");
    lua_pushvalue(L, -1);
    lua_setglobal(L, "package");
    lua_pushcclosure(L, base_require, 1);
    lua_setglobal(L, "require");
}

static void open_order(lua_State *L)
{
    lua_newtable(L);
    lua_createtable(L, 0, 1);
    lua_pushliteral(L, "k");
    lua_setfield(L, -2, "__mode");
    lua_setmetatable(L, -2);
    lua_rawsetp(L, LUA_REGISTRYINDEX, &order_key);
    lua_pushcfunction(L, fixed_next);
    lua_setglobal(L, "next");
    lua_pushcfunction(L, fixed_pairs);
    lua_setglobal(L, "pairs");
}

static void open_libraries(lua_State *L)
{
    static const luaL_Reg libraries[] = {
        {LUA_GNAME, luaopen_base},        {LUA_TABLIBNAME, luaopen_table}, {LUA_STRLIBNAME, luaopen_string},
        {LUA_MATHLIBNAME, luaopen_math},  {LUA_UTF8LIBNAME, luaopen_utf8}, {LUA_COLIBNAME, luaopen_coroutine},
        {LUA_IOLIBNAME, luaopen_io},      {LUA_OSLIBNAME, luaopen_os},
    };
    static const char *const io_keep[] = {"open", "lines", "input", "read", "write", "type", "close", NULL};
    static const char *const os_keep[] = {"clock", "date", "time", "difftime", "getenv", NULL};
    for (size_t i = 0; i < sizeof libraries / sizeof libraries[0]; i++) {
        luaL_requiref(L, libraries[i].name, libraries[i].func, 1);
        lua_pop(L, 1);
    }
    restrict_library(L, LUA_IOLIBNAME, io_keep);
    wrap(L, "open", io_open);
    wrap(L, "lines", io_existing);
    wrap(L, "input", io_existing);
    restrict_library(L, LUA_OSLIBNAME, os_keep);
    lua_pushglobaltable(L);
    wrap(L, "load", base_load);
    wrap(L, "loadfile", base_loadfile);
    lua_pushcfunction(L, base_dofile);
    lua_setfield(L, -2, "dofile");
    lua_pop(L, 3);
    open_package(L);
    open_order(L);
}

/* What scripts of Lua 5.0 and 5.1 call. */
static const char legacy_names[] =
    "unpack, loadstring = table.unpack, load\n"
    "math.pow = function(x, y) return x ^ y end\n"
    "math.mod = math.fmod\n"
    "string.gfind = string.gmatch\n"
    "table.getn = function(t) return #t end\n"
    "table.foreachi = function(t, f)\n"
    "  for i = 1, #t do local r = f(i, t[i]); if r ~= nil then return r end end\n"
    "end\n"
    "table.foreach = function(t, f)\n"
    "  for k, v in pairs(t) do local r = f(k, v); if r ~= nil then return r end end\n"
    "end\n";

/* -- Running a script -------------------------------------------------------------------------------------------- */

/* math.random gives the same numbers in every run, until the script seeds it itself. */
static void seed_random(lua_State *L)
{
    lua_getglobal(L, LUA_MATHLIBNAME);
    lua_getfield(L, -1, "randomseed");
    lua_pushinteger(L, 1);
    lua_call(L, 1, 0);
    lua_pop(L, 1);
}

/* Sets the global `arg` and pushes its words, which are also the `...` of the script. */
static void push_args(lua_State *L, const SceneScript *script)
{
    lua_createtable(L, script->arg_count, 1);
    lua_pushstring(L, script->script);
    lua_rawseti(L, -2, 0);
    for (int i = 0; i < script->arg_count; i++) {
        lua_pushstring(L, script->args[i]);
        lua_rawseti(L, -2, i + 1);
    }
    lua_setglobal(L, "arg");
    luaL_checkstack(L, script->arg_count, "too many arguments");
    for (int i = 0; i < script->arg_count; i++) lua_pushstring(L, script->args[i]);
}

static int run_script(lua_State *L)
{
    Front *front = front_of(L);
    const SceneScript *script = front->script;
    open_libraries(L);
    seed_random(L);
    open_gr(L);
    if (script->legacy) {
        if (luaL_loadbufferx(L, legacy_names, sizeof legacy_names - 1, "=legacy", "t") != LUA_OK) lua_error(L);
        lua_call(L, 0, 0);
    }
    push_chunk(L, script->script);
    push_args(L, script);
    lua_call(L, script->arg_count, 0);
    if (!front->rendered && front->sink->warn) {
        const char *text = lua_pushfstring(L, "%s never calls gr.render: there is no picture", script->script);
        front->sink->warn(front->sink->context, text);
    }
    return 0;
}

/* Lua's allocator. Lua relies on this: making a block smaller never fails. */
static void *allocate(void *context, void *old, size_t old_size, size_t size)
{
    (void)context;
    if (size == 0) {
        free(old);
        return NULL;
    }
    void *block = realloc(old, size);
    if (!block && old && size <= old_size) return old;
    return block;
}

/* The error that lua_pcall ended with, its message on top of the stack. */
static bool script_error(lua_State *L, int status, Err *err)
{
    const Front *front = front_of(L);
    if (status == LUA_ERRMEM) return err_memory(err, front->script->script);
    const char *text = lua_type(L, -1) == LUA_TSTRING ? lua_tostring(L, -1) : "the script failed";
    if (status == LUA_ERRERR) return err_set(err, ERR_SCENE, "%s: stack overflow (%s)", front->script->script, text);
    bool raised = lua_rawgetp(L, LUA_REGISTRYINDEX, &raised_key) == LUA_TSTRING && lua_rawequal(L, -1, -2);
    return err_set(err, raised ? front->raised : ERR_SCENE, "%s", text);
}

bool scene_lua_run(const SceneScript *script, const RenderSink *sink, Err *err)
{
    Front front = {.script = script, .sink = sink};
    bool ok = false;
    front.scene = scene_create();
    lua_State *L = front.scene ? lua_newstate(allocate, NULL) : NULL;
    if (!L) {
        err_memory(err, script->script);
        goto done;
    }
    *(Front **)lua_getextraspace(L) = &front;
    lua_pushcfunction(L, on_error);
    lua_pushcfunction(L, run_script);
    int status = lua_pcall(L, 0, 0, 1);
    ok = status == LUA_OK || script_error(L, status, err);
    lua_close(L);
    if (front.sink_err.kind != ERR_NONE) {  /* also if the script caught it */
        ok = false;
        if (err) *err = front.sink_err;
    }
done:
    scene_destroy(front.scene);
    return ok;
}
