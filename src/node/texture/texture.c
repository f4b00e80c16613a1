#include "node/texture/texture.h"

void texture_destroy(Texture *texture)
{
    if (texture) texture->ops->destroy(texture);
}

bool texture_source_load(TextureSource *source, bool srgb, Err *err)
{
    if (!source->loaded) source->loaded = image_texture_load(source->path, srgb, err);
    return source->loaded != NULL;
}
