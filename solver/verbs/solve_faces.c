#include "solver/verbs/solve_faces.h"

#include <stdlib.h>

lam_status solve_faces_find(const char *path, mesh *m, face_index *out, lam_error *error) {
    if (m->faces.of == NULL)
        return status_fail(error, LAM_ERR_ARGUMENT,
                           "%s: --at faces: the store does not know the faces of its scene file, as older "
                           "ones do not; precompute the scene again",
                           path);
    return face_index_make(m->n, m->n - m->n_backs, m->area, &m->faces, out, error);
}

lam_status solve_faces_take(const face_index *faces, float **values, refined_light *refined, solution *s,
                            lam_error *error) {
    lam_status status = LAM_OK;
    const face_choice all = {.n = faces->n_faces};
    const size_t C = s->m->n_channels, rows = s->n_vectors * C;
    float *means = NULL;
    double *fine = NULL;
    if (*values != NULL) {
        means = memory_allocate(rows, all.n * sizeof *means, "values of faces", error);
        if (means == NULL) TRY(LAM_ERR_MEMORY);
        face_means_floats(faces, &all, rows, *values, means);
        free(*values);
        s->values = *values = means;
    } else {
        fine = memory_allocate(rows, all.n * sizeof *fine, "values of faces", error);
        if (fine == NULL) TRY(LAM_ERR_MEMORY);
        for (size_t v = 0; v < s->n_vectors; v++) {
            double rounding = 0;
            face_means_doubles(faces, &all, C, refined->values + v * C * s->m->n, fine + v * C * all.n,
                               &rounding);
            refined->certificates[v] += rounding;
        }
        free(refined->values);
        s->refined = refined->values = fine;
    }
    s->faces = faces;
done:
    return status;
}
