#include "solver/base/scene/scene_lights.h"

#include "store/groups.h"
#include "store/status.h"

#include <stdlib.h>

lam_status scene_lights_load(store *s, light_kind *out, lam_error *error) {
    lam_status status = LAM_OK;
    char *word = NULL;
    *out = LIGHT_RADIOMETRIC;
    if (!store_has_attribute(s, STORE_MESH, "lights")) goto done;
    TRY(store_get_text(s, STORE_MESH, "lights", &word, error));
    if (!light_kind_find(word, out))
        FAIL(error, LAM_ERR_FORMAT, "%s: /mesh attribute lights is '%.20s', must be W or lm", store_path(s),
             word);
done:
    free(word);
    return status;
}

lam_status scene_lights_save(light_kind lights, store *s, lam_error *error) {
    return store_set_text(s, STORE_MESH, "lights", light_kind_word(lights), error);
}
