#include "node/texture/texture.h"

#include <stdlib.h>

typedef struct {
    Texture base;
    double low, high;  /* heights of the two borders */
} HeightTexture;

static Rgb colour(const Texture *texture, double u, double v, Vec3 p)
{
    (void)u;
    (void)v;
    const HeightTexture *t = (const HeightTexture *)texture;
    if (p.y < t->low) return rgb(0.0f, 0.6f, 0.0f);
    if (p.y < t->high) return rgb(0.8588f, 0.6745f, 0.2039f);
    return rgb(0.7f, 0.7f, 0.7f);
}

static void destroy(Texture *texture) { free(texture); }

static const TextureOps ops = {.name = "height", .colour = colour, .by_place = true, .destroy = destroy};

Texture *height_texture_create(double peak)
{
    HeightTexture *t = malloc(sizeof *t);
    if (!t) return NULL;
    *t = (HeightTexture){{&ops}, 0.5 * peak, 0.8 * peak};
    return &t->base;
}
