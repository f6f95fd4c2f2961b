#include "solver/precompute/precision_loss.h"

#include "solver/base/random.h"

#include <math.h>
#include <stdlib.h>

/* The loss for one bright element, and for emissions that are random everywhere. */
typedef struct precision_loss {
    double single, random;
} precision_loss;

/* Probes of each sort. */
enum { PROBES = 8 };

static lam_status apply(const lam_operator *op, const float *E, float *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t bytes = lam_operator_work_bytes(op, 2 * PROBES);
    void *work = memory_allocate(bytes, 1, "the work area of a solve", error);
    if (work == NULL) return LAM_ERR_MEMORY;
    TRY(lam_operator_apply(op, 2 * PROBES, LAM_INDIRECT, E, out, work, bytes, error));
done:
    free(work);
    return status;
}

/* |b - a|/|a| of one vector; 0 where nothing bounces. */
static double difference(const lam_operator *op, const double *area, const float *a, const float *b) {
    const size_t n = lam_operator_elements(op), count = n * lam_operator_channels(op);
    double whole = 0, off = 0;
    for (size_t i = 0; i < count; i++) {
        const double x = (double)a[i], d = (double)b[i] - x;
        whole += area[i % n] * x * x;
        off += area[i % n] * d * d;
    }
    return whole > 0 ? sqrt(off / whole) : 0;
}

static lam_status measure_loss(const lam_operator *op, const lam_operator *narrow, const double *area,
                               uint64_t seed, precision_loss *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = lam_operator_elements(op), n_channels = lam_operator_channels(op),
                 vector = n * n_channels;
    float *E = memory_allocate(2 * PROBES, vector * sizeof *E, "probes", error);
    float *before = memory_allocate(2 * PROBES, vector * sizeof *before, "probes", error);
    float *after = memory_allocate(2 * PROBES, vector * sizeof *after, "probes", error);
    if (E == NULL || before == NULL || after == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t v = 0; v < PROBES; v++) {
        const size_t bright = (size_t)(random_unit(&seed) * (double)n);
        for (size_t c = 0; c < n_channels; c++) E[v * vector + c * n + bright] = 1;
        for (size_t i = 0; i < vector; i++) E[(PROBES + v) * vector + i] = (float)random_unit(&seed);
    }
    TRY(apply(op, E, before, error));
    TRY(apply(narrow, E, after, error));
    *out = (precision_loss){0};
    for (size_t v = 0; v < PROBES; v++) {
        out->single += difference(op, area, before + v * vector, after + v * vector) / PROBES;
        out->random +=
            difference(op, area, before + (PROBES + v) * vector, after + (PROBES + v) * vector) / PROBES;
    }
done:
    free(E);
    free(before);
    free(after);
    return status;
}

lam_status precision_replace(lam_operator **op, panel_precision precision, const double *area, uint64_t seed,
                             terminal *t, lam_error *error) {
    lam_status status = LAM_OK;
    lam_operator *made = NULL;
    precision_loss loss;
    if ((*op)->kind->narrow == NULL || precision == PANEL_F32) return LAM_OK;
    const size_t before = lam_operator_bytes(*op);
    TRY(operator_narrow(*op, precision, &made, error));
    TRY(measure_loss(*op, made, area, seed, &loss, error));
    lam_operator_close(*op);
    *op = made;
    made = NULL;
    terminal_log(
        t,
        "%s takes %.0f %% of the memory of f32 and adds %.2g to the indirect error of single elements, "
        "%.2g of random emissions",
        panel_precision_name(precision),
        100 * (double)lam_operator_bytes(*op) / (double)(before > 0 ? before : 1), loss.single, loss.random);
done:
    lam_operator_close(made);
    return status;
}
