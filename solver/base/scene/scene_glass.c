#include "solver/base/scene/scene_glass.h"

#include "store/groups.h"
#include "store/status.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define DATASET STORE_MESH "/glass"
#define LAW "glass_law"
#define GIVEN "glass_given"
static const char law_angle[] = "angle", law_none[] = "none";

const char *glass_law_word(const scene_glass *glass) {
    return glass->by_angle ? law_angle : law_none;
}

double glass_passes(const struct group_glass *glass, bool by_angle, double cosine) {
    const double c = fmin(fmax(cosine, 0), 1), sine = sqrt(1 - c * c);
    const double g = by_angle ? fmin(1, 1.018 * c * (1 + sine * sine * sine)) : 1;
    const double whole = glass->transmittance * g;
    return glass->faces > 1 ? pow(whole, 1 / glass->faces) : whole;
}

double glass_row_most(const struct group_glass *of, size_t n) {
    double largest = 0, part = 1, sum = 1;
    for (size_t g = 0; g < n; g++) largest = fmax(largest, glass_passes(&of[g], false, 1));
    for (int k = 0; k < PANES_MOST; k++) sum += part *= largest;
    return sum;
}

lam_status glass_row_most_of(store *s, double *out, lam_error *error) {
    lam_status status = LAM_OK;
    scene_glass glass = {.of = NULL};
    store_type type;
    size_t dims[STORE_MAX_RANK] = {0};
    int rank;
    *out = 1;
    if (!store_has(s, DATASET)) return LAM_OK;
    TRY(store_array_info(s, DATASET, &type, &rank, dims, error));
    TRY(scene_glass_load(s, dims[0], &glass, error));
    *out = glass_row_most(glass.of, dims[0]);
done:
    free(glass.of);
    return status;
}

lam_status scene_glass_save(const scene_glass *glass, size_t n_groups, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t shape[2] = {n_groups, 2};
    if (glass->of == NULL) return LAM_OK;
    TRY(store_write(s, DATASET, STORE_F64, 2, shape, glass->of, error));
    TRY(store_set_text(s, STORE_MESH, LAW, glass_law_word(glass), error));
    if (glass->given) TRY(store_set_integer(s, STORE_MESH, GIVEN, 1, error));
done:
    return status;
}

lam_status scene_glass_load(store *s, size_t n_groups, scene_glass *out, lam_error *error) {
    lam_status status = LAM_OK;
    char *law = NULL;
    void *data = NULL;
    *out = (scene_glass){.of = NULL};
    if (!store_has(s, DATASET)) return LAM_OK;
    TRY(store_get_text(s, STORE_MESH, LAW, &law, error));
    if (strcmp(law, law_angle) != 0 && strcmp(law, law_none) != 0)
        FAIL(error, LAM_ERR_FORMAT, "%s: /mesh attribute " LAW " is '%.20s', must be angle or none",
             store_path(s), law);
    TRY(store_read(s, DATASET, STORE_F64, 2, (size_t[]){n_groups, 2}, &data, error));
    const struct group_glass *of = data;
    for (size_t g = 0; g < n_groups; g++) {
        if (!(of[g].transmittance >= 0 && of[g].transmittance <= 1))
            FAIL(error, LAM_ERR_FORMAT, "%s: " DATASET "[%zu][0] = %g, must be from 0 to 1", store_path(s), g,
                 of[g].transmittance);
        if (of[g].transmittance > 0 && !(of[g].faces >= 1 && of[g].faces <= GLASS_FACES_MOST))
            FAIL(error, LAM_ERR_FORMAT, "%s: " DATASET "[%zu][1] = %g, must be from 1 to %d", store_path(s),
                 g, of[g].faces, GLASS_FACES_MOST);
    }
    *out = (scene_glass){.of = data,
                         .by_angle = strcmp(law, law_angle) == 0,
                         .given = store_has_attribute(s, STORE_MESH, GIVEN)};
    data = NULL;
done:
    free(law);
    free(data);
    return status;
}
