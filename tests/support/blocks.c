#include "support/blocks.h"

block_factors blocks_with(const mesh *m, plane_tree *tree, const block_options *options,
                          block_report *report) {
    lam_error error = {.message = ""};
    visibility *v = NULL;
    block_factors f;
    ck_ok(visibility_create(m, &v, &error));
    ck_ok(form_factors_tree(m, tree, &error));
    ck_ok(blocks_find(m, v, tree, options, &f, report, &error));
    visibility_destroy(v);
    return f;
}

block_factors blocks_of(const mesh *m, plane_tree *tree, double open, double shadow, block_report *report) {
    const block_options options = {.open = open, .shadow = shadow, .exact = 1e-6, .seed = 1};
    return blocks_with(m, tree, &options, report);
}

block_factors blocks_of_seed(const mesh *m, plane_tree *tree, uint64_t seed) {
    const block_options options = {
        .open = blocks_open, .shadow = blocks_shadow, .exact = 1e-6, .scene_every = seed % 2, .seed = seed};
    return blocks_with(m, tree, &options, NULL);
}

void blocks_multiply(const block_factors *f, const double *x, double *y) {
    lam_error error = {.message = ""};
    double *in = malloc(f->n * sizeof *in), *out = malloc(f->n * sizeof *out);
    for (size_t p = 0; p < f->n; p++) in[p] = x[f->order[p]];
    ck_ok(block_factors_multiply(f, 1, in, out, &error));
    for (size_t p = 0; p < f->n; p++) y[f->order[p]] = out[p];
    free(in);
    free(out);
}

double blocks_exchange(const mesh *m, const block_factors *f, size_t from, size_t n_from, size_t to,
                       size_t n_to) {
    double *x = calloc(m->n, sizeof *x), *y = malloc(m->n * sizeof *y), sum = 0;
    for (size_t j = to; j < to + n_to; j++) x[j] = 1;
    blocks_multiply(f, x, y);
    for (size_t i = from; i < from + n_from; i++) sum += m->area[i] * y[i];
    free(x);
    free(y);
    return sum;
}
