/* The indirect error of operators where a scene is too large for a reference of all pairs, and what they
 * cost:
 *
 *     bench_hierarchical SCENE JUDGE[@FILE] SINGLES LAMPS RANDOMS STORE.h5 ...
 *
 * by the probes of judged_probes.h, of the recipe JUDGE; FILE keeps the judgement for the next run. As CSV.
 */
#include "solver/base/clock.h"
#include "solver/base/random.h"
#include "solver/operator/operator.h"
#include "support/judged_probes.h"
#include "tests/bench/bench_recipe.h"
#include "tests/bench/suites/stats.h"

#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <string.h>

enum { ROUNDS = 31 };

/* An answer to random emission, to one element's emission, and to random emission for some elements. */
enum { WHOLE, FROM_ONE, FOR_SOME, WAYS, SOME = 100 };
static const char *const way_names[WAYS] = {"whole", "from_one", "for_some"};

static double unit(uint64_t *state) {
    return random_lcg_unit(state);
}

static void die(const char *what) {
    fprintf(stderr, "bench_hierarchical: %s\n", what);
    exit(1);
}

static lam_status time_answers(const judged_probes *b, const lam_operator *op, float *out, void *work,
                               size_t bytes, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = b->m.n;
    double ms[ROUNDS];
    uint32_t some[SOME];
    uint64_t state = 9;
    float *one = calloc(n, sizeof *one);
    if (one == NULL) die("not enough memory");
    one[n / 2] = 1;
    for (size_t k = 0; k < SOME; k++) some[k] = (uint32_t)(unit(&state) * (double)n);
    for (int way = 0; way < WAYS; way++) {
        const float *E = way == FROM_ONE ? one : b->E + (b->n_probes - 1) * n;
        for (size_t round = 0; round < ROUNDS; round++) {
            const double started = clock_seconds();
            if (way == FOR_SOME)
                TRY(lam_operator_apply_selected(op, 1, LAM_RADIOSITY, E, NULL, SOME, some, out, work, bytes,
                                                error));
            else
                TRY(lam_operator_apply(op, 1, LAM_RADIOSITY, E, out, work, bytes, error));
            ms[round] = 1e3 * (clock_seconds() - started);
        }
        printf(",%.3f,%.3f", stats_median(ms, ROUNDS), stats_quantile(ms, ROUNDS, 0));
    }
done:
    free(one);
    return status;
}

static lam_status judge(const judged_probes *b, const char *path, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = b->m.n;
    lam_operator *op = NULL;
    operator_description about;
    void *work = NULL;
    float *out = memory_allocate(n, sizeof *out, "bench", error);
    if (out == NULL) TRY(LAM_ERR_MEMORY);
    TRY(lam_operator_open(path, &op, error));
    if (op->n != n || op->n_channels != 1) die("a store of other elements, or of colours");
    lam_operator_set_threads(op, (size_t)omp_get_max_threads());
    const size_t bytes = lam_operator_work_bytes(op, 1);
    work = memory_allocate(1, bytes, "bench", error);
    if (work == NULL) TRY(LAM_ERR_MEMORY);
    operator_describe(op, &about);
    printf("%s,%zu,%s,%.3f", path, n, lam_operator_kind(op), (double)about.bytes * 1e-6);
    for (size_t g = 0, k = 0; g < PROBE_GROUPS; g++) {
        double mean = 0, most = 0;
        size_t lit = 0; /* probes with any indirect light */
        for (size_t end = k + b->counts[g]; k < end; k++) {
            TRY(lam_operator_apply(op, 1, LAM_INDIRECT, b->E + k * n, out, work, bytes, error));
            const double off = judged_probes_error(b, k, out);
            if (!isfinite(off)) continue;
            mean += off;
            most = fmax(most, off);
            lit++;
        }
        printf(",%.4f,%.4f", mean / (double)lit, most);
    }
    TRY(time_answers(b, op, out, work, bytes, error));
    printf("\n");
    fflush(stdout);
done:
    lam_operator_close(op);
    free(work);
    free(out);
    return status;
}

int main(int argc, char **argv) {
    lam_error error = {.message = ""};
    judged_probes b;
    recipe judging;
    size_t counts[PROBE_GROUPS];
    if (argc < 6 || !bench_recipe(argv[2], 7, &judging))
        die("usage: bench_hierarchical SCENE RAYS|near:RAYS|pairs[@FILE] SINGLES LAMPS RANDOMS STORE.h5 ...");
    for (int g = 0; g < PROBE_GROUPS; g++) counts[g] = (size_t)atoi(argv[3 + g]);
    judged_probes_make(argv[1], &judging, bench_recipe_file(argv[2]), counts, &b);
    printf("store,n,kind,MB");
    for (int g = 0; g < PROBE_GROUPS; g++) printf(",%s,%s_most", probe_groups[g], probe_groups[g]);
    for (int way = 0; way < WAYS; way++) printf(",%s_ms,%s_best_ms", way_names[way], way_names[way]);
    printf("\n");
    for (int k = 6; k < argc; k++)
        if (judge(&b, argv[k], &error) != LAM_OK) die(error.message);
    judged_probes_free(&b);
    return 0;
}
