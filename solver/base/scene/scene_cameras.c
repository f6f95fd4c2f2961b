#include "solver/base/scene/scene_cameras.h"

#include "solver/base/utf8.h"
#include "solver/base/vector3.h"
#include "store/groups.h"
#include "store/status.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Divides by the length; false where that is too small or no number. */
static bool make_unit(double v[3]) {
    const double length = sqrt(dot3(v, v));
    if (!(length > 1e-12) || !isfinite(length)) return false;
    for (int d = 0; d < 3; d++) v[d] /= length;
    return true;
}

bool scene_camera_settle(scene_camera *c) {
    scene_camera made = *c;
    if (!(made.fov >= 1 && made.fov <= 170)) return false;
    for (int d = 0; d < 3; d++)
        if (!(fabs(made.eye[d]) < 1e30)) return false;
    if (!make_unit(made.direction) || !make_unit(made.up)) return false;
    const double along = dot3(made.up, made.direction);
    for (int d = 0; d < 3; d++) made.up[d] -= along * made.direction[d];
    if (!(dot3(made.up, made.up) > 1e-12) || !make_unit(made.up)) return false;
    *c = made;
    return true;
}

const scene_camera *scene_camera_find(size_t n, const scene_camera *cameras, const char *name) {
    for (size_t k = 0; k < n; k++)
        if (strcmp(cameras[k].name, name) == 0) return &cameras[k];
    return NULL;
}

/* The numbers of one dataset: [n][3], of eyes, directions or ups. */
static const char *const vectors[] = {STORE_CAMERAS "/eye", STORE_CAMERAS "/direction", STORE_CAMERAS "/up"};

static double *vector_of(scene_camera *c, size_t which) {
    return which == 0 ? c->eye : which == 1 ? c->direction : c->up;
}

lam_status scene_cameras_save(size_t n, const scene_camera *cameras, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t dims[2] = {n, 3};
    const char **names = NULL;
    double(*numbers)[3] = NULL, *fov = NULL;
    if (n == 0) return LAM_OK;
    names = memory_allocate(n, sizeof *names, "cameras", error);
    numbers = memory_allocate(n, sizeof *numbers, "cameras", error);
    fov = memory_allocate(n, sizeof *fov, "cameras", error);
    if (names == NULL || numbers == NULL || fov == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < n; k++) {
        names[k] = cameras[k].name;
        fov[k] = cameras[k].fov;
    }
    TRY(store_write_texts(s, STORE_CAMERAS "/names", n, names, error));
    for (size_t which = 0; which < 3; which++) {
        for (size_t k = 0; k < n; k++) {
            scene_camera c = cameras[k];
            memcpy(numbers[k], vector_of(&c, which), sizeof numbers[k]);
        }
        TRY(store_write(s, vectors[which], STORE_F64, 2, dims, numbers, error));
    }
    TRY(store_write(s, STORE_CAMERAS "/fov", STORE_F64, 1, &n, fov, error));
done:
    free(names);
    free(numbers);
    free(fov);
    return status;
}

static lam_status take_names(store *s, size_t n, char *const *names, scene_camera *cameras,
                             lam_error *error) {
    lam_status status = LAM_OK;
    for (size_t k = 0; k < n; k++) {
        const size_t length = strlen(names[k]);
        if (length >= sizeof cameras[k].name || !utf8_is_valid(names[k], length))
            FAIL(error, LAM_ERR_FORMAT, "%s: /cameras/names[%zu] is no UTF-8 of less than %zu bytes",
                 store_path(s), k, sizeof cameras[k].name);
        memcpy(cameras[k].name, names[k], length + 1);
    }
done:
    return status;
}

lam_status scene_cameras_load(store *s, size_t *n, scene_camera **out, lam_error *error) {
    lam_status status = LAM_OK;
    char **names = NULL;
    scene_camera *made = NULL;
    void *data = NULL;
    size_t count = 0;
    if (!store_has(s, STORE_CAMERAS)) {
        *n = 0;
        *out = NULL;
        return LAM_OK;
    }
    TRY(store_read_texts(s, STORE_CAMERAS "/names", &count, &names, error));
    if (count == 0 || count > SCENE_CAMERAS_MOST)
        FAIL(error, LAM_ERR_FORMAT, "%s: /cameras holds %zu cameras, must be 1 to %d", store_path(s), count,
             SCENE_CAMERAS_MOST);
    made = memory_allocate(count, sizeof *made, "cameras", error);
    if (made == NULL) TRY(LAM_ERR_MEMORY);
    TRY(take_names(s, count, names, made, error));
    for (size_t which = 0; which < 3; which++) {
        size_t dims[2] = {count, 3};
        TRY(store_read(s, vectors[which], STORE_F64, 2, dims, &data, error));
        for (size_t k = 0; k < count; k++)
            memcpy(vector_of(&made[k], which), (const double *)data + 3 * k, 3 * sizeof(double));
        free(data);
        data = NULL;
    }
    TRY(store_read(s, STORE_CAMERAS "/fov", STORE_F64, 1, &count, &data, error));
    for (size_t k = 0; k < count; k++) {
        made[k].fov = ((const double *)data)[k];
        if (!scene_camera_settle(&made[k]))
            FAIL(error, LAM_ERR_FORMAT,
                 "%s: /cameras: camera %zu has no direction, no up, or a field of view of %g degrees",
                 store_path(s), k, made[k].fov);
    }
    *n = count;
    *out = made;
    made = NULL;
done:
    free(names);
    free(made);
    free(data);
    return status;
}
