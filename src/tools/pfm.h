/* PFM files in and out: pictures of 32-bit floats, linear light by custom (Debevec's portable float map; also netpbm's
 * pfm(5)). */
#ifndef RT_TOOLS_PFM_H
#define RT_TOOLS_PFM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "common/err.h"

typedef struct {
    uint32_t width, height;
    float *rgb;   /* 3 a pixel, finite, rows from the top; malloc'ed */
} Pfm;

/* Whether a file that begins so is meant as one. */
bool pfm_begins(const unsigned char *head, size_t size);

/* For infile_read: judges the header, which tells the size of the whole file. Sides are limited to MAX_SIDE and the area
 * to MAX_AREA. False and *err (ERR_INPUT "file.pfm: what"). */
bool pfm_accept(const char *path, const unsigned char *head, size_t size, size_t *most, Err *err);

/* A colour (PF) or grey (Pf) file, whole in memory, of either byte order; its values are multiplied by the header's scale.
 * `path` is for messages. False and *err: ERR_INPUT "file.pfm: what", ERR_LIMIT. */
bool pfm_decode(const char *path, const unsigned char *data, size_t size, Pfm *pfm, Err *err);
void pfm_free(Pfm *pfm);

/* Encodes 3 floats a pixel, rows from the top, low byte first: every bit comes back. *data is malloc'ed. False and *err
 * (ERR_LIMIT) without memory. */
bool pfm_encode(const float *rgb, uint32_t width, uint32_t height, uint8_t **data, size_t *size, Err *err);

#endif
