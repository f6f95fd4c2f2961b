#include "solver/base/scene/scene_buried.h"

#include "store/groups.h"
#include "store/status.h"

#include <stdint.h>
#include <stdlib.h>

static const char path[] = STORE_MESH "/buried";

lam_status scene_buried_load(store *s, size_t n, bool **buried, lam_error *error) {
    lam_status status = LAM_OK;
    size_t count = SIZE_MAX;
    void *data = NULL;
    bool *made = NULL;
    *buried = NULL;
    if (!store_has(s, path)) return LAM_OK;
    TRY(store_read(s, path, STORE_U32, 1, &count, &data, error));
    const uint32_t *elements = data;
    made = memory_allocate(n, sizeof *made, "buried elements", error);
    if (made == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < count; k++) {
        if (elements[k] >= n || (k > 0 && elements[k] <= elements[k - 1]))
            FAIL(error, LAM_ERR_FORMAT, "%s: %s[%zu] = %u, must be above the one before and below %zu",
                 store_path(s), path, k, elements[k], n);
        made[elements[k]] = true;
    }
    *buried = made;
    made = NULL;
done:
    free(made);
    free(data);
    return status;
}

lam_status scene_buried_save(const bool *buried, size_t n, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    size_t count = 0;
    for (size_t i = 0; buried != NULL && i < n; i++) count += buried[i];
    if (count == 0) return LAM_OK;
    uint32_t *elements = memory_allocate(count, sizeof *elements, "buried elements", error);
    if (elements == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0, k = 0; i < n; i++)
        if (buried[i]) elements[k++] = (uint32_t)i;
    status = store_write(s, path, STORE_U32, 1, &count, elements, error);
    free(elements);
    return status;
}
