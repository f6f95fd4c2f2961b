/* Measures a vector alone and in company, and the light of one group beside the whole answer:
 *
 *     bench_batches VECTORS STORE.h5 ...
 *
 * on one thread, in processor time. Light is dense, or of one group of the scene after another. As CSV, least
 * times in ms a vector and medians of ratios of runs in turn; `read` is one pass of additions over as many
 * bytes as an answer reads. Exits with 1 where a vector has other bits in company. */
#include "lambert/lambert.h"
#include "solver/base/clock.h"
#include "solver/base/random.h"
#include "solver/operator/operator.h"
#include "tests/bench/suites/stats.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ROUNDS = 15 };

typedef struct subject {
    lam_operator *op;
    lam_scene *scene;
    size_t n, n_channels, n_vectors, work_bytes;
    float *E, *alone, *company; /* [n_vectors][C][n] */
    void *work;
    bool same; /* bits, so far */
} subject;

static void subject_free(subject *s) {
    lam_operator_close(s->op);
    lam_scene_close(s->scene);
    free(s->E);
    free(s->alone);
    free(s->company);
    free(s->work);
}

static lam_status subject_open(subject *s, const char *path, size_t n_vectors, lam_error *error) {
    lam_status status = LAM_OK;
    *s = (subject){.n_vectors = n_vectors, .same = true};
    TRY(lam_operator_open(path, &s->op, error));
    TRY(lam_scene_open(path, &s->scene, error));
    lam_operator_set_threads(s->op, 1);
    s->n = lam_operator_elements(s->op);
    s->n_channels = lam_operator_channels(s->op);
    s->work_bytes = lam_operator_work_bytes(s->op, n_vectors);
    s->E = memory_allocate(n_vectors * s->n_channels, s->n * sizeof *s->E, path, error);
    s->alone = memory_allocate(n_vectors * s->n_channels, s->n * sizeof *s->alone, path, error);
    s->company = memory_allocate(n_vectors * s->n_channels, s->n * sizeof *s->company, path, error);
    s->work = memory_allocate(s->work_bytes, 1, path, error);
    if (s->E == NULL || s->alone == NULL || s->company == NULL || s->work == NULL) TRY(LAM_ERR_MEMORY);
done:
    return status;
}

static void light_all(subject *s) {
    uint64_t state = 1;
    for (size_t k = 0; k < s->n_vectors * s->n_channels * s->n; k++) s->E[k] = (float)random_lcg_unit(&state);
}

/* Vector v is the light of group v, where there are so many, and so on in a circle. */
static void light_groups(subject *s) {
    const size_t n_groups = lam_scene_groups(s->scene), C = s->n_channels;
    memset(s->E, 0, s->n_vectors * C * s->n * sizeof *s->E);
    for (size_t v = 0; v < s->n_vectors; v++) {
        size_t count;
        const uint32_t *elements = lam_scene_group_elements(s->scene, v % n_groups, &count);
        for (size_t c = 0; c < C; c++)
            for (size_t k = 0; k < count; k++) s->E[(v * C + c) * s->n + elements[k]] = 1;
    }
}

static double least(const double *x, size_t n) {
    double found = x[0];
    for (size_t k = 1; k < n; k++) found = x[k] < found ? x[k] : found;
    return found;
}

/* One pass over as many bytes as an answer reads. */
static lam_status time_read(const subject *s, double *out, lam_error *error) {
    const size_t count = lam_operator_bytes(s->op) / sizeof(double);
    double ms[ROUNDS];
    double *bytes = memory_allocate(count, sizeof *bytes, "bytes to read", error);
    if (bytes == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < count; k++) bytes[k] = (double)k;
    for (size_t r = 0; r < ROUNDS; r++) {
        const double start = clock_processor_seconds();
        double sums[4] = {0};
        for (size_t k = 0; k + 4 <= count; k += 4)
            for (size_t l = 0; l < 4; l++) sums[l] += bytes[k + l];
        volatile double kept = sums[0] + sums[1] + sums[2] + sums[3];
        (void)kept;
        ms[r] = 1e3 * (clock_processor_seconds() - start);
    }
    *out = least(ms, ROUNDS);
    free(bytes);
    return LAM_OK;
}

/* Vectors one by one, then all of them, in turn. */
static lam_status time_company(subject *s, const char *light, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t numbers = s->n_channels * s->n, V = s->n_vectors;
    double alone[ROUNDS], company[ROUNDS], ratio[ROUNDS];
    for (size_t r = 0; r < ROUNDS; r++) {
        const double start = clock_processor_seconds();
        for (size_t v = 0; v < V; v++)
            TRY(lam_operator_apply(s->op, 1, LAM_RADIOSITY, s->E + v * numbers, s->alone + v * numbers,
                                   s->work, s->work_bytes, error));
        const double middle = clock_processor_seconds();
        TRY(lam_operator_apply(s->op, V, LAM_RADIOSITY, s->E, s->company, s->work, s->work_bytes, error));
        alone[r] = 1e3 * (middle - start) / (double)V;
        company[r] = 1e3 * (clock_processor_seconds() - middle) / (double)V;
        ratio[r] = company[r] / alone[r];
    }
    s->same = s->same && memcmp(s->alone, s->company, V * numbers * sizeof *s->alone) == 0;
    printf("%zu,%zu,%s,%zu,%.3f,%.3f,%.2f\n", s->n, s->n_channels, light, V, least(alone, ROUNDS),
           least(company, ROUNDS), stats_median(ratio, ROUNDS));
done:
    return status;
}

/* The answer for the elements of one group beside the whole one, of the light of the last group. */
static lam_status time_groups(subject *s, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n_groups = lam_scene_groups(s->scene), numbers = s->n_channels * s->n;
    const float *E = s->E + (n_groups - 1) % s->n_vectors * numbers;
    for (size_t g = 0; g < n_groups; g++) {
        size_t count;
        const uint32_t *elements = lam_scene_group_elements(s->scene, g, &count);
        double whole[ROUNDS], some[ROUNDS], ratio[ROUNDS];
        for (size_t r = 0; r < ROUNDS; r++) {
            const double start = clock_processor_seconds();
            TRY(lam_operator_apply(s->op, 1, LAM_RADIOSITY, E, s->alone, s->work, s->work_bytes, error));
            const double middle = clock_processor_seconds();
            TRY(lam_operator_apply_selected(s->op, 1, LAM_RADIOSITY, E, NULL, count, elements, s->company,
                                            s->work, s->work_bytes, error));
            whole[r] = 1e3 * (middle - start);
            some[r] = 1e3 * (clock_processor_seconds() - middle);
            ratio[r] = some[r] / whole[r];
        }
        for (size_t c = 0; c < s->n_channels; c++)
            for (size_t k = 0; k < count; k++)
                s->same = s->same && memcmp(&s->company[c * count + k], &s->alone[c * s->n + elements[k]],
                                            sizeof *s->alone) == 0;
        printf("%zu,%zu,%zu of one group,1,%.3f,%.3f,%.2f\n", s->n, s->n_channels, count,
               least(whole, ROUNDS), least(some, ROUNDS), stats_median(ratio, ROUNDS));
    }
done:
    return status;
}

static lam_status measure(const char *path, size_t n_vectors, bool *same, lam_error *error) {
    lam_status status = LAM_OK;
    subject s;
    double read;
    TRY(subject_open(&s, path, n_vectors, error));
    TRY(time_read(&s, &read, error));
    printf("%zu,%zu,read,1,%.3f,,\n", s.n, s.n_channels, read);
    light_all(&s);
    TRY(time_company(&s, "dense", error));
    light_groups(&s);
    TRY(time_company(&s, "groups", error));
    TRY(time_groups(&s, error));
    *same = *same && s.same;
done:
    subject_free(&s);
    return status;
}

int main(int argc, char **argv) {
    lam_error error;
    bool same = true;
    const size_t n_vectors = argc > 2 ? strtoul(argv[1], NULL, 10) : 0;
    if (n_vectors == 0) {
        fprintf(stderr, "usage: bench_batches VECTORS STORE.h5 ...\n");
        return 2;
    }
    puts("elements,channels,light,vectors,alone,company,ratio");
    for (int k = 2; k < argc; k++)
        if (measure(argv[k], n_vectors, &same, &error) != LAM_OK) {
            fprintf(stderr, "bench_batches: %s\n", error.message);
            return 1;
        }
    if (!same) fprintf(stderr, "bench_batches: a vector has other bits in company\n");
    return same ? 0 : 1;
}
