/* What a surface does with light. */
#ifndef RT_NODE_MATERIAL_MATERIAL_H
#define RT_NODE_MATERIAL_MATERIAL_H

#include <stdint.h>

#include "common/colour.h"

typedef struct Material Material;

typedef struct {
    const char *name;
    /* The shares of a light's colour that leave n points toward the viewer: n_l = n.l, where that is above 0 (elsewhere
     * any number will do); r_v = r.v, r the mirror image of l (n, l, r, v unit vectors); kd the diffuse colours, which a
     * texture may have replaced. */
    void (*reflect_light)(const Material *, const float *const kd[3], const float *n_l, const float *r_v,
                          float *const share[3], uint32_t n);
} MaterialOps;

struct Material {
    const MaterialOps *ops;
    Rgb kd;         /* diffuse colour where no texture replaces it */
    float mirror;   /* share in [0,1] of the colour that comes from the mirror direction */
};

/* Phong: kd n.l + ks (r.v)^exponent, the second term 0 where r.v <= 0. exponent >= 0. mirror 0 for none.
 * NULL without memory; the caller frees it with free(). */
Material *phong_create(Rgb kd, Rgb ks, double exponent, double mirror);

#endif
