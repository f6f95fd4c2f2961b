#include "support/dense.h"

#include "solver/base/random.h"

void *test_allocate(size_t count, size_t size) {
    void *memory = calloc(count + 1, size);
    ck_assert_ptr_nonnull(memory);
    return memory;
}

float *test_random_positive(size_t count, uint64_t seed) {
    float *x = test_allocate(count, sizeof *x);
    for (size_t i = 0; i < count; i++) x[i] = (float)random_lcg_unit(&seed);
    return x;
}

void invert(size_t n, double *X) {
    double *inverse = test_allocate(n * n, sizeof *inverse);
    for (size_t i = 0; i < n; i++) inverse[i * n + i] = 1;
    for (size_t c = 0; c < n; c++) {
        size_t pivot = c;
        for (size_t i = c + 1; i < n; i++)
            if (fabs(X[i * n + c]) > fabs(X[pivot * n + c])) pivot = i;
        for (size_t j = 0; j < n; j++) {
            double x = X[c * n + j], y = inverse[c * n + j];
            X[c * n + j] = X[pivot * n + j];
            X[pivot * n + j] = x;
            inverse[c * n + j] = inverse[pivot * n + j];
            inverse[pivot * n + j] = y;
        }
        double scale = 1 / X[c * n + c];
        for (size_t j = 0; j < n; j++) {
            X[c * n + j] *= scale;
            inverse[c * n + j] *= scale;
        }
        for (size_t i = 0; i < n; i++) {
            double factor = X[i * n + c];
            if (i == c || factor == 0) continue;
            for (size_t j = 0; j < n; j++) {
                X[i * n + j] -= factor * X[c * n + j];
                inverse[i * n + j] -= factor * inverse[c * n + j];
            }
        }
    }
    memcpy(X, inverse, n * n * sizeof *X);
    free(inverse);
}

double rho_or_one(float rho) {
    return rho > 0 ? (double)rho : 1.0;
}

void bounced_light(size_t n, const double *F, const float *rho, double *P) {
    double *M = test_allocate(n * n, sizeof *M);
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) M[i * n + j] = (i == j ? 1.0 : 0.0) - (double)rho[i] * F[i * n + j];
    invert(n, M);
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) {
            double sum = 0;
            for (size_t l = 0; l < n; l++) sum += F[i * n + l] * M[l * n + j];
            P[i * n + j] = rho_or_one(rho[i]) * sum;
        }
    free(M);
}

void random_factors(size_t n, size_t k, float *U, float *V, uint64_t *state) {
    double *A = test_allocate(n, sizeof *A), largest = 0;
    double *column = test_allocate(k, sizeof *column);
    for (size_t i = 0; i < n; i++) {
        A[i] = 0.1 + 3 * random_lcg_unit(state);
        for (size_t j = 0; j < k; j++) {
            V[i * k + j] = random_lcg_unit(state) < 0.4 ? (float)random_lcg_unit(state) : 0.0f;
            column[j] += (double)V[i * k + j];
        }
    }
    for (size_t i = 0; i < n; i++) {
        double sum = 0;
        for (size_t j = 0; j < k; j++) sum += (double)V[i * k + j] * column[j] / A[i];
        largest = fmax(largest, sum);
    }
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < k; j++) U[i * k + j] = (float)(0.95 * (double)V[i * k + j] / A[i] / largest);
    /* The same product from unlike factors, or the core would be symmetric and its transpose as good. */
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < k; j++) {
            U[i * k + j] = ldexpf(U[i * k + j], (int)(j % 5) - 2);
            V[i * k + j] = ldexpf(V[i * k + j], 2 - (int)(j % 5));
        }
    free(A);
    free(column);
}

float *random_reflectance(size_t n, size_t n_channels, uint64_t *state) {
    float *rho = test_allocate(n * n_channels, sizeof *rho);
    for (size_t i = 0; i < n * n_channels; i++)
        rho[i] = random_lcg_unit(state) < 1 / 6.0 ? 0.0f : (float)(0.05 + 0.8 * random_lcg_unit(state));
    return rho;
}

float *in_positions(const uint32_t *order, size_t n, size_t columns, bool square, const float *x) {
    float *y = test_allocate(n * columns, sizeof *y);
    for (size_t p = 0; p < n; p++)
        for (size_t j = 0; j < columns; j++)
            y[p * columns + j] = x[(order ? order[p] : p) * columns + (square && order ? order[j] : j)];
    return y;
}

uint32_t *random_order(size_t n, uint64_t *state) {
    uint32_t *order = test_allocate(n, sizeof *order);
    for (size_t p = 0; p < n; p++) order[p] = (uint32_t)p;
    for (size_t p = n; p > 1; p--) {
        size_t other = (size_t)(random_lcg_unit(state) * (double)p);
        uint32_t x = order[p - 1];
        order[p - 1] = order[other];
        order[other] = x;
    }
    return order;
}
