/* Solids to write down as expressions, rays to try them with, a way to compare them along a line, and an oracle that
 * knows them only as sets of points, in __float128. */
#ifndef RT_SUPPORT_SOLIDS_H
#define RT_SUPPORT_SOLIDS_H

#include "common/rng.h"
#include "node/csg/csg.h"

__extension__ typedef __float128 Quad;

enum { MAX_TOKENS = 32 };
enum { SPHERE, CUBE, CYLINDER, CONE, TORUS, ANALYTIC_SHAPES, CLOSED_MESH = ANALYTIC_SHAPES, SHAPES };

typedef struct { CsgToken token[MAX_TOKENS]; size_t count; } Expr;

/* Between create and destroy. */
extern Prim *solid_shape[SHAPES];
extern Scratch solid_scratch;

void solids_create(void);
void solids_destroy(void);

Expr solid_leaf(int kind, Affine m);
Expr solid_op(CsgOp o, Expr a, Expr b);
Expr solid_unite(Expr a, Expr b);
Expr solid_minus(Expr a, Expr b);
Expr solid_meet(Expr a, Expr b);
Affine solid_then(Affine first, Affine second);

/* All leaves moved by one more matrix. */
Expr solid_moved(Expr e, Affine m);

Expr solid_box(double x0, double y0, double z0, double x1, double y1, double z1);
Expr solid_rod(double radius, double y0, double y1);

/* The laws of set algebra for any solids A, B, C and A', which is A by other roundings; U is a large box. A right side
 * without tokens is the empty solid. */
enum { SOLID_LAWS = 18 };
typedef struct { Expr left, right; } Law;
extern const char *const SOLID_LAW_NAMES[SOLID_LAWS];

void solid_laws(Law law[SOLID_LAWS], Expr a, Expr a2, Expr b, Expr c);

/* The caller frees it with prim_destroy. */
Prim *solid_prim(const Expr *e);

double solid_uniform(Rng *rng, double lo, double hi);
Vec3 solid_random_point(Rng *rng, double reach);
Affine solid_random_pose(Rng *rng);

/* The same place by other roundings. */
Affine solid_roundabout(Affine m, Rng *rng);

enum { RAY_RANDOM, RAY_AXIS, RAY_EDGE, RAY_FAR, RAY_KINDS };
extern const char *const SOLID_RAY_NAMES[];

Ray solid_random_ray(Rng *rng, int kind, const Expr *e);

/* What of the line is inside, in solid_scratch. */
SegList solid_segments(const Prim *prim, const Ray *ray);
const Edge *solid_edge(const SegList *list, uint32_t i);

void solid_print_ray(const char *name, const Ray *ray);
void solid_print_list(const char *name, const SegList *list);

/* The greatest thickness of a Difference that two ways to make the same solid may have. The place of a face on a line has
 * 24 roundings behind it, each of a sum of coordinates: 16 of the matrix or of its inverse, whichever was rounded more (up to
 * four products of four roundings), 4 of the ray's origin and 4 of its way in the leaf's space. The absolute values in the
 * rows of a rotation and of its inverse add up to sqrt(3) each, so along the normal that is 24 x 3 for one face, and there
 * are two. A', placed by eight products, gets no more. */
#define SOLID_THICKEST 144

/* The oracle: each leaf's inverse (of the analytic shapes), and whether the list is inside where the set of points is. */
typedef struct { Quad m[3][4]; } QAffine;

QAffine solid_q_inverse(const Affine *a);
bool solid_agrees(const Expr *e, const QAffine *inverse, const SegList *list, const Ray *ray);

/* The surfaces of all leaves of two expressions (of b without tokens: of one). */
typedef struct {
    size_t count;
    double reach;  /* the greatest coordinate of any leaf */
    const Prim *prim[2 * MAX_TOKENS];
    QAffine inverse[2 * MAX_TOKENS];
} Faces;

Faces solid_faces(const Expr *a, const Expr *b);

/* What of the line is inside in one list and not in the other.
 * `thickness`: of the thickest part, how far from the nearest surface the line gets in it, along the normal and not along
 * the line, in __float128 and whatever the lists claim of their bounds; in units of u times the greatest coordinate of
 * the ray's origin, of its way and of the leaves.
 * `unclaimed`: whether a part is longer than twice the bounds of its ends. A part along a surface, longer than 2^10 times
 * its thickness, is left to its thickness: there the roundings decide whether there is a crossing at all, and one list
 * has no end that could tell. */
typedef struct { double thickness; bool unclaimed; } Difference;

Difference solid_difference(const Faces *faces, const SegList *a, const SegList *b, const Ray *ray);

#endif
