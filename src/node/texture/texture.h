/* What replaces the diffuse colour at a point. */
#ifndef RT_NODE_TEXTURE_TEXTURE_H
#define RT_NODE_TEXTURE_TEXTURE_H

#include <stdbool.h>
#include <stdint.h>

#include "common/colour.h"
#include "common/err.h"
#include "common/vec.h"

typedef struct Texture Texture;

typedef struct {
    const char *name;
    /* Colour at texture coordinates (u,v) (any finite or infinite value) and object-space point p. */
    Rgb (*colour)(const Texture *, double u, double v, Vec3 p);
    bool by_place;   /* looks at p */
    void (*destroy)(Texture *);
} TextureOps;

struct Texture { const TextureOps *ops; };

void texture_destroy(Texture *texture);

/* A picture: bilinear, repeating outside [0,1], (0,0) its lower left; a texel is byte / 255, decoded from sRGB if
 * `srgb`. NULL and *err (ERR_INPUT naming the file, ERR_LIMIT) on failure. */
Texture *image_texture_load(const char *path, bool srgb, Err *err);

/* Bands by height, the mountain's: y below 0.5 of `peak` green, below 0.8 ochre, above grey. NULL without memory. */
Texture *height_texture_create(double peak);

/* What a script named, loaded when a scene that needs it is compiled. */
typedef struct {
    const char *path;  /* as resolved */
    Texture *loaded;   /* NULL until needed */
    uint32_t index;    /* in order of creation, unique in the scene */
} TextureSource;

/* Loads it if that hasn't happened yet. False and *err on failure. */
bool texture_source_load(TextureSource *source, bool srgb, Err *err);

#endif
