/* Sums of the light of luminaires against the same over elements, and the bound where there are too many
 * pairs. */
#include "server/scene/luminaire_sums.h"
#include "server/scene/scene.h"
#include "solver/base/random.h"
#include "solver/operator/luminaire_light.h"
#include "store/store.h"
#include "support/suite.h"

#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { N = 40, C = 3, G = 2, MANY = 1200 /* of which C MANY^2 pairs are too many */ };

static double area[N];
static float reflectance[C * N];

static void write_numbers(store *s, const char *name, size_t k, size_t width, uint64_t *seed) {
    lam_error error = {0};
    char path[64];
    double *x = calloc(k * width, sizeof *x);
    ck_assert_ptr_nonnull(x);
    for (size_t i = 0; i < k * width; i++) x[i] = width == 8 ? 0 : random_lcg_unit(seed);
    snprintf(path, sizeof path, "/luminaires/%s", name);
    ck_assert_int_eq(store_write(s, path, STORE_F64, width == 1 ? 1 : 2, (size_t[]){k, width}, x, &error),
                     LAM_OK);
    free(x);
}

/* k luminaires of random light. */
static lam_luminaires *make_luminaires(size_t k) {
    uint64_t seed = 5;
    char path[64], *texts = calloc(k, 12);
    const char **names = calloc(k, sizeof *names);
    lam_error error = {0};
    lam_luminaires *l = NULL;
    store *s = NULL;
    float *h = calloc(k * N, sizeof *h);
    ck_assert(texts != NULL && names != NULL && h != NULL);
    for (size_t j = 0; j < k; j++) {
        names[j] = texts + 12 * j;
        snprintf(texts + 12 * j, 12, "l%zu", j);
    }
    for (size_t i = 0; i < k * N; i++) h[i] = (float)random_lcg_unit(&seed);
    snprintf(path, sizeof path, "/tmp/lambert-luminaire-sums-%d.h5", (int)getpid());
    ck_assert_int_eq(store_create(path, &s, &error), LAM_OK);
    ck_assert_int_eq(store_write(s, "/mesh/reflectance", STORE_F32, 2, (size_t[]){C, N}, reflectance, &error),
                     LAM_OK);
    ck_assert_int_eq(store_write(s, "/luminaires/irradiance", STORE_F32, 2, (size_t[]){k, N}, h, &error),
                     LAM_OK);
    ck_assert_int_eq(store_write_texts(s, "/luminaires/names", k, names, &error), LAM_OK);
    write_numbers(s, "dimmers", k, 1, &seed);
    write_numbers(s, "lumens", k, 1, &seed);
    write_numbers(s, "colour", k, 3, &seed);
    write_numbers(s, "place", k, 12, &seed);
    write_numbers(s, "opening", k, 8, &seed);
    ck_assert_int_eq(store_seal(s, &error), LAM_OK);
    ck_assert_msg(lam_luminaires_open(path, &l, &error) == LAM_OK, "%s", error.message);
    unlink(path);
    free(h);
    free(names);
    free(texts);
    return l;
}

typedef struct fixture {
    scene s;
    memory_ledger ledger;
} fixture;

static void setup(fixture *f, size_t k) {
    uint64_t seed = 3;
    uint32_t group[N];
    char **names = calloc(1, G * (sizeof *names + 4));
    ck_assert_ptr_nonnull(names);
    memset(f, 0, sizeof *f);
    for (size_t i = 0; i < N; i++) {
        area[i] = .5 + random_lcg_unit(&seed);
        group[i] = i % 3 == 0;
    }
    for (size_t i = 0; i < C * N; i++) reflectance[i] = (float)random_lcg_unit(&seed);
    for (size_t g = 0; g < G; g++) {
        names[g] = (char *)(names + G) + 4 * g;
        sprintf(names[g], "g%zu", g);
    }
    ck_assert_int_eq(group_index_make(N, 0, group, G, names, &f->s.groups, NULL), LAM_OK);
    f->s.n = N;
    f->s.n_channels = C;
    f->s.reflectance = reflectance;
    f->s.area = area;
    f->s.luminaires = make_luminaires(k);
    f->s.ledger = &f->ledger;
    atomic_init(&f->ledger.room, SIZE_MAX);
    ck_assert_int_eq(row_cache_create(1 << 20, &f->ledger, &f->s.rows, NULL), LAM_OK);
}

static void teardown(fixture *f) {
    row_cache_destroy(f->s.rows);
    ck_assert_uint_eq(atomic_load(&f->ledger.taken), 0);
    lam_luminaires_close(f->s.luminaires);
    group_index_free(&f->s.groups);
}

/* The power and squares of what elements send on by dimmers [C][k], of channel c. */
static void plain_size(const lam_luminaires *l, size_t c, const float *D, double *power, double *squares) {
    float H0[C * N] = {0};
    lam_luminaires_irradiance(l, 1, D, H0);
    *power = *squares = 0;
    for (size_t i = 0; i < N; i++) {
        const double flux = area[i] * (double)reflectance[c * N + i] * (double)H0[c * N + i];
        *power += flux;
        *squares += flux * flux;
    }
}

START_TEST(sizes_are_those_of_the_light) {
    enum { K = 4 };
    static const float D[C * K] = {1, 0, 2, .5f, 0, 4, 0, 0, 3, 1, .25f, 1};
    fixture f;
    const luminaire_sums *sums = NULL, *again = NULL;
    setup(&f, K);
    ck_assert(!scene_has_luminaire_sums(&f.s));
    ck_assert(scene_luminaire_sums(&f.s, &sums) && sums != NULL && sums->whole);
    ck_assert(scene_has_luminaire_sums(&f.s));
    ck_assert(scene_luminaire_sums(&f.s, &again) && again == sums);
    ck_assert_uint_eq(row_cache_held(f.s.rows), sums->bytes);
    for (size_t c = 0; c < C; c++) {
        double power = 0, squares = 0, wanted, wanted_squares;
        luminaire_sums_size(sums, c, D + c * K, &power, &squares);
        plain_size(f.s.luminaires, c, D, &wanted, &wanted_squares);
        /* H0 is rounded to single precision, 2^-24 of it. */
        ck_assert_double_eq_tol(power, wanted, 1e-6 * wanted);
        ck_assert_double_eq_tol(squares, wanted_squares, 1e-6 * wanted_squares);
    }
    const float *h = luminaires_irradiance(f.s.luminaires);
    for (size_t j = 0; j < K; j++) {
        double sum = 0, all = 0;
        for (size_t i = 0; i < N; i += 3) {
            sum += area[i] * (double)h[j * N + i];
            all += area[i];
        }
        ck_assert_double_eq_tol(sums->first[1 * K + j], sum / all, 1e-12);
    }
    teardown(&f);
}
END_TEST

/* Without pairs the squares of one luminaire are right, and those of several at most as large as stated. */
START_TEST(too_many_pairs_are_bounded) {
    fixture f;
    const luminaire_sums *sums = NULL;
    float *D = calloc(C * MANY, sizeof *D);
    ck_assert_ptr_nonnull(D);
    setup(&f, MANY);
    ck_assert(scene_luminaire_sums(&f.s, &sums) && sums != NULL && !sums->whole);
    for (size_t lit = 0; lit < 3; lit++) {
        double power = 0, squares = 0, wanted, wanted_squares;
        for (size_t c = 0; c < C; c++) D[c * MANY + lit * 500] = 1.5f;
        luminaire_sums_size(sums, 1, D + MANY, &power, &squares);
        plain_size(f.s.luminaires, 1, D, &wanted, &wanted_squares);
        ck_assert_double_eq_tol(power, wanted, 1e-6 * wanted);
        ck_assert_double_ge(squares, (1 - 1e-6) * wanted_squares);
        if (lit == 0) ck_assert_double_eq_tol(squares, wanted_squares, 1e-6 * wanted_squares);
    }
    free(D);
    teardown(&f);
}
END_TEST

START_TEST(a_full_ledger_leaves_them_out) {
    fixture f;
    const luminaire_sums *sums = NULL;
    setup(&f, 2);
    atomic_store(&f.ledger.room, 8);
    ck_assert(scene_luminaire_sums(&f.s, &sums));
    ck_assert_ptr_null(sums);
    ck_assert(!scene_has_luminaire_sums(&f.s));
    teardown(&f);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("luminaire_sums");
    TCase *cases = tcase_create("luminaire_sums");
    tcase_add_test(cases, sizes_are_those_of_the_light);
    tcase_add_test(cases, too_many_pairs_are_bounded);
    tcase_add_test(cases, a_full_ledger_leaves_them_out);
    suite_add_tcase(suite, cases);
    return suite_run(suite);
}
