/* Pictures as floats, whichever file they come from. */
#ifndef RT_TOOLS_IMAGE_H
#define RT_TOOLS_IMAGE_H

#include <stdbool.h>
#include <stdint.h>

#include "common/err.h"

typedef struct {
    uint32_t width, height;
    double white;   /* the value that counts as 1: 65535 from a PNG, so that its levels are whole numbers; 1 from a PFM */
    float *rgb;     /* 3 a pixel, finite, rows from the top; malloc'ed */
} Image;

/* A PNG of any kind or a PFM, told apart by how they begin. False and *err: ERR_INPUT "file: what", ERR_LIMIT. */
bool image_load(const char *path, Image *image, Err *err);
void image_free(Image *image);

/* Keeps the part from (x0, y0) to before (x1, y1): crop is x0, y0, x1, y1, and lies within the picture. */
void image_crop(Image *image, const uint32_t crop[4]);

#endif
