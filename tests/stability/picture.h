/* Small pictures of scenes that are written as scripts: one sample per pixel, so that two of them can be compared. */
#ifndef RT_TESTS_STABILITY_PICTURE_H
#define RT_TESTS_STABILITY_PICTURE_H

#include <stdint.h>

#include "common/err.h"
#include "stability/stability.h"

typedef struct {
    uint32_t width, height;
    uint8_t *rgb;   /* NULL: the script rendered nothing */
    Err err;        /* what ended the script, ERR_NONE if nothing did */
    unsigned warnings;
    char warning[256];  /* the last of them */
} Picture;

/* Runs the script with the words as its arg[1], arg[2], ..., ended by NULL, and keeps the last picture that it renders.
 * `name` is the file's (test_file.h). A sample that is no number makes rendering fail. */
Picture picture_run(const char *name, const char *script, const char *const *words);
void picture_free(Picture *picture);

/* A trial per pixel. Pictures may differ in `allowed` pixels by one level; all of the pixels that differ are failures if
 * there are more, and so is every pixel that differs by more than a level. `mirrored`: b is a turned left to right. */
void picture_compare(Row *row, const Picture *a, const Picture *b, bool mirrored, unsigned allowed, const char *what);

#endif
