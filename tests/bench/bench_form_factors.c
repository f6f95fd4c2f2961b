/* Time and memory of form factors and of what keeping them costs, as CSV: medians of some runs and the peak
 * of them all.
 *
 *     bench_form_factors SCENE RAYS|pairs|near:RAYS RUNS [STORE.h5 [SCRATCH]]
 *
 * Pairs, all or near ones, are those of normal quality. rows=1 in the environment expands the upper triangle
 * to rows, as an operator needs them. */
#include "solver/base/clock.h"
#include "solver/bench/stats.h"
#include "solver/formfactor/formfactor.h"
#include "solver/scene/import/import.h"
#include "tests/bench/bench_recipe.h"

#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>

enum { MAX_RUNS = 99 };

typedef struct run_times {
    double make, save, cpu; /* seconds */
} run_times;

static double cpu_seconds(void) {
    struct rusage used;
    getrusage(RUSAGE_SELF, &used);
    return (double)(used.ru_utime.tv_sec + used.ru_stime.tv_sec) +
           1e-6 * (double)(used.ru_utime.tv_usec + used.ru_stime.tv_usec);
}

static double median(const run_times *runs, size_t n, size_t offset) {
    double values[MAX_RUNS];
    for (size_t k = 0; k < n; k++) values[k] = *(const double *)((const char *)&runs[k] + offset);
    return stats_median(values, n);
}

static lam_status keep(const form_factors *f, const char *path, lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL, *sealing;
    TRY(store_create(path, &s, error));
    TRY(form_factors_save(f, s, error));
    sealing = s;
    s = NULL;
    TRY(store_seal(sealing, error));
done:
    store_close(s);
    return status;
}

static lam_status run_once(const mesh *m, const uint32_t *order, const form_factor_options *how,
                           const char *store_to, const char *scratch_in, run_times *times, size_t *entries,
                           lam_error *error) {
    lam_status status = LAM_OK;
    form_factors f = {.closed = false};
    form_factor_options options = *how;
    double started = clock_seconds();
    const double used = cpu_seconds();
    if (scratch_in != NULL) TRY(scratch_open(scratch_in, &options.scratch, error));
    TRY(form_factors_make(m, order, &options, &f, error));
    times->make = clock_seconds() - started;
    *entries = f.upper.indptr != NULL ? f.upper.indptr[m->n] : f.F.indptr[m->n];
    started = clock_seconds();
    if (store_to != NULL) TRY(keep(&f, store_to, error));
    times->save = clock_seconds() - started;
    times->cpu = cpu_seconds() - used;
done:
    scratch_close(options.scratch, true);
    form_factors_free(&f);
    return status;
}

int main(int argc, char **argv) {
    lam_status status = LAM_OK;
    lam_error problem = {0}, *error = &problem;
    mesh m = {0};
    uint32_t *order = NULL;
    import_report report;
    run_times runs[MAX_RUNS];
    const import_options plain = {.unit = 1, .reflectance = -1};
    form_factor_options how = {
        .stage = "form factors", .upper = getenv("rows") == NULL, .scratch_name = "form-factors"};
    size_t n_runs, entries = 0;
    struct rusage used;
    if (argc < 4 || argc > 6) {
        fprintf(stderr, "usage: %s SCENE RAYS|pairs|near:RAYS RUNS [STORE.h5 [SCRATCH]]\n", argv[0]);
        return 2;
    }
    n_runs = strtoull(argv[3], NULL, 10);
    if (!bench_recipe(argv[2], 1, &how.recipe) || n_runs < 1 || n_runs > MAX_RUNS) return 2;
    TRY(scene_import(argv[1], &plain, &m, &report, error));
    order = memory_allocate(m.n, sizeof *order, "the order of the elements", error);
    if (order == NULL) TRY(LAM_ERR_MEMORY);
    TRY(mesh_z_order(&m, order, error));
    for (size_t k = 0; k < n_runs; k++)
        TRY(run_once(&m, order, &how, argc > 4 ? argv[4] : NULL, argc > 5 ? argv[5] : NULL, &runs[k],
                     &entries, error));
    getrusage(RUSAGE_SELF, &used);
    printf("elements,recipe,threads,runs,make_s,save_s,cpu_s,peak_MiB,entries\n");
    printf("%zu,%s,%d,%zu,%.2f,%.2f,%.2f,%.0f,%zu\n", m.n, argv[2], omp_get_max_threads(), n_runs,
           median(runs, n_runs, offsetof(run_times, make)), median(runs, n_runs, offsetof(run_times, save)),
           median(runs, n_runs, offsetof(run_times, cpu)), (double)used.ru_maxrss / 1024, entries);
done:
    if (status != LAM_OK) fprintf(stderr, "%s\n", problem.message);
    free(order);
    mesh_free(&m);
    return status == LAM_OK ? 0 : 1;
}
