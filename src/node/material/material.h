/* What a surface does with light. */
#ifndef RT_NODE_MATERIAL_MATERIAL_H
#define RT_NODE_MATERIAL_MATERIAL_H

#include "common/colour.h"

typedef struct Material Material;

typedef struct {
    const char *name;
    /* The share of a light's colour that leaves toward the viewer: n_l = n.l > 0; r_v = r.v, r the mirror image of l
     * (n, l, r, v unit vectors); kd the diffuse colour, which a texture may have replaced. */
    Rgb (*reflect_light)(const Material *, Rgb kd, float n_l, float r_v);
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
