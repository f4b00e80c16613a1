/* Scenes of spheres and boxes, drawn twice: by the program from a script, and in __float128 from SPEC 5 alone, one ray
 * through each pixel's centre. Where roundings may decide what a pixel sees, the oracle gives an interval. */
#ifndef RT_TESTS_STABILITY_QUAD_SCENE_H
#define RT_TESTS_STABILITY_QUAD_SCENE_H

#include "stability/picture.h"
#include "support/oracle.h"

enum { QUAD_SOLIDS = 12, QUAD_LIGHTS = 2 };

/* What the script makes of a solid: the primitive, a mesh of 12 triangles (boxes only), the primitive united with one of
 * half its size in its middle. */
typedef enum { MADE_PLAIN, MADE_MESH, MADE_CSG } QuadMaking;

typedef struct {
    bool box;            /* otherwise a sphere */
    QuadMaking making;
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

/* How far roundings move a surface, in spacings of the numbers at the greatest coordinate: the inverse's translation (7
 * roundings of products that add up to the coordinate), the ray's origin carried by it (4, of twice the coordinate) and the
 * hit carried back (4, of twice): 23 roundings, each half a spacing or less; sqrt(3) for three axes makes 20. */
#define QUAD_SPACINGS 20

void quad_set3(double out[3], double x, double y, double z);
void quad_set_vec(double out[3], Vec3 v);
QuadSolid quad_sphere(double x, double y, double z, double radius);
QuadSolid quad_box(double x, double y, double z, double w, double h, double l);
void quad_look_at(QuadScene *s, Vec3 p);
void quad_add_light(QuadScene *s, Vec3 at, double brightness, double c0, double c1, double c2);

/* Sine and cosine to about 110 bits, |x| at most 4. */
void q_sincos(Quad x, Quad *sine, Quad *cosine);
Quad q_pi(void);

Picture quad_scene_picture(const QuadScene *scene);

/* A trial per pixel: within a level of the oracle's colour, or, where surfaces grown or shrunk by `slack` give another
 * colour, between those. Returns the number of pixels that needed the interval. */
uint64_t quad_scene_compare(Row *row, const QuadScene *scene, const Picture *picture, const char *what);

/* Both; the number is added to *undecided. */
void quad_scene_check(Row *row, const QuadScene *scene, uint64_t *undecided, const char *what);

/* A trial at a row's end: no more than a share of its pixels needed the interval. */
void quad_scene_decided(Row *row, uint64_t undecided, double share);

#endif
