/* FLIP, the difference that a viewer sees who flips between two pictures (Andersson, Nilsson, Akenine-Moller, Oskarsson,
 * Astrom, Fairchild 2020: "FLIP: A difference evaluator for alternating images"), for pictures of low dynamic range. */
#ifndef RT_COMPARE_FLIP_H
#define RT_COMPARE_FLIP_H

#include "tools/image.h"

/* *value is the mean over the pixels, from 0 (equal) to 1, symmetric, as seen at the 67 pixels per degree that the authors
 * take: 3840 pixels over 0.7 m at a distance of 0.7 m. Values, clamped to [0,1], are sRGB, or linear light if `linear`. The
 * pictures are of one size. False and *err (ERR_LIMIT) without memory. */
bool flip(const Image *a, const Image *b, bool linear, double *value, Err *err);

#endif
