/* A line at a time, straight into arrays that double. */
#include "tools/obj.h"

#include <float.h>
#include <inttypes.h>
#include <locale.h>
#include <stdlib.h>
#include <string.h>

#include "tools/decimal.h"
#include "tools/lines.h"

enum { FIRST_CAPACITY = 1024, SHOWN_CHARS = 40 };

#define MAX_COUNT (UINT32_MAX - 1)

typedef enum { REF_POSITION, REF_UV, REF_NORMAL, REF_KINDS } RefKind;

static const char *const ref_names[REF_KINDS] = {"vertex", "texture vertex", "normal"};

typedef struct { uint32_t index[REF_KINDS]; } Corner;

typedef struct {
    Obj *obj;
    Lines lines;
    Err *err;
    locale_t c_locale;
    uint32_t capacity[REF_KINDS], triangle_capacity;
    bool zero_normal;
    /* Faces may come before their vertices: the highest number used ahead of its vertex, and the line that did. */
    struct { int64_t number; uint64_t line; } ahead[REF_KINDS];
} Reader;

/* ---- characters ---- */

/* A backslash before a newline stands for a blank; its length, or 0. */
static size_t continuation(const char *p)
{
    if (p[0] != '\\') return 0;
    if (p[1] == '\n') return 2;
    return p[1] == '\r' && p[2] == '\n' ? 3 : 0;
}

static bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

static bool ends_token(const char *p)
{
    return is_blank(*p) || *p == '\n' || *p == '\0' || (*p == '\\' && continuation(p));
}

static const char *skip_blanks(const char *p)
{
    for (;;) {
        while (is_blank(*p)) p++;
        size_t n = continuation(p);
        if (!n) return p;
        p += n;
    }
}

static bool ends_line(const char *p) { return *p == '\n' || *p == '\0' || *p == '#'; }

static bool is_digit(char c) { return c >= '0' && c <= '9'; }

/* "'TOKEN' WHAT", the token cut to a readable length. */
static bool token_error(Reader *r, const char *token, const char *what)
{
    int n = 0;
    while (n < SHOWN_CHARS && !ends_token(token + n)) n++;
    return lines_error(&r->lines, r->err, "'%.*s%s' %s", n, token, ends_token(token + n) ? "" : "...", what);
}

/* ---- numbers ---- */

/* Words for what isn't a number at all are told from those for what is none that can be used. */
static bool number_error(Reader *r, const char *token)
{
    const char *p = token + (*token == '-' || *token == '+');
    bool special = strncasecmp(p, "nan", 3) == 0 || strncasecmp(p, "inf", 3) == 0;
    return token_error(r, token, special ? "is not a finite number" : "is not a number");
}

/* A finite decimal number at *at, which is moved behind it. */
static bool parse_number(Reader *r, const char **at, double *x)
{
    const char *token = *at;
    if (!decimal_read(at, x, r->c_locale) || !ends_token(*at)) return number_error(r, token);
    return isfinite(*x) || token_error(r, token, "is not a finite number");
}

/* The numbers of a line: at least `least` of them, the first `most` into x; the rest need only be numbers. */
static bool parse_numbers(Reader *r, const char *p, double *x, int least, int most, const char *what)
{
    int count = 0;
    for (p = skip_blanks(p); !ends_line(p); p = skip_blanks(p)) {
        double ignored;
        if (!parse_number(r, &p, count < most ? &x[count] : &ignored)) return false;
        if (count < most) count++;
    }
    return count >= least || lines_error(&r->lines, r->err, "%s", what);
}

/* ---- arrays ---- */

/* Room for twice the elements; the old array, unchanged, if there is none. */
static bool grow(Reader *r, void **array, uint32_t capacity, size_t element)
{
    void *more = realloc(*array, capacity * element);
    if (!more) return err_memory(r->err, r->lines.path);
    *array = more;
    return true;
}

/* Whether another element may be added to an array of `count`: sets *capacity, and *full if it must grow to that. */
static bool make_room(Reader *r, uint32_t count, uint32_t *capacity, bool *full)
{
    *full = count == *capacity;
    if (!*full) return true;
    if (count == MAX_COUNT)
        return err_set(r->err, ERR_LIMIT, "%s: more than the limit of %u vertices or triangles", r->lines.path,
                       (unsigned)MAX_COUNT);
    *capacity = count > MAX_COUNT / 2 ? MAX_COUNT : count ? 2 * count : FIRST_CAPACITY;
    return true;
}

static bool add_position(Reader *r, const char *p)
{
    Obj *o = r->obj;
    double x[3];
    bool full;
    if (!parse_numbers(r, p, x, 3, 3, "a vertex needs three coordinates")) return false;
    if (!make_room(r, o->position_count, &r->capacity[REF_POSITION], &full)) return false;
    if (full) {
        void *array = o->position;
        if (!grow(r, &array, r->capacity[REF_POSITION], sizeof *o->position)) return false;
        o->position = array;
    }
    o->position[o->position_count++] = vec3_make(x[0], x[1], x[2]);
    return true;
}

static float finite_float(double x) { return (float)fmin(fmax(x, -(double)FLT_MAX), (double)FLT_MAX); }

static bool add_uv(Reader *r, const char *p)
{
    Obj *o = r->obj;
    double x[2] = {0, 0};
    bool full;
    if (!parse_numbers(r, p, x, 1, 2, "a texture vertex needs a coordinate")) return false;
    if (!make_room(r, o->uv_count, &r->capacity[REF_UV], &full)) return false;
    if (full) {
        void *array = o->uv;
        if (!grow(r, &array, r->capacity[REF_UV], sizeof *o->uv)) return false;
        o->uv = array;
    }
    float *uv = o->uv[o->uv_count++];
    uv[0] = finite_float(x[0]);
    uv[1] = finite_float(x[1]);
    return true;
}

static bool add_normal(Reader *r, const char *p)
{
    Obj *o = r->obj;
    double x[3];
    bool full;
    if (!parse_numbers(r, p, x, 3, 3, "a normal needs three coordinates")) return false;
    if (!make_room(r, o->normal_count, &r->capacity[REF_NORMAL], &full)) return false;
    if (full) {
        void *array = o->normal;
        if (!grow(r, &array, r->capacity[REF_NORMAL], sizeof *o->normal)) return false;
        o->normal = array;
    }
    Vec3 n = vec3_make(x[0], x[1], x[2]);
    if (vec3_max(vec3_abs(n)) > 0)
        n = vec3_normalize(n);
    else
        r->zero_normal = true;
    float *normal = o->normal[o->normal_count++];
    normal[0] = (float)n.x;
    normal[1] = (float)n.y;
    normal[2] = (float)n.z;
    return true;
}

static bool grow_triangles(Reader *r)
{
    Obj *o = r->obj;
    void *array = o->triangle;
    if (!grow(r, &array, r->triangle_capacity, sizeof *o->triangle)) return false;
    o->triangle = array;
    array = o->triangle_uv;
    if (array && !grow(r, &array, r->triangle_capacity, sizeof *o->triangle_uv)) return false;
    o->triangle_uv = array;
    array = o->triangle_normal;
    if (array && !grow(r, &array, r->triangle_capacity, sizeof *o->triangle_normal)) return false;
    o->triangle_normal = array;
    return true;
}

/* Stores one kind of index of a triangle. The array is made when the first corner has one. */
static bool set_optional(Reader *r, uint32_t (**array)[3], RefKind kind, const Corner corner[3])
{
    uint32_t at = r->obj->triangle_count;
    if (!*array) {
        if (corner[0].index[kind] == OBJ_NONE && corner[1].index[kind] == OBJ_NONE &&
            corner[2].index[kind] == OBJ_NONE)
            return true;
        *array = malloc(r->triangle_capacity * sizeof **array);
        if (!*array) return err_memory(r->err, r->lines.path);
        memset(*array, 0xff, at * sizeof **array);  /* OBJ_NONE */
    }
    for (int i = 0; i < 3; i++) (*array)[at][i] = corner[i].index[kind];
    return true;
}

static bool add_triangle(Reader *r, const Corner corner[3])
{
    Obj *o = r->obj;
    bool full;
    if (!make_room(r, o->triangle_count, &r->triangle_capacity, &full)) return false;
    if (full && !grow_triangles(r)) return false;
    for (int i = 0; i < 3; i++) o->triangle[o->triangle_count][i] = corner[i].index[REF_POSITION];
    if (!set_optional(r, &o->triangle_uv, REF_UV, corner)) return false;
    if (!set_optional(r, &o->triangle_normal, REF_NORMAL, corner)) return false;
    o->triangle_count++;
    return true;
}

/* ---- faces ---- */

static uint32_t count_of(const Obj *o, RefKind kind)
{
    switch (kind) {
    case REF_POSITION: return o->position_count;
    case REF_UV: return o->uv_count;
    case REF_NORMAL: return o->normal_count;
    case REF_KINDS: break;
    }
    return 0;
}

/* One number of a corner: from 1, or from -1 backwards from the last one read. */
static bool parse_ref(Reader *r, const char *token, const char **at, RefKind kind, uint32_t *index)
{
    const char *text = *at, *p = text;
    bool negative = *p == '-';
    if (*p == '-' || *p == '+') p++;
    if (!is_digit(*p)) return token_error(r, token, "is not a corner of a face");
    int64_t number = 0;
    for (; is_digit(*p); p++)
        if (number < INT64_MAX / 100) number = 10 * number + (*p - '0');
    *at = p;
    int64_t count = count_of(r->obj, kind);
    if (number == 0)
        return lines_error(&r->lines, r->err, "%s 0; they are counted from 1", ref_names[kind]);
    if (number > (negative ? count : (int64_t)MAX_COUNT))
        return lines_error(&r->lines, r->err, "%s %.*s of %" PRId64 "%s", ref_names[kind],
                           p - text < SHOWN_CHARS ? (int)(p - text) : SHOWN_CHARS, text, count,
                           negative ? " so far" : "");
    if (!negative && number > count && number > r->ahead[kind].number) {
        r->ahead[kind].number = number;
        r->ahead[kind].line = r->lines.number;
    }
    *index = (uint32_t)(negative ? count - number : number - 1);
    return true;
}

/* v, v/t, v//n or v/t/n. */
static bool parse_corner(Reader *r, const char **at, Corner *corner)
{
    const char *token = *at;
    *corner = (Corner){{OBJ_NONE, OBJ_NONE, OBJ_NONE}};
    if (!parse_ref(r, token, at, REF_POSITION, &corner->index[REF_POSITION])) return false;
    for (RefKind kind = REF_UV; kind <= REF_NORMAL && **at == '/'; kind++) {
        ++*at;
        bool omitted = **at == '/' || ends_token(*at);
        if (!omitted && !parse_ref(r, token, at, kind, &corner->index[kind])) return false;
    }
    return ends_token(*at) || token_error(r, token, "is not a corner of a face");
}

/* The fan of a polygon, made as its corners are read: there may be millions. */
static bool add_face(Reader *r, const char *p)
{
    Corner fan[3];
    uint64_t corners = 0;
    for (p = skip_blanks(p); !ends_line(p); p = skip_blanks(p)) {
        if (!parse_corner(r, &p, &fan[corners < 2 ? corners : 2])) return false;
        corners++;
        if (corners < 3) continue;
        if (!add_triangle(r, fan)) return false;
        fan[1] = fan[2];
    }
    if (corners == 2) return lines_error(&r->lines, r->err, "a face of two vertices");
    if (corners == 1) return lines_error(&r->lines, r->err, "a face of one vertex");
    return corners > 0 || lines_error(&r->lines, r->err, "a face without vertices");
}

/* ---- the file ---- */

static bool read_line(Reader *r, const char *p)
{
    p = skip_blanks(p);
    if (p[0] == 'v') {
        if (ends_token(p + 1)) return add_position(r, p + 1);
        if (p[1] == 't' && ends_token(p + 2)) return add_uv(r, p + 2);
        if (p[1] == 'n' && ends_token(p + 2)) return add_normal(r, p + 2);
    } else if (p[0] == 'f' && ends_token(p + 1)) {
        return add_face(r, p + 1);
    }
    return true;
}

static bool check_refs_ahead(Reader *r)
{
    for (RefKind kind = 0; kind < REF_KINDS; kind++) {
        uint32_t count = count_of(r->obj, kind);
        if (r->ahead[kind].number > count)
            return err_set(r->err, ERR_INPUT, "%s:%" PRIu64 ": %s %" PRId64 " of %" PRIu32, r->lines.path,
                           r->ahead[kind].line, ref_names[kind], r->ahead[kind].number, count);
    }
    return true;
}

/* A normal of no length is no normal. */
static void drop_zero_normals(Obj *o)
{
    for (uint32_t i = 0; o->triangle_normal && i < o->triangle_count; i++) {
        for (int k = 0; k < 3; k++) {
            uint32_t n = o->triangle_normal[i][k];
            if (n == OBJ_NONE) continue;
            const float *normal = o->normal[n];
            if (normal[0] == 0 && normal[1] == 0 && normal[2] == 0) o->triangle_normal[i][k] = OBJ_NONE;
        }
    }
}

/* Gives back what doubling took too much; a failure to shrink is none. */
static void *shrink(void *array, uint32_t count, size_t element)
{
    void *less = array && count ? realloc(array, count * element) : NULL;
    return less ? less : array;
}

static void shrink_all(Obj *o)
{
    o->position = shrink(o->position, o->position_count, sizeof *o->position);
    o->uv = shrink(o->uv, o->uv_count, sizeof *o->uv);
    o->normal = shrink(o->normal, o->normal_count, sizeof *o->normal);
    o->triangle = shrink(o->triangle, o->triangle_count, sizeof *o->triangle);
    o->triangle_uv = shrink(o->triangle_uv, o->triangle_count, sizeof *o->triangle_uv);
    o->triangle_normal = shrink(o->triangle_normal, o->triangle_count, sizeof *o->triangle_normal);
}

static bool read_all(Reader *r)
{
    for (;;) {
        const char *text, *end;
        LinesResult result = lines_next(&r->lines, &text, &end, r->err);
        if (result == LINES_FAILED) return false;
        if (result == LINES_END) break;
        if (!read_line(r, text)) return false;
    }
    if (!check_refs_ahead(r)) return false;
    if (r->obj->triangle_count == 0) return err_set(r->err, ERR_INPUT, "%s: no faces", r->lines.path);
    if (r->zero_normal) drop_zero_normals(r->obj);
    shrink_all(r->obj);
    return true;
}

bool obj_load(const char *path, Obj *obj, Err *err)
{
    *obj = (Obj){0};
    Reader r = {.obj = obj, .err = err};
    if (!lines_open(&r.lines, path, true, err)) return false;
    r.c_locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    bool ok = r.c_locale ? read_all(&r) : err_memory(err, path);
    if (r.c_locale) freelocale(r.c_locale);
    lines_close(&r.lines);
    if (!ok) obj_free(obj);
    return ok;
}

void obj_free(Obj *obj)
{
    free(obj->position);
    free(obj->uv);
    free(obj->normal);
    free(obj->triangle);
    free(obj->triangle_uv);
    free(obj->triangle_normal);
    *obj = (Obj){0};
}
