/* Loops between vectors and rows of lanes, at each level of the CPU, beside the same written plainly. */
#include "solver/operator/lane_rows.h"
#include "solver/operator/mean_correction.h"

#include "support/suite.h"

#include <string.h>

enum { ROWS = 61, LONG = 200 };

typedef struct subject {
    _Alignas(64) float X[ROWS][LANES];
    float vectors[LANES][LONG], by[ROWS], lift[ROWS];
    _Alignas(64) float factor[LANES];
    const float *from[LANES];
    lane_block b;
} subject;

/* Numbers of both signs, a tenth of them 0 and a tenth -0. */
static float number(unsigned *seed) {
    *seed = *seed * 1664525u + 1013904223u;
    const unsigned r = *seed >> 8;
    if (r % 10 == 0) return 0;
    if (r % 10 == 1) return -0.0f;
    return ((float)r / 16777216 - .5f) * 8;
}

static void subject_make(subject *s, size_t count, unsigned seed) {
    s->b = (lane_block){.first = seed % (LONG - LANES), .count = count};
    for (size_t k = 0; k < count; k++) s->b.row[k] = (uint32_t)((seed + 7 * k) % ROWS);
    for (size_t p = 0; p < ROWS; p++) {
        s->by[p] = number(&seed);
        s->lift[p] = number(&seed);
        for (size_t v = 0; v < LANES; v++) s->X[p][v] = number(&seed);
    }
    for (size_t v = 0; v < LANES; v++) {
        s->factor[v] = number(&seed);
        for (size_t i = 0; i < LONG; i++) s->vectors[v][i] = number(&seed);
        s->from[v] = s->vectors[v] + s->b.first;
    }
}

static void check_bits(float found, float wanted) {
    ck_assert_msg(memcmp(&found, &wanted, sizeof found) == 0, "%a, must be %a", (double)found,
                  (double)wanted);
}

/* Calls `check` for each level, each number of elements and several places. */
static void each(void (*check)(const lane_kernels *run, subject *s)) {
    for (cpu_level level = CPU_PORTABLE; level <= cpu_best(); level++)
        for (unsigned seed = 0; seed < 5 * LANES; seed++) {
            subject s;
            subject_make(&s, 1 + seed % LANES, seed * 17);
            check(lane_kernels_of(level), &s);
        }
}

static void check_put(const lane_kernels *run, subject *s) {
    for (int scaled = 0; scaled < 2; scaled++) {
        _Alignas(64) float X[ROWS][LANES];
        memcpy(X, s->X, sizeof X);
        run->put(&s->b, s->from, scaled ? s->by : NULL, X[0]);
        for (size_t k = 0; k < s->b.count; k++)
            for (size_t v = 0; v < LANES; v++) {
                float *at = &s->X[s->b.row[k]][v];
                *at = scaled ? s->from[v][k] * s->by[s->b.row[k]] : s->from[v][k];
            }
        for (size_t p = 0; p < ROWS; p++)
            for (size_t v = 0; v < LANES; v++) check_bits(X[p][v], s->X[p][v]);
    }
}

START_TEST(rows_get_numbers_of_vectors) {
    each(check_put);
}
END_TEST

static void check_sum(const lane_kernels *run, subject *s) {
    const size_t count = ROWS - s->b.count;
    double sums[LANES];
    float x[ROWS];
    run->sum(s->by, s->X[0], count, sums);
    for (size_t v = 0; v < LANES; v++) {
        for (size_t p = 0; p < count; p++) x[p] = s->X[p][v];
        const double wanted = mean_correction_sum(s->by, x, count);
        ck_assert_msg(memcmp(&sums[v], &wanted, sizeof wanted) == 0, "%a, must be %a", sums[v], wanted);
    }
}

START_TEST(sums_have_their_order) {
    each(check_sum);
}
END_TEST

static float bounced(const subject *s, const lane_bounce *bounce, size_t row, size_t v) {
    const float left = s->by[row], reflected = left * s->X[row][v];
    if (bounce->adjoint) return reflected + s->factor[v] * (left * left) + 0.0f;
    return bounce->lift != NULL ? reflected + 0.0f + s->factor[v] * s->lift[row] : reflected + 0.0f;
}

static void check_take(const lane_kernels *run, subject *s) {
    for (int kind = 0; kind < 3; kind++) {
        const lane_bounce bounce = {
            .adjoint = kind == 2, .left = s->by, .lift = kind == 1 ? s->lift : NULL, .factor = s->factor};
        _Alignas(64) float P[LANES][LANES];
        run->take(&bounce, &s->b, s->X[0], P);
        for (size_t v = 0; v < LANES; v++)
            for (size_t k = 0; k < LANES; k++)
                check_bits(P[v][k], k < s->b.count ? bounced(s, &bounce, s->b.row[k], v) : 0.0f);
    }
}

START_TEST(vectors_get_bounces_of_rows) {
    each(check_take);
}
END_TEST

static void check_radiosity(const lane_kernels *run, subject *s) {
    _Alignas(64) float P[LANES][LANES];
    float rho[LONG], out[LANES][LONG];
    const float *E[LANES];
    float *to[LANES];
    const size_t count = s->b.count, first = s->b.first;
    for (size_t i = 0; i < LONG; i++) rho[i] = s->vectors[3][i] > 0 ? s->vectors[3][i] : 0;
    for (size_t v = 0; v < LANES; v++) {
        E[v] = s->vectors[v];
        to[v] = out[v];
        memcpy(P[v], s->X[v], sizeof P[v]);
        for (size_t i = 0; i < LONG; i++) out[v][i] = 77;
    }
    run->radiosity(&s->b, count, rho, E, (const float(*)[LANES])P, to);
    for (size_t v = 0; v < LANES; v++)
        for (size_t i = 0; i < LONG; i++) {
            const bool written = v < count && i >= first && i < first + s->b.count;
            const float B = rho[i] > 0 ? E[v][i] + P[v][written ? i - first : 0] : E[v][i];
            check_bits(out[v][i], written ? B : 77.0f);
        }
}

START_TEST(radiosities_are_written_where_elements_are) {
    each(check_radiosity);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("lane rows");
    TCase *tests = tcase_create("lane rows");
    tcase_add_test(tests, rows_get_numbers_of_vectors);
    tcase_add_test(tests, sums_have_their_order);
    tcase_add_test(tests, vectors_get_bounces_of_rows);
    tcase_add_test(tests, radiosities_are_written_where_elements_are);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
