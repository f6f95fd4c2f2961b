#include "server/scene/scene_store.h"

#include <string.h>

lam_status scene_store_open(const scene *of, store **out, lam_error *error) {
    const scene *root = scene_root(of);
    const lam_status status = store_open(root->path, out, error);
    if (status != LAM_OK) return status;
    if (strcmp(store_identity_of(*out)->digest, root->identity.digest) == 0) return LAM_OK;
    return status_fail(error, LAM_ERR_IO,
                       "%s: the store is another one than was read; read it again (SIGHUP)", root->path);
}
