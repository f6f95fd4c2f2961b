#include "solver/base/scene/scene_backs.h"

#include "store/groups.h"
#include "store/status.h"

static lam_status load(store *s, const char *name, int64_t *value, lam_error *error) {
    if (!store_has_attribute(s, STORE_MESH, name)) return LAM_OK;
    return store_get_integer(s, STORE_MESH, name, value, error);
}

lam_status scene_backs_load(store *s, size_t n, size_t *n_backs, bool *two_sided, lam_error *error) {
    lam_status status = LAM_OK;
    int64_t all = 0, some = 0;
    TRY(load(s, "two_sided", &all, error));
    TRY(load(s, "backs", &some, error));
    if (all != 0 && all != 1)
        FAIL(error, LAM_ERR_FORMAT, "%s: /mesh attribute two_sided is %lld, must be 0 or 1", store_path(s),
             (long long)all);
    if (all == 1 && n % 2 != 0)
        FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/elements holds %zu elements, must be an even number",
             store_path(s), n);
    if (all == 0 && (some < 0 || (uint64_t)some > n / 2))
        FAIL(error, LAM_ERR_FORMAT,
             "%s: /mesh attribute backs is %lld, must be from 0 to half of %zu elements", store_path(s),
             (long long)some, n);
    *two_sided = all == 1;
    *n_backs = all == 1 ? n / 2 : (size_t)some;
done:
    return status;
}

lam_status scene_backs_save(size_t n_backs, bool two_sided, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(store_set_integer(s, STORE_MESH, "two_sided", two_sided, error));
    if (!two_sided && n_backs > 0) TRY(store_set_integer(s, STORE_MESH, "backs", (int64_t)n_backs, error));
done:
    return status;
}
