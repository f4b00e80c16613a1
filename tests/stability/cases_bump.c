/* Bumped normals: a square in the plane y = 0 with waves, shaded by SPEC 5 in quad. */
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "stability/quad_scene.h"
#include "stability/ray_check.h"
#include "support/test_file.h"

enum { WIDTH = 64, HEIGHT = 48, ANGLES = 8 };

#define LEVEL (1 / 255.0)
#define FAR_WALL 100.0

/* Of a row's pixels, those where the waves end, a normal or a mirror ray is in the surface, or walls meet, within roundings. */
#define UNDECIDED 0.001

typedef struct {
    double u0, v0, periods, period, eye[3], aim[3], light[3], scale[3];
    double tilt_deg;     /* of the vertices' normals, about x */
    bool flat_uv;        /* all corners have the same texture coordinates: no gradient */
    bool has_normals;
    bool mirror;         /* of share 1/2 in a room whose walls shine; otherwise lit by a light */
} Waves;

typedef struct { Quad v[3]; } Q3;

static Quad dot(Q3 a, Q3 b) { return a.v[0] * b.v[0] + a.v[1] * b.v[1] + a.v[2] * b.v[2]; }
static Q3 at(Q3 a, Quad t, Q3 b) { return (Q3){{a.v[0] + t * b.v[0], a.v[1] + t * b.v[1], a.v[2] + t * b.v[2]}}; }
static Q3 unit(Q3 a) { return at((Q3){{0, 0, 0}}, 1 / q_sqrt(dot(a, a)), a); }

static Q3 cross(Q3 a, Q3 b)
{
    return (Q3){{a.v[1] * b.v[2] - a.v[2] * b.v[1], a.v[2] * b.v[0] - a.v[0] * b.v[2],
                 a.v[0] * b.v[1] - a.v[1] * b.v[0]}};
}

static Q3 q3(const double v[3]) { return (Q3){{v[0], v[1], v[2]}}; }

static void turn_about_x(Quad angle, Q3 *n)
{
    Quad s, c, y = n->v[1], z = n->v[2];
    q_sincos(angle, &s, &c);
    n->v[1] = c * y - s * z;
    n->v[2] = s * y + c * z;
}

/* Red of the wall that a ray from p meets, and in *second that of the next one if the two are as good as equally far. */
static const double wall_red[6] = {0.1, 0.25, 0.4, 0.55, 0.7, 0.85};

static Quad wall(Q3 p, Q3 d, Quad *second)
{
    Quad t[6], nearest = -1;
    int hit = 0;
    for (int i = 0; i < 6; i++) {
        int k = i / 2;
        Quad side = i % 2 ? FAR_WALL : -FAR_WALL;
        t[i] = d.v[k] * side > 0 ? (side - p.v[k]) / d.v[k] : -1;
        if (t[i] > 0 && (nearest < 0 || t[i] < nearest)) nearest = t[i], hit = i;
    }
    *second = wall_red[hit];
    for (int i = 0; i < 6; i++)
        if (i != hit && t[i] > 0 && t[i] < nearest * (1 + 1e-6)) *second = wall_red[i];
    return wall_red[hit];
}

/* What a pixel may show in red. */
typedef struct { Quad lo, hi; } Range;

static void include(Range *r, Quad x)
{
    r->lo = q_min(r->lo, x);
    r->hi = q_max(r->hi, x);
}

/* The colour at p, whose object-space shading normal is n: the geometric one is +-y, on the viewer's side. */
static void shade(const Waves *w, Q3 p, Q3 d, Q3 n, Range *range)
{
    Q3 ng = {{0, d.v[1] > 0 ? -1 : 1, 0}};
    for (int k = 0; k < 3; k++) n.v[k] /= w->scale[k];
    n = unit(n);
    Quad facing = dot(n, ng);
    for (int side = -1; side <= 1; side += 2) {
        if (q_abs(facing) > 1e-6 && side * facing < 0) continue;
        Q3 m = at((Q3){{0, 0, 0}}, side, n);
        if (!w->mirror) {
            Q3 l = unit(at(q3(w->light), -1, p));
            include(range, (Quad)0.1 + (Quad)0.75 * q_max(0, dot(m, l)));
            continue;
        }
        Q3 r = at(d, -2 * dot(d, m), m);
        Quad leaving = dot(r, ng), limit = 1e-6 * q_sqrt(dot(d, d)), other;
        for (int fallback = 0; fallback < 2; fallback++) {
            if (fallback ? leaving > limit : leaving < -limit) continue;
            Q3 way = fallback ? at(d, -2 * dot(d, ng), ng) : r;
            include(range, (wall(p, way, &other) + (Quad)0.1) / 2);
            include(range, (other + (Quad)0.1) / 2);
        }
    }
}

/* False where the pixel doesn't see the square. */
static bool pixel(const Waves *w, Quad x, Quad y, Range *range, bool *decided)
{
    Q3 eye = q3(w->eye), forward = unit(at(q3(w->aim), -1, eye)), right, up;
    right = unit(cross(forward, (Q3){{0, 0, -1}}));
    up = cross(right, forward);
    Quad s, c;
    q_sincos(30 * q_pi() / 360, &s, &c);
    Q3 d = at(at(forward, (2 * x / WIDTH - 1) * s / c * WIDTH / HEIGHT, right), (1 - 2 * y / HEIGHT) * s / c, up);
    if (d.v[1] * eye.v[1] >= 0) return false;
    Q3 p = at(eye, -eye.v[1] / d.v[1], d);
    Quad ox = p.v[0] / w->scale[0], oz = p.v[2] / w->scale[2];
    if (q_abs(ox) > (Quad)0.999 || q_abs(oz) > (Quad)0.999) return false;
    Quad u = w->flat_uv ? (Quad)0.25 : (ox + 1) / 2, v = w->flat_uv ? (Quad)0.25 : (1 - oz) / 2;
    Quad du = u - w->u0, dv = v - w->v0, far = q_sqrt(du * du + dv * dv), turns = far / w->period;
    Q3 n = {{0, 1, 0}};
    if (w->has_normals) turn_about_x(w->tilt_deg * q_pi() / 180, &n);
    *range = (Range){1e9, -1e9};
    Quad edge = 1e-12 * (1 + w->periods);
    bool flat = !(far > 0) || turns > w->periods - edge || far < 1e-12;
    bool bumped = far > 0 && turns < w->periods + edge;
    if (flat) shade(w, p, d, n, range);
    /* u and v are off by a few roundings, the phase by as many over the period; where that is much the angle may be any. */
    Quad doubt = 2 * q_pi() * 16 * DBL_EPSILON * (1 + far) / w->period;
    int most = !bumped ? -1 : doubt < 1 ? 1 : ANGLES;
    for (int i = -most; i <= most; i++) {
        Quad angle = i / (Quad)ANGLES;
        if (doubt < 1) {
            Quad phase = 2 * q_pi() * (turns - (long long)turns) + i * doubt, sine;
            q_sincos(phase > 4 ? phase - 2 * q_pi() : phase, &sine, &angle);
        }
        Q3 bent = n;
        turn_about_x(angle, &bent);
        shade(w, p, d, bent, range);
    }
    *decided = range->hi - range->lo < LEVEL / 2 || doubt > 1e-4;
    return true;
}

static void write_square(const Waves *w)
{
    char obj[700], normal[80] = "";
    double a = w->tilt_deg * (M_PI / 180);
    if (w->has_normals) snprintf(normal, sizeof normal, "vn 0 %.17g %.17g\n", cos(a), sin(a));
    const char *face = w->has_normals ? "f 1/1/1 2/2/1 3/3/1 4/4/1\n" : "f 1/1 2/2 3/3 4/4\n";
    snprintf(obj, sizeof obj, "v -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\n%s%s%s",
             w->flat_uv ? "vt 0.25 0.25\nvt 0.25 0.25\nvt 0.25 0.25\nvt 0.25 0.25\n" : "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n",
             normal, face);
    test_file("stability_bump.obj", obj);
}

static const char script_format[] =
    "local root, m = gr.node('root'), gr.mesh('m', 'stability_bump.obj')\n"
    "m:set_material(gr.reflective_material({1, 1, 1}, {0, 0, 0}, 1, %s))\n"
    "m:mesh_add_bumps({%a, %a}, %a, %a)\n"
    "m:scale(%a, %a, %a)\n"
    "root:add_child(m)\n"
    "local red = {0.1, 0.25, 0.4, 0.55, 0.7, 0.85}\n"
    "for i = 1, %d do\n"
    "  local at, size, k = {-110, -110, -110}, {220, 220, 220}, (i + 1) // 2\n"
    "  at[k], size[k] = i %% 2 == 0 and 100 or -110, 10\n"
    "  local wall = gr.cube('wall')\n"
    "  wall:set_material(gr.material({10 * red[i], 0, 0}, {0, 0, 0}, 1))\n"
    "  wall:scale(size[1], size[2], size[3])\n"
    "  wall:translate(at[1], at[2], at[3])\n"
    "  root:add_child(wall)\n"
    "end\n"
    "gr.render(root, 'o.png', 64, 48, {%a, %a, %a}, {%a, %a, %a}, {0, 0, -1}, 30, {0.1, 0, 0}, {%s}, {max_depth = 1})\n";

static Picture draw(const Waves *w)
{
    char script[2048], light[200] = "";
    write_square(w);
    if (!w->mirror)
        snprintf(light, sizeof light, "gr.light({%a, %a, %a}, {0.75, 0, 0}, {1, 0, 0})", w->light[0], w->light[1],
                 w->light[2]);
    snprintf(script, sizeof script, script_format, w->mirror ? "0.5" : "0", w->u0, w->v0, w->periods, w->period,
             w->scale[0], w->scale[1], w->scale[2], w->mirror ? 6 : 0, w->eye[0], w->eye[1], w->eye[2],
             w->aim[0] - w->eye[0], w->aim[1] - w->eye[1], w->aim[2] - w->eye[2], light);
    return picture_run("stability_bump.lua", script, NULL);
}

static Waves random_waves(Rng *rng, uint64_t number)
{
    static const double odd_periods[] = {1e-300, 5e-324, 1e-12, 1e-3, 1e300};
    Waves w = {.u0 = uniform(rng, -0.2, 1.2), .v0 = uniform(rng, -0.2, 1.2), .scale = {1, 1, 1}};
    w.period = number % 4 == 3 ? odd_periods[number / 4 % 5] : pow(10, uniform(rng, -2, 1));
    w.periods = number % 8 == 7 ? 1e308 : number % 16 == 1 ? 0 : uniform(rng, 0, 20);
    w.flat_uv = number % 8 == 2;
    if (number % 16 == 2) w.u0 = w.v0 = 0.25;
    if (number % 32 == 4) w.u0 = -1e300;
    w.has_normals = number % 2;
    w.tilt_deg = uniform(rng, -100, 100);
    w.mirror = number / 2 % 3 == 0;
    for (int k = 0; k < 3; k++) {
        if (number / 2 % 2) w.scale[k] = pow(2, uniform(rng, -1, 2)) * (rng_u32(rng) % 2 ? 1 : -1);
        w.aim[k] = k == 1 ? 0 : uniform(rng, -0.5, 0.5);
        w.eye[k] = uniform(rng, -3, 3);
        w.light[k] = uniform(rng, -5, 5);
    }
    w.eye[1] = (rng_u32(rng) % 4 ? 1 : -1) * pow(10, uniform(rng, -2, 0.5));
    return w;
}

static void waves(Row *row, uint64_t trials)
{
    Rng rng = rng_seed(40, 1);
    uint64_t undecided = 0;
    for (uint64_t i = 0; row->trials < trials; i++) {
        Waves w = random_waves(&rng, i);
        Picture picture = draw(&w);
        if (!picture.rgb) row_trial(row, false, "picture %llu: %.120s", (unsigned long long)i, picture.err.text);
        for (uint32_t y = 0; picture.rgb && y < HEIGHT; y++)
            for (uint32_t x = 0; x < WIDTH; x++) {
                Range range;
                bool decided = true;
                if (!pixel(&w, x + (Quad)0.5, y + (Quad)0.5, &range, &decided)) continue;
                uint8_t red = picture.rgb[3 * (y * WIDTH + x)];
                undecided += !decided;
                row_trial(row, red >= 255 * (double)range.lo - 1 && red <= 255 * (double)range.hi + 1,
                          "picture %llu, period %g, periods %g%s%s: pixel %u,%u: %d, not %.2f ... %.2f",
                          (unsigned long long)i, w.period, w.periods, w.mirror ? ", mirror" : "",
                          w.has_normals ? ", normals" : "", x, y, red, 255 * (double)range.lo, 255 * (double)range.hi);
            }
        picture_free(&picture);
    }
    quad_scene_decided(row, undecided, UNDECIDED);
}

const StabilityCase bump_cases[] = {
    {40, "bumps: below the horizon, period 1e-300", "quad", "", 50000, 1000000, 10000000, waves},
    {0},
};
