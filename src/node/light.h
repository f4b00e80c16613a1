/* A point light: colour / (c0 + c1 d + c2 d^2) at distance d. */
#ifndef RT_NODE_LIGHT_H
#define RT_NODE_LIGHT_H

#include "common/colour.h"
#include "common/vec.h"

typedef struct {
    Vec3 position;
    Rgb colour;
    double falloff[3];
} Light;

#endif
