#include "stability/quad_scene.h"

#include <stdlib.h>
#include <string.h>

#include "support/check.h"

/* A level of the picture; the colours and sums of the program are floats. */
#define LEVEL (1 / 255.0)
#define FLOAT_ROUNDING 0x1p-21

typedef struct { Quad v[3]; } Q3;

/* One way to see the scene: surfaces grown by one length, those that shade by another. */
typedef struct {
    const QuadScene *scene;
    Quad grown, shading_grown;
    bool opposed;     /* spheres shrink where boxes grow: roundings are each solid's own */
    Quad window;      /* crossings nearer than this to either end of a shadow segment don't shade */
    Quad tolerance;   /* grows with what the slack does to a colour */
} View;

typedef struct { Quad t; int solid; Q3 normal; } QuadHit;

static Q3 q3(const double v[3]) { return (Q3){{v[0], v[1], v[2]}}; }
static Quad dot(Q3 a, Q3 b) { return a.v[0] * b.v[0] + a.v[1] * b.v[1] + a.v[2] * b.v[2]; }
static Q3 at(Q3 a, Quad t, Q3 b) { return (Q3){{a.v[0] + t * b.v[0], a.v[1] + t * b.v[1], a.v[2] + t * b.v[2]}}; }
static Q3 sub(Q3 a, Q3 b) { return at(a, -1, b); }
static Quad length(Q3 a) { return q_sqrt(dot(a, a)); }

static Q3 scaled(Q3 a, Quad s) { return (Q3){{a.v[0] * s, a.v[1] * s, a.v[2] * s}}; }

/* The greatest component to 1 first, so that no square is out of range. */
static Q3 unit(Q3 a)
{
    Quad m = q_max(q_max(q_abs(a.v[0]), q_abs(a.v[1])), q_abs(a.v[2]));
    CHECK(m > 0);
    a = scaled(a, 1 / m);
    return scaled(a, 1 / length(a));
}

static Q3 cross(Q3 a, Q3 b)
{
    return (Q3){{a.v[1] * b.v[2] - a.v[2] * b.v[1], a.v[2] * b.v[0] - a.v[0] * b.v[2],
                 a.v[0] * b.v[1] - a.v[1] * b.v[0]}};
}

Quad q_pi(void) { return (Quad)0x1.921fb54442d18p+1 + (Quad)0x1.1a62633145c07p-53 - (Quad)0x1.f1976b7ed8fbcp-109; }

void q_sincos(Quad x, Quad *sine, Quad *cosine)
{
    Quad term = 1, s = 0, c = 0;
    for (int n = 0; n < 52; n += 4) {
        c += term;
        term *= x / (n + 1);
        s += term;
        term *= x / (n + 2);
        c -= term;
        term *= x / (n + 3);
        s -= term;
        term *= x / (n + 4);
    }
    *sine = s;
    *cosine = c;
}

void quad_set3(double out[3], double x, double y, double z) { out[0] = x, out[1] = y, out[2] = z; }
void quad_set_vec(double out[3], Vec3 v) { quad_set3(out, v.x, v.y, v.z); }

QuadSolid quad_sphere(double x, double y, double z, double radius)
{
    return (QuadSolid){.at = {x, y, z}, .size = {radius, radius, radius}, .kd = {0.8, 0.6, 0.4}};
}

QuadSolid quad_box(double x, double y, double z, double w, double h, double l)
{
    return (QuadSolid){.box = true, .at = {x, y, z}, .size = {w, h, l}, .kd = {0.4, 0.7, 0.5}};
}

void quad_look_at(QuadScene *s, Vec3 p) { quad_set3(s->view, p.x - s->eye[0], p.y - s->eye[1], p.z - s->eye[2]); }

void quad_add_light(QuadScene *s, Vec3 at, double brightness, double c0, double c1, double c2)
{
    QuadLight *l = &s->light[s->lights++];
    quad_set_vec(l->at, at);
    quad_set3(l->colour, brightness, brightness, brightness);
    quad_set3(l->falloff, c0, c1, c2);
}

/* ---- geometry ---- */

/* The two crossings of the line, and the axis of each on a box; false if it misses. */
static bool crossings(const QuadSolid *s, Quad grown, Q3 o, Q3 d, Quad t[2], int axis[2])
{
    if (!s->box) {
        Q3 from = sub(o, q3(s->at));
        Quad r = s->size[0] + grown, a = dot(d, d), along = dot(from, d) / a;
        Q3 nearest = at(from, -along, d);
        Quad rest = r * r - dot(nearest, nearest);
        if (r <= 0 || rest <= 0) return false;
        Quad half = q_sqrt(rest / a);
        t[0] = -along - half;
        t[1] = -along + half;
        return true;
    }
    bool first = true;
    for (int i = 0; i < 3; i++) {
        Quad lo = s->at[i] - grown, hi = (Quad)s->at[i] + s->size[i] + grown;
        if (d.v[i] == 0) {
            if (o.v[i] <= lo || o.v[i] >= hi) return false;
            continue;
        }
        Quad a = (lo - o.v[i]) / d.v[i], b = (hi - o.v[i]) / d.v[i];
        if (first || q_min(a, b) > t[0]) t[0] = q_min(a, b), axis[0] = i;
        if (first || q_max(a, b) < t[1]) t[1] = q_max(a, b), axis[1] = i;
        first = false;
    }
    return t[0] < t[1];
}

static Quad growth(const View *view, const QuadSolid *s, Quad grown) { return view->opposed && !s->box ? -grown : grown; }

static bool nearest(const View *view, Q3 o, Q3 d, Quad tmin, QuadHit *hit)
{
    hit->solid = -1;
    for (int i = 0; i < view->scene->solids; i++) {
        const QuadSolid *s = &view->scene->solid[i];
        Quad t[2] = {0, 0};
        int axis[2] = {0, 0};
        if (!crossings(s, growth(view, s, view->grown), o, d, t, axis)) continue;
        int k = t[0] > tmin ? 0 : 1;
        if (!(t[k] > tmin) || (hit->solid >= 0 && t[k] >= hit->t)) continue;
        hit->t = t[k];
        hit->solid = i;
        hit->normal = (Q3){{0, 0, 0}};
        if (s->box)
            hit->normal.v[axis[k]] = 1;
        else
            hit->normal = unit(sub(at(o, t[k], d), q3(s->at)));
    }
    if (hit->solid >= 0 && dot(hit->normal, d) > 0) hit->normal = scaled(hit->normal, -1);
    return hit->solid >= 0;
}

/* The solid that p is on is as large as it was when p was found. */
static bool is_shaded(const View *view, int own, Q3 p, Q3 to_light, Quad distance)
{
    Quad w = view->window / distance;
    for (int i = 0; i < view->scene->solids; i++) {
        Quad t[2] = {0, 0};
        int axis[2] = {0, 0};
        const QuadSolid *s = &view->scene->solid[i];
        Quad grown = growth(view, s, i == own ? view->grown : view->shading_grown);
        if (!crossings(s, grown, p, to_light, t, axis)) continue;
        for (int k = 0; k < 2; k++)
            if (t[k] > w && t[k] < 1 - w) return true;
    }
    return false;
}

/* ---- SPEC 5 ---- */

static Quad falloff(const QuadLight *l, Quad d) { return l->falloff[0] + l->falloff[1] * d + l->falloff[2] * d * d; }

/* By what angle a sphere's normal may be turned where the ray or the surface is off by the slack: its cosine c against the
 * ray has c^2 = 1 - (b/r)^2, b the ray's distance from the centre. */
static Quad normal_turn(const View *view, const QuadSolid *s, const QuadHit *hit, Q3 d)
{
    if (s->box) return 0;
    Quad share = view->scene->slack / s->size[0], c = q_abs(dot(hit->normal, d)) / length(d);
    return share + q_sqrt(c * c + 4 * share) - c;
}

static void add_light(View *view, const QuadLight *l, const QuadSolid *s, const QuadHit *hit, Q3 p, Quad normal_turn,
                      Quad weight, Quad colour[3])
{
    Quad slack = view->scene->slack;
    Q3 to_light = sub(q3(l->at), p);
    Quad d = length(to_light);
    if (d == 0) return;
    Quad n_l = dot(hit->normal, to_light) / d;
    Quad turned = normal_turn + slack / d;
    if (n_l + turned <= 0) return;
    Quad fall = falloff(l, d), most = q_max(0, n_l) / fall * (2 * slack / d + FLOAT_ROUNDING) + turned / fall;
    for (int k = 0; k < 3; k++) view->tolerance = q_max(view->tolerance, weight * s->kd[k] * l->colour[k] * most);
    if (n_l <= 0 || is_shaded(view, hit->solid, p, to_light, d)) return;
    for (int k = 0; k < 3; k++) colour[k] += s->kd[k] * l->colour[k] * n_l / fall;
}

/* False if the ray leaves the scene. */
static bool trace(View *view, Q3 o, Q3 d, uint32_t depth, Quad weight, Quad colour[3])
{
    const QuadScene *scene = view->scene;
    QuadHit hit;
    if (!nearest(view, o, d, depth == 0 ? 0 : view->window / length(d), &hit)) return false;
    const QuadSolid *s = &scene->solid[hit.solid];
    Q3 p = at(o, hit.t, d);
    for (int k = 0; k < 3; k++) colour[k] = (Quad)scene->ambient[k] * s->kd[k];
    Quad turn = normal_turn(view, s, &hit, d);
    for (int i = 0; i < scene->lights; i++) add_light(view, &scene->light[i], s, &hit, p, turn, weight, colour);
    if (s->mirror == 0 || depth == scene->max_depth) return true;
    Quad seen[3];
    Q3 mirrored = at(d, -2 * dot(d, hit.normal), hit.normal);
    if (!trace(view, p, mirrored, depth + 1, weight * s->mirror, seen)) return true;
    for (int k = 0; k < 3; k++) colour[k] = (1 - (Quad)s->mirror) * colour[k] + s->mirror * seen[k];
    return true;
}

typedef struct { Q3 forward, right, up; } QuadCamera;

static QuadCamera camera_of(const QuadScene *scene)
{
    QuadCamera c = {.forward = unit(q3(scene->view))};
    c.right = unit(cross(c.forward, unit(q3(scene->up))));
    c.up = cross(c.right, c.forward);
    Quad sine, cosine;
    q_sincos((Quad)scene->fov_deg * q_pi() / 360, &sine, &cosine);
    c.up = scaled(c.up, sine / cosine);
    c.right = scaled(c.right, sine / cosine * scene->width / scene->height);
    return c;
}

static void pixel(View *view, const QuadCamera *c, Quad x, Quad y, Quad colour[3])
{
    const QuadScene *scene = view->scene;
    Q3 d = at(at(c->forward, 2 * x / scene->width - 1, c->right), 1 - 2 * y / scene->height, c->up);
    view->tolerance = 0;
    if (!trace(view, q3(scene->eye), d, 0, 1, colour))
        for (int k = 0; k < 3; k++) colour[k] = scene->background[k];
}

/* Whether a byte is what the colours between lo and hi may be rounded to. */
static bool is_between(uint8_t byte, Quad lo, Quad hi, Quad tolerance)
{
    Quad value = byte / (Quad)255;
    Quad least = q_min(q_max(lo - tolerance, 0), 1), most = q_min(q_max(hi + tolerance, 0), 1);
    return value >= least - LEVEL && value <= most + LEVEL;
}

static bool agrees(const uint8_t *rgb, const Quad *lo, const Quad *hi, Quad tolerance)
{
    for (int k = 0; k < 3; k++)
        if (!is_between(rgb[k], lo[k], hi[k], tolerance)) return false;
    return true;
}

/* The colours that a pixel may have: its centre and four places around it, as far as the camera may be turned, with
 * surfaces grown and shrunk; and with what is farther than the slack from a light that is to lie on it shading or not. */
static Quad widen(View *view, const QuadCamera *c, uint32_t x, uint32_t y, Quad lo[3], Quad hi[3])
{
    const QuadScene *scene = view->scene;
    Quad shift = scene->turn / (2 * length(c->up) / scene->height), tolerance = 0;
    Quad window = view->window;
    for (int i = 0; i < 3 * 3 * 5 * 2 * 2; i++) {
        static const int places[5][2] = {{0, 0}, {1, 0}, {-1, 0}, {0, 1}, {0, -1}};
        Quad colour[3];
        view->grown = (i % 3 - 1) * (Quad)scene->slack;
        view->shading_grown = (i / 3 % 3 - 1) * (Quad)scene->slack;
        view->window = i / 45 % 2 ? (Quad)scene->slack : window;
        view->opposed = i / 90;
        const int *place = places[i / 9 % 5];
        pixel(view, c, x + (Quad)0.5 + place[0] * shift, y + (Quad)0.5 + place[1] * shift, colour);
        tolerance = q_max(tolerance, view->tolerance);
        for (int k = 0; k < 3; k++) {
            lo[k] = q_min(lo[k], colour[k]);
            hi[k] = q_max(hi[k], colour[k]);
        }
    }
    view->grown = view->shading_grown = 0;
    view->window = window;
    view->opposed = false;
    return tolerance;
}

uint64_t quad_scene_compare(Row *row, const QuadScene *scene, const Picture *picture, const char *what)
{
    uint64_t undecided = 0;
    if (!picture->rgb) {
        row_trial(row, false, "%.60s: no picture: %.90s", what, picture->err.text);
        return 0;
    }
    QuadCamera c = camera_of(scene);
    View view = {.scene = scene, .window = 1e-9 + 4 * scene->slack};
    for (uint32_t y = 0; y < scene->height; y++)
        for (uint32_t x = 0; x < scene->width; x++) {
            const uint8_t *rgb = picture->rgb + 3 * ((size_t)y * scene->width + x);
            Quad lo[3], hi[3];
            pixel(&view, &c, x + (Quad)0.5, y + (Quad)0.5, lo);
            memcpy(hi, lo, sizeof hi);
            bool ok = agrees(rgb, lo, hi, view.tolerance);
            if (!ok) {
                Quad tolerance = widen(&view, &c, x, y, lo, hi);
                ok = agrees(rgb, lo, hi, tolerance);
                undecided += ok;
            }
            row_trial(row, ok, "%.60s: pixel %u,%u: %d,%d,%d, not %.1f,%.1f,%.1f", what, x, y, rgb[0], rgb[1], rgb[2],
                      255 * (double)lo[0], 255 * (double)lo[1], 255 * (double)lo[2]);
        }
    return undecided;
}

/* ---- the script ---- */

static void write_triple(FILE *out, const double v[3]) { fprintf(out, "{%a, %a, %a}", v[0], v[1], v[2]); }

/* A primitive of so many times the size about the same middle. */
static void write_primitive(FILE *out, const QuadSolid *s, const char *variable, double times)
{
    double middle[3], size[3], at[3];
    for (int k = 0; k < 3; k++) {
        size[k] = s->size[s->box ? k : 0] * times;
        middle[k] = s->box ? s->at[k] + s->size[k] / 2 : s->at[k];
        at[k] = times == 1 ? s->at[k] : s->box ? middle[k] - size[k] / 2 : middle[k];
    }
    fprintf(out, "%s = gr.%s('solid')\n", variable, s->box ? "cube" : "sphere");
    fprintf(out, "%s:scale(%a, %a, %a)\n", variable, size[0], size[1], size[2]);
    fprintf(out, "%s:translate(%a, %a, %a)\n", variable, at[0], at[1], at[2]);
}

static void write_mesh(FILE *out, const QuadSolid *s)
{
    fputs("n = gr.mesh('solid', {", out);
    for (int i = 0; i < 8; i++) {
        double p[3];
        for (int k = 0; k < 3; k++) p[k] = s->at[k] + (i >> k & 1 ? s->size[k] : 0);
        write_triple(out, p);
        fputs(", ", out);
    }
    fputs("}, {{0,2,3,1}, {4,5,7,6}, {0,1,5,4}, {2,6,7,3}, {0,4,6,2}, {1,3,7,5}})\n", out);
}

static void write_solid(FILE *out, const QuadSolid *s)
{
    const double none[3] = {0, 0, 0};
    if (s->making == MADE_MESH)
        write_mesh(out, s);
    else
        write_primitive(out, s, "n", 1);
    fputs("n:set_material(gr.reflective_material(", out);
    write_triple(out, s->kd);
    fputs(", ", out);
    write_triple(out, none);
    fprintf(out, ", 1, %a))\n", s->mirror);
    if (s->making == MADE_CSG) {
        write_primitive(out, s, "inner", 0.5);
        fputs("inner:set_material(gr.material({1, 0, 1}, {0, 0, 0}, 1))\nn = gr.union('both', n, inner)\n", out);
    }
    fputs("root:add_child(n)\n", out);
}

Picture quad_scene_picture(const QuadScene *s)
{
    char *text;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    CHECK(out);
    fputs("local root, lights, n, inner = gr.node('root'), {}, nil, nil\n", out);
    for (int i = 0; i < s->solids; i++) write_solid(out, &s->solid[i]);
    for (int i = 0; i < s->lights; i++) {
        fputs("lights[#lights + 1] = gr.light(", out);
        write_triple(out, s->light[i].at);
        fputs(", ", out);
        write_triple(out, s->light[i].colour);
        fputs(", ", out);
        write_triple(out, s->light[i].falloff);
        fputs(")\n", out);
    }
    fprintf(out, "gr.render(root, 'o.png', %u, %u, ", s->width, s->height);
    write_triple(out, s->eye);
    fputs(", ", out);
    write_triple(out, s->view);
    fputs(", ", out);
    write_triple(out, s->up);
    fprintf(out, ", %a, ", s->fov_deg);
    write_triple(out, s->ambient);
    fprintf(out, ", lights, {max_depth = %u, background = ", s->max_depth);
    write_triple(out, s->background);
    fputs("})\n", out);
    CHECK(fclose(out) == 0);
    Picture picture = picture_run("stability_quad.lua", text, NULL);
    free(text);
    return picture;
}

void quad_scene_check(Row *row, const QuadScene *scene, uint64_t *undecided, const char *what)
{
    Picture picture = quad_scene_picture(scene);
    *undecided += quad_scene_compare(row, scene, &picture, what);
    picture_free(&picture);
}

void quad_scene_decided(Row *row, uint64_t undecided, double share)
{
    row_trial(row, (double)undecided <= share * (double)row->trials, "%llu of %llu pixels were undecided",
              (unsigned long long)undecided, (unsigned long long)row->trials);
}
