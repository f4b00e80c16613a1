/* Cases that cases_primitive.c lists and other files of this folder run. */
#ifndef RT_TESTS_STABILITY_CASES_PRIMITIVE_H
#define RT_TESTS_STABILITY_CASES_PRIMITIVE_H

#include "stability/stability.h"

/* cases_primitive_placed.c: primitives under affine maps, and the script's errors about them. */
void ellipsoid_coverage(Row *row, uint64_t trials);
void ellipsoid_normals(Row *row, uint64_t trials);
void bad_arguments(Row *row, uint64_t trials);
void sheared_normals(Row *row, uint64_t trials);
void needle_and_disc(Row *row, uint64_t trials);

/* cases_primitive_roots.c */
void quartics(Row *row, uint64_t trials);
void quadratics(Row *row, uint64_t trials);

#endif
