/* The list of factorizers and the choice among them. */
#include "solver/method/low_rank/factorizer.h"

#include <string.h>

static const factorizer *const factorizers[] = {&factorizer_hf, &factorizer_svd, &factorizer_rsi,
                                                &factorizer_sgrsvd};
enum { FACTORIZERS = sizeof factorizers / sizeof *factorizers };

static const factorizer *find(const char *name) {
    for (size_t k = 0; k < FACTORIZERS; k++)
        if (strcmp(factorizers[k]->name, name) == 0) return factorizers[k];
    return NULL;
}

bool factorizer_exists(const char *name) {
    return strcmp(name, "auto") == 0 || find(name) != NULL;
}

lam_status factorize(const char *name, const scaled_matrix *S, const factorizer_options *options,
                     tall_factors *out, factorizer_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    const factorizer *chosen = strcmp(name, "auto") == 0 ? &factorizer_hf : find(name);
    if (chosen == NULL) FAIL(error, LAM_ERR_ARGUMENT, "--factorizer %.40s: unknown", name);
    const double before = row_source_passes(S->rows);
    *report = (factorizer_report){.name = chosen->name};
    TRY(chosen->factorize(S, options, out, report, error));
    report->passes = row_source_passes(S->rows) - before;
done:
    return status;
}
