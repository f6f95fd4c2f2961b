/* Form factors by blocks: time, size and the indirect error of what is solved with them.
 *
 *     bench_blocks SCENE JUDGE[@FILE] SINGLES LAMPS RANDOMS OPEN:SHADOW[:EXACT] ...
 *
 * by the probes of judged_probes.h. A line for each pair of tolerances, as CSV. */
#include "solver/base/clock.h"
#include "solver/formfactor/blocks/blocks.h"
#include "solver/formfactor/leaving.h"
#include "solver/formfactor/source.h"
#include "support/judged_probes.h"
#include "tests/bench/bench_recipe.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

enum { BOUNCES = 24, SWEEPS = 6 };

static void die(const char *what) {
    fprintf(stderr, "bench_blocks: %s\n", what);
    exit(1);
}

static double cpu_seconds(void) {
    return (double)clock() / CLOCKS_PER_SEC;
}

/* Few rays tell a closed scene. */
static bool is_closed(const judged_probes *b) {
    lam_error error = {.message = ""};
    const form_factor_options few = {.recipe = {.source = &source_rays, .rays = 32, .seed = 1}};
    form_factors f;
    if (form_factors_make(&b->m, b->order, &few, &f, &error) != LAM_OK) die(error.message);
    const bool closed = leaving_nothing(&f);
    form_factors_free(&f);
    return closed;
}

/* F' = D F D with row sums of 1 in a closed scene, else of at most 1. */
static void balance(block_factors *f, bool closed) {
    lam_error error = {.message = ""};
    double *one = malloc(f->n * sizeof *one), *sums = malloc(f->n * sizeof *sums);
    double *d = malloc(f->n * sizeof *d);
    if (one == NULL || sums == NULL || d == NULL) die("not enough memory");
    for (size_t p = 0; p < f->n; p++) one[p] = d[p] = 1;
    f->balance = d;
    for (int sweep = 0; sweep < SWEEPS; sweep++) {
        double off = 0, all = 0;
        if (block_factors_multiply(f, 1, one, sums, &error) != LAM_OK) die(error.message);
        for (size_t p = 0; p < f->n; p++) {
            const double wrong = closed || sums[p] > 1 ? sums[p] - 1 : 0;
            off += f->area[p] * wrong * wrong;
            all += f->area[p];
            d[p] /= sqrt(fmax(1 + wrong, .05));
        }
        if (sweep == 0 || sweep == SWEEPS - 1) fprintf(stderr, "row sums off by %.2e\n", sqrt(off / all));
    }
    free(one);
    free(sums);
}

/* B - E of all probes by the Neumann series, [n][n_probes] by position. */
static void solve(const judged_probes *b, const block_factors *f, double *B) {
    lam_error error = {.message = ""};
    const size_t n = f->n, V = b->n_probes;
    double *x = malloc(n * V * sizeof *x), *y = malloc(n * V * sizeof *y);
    if (x == NULL || y == NULL) die("not enough memory");
    for (size_t p = 0; p < n; p++)
        for (size_t v = 0; v < V; v++) {
            x[p * V + v] = (double)b->E[v * n + f->order[p]];
            B[p * V + v] = 0;
        }
    for (int bounce = 0; bounce < BOUNCES; bounce++) {
        if (block_factors_multiply(f, V, x, y, &error) != LAM_OK) die(error.message);
        for (size_t p = 0; p < n; p++)
            for (size_t v = 0; v < V; v++) {
                x[p * V + v] = (double)b->m.reflectance[f->order[p]] * y[p * V + v];
                B[p * V + v] += x[p * V + v];
            }
    }
    free(x);
    free(y);
}

static void judge(const judged_probes *b, const visibility *v, const plane_tree *tree, bool closed,
                  const char *text) {
    lam_error error = {.message = ""};
    const size_t n = b->m.n, V = b->n_probes;
    block_factors f;
    block_report found;
    block_options options = {.exact = 1e-4, .seed = 1};
    char *rest;
    options.open = strtod(text, &rest);
    if (*rest == ':') options.shadow = strtod(rest + 1, &rest);
    if (*rest == ':') options.exact = strtod(rest + 1, &rest);
    if (*rest != '\0' || !(options.open > 0) || !(options.shadow > 0)) die("OPEN:SHADOW[:EXACT]");
    double cpu = cpu_seconds(), wall = clock_seconds();
    if (blocks_find(&b->m, v, tree, &options, &f, &found, &error) != LAM_OK) die(error.message);
    cpu = cpu_seconds() - cpu;
    wall = clock_seconds() - wall;
    balance(&f, closed);
    double *B = malloc(n * V * sizeof *B);
    float *one = malloc(n * sizeof *one);
    if (B == NULL || one == NULL) die("not enough memory");
    const double started = clock_seconds();
    solve(b, &f, B);
    printf("%s,%zu,%.3f,%.3f,%.3f,%zu,%.1f", text, n, wall, cpu, clock_seconds() - started, f.n_blocks,
           1e-6 * (double)(f.n_blocks * sizeof *f.blocks));
    for (size_t g = 0, k = 0; g < PROBE_GROUPS; g++) {
        double mean = 0, most = 0;
        size_t lit = 0; /* probes with any indirect light */
        for (size_t end = k + b->counts[g]; k < end; k++) {
            for (size_t p = 0; p < n; p++) one[f.order[p]] = (float)B[p * V + k];
            const double off = judged_probes_error(b, k, one);
            if (!isfinite(off)) continue;
            mean += off;
            most = fmax(most, off);
            lit++;
        }
        printf(",%.5f,%.5f", mean / (double)lit, most);
    }
    printf("\n");
    fprintf(stderr,
            "visits %llu: away %llu (%.3g pairs), hidden %llu (%.3g), linear %llu, pairs %llu, shaded %llu, "
            "shaded pairs %llu, segments %llu, reduced %llu, pieces %.3g\n",
            (unsigned long long)found.visits, (unsigned long long)found.away, found.elements_away,
            (unsigned long long)found.hidden, found.elements_hidden, (unsigned long long)found.linear,
            (unsigned long long)found.pairs, (unsigned long long)found.shaded,
            (unsigned long long)found.shaded_pairs, (unsigned long long)found.segments,
            (unsigned long long)found.reduced, found.sifted);
    fflush(stdout);
    free(B);
    free(one);
    block_factors_free(&f);
}

int main(int argc, char **argv) {
    lam_error error = {.message = ""};
    judged_probes b;
    recipe judging;
    size_t counts[PROBE_GROUPS];
    plane_tree tree;
    visibility *v = NULL;
    if (argc < 7 || !bench_recipe(argv[2], 7, &judging))
        die("usage: bench_blocks SCENE RAYS|near:RAYS|pairs[@FILE] SINGLES LAMPS RANDOMS OPEN:SHADOW[:EXACT] "
            "...");
    for (int g = 0; g < PROBE_GROUPS; g++) counts[g] = (size_t)atoi(argv[3 + g]);
    judged_probes_make(argv[1], &judging, bench_recipe_file(argv[2]), counts, &b);
    double started = clock_seconds();
    if (visibility_create(&b.m, &v, &error) != LAM_OK) die(error.message);
    fprintf(stderr, "facets and acceleration structure %.3f s, ", clock_seconds() - started);
    started = clock_seconds();
    if (form_factors_tree(&b.m, &tree, &error) != LAM_OK) die(error.message);
    fprintf(stderr, "tree of %zu planes, %zu clusters %.3f s\n", tree.n_frames, tree.n_clusters,
            clock_seconds() - started);
    const bool closed = is_closed(&b);
    printf("tolerances,n,seconds,cpu_seconds,solve_seconds,blocks,MB");
    for (int g = 0; g < PROBE_GROUPS; g++) printf(",%s,%s_most", probe_groups[g], probe_groups[g]);
    printf("\n");
    for (int k = 6; k < argc; k++) judge(&b, v, &tree, closed, argv[k]);
    plane_tree_free(&tree);
    visibility_destroy(v);
    judged_probes_free(&b);
    return 0;
}
