#include "solver/codec/stated_errors.h"

#include "solver/operator/blocks/importance.h"

#include <math.h>
#include <stdlib.h>

void stated_errors_free(stated_errors *e) {
    free(e->read);
    *e = (stated_errors){.n = 0};
}

static stated_error read_error(store *s, const char *relative, const char *indirect) {
    static const char *const groups[] = {"/error/lights", "/error/single"};
    stated_error found = {.known = false};
    for (size_t i = 0; i < sizeof groups / sizeof groups[0] && !found.known; i++)
        found.known = store_has(s, groups[i]) && store_has_attribute(s, groups[i], relative) &&
                      store_has_attribute(s, groups[i], indirect) &&
                      store_get_number(s, groups[i], relative, &found.relative, NULL) == LAM_OK &&
                      store_get_number(s, groups[i], indirect, &found.indirect, NULL) == LAM_OK &&
                      isfinite(found.relative) && isfinite(found.indirect);
    return found;
}

lam_status stated_errors_read(store *s, size_t n, stated_errors *out, lam_error *error) {
    lam_status status = LAM_OK;
    importance weights = {.n = 0};
    stated_errors made = {.n = n, .all = read_error(s, "total_relative_mean", "total_indirect_mean")};
    TRY(importance_load(s, n, &weights, error));
    if (weights.n > 0) {
        made.read = memory_allocate(n, sizeof *made.read, "receivers", error);
        if (made.read == NULL) TRY(LAM_ERR_MEMORY);
        for (size_t i = 0; i < n; i++) made.read[i] = weights.read[i] > 0;
        made.receivers = read_error(s, "receivers_relative", "receivers_indirect");
    }
    *out = made;
    made.read = NULL;
done:
    importance_free(&weights);
    free(made.read);
    return status;
}

size_t stated_errors_others(const stated_errors *e, size_t count, const uint32_t *selected) {
    size_t others = 0;
    for (size_t k = 0; e->read != NULL && k < count; k++)
        others += !e->read[selected != NULL ? selected[k] : k];
    return others;
}

void stated_errors_note(const stated_errors *e, bool only, answer_notes *notes) {
    const bool receivers = only && e->read != NULL;
    const stated_error *of = receivers ? &e->receivers : &e->all;
    notes->has_error = of->known;
    notes->relative_mean = of->relative;
    notes->indirect_mean = of->indirect;
    notes->error_of = e->read == NULL ? NULL : receivers ? "receivers" : "all";
}
