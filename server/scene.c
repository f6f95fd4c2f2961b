#include "server/scene.h"

#include "server/scene_description.h"
#include "solver/operator/operator.h"
#include "solver/operator/sky.h"
#include "store/store.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

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

lam_status scene_open(const char *path, const char *name, bool verify, scene **out, lam_error *error) {
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
    TRY(sky_load(s, made->n, &made->sky, error));
    made->n_emitters = lam_operator_emitters(made->op);
    TRY(read_groups(s, made, error));
    TRY(store_get_text(s, "/checksum", "xxh3", &made->checksum, error));
    TRY(store_group_bytes(s, "/operator", &made->bytes, error));
    read_error(s, made);
    TRY(scene_describe(s, made, &made->description, error));
    *out = made;
    made = NULL;
done:
    store_close(s);
    if (made != NULL) scene_release(made);
    return status;
}

bool scene_is_same(const scene *one, const scene *other) {
    /* The checksum is of the arrays, the description of the attributes. */
    return strcmp(one->checksum, other->checksum) == 0 && strcmp(one->description, other->description) == 0;
}

lam_status scene_open_variant(scene *base, const char *name, const char *groups, lam_operator *op,
                              scene **out, lam_error *error) {
    lam_status status = LAM_OK;
    operator_description of_op;
    scene *made = memory_allocate(1, sizeof *made, name, error);
    if (made == NULL) {
        lam_operator_close(op);
        return LAM_ERR_MEMORY;
    }
    operator_describe(op, &of_op);
    atomic_init(&made->references, 1);
    made->base = scene_acquire(base);
    made->path = base->path;
    made->n = base->n;
    made->n_channels = base->n_channels;
    made->op = op;
    made->groups = base->groups;
    made->sky = base->sky;
    made->bytes = (uint64_t)base->n_channels * of_op.rank * of_op.rank * sizeof(float);
    made->name = strdup(name);
    if (made->name == NULL) FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory", name);
    TRY(scene_describe_variant(made, groups, &made->description, error));
    *out = made;
    made = NULL;
done:
    if (made != NULL) scene_release(made);
    return status;
}

scene *scene_acquire(scene *s) {
    atomic_fetch_add(&s->references, 1);
    return s;
}

void scene_release(scene *s) {
    if (atomic_fetch_sub(&s->references, 1) != 1) return;
    lam_operator_close(s->op);
    if (s->base == NULL) {
        lam_sky_close(s->sky);
        group_index_free(&s->groups);
        free(s->path);
    } else {
        scene_release(s->base);
    }
    free(s->checksum);
    free(s->description);
    free(s->name);
    free(s);
}
