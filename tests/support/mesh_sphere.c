#include "support/mesh_sphere.h"

#include <stdlib.h>

#include "support/check.h"

Mesh *mesh_sphere(uint32_t rings, uint32_t sectors, Vec3 centre)
{
    Mesh *m = calloc(1, sizeof *m);
    CHECK(m);
    m->position = malloc(((rings - 1) * sectors + 2) * sizeof *m->position);
    m->triangle = malloc(2 * rings * sectors * sizeof *m->triangle);
    CHECK(m->position && m->triangle);
    m->position[m->position_count++] = vec3_add(centre, vec3_make(0, 1, 0));
    for (uint32_t r = 1; r < rings; r++)
        for (uint32_t s = 0; s < sectors; s++) {
            double a = M_PI * r / rings, b = 2 * M_PI * s / sectors;
            m->position[m->position_count++] = vec3_add(centre, vec3_make(sin(a) * sin(b), cos(a), sin(a) * cos(b)));
        }
    m->position[m->position_count++] = vec3_add(centre, vec3_make(0, -1, 0));
    uint32_t south = m->position_count - 1;
    for (uint32_t r = 0; r < rings; r++)
        for (uint32_t s = 0; s < sectors; s++) {
            uint32_t t = (s + 1) % sectors;
            uint32_t a = 1 + (r - 1) * sectors + s, b = 1 + (r - 1) * sectors + t;
            uint32_t c = 1 + r * sectors + s, d = 1 + r * sectors + t;
            uint32_t tri[2][3] = {{a, c, b}, {b, c, d}};
            if (r == 0) tri[1][0] = 0;
            if (r == rings - 1) tri[0][1] = south;
            for (int k = r == 0; k < 2 - (r == rings - 1); k++) {
                for (int j = 0; j < 3; j++) m->triangle[m->triangle_count][j] = tri[k][j];
                m->triangle_count++;
            }
        }
    return m;
}
