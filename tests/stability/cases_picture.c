/* Whole pictures: a scene that is scaled, moved, mirrored or turned there and back must look the same. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "stability/picture.h"

/* Pixels that may differ, by a level, where the two pictures can't be rounded alike. */
enum { ROUNDED = 8 };

/* arg: the scene's kind, scale, translation, mirroring (0: none, 1: x, 3: all axes), nested turns, and what is scaled: the
 * "whole" by a node above it, or "each" solid, operand and vertex by itself. */
static const char moved_scene[] =
    "local kind, s, t, mirror, turns = arg[1], tonumber(arg[2]), tonumber(arg[3]), arg[4], tonumber(arg[5])\n"
    "local own = arg[6] == 'each' and s or 1\n"
    "local sign = {mirror ~= '0' and -1 or 1, mirror == '3' and -1 or 1, mirror == '3' and -1 or 1}\n"
    "local function direction(x, y, z) return {sign[1] * x, sign[2] * y, sign[3] * z} end\n"
    "local function point(x, y, z)\n"
    "  return {sign[1] * x * s + t, sign[2] * y * s + t, sign[3] * z * s + t}\n"
    "end\n"
    "local red = gr.material({0.8, 0.4, 0.2}, {0.3, 0.3, 0.3}, 20)\n"
    "local green = gr.material({0.2, 0.7, 0.4}, {0.2, 0.2, 0.2}, 5)\n"
    "local mirrored = gr.reflective_material({0.5, 0.5, 0.8}, {0.4, 0.4, 0.4}, 30, 0.6)\n"
    "local root, world = gr.node('root'), gr.node('world')\n"
    "root:add_child(world)\n"
    "world:scale(sign[1] * s / own, sign[2] * s / own, sign[3] * s / own)\n"
    "world:translate(t, t, t)\n"
    "local axes, top = {'x', 'y', 'z'}, world\n"
    "for i = 1, 2 * turns do\n"
    "  local j = i <= turns and i or 2 * turns + 1 - i\n"
    "  local node = gr.node('turn')\n"
    "  node:rotate(axes[j % 3 + 1], (i <= turns and 1 or -1) * (j * 7.3 % 360))\n"
    "  top:add_child(node)\n"
    "  top = node\n"
    "end\n"
    "local function place(node, x, y, z)\n"
    "  node:translate(x * own, y * own, z * own)\n"
    "  top:add_child(node)\n"
    "end\n"
    "local function solid(node, material)\n"
    "  node:scale(own, own, own)\n"
    "  if material then node:set_material(material) end\n"
    "  return node\n"
    "end\n"
    "local function add(node, material, x, y, z) place(solid(node, material), x, y, z) end\n"
    "local function floor(material)\n"
    "  local node = gr.cube('floor')\n"
    "  node:scale(16, 0.5, 16)\n"
    "  add(node, material, -8, -2, -8)\n"
    "end\n"
    "if kind == 'sphere' then\n"
    "  top:add_child(solid(gr.nh_sphere('s', {0, 0, 0}, 1), red))\n"
    "elseif kind == 'primitive' then\n"
    "  add(gr.sphere('s'), red, -2, 0.25, 0)\n"
    "  add(gr.cylinder('c'), green, 2, 0.5, -1)\n"
    "  add(gr.cone('k'), red, 0.125, 1.5, 1)\n"
    "  local ring = gr.torus('t', 0.375)\n"
    "  ring:rotate('x', 50)\n"
    "  add(ring, green, 0, 1, -2)\n"
    "  floor(green)\n"
    "elseif kind == 'csg' then\n"
    "  local hole = gr.cylinder('b')\n"
    "  hole:scale(0.5, 2, 0.5)\n"
    "  hole:rotate('x', 60)\n"
    "  local box = gr.cube('a')\n"
    "  box:scale(2, 2, 2)\n"
    "  box:translate(-1, -1, -1)\n"
    "  local ball = gr.sphere('ball')\n"
    "  ball:scale(1.25, 1.25, 1.25)\n"
    "  local body = gr.intersect('i', gr.diff('d', solid(box, red), solid(hole)), solid(ball, green))\n"
    "  body:rotate('y', 30)\n"
    "  place(body, 0, 0.25, 0)\n"
    "  floor(green)\n"
    "elseif kind == 'mesh' then\n"
    "  local points, faces, n = {}, {}, 12\n"
    "  for i = 0, n do\n"
    "    for j = 0, 2 * n - 1 do\n"
    "      local a, b = math.pi * i / n, math.pi * j / n\n"
    "      local r = 1.5 * own\n"
    "      points[#points + 1] = {math.sin(a) * math.cos(b) * r, math.cos(a) * r, math.sin(a) * math.sin(b) * r}\n"
    "      if i < n then\n"
    "        local k, l = i * 2 * n + j, i * 2 * n + (j + 1) % (2 * n)\n"
    "        faces[#faces + 1] = {k, l, l + 2 * n}\n"
    "        faces[#faces + 1] = {k, l + 2 * n, k + 2 * n}\n"
    "      end\n"
    "    end\n"
    "  end\n"
    "  local m = gr.mesh('m', points, faces)\n"
    "  m:rotate('z', 20)\n"
    "  m:set_material(red)\n"
    "  place(m, 0.25, 0.5, 0)\n"
    "  floor(green)\n"
    "elseif kind == 'mountain' then\n"
    "  place(gr.fractal_mountain('m', {8 * own, 4 * own, 8 * own}, 0.2, 3, 5), -4, -1.5, 4)\n"
    "  floor(green)\n"
    "else\n"
    "  add(gr.sphere('s'), mirrored, -1.5, 0.25, 0)\n"
    "  add(gr.sphere('s'), red, 1.25, 0, 0.5)\n"
    "  floor(mirrored)\n"
    "end\n"
    "gr.render(root, 'o.png', 96, 72, point(1, 3, 9), direction(-0.125, -0.3125, -1), direction(0, 1, 0), 40,\n"
    "  {0.2, 0.2, 0.25}, {gr.light(point(5, 9, 6), {0.8, 0.8, 0.7}, {0.5, 0.03125 / s, 0.001953125 / s / s})})\n";

/* The last, whose colours have borders that any rounding moves, only where nothing is rounded. */
static const char *const kinds[] = {"primitive", "csg", "mesh", "mirror", "mountain"};
enum { ALL_KINDS = sizeof kinds / sizeof *kinds, KINDS = ALL_KINDS - 1 };

static Picture moved(const char *kind, double scale, double translation, const char *mirror, unsigned turns, const char *what)
{
    char s[64], t[64], n[16];
    snprintf(s, sizeof s, "%a", scale);
    snprintf(t, sizeof t, "%a", translation);
    snprintf(n, sizeof n, "%u", turns);
    return picture_run("stability_moved.lua", moved_scene, (const char *const[]){kind, s, t, mirror, n, what, NULL});
}

static void compare_moved(Row *row, const char *kind, double scale, double translation, const char *mirror,
                          unsigned turns, unsigned allowed)
{
    char what[160];
    snprintf(what, sizeof what, "%s * %g + %g, mirror %s, %u turns", kind, scale, translation, mirror, turns);
    Picture a = moved(kind, 1, 0, "0", 0, "whole"), b = moved(kind, scale, translation, mirror, turns, "whole");
    picture_compare(row, &a, &b, *mirror != '0', allowed, what);
    picture_free(&a);
    picture_free(&b);
}

/* The whole scene in one, and all that is in it one by one. */
static void compare_scaled(Row *row, const char *kind, double scale, unsigned allowed)
{
    char what[160];
    compare_moved(row, kind, scale, 0, "0", 0, allowed);
    snprintf(what, sizeof what, "%s * %g, each by itself", kind, scale);
    Picture a = moved(kind, 1, 0, "0", 0, "whole"), b = moved(kind, scale, 0, "0", 0, "each");
    picture_compare(row, &a, &b, false, allowed, what);
    picture_free(&a);
    picture_free(&b);
}

/* The exponents from -most to most that `pictures` are spread over, both ends among them. */
static int exponent(uint64_t i, uint64_t pictures, int most)
{
    return (int)lround(-most + 2.0 * most * (double)i / (double)(pictures - 1));
}

static uint64_t pictures_of(uint64_t trials, uint64_t kind_count, int values)
{
    uint64_t n = trials / (96 * 72) / kind_count;
    return n < 2 ? 2 : n > (uint64_t)values ? (uint64_t)values : n;
}

static void sphere_of_any_radius(Row *row, uint64_t trials)
{
    uint64_t n = pictures_of(trials, 1, 301);
    for (uint64_t i = 0; i < n; i++)
        compare_moved(row, "sphere", pow(10, exponent(i, n, 150)), 0, "0", 0, ROUNDED);
}

static void power_of_two(Row *row, uint64_t trials)
{
    uint64_t n = pictures_of(trials, 2 * ALL_KINDS, 601);
    for (uint64_t i = 0; i < n; i++)
        for (int k = 0; k < ALL_KINDS; k++) compare_scaled(row, kinds[k], ldexp(1, exponent(i, n, 300)), 0);
}

static void power_of_ten(Row *row, uint64_t trials)
{
    uint64_t n = pictures_of(trials, 2 * KINDS, 25);
    for (uint64_t i = 0; i < n; i++)
        for (int k = 0; k < KINDS; k++) compare_scaled(row, kinds[k], pow(10, exponent(i, n, 12)), ROUNDED);
}

static void translated(Row *row, uint64_t trials)
{
    uint64_t n = pictures_of(trials, KINDS, 27);
    for (uint64_t i = 0; i < n; i++)
        for (int k = 0; k < KINDS; k++)
            compare_moved(row, kinds[k], 1, ldexp(1, (int)(26 - i * 26 / (n - 1))), "0", 0, ROUNDED);
}

static void mirrored(Row *row, uint64_t trials)
{
    (void)trials;
    for (int k = 0; k < KINDS; k++) {
        compare_moved(row, kinds[k], 1, 0, "1", 0, ROUNDED);
        compare_moved(row, kinds[k], 1, 0, "3", 0, ROUNDED);
    }
}

static void turned(Row *row, uint64_t trials)
{
    (void)trials;
    for (int k = 0; k < KINDS; k++) compare_moved(row, kinds[k], 1, 0, "0", 1000, ROUNDED);
}

/* arg: size of the mesh's own coordinates, "once" (baked), "twice" (instances), "csg". */
static const char undone_scene[] =
    "local s, use = tonumber(arg[1]), arg[2]\n"
    "local points, root = {}, gr.node('root')\n"
    "local faces = {{0,3,2,1}, {4,5,6,7}, {0,1,5,4}, {1,2,6,5}, {2,3,7,6}, {3,0,4,7}}\n"
    "for i, p in ipairs{{-1,-1,-1}, {1,-1,-1}, {1,1,-1}, {-1,1,-1}, {-1,-1,1}, {1,-1,1}, {1,1,1}, {-1,1,1}} do\n"
    "  points[i] = {p[1] * s, p[2] * s, p[3] * s}\n"
    "end\n"
    "local m, red = gr.mesh('m', points, faces), gr.material({0.8, 0.4, 0.2}, {0.3, 0.3, 0.3}, 20)\n"
    "m:set_material(red)\n"
    "m:scale(1 / s, 1 / s, 1 / s)\n"
    "m:rotate('y', 30)\n"
    "if use == 'csg' then\n"
    "  local b = gr.sphere('b')\n"
    "  b:translate(1, 1, 1)\n"
    "  root:add_child(gr.diff('d', m, b))\n"
    "else\n"
    "  root:add_child(m)\n"
    "end\n"
    "if use == 'twice' then\n"
    "  local second = gr.node('second')\n"
    "  second:translate(3, 0, 0)\n"
    "  second:add_child(m)\n"
    "  root:add_child(second)\n"
    "end\n"
    "gr.render(root, 'o.png', 96, 72, {1, 3, 9}, {-0.125, -0.3125, -1}, {0, 1, 0}, 40, {0.2, 0.2, 0.2},\n"
    "  {gr.light({5, 9, 6}, {0.8, 0.8, 0.8}, {1, 0, 0})})\n";

static void mesh_size_undone(Row *row, uint64_t trials)
{
    (void)trials;
    static const char *const sizes[] = {"1e10", "1e-10", "1e30", "1e-30", "1e100", "1e-100", "1e200", "1e-200"};
    static const char *const uses[] = {"once", "twice", "csg"};
    for (size_t u = 0; u < sizeof uses / sizeof *uses; u++)
        for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
            char what[64];
            snprintf(what, sizeof what, "%s, %s", uses[u], sizes[i]);
            Picture a = picture_run("stability_undone.lua", undone_scene, (const char *const[]){"1", uses[u], NULL});
            Picture b =
                picture_run("stability_undone.lua", undone_scene, (const char *const[]){sizes[i], uses[u], NULL});
            picture_compare(row, &a, &b, false, ROUNDED, what);
            picture_free(&a);
            picture_free(&b);
        }
}

#define PICTURES(n) ((uint64_t)(n) * 96 * 72)

const StabilityCase picture_cases[] = {
    {2, "sphere of radius 1e-150 ... 1e150, per pixel", "metamorphic", "", PICTURES(7), PICTURES(301), PICTURES(301),
     sphere_of_any_radius},
    {7, "scene scaled by 2^k, k = -300 ... 300", "metamorphic", "", PICTURES(30), PICTURES(10 * 601),
     PICTURES(10 * 601), power_of_two},
    {8, "scene scaled by 10^k, k = -12 ... 12", "metamorphic",
     "POV-Ray, wrong pixels of 400x300: 1e-3 59, 1e-4 13,901, 1e5 2,209, 1e6 10,218", PICTURES(24), PICTURES(8 * 25),
     PICTURES(8 * 25), power_of_ten},
    {8, "mesh of size 1e-200 ... 1e200, scaled back", "metamorphic", "", PICTURES(24), PICTURES(24),
     PICTURES(24), mesh_size_undone},
    {9, "scene translated by 2^k, k = 0 ... 26", "metamorphic", "POV-Ray, by 1e10: 19,758 wrong pixels of 400x300",
     PICTURES(12), PICTURES(4 * 27), PICTURES(4 * 27), translated},
    {13, "scene scaled by -1, in x and in all axes", "metamorphic", "", PICTURES(8), PICTURES(8), PICTURES(8),
     mirrored},
    {14, "1000 nested rotations and their inverses", "metamorphic", "", PICTURES(4), PICTURES(4), PICTURES(4),
     turned},
    {0},
};
