/* Two facing unit squares with something between them, at several scales and places. */
#ifndef LAMBERT_TESTS_PLATES_H
#define LAMBERT_TESTS_PLATES_H

#include "support/box.h"

/* Unit squares at z = 0 (up) and z = 1 (down), with an occluder between that has both its faces. */
static inline mesh plates(const double *occluder) {
    mesh m = {0};
    const box_cell low = {.axis = 2, .level = 0, .from = {0, 0, 0}, .to = {1, 1, 0}};
    const box_cell high = {.axis = 2, .level = 1, .from = {0, 0, 1}, .to = {1, 1, 1}};
    mesh_add_cell(&m, &low, true);
    mesh_add_cell(&m, &high, false);
    if (occluder != NULL) {
        const box_cell cell = {.axis = 2,
                               .level = .5,
                               .from = {occluder[0], occluder[2], .5},
                               .to = {occluder[1], occluder[3], .5}};
        mesh_add_cell(&m, &cell, true);
        mesh_add_cell(&m, &cell, false);
    }
    mesh_finish(&m, .5f);
    return m;
}

static inline void plates_move(mesh *m, double scale, double offset) {
    for (size_t i = 0; i < m->n_vertices; i++)
        for (int d = 0; d < 3; d++) m->vertices[i][d] = m->vertices[i][d] * scale + offset;
    lam_error error = {0};
    ck_assert_msg(mesh_measure(m, &error) == LAM_OK, "%s", error.message);
}

/* F from one to the other (the first without an occluder), and what hides one from the other entirely. */
static const struct {
    double occluder[4]; /* x from, to, y from, to */
    double F;
} plates_cases[] = {{{0}, .199824895698},
                    {{0, .5, 0, .5}, .149868671774},
                    {{0, .5, 0, 1}, .099912447849},
                    {{.25, .75, .25, .75}, .099506294599}};
static const double plates_hidden[4] = {0, 1, 0, 1};

static const double plates_places[][2] = {{1, 0}, {1, 1e6}, {1e-3, 0}, {1e3, 0}};

#endif
