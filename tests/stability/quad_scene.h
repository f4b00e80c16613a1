/* Scenes of spheres and boxes, drawn twice: by the program from a script, and in __float128 from SPEC 5 alone, one ray
 * through each pixel's centre. Where roundings may decide what a pixel sees, the oracle gives an interval. */
#ifndef RT_TESTS_STABILITY_QUAD_SCENE_H
#define RT_TESTS_STABILITY_QUAD_SCENE_H

#include "stability/picture.h"
#include "support/oracle.h"

enum { QUAD_SOLIDS = 12, QUAD_LIGHTS = 2 };

typedef struct {
    bool box;            /* otherwise a sphere */
    double at[3];        /* a box' least corner, a sphere's centre */
    double size[3];      /* a box' sides; a sphere's radius is size[0] */
    double kd[3], mirror;
} QuadSolid;

typedef struct { double at[3], colour[3], falloff[3]; } QuadLight;

typedef struct {
    QuadSolid solid[QUAD_SOLIDS];
    int solids;
    QuadLight light[QUAD_LIGHTS];
    int lights;
    double ambient[3], background[3];
    double eye[3], view[3], up[3], fov_deg;
    uint32_t width, height, max_depth;
    double slack;        /* how far roundings may move a surface, a light or the eye */
    double turn;         /* by what angle they may turn the camera */
} QuadScene;

/* Sine and cosine to about 110 bits, |x| at most 4. */
void q_sincos(Quad x, Quad *sine, Quad *cosine);
Quad q_pi(void);

Picture quad_scene_picture(const QuadScene *scene);

/* A trial per pixel: within a level of the oracle's colour, or, where surfaces grown or shrunk by `slack` give another
 * colour, between those. Returns the number of pixels that needed the interval. */
uint64_t quad_scene_compare(Row *row, const QuadScene *scene, const Picture *picture, const char *what);

/* Both, and a trial more: no more than a share of the pixels needed the interval. */
void quad_scene_check(Row *row, const QuadScene *scene, double undecided, const char *what);

#endif
