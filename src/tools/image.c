#include "tools/image.h"

#include <stdlib.h>
#include <string.h>

#include "tools/infile.h"
#include "tools/pfm.h"
#include "tools/png.h"

static bool png_begins(const unsigned char *head, size_t size)
{
    return size >= 4 && memcmp(head, "\x89PNG", 4) == 0;
}

static bool accept(const char *path, const unsigned char *head, size_t size, size_t *most, Err *err)
{
    if (pfm_begins(head, size)) return pfm_accept(path, head, size, most, err);
    if (png_begins(head, size)) return png_accept(path, head, size, most, err);
    return err_set(err, ERR_INPUT, "%s: neither a PNG nor a PFM", path);
}

static bool from_pfm(const char *path, const unsigned char *data, size_t size, Image *image, Err *err)
{
    Pfm pfm;
    if (!pfm_decode(path, data, size, &pfm, err)) return false;
    *image = (Image){pfm.width, pfm.height, 1, pfm.rgb};
    return true;
}

static bool from_png(const char *path, const unsigned char *data, size_t size, Image *image, Err *err)
{
    Png png;
    if (!png_decode(path, data, size, 16, &png, err)) return false;
    size_t count = (size_t)png.width * png.height * 3;
    float *rgb = malloc(count * sizeof *rgb);
    if (rgb) {
        for (size_t i = 0; i < count; i++) rgb[i] = (float)(png.rgb[2 * i] << 8 | png.rgb[2 * i + 1]);
        *image = (Image){png.width, png.height, UINT16_MAX, rgb};
    }
    png_free(&png);
    return rgb || err_memory(err, path);
}

bool image_load(const char *path, Image *image, Err *err)
{
    unsigned char *data;
    size_t size;
    *image = (Image){0};
    if (!infile_read(path, accept, &data, &size, err)) return false;
    bool ok = pfm_begins(data, size) ? from_pfm(path, data, size, image, err) : from_png(path, data, size, image, err);
    free(data);
    return ok;
}

void image_free(Image *image)
{
    free(image->rgb);
    *image = (Image){0};
}

void image_crop(Image *image, const uint32_t crop[4])
{
    uint32_t width = crop[2] - crop[0], height = crop[3] - crop[1];
    for (uint32_t y = 0; y < height; y++)
        memmove(image->rgb + (size_t)y * width * 3,
                image->rgb + ((size_t)(crop[1] + y) * image->width + crop[0]) * 3, (size_t)width * 3 * sizeof(float));
    image->width = width;
    image->height = height;
}
