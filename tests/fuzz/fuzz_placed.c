/* Lists of luminaires, JSON and CSV; those that are read have sound frames, factors and places. */
#include "fuzz/fuzz.h"
#include "solver/base/vector3.h"
#include "solver/luminaire/placed.h"

#include <math.h>

static void check(const placed_luminaires *p, const placed_luminaire *l) {
    double y[3];
    cross3(l->z, l->x, y);
    FUZZ_CHECK(fabs(dot3(l->x, l->x) - 1) < 1e-12 && fabs(dot3(l->z, l->z) - 1) < 1e-12 &&
               fabs(dot3(l->x, l->z)) < 1e-12);
    for (int d = 0; d < 3; d++)
        FUZZ_CHECK(fabs(y[d] - l->y[d]) < 1e-12 && isfinite(l->at[d]) && l->colour[d] >= 0);
    FUZZ_CHECK(isfinite(l->scale) && l->scale >= 0 && (isnan(l->flux) || l->flux > 0));
    FUZZ_CHECK(l->name[0] != '\0' && strlen(l->name) < PLACED_NAME && strlen(l->group) < PLACED_NAME);
    FUZZ_CHECK(l->file < p->n_files && l->ignored + l->n_ignored <= p->n_ignored);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static const char *const names[] = {"a.json", "a.csv", "a"};
    if (size == 0) return 0;
    const placed_options options = {.unit = data[size - 1] & 64 ? .001 : 0};
    char *text = fuzz_text(data, size - 1);
    lam_error error = {.message = ""};
    placed_luminaires p = {.n = 0};
    if (placed_read_text(names[data[size - 1] % 3], text, size - 1, &options, &p, &error) == LAM_OK) {
        FUZZ_CHECK(p.n > 0 && p.n <= PLACED_MOST && p.n_files <= PLACED_FILES_MOST);
        for (size_t k = 0; k < p.n; k++) check(&p, &p.luminaires[k]);
        for (size_t k = 0; k < p.n_files; k++)
            FUZZ_CHECK(p.files[k].name[0] != '\0' && p.files[k].path == NULL);
    } else {
        FUZZ_CHECK(error.message[0] != '\0' && strpbrk(error.message, "\r\n") == NULL && p.n == 0);
    }
    placed_free(&p);
    free(text);
    return 0;
}
