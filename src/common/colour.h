/* Colours: linear RGB, cglm's float vectors by value (glms_vec3_*); and sRGB's transfer curve. */
#ifndef RT_COMMON_COLOUR_H
#define RT_COMMON_COLOUR_H

#include <math.h>

#include <cglm/struct.h>

typedef vec3s Rgb;

static inline Rgb rgb(float r, float g, float b) { return (Rgb){{r, g, b}}; }

/* sRGB's transfer curve (IEC 61966-2-1) and its inverse, from [0,1] to [0,1]. */
static inline double srgb_encode(double c) { return c <= 0.0031308 ? 12.92 * c : 1.055 * pow(c, 1 / 2.4) - 0.055; }
static inline double srgb_decode(double c) { return c <= 0.04045 ? c / 12.92 : pow((c + 0.055) / 1.055, 2.4); }

#endif
