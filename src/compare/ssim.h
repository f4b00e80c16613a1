/* The structural similarity of two pictures (Wang, Bovik, Sheikh, Simoncelli 2004: "Image quality assessment: from error
 * visibility to structural similarity"). */
#ifndef RT_COMPARE_SSIM_H
#define RT_COMPARE_SSIM_H

#include "tools/image.h"

/* *value is the mean over all 11 x 11 windows that lie in the picture, Gaussian with sigma 1.5, of luma (0.299 R +
 * 0.587 G + 0.114 B of the values as they are, clamped to [0,1]): 1 for equal pictures, at least -1, symmetric. A picture
 * with a side below 11 has no window: *value is NaN. The pictures are of one size. False and *err (ERR_LIMIT) without
 * memory. */
bool ssim(const Image *a, const Image *b, double *value, Err *err);

#endif
