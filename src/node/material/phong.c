/* Phong's model (1975), the mirror image of the light against the viewer. */
#include "node/material/material.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

typedef struct {
    Material base;
    Rgb ks;
    float exponent;
} Phong;

static Rgb reflect_light(const Material *material, Rgb kd, float n_l, float r_v)
{
    const Phong *m = (const Phong *)material;
    if (!(n_l > 0)) return rgb(0, 0, 0);
    Rgb diffuse = glms_vec3_scale(kd, n_l);
    if (!(r_v > 0)) return diffuse;
    /* a cosine that rounding put above 1 would blow up under a large exponent */
    return glms_vec3_add(diffuse, glms_vec3_scale(m->ks, powf(r_v < 1 ? r_v : 1, m->exponent)));
}

static const MaterialOps ops = {.name = "phong", .reflect_light = reflect_light};

Material *phong_create(Rgb kd, Rgb ks, double exponent, double mirror)
{
    Phong *m = malloc(sizeof *m);
    if (!m) return NULL;
    *m = (Phong){{&ops, kd, (float)mirror}, ks, (float)fmin(exponent, (double)FLT_MAX)};
    return &m->base;
}
