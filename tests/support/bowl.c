#include "support/bowl.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void add_triangle(mesh *m, size_t a, size_t b, size_t c) {
    const uint32_t corners[4] = {(uint32_t)a, (uint32_t)b, (uint32_t)c, MESH_NO_VERTEX};
    memcpy(m->elements[m->n++], corners, sizeof corners);
}

mesh bowl(size_t rings, size_t sectors, double depth, bool lid) {
    lam_error error = {.message = ""};
    const size_t n = sectors * (2 * rings - 1 + lid), n_vertices = 2 + rings * sectors;
    mesh m = {.n_vertices = n_vertices, .n_groups = 1, .n_channels = 1, .unit = 1, .up = 'z'};
    m.vertices = calloc(n_vertices, sizeof *m.vertices);
    m.elements = calloc(n, sizeof *m.elements);
    m.group = calloc(n, sizeof *m.group);
    m.group_names = malloc(sizeof *m.group_names + sizeof "bowl");
    m.reflectance = calloc(n, sizeof *m.reflectance);
    m.emission = calloc(n, sizeof *m.emission);
    ck_assert(m.vertices != NULL && m.elements != NULL && m.group != NULL && m.group_names != NULL &&
              m.reflectance != NULL && m.emission != NULL);
    m.group_names[0] = memcpy((char *)(m.group_names + 1), "bowl", sizeof "bowl");
    for (size_t i = 0; i < n; i++) m.reflectance[i] = .5f;
    m.vertices[0][2] = -depth;
    for (size_t ring = 1; ring <= rings; ring++)
        for (size_t k = 0; k < sectors; k++) {
            const double polar = M_PI / 2 * (double)ring / (double)rings,
                         around = 2 * M_PI * (double)k / (double)sectors;
            double *v = m.vertices[1 + (ring - 1) * sectors + k];
            v[0] = sin(polar) * cos(around);
            v[1] = sin(polar) * sin(around);
            v[2] = -depth * cos(polar);
        }
    for (size_t ring = 0; ring < rings; ring++)
        for (size_t k = 0; k < sectors; k++) {
            const size_t next = (k + 1) % sectors, upper = 1 + ring * sectors, lower = upper - sectors;
            if (ring > 0) add_triangle(&m, lower + k, upper + k, upper + next);
            add_triangle(&m, ring > 0 ? lower + k : 0, ring > 0 ? upper + next : upper + k,
                         ring > 0 ? lower + next : upper + next);
        }
    for (size_t k = 0; lid && k < sectors; k++) {
        const size_t rim = 1 + (rings - 1) * sectors;
        add_triangle(&m, n_vertices - 1, rim + (k + 1) % sectors, rim + k);
    }
    ck_ok(mesh_measure(&m, &error));
    return m;
}
