/* Operators of few emitters: their answers against sums in double, their transpose, what they can tell from
 * an emission, and what a store may not be. */
#include "solver/base/random.h"
#include "solver/operator/emitters.h"
#include "solver/operator/luminaire_light.h"
#include "solver/operator/sky_light.h"
#include "support/failing_memory.h"
#include "support/operator_file.h"
#include "support/suite.h"

static lam_error error;

enum { N = 61, C = 2, S = 7, M = 5, MANY = 35 };

/* The last emitters are these luminaires, in the variant that has them. */
enum { LUMINAIRES = 2, FIRST_LUMINAIRE = S - LUMINAIRES };
static const char *const names[S] = {"a", "b", "c", "d", "tile", "both", "all"};

static void setup(void) {
    operator_file_setup();
    allocations_left = -1;
}

/* Everything in double; T is rho' H. */
typedef struct problem {
    float rho[C * N], first_bounce[M * N], L[C * S * M], E[C * S * N];
    bool outside; /* they give direct light from outside the mesh too: */
    float direct[S * N], exitance[C];
    bool luminaires; /* the last ones are luminaires, of these irradiances and colours: */
    float irradiance[LUMINAIRES * N];
    double colour[LUMINAIRES * 3];
    double T[C * S * N];
} problem;

enum { PLAIN, OUTSIDE, LIT, VARIANTS };

/* Emitters 0 to 3 are elements, 4 and 5 tiles of the sky (5 with an element), 6 all elements of the others.
 */
static problem *make_problem(int variant) {
    uint64_t state = 11;
    problem *p = test_allocate(1, sizeof *p);
    float *rho = random_reflectance(N, C, &state);
    memcpy(p->rho, rho, sizeof p->rho);
    free(rho);
    for (size_t k = 0; k < M * N; k++) p->first_bounce[k] = (float)(.1 * random_lcg_unit(&state));
    for (size_t c = 0; c < C; c++) {
        for (size_t k = 0; k < 4; k++) {
            p->E[(c * S + k) * N + 3 * k] = (float)(k + 1);
            p->E[(c * S + k) * N + 3 * k + 30] = (float)(c + .5);
            p->E[(c * S + 6) * N + 3 * k] = 2;
            p->E[(c * S + 6) * N + 3 * k + 30] = 1;
        }
        p->L[(c * S + 4) * M + 1] = 2;
        p->L[(c * S + 5) * M + 3] = (float)(c + 1);
        p->E[(c * S + 5) * N + 59] = .25f;
    }
    for (size_t k = 0; k < (size_t)C * S * N; k++) p->T[k] = .3 * random_lcg_unit(&state);
    for (size_t k = 0; k < S * N; k++) p->direct[k] = (float)(.1 * random_lcg_unit(&state));
    for (size_t c = 0; c < C; c++) p->exitance[c] = (float)(c + 2);
    for (size_t k = 0; k < LUMINAIRES * N; k++) p->irradiance[k] = (float)(.1 * random_lcg_unit(&state));
    for (size_t k = 0; k < (size_t)LUMINAIRES * 3; k++) p->colour[k] = .5 + random_lcg_unit(&state);
    p->outside = variant == OUTSIDE;
    p->luminaires = variant == LIT;
    /* Luminaires are no elements and no tiles. */
    for (size_t c = 0; p->luminaires && c < C; c++) {
        memset(p->E + (c * S + FIRST_LUMINAIRE) * N, 0, LUMINAIRES * N * sizeof *p->E);
        memset(p->L + (c * S + FIRST_LUMINAIRE) * M, 0, LUMINAIRES * M * sizeof *p->L);
    }
    return p;
}

/* The irradiance that emitter k gives directly, by the sky and otherwise. */
static double direct_light(const problem *p, size_t c, size_t k, size_t i) {
    double H0 = p->outside ? (double)p->exitance[c] * (double)p->direct[k * N + i] : 0;
    if (p->luminaires && k >= FIRST_LUMINAIRE)
        H0 += p->colour[(k - FIRST_LUMINAIRE) * 3 + c] * (double)p->irradiance[(k - FIRST_LUMINAIRE) * N + i];
    for (size_t t = 0; t < M; t++)
        H0 += (double)p->L[(c * S + k) * M + t] * (double)p->first_bounce[t * N + i];
    return H0;
}

/* s: how many of the emitters. */
static lam_status make_operator(const problem *p, size_t s, lam_operator **op, lam_error *cause) {
    lam_status status = LAM_OK;
    double factors[C * LUMINAIRES];
    emitter_arrays a = {.s = s, .n_tiles = M};
    a.names = test_allocate(s * sizeof(char *) + 64, 1);
    char *text = (char *)(a.names + s);
    for (size_t k = 0; k < s; k++) {
        a.names[k] = text;
        text = stpcpy(text, names[k]) + 1;
    }
    a.T = test_allocate((size_t)C * s * N, sizeof *a.T);
    a.ends = test_allocate(C * s + 1, sizeof *a.ends);
    a.elements = test_allocate((size_t)C * S * N, sizeof *a.elements);
    a.values = test_allocate((size_t)C * S * N, sizeof *a.values);
    a.L = test_allocate(C * s * M, sizeof *a.L);
    uint64_t at = 0;
    for (size_t c = 0; c < C; c++)
        for (size_t k = 0; k < s; k++) {
            for (size_t i = 0; i < N; i++) {
                a.T[(c * s + k) * N + i] = (float)p->T[(c * S + k) * N + i];
                if (!(p->E[(c * S + k) * N + i] > 0)) continue;
                a.elements[at] = (uint32_t)i;
                a.values[at++] = p->E[(c * S + k) * N + i];
            }
            a.ends[c * s + k + 1] = at;
            memcpy(a.L + (c * s + k) * M, p->L + (c * S + k) * M, M * sizeof *a.L);
        }
    TRY(sky_create(M, N, p->first_bounce, &a.sky, cause));
    if (p->outside) {
        a.direct = test_allocate(s * N, sizeof *a.direct);
        a.exitance = test_allocate(C, sizeof *a.exitance);
        memcpy(a.direct, p->direct, s * N * sizeof *a.direct);
        memcpy(a.exitance, p->exitance, sizeof p->exitance);
    }
    for (size_t k = 0; k < (size_t)C * LUMINAIRES; k++)
        factors[k] = p->colour[k % LUMINAIRES * 3 + k / LUMINAIRES];
    if (p->luminaires) TRY(luminaires_create(LUMINAIRES, N, C, p->irradiance, factors, &a.luminaires, cause));
    TRY(operator_emitters_create(N, C, p->rho, &a, op, cause));
done:
    emitter_arrays_free(&a);
    return status;
}

static lam_operator *good_operator(const problem *p, size_t s) {
    lam_operator *op = NULL;
    ck_ok(make_operator(p, s, &op, &error));
    ck_assert_uint_eq(lam_operator_emitters(op), s);
    return op;
}

/* d quantity_i / d w_k, in double. */
static double derivative(const problem *p, size_t c, size_t k, size_t i, lam_quantity quantity) {
    const double T = p->T[(c * S + k) * N + i], rho = (double)p->rho[c * N + i];
    if (quantity == LAM_IRRADIANCE) return T / rho_or_one((float)rho);
    if (quantity == LAM_INDIRECT) return rho > 0 ? T - rho * direct_light(p, c, k, i) : 0;
    return (double)p->E[(c * S + k) * N + i] + (rho > 0 ? T : 0);
}

static const lam_quantity quantities[] = {LAM_RADIOSITY, LAM_IRRADIANCE, LAM_INDIRECT};

typedef struct area {
    void *bytes;
    size_t size;
} area;

static area work_area(const lam_operator *op, size_t n_rhs) {
    const size_t bytes = lam_operator_work_bytes(op, n_rhs);
    ck_assert_uint_gt(bytes, 0);
    return (area){malloc(bytes), bytes};
}

START_TEST(answers_are_sums) {
    problem *p = make_problem(_i);
    lam_operator *op = good_operator(p, S);
    float *W = random_vectors((size_t)MANY * C * S, 3),
          *out = test_allocate((size_t)MANY * C * N, sizeof *out);
    float *one = test_allocate((size_t)C * N, sizeof *one), some[C * 4];
    const uint32_t selected[4] = {60, 3, 3, 17};
    const area work = work_area(op, MANY);
    for (int q = 0; q < 3; q++) {
        ck_ok(lam_operator_apply_emitters(op, MANY, quantities[q], W, 0, NULL, out, work.bytes, work.size,
                                          &error));
        for (size_t v = 0; v < MANY; v++) {
            const float *w = W + v * C * S, *row = out + v * C * N;
            for (size_t c = 0; c < C; c++)
                for (size_t i = 0; i < N; i++) {
                    double sum = 0, magnitude = 0;
                    for (size_t k = 0; k < S; k++) {
                        const double x = (double)w[c * S + k] * derivative(p, c, k, i, quantities[q]);
                        sum += x;
                        magnitude += fabs(x);
                    }
                    /* T is rounded where it is stored as E + T, of at most 4. */
                    ck_assert_double_le(fabs((double)row[c * N + i] - sum),
                                        40 * TRANSPORT_U * (magnitude + 4));
                }
            ck_ok(lam_operator_apply_emitters(op, 1, quantities[q], w, 0, NULL, one, work.bytes, work.size,
                                              &error));
            ck_assert_mem_eq(one, row, C * N * sizeof *one);
            ck_ok(lam_operator_apply_emitters(op, 1, quantities[q], w, 4, selected, some, work.bytes,
                                              work.size, &error));
            for (size_t c = 0; c < C; c++)
                for (size_t r = 0; r < 4; r++)
                    ck_assert_mem_eq(&some[c * 4 + r], &row[c * N + selected[r]], sizeof *some);
        }
    }
    free(work.bytes);
    free(W);
    free(out);
    free(one);
    lam_operator_close(op);
    free(p);
}
END_TEST

/* The adjoint against the derivative itself. */
START_TEST(adjoint_is_the_transpose) {
    problem *p = make_problem(_i);
    lam_operator *op = good_operator(p, S);
    float *g = random_vectors((size_t)MANY * C * N, 7), *W = test_allocate((size_t)MANY * C * S, sizeof *W);
    for (size_t k = 0; k < (size_t)MANY * C * N; k += 3) g[k] = -g[k];
    const area work = work_area(op, MANY);
    for (int q = 0; q < 3; q++) {
        ck_ok(lam_operator_adjoint_emitters(op, MANY, quantities[q], g, W, work.bytes, work.size, &error));
        for (size_t v = 0; v < MANY; v++)
            for (size_t c = 0; c < C; c++)
                for (size_t k = 0; k < S; k++) {
                    double sum = 0, magnitude = 0;
                    for (size_t i = 0; i < N; i++) {
                        const double x =
                            (double)g[(v * C + c) * N + i] * derivative(p, c, k, i, quantities[q]);
                        sum += x;
                        magnitude += fabs(x);
                    }
                    ck_assert_double_le(fabs((double)W[(v * C + c) * S + k] - sum),
                                        40 * TRANSPORT_U * (magnitude + 4 * N));
                }
    }
    free(work.bytes);
    free(g);
    free(W);
    lam_operator_close(op);
    free(p);
}
END_TEST

/* Weights come back from what they send out; what no weights send is refused. The last emitter is nowhere
 * alone, so it is left out here. */
START_TEST(weights_follow_from_light) {
    enum { FEW = 6 };
    problem *p = make_problem(PLAIN);
    lam_operator *op = good_operator(p, FEW);
    float *W = random_vectors((size_t)MANY * C * FEW, 3), *E = test_allocate((size_t)MANY * C * N, sizeof *E);
    float *H0 = test_allocate((size_t)MANY * C * N, sizeof *H0),
          *L = test_allocate((size_t)MANY * C * M, sizeof *L);
    float *found = test_allocate((size_t)MANY * C * FEW, sizeof *found);
    for (size_t k = 0; k < C * FEW; k++) W[k] = 0; /* nothing at all */
    ck_ok(operator_emitters_light(op, MANY, W, E, H0, &error));
    for (size_t row = 0; row < (size_t)MANY * C; row++) {
        for (size_t i = 0; i < N; i++) {
            double sum = 0;
            for (size_t k = 0; k < FEW; k++)
                sum += (double)W[row * FEW + k] * (double)p->E[((row % C) * S + k) * N + i];
            ck_assert_double_le(fabs((double)E[row * N + i] - sum), 1e-5 * fabs(sum));
        }
        for (size_t t = 0; t < M; t++)
            for (size_t k = 0; k < FEW; k++)
                L[row * M + t] += W[row * FEW + k] * p->L[((row % C) * S + k) * M + t];
    }
    lam_sky *sky = NULL;
    ck_ok(sky_create(M, N, p->first_bounce, &sky, &error));
    float *direct = test_allocate((size_t)MANY * C * N, sizeof *direct);
    lam_sky_irradiance(sky, (size_t)MANY * C, L, direct);
    ck_assert_mem_eq(direct, H0, (size_t)MANY * C * N * sizeof *H0);
    ck_ok(lam_operator_weights(op, MANY, E, M, L, found, &error));
    for (size_t k = 0; k < (size_t)MANY * C * FEW; k++)
        ck_assert_double_le(fabs((double)found[k] - (double)W[k]), 1e-5 * fabs((double)W[k]));

    float *last = E + ((size_t)MANY * C - 1) * N;
    last[44] = 1e-3f;
    ck_assert(lam_operator_weights(op, MANY, E, M, L, found, &error) == LAM_ERR_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(error.message, "element 44 emits 0.001"));
    last[44] = 0;
    last[30] *= 1.001f;
    ck_assert(lam_operator_weights(op, MANY, E, M, L, found, &error) == LAM_ERR_ARGUMENT);
    last[30] /= 1.001f;
    L[0 * M + 2] = 1;
    ck_assert(lam_operator_weights(op, MANY, E, M, L, found, &error) == LAM_ERR_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(error.message, "tile 2 of the sky"));
    L[0 * M + 2] = 0;
    ck_assert(lam_operator_weights(op, MANY, E, M - 1, L, found, &error) == LAM_ERR_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(error.message, "has 4 tiles, that of the store's emitters 5"));
    ck_assert(lam_operator_weights(op, MANY, E, 0, NULL, found, &error) == LAM_ERR_ARGUMENT);
    lam_operator_close(op);

    op = good_operator(p, S);
    ck_assert(lam_operator_weights(op, MANY, E, M, L, found, &error) == LAM_ERR_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(error.message, "(a) shares every place with another one"));
    memset(E, 0, (size_t)C * N * sizeof *E);
    ck_ok(lam_operator_weights(op, 1, E, M, NULL, found, &error)); /* dark */
    lam_operator_close(op);
    lam_sky_close(sky);
    free(direct);
    free(found);
    free(W);
    free(E);
    free(H0);
    free(L);
    free(p);
}
END_TEST

START_TEST(wrong_calls_are_refused) {
    problem *p = make_problem(PLAIN);
    lam_operator *op = good_operator(p, S);
    float W[C * S] = {0}, out[C * N];
    const uint32_t selected[1] = {N};
    const area work = work_area(op, 1);
    ck_assert(lam_operator_apply(op, 1, LAM_RADIOSITY, out, out, work.bytes, work.size, &error) ==
              LAM_ERR_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(error.message, "its own emitters only"));
    ck_assert(lam_operator_apply_adjoint(op, 1, LAM_RADIOSITY, out, out, work.bytes, work.size, &error) ==
              LAM_ERR_ARGUMENT);
    ck_assert(lam_operator_apply_emitters(op, 1, LAM_RADIOSITY, W, 1, selected, out, work.bytes, work.size,
                                          &error) == LAM_ERR_ARGUMENT);
    ck_assert_ptr_nonnull(strstr(error.message, "selected[0] = 61, must be below 61"));
    ck_assert(lam_operator_apply_emitters(op, 1, LAM_RADIOSITY, W, 0, NULL, out, work.bytes, 7, &error) ==
              LAM_ERR_ARGUMENT);
    ck_assert(lam_operator_apply_emitters(op, 1, (lam_quantity)9, W, 0, NULL, out, work.bytes, work.size,
                                          &error) == LAM_ERR_ARGUMENT);
    ck_assert(lam_operator_apply_emitters(op, 1, LAM_RADIOSITY, NULL, 0, NULL, out, work.bytes, work.size,
                                          &error) == LAM_ERR_ARGUMENT);
    ck_assert_str_eq(lam_operator_emitter_name(op, 5), "both");
    free(work.bytes);
    lam_operator_close(op);
    free(p);
}
END_TEST

/* Writes /luminaires as a store has them; `called` are their names. */
static lam_status save_luminaires(const problem *p, store *s, const char *const *called, lam_error *cause) {
    lam_status status = LAM_OK;
    const size_t many = LUMINAIRES, lit[2] = {LUMINAIRES, N};
    const uint32_t group[LUMINAIRES] = {LUMINAIRE_NO_GROUP, LUMINAIRE_NO_GROUP};
    const double ones[LUMINAIRES] = {1, 1}, place[LUMINAIRES * 12] = {0}, opening[LUMINAIRES * 8] = {0};
    TRY(store_write(s, "/luminaires/irradiance", STORE_F32, 2, lit, p->irradiance, cause));
    TRY(store_write_texts(s, "/luminaires/names", LUMINAIRES, called, cause));
    TRY(store_write_texts(s, "/luminaires/group_names", 0, NULL, cause));
    TRY(store_write(s, "/luminaires/group", STORE_U32, 1, &many, group, cause));
    TRY(store_write(s, "/luminaires/dimmers", STORE_F64, 1, &many, ones, cause));
    TRY(store_write(s, "/luminaires/lumens", STORE_F64, 1, &many, ones, cause));
    TRY(store_write(s, "/luminaires/colour", STORE_F64, 2, (size_t[]){LUMINAIRES, 3}, p->colour, cause));
    TRY(store_write(s, "/luminaires/place", STORE_F64, 2, (size_t[]){LUMINAIRES, 12}, place, cause));
    TRY(store_write(s, "/luminaires/opening", STORE_F64, 2, (size_t[]){LUMINAIRES, 8}, opening, cause));
done:
    return status;
}

static lam_status save(const problem *p, const lam_operator *op, lam_error *cause) {
    lam_status status = LAM_OK;
    store *s = NULL;
    const size_t dims[2] = {C, N}, sky[2] = {M, N};
    TRY(store_create(operator_file_path, &s, cause));
    TRY(store_write(s, "/mesh/reflectance", STORE_F32, 2, dims, p->rho, cause));
    TRY(store_write(s, "/sky/first_bounce", STORE_F32, 2, sky, p->first_bounce, cause));
    if (p->luminaires) TRY(save_luminaires(p, s, names + FIRST_LUMINAIRE, cause));
    TRY(operator_save(op, s, cause));
    status = store_seal(s, cause);
    s = NULL;
done:
    store_close(s);
    return status;
}

START_TEST(what_is_saved_comes_back_bit_for_bit) {
    problem *p = make_problem(_i);
    lam_operator *op = good_operator(p, S), *loaded = NULL;
    float *W = random_vectors((size_t)MANY * C * S, 3);
    float *before = test_allocate((size_t)MANY * C * N, sizeof *before),
          *after = test_allocate((size_t)MANY * C * N, sizeof *after);
    ck_ok(save(p, op, &error));
    ck_ok(lam_operator_open(operator_file_path, &loaded, &error));
    const area work = work_area(op, MANY);
    ck_assert_uint_eq(lam_operator_emitters(loaded), S);
    for (size_t k = 0; k < S; k++)
        ck_assert_str_eq(lam_operator_emitter_name(loaded, k), lam_operator_emitter_name(op, k));
    for (int q = 0; q < 3; q++) {
        ck_ok(lam_operator_apply_emitters(op, MANY, quantities[q], W, 0, NULL, before, work.bytes, work.size,
                                          &error));
        ck_ok(lam_operator_apply_emitters(loaded, MANY, quantities[q], W, 0, NULL, after, work.bytes,
                                          work.size, &error));
        ck_assert_mem_eq(before, after, (size_t)MANY * C * N * sizeof *after);
    }
    free(work.bytes);
    free(W);
    free(before);
    free(after);
    lam_operator_close(loaded);
    lam_operator_close(op);
    free(p);
}
END_TEST

/* A store's luminaires and those of its operator are the same, in the same order. */
START_TEST(luminaires_of_a_store_are_its_emitters) {
    static const char *const turned[LUMINAIRES] = {"all", "both"};
    problem *p = make_problem(LIT), *plain = make_problem(PLAIN);
    lam_operator *op = good_operator(p, S), *made = NULL;
    store *s = NULL;
    for (int what = 0; what < 2; what++) {
        ck_ok(save(what == 0 ? plain : p, op, &error));
        if (what == 1) {
            const size_t dims[2] = {C, N}, sky[2] = {M, N};
            ck_ok(store_create(operator_file_path, &s, &error));
            ck_ok(store_write(s, "/mesh/reflectance", STORE_F32, 2, dims, p->rho, &error));
            ck_ok(store_write(s, "/sky/first_bounce", STORE_F32, 2, sky, p->first_bounce, &error));
            ck_ok(save_luminaires(p, s, turned, &error));
            ck_ok(operator_save(op, s, &error));
            ck_ok(store_seal(s, &error));
        }
        ck_assert(lam_operator_open(operator_file_path, &made, &error) == LAM_ERR_FORMAT);
        ck_assert_ptr_null(made);
        ck_assert_msg(strstr(error.message, what == 0 ? "counts 2 luminaires among 7 emitters"
                                                      : "emitter 5 is both, and luminaire 0 is all") != NULL,
                      "%s", error.message);
    }
    lam_operator_close(op);
    free(plain);
    free(p);
}
END_TEST

START_TEST(memory_that_fails_is_not_lost) {
    problem *p = make_problem(_i);
    lam_operator *op = good_operator(p, S);
    int failures[3] = {0};
    ck_ok(save(p, op, &error));
    for (int what = 0; what < 3; what++)
        for (long k = 0;; k++) {
            lam_operator *made = NULL;
            allocations_left = k;
            const lam_status status = what == 0   ? save(p, op, &error)
                                      : what == 1 ? lam_operator_open(operator_file_path, &made, &error)
                                                  : make_operator(p, S, &made, &error);
            allocations_left = -1;
            lam_operator_close(made);
            if (status == LAM_OK) break;
            ck_assert_msg(status == LAM_ERR_MEMORY && made == NULL, "allocation %ld: %s", k, error.message);
            failures[what]++;
        }
    for (int what = 0; what < 3; what++) ck_assert_int_gt(failures[what], 1);
    lam_operator_close(op);
    free(p);
}
END_TEST

/* Light from outside the mesh comes out as direct light, in single precision and in double. No emission shows
 * the weight of emitters outside, nor that of luminaires, whose dimmers stand beside it. */
START_TEST(light_from_outside_is_direct) {
    problem *p = make_problem(_i);
    lam_operator *op = good_operator(p, S);
    float *W = random_vectors((size_t)C * S, 3), E[C * N], H0[C * N], L[C * M] = {0};
    double E2[C * N], H2[C * N];
    ck_ok(operator_emitters_light(op, 1, W, E, H0, &error));
    ck_ok(operator_emitters_light_double(op, 1, W, E2, H2, &error));
    for (size_t c = 0; c < C; c++)
        for (size_t i = 0; i < N; i++) {
            double sum = 0;
            for (size_t k = 0; k < S; k++) sum += (double)W[c * S + k] * direct_light(p, c, k, i);
            ck_assert_double_eq_tol((double)H0[c * N + i], sum, 1e-5 * fabs(sum) + 1e-6);
            ck_assert_double_eq_tol(H2[c * N + i], sum, 1e-12 * fabs(sum) + 1e-12);
            ck_assert_double_eq_tol((double)E[c * N + i], E2[c * N + i], 1e-5 * fabs(E2[c * N + i]) + 1e-6);
        }
    if (p->luminaires) {
        float D[C * LUMINAIRES], found[C * S];
        for (size_t k = 0; k < (size_t)C * S; k++) {
            const size_t c = k / S, j = k % S;
            for (size_t t = 0; t < M; t++) L[c * M + t] += W[k] * p->L[k * M + t];
            if (j >= FIRST_LUMINAIRE) D[c * LUMINAIRES + j - FIRST_LUMINAIRE] = W[k];
        }
        ck_ok(lam_operator_weights(op, 1, E, M, L, found, &error));
        for (size_t k = 0; k < (size_t)C * S; k++)
            if (k % S >= FIRST_LUMINAIRE) ck_assert_double_eq((double)found[k], 0);
        operator_emitters_dim(op, 1, D, found);
        for (size_t k = 0; k < (size_t)C * S; k++)
            ck_assert_double_le(fabs((double)found[k] - (double)W[k]), 1e-5 * fabs((double)W[k]));
    } else {
        ck_assert(lam_operator_weights(op, 1, E, M, L, W, &error) == LAM_ERR_ARGUMENT);
        ck_assert_ptr_nonnull(strstr(error.message, "no part of its mesh"));
    }
    free(W);
    lam_operator_close(op);
    free(p);
}
END_TEST

/* Files that hold no operator of this kind. */
START_TEST(what_does_not_fit_is_refused) {
    problem *p = make_problem(PLAIN);
    for (int what = 0; what < 8; what++) {
        static const char *const wanted[] = {"the value -1",
                                             "the value 0",
                                             "element 61",
                                             "/operator/L[3] = ",
                                             "is of 5 tiles",
                                             "names is empty",
                                             "/operator/direct[7] = nan",
                                             "/operator/exitance[1] = -2"};
        emitter_arrays a = {.s = what == 5 ? 0 : 1, .n_tiles = M};
        lam_operator *op = NULL;
        a.T = test_allocate((size_t)C * N, sizeof *a.T);
        a.ends = test_allocate(C + 1, sizeof *a.ends);
        a.elements = test_allocate(C, sizeof *a.elements);
        a.values = test_allocate(C, sizeof *a.values);
        a.L = test_allocate(C * M, sizeof *a.L);
        for (size_t c = 0; c < C; c++) {
            a.ends[c + 1] = c + 1;
            a.elements[c] = what == 2 ? N : 4;
            a.values[c] = what == 0 ? -1 : what == 1 ? 0 : 1;
        }
        if (what == 3) a.L[3] = -1;
        if (what > 5) {
            a.direct = test_allocate(N, sizeof *a.direct);
            a.exitance = test_allocate(C, sizeof *a.exitance);
            if (what == 6) a.direct[7] = NAN;
            if (what == 7) a.exitance[1] = -2;
        }
        if (what != 4) ck_ok(sky_create(M, N, p->first_bounce, &a.sky, &error));
        ck_assert(operator_emitters_create(N, C, p->rho, &a, &op, &error) != LAM_OK);
        ck_assert_msg(strstr(error.message, wanted[what]) != NULL, "%s", error.message);
        ck_assert_ptr_null(op);
        emitter_arrays_free(&a);
    }
    free(p);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("emitters");
    TCase *cases = tcase_create("emitters");
    tcase_add_checked_fixture(cases, setup, operator_file_teardown);
    tcase_add_loop_test(cases, answers_are_sums, 0, VARIANTS);
    tcase_add_loop_test(cases, adjoint_is_the_transpose, 0, VARIANTS);
    tcase_add_test(cases, weights_follow_from_light);
    tcase_add_test(cases, wrong_calls_are_refused);
    tcase_add_loop_test(cases, what_is_saved_comes_back_bit_for_bit, 0, VARIANTS);
    tcase_add_loop_test(cases, light_from_outside_is_direct, OUTSIDE, VARIANTS);
    tcase_add_test(cases, luminaires_of_a_store_are_its_emitters);
    tcase_add_loop_test(cases, memory_that_fails_is_not_lost, OUTSIDE, VARIANTS);
    tcase_add_test(cases, what_does_not_fit_is_refused);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
