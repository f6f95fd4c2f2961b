#include "support/plates.h"

mesh plates(const double *occluder) {
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

void plates_move(mesh *m, double scale, double offset) {
    for (size_t i = 0; i < m->n_vertices; i++)
        for (int d = 0; d < 3; d++) m->vertices[i][d] = m->vertices[i][d] * scale + offset;
    lam_error error = {0};
    ck_assert_msg(mesh_measure(m, &error) == LAM_OK, "%s", error.message);
}
