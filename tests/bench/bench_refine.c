/* Measures the refinement of answers to a certificate: one vector, the scene's own light (or one bright
 * element where it has none), of a store of one channel that keeps its form factors.
 *
 *     bench_refine [-r ROUNDS] [-t TOLERANCE] STORE.h5 ...
 *
 * CSV. Every method multiplies with the same rows of F in double and stops at the same certificate; they take
 * turns in one run; beside other programs the best time says more than the median. `times` counts products
 * with F, `of_jacobi` is time over Jacobi's.
 */
#include "solver/base/clock.h"
#include "solver/bench/stats.h"
#include "solver/operator/refine/refinement.h"

#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_ROUNDS = 99, MOST_TIMES = 2000, MOST_BASIS = 60 };

typedef struct subject {
    lam_operator *op;
    lam_form_factors *F;
    lam_refiner *refiner;
    size_t n;
    double tolerance;
    double *E;
    refinement one; /* room, and the product of one vector */
    double *P, *r, *z, *q, *t, *basis, *images;
    size_t times;
} subject;

static void die(const char *what) {
    fprintf(stderr, "bench_refine: %s\n", what);
    exit(1);
}

static double *vector(size_t count) {
    double *made = calloc(count, sizeof *made);
    if (made == NULL) die("not enough memory");
    return made;
}

static void multiply(subject *s, const double *x, double *y) {
    refinement_multiply(&s->one, (bool[]){true}, x, y);
    s->times++;
}

/* r = R F (E + P) - P */
static void find_residual(subject *s) {
    const float *rho = s->op->reflectance;
    for (size_t i = 0; i < s->n; i++) s->t[i] = s->E[i] + s->P[i];
    multiply(s, s->t, s->r);
    for (size_t i = 0; i < s->n; i++) s->r[i] = (double)rho[i] * s->r[i] - s->P[i];
}

/* y = x - R F x */
static void apply_A(subject *s, const double *x, double *y) {
    multiply(s, x, y);
    for (size_t i = 0; i < s->n; i++) y[i] = x[i] - (double)s->op->reflectance[i] * y[i];
}

/* z = M~ r */
static void help(subject *s, const double *r, double *z) {
    double largest = 0;
    for (size_t i = 0; i < s->n; i++) largest = fmax(largest, fabs(r[i]));
    for (size_t i = 0; i < s->n; i++) s->one.narrow_in[i] = (float)(r[i] / largest);
    (void)lam_operator_apply(s->op, 1, LAM_INDIRECT, s->one.narrow_in, s->one.narrow_out, s->one.work,
                             s->one.work_bytes, NULL);
    for (size_t i = 0; i < s->n; i++) z[i] = r[i] + largest * (double)s->one.narrow_out[i];
}

static double dot(const subject *s, const double *x, const double *y) {
    const double *scale = s->refiner->channels[0].scale;
    double sum = 0;
#pragma omp simd reduction(+ : sum)
    for (size_t i = 0; i < s->n; i++) sum += scale[i] * x[i] * y[i];
    return sum;
}

/* The same certificate as that of lam_refine, of P + r; rounding apart. */
static bool certified(const subject *s, const double *r, const double *P) {
    double most = 0;
    for (size_t i = 0; i < s->n; i++) most = fmax(most, fabs(P[i] + r[i]));
    const double allowed = s->tolerance * most;
    return s->times >= MOST_TIMES ||
           refine_left(s->refiner, &s->refiner->channels[0], r, refine_most(s->n, r), allowed) <= allowed;
}

static void add(const subject *s, double a, const double *x, double *y) {
    for (size_t i = 0; i < s->n; i++) y[i] += a * x[i];
}

/* P += r */
static void jacobi(subject *s) {
    memset(s->P, 0, s->n * sizeof *s->P);
    for (find_residual(s); !certified(s, s->r, s->P); find_residual(s)) add(s, 1, s->r, s->P);
}

/* P += M~ r */
static void refinement_by_operator(subject *s) {
    memset(s->P, 0, s->n * sizeof *s->P);
    for (find_residual(s); !certified(s, s->r, s->P); find_residual(s)) {
        help(s, s->r, s->z);
        add(s, 1, s->z, s->P);
    }
}

/* Conjugate gradients in the inner product A/rho, in which I - R F is symmetric: those of the symmetric form.
 * With help flexible (Polak and Ribiere). */
static void gradients(subject *s, bool helped) {
    double *p = s->basis, *before = s->basis + s->n;
    double rz, last = 0;
    memset(s->P, 0, s->n * sizeof *s->P);
    find_residual(s);
    for (bool first = true; !certified(s, s->r, s->P); first = false) {
        if (helped)
            help(s, s->r, s->z);
        else
            memcpy(s->z, s->r, s->n * sizeof *s->z);
        rz = dot(s, s->r, s->z);
        const double beta = first ? 0 : (rz - dot(s, before, s->z)) / last;
        for (size_t i = 0; i < s->n; i++) p[i] = s->z[i] + (first ? 0 : beta * p[i]);
        apply_A(s, p, s->q);
        const double alpha = rz / dot(s, p, s->q);
        memcpy(before, s->r, s->n * sizeof *before);
        add(s, alpha, p, s->P);
        add(s, -alpha, s->q, s->r);
        last = rz;
    }
}

static void plain_gradients(subject *s) {
    gradients(s, false);
}

static void helped_gradients(subject *s) {
    gradients(s, true);
}

/* Flexible GMRES: A Z_k = V_{k+1} H_k, P = Z_k y, y the least |beta e_1 - H y|, r = V_{k+1} (beta e_1 - H y).
 */
static void gmres(subject *s) {
    const size_t n = s->n;
    double H[MOST_BASIS + 1][MOST_BASIS] = {{0}}, R[MOST_BASIS + 1][MOST_BASIS], g[MOST_BASIS + 1],
                          cosine[MOST_BASIS], sine[MOST_BASIS], y[MOST_BASIS];
    double *V = s->basis, *Z = s->images;
    memset(s->P, 0, n * sizeof *s->P);
    find_residual(s);
    const double beta = sqrt(dot(s, s->r, s->r));
    for (size_t i = 0; i < n; i++) V[i] = s->r[i] / beta;
    memset(g, 0, sizeof g);
    g[0] = beta;
    for (size_t k = 0; k < MOST_BASIS; k++) {
        double *next = V + (k + 1) * n;
        help(s, V + k * n, Z + k * n);
        apply_A(s, Z + k * n, next);
        for (size_t j = 0; j <= k; j++) {
            H[j][k] = dot(s, next, V + j * n);
            add(s, -H[j][k], V + j * n, next);
        }
        H[k + 1][k] = sqrt(dot(s, next, next));
        for (size_t i = 0; i < n; i++) next[i] /= H[k + 1][k];
        for (size_t j = 0; j <= k + 1; j++) R[j][k] = H[j][k];
        for (size_t j = 0; j < k; j++) {
            const double a = R[j][k], b = R[j + 1][k];
            R[j][k] = cosine[j] * a + sine[j] * b;
            R[j + 1][k] = cosine[j] * b - sine[j] * a;
        }
        const double length = hypot(R[k][k], R[k + 1][k]);
        cosine[k] = R[k][k] / length;
        sine[k] = R[k + 1][k] / length;
        R[k][k] = length;
        g[k + 1] = -sine[k] * g[k];
        g[k] *= cosine[k];
        for (size_t j = k + 1; j-- > 0;) {
            y[j] = g[j];
            for (size_t l = j + 1; l <= k; l++) y[j] -= R[j][l] * y[l];
            y[j] /= R[j][j];
        }
        memset(s->P, 0, n * sizeof *s->P);
        memset(s->r, 0, n * sizeof *s->r);
        for (size_t j = 0; j <= k; j++) add(s, y[j], Z + j * n, s->P);
        for (size_t j = 0; j <= k + 1; j++) {
            double left = j == 0 ? beta : 0;
            for (size_t l = 0; l <= k; l++) left -= H[j][l] * y[l];
            add(s, left, V + j * n, s->r);
        }
        if (certified(s, s->r, s->P)) return;
    }
}

static void ours(subject *s) {
    double certificate;
    lam_error error = {0};
    if (lam_refine(s->refiner, 1, LAM_INDIRECT, s->E, NULL, NULL, s->tolerance, s->P, &certificate, &s->times,
                   &error) != LAM_OK)
        die(error.message);
}

static void open_subject(const char *path, subject *s) {
    lam_error error = {0};
    store *file = NULL;
    void *emission = NULL;
    size_t dims[STORE_MAX_RANK] = {1, SIZE_MAX};
    if (lam_operator_open(path, &s->op, &error) != LAM_OK ||
        lam_form_factors_open(path, &s->F, &error) != LAM_OK || store_open(path, &file, &error) != LAM_OK ||
        store_read(file, "/mesh/emission", STORE_F32, 2, dims, &emission, &error) != LAM_OK)
        die(error.message);
    if (s->F == NULL) die("the store keeps no form factors");
    store_close(file);
    lam_operator_set_threads(s->op, (size_t)omp_get_max_threads());
    if (lam_refiner_create(s->op, s->F, &s->refiner, &error) != LAM_OK ||
        refinement_create(s->refiner, 1, &s->one, &error) != LAM_OK)
        die(error.message);
    const size_t n = s->n = s->op->n;
    s->E = vector(n);
    double largest = 0;
    for (size_t i = 0; i < n; i++) s->E[i] = (double)((const float *)emission)[i], largest += s->E[i];
    if (!(largest > 0)) s->E[n / 3] = 1;
    free(emission);
    s->P = vector(n);
    s->r = vector(n);
    s->z = vector(n);
    s->q = vector(n);
    s->t = vector(n);
    s->basis = vector((MOST_BASIS + 1) * n);
    s->images = vector((MOST_BASIS + 1) * n);
}

static void close_subject(subject *s) {
    free(s->E);
    free(s->P);
    free(s->r);
    free(s->z);
    free(s->q);
    free(s->t);
    free(s->basis);
    free(s->images);
    refinement_free(&s->one);
    lam_refiner_free(s->refiner);
    lam_form_factors_close(s->F);
    lam_operator_close(s->op);
}

int main(int argc, char **argv) {
    static const struct {
        const char *name;
        void (*run)(subject *s);
    } methods[] = {{"jacobi", jacobi},
                   {"refinement with M~", refinement_by_operator},
                   {"conjugate gradients", plain_gradients},
                   {"flexible gradients with M~", helped_gradients},
                   {"flexible GMRES with M~", gmres},
                   {"lam_refine", ours}};
    enum { METHODS = sizeof methods / sizeof *methods };
    size_t rounds = 5;
    double tolerance = 1e-6;
    int at = 1;
    for (; at + 1 < argc && argv[at][0] == '-'; at += 2) {
        if (argv[at][1] == 'r') rounds = (size_t)atoi(argv[at + 1]);
        if (argv[at][1] == 't') tolerance = atof(argv[at + 1]);
    }
    if (at == argc || rounds == 0 || rounds > MOST_ROUNDS)
        die("usage: bench_refine [-r ROUNDS] STORE.h5 ...");
    printf("store,elements,largest_reflectance,method,times,median_ms,best_ms,of_jacobi,best_of_jacobi\n");
    for (; at < argc; at++) {
        subject s = {.tolerance = tolerance};
        double ms[METHODS][MOST_ROUNDS], rho = 0;
        size_t times[METHODS];
        open_subject(argv[at], &s);
        for (size_t i = 0; i < s.n; i++) rho = fmax(rho, (double)s.op->reflectance[i]);
        for (size_t round = 0; round < rounds; round++)
            for (size_t k = 0; k < METHODS; k++) {
                s.times = 0;
                const double start = clock_seconds();
                methods[k].run(&s);
                ms[k][round] = 1e3 * (clock_seconds() - start);
                times[k] = s.times;
            }
        for (size_t k = 0; k < METHODS; k++)
            printf("%s,%zu,%g,%s,%zu,%.3g,%.3g,%.3f,%.3f\n", argv[at], s.n, rho, methods[k].name, times[k],
                   stats_median(ms[k], rounds), stats_quantile(ms[k], rounds, 0),
                   stats_median(ms[k], rounds) / stats_median(ms[0], rounds),
                   stats_quantile(ms[k], rounds, 0) / stats_quantile(ms[0], rounds, 0));
        fflush(stdout);
        close_subject(&s);
    }
    return 0;
}
