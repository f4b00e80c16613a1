/* Colours: linear RGB, cglm's float vectors by value (glms_vec3_*). */
#ifndef RT_COMMON_COLOUR_H
#define RT_COMMON_COLOUR_H

#include <cglm/struct.h>

typedef vec3s Rgb;

static inline Rgb rgb(float r, float g, float b) { return (Rgb){{r, g, b}}; }

#endif
