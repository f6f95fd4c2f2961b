/* Factorizers on the form factors of a store, as CSV:
 *
 *     bench_factorize STORE.h5 FACTORIZER epsilon=X|rank=K [alpha=X] [levels=N] [iterations=Q]
 *                     [order=mesh] [runs=N] [norm=0]
 */
#include "solver/base/clock.h"
#include "solver/bench/stats.h"
#include "solver/formfactor/formfactor.h"
#include "solver/method/low_rank/factorizer.h"
#include "solver/method/method.h"
#include "solver/method/norm.h"

#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>

enum { MAX_RUNS = 99 };

int main(int argc, char **argv) {
    lam_status status = LAM_OK;
    lam_error problem = {0}, *error = &problem;
    store *s = NULL;
    mesh m = {0};
    form_factors f = {.closed = false};
    uint32_t *order = NULL;
    row_source rows;
    scaled_matrix S = {0};
    tall_factors factors = {0};
    factorizer_report report;
    factorizer_options how = {.budget = {.alpha = .5}, .levels = -1, .iterations = -1, .seed = 1};
    double ratio = 0, leaf = 0;
    bool mesh_order = false, with_norm = true;
    size_t runs = 3;
    double seconds[MAX_RUNS], norm = -1, *row_sums = NULL;
    struct rusage used;
    if (argc < 4) {
        fprintf(stderr, "usage: %s STORE.h5 FACTORIZER epsilon=X|rank=K ...\n", argv[0]);
        return 2;
    }
    for (int k = 3; k < argc; k++) {
        double x = 0;
        if (sscanf(argv[k], "epsilon=%lf", &x) == 1) how.epsilon = x;
        if (sscanf(argv[k], "rank=%lf", &x) == 1) how.rank = (size_t)x;
        if (sscanf(argv[k], "alpha=%lf", &x) == 1) how.budget.alpha = x;
        if (sscanf(argv[k], "ratio=%lf", &x) == 1) ratio = x;
        if (sscanf(argv[k], "leaf=%lf", &x) == 1) leaf = x;
        if (sscanf(argv[k], "levels=%lf", &x) == 1) how.levels = (int)x;
        if (sscanf(argv[k], "iterations=%lf", &x) == 1) how.iterations = (int)x;
        if (sscanf(argv[k], "runs=%lf", &x) == 1) runs = (size_t)x;
        if (sscanf(argv[k], "norm=%lf", &x) == 1) with_norm = x != 0;
        if (sscanf(argv[k], "memory=%lf", &x) == 1) how.memory = (size_t)x;
        if (strcmp(argv[k], "order=mesh") == 0) mesh_order = true;
    }
    if (ratio > 0 && how.levels > 0) budget_divide(&how.budget, how.levels, ratio, leaf);
    if (runs < 1 || runs > MAX_RUNS) return 2;
    TRY(store_open(argv[1], &s, error));
    TRY(mesh_load(s, &m, &row_sums, error));
    TRY(form_factors_load(s, &m, NULL, &f, error));
    TRY(form_factors_expand(&f, m.area, error));
    order = memory_allocate(m.n, sizeof *order, "order", error);
    if (order == NULL) TRY(LAM_ERR_MEMORY);
    if (mesh_order)
        for (size_t i = 0; i < m.n; i++) order[i] = (uint32_t)i;
    else
        TRY(mesh_z_order(&m, order, error));
    row_source_of_csr(&rows, &f.F);
    TRY(scaled_init(&S, &rows, m.area, order, error));
    for (size_t k = 0; k < runs; k++) {
        tall_factors_free(&factors);
        const double started = clock_seconds();
        TRY(factorize(argv[2], &S, &how, &factors, &report, error));
        seconds[k] = clock_seconds() - started;
    }
    if (with_norm) TRY(norm_of_error(&S, &factors, NULL, &norm, error));
    getrusage(RUSAGE_SELF, &used);
    printf("elements,density,factorizer,epsilon,rank_asked,alpha,order,threads,runs,seconds,rank,real,"
           "levels,passes,peak_MiB,left,compression\n");
    printf("%zu,%.4f,%s,%g,%zu,%g,%s,%d,%zu,%.3f,%zu,%.4f,%d,%.2f,%.0f,", m.n, rows.density, report.name,
           how.epsilon, how.rank, how.budget.alpha, mesh_order ? "mesh" : "z", omp_get_max_threads(), runs,
           stats_median(seconds, runs), factors.rank, norm, report.levels, report.passes,
           (double)used.ru_maxrss / 1024);
    for (int l = 0; l <= report.levels; l++) printf("%.4f%s", report.left[l], l < report.levels ? " " : ",");
    for (int l = 0; l <= report.levels; l++) printf("%.3f ", report.compression[l]);
    printf("\n");
done:
    if (status != LAM_OK) fprintf(stderr, "%s\n", problem.message);
    tall_factors_free(&factors);
    scaled_free(&S);
    form_factors_free(&f);
    free(order);
    free(row_sums);
    mesh_free(&m);
    store_close(s);
    return status == LAM_OK ? 0 : 1;
}
