/* The contract of every operator kind: the same checks, run on each. */
#include "support/suite.h"
#include "support/transport.h"

#include <pthread.h>

static const lam_quantity quantities[] = {LAM_RADIOSITY, LAM_IRRADIANCE, LAM_INDIRECT};

enum { QUANTITIES = 3 };

static size_t vector_size(const transport *t) {
    return t->n * t->n_channels;
}

/* Judges one vector of all channels by the truth. B rounds twice more (the sum, or a division), and what the
 * tolerance itself leaves out is of second order: (1 + u)^300 - 300 u < 300 u / 50000. */
static void check_vector(const transport *t, bool adjoint, lam_quantity quantity, const float *in,
                         const float *out) {
    size_t n = t->n;
    for (size_t c = 0; c < t->n_channels; c++) {
        const float *rho = t->reflectance + c * n;
        const double *P = t->P + c * n * n, *magnitude = t->magnitude + c * n * n;
        for (size_t i = 0; i < n; i++) {
            double direct, scale, truth = 0, bound = 0;
            for (size_t j = 0; j < n; j++) {
                size_t row = adjoint ? j : i, column = adjoint ? i : j;
                double x = (double)in[c * n + j];
                quantity_row(quantity, rho[row], &direct, &scale);
                truth += scale * P[row * n + column] * x;
                bound += scale * magnitude[row * n + column] * fabs(x);
                if (i == j) {
                    truth += direct * x;
                    bound += direct * fabs(x);
                }
            }
            double found = (double)out[c * n + i];
            if (!(fabs(found - truth) <= 1.001 * (t->roundings + 3) * TRANSPORT_U * bound + 1e-12 * bound))
                ck_abort_msg("%s, %s, quantity %d, channel %zu, element %zu: %.9g instead of %.9g, bound %g",
                             t->name, adjoint ? "adjoint" : "apply", quantity, c, i, found, truth,
                             (t->roundings + 3) * TRANSPORT_U * bound);
        }
    }
}

START_TEST(agrees_with_the_reference_in_double) {
    const transport *t = transport_kept(_i);
    size_t size = vector_size(t), n_rhs = 3;
    float *in = random_vectors(n_rhs * size, 3);
    for (int q = 0; q < QUANTITIES; q++)
        for (int adjoint = 0; adjoint < 2; adjoint++) {
            float *out = transport_apply(t->op, adjoint, n_rhs, quantities[q], in);
            for (size_t r = 0; r < n_rhs; r++)
                check_vector(t, adjoint, quantities[q], in + r * size, out + r * size);
            free(out);
        }
    free(in);
}
END_TEST

/* The matrices of the test are not small against their tolerance: a wrong term would show. */
START_TEST(bounced_light_is_far_above_the_tolerance) {
    const transport *t = transport_kept(_i);
    double power = 0, bound = 0;
    for (size_t e = 0; e < t->n_channels * t->n * t->n; e++) {
        power += fabs(t->P[e]);
        bound += (t->roundings + 3) * TRANSPORT_U * t->magnitude[e];
    }
    ck_assert_double_gt(power, 1000 * bound);
}
END_TEST

/* <g, Q E> = <Q^T g, E>, both in double from rounded vectors; each side is off by at most the bound of
 * check_vector, weighted with the other vector. */
START_TEST(adjoint_is_the_transpose) {
    const transport *t = transport_kept(_i);
    size_t n = t->n, size = vector_size(t);
    float *E = random_vectors(size, 4), *g = random_vectors(size, 5);
    for (int q = 0; q < QUANTITIES; q++) {
        float *out = transport_apply(t->op, false, 1, quantities[q], E);
        float *w = transport_apply(t->op, true, 1, quantities[q], g);
        double forward = 0, backward = 0, bound = 0;
        for (size_t row = 0; row < size; row++) {
            size_t c = row / n;
            double direct, scale;
            quantity_row(quantities[q], t->reflectance[row], &direct, &scale);
            forward += (double)g[row] * (double)out[row];
            backward += (double)w[row] * (double)E[row];
            bound += direct * fabs((double)g[row] * (double)E[row]);
            for (size_t j = 0; j < n; j++)
                bound += fabs((double)g[row] * (double)E[c * n + j]) * scale * t->magnitude[row * n + j];
        }
        ck_assert_msg(fabs(forward - backward) <= 2 * 1.001 * (t->roundings + 3) * TRANSPORT_U * bound,
                      "%s, quantity %d: %.9g and %.9g", t->name, q, forward, backward);
        free(out);
        free(w);
    }
    free(E);
    free(g);
}
END_TEST

/* Doubling is exact in every step, so it must be exact at the end; the sum of two is linear up to rounding,
 * as three vectors that all agree with one matrix are. */
START_TEST(is_linear) {
    const transport *t = transport_kept(_i);
    size_t size = vector_size(t);
    float *in = random_vectors(3 * size, 6);
    for (size_t i = 0; i < size; i++) {
        in[i] = ldexpf(roundf(ldexpf(in[i], 20)), -20); /* short enough that the sum below is exact */
        in[size + i] = ldexpf(roundf(ldexpf(in[size + i], 20)), -20);
        in[2 * size + i] = in[i] + in[size + i];
    }
    for (int q = 0; q < QUANTITIES; q++)
        for (int adjoint = 0; adjoint < 2; adjoint++) {
            float *out = transport_apply(t->op, adjoint, 3, quantities[q], in);
            check_vector(t, adjoint, quantities[q], in + 2 * size, out + 2 * size);
            float *doubled = test_allocate(size, sizeof *doubled);
            for (size_t i = 0; i < size; i++) doubled[i] = -2 * in[i];
            float *twice = transport_apply(t->op, adjoint, 1, quantities[q], doubled);
            for (size_t i = 0; i < size; i++) ck_assert(twice[i] == -2 * out[i]);
            free(doubled);
            free(twice);
            free(out);
        }
    free(in);
}
END_TEST

START_TEST(without_reflectance_nothing_bounces_but_light_arrives) {
    const transport *t = transport_kept(_i);
    size_t size = vector_size(t), n = t->n, black = 0;
    float *E = random_vectors(size, 7);
    float *B = transport_apply(t->op, false, 1, LAM_RADIOSITY, E);
    float *H = transport_apply(t->op, false, 1, LAM_IRRADIANCE, E);
    float *indirect = transport_apply(t->op, false, 1, LAM_INDIRECT, E);
    for (size_t row = 0; row < size; row++) {
        double rho = (double)t->reflectance[row], b = (double)B[row], e = (double)E[row], h = (double)H[row];
        if (t->reflectance[row] == 0) {
            double truth = 0;
            for (size_t j = 0; j < n; j++) truth += t->P[row * n + j] * (double)E[row / n * n + j];
            ck_assert(B[row] == E[row]);
            ck_assert(indirect[row] == 0);
            ck_assert(truth != 0 && fabs(h - truth) < 1e-3 * fabs(truth) + 1e-4);
            black++;
        } else { /* B = E + rho H up to the rounding of H (one division), rho H and the sum */
            ck_assert(fabs(b - e - rho * h) <= TRANSPORT_U * (fabs(b) + 2 * fabs(rho * h)));
            ck_assert(B[row] == E[row] + indirect[row]);
        }
    }
    ck_assert_uint_gt(black, 5);
    free(E);
    free(B);
    free(H);
    free(indirect);
}
END_TEST

/* Under a sky: B = M~ E' and B - E' are those of E' = E + rho H0, H gets H0 on top, black elements too. */
START_TEST(sky_lights_what_reflects) {
    const transport *t = transport_kept(_i);
    const size_t n_rhs = 19, size = vector_size(t), count = n_rhs * size;
    const size_t work_bytes = lam_operator_work_bytes(t->op, n_rhs);
    float *E = random_vectors(count, 9), *H0 = random_vectors(count, 10), *lit = test_allocate(count, 4);
    float *out = test_allocate(count, sizeof *out);
    void *work = malloc(work_bytes);
    lam_error error;
    /* At last the sky alone. */
    for (int q = 0; q < 2 * QUANTITIES; q++) {
        const lam_quantity quantity = quantities[q % QUANTITIES];
        for (size_t i = 0; i < count; i++) {
            if (q >= QUANTITIES) E[i] = 0;
            lit[i] = E[i] + t->reflectance[i % size] * H0[i];
        }
        float *expected = transport_apply(t->op, false, n_rhs, quantity, lit);
        for (size_t i = 0; i < count; i++) {
            out[i] = NAN;
            if (quantity == LAM_IRRADIANCE) expected[i] += H0[i];
        }
        memset(work, 0xff, work_bytes);
        ck_assert_int_eq(lam_operator_apply_lit(t->op, n_rhs, quantity, E, H0, out, work, work_bytes, &error),
                         LAM_OK);
        ck_assert_mem_eq(out, expected, count * sizeof *out);
        free(expected);
    }
    ck_assert_int_eq(
        lam_operator_apply_lit(t->op, n_rhs, LAM_RADIOSITY, E, out, out, work, work_bytes, &error),
        LAM_ERR_ARGUMENT);
    free(E);
    free(H0);
    free(lit);
    free(out);
    free(work);
}
END_TEST

START_TEST(darkness_stays_dark) {
    const transport *t = transport_kept(_i);
    size_t size = 17 * vector_size(t);
    float *zero = test_allocate(size, sizeof *zero);
    for (int q = 0; q < QUANTITIES; q++)
        for (int adjoint = 0; adjoint < 2; adjoint++) {
            float *out = transport_apply(t->op, adjoint, 17, quantities[q], zero);
            for (size_t i = 0; i < size; i++) ck_assert(out[i] == 0);
            free(out);
        }
    free(zero);
}
END_TEST

/* Light of one channel stays there, and is that of all channels together. */
START_TEST(channels_do_not_mix) {
    const transport *t = transport_kept(_i);
    const size_t size = vector_size(t), n = t->n;
    float *all = random_vectors(size, 9), *one = test_allocate(size, sizeof *one);
    for (size_t c = 0; c < t->n_channels; c++)
        for (int q = 0; q < QUANTITIES; q++)
            for (int adjoint = 0; adjoint < 2; adjoint++) {
                memset(one, 0, size * sizeof *one);
                memcpy(one + c * n, all + c * n, n * sizeof *one);
                float *of_one = transport_apply(t->op, adjoint, 1, quantities[q], one);
                float *of_all = transport_apply(t->op, adjoint, 1, quantities[q], all);
                for (size_t i = 0; i < size; i++) ck_assert(of_one[i] == (i / n == c ? of_all[i] : 0));
                free(of_one);
                free(of_all);
            }
    free(all);
    free(one);
}
END_TEST

START_TEST(bits_do_not_depend_on_the_batch) {
    static const size_t batches[] = {1, 3, 16, 17, 40};
    const transport *t = transport_kept(_i);
    size_t size = vector_size(t);
    float *in = random_vectors(40 * size, 8);
    /* One bright element: alone it reads few rows, beside others all. */
    for (size_t i = 0; i < size; i++)
        if (i != t->n / 3) in[2 * size + i] = 0;
    for (size_t i = 0; i < t->n; i++) in[size + i] = 0; /* a dark channel beside lit ones */
    for (int q = 0; q < QUANTITIES; q++)
        for (int adjoint = 0; adjoint < 2; adjoint++) {
            float *single = test_allocate(40 * size, sizeof *single);
            for (size_t r = 0; r < 40; r++) {
                float *out = transport_apply(t->op, adjoint, 1, quantities[q], in + r * size);
                memcpy(single + r * size, out, size * sizeof *out);
                free(out);
            }
            for (size_t b = 0; b < sizeof batches / sizeof *batches; b++) {
                float *out = transport_apply(t->op, adjoint, batches[b], quantities[q], in);
                ck_assert_mem_eq(out, single, batches[b] * size * sizeof *out);
                free(out);
            }
            free(single);
        }
    free(in);
}
END_TEST

typedef struct worker {
    const transport *t;
    const float *in, *expected;
    bool same;
} worker;

enum { THREADS = 8, ROUNDS = 20, BATCH = 5 };

/* No libcheck in here: it does not know threads. */
static void *work_repeatedly(void *argument) {
    worker *self = argument;
    const lam_operator *op = self->t->op;
    size_t count = BATCH * vector_size(self->t), work_bytes = lam_operator_work_bytes(op, BATCH);
    float *out = malloc(count * sizeof *out);
    void *work = malloc(work_bytes);
    self->same = out != NULL && work != NULL;
    for (int round = 0; round < ROUNDS && self->same; round++) {
        for (size_t i = 0; i < count; i++) out[i] = NAN;
        self->same =
            lam_operator_apply(op, BATCH, LAM_RADIOSITY, self->in, out, work, work_bytes, NULL) == LAM_OK &&
            memcmp(out, self->expected, count * sizeof *out) == 0;
    }
    free(out);
    free(work);
    return NULL;
}

START_TEST(eight_threads_give_the_same_bits) {
    const transport *t = transport_kept(_i);
    float *in = random_vectors(BATCH * vector_size(t), 9);
    float *expected = transport_apply(t->op, false, BATCH, LAM_RADIOSITY, in);
    pthread_t threads[THREADS];
    worker workers[THREADS];
    for (int i = 0; i < THREADS; i++) {
        workers[i] = (worker){.t = t, .in = in, .expected = expected};
        ck_assert_int_eq(pthread_create(&threads[i], NULL, work_repeatedly, &workers[i]), 0);
    }
    for (int i = 0; i < THREADS; i++) pthread_join(threads[i], NULL);
    for (int i = 0; i < THREADS; i++) ck_assert(workers[i].same);
    free(in);
    free(expected);
}
END_TEST

/* Chosen rows, some twice, are those of the whole answer. */
START_TEST(selected_elements_have_the_same_bits) {
    enum { N_RHS = 19, SELECTED = 40 };
    const transport *t = transport_kept(_i);
    const size_t size = vector_size(t), rows = N_RHS * t->n_channels;
    const size_t work_bytes = lam_operator_work_bytes(t->op, N_RHS);
    float *E = random_vectors(N_RHS * size, 13), *H0 = random_vectors(N_RHS * size, 14);
    float *whole = test_allocate(N_RHS * size, sizeof *whole);
    float *some = test_allocate(rows * SELECTED, sizeof *some);
    void *work = malloc(work_bytes);
    uint32_t selected[SELECTED];
    lam_error error = {.message = ""};
    for (size_t r = 0; r < SELECTED; r++) selected[r] = (uint32_t)((r * r * 7 + 150) % t->n);
    for (size_t i = 0; i < t->n; i++) E[size + i] = 0; /* a dark channel */
    for (int q = 0; q < QUANTITIES; q++)
        for (int lit = 0; lit < 2; lit++)
            for (size_t count = 0; count <= SELECTED; count += SELECTED / 2) {
                for (size_t i = 0; i < rows * SELECTED; i++) some[i] = NAN;
                ck_assert(lam_operator_apply_lit(t->op, N_RHS, quantities[q], E, lit ? H0 : NULL, whole, work,
                                                 work_bytes, &error) == LAM_OK);
                memset(work, 0xff, work_bytes);
                ck_assert_msg(lam_operator_apply_selected(t->op, N_RHS, quantities[q], E, lit ? H0 : NULL,
                                                          count, selected, some, work, work_bytes,
                                                          &error) == LAM_OK,
                              "%s", error.message);
                for (size_t row = 0; row < rows; row++)
                    for (size_t r = 0; r < count; r++)
                        ck_assert(memcmp(&some[row * count + r], &whole[row * t->n + selected[r]],
                                         sizeof(float)) == 0);
            }
    selected[SELECTED - 1] = (uint32_t)t->n;
    ck_assert(lam_operator_apply_selected(t->op, 1, LAM_RADIOSITY, E, NULL, SELECTED, selected, some, work,
                                          work_bytes, &error) == LAM_ERR_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(error.message, "selected[39] = 151, must be below 151"));
    ck_assert(lam_operator_apply_selected(t->op, 1, LAM_RADIOSITY, E, NULL, SELECTED, NULL, some, work,
                                          work_bytes, &error) == LAM_ERR_ARGUMENT);
    free(E);
    free(H0);
    free(whole);
    free(some);
    free(work);
}
END_TEST

/* Callers who share passes, some of which begin and end within a caller's vectors, each with a quantity of
 * its own, under a sky or not. */
START_TEST(callers_who_share_passes_get_their_own_bits) {
    static const size_t counts[] = {1, 3, 20, 0, 2, 7};
    enum { CALLERS = sizeof counts / sizeof *counts, VECTORS = 33 };
    const transport *t = transport_kept(_i);
    const size_t size = vector_size(t), work_bytes = lam_operator_work_bytes(t->op, VECTORS);
    float *E = random_vectors(VECTORS * size, 15), *H0 = random_vectors(VECTORS * size, 16);
    float *shared = test_allocate(VECTORS * size, sizeof *shared);
    float *alone = test_allocate(VECTORS * size, sizeof *alone);
    void *work = malloc(work_bytes);
    lam_part parts[CALLERS];
    lam_error error = {.message = ""};
    size_t first = 0;
    for (size_t i = 0; i < VECTORS * size; i++) shared[i] = NAN;
    for (size_t k = 0; k < CALLERS; first += counts[k++]) {
        parts[k] = (lam_part){.n_rhs = counts[k],
                              .quantity = quantities[k % QUANTITIES],
                              .E = E + first * size,
                              .H0 = k % 2 == 1 ? H0 + first * size : NULL,
                              .out = shared + first * size};
        ck_assert(lam_operator_apply_lit(t->op, counts[k], parts[k].quantity, parts[k].E, parts[k].H0,
                                         alone + first * size, work, work_bytes, &error) == LAM_OK);
    }
    ck_assert_uint_eq(first, VECTORS);
    memset(work, 0xff, work_bytes);
    ck_assert_msg(lam_operator_apply_parts(t->op, CALLERS, parts, work, work_bytes, &error) == LAM_OK, "%s",
                  error.message);
    ck_assert_mem_eq(shared, alone, VECTORS * size * sizeof *shared);
    /* One of them wrong: nobody gets anything. */
    parts[2].quantity = (lam_quantity)7;
    for (size_t i = 0; i < VECTORS * size; i++) shared[i] = NAN;
    ck_assert(lam_operator_apply_parts(t->op, CALLERS, parts, work, work_bytes, &error) == LAM_ERR_ARGUMENT);
    for (size_t i = 0; i < VECTORS * size; i++) ck_assert(isnan(shared[i]));
    parts[2].quantity = LAM_RADIOSITY;
    ck_assert(lam_operator_apply_parts(t->op, CALLERS, parts, work, lam_operator_work_bytes(t->op, 3),
                                       &error) == LAM_ERR_ARGUMENT);
    free(E);
    free(H0);
    free(shared);
    free(alone);
    free(work);
}
END_TEST

START_TEST(work_area_is_not_overrun) {
    enum { GUARD = 256 };
    const transport *t = transport_kept(_i);
    for (size_t n_rhs = 1; n_rhs <= 18; n_rhs++)
        for (size_t shift = 0; shift < 64; shift += 16) { /* any alignment that malloc may give */
            size_t count = n_rhs * vector_size(t), bytes = lam_operator_work_bytes(t->op, n_rhs);
            float *in = random_vectors(count, 10), *out = test_allocate(count + 2, sizeof *out);
            unsigned char *area = aligned_alloc(64, (bytes + shift + 2 * GUARD + 63) / 64 * 64);
            out[count] = 77;
            for (int adjoint = 0; adjoint < 2; adjoint++) {
                unsigned char *work = area + GUARD + shift;
                memset(area, 0xa5, bytes + shift + 2 * GUARD);
                lam_status status =
                    adjoint
                        ? lam_operator_apply_adjoint(t->op, n_rhs, LAM_IRRADIANCE, in, out, work, bytes, NULL)
                        : lam_operator_apply(t->op, n_rhs, LAM_IRRADIANCE, in, out, work, bytes, NULL);
                ck_assert(status == LAM_OK);
                for (size_t i = 0; i < GUARD; i++) ck_assert(area[i] == 0xa5 && work[bytes + i] == 0xa5);
                ck_assert_float_eq(out[count], 77);
            }
            free(in);
            free(out);
            free(area);
        }
}
END_TEST

START_TEST(bad_arguments_are_refused) {
    const transport *t = transport_kept(_i);
    lam_error error = {.message = ""};
    size_t size = vector_size(t), bytes = lam_operator_work_bytes(t->op, 2), span = 2 * size * sizeof(float);
    float *in = random_vectors(2 * size, 11), *out = test_allocate(2 * size, sizeof *out);
    char *work = malloc(bytes + span);
    for (size_t i = 0; i < 2 * size; i++) out[i] = 77;
    lam_status (*const apply[])(const lam_operator *, size_t, lam_quantity, const float *, float *, void *,
                                size_t, lam_error *) = {lam_operator_apply, lam_operator_apply_adjoint};
#define check_refused(word, ...)                                                                             \
    do {                                                                                                     \
        error = (lam_error){.message = ""};                                                                  \
        ck_assert(apply[a](__VA_ARGS__, &error) == LAM_ERR_ARGUMENT);                                        \
        ck_assert_msg(strstr(error.message, word) != NULL, "no '%s' in '%s'", word, error.message);          \
        ck_assert(apply[a](__VA_ARGS__, NULL) == LAM_ERR_ARGUMENT);                                          \
    } while (0)
    for (int a = 0; a < 2; a++) {
        check_refused("NULL", NULL, 2, LAM_RADIOSITY, in, out, work, bytes);
        check_refused("NULL", t->op, 2, LAM_RADIOSITY, NULL, out, work, bytes);
        check_refused("NULL", t->op, 2, LAM_RADIOSITY, in, NULL, work, bytes);
        check_refused("NULL", t->op, 2, LAM_RADIOSITY, in, out, NULL, bytes);
        check_refused("are needed for n_rhs = 2", t->op, 2, LAM_RADIOSITY, in, out, work, bytes - 1);
        check_refused("are needed", t->op, 2, LAM_RADIOSITY, in, out, work, 0);
        check_refused("quantity 3", t->op, 2, (lam_quantity)3, in, out, work, bytes);
        check_refused("quantity", t->op, 2, (lam_quantity)-1, in, out, work, bytes);
        check_refused("aligned", t->op, 2, LAM_RADIOSITY, in, out, work + 8, bytes);
        check_refused("overlap", t->op, 2, LAM_RADIOSITY, in, in, work, bytes);
        check_refused("overlap", t->op, 2, LAM_RADIOSITY, out, out + size, work, bytes);
        check_refused("overlap", t->op, 2, LAM_RADIOSITY, out + 2 * size - 1, out, work, bytes);
        check_refused("overlap", t->op, 2, LAM_RADIOSITY, in, (float *)(void *)work, work, bytes);
        check_refused("overlap", t->op, 2, LAM_RADIOSITY, (float *)(void *)(work + bytes - 4), out, work,
                      bytes);
        check_refused("more than memory", t->op, SIZE_MAX / 2, LAM_RADIOSITY, in, out, work, bytes);
        check_refused("more than memory", t->op, SIZE_MAX / size / 2, LAM_RADIOSITY, in, out, work, bytes);
        ck_assert(apply[a](t->op, 0, LAM_RADIOSITY, in, out, work, bytes, NULL) == LAM_OK);
    }
#undef check_refused
    for (size_t i = 0; i < 2 * size; i++) ck_assert(out[i] == 77);
    free(in);
    free(out);
    free(work);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("operator contract");
    TCase *tests = tcase_create("every kind");
    tcase_set_timeout(tests, 300);
    tcase_add_unchecked_fixture(tests, transport_keep_all, transport_free_all);
    tcase_add_loop_test(tests, agrees_with_the_reference_in_double, 0, TRANSPORTS);
    tcase_add_loop_test(tests, bounced_light_is_far_above_the_tolerance, 0, TRANSPORTS);
    tcase_add_loop_test(tests, adjoint_is_the_transpose, 0, TRANSPORTS);
    tcase_add_loop_test(tests, is_linear, 0, TRANSPORTS);
    tcase_add_loop_test(tests, without_reflectance_nothing_bounces_but_light_arrives, 0, TRANSPORTS);
    tcase_add_loop_test(tests, sky_lights_what_reflects, 0, TRANSPORTS);
    tcase_add_loop_test(tests, darkness_stays_dark, 0, TRANSPORTS);
    tcase_add_loop_test(tests, channels_do_not_mix, 0, TRANSPORTS);
    tcase_add_loop_test(tests, bits_do_not_depend_on_the_batch, 0, TRANSPORTS);
    tcase_add_loop_test(tests, eight_threads_give_the_same_bits, 0, TRANSPORTS);
    tcase_add_loop_test(tests, selected_elements_have_the_same_bits, 0, TRANSPORTS);
    tcase_add_loop_test(tests, callers_who_share_passes_get_their_own_bits, 0, TRANSPORTS);
    tcase_add_loop_test(tests, work_area_is_not_overrun, 0, TRANSPORTS);
    tcase_add_loop_test(tests, bad_arguments_are_refused, 0, TRANSPORTS);
    suite_add_tcase(suite, tests);
    return suite_run_together(suite);
}
