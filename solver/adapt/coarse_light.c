#include "solver/adapt/coarse_light.h"

#include "solver/base/random.h"
#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/source.h"
#include "solver/method/reference.h"
#include "solver/scene/lit_groups.h"
#include "solver/scene/mesh_cells.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Rays of each element, 256 of COARSE_ELEMENTS of them and fewer, down to 64, of more: it is the sum of the
 * rays that meet a face from which its light at points has little noise. */
enum { RAYS_MOST = 256, RAYS_LEAST = 64 };
static const double tolerance = 1e-4;

void coarse_light_free(coarse_light *c) {
    mesh_free(&c->m);
    free(c->first);
    free(c->back);
    free(c->E);
    free(c->B);
    free(c->first_light);
    sky_bounce_free(&c->bounce);
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

static size_t rays_of(size_t elements) {
    size_t rays = RAYS_MOST;
    while (rays > RAYS_LEAST && rays * elements > 2 * (size_t)RAYS_MOST * COARSE_ELEMENTS) rays /= 2;
    return rays;
}

/* Both directions of an exchange are entries of 8 bytes, beside half as much while rows are merged. */
double coarse_light_bytes(size_t faces) {
    const size_t n = faces > 2 * COARSE_ELEMENTS ? faces : 2 * COARSE_ELEMENTS;
    return 24. * (double)rays_of(n) * (double)n;
}

/* The light that is there without a bounce: an emission, or of the sky rho H0. */
static double first_of(const coarse_light *c, size_t light, size_t channel, size_t i) {
    const size_t n = c->m.n, at = channel * n + i;
    if (c->sky && light == c->n_lights - 1)
        return (double)c->m.reflectance[at] * (double)c->bounce.first_bounce[i];
    const double direct =
        light == 0 && c->first_light != NULL ? (double)c->m.reflectance[at] * (double)c->first_light[at] : 0;
    return (double)c->E[light * c->m.n_channels * n + at] + direct;
}

/* The middle of an element, and places half the way to its corners. */
static size_t place_points(const mesh *m, size_t i, double points[5][3]) {
    const size_t corners = m->elements[i][3] == MESH_NO_VERTEX ? 3 : 4;
    mesh_centroid(m, i, points[0]);
    for (size_t k = 0; k < corners; k++)
        for (int d = 0; d < 3; d++) points[k + 1][d] = (points[0][d] + m->vertices[m->elements[i][k]][d]) / 2;
    return corners + 1;
}

/* The direct light of elements, by a few points of each. */
static lam_status light_first(const gather_direct *direct, uint64_t seed, coarse_light *c, lam_error *error) {
    const size_t n = c->m.n, C = c->m.n_channels;
    if (direct == NULL) return LAM_OK;
    c->first_light = memory_allocate(C, n * sizeof *c->first_light, "a coarse solution", error);
    if (c->first_light == NULL) return LAM_ERR_MEMORY;
#pragma omp parallel for schedule(dynamic, 64)
    for (size_t i = 0; i < n; i++) {
        double points[5][3], E[5 * GATHER_HALVES * 3] = {0};
        const double normal[3] = {(double)c->m.normal[i][0], (double)c->m.normal[i][1],
                                  (double)c->m.normal[i][2]};
        const size_t count = place_points(&c->m, i, points), rows = count * GATHER_HALVES;
        direct->add(direct->context, normal, random_hash(random_hash(seed) ^ random_hash(i + 1)), count,
                    (const double(*)[3])points, C, E);
        for (size_t k = 0; k < C; k++) {
            double sum = 0;
            for (size_t r = 0; r < rows; r++) sum += E[r * C + k];
            c->first_light[k * n + i] = (float)(sum / (double)rows);
        }
    }
    return LAM_OK;
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
            for (size_t i = 0; i < n; i++) E[l * n + i] = B[l * n + i] = first_of(c, l, k, i);
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

static lam_status set_lights(const mesh *faces, const coarse_sources *from, coarse_light *c,
                             lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = c->m.n, vector = n * c->m.n_channels;
    uint8_t *light_of = memory_allocate(faces->n_groups, sizeof *light_of, "a coarse solution", error);
    if (light_of == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < vector; i++) c->lamps = c->lamps || c->m.emission[i] > 0;
    c->lamps = c->lamps || from->direct != NULL;
    c->sky = from->sky != NULL;
    if (!c->lamps && !c->sky) TRY(lit_groups_find(faces, COARSE_LIT, light_of, &c->n_lit, error));
    c->n_lights = 1 + coarse_light_even(c) + c->sky;
    c->E = memory_allocate(c->n_lights * vector, sizeof *c->E, "a coarse solution", error);
    c->B = memory_allocate(c->n_lights * vector, sizeof *c->B, "a coarse solution", error);
    if (c->E == NULL || c->B == NULL) TRY(LAM_ERR_MEMORY);
    if (c->lamps) memcpy(c->E, c->m.emission, vector * sizeof *c->E);
    for (size_t k = 0; k < c->n_lit * vector; k++) {
        const uint32_t group = c->m.group[k % n]; /* backs have their own, behind the others */
        c->E[k] = group < faces->n_groups && light_of[group] == k / vector ? 1 : 0;
    }
    for (size_t i = 0; i < vector; i++) c->E[coarse_light_even(c) * vector + i] = 1;
done:
    free(light_of);
    return status;
}

/* The ground below a sky of radiance 1 receives pi, and reflects its albedo of it. */
static void set_radiances(const coarse_sky *sky, coarse_light *c) {
    double *const L = c->L + 2 * (c->n_lights - 1);
    if (sky == NULL) return;
    L[0] = 1;
    L[1] = sky->ground_albedo;
}

lam_status coarse_light_make(const mesh *faces, const coarse_sources *from, uint64_t seed, const progress *p,
                             coarse_light *out, lam_error *error) {
    lam_status status = LAM_OK;
    coarse_light c = {.n_lights = 0};
    form_factors f = {.row_sums = NULL};
    uint32_t *order = NULL;
    const coarse_sky *const sky = from->sky;
    TRY(divide(faces, &c, error));
    TRY(make_backs(faces, &c, error));
    TRY(set_lights(faces, from, &c, error));
    TRY(light_first(from->direct, seed, &c, error));
    order = memory_allocate(c.m.n, sizeof *order, "a coarse mesh", error);
    if (order == NULL) TRY(LAM_ERR_MEMORY);
    TRY(mesh_z_order(&c.m, order, error));
    const form_factor_options how = {.recipe = {.rays = rays_of(c.m.n), .seed = seed},
                                     .progress = p,
                                     .stage = "form factors of a coarse mesh",
                                     .sky = sky != NULL ? "grid:1x1" : NULL,
                                     .ground_albedo = sky != NULL ? sky->ground_albedo : 0,
                                     .openings = sky != NULL ? sky->openings : NULL};
    TRY(form_factors_make(&c.m, order, &how, &f, error));
    if (f.F.indptr == NULL) TRY(form_factors_expand(&f, c.m.area, error));
    c.bounce = f.sky;
    f.sky = (sky_bounce){.n = 0};
    set_radiances(sky, &c);
    TRY(solve(&f, p, &c, error));
    *out = c;
    c = (coarse_light){.n_lights = 0};
done:
    form_factors_free(&f);
    coarse_light_free(&c);
    free(order);
    return status;
}
