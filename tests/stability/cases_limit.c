/* What a script may not say, and limits: an error with the script's line, or an image. */
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "node/primitive/mesh.h"
#include "stability/quad_scene.h"
#include "stability/ray_check.h"
#include "support/check.h"
#include "support/test_file.h"

/* The error is of that kind and one line "FILE:LINE: ...TEXT...", FILE as test_path says it; no text: an image. */
static void expect(Row *row, const Picture *picture, ErrKind kind, const char *file, int line, const char *text,
                   const char *what)
{
    char place[200];
    snprintf(place, sizeof place, "%s:%d: ", test_path(file), line);
    const char *got = picture->err.text;
    bool ok = text ? picture->err.kind == kind && strncmp(got, place, strlen(place)) == 0 && strstr(got, text) && !strchr(got, '\n')
                   : picture->rgb != NULL;
    row_trial(row, ok, "%.70s: %s%.80s", what, picture->rgb ? "an image" : "", picture->rgb ? "" : got);
}

/* ---- 12: tests/data/arguments.txt: what goes before, calls with @ for an argument, what is wrong for which kind ---- */

static char *part_of(char **text)
{
    char *part = *text, *end = strstr(part, "---\n");
    if (end) {
        *end = '\0';
        *text = end + 4;
    }
    return part;
}

static void call(Row *row, const char *before, const char *statement, const char *value, bool good)
{
    char script[2000];
    const char *mark = strchr(statement, '@');
    CHECK(mark);
    snprintf(script, sizeof script, "%s%.*s%s%s\n", before, (int)(mark - statement), statement, value, mark + 1);
    Picture picture = picture_run("stability_argument.lua", script, NULL);
    int line = 1;
    for (const char *p = before; *p; p++) line += *p == '\n';
    if (good)
        row_trial(row, picture.err.kind == ERR_NONE, "%.70s: %.80s", statement, picture.err.text);
    else
        expect(row, &picture, ERR_SCENE, "stability_argument.lua", line, ": ", script + strlen(before));
    picture_free(&picture);
}

static bool takes_any_number(const char *kind)
{
    static const char *const kinds[] = {"number", "positive", "least0", "not0", "share", "angle"};
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        if (strcmp(kinds[i], kind) == 0) return true;
    return false;
}

static void bad_calls(Row *row, const char *before, const char *kind, const char *statement, const char *values)
{
    static const char *const never[] = {"0/0", "1/0", "-1/0"};
    for (size_t i = 0; i < sizeof never / sizeof *never; i++) call(row, before, statement, never[i], false);
    char its_kind[20], value[40];
    for (const char *p = values; sscanf(p, "%19s %39[^\n]", its_kind, value) == 2; p = strchr(p, '\n') + 1) {
        bool is_number = strcmp(its_kind, "number") == 0;
        if (is_number ? takes_any_number(kind) : strcmp(its_kind, kind) == 0) call(row, before, statement, value, false);
    }
    if (!strstr(statement, "none.grammar")) call(row, before, statement, "1", true);
}

static void arguments(Row *row, uint64_t trials)
{
    (void)trials;
    char *text = test_read("tests/data/arguments.txt", NULL), *rest = text;
    const char *before = part_of(&rest), *calls = part_of(&rest);
    char kind[20], statement[300];
    for (const char *p = calls; sscanf(p, "%19s %299[^\n]", kind, statement) == 2; p = strchr(p, '\n') + 1)
        bad_calls(row, before, kind, statement, rest);
    free(text);
}

/* ---- 42: mountains ---- */

enum { MOUNTAIN_LIMIT = 9, WIDTH = 96, HEIGHT = 72 };

static const double roughnesses[] = {0, 5e-324, 0.3, 1e308, DBL_MAX};

/* n halvings in a row are exact for numbers of 53 - n bits: of heights n are cut off, below the peak's first; of sides, in
 * which the peak is a halving more, n + 1. */
static double cut_off(double greatest, uint32_t halvings) { return ldexp(greatest, (int)halvings - 52); }

/* Without roughness nothing is lifted: all lies on the pyramid, but for what the raised peak takes along, a 1/100 of its
 * height at most. */
static void judge_smooth(Row *row, const Mesh *m, double w, double h, double l, uint32_t n)
{
    double below = h * DBL_EPSILON * 16 + cut_off(1.01 * h, n);
    for (uint32_t i = 0; i < m->position_count; i++) {
        Vec3 p = m->position[i];
        Quad across = q_abs(2 * (Quad)p.x / w - 1), along = q_abs(2 * (Quad)p.z / l + 1);
        Quad off = p.y - h * (1 - q_max(across, along));
        row_trial(row, across <= 1 && along <= 1 && off >= -below && off <= h * (Quad)0.010000001,
                  "%u subdivisions: vertex %u is %g off the pyramid", n, i, (double)off);
    }
}

/* With a roughness of 1e308 each midpoint is lifted by 3/2 of its edge. Of one subdivision the edges are the pyramid's. */
static void judge_roughest(Row *row, const Mesh *m, double w, double h, double l)
{
    const Vec3 corner[5] = {{0, 0, 0}, {0, 0, -l}, {w, 0, -l}, {w, 0, 0}, {0.5 * w, h, -0.5 * l}};
    for (int face = 0; face < 4; face++) {
        const Vec3 *v[3] = {&corner[(face + 1) % 4], &corner[face], &corner[4]};
        for (int k = 1; k < 3; k++) {
            const Vec3 *a = v[k], *b = v[(k + 1) % 3];
            Quad x = (Quad)a->x - b->x, y = (Quad)a->y - b->y, z = (Quad)a->z - b->z;
            Quad lift = q_sqrt(x * x + y * y + z * z) * 3 / 2, got = m->position[5 + 3 * face + k].y - ((Quad)a->y + b->y) / 2;
            row_trial(row, q_abs(q_abs(got) - lift) <= 8 * DBL_EPSILON * (lift + q_abs(a->y)),
                      "midpoint %d of face %d is lifted by %g, not %g", k, face, (double)got, (double)lift);
        }
    }
}

/* Of the base's area, what roundings of midpoints may make of a standing face's, and much less than 4^-9. */
#define STANDING 0x1p-40

static void judge_mountain(Row *row, Rng *rng, double roughness, uint32_t n)
{
    double w = uniform(rng, 0.5, 4), h = uniform(rng, 0.5, 4), l = uniform(rng, 0.5, 4), peak = 0;
    Err err;
    Mesh *m = mountain_create(w, h, l, roughness, n, rng_u32(rng), &peak, &err);
    if (!row_trial(row, m != NULL, "%u subdivisions: %.100s", n, m ? "" : err.text)) return;
    double asked_w = w, asked_l = l;
    w = m->position[3].x, l = -m->position[1].z;
    row_trial(row, fabs(w - asked_w) <= cut_off(asked_w, n + 1) && fabs(l - asked_l) <= cut_off(asked_l, n + 1),
              "%u subdivisions: %a x %a, not %a x %a", n, w, l, asked_w, asked_l);
    uint64_t faces = 4, seen_faces = 4, seen = 0;
    for (uint32_t i = 0; i < n; i++) faces *= 6, seen_faces *= 4;
    /* Four of the six new faces of one share its area seen from above, two stand on edges and have none, nor do faces of
     * these; those have no area at all, and are dropped, only where a lift is lost in rounding or stopped by the range. */
    Quad area = 0;
    bool lifts = roughness > 0x1p-40 && roughness < 1e300;
    for (uint32_t i = 0; i < m->triangle_count; i++) {
        const Vec3 *p[3];
        for (int k = 0; k < 3; k++) p[k] = &m->position[m->triangle[i][k]];
        Quad its = ((Quad)p[1]->z - p[0]->z) * ((Quad)p[2]->x - p[0]->x) - ((Quad)p[1]->x - p[0]->x) * ((Quad)p[2]->z - p[0]->z);
        area += its;
        seen += its > STANDING * w * l;
    }
    bool all = seen == seen_faces && (lifts ? m->triangle_count == faces : m->triangle_count <= faces);
    row_trial(row, all && q_abs(area / 2 - (Quad)w * l) <= 64 * DBL_EPSILON * w * l,
              "roughness %g, %u subdivisions: %u faces, %u seen, area %.17g of %.17g", roughness, n, m->triangle_count,
              (unsigned)seen, (double)area / 2, w * l);
    double greatest = -INFINITY;
    for (uint32_t i = 0; i < m->position_count; i++) {
        Vec3 p = m->position[i];
        greatest = fmax(greatest, p.y);
        row_trial(row, isfinite(p.x) && isfinite(p.y) && isfinite(p.z), "roughness %g, %u subdivisions: vertex %u",
                  roughness, n, i);
    }
    row_trial(row, peak == greatest, "roughness %g, %u subdivisions: peak %g of %g", roughness, n, peak, greatest);
    if (roughness < 1e-300) judge_smooth(row, m, w, h, l, n);
    if (roughness > 1e300 && n == 1) judge_roughest(row, m, w, h, l);
    mesh_destroy(m);
}

/* Seen from far above no ray through the base may find a hole, and what it finds has one of the three colours of heights.
 * The eye is over the middle: rays are in the very planes of edges on which corners of small faces lie. */
static const char mountain_scene[] =
    "local roughness, n = tonumber(arg[1]), math.tointeger(tonumber(arg[2]))\n"
    "local m = gr.fractal_mountain('m', {2, 1, 2}, roughness, n, n)\n"
    "gr.render(m, 'o.png', 96, 72, {1, 1e5, -1}, {0, -1, 0}, {0, 0, -1}, 2 * math.deg(math.atan(0.8e-5)), {1, 1, 1}, {},\n"
    "  {background = {0, 0, 1}})\n";

static bool is_height_colour(const uint8_t *rgb)
{
    static const double colours[3][3] = {{0, 0.6, 0}, {0.8588, 0.6745, 0.2039}, {0.7, 0.7, 0.7}};
    for (int i = 0; i < 3; i++)
        if (fabs(rgb[0] - 255 * colours[i][0]) <= 1 && fabs(rgb[1] - 255 * colours[i][1]) <= 1 &&
            fabs(rgb[2] - 255 * colours[i][2]) <= 1)
            return true;
    return false;
}

static void draw_mountain(Row *row, double roughness, uint32_t n)
{
    char r[32], count[16], what[80];
    snprintf(r, sizeof r, "%a", roughness);
    snprintf(count, sizeof count, "%u", n);
    snprintf(what, sizeof what, "roughness %g, %u subdivisions", roughness, n);
    Picture p = picture_run("stability_mountain.lua", mountain_scene, (const char *const[]){r, count, NULL});
    expect(row, &p, ERR_LIMIT, "stability_mountain.lua", 2, n > MOUNTAIN_LIMIT ? "the limit is 9" : NULL, what);
    /* 0.8 either way is within the base. */
    for (uint32_t y = 0; p.rgb && y < HEIGHT; y++)
        for (uint32_t x = (WIDTH - HEIGHT) / 2; x < (WIDTH + HEIGHT) / 2; x++) {
            const uint8_t *rgb = p.rgb + 3 * (y * WIDTH + x);
            row_trial(row, is_height_colour(rgb), "%s: pixel %u,%u: %d,%d,%d", what, x, y, rgb[0], rgb[1], rgb[2]);
        }
    picture_free(&p);
}

/* `most` is the finest that is made; 8 takes seconds, 9 takes 40 million faces. */
static void mountains(Row *row, uint64_t most)
{
    Rng rng = rng_seed(42, 1);
    for (size_t i = 0; i < sizeof roughnesses / sizeof *roughnesses; i++) {
        for (uint32_t n = 0; n <= most; n++) judge_mountain(row, &rng, roughnesses[i], n);
        for (uint32_t n = 0; n <= 12; n++)
            if (n <= most || n > MOUNTAIN_LIMIT) draw_mountain(row, roughnesses[i], n);
    }
}

/* ---- 42: grammars ---- */

static const char grammar_scene[] =
    "local s = gr.sphere('s')\n"
    "s:set_material(gr.material({1, 1, 1}, {0, 0, 0}, 1))\n"
    "s:scale(1, 1, 1)\n"
    "local t = gr.tree('t', 'stability.grammar', math.tointeger(tonumber(arg[1])), s, s)\n"
    "gr.render(t, 'o.png', 96, 72, {0, 1, 20}, {0, 0, -1}, {0, 1, 0}, 10, {1, 1, 1}, {}, {background = {0, 0, 0}})\n";

static const struct {
    const char *name, *grammar, *depth;
    ErrKind kind;           /* ERR_NONE: an image */
    int line;
    const char *text;
    double radius;          /* of the one ball drawn, its centre at this height too; 0: nothing is drawn */
} grammars[] = {
    {"no rule", "F\ntrunk F 1 1 1\n", "40", ERR_NONE, 0, NULL, 1},
    {"neither rule nor meaning", "F\n", "40", ERR_INPUT, 1, "'F' has neither a meaning nor a rule", 0},
    {"empty", "", "40", ERR_INPUT, 1, "no start symbol", 0},
    {"cyclic, one for one", "F\ntrunk F 1 1 1\nF 1 G\nG 1 F\n", "40", ERR_NONE, 0, NULL, 1},
    {"cyclic, no meaning at the end", "F\ntrunk F 1 1 1\nF 1 G\nG 1 F\n", "41", ERR_NONE, 0, NULL, 0},
    {"certain to vanish", "X\nX 0 X X\n", "40", ERR_NONE, 0, NULL, 0},
    {"2^40 symbols", "F\ntrunk F 1 1 1\nF 1 F F\n", "40", ERR_LIMIT, 4, " objects, the limit by this machine's memory", 0},
    {"2^40 symbols of two that are cyclic", "F\ntrunk F 1 1 1\nF 1 G G\nG 1 F F\n", "40", ERR_LIMIT, 4, "limit", 0},
    {"2^60 symbols that only grow", "X\nX 1 X X\n", "60", ERR_LIMIT, 4, " symbols", 0},
    {"size 0", "F\ntrunk F 1 0 1\n", "1", ERR_INPUT, 2, "is no size", 0},
    {"sizes that overflow", "F\ntrunk F 1 1e308 1\nF 1 F F\n", "4", ERR_SCENE, 1, "reaches beyond the range of numbers", 0},
};

/* Pixels whose centre sees a ball of a radius at the same height, from 20 away: the eye is at height 1. */
static void judge_ball(Row *row, const Picture *p, double radius, const char *what)
{
    Quad s, c;
    q_sincos(10 * q_pi() / 360, &s, &c);
    for (int y = 0; p->rgb && y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            Quad dx = (2 * (x + (Quad)0.5) / WIDTH - 1) * s / c * WIDTH / HEIGHT, dy = (1 - 2 * (y + (Quad)0.5) / HEIGHT) * s / c;
            /* distance of the centre (0, r, 0) from the line: |(0, r - 1, -20) x d| / |d| */
            Quad up = (Quad)radius - 1, cx = -up + 20 * dy, cy = -20 * dx, cz = -up * dx;
            bool inside = radius > 0 && cx * cx + cy * cy + cz * cz < (Quad)radius * radius * (dx * dx + dy * dy + 1);
            const uint8_t *rgb = p->rgb + 3 * (y * WIDTH + x);
            row_trial(row, rgb[0] == (inside ? 255 : 0), "%.60s: pixel %d,%d: %d", what, x, y, rgb[0]);
        }
}

static void grammar_limits(Row *row, uint64_t trials)
{
    (void)trials;
    for (size_t i = 0; i < sizeof grammars / sizeof *grammars; i++) {
        test_file("stability.grammar", grammars[i].grammar);
        Picture p = picture_run("stability_grammar.lua", grammar_scene, (const char *const[]){grammars[i].depth, NULL});
        const char *file = grammars[i].kind == ERR_INPUT ? "stability.grammar" : "stability_grammar.lua";
        expect(row, &p, grammars[i].kind, file, grammars[i].line, grammars[i].text, grammars[i].name);
        if (grammars[i].kind == ERR_NONE) judge_ball(row, &p, grammars[i].radius, grammars[i].name);
        picture_free(&p);
    }
}

const StabilityCase limit_cases[] = {
    {12, "bad arguments: the script's line", "analytic", "", 1, 1, 1, arguments},
    {42, "mountains, roughness 0 ... 1e308", "analytic", "", 4, 7, 9, mountains},
    {42, "grammars without rule, cyclic, depth 40", "analytic", "", 1, 1, 1, grammar_limits},
    {0},
};
