/* A picture as a texture. Texel i of w has its centre at (i + 1/2) / w; bytes are kept as they are and looked up. */
#include "node/texture/texture.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>

#include "common/colour.h"
#include "tools/png.h"

enum { BYTE_VALUES = 256 };

typedef struct {
    Texture base;
    Png png;                   /* rows from the top */
    float value[BYTE_VALUES];  /* of a byte */
} ImageTexture;

/* The two texels around a coordinate, and the weight of the second. */
typedef struct {
    uint32_t first, second;
    float weight;
} Neighbours;

static Neighbours find_neighbours(double u, uint32_t count)
{
    double turn = u - floor(u);              /* NaN for what is not finite */
    if (!(turn >= 0 && turn < 1)) turn = 0;  /* 1 by rounding, for u just below a whole number */
    double x = turn * count - 0.5, cell = floor(x);
    uint32_t first = cell < 0 ? count - 1 : (uint32_t)cell;
    return (Neighbours){first, first + 1 < count ? first + 1 : 0, (float)(x - cell)};
}

static Rgb texel(const ImageTexture *t, uint32_t column, uint32_t row_from_below)
{
    size_t row = t->png.height - 1 - row_from_below;
    const uint8_t *p = t->png.rgb + 3 * (row * t->png.width + column);
    return rgb(t->value[p[0]], t->value[p[1]], t->value[p[2]]);
}

static Rgb colour(const Texture *texture, double u, double v, Vec3 p)
{
    (void)p;
    const ImageTexture *t = (const ImageTexture *)texture;
    Neighbours x = find_neighbours(u, t->png.width), y = find_neighbours(v, t->png.height);
    Rgb below = glms_vec3_lerp(texel(t, x.first, y.first), texel(t, x.second, y.first), x.weight);
    Rgb above = glms_vec3_lerp(texel(t, x.first, y.second), texel(t, x.second, y.second), x.weight);
    return glms_vec3_lerp(below, above, y.weight);
}

static void destroy(Texture *texture)
{
    png_free(&((ImageTexture *)texture)->png);
    free(texture);
}

static const TextureOps ops = {.name = "image", .colour = colour, .destroy = destroy};

Texture *image_texture_load(const char *path, bool srgb, Err *err)
{
    ImageTexture *t = malloc(sizeof *t);
    if (!t) {
        err_memory(err, path);
        return NULL;
    }
    t->base.ops = &ops;
    if (!png_load(path, &t->png, err)) {
        free(t);
        return NULL;
    }
    for (int i = 0; i < BYTE_VALUES; i++) t->value[i] = (float)(srgb ? srgb_decode(i / 255.0) : i / 255.0);
    return &t->base;
}
