/* PNG files in and out (lodepng, with libdeflate to pack and unpack). */
#ifndef RT_TOOLS_PNG_H
#define RT_TOOLS_PNG_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "common/err.h"

typedef struct {
    uint32_t width, height;
    uint8_t *rgb;   /* 3 samples a pixel of 1 byte, or of 2 with the high one first; rows from the top; malloc'ed */
} Png;

/* For infile_read: judges the header. Sides are limited to MAX_SIDE and the area to MAX_AREA before anything of that size
 * is allocated. False and *err (ERR_INPUT "file.png: what"). */
bool png_accept(const char *path, const unsigned char *head, size_t size, size_t *most, Err *err);

/* Any PNG, whole in memory, as RGB of 8 or 16 bits a sample (fewer bits are stretched to all of them), alpha ignored (not
 * premultiplied). `path` is for messages. False and *err: ERR_INPUT "file.png: what", ERR_LIMIT. */
bool png_decode(const char *path, const unsigned char *data, size_t size, unsigned bits, Png *png, Err *err);

/* Reads and decodes a file as 8-bit RGB; errors as above. */
bool png_load(const char *path, Png *png, Err *err);
void png_free(Png *png);

/* Encodes RGB of 8 or 16 bits a sample, laid out as in Png, without a date or any other metadata; the same pixels give the
 * same bytes. *data is malloc'ed. False and *err (ERR_LIMIT) without memory. */
bool png_encode(const uint8_t *rgb, unsigned bits, uint32_t width, uint32_t height, uint8_t **data, size_t *size,
                Err *err);

#endif
