/* The light at points of the scene of a store, by unbiased walks, beside which headlines.py puts the light of
 * its elements:
 *
 *     bench_points STORE POINTS WALKS SEED [GROUP...]
 *
 * The points are the centres of tiny pieces of the elements, in equal strata of the area; the lamps are those
 * of the scene, or the groups named, each of whose elements emits 1 in all channels. As CSV: the element of
 * each point, and for each channel B - E and its standard error. */
#include "store/store.h"
#include "tests/bench/suites/mesh_truths.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Lights the groups alone, where any are named. */
static lam_status light(mesh *m, char *const *groups, size_t n_groups, lam_error *error) {
    lam_status status = LAM_OK;
    if (n_groups == 0) return LAM_OK;
    for (size_t k = 0; k < m->n * m->n_channels; k++) m->emission[k] = 0;
    for (size_t k = 0; k < n_groups; k++) {
        size_t g = 0;
        while (g < m->n_groups && strcmp(m->group_names[g], groups[k]) != 0) g++;
        if (g == m->n_groups) FAIL(error, LAM_ERR_ARGUMENT, "no group %s", groups[k]);
        for (size_t i = 0; i < m->n * m->n_channels; i++)
            if (m->group[i % m->n] == g) m->emission[i] = 1;
    }
done:
    return status;
}

static lam_status open_mesh(const char *path, mesh *out, lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL;
    double *row_sums = NULL;
    TRY(store_open(path, &s, error));
    TRY(mesh_load(s, out, &row_sums, error));
done:
    free(row_sums);
    store_close(s);
    return status;
}

static void print_points(const mesh_points *p, const uint32_t *element) {
    printf("element");
    for (size_t c = 0; c < p->n_channels; c++) printf(",light_%zu,error_%zu", c, c);
    for (size_t k = 0; k < p->n; k++) {
        printf("\n%u", element[k]);
        for (size_t c = 0; c < p->n_channels; c++)
            printf(",%.9g,%.9g", p->truth[c * p->n + k], p->spread[c * p->n + k]);
    }
    putchar('\n');
}

static lam_status run(int argc, char **argv, lam_error *error) {
    lam_status status = LAM_OK;
    mesh m = {0}, pieces = {0};
    mesh_points p = {.n = 0};
    uint32_t *element = NULL;
    const bench_run how = {.scale = BENCH_DEFAULT, .seed = strtoull(argv[4], NULL, 10)};
    const size_t points = strtoull(argv[2], NULL, 10), walks = strtoull(argv[3], NULL, 10);
    TRY(open_mesh(argv[1], &m, error));
    TRY(open_mesh(argv[1], &pieces, error));
    TRY(light(&pieces, argv + 5, (size_t)argc - 5, error));
    TRY(mesh_points_walk(&how, &pieces, points, walks, &p, error));
    element = memory_allocate(p.n, sizeof *element, "points", error);
    if (element == NULL) TRY(LAM_ERR_MEMORY);
    TRY(mesh_points_locate(&p, &m, element, error));
    print_points(&p, element);
done:
    free(element);
    mesh_points_free(&p);
    mesh_free(&pieces);
    mesh_free(&m);
    return status;
}

int main(int argc, char **argv) {
    lam_error error = {0};
    if (argc < 5) {
        fprintf(stderr, "usage: bench_points STORE POINTS WALKS SEED [GROUP...]\n");
        return 2;
    }
    if (run(argc, argv, &error) == LAM_OK) return 0;
    fprintf(stderr, "bench_points: %s\n", error.message);
    return 1;
}
