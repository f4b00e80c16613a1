/* Textures and bumps at their extremes: each colour from the definitions in SPEC 4 and 5. */
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "node/texture/texture.h"
#include "stability/quad_scene.h"
#include "stability/ray_check.h"
#include "support/check.h"
#include "support/test_file.h"
#include "tools/png.h"

/* What three interpolations in float may be off by, and what 8 bits add. */
#define LERP_ROUNDING 0x1p-21
#define LEVEL (1 / 255.0)

enum { WIDTH = 65, HEIGHT = 49 };

/* ---- the oracle of textures ---- */

typedef struct { uint32_t width, height; uint8_t *rgb; } Image;

static Image random_image(Rng *rng, uint32_t width, uint32_t height)
{
    Image image = {width, height, malloc((size_t)3 * width * height)};
    CHECK(image.rgb);
    for (size_t i = 0; i < (size_t)3 * width * height; i++) image.rgb[i] = (uint8_t)rng_u32(rng);
    return image;
}

static void write_image(const Image *image, const char *name)
{
    uint8_t *data;
    size_t size;
    Err err;
    CHECK(png_encode(image->rgb, 8, image->width, image->height, &data, &size, &err));
    test_file_bytes(name, data, size);
    free(data);
}

static Quad q_floor(Quad x)
{
    if (q_abs(x) >= 0x1p112) return x;  /* whole, and 1 more may be the same number */
    Quad whole = floor((double)x);
    while (whole > x) whole -= 1;
    while (whole + 1 <= x) whole += 1;
    return whole;
}

/* Texels i and i + 1 with their centres around u, and the weight of the second; i counted round. */
static Quad around(Quad u, uint32_t count, uint32_t index[2])
{
    Quad x = (u - q_floor(u)) * count - (Quad)0.5, cell = q_floor(x);
    index[0] = cell < 0 ? count - 1 : (uint32_t)cell % count;
    index[1] = (index[0] + 1) % count;
    return x - cell;
}

static void bilinear(const Image *image, Quad u, Quad v, Quad colour[3])
{
    uint32_t column[2], row[2];
    Quad wx = around(u, image->width, column), wy = around(v, image->height, row);
    for (int k = 0; k < 3; k++) {
        Quad sum = 0;
        for (int i = 0; i < 2; i++)
            for (int j = 0; j < 2; j++) {
                size_t texel = (size_t)(image->height - 1 - row[j]) * image->width + column[i];
                sum += (i ? wx : 1 - wx) * (j ? wy : 1 - wy) * image->rgb[3 * texel + (size_t)k] / 255;
            }
        colour[k] = sum;
    }
}

/* ---- 39: coordinates ---- */

static double coordinate(Rng *rng, uint32_t count)
{
    static const double hard[] = {0, 1, -1e300, 1e300, -0.0, -1, 5e-324, -5e-324, -1e-20, 0x1p52 + 0.5, -0x1p52 - 0.5,
                                  DBL_MAX, -DBL_MAX, 1 - 0x1p-53, 1 + 0x1p-52, 0x1p53, 0x1p31, -0x1p32};
    switch (rng_u32(rng) % 5) {
    case 0: return hard[rng_u32(rng) % (sizeof hard / sizeof *hard)];
    case 1: return (double)(rng_u32(rng) % (2 * count + 1)) / (2.0 * count);
    case 2: return (rng_u32(rng) % 2 ? 1 : -1) * pow(10, uniform(rng, -20, 17));
    case 3: return (double)(int32_t)rng_u32(rng) + rng_double(rng);
    default: return rng_double(rng);
    }
}

static void texture_coordinates(Row *row, uint64_t trials)
{
    static const uint32_t sizes[][2] = {{1, 1}, {65535, 1}, {1, 65535}, {7, 5}, {256, 128}, {2, 3}};
    enum { SIZES = sizeof sizes / sizeof *sizes };
    Rng rng = rng_seed(39, 1);
    for (int i = 0; i < SIZES; i++) {
        Image image = random_image(&rng, sizes[i][0], sizes[i][1]);
        write_image(&image, "stability_texture.png");
        Err err;
        Texture *texture = image_texture_load(test_path("stability_texture.png"), false, &err);
        CHECK(texture);
        for (uint64_t j = 0; j < trials / SIZES; j++) {
            double u = coordinate(&rng, image.width), v = coordinate(&rng, image.height);
            Rgb got = texture->ops->colour(texture, u, v, vec3_make(0, 0, 0));
            Quad want[3];
            bilinear(&image, u, v, want);
            const float *c = (const float *)&got;
            bool ok = true;
            /* A product with the width is rounded. */
            Quad allowed = LERP_ROUNDING + 0x1p-52 * (image.width + image.height);
            for (int k = 0; k < 3; k++) ok = ok && q_abs(c[k] - want[k]) <= allowed;
            row_trial(row, ok, "%u x %u at %a, %a: %.9g, not %.9g", image.width, image.height, u, v, (double)c[0],
                      (double)want[0]);
        }
        texture_destroy(texture);
        free(image.rgb);
    }
}

/* ---- 39: poles ---- */

/* The script's ambient light shows the texture as it is. */
static const char pole_scene[] =
    "local kind, fov, size = arg[1], tonumber(arg[2]), tonumber(arg[3])\n"
    "local n = kind == 'pole' and gr.sphere('s') or gr.mesh('m', 'stability_plane.obj')\n"
    "n:set_material(gr.material({1, 1, 1}, {0, 0, 0}, 1))\n"
    "n:add_texture('stability_texture.png')\n"
    "gr.render(n, 'o.png', 65, 49, {0, size, 0}, {0, -1, 0}, {0, 0, -1}, fov, {1, 1, 1}, {}, {background = {0, 0, 0}})\n";

/* Whether a pixel shows the texture at (u, v), or `du` to either side. */
static bool shows(const Image *image, const uint8_t *rgb, Quad u, Quad v, Quad du)
{
    for (int i = -1; i <= 1; i++) {
        Quad want[3];
        bilinear(image, u + i * du, v, want);
        bool ok = true;
        for (int k = 0; k < 3; k++) ok = ok && q_abs(rgb[k] / (Quad)255 - want[k]) <= LEVEL;
        if (ok) return true;
    }
    return false;
}

/* Straight down on the pole of a sphere, from `height` above the origin, the middle pixel at it. */
static void pole(Row *row, Rng *rng, uint64_t number)
{
    Image image = random_image(rng, 1 + rng_u32(rng) % 9, 1 + rng_u32(rng) % 9);
    write_image(&image, "stability_texture.png");
    double fov = pow(10, uniform(rng, -6, 1.6)), height = uniform(rng, 1.5, 10);
    char fov_text[32], height_text[32];
    snprintf(fov_text, sizeof fov_text, "%a", fov);
    snprintf(height_text, sizeof height_text, "%a", height);
    Picture picture = picture_run("stability_pole.lua", pole_scene,
                                  (const char *const[]){"pole", fov_text, height_text, NULL});
    Quad sine, cosine;
    q_sincos((Quad)fov * q_pi() / 360, &sine, &cosine);
    Quad step = 2 * sine / cosine / HEIGHT;
    for (int y = 0; picture.rgb && y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            const uint8_t *rgb = picture.rgb + 3 * (y * WIDTH + x);
            /* right is +x, up -z: d = (a, -1, b), p = (0, h, 0) + t d on the unit sphere */
            Quad a = (x - WIDTH / 2) * step, b = (y - HEIGHT / 2) * step, dd = 1 + a * a + b * b;
            Quad rest = height * (Quad)height - dd * (height * (Quad)height - 1);
            if (rest < 1e-9 * dd) continue;  /* the limb, where this is no pole */
            Quad t = (height - q_sqrt(rest)) / dd, px = t * a, py = height - t, pz = t * b, rho = q_sqrt(px * px + pz * pz);
            long double turn = (atan2l((long double)px, (long double)pz) / (long double)M_PI + 1) / 2;
            long double rise = 0.5L + atan2l((long double)py, (long double)rho) / (long double)q_pi();
            /* p is off by some roundings, u by as many over the distance from the pole; nothing is known of it there. */
            bool ok = true;
            if (rho > 0)
                ok = shows(&image, rgb, turn, rise, 16 * (Quad)DBL_EPSILON / rho);
            else
                for (int k = 0; k < 3; k++) {
                    uint8_t lo = 255, hi = 0;
                    for (uint32_t i = 0; i < 2 * image.width; i++) {  /* v = 1 lies between the first and the last row */
                        const uint8_t *texel = image.rgb + 3 * ((i % 2 ? image.height - 1 : 0) * image.width + i / 2);
                        if (texel[k] < lo) lo = texel[k];
                        if (texel[k] > hi) hi = texel[k];
                    }
                    ok = ok && rgb[k] >= lo && rgb[k] <= hi;
                }
            row_trial(row, ok, "picture %llu, fov %g: pixel %d,%d: %d,%d,%d", (unsigned long long)number, fov, x, y,
                      rgb[0], rgb[1], rgb[2]);
        }
    if (!picture.rgb) row_trial(row, false, "no picture: %.120s", picture.err.text);
    picture_free(&picture);
    free(image.rgb);
}

/* A square of two triangles, x and z in [-1,1], whose texture coordinates run over [0,1] from a whole number on, or are so
 * large that nothing is left of their fraction. */
static void plane(Row *row, Rng *rng, uint64_t number)
{
    static const double huge[] = {-1e300, 1e300, 1e38, -3e9};
    Image image = random_image(rng, 1 + rng_u32(rng) % 9, 1 + rng_u32(rng) % 9);
    write_image(&image, "stability_texture.png");
    bool is_huge = number % 4 == 1;
    double at = is_huge ? huge[number / 4 % 4] : ldexp(rng_u32(rng) % 2 ? 1 : -1, (int)(rng_u32(rng) % 20)), side = is_huge ? 0 : 1;
    char obj[512];
    snprintf(obj, sizeof obj,
             "v -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\nvt %.17g %.17g\nvt %.17g %.17g\nvt %.17g %.17g\nvt %.17g %.17g\n"
             "f 1/1 2/2 3/3 4/4\n", at, at, at + side, at, at + side, at + side, at, at + side);
    test_file("stability_plane.obj", obj);
    Picture picture = picture_run("stability_pole.lua", pole_scene, (const char *const[]){"plane", "40", "2", NULL});
    Quad sine, cosine;
    q_sincos(40 * q_pi() / 360, &sine, &cosine);
    Quad step = 2 * sine / cosine / HEIGHT * 2;
    for (int y = 0; picture.rgb && y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++) {
            const uint8_t *rgb = picture.rgb + 3 * (y * WIDTH + x);
            Quad px = (x - WIDTH / 2) * step, pz = (y - HEIGHT / 2) * step;
            bool ok = shows(&image, rgb, is_huge ? 0 : (px + 1) / 2, is_huge ? 0 : (1 - pz) / 2, 0);
            row_trial(row, ok, "picture %llu, vt from %g: pixel %d,%d: %d,%d,%d", (unsigned long long)number, at, x, y,
                      rgb[0], rgb[1], rgb[2]);
        }
    if (!picture.rgb) row_trial(row, false, "no picture: %.120s", picture.err.text);
    picture_free(&picture);
    free(image.rgb);
}

static void textured_pictures(Row *row, uint64_t trials)
{
    Rng rng = rng_seed(39, 2);
    for (uint64_t i = 0; row->trials < trials; i++) (i % 2 ? plane : pole)(row, &rng, i / 2);
}

#define PICTURES(n) ((uint64_t)(n) * WIDTH * HEIGHT)

const StabilityCase texture_cases[] = {
    {39, "texture coordinates 0, 1, 1e300; 65,535 x 1", "quad", "", 200000, 3000000, 30000000, texture_coordinates},
    {39, "textures at poles and far coordinates", "quad", "", PICTURES(20), PICTURES(400), PICTURES(4000),
     textured_pictures},
    {0},
};
