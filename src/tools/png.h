/* PNG files in and out (lodepng). */
#ifndef RT_TOOLS_PNG_H
#define RT_TOOLS_PNG_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "common/err.h"

typedef struct {
    uint32_t width, height;
    uint8_t *rgb;   /* 3 bytes a pixel, rows from the top; malloc'ed */
} Png;

/* Any PNG as 8-bit RGB, alpha ignored (not premultiplied). Sides are limited to 65,535 and the area to 2^28 before
 * anything of that size is allocated. False and *err: ERR_INPUT "file.png: what", ERR_LIMIT. */
bool png_load(const char *path, Png *png, Err *err);
void png_free(Png *png);

/* Encodes 8-bit RGB, without a date or any other metadata; the same pixels give the same bytes. *data is malloc'ed.
 * False and *err (ERR_LIMIT) without memory. */
bool png_encode(const uint8_t *rgb, uint32_t width, uint32_t height, uint8_t **data, size_t *size, Err *err);

#endif
