/* Solves without HTTP around them. */
#include "solver/base/clock.h"
#include "solver/bench/bench_service.h"
#include "solver/bench/stats.h"

#include <math.h>
#include <omp.h>
#include <stdlib.h>

/* More solves than these say no more about their median. */
enum { MOST_TIMES = 1 << 16 };

static lam_status get_work(const lam_operator *op, void **work, size_t *bytes, lam_error *error) {
    *bytes = lam_operator_work_bytes(op, 1);
    *work = memory_allocate(1, *bytes, "work area", error);
    return *work != NULL ? LAM_OK : LAM_ERR_MEMORY;
}

lam_status service_solve_alone(const service_bench *b, lam_operator *op, int threads, const float *E,
                               float *B, double seconds, service_solve *out, lam_error *error) {
    lam_status status = LAM_OK;
    void *work = NULL;
    size_t bytes, count = 0;
    double *times = memory_allocate(MOST_TIMES, sizeof *times, "times", error);
    if (times == NULL) return LAM_ERR_MEMORY;
    lam_operator_set_threads(op, (size_t)threads);
    TRY(get_work(op, &work, &bytes, error));
    TRY(lam_operator_apply(op, 1, LAM_RADIOSITY, E, B, work, bytes, error)); /* fetches pages and caches */
    const double start = clock_seconds();
    double now = start;
    while (now < start + seconds || count == 0) {
        const double before = now;
        TRY(lam_operator_apply(op, 1, LAM_RADIOSITY, E, B, work, bytes, error));
        now = clock_seconds();
        times[count++ % MOST_TIMES] = now - before;
        TRY(bench_check(b->run, error));
    }
    const size_t kept = count < MOST_TIMES ? count : MOST_TIMES;
    *out = (service_solve){.per_second = (double)count / (now - start), .count = count};
    out->p50 = stats_quantile(times, kept, .5);
    out->p99 = stats_quantile(times, kept, .99);
done:
    free(work);
    free(times);
    return status;
}

lam_status service_solve_beside(const service_bench *b, lam_operator *op, const float *E, double seconds,
                                service_solve *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = lam_operator_elements(op);
    size_t count = 0;
    lam_operator_set_threads(op, 1);
    const double start = clock_seconds();
#pragma omp parallel num_threads(b->threads) reduction(+ : count)
    {
        lam_error own;
        void *work = NULL;
        size_t bytes;
        float *B = memory_allocate(n, sizeof *B, "radiosity", &own);
        lam_status mine = B != NULL ? get_work(op, &work, &bytes, &own) : LAM_ERR_MEMORY;
        while (mine == LAM_OK && (clock_seconds() < start + seconds || count == 0)) {
            mine = lam_operator_apply(op, 1, LAM_RADIOSITY, E, B, work, bytes, &own);
            count++;
            if (mine == LAM_OK) mine = bench_check(b->run, &own);
        }
        free(work);
        free(B);
        if (mine != LAM_OK)
#pragma omp critical
        {
            status = mine;
            if (error != NULL) *error = own;
        }
    }
    *out = (service_solve){
        .p50 = NAN, .p99 = NAN, .per_second = (double)count / (clock_seconds() - start), .count = count};
    return status;
}
