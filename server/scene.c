#include "server/scene.h"

#include "server/scene_description.h"
#include "solver/operator/operator.h"
#include "solver/operator/sky.h"
#include "store/store.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What a scene may keep of adjoint rows. */
#define ADJOINT_ROWS_BYTES ((size_t)256 << 20)

/* The total error that an answer carries: the scene's own lights, else single elements, else none. */
static void read_error(store *s, scene *made) {
    static const char *const groups[] = {"/error/lights", "/error/single"};
    for (size_t i = 0; i < 2 && !made->has_error; i++)
        made->has_error =
            store_has(s, groups[i]) && store_has_attribute(s, groups[i], "total_relative_mean") &&
            store_has_attribute(s, groups[i], "total_indirect_mean") &&
            store_get_number(s, groups[i], "total_relative_mean", &made->relative_mean, NULL) == LAM_OK &&
            store_get_number(s, groups[i], "total_indirect_mean", &made->indirect_mean, NULL) == LAM_OK &&
            isfinite(made->relative_mean) && isfinite(made->indirect_mean);
}

static lam_status read_groups(store *s, scene *made, lam_error *error) {
    lam_status status = LAM_OK;
    void *group = NULL;
    char **names = NULL;
    size_t n_groups = 0;
    lam_error cause;
    TRY(store_read(s, "/mesh/group", STORE_U32, 1, (size_t[]){made->n}, &group, error));
    TRY(store_read_texts(s, "/mesh/group_names", &n_groups, &names, error));
    status = group_index_make(made->n, group, n_groups, names, &made->groups, &cause);
    if (status != LAM_OK) FAIL(error, status, "%s: %s", made->path, cause.message);
done:
    free(group);
    return status;
}

static lam_status read_area(store *s, scene *made, lam_error *error) {
    lam_status status = LAM_OK;
    void *area = NULL;
    TRY(store_read(s, "/mesh/area", STORE_F64, 1, (size_t[]){made->n}, &area, error));
    made->area = area;
    for (size_t i = 0; i < made->n; i++)
        if (!(made->area[i] >= 0 && isfinite(made->area[i])))
            FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/area[%zu] = %g, must be at least 0", made->path, i,
                 made->area[i]);
done:
    return status;
}

lam_status scene_open(const char *path, const char *name, bool verify, pthread_mutex_t *stores, scene **out,
                      lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL;
    scene *made = memory_allocate(1, sizeof *made, path, error);
    if (made == NULL) return LAM_ERR_MEMORY;
    atomic_init(&made->references, 1);
    made->path = strdup(path);
    if (made->path == NULL) FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory", path);
    TRY(store_open(path, &s, error));
    if (verify) TRY(store_verify(s, error));
    if (name != NULL)
        made->name = strdup(name);
    else
        TRY(store_get_text(s, "/", "name", &made->name, error));
    if (made->name == NULL) FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory", path);
    if (made->name[0] == '\0')
        FAIL(error, LAM_ERR_FORMAT, "%s: the store's name is empty; give it one: %s:NAME", path, path);
    TRY(operator_load(s, &made->op, error));
    made->n = lam_operator_elements(made->op);
    made->n_channels = lam_operator_channels(made->op);
    made->reflectance = made->op->reflectance;
    TRY(sky_load(s, made->n, &made->sky, error));
    made->n_emitters = lam_operator_emitters(made->op);
    TRY(read_groups(s, made, error));
    TRY(read_area(s, made, error));
    TRY(adjoint_rows_create(ADJOINT_ROWS_BYTES, &made->rows, error));
    TRY(store_group_bytes(s, "/operator", &made->bytes, error));
    read_error(s, made);
    TRY(refined_create(s, made->op, stores, &made->refined, error));
    TRY(scene_describe(s, made, &made->description, error));
    *out = made;
    made = NULL;
done:
    store_close(s);
    if (made != NULL) scene_release(made);
    return status;
}

scene *scene_acquire(scene *s) {
    atomic_fetch_add(&s->references, 1);
    return s;
}

void scene_release(scene *s) {
    if (atomic_fetch_sub(&s->references, 1) != 1) return;
    refined_destroy(s->refined);
    lam_operator_close(s->op);
    lam_sky_close(s->sky);
    adjoint_rows_destroy(s->rows);
    group_index_free(&s->groups);
    free(s->area);
    free(s->description);
    free(s->name);
    free(s->path);
    free(s);
}
