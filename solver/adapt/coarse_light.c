#include "solver/adapt/coarse_light.h"

#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/source.h"
#include "solver/method/reference.h"
#include "solver/scene/mesh_cells.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { RAYS = 256 };
static const double tolerance = 1e-4;

void coarse_light_free(coarse_light *c) {
    mesh_free(&c->m);
    free(c->first);
    free(c->back);
    free(c->E);
    free(c->B);
    *c = (coarse_light){.n_lights = 0};
}

/* The faces, divided; first is set. */
static lam_status divide(const mesh *faces, coarse_light *c, lam_error *error) {
    lam_status status = LAM_OK;
    mesh_cell *cells = NULL;
    double area = 0;
    size_t n;
    c->first = memory_allocate(faces->n + 1, sizeof *c->first, "a coarse mesh", error);
    if (c->first == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t f = 0; f < faces->n; f++) area += faces->area[f];
    TRY(mesh_cells_even(faces, area / COARSE_ELEMENTS, 2 * COARSE_ELEMENTS, &cells, &n, error));
    for (size_t i = 0; i < n; i++) c->first[cells[i].face + 1] = (uint32_t)(i + 1);
    TRY(mesh_of_cells(faces, n, cells, &c->m, error));
done:
    free(cells);
    return status;
}

/* Both sides of the faces that have two; back is set. */
static lam_status make_backs(const mesh *faces, coarse_light *c, lam_error *error) {
    uint32_t at = (uint32_t)c->m.n;
    if (faces->has_back == NULL) return LAM_OK;
    c->back = memory_allocate(faces->n, sizeof *c->back, "a coarse mesh", error);
    if (c->back == NULL) return LAM_ERR_MEMORY;
    for (size_t f = 0; f < faces->n; f++) {
        c->back[f] = at;
        if (faces->has_back[f]) at += c->first[f + 1] - c->first[f];
    }
    return mesh_make_backs(&c->m, error);
}

static lam_status solve(const form_factors *f, const progress *p, coarse_light *c, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = c->m.n, channels = c->m.n_channels;
    reference *of = NULL;
    double *E = memory_allocate(2 * c->n_lights * n, sizeof *E, "a coarse solution", error);
    if (E == NULL) TRY(LAM_ERR_MEMORY);
    double *B = E + c->n_lights * n;
    for (size_t k = 0; k < channels; k++) {
        for (size_t l = 0; l < c->n_lights; l++)
            for (size_t i = 0; i < n; i++)
                E[l * n + i] = B[l * n + i] = (double)c->E[(l * channels + k) * n + i];
        TRY(reference_create(&f->F, c->m.area, c->m.reflectance + k * n, REFERENCE_ITERATED, &of, error));
        TRY(reference_solve(of, c->n_lights, E, B, tolerance, p, error));
        reference_destroy(of);
        of = NULL;
        for (size_t l = 0; l < c->n_lights; l++)
            for (size_t i = 0; i < n; i++) c->B[(l * channels + k) * n + i] = (float)B[l * n + i];
    }
done:
    reference_destroy(of);
    free(E);
    return status;
}

static lam_status set_lights(coarse_light *c, lam_error *error) {
    const size_t vector = c->m.n * c->m.n_channels;
    for (size_t i = 0; i < vector; i++) c->lamps = c->lamps || c->m.emission[i] > 0;
    c->n_lights = c->lamps ? COARSE_LIGHTS : 1;
    c->E = memory_allocate(c->n_lights * vector, sizeof *c->E, "a coarse solution", error);
    c->B = memory_allocate(c->n_lights * vector, sizeof *c->B, "a coarse solution", error);
    if (c->E == NULL || c->B == NULL) return LAM_ERR_MEMORY;
    if (c->lamps) memcpy(c->E, c->m.emission, vector * sizeof *c->E);
    for (size_t i = 0; i < vector; i++) c->E[(c->n_lights - 1) * vector + i] = 1;
    return LAM_OK;
}

lam_status coarse_light_make(const mesh *faces, uint64_t seed, const progress *p, coarse_light *out,
                             lam_error *error) {
    lam_status status = LAM_OK;
    coarse_light c = {.n_lights = 0};
    form_factors f = {.row_sums = NULL};
    uint32_t *order = NULL;
    TRY(divide(faces, &c, error));
    TRY(make_backs(faces, &c, error));
    TRY(set_lights(&c, error));
    order = memory_allocate(c.m.n, sizeof *order, "a coarse mesh", error);
    if (order == NULL) TRY(LAM_ERR_MEMORY);
    TRY(mesh_z_order(&c.m, order, error));
    const form_factor_options how = {
        .recipe = {.rays = RAYS, .seed = seed}, .progress = p, .stage = "form factors of a coarse mesh"};
    TRY(form_factors_make(&c.m, order, &how, &f, error));
    if (f.F.indptr == NULL) TRY(form_factors_expand(&f, c.m.area, error));
    TRY(solve(&f, p, &c, error));
    *out = c;
    c = (coarse_light){.n_lights = 0};
done:
    form_factors_free(&f);
    coarse_light_free(&c);
    free(order);
    return status;
}
