/* Phong's model (1975), the mirror image of the light against the viewer. */
#include "node/material/material.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

#include "common/power.h"
#include "common/wide.h"

typedef struct {
    Material base;
    Rgb ks;
    float exponent;
} Phong;

/* A cosine that rounding put above 1 would blow up under a large exponent; one below this counts as this. */
#define LEAST_COSINE 0x1p-126

/* Points at once: each loop writes one array, so that the compiler can tell it from those it reads. */
enum { BLOCK = 64 };

WIDE static void shine_of(const float *restrict r_v, double exponent, float *restrict shine, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) {
        double cosine = (double)r_v[i];
        cosine = cosine < 1 ? cosine : 1;
        float power = (float)power_of(cosine > LEAST_COSINE ? cosine : LEAST_COSINE, exponent);
        shine[i] = cosine > 0 ? power : 0;
    }
}

WIDE static void add_up(const float *restrict kd, const float *restrict n_l, float ks, const float *restrict shine,
                        float *restrict share, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) share[i] = kd[i] * n_l[i] + ks * shine[i];
}

static void reflect_light(const Material *material, const float *const kd[3], const float *n_l, const float *r_v,
                          float *const share[3], uint32_t n)
{
    const Phong *m = (const Phong *)material;
    float shine[BLOCK];
    for (uint32_t at = 0, count; at < n; at += count) {
        count = n - at < BLOCK ? n - at : BLOCK;
        shine_of(r_v + at, (double)m->exponent, shine, count);
        for (int k = 0; k < 3; k++) add_up(kd[k] + at, n_l + at, m->ks.raw[k], shine, share[k] + at, count);
    }
}

static const MaterialOps ops = {.name = "phong", .reflect_light = reflect_light};

Material *phong_create(Rgb kd, Rgb ks, double exponent, double mirror)
{
    Phong *m = malloc(sizeof *m);
    if (!m) return NULL;
    *m = (Phong){{&ops, kd, (float)mirror}, ks, (float)fmin(exponent, (double)FLT_MAX)};
    return &m->base;
}
