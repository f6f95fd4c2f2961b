#include "solver/light/result_figures.h"

#include "solver/light/emission.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char *const names[REDUCE_COUNT] = {"mean", "sum", "min", "max", "uniformity", "variance"};

const char *reduce_name(reduce_statistic statistic) {
    return names[statistic];
}

void reduce_free(reduction *r) {
    free(r->inside);
    *r = (reduction){0};
}

lam_status reduce_parse(const char *item, reduction *out, lam_error *error) {
    lam_status status = LAM_OK;
    reduction r = {0};
    const char *equals = strrchr(item, '=');
    if (equals == NULL || equals == item)
        FAIL(error, LAM_ERR_ARGUMENT,
             "--reduce %s: must be GROUP=mean, sum, min, max, uniformity or variance", item);
    if ((size_t)(equals - item) >= sizeof r.group)
        FAIL(error, LAM_ERR_ARGUMENT, "--reduce %s: no group has so long a name", item);
    memcpy(r.group, item, (size_t)(equals - item));
    for (const char *rest = equals + 1;; rest++) {
        const size_t length = strcspn(rest, ",");
        int found = -1;
        for (int i = 0; i < REDUCE_COUNT; i++)
            if (strlen(names[i]) == length && strncmp(names[i], rest, length) == 0) found = i;
        if (found < 0)
            FAIL(error, LAM_ERR_ARGUMENT,
                 "--reduce %s: %.*s must be one of: mean sum min max uniformity variance", item, (int)length,
                 rest);
        r.wanted[found] = true;
        rest += length;
        if (*rest == '\0') break;
    }
    *out = r;
done:
    return status;
}

static void mark(void *context, size_t group) {
    bool *inside = context;
    inside[group] = true;
}

lam_status reduce_bind(reduction *r, const mesh *m, lam_error *error) {
    lam_status status = LAM_OK;
    bool *inside = memory_allocate(m->n_groups, sizeof *inside, "the groups of --reduce", error);
    if (inside == NULL) TRY(LAM_ERR_MEMORY);
    if (emission_match_groups(m, r->group, mark, inside) == 0)
        FAIL(error, LAM_ERR_ARGUMENT, "--reduce %s: no group of this name in the store", r->group);
    free(r->inside);
    r->inside = inside;
    inside = NULL;
done:
    free(inside);
    return status;
}

/* Of narrow, or else of wide. */
static void compute(const mesh *m, const bool *inside, const float *narrow, const double *wide,
                    double out[REDUCE_COUNT]) {
    double area = 0, sum = 0, squares = 0, low = INFINITY, high = -INFINITY;
    for (size_t i = 0; i < m->n; i++) {
        if (!inside[m->group[i]]) continue;
        const double value = narrow != NULL ? (double)narrow[i] : wide[i];
        area += m->area[i];
        sum += m->area[i] * value;
        low = fmin(low, value);
        high = fmax(high, value);
    }
    const double mean = sum / area;
    for (size_t i = 0; i < m->n; i++) {
        const double value = narrow != NULL ? (double)narrow[i] : wide[i];
        if (inside[m->group[i]]) squares += m->area[i] * (value - mean) * (value - mean);
    }
    const bool any = area > 0;
    out[REDUCE_MEAN] = any ? mean : NAN;
    out[REDUCE_SUM] = any ? sum : NAN;
    out[REDUCE_MIN] = any ? low : NAN;
    out[REDUCE_MAX] = any ? high : NAN;
    out[REDUCE_UNIFORMITY] = any && mean != 0 ? low / mean : NAN;
    out[REDUCE_VARIANCE] = any ? squares / area : NAN;
}

void reduce_compute(const mesh *m, const bool *inside, const float *x, double out[REDUCE_COUNT]) {
    compute(m, inside, x, NULL, out);
}

void reduce_compute_double(const mesh *m, const bool *inside, const double *x, double out[REDUCE_COUNT]) {
    compute(m, inside, NULL, x, out);
}
