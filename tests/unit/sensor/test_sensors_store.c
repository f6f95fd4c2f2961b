/* Sensors in a store, and the library that gathers light at them: values are sums, the adjoint is the
 * transpose, and wrong values are refused. */
#include "solver/base/random.h"
#include "solver/operator/sensor_light.h"
#include "solver/sensor/sensors_store.h"
#include "support/box.h"
#include "support/dense.h"
#include "support/suite.h"

#include <unistd.h>

enum { N = 50, S = 27, SETS = 4, NNZ = 120, M = 5, K = 3, C = 3, RHS = 2, ROWS = RHS * C, EYES = 2 };

/* Sensors with made-up rows. */
typedef struct sample {
    sensor_set sets[SETS];
    receiver receivers[S];
    uint32_t cell[S], element[NNZ];
    uint64_t start[S + 1];
    float weight[NNZ], off[NNZ], sky[M * S], sky_off[M * S], backs[S], H[K * S];
    bool inside[S];
    double colour[K * 3];
    uint32_t eyes[EYES];
    glare_source seen[K * EYES];
} sample;

static float unit(uint64_t *seed) {
    return (float)random_unit(seed);
}

/* Harmonics of a probe but the first, whose numbers have either sign. */
static bool is_signed(size_t k) {
    return k > 9 && (k - 9) % 9 > 0;
}

static float number(size_t k, uint64_t *seed) {
    return unit(seed) - (is_signed(k) ? .5f : 0);
}

static void fill(sample *a) {
    uint64_t seed = 1;
    *a = (sample){.sets = {{.name = "desk", .count = 2},
                           {.name = "room",
                            .kind = SENSOR_GRIDS,
                            .first = 2,
                            .count = 4,
                            .rows = 2,
                            .columns = 3,
                            .spacing = {.5, .6}},
                           {.name = "faces", .kind = SENSOR_SEMICYLINDERS, .first = 6, .count = 3},
                           {.name = "game", .kind = SENSOR_PROBES, .first = 9, .count = 18}}};
    for (size_t k = 0; k < S; k++) {
        a->receivers[k] = (receiver){.kind = k < 6 ? RECEIVER_PLANE : RECEIVER_SEMICYLINDER,
                                     .at = {(double)k, .1, .2},
                                     .axis = {0, 0, 1}};
        if (k >= 6) a->receivers[k].look[1] = 1;
        if (k >= 9) a->receivers[k].kind = (receiver_kind)(RECEIVER_HARMONIC + k % 9);
        a->cell[k] = k >= 2 && k < 6 ? (uint32_t)k : SENSOR_NO_CELL;
        a->start[k + 1] = k == 3 ? a->start[k] : NNZ * (k + 1) / S; /* an empty row, and others */
        a->backs[k] = k == 5 ? .75f : 0;
        a->inside[k] = k == 7;
    }
    for (size_t k = 0, row = 0; k < NNZ; k++) {
        while (k >= a->start[row + 1]) row++;
        a->element[k] = (uint32_t)(k % N);
        a->weight[k] = number(row, &seed);
        a->off[k] = unit(&seed) - .5f;
    }
    for (size_t k = 0; k < M * S; k++) {
        a->sky[k] = number(k % S, &seed);
        a->sky_off[k] = unit(&seed) - .5f;
    }
    for (size_t k = 0; k < K * S; k++) a->H[k] = number(k % S, &seed);
    for (size_t k = 0; k < K * 3; k++) a->colour[k] = random_unit(&seed);
    for (size_t k = 0; k < K * EYES; k++) {
        glare_source *one = &a->seen[k];
        *one = (glare_source){
            .intensity = 100. * (double)k, .area = .5, .distance = 3, .position = 2, .seen = 1};
        one->seen /= 1 << k;
    }
    a->eyes[0] = 1, a->eyes[1] = 4;
}

static void save(sample *a, bool lit, char path[64]) {
    lam_error error = {0};
    store *s = NULL;
    float *reflectance = test_allocate(C * N, sizeof *reflectance);
    const sensor_list l = {
        .n_sets = SETS, .n = S, .sets = a->sets, .receivers = a->receivers, .cell = a->cell};
    const sensor_rows rows = {.n = N,
                              .n_receivers = S,
                              .n_tiles = lit ? M : 0,
                              .start = a->start,
                              .element = a->element,
                              .weight = a->weight,
                              .off = a->off,
                              .sky = a->sky,
                              .sky_off = a->sky_off,
                              .backs = a->backs};
    const sensors_lit light = {
        .n_luminaires = K, .H = a->H, .inside = a->inside, .n_eyes = EYES, .eyes = a->eyes, .seen = a->seen};
    snprintf(path, 64, "/tmp/lambert-sensors-%d.h5", (int)getpid());
    ck_ok(store_create(path, &s, &error));
    ck_ok(store_write(s, "/mesh/reflectance", STORE_F32, 2, (size_t[]){C, N}, reflectance, &error));
    ck_ok(store_write(s, "/luminaires/colour", STORE_F64, 2, (size_t[]){K, 3}, a->colour, &error));
    ck_ok(sensors_save(&l, &rows, lit ? &light : NULL, s, &error));
    ck_ok(store_seal(s, &error));
    free(reflectance);
}

static float *random_values(size_t n, uint64_t seed) {
    float *x = test_allocate(n, sizeof *x);
    for (size_t i = 0; i < n; i++) x[i] = unit(&seed);
    return x;
}

/* Sums in double against those of single precision: up to 8 terms below 1, and three roundings. */
START_TEST(values_and_their_transpose) {
    char path[64];
    lam_error error = {0};
    lam_sensors *l = NULL;
    sample *a = test_allocate(1, sizeof *a);
    float *B = random_values(ROWS * N, 2), *L = random_values(ROWS * M, 3), *D = random_values(ROWS * K, 4);
    float *g = random_values(ROWS * S, 5), *out = test_allocate(ROWS * S, sizeof *out),
          *one = test_allocate(C * S, sizeof *one);
    float *gB = random_values(ROWS * N, 6), *gL = random_values(ROWS * M, 7),
          *gD = random_values(ROWS * K, 8), *V = test_allocate(ROWS * S, sizeof *V);
    double *B2 = test_allocate(ROWS * N, sizeof *B2), *out2 = test_allocate(ROWS * S, sizeof *out2), left = 0,
           right = 0;
    fill(a);
    save(a, true, path);
    ck_ok(lam_sensors_open(path, &l, &error));
    ck_assert_uint_eq(lam_sensors_count(l), S);
    ck_assert_uint_eq(lam_sensors_channels(l), C);
    ck_assert_uint_eq(lam_sensors_elements(l), N);
    ck_assert_uint_eq(lam_sensors_tiles(l), M);
    ck_assert_uint_eq(lam_sensors_luminaires(l), K);
    lam_sensors_gather(l, RHS, B, L, D, out);
    lam_sensors_variance(l, RHS, B, L, V);
    lam_sensors_adjoint(l, RHS, g, gB, gL, gD);
    for (size_t i = 0; i < ROWS * N; i++) B2[i] = (double)B[i];
    sensors_gather_double(l, RHS, B2, NULL, NULL, out2);
    for (size_t q = 0; q < ROWS; q++)
        for (size_t k = 0; k < S; k++) {
            double sum = 0, off = 0;
            for (uint64_t i = a->start[k]; i < a->start[k + 1]; i++) {
                sum += (double)a->weight[i] * (double)B[q * N + a->element[i]];
                off += (double)a->off[i] * (double)B[q * N + a->element[i]];
            }
            ck_assert_double_eq_tol(out2[q * S + k], sum, 1e-12);
            for (size_t t = 0; t < M; t++) {
                sum += (double)a->sky[t * S + k] * (double)L[q * M + t];
                off += (double)a->sky_off[t * S + k] * (double)L[q * M + t];
            }
            for (size_t j = 0; j < K; j++)
                sum += a->colour[j * 3 + q % C] * (double)a->H[j * S + k] * (double)D[q * K + j];
            ck_assert_double_eq_tol((double)out[q * S + k], sum, 3e-6);
            ck_assert_double_eq_tol((double)V[q * S + k], off * off, 3e-6);
            left += sum * (double)g[q * S + k];
        }
    for (size_t i = 0; i < ROWS * N; i++) right += (double)gB[i] * (double)B[i];
    for (size_t i = 0; i < ROWS * M; i++) right += (double)gL[i] * (double)L[i];
    for (size_t i = 0; i < ROWS * K; i++) right += (double)gD[i] * (double)D[i];
    ck_assert_double_eq_tol(left, right, 1e-6 * left);
    /* A vector alone has the same bits; without sky and luminaires only the rows are left. */
    lam_sensors_gather(l, 1, B + C * N, L + C * M, D + C * K, one);
    ck_assert_mem_eq(one, out + C * S, C * S * sizeof *one);
    lam_sensors_gather(l, 1, B, NULL, NULL, one);
    for (size_t i = 0; i < C * S; i++) ck_assert_double_eq_tol((double)one[i], out2[i], 1e-6 * (1 + out2[i]));
    lam_sensors_close(l);
    unlink(path);
    float *const floats[] = {B, L, D, g, out, one, gB, gL, gD, V};
    for (size_t k = 0; k < sizeof floats / sizeof *floats; k++) free(floats[k]);
    free(B2);
    free(out2);
    free(a);
}
END_TEST

/* The direct part is what luminaires add, to three roundings of sums below 10. */
START_TEST(light_and_sight_of_luminaires) {
    char path[64];
    lam_error error = {0};
    lam_sensors *l = NULL;
    sample *a = test_allocate(1, sizeof *a);
    float *B = random_values(ROWS * N, 2), *D = random_values(ROWS * K, 4);
    float *with = test_allocate(ROWS * S, sizeof *with), *without = test_allocate(ROWS * S, sizeof *without);
    const float *seen;
    double dimmer[K];
    fill(a);
    save(a, true, path);
    ck_ok(lam_sensors_open(path, &l, &error));
    lam_sensors_gather(l, RHS, B, NULL, D, with);
    lam_sensors_gather(l, RHS, B, NULL, NULL, without);
    const sensor_eyes eyes = sensors_eyes(l);
    for (size_t i = 0; i < ROWS * S; i++) {
        for (size_t k = 0; k < K; k++) dimmer[k] = (double)D[i / S * K + k] * eyes.colours[i / S % C * K + k];
        ck_assert_double_eq_tol((double)with[i], (double)without[i] + sensors_direct(l, dimmer, i % S), 3e-6);
    }
    ck_assert_double_gt(sensors_direct(l, dimmer, 0), 0);
    ck_assert_uint_eq(eyes.n, EYES);
    ck_assert_uint_eq(eyes.eyes[1], 4);
    for (size_t k = 0; k < K * EYES; k++) {
        const float *x = eyes.seen + k * SENSOR_SEEN;
        const double numbers[SENSOR_SEEN] = {a->seen[k].intensity, a->seen[k].area, a->seen[k].distance,
                                             a->seen[k].position, a->seen[k].seen};
        for (int d = 0; d < SENSOR_SEEN; d++) ck_assert_double_eq((double)x[d], numbers[d]);
    }
    for (size_t k = 0, eye = 0; k < S; k++) {
        const bool is_eye = eye < EYES && eyes.eyes[eye] == k;
        seen = is_eye ? eyes.seen + eye++ * SENSOR_SEEN : NULL;
        ck_assert_ptr_eq(sensors_seen(l, k), seen);
    }
    ck_assert_double_eq(eyes.colours[K + 2], a->colour[2 * 3 + 1]);
    lam_sensors_close(l);
    save(a, false, path);
    ck_ok(lam_sensors_open(path, &l, &error));
    ck_assert_uint_eq(sensors_eyes(l).n, 0);
    ck_assert_ptr_null(sensors_seen(l, 4));
    lam_sensors_close(l);
    unlink(path);
    float *const floats[] = {B, D, with, without};
    for (size_t k = 0; k < sizeof floats / sizeof *floats; k++) free(floats[k]);
    free(a);
}
END_TEST

START_TEST(sets_and_receivers) {
    char path[64];
    lam_error error = {0};
    lam_sensors *l = NULL;
    store *s = NULL;
    sensor_list list;
    size_t first, count;
    sample *a = test_allocate(1, sizeof *a);
    fill(a);
    save(a, true, path);
    ck_ok(lam_sensors_open(path, &l, &error));
    ck_assert_uint_eq(lam_sensors_sets(l), SETS);
    ck_assert_str_eq(lam_sensors_set(l, 1, &first, &count), "room");
    ck_assert_uint_eq(first, 2);
    ck_assert_uint_eq(count, 4);
    for (size_t k = 0; k < S; k++) ck_assert_int_eq(lam_sensors_has_value(l, k) != 0, k != 5 && k != 7);
    ck_assert_uint_eq(sensors_shown(l, 5).flags, SENSOR_IN_WALL);
    ck_assert_uint_eq(sensors_shown(l, 7).flags, SENSOR_IN_LUMINAIRE);
    ck_assert_uint_eq(sensors_set_shown(l, 1).columns, 3);
    for (size_t k = 0; k < S; k++) ck_assert(sensors_is_signed(l, k) == is_signed(k));
    lam_sensors_close(l);
    ck_ok(store_open(path, &s, &error));
    ck_ok(sensors_load_list(s, &list, &error));
    ck_assert_uint_eq(list.n, S);
    ck_assert_mem_eq(list.receivers, a->receivers, sizeof a->receivers);
    ck_assert_mem_eq(list.cell, a->cell, sizeof a->cell);
    for (size_t k = 0; k < SETS; k++) {
        ck_assert_str_eq(list.sets[k].name, a->sets[k].name);
        ck_assert_int_eq(list.sets[k].kind, a->sets[k].kind);
        ck_assert_uint_eq(list.sets[k].first, a->sets[k].first);
        ck_assert_uint_eq(list.sets[k].count, a->sets[k].count);
        ck_assert_uint_eq(list.sets[k].rows, a->sets[k].rows);
        ck_assert_double_eq(list.sets[k].spacing[1], a->sets[k].spacing[1]);
    }
    sensors_free(&list);
    store_close(s);
    save(a, false, path);
    ck_ok(lam_sensors_open(path, &l, &error));
    ck_assert_uint_eq(lam_sensors_tiles(l), 0);
    ck_assert_uint_eq(lam_sensors_luminaires(l), 0);
    lam_sensors_close(l);
    unlink(path);
    free(a);
}
END_TEST

static void refused(sample *a, const char *says) {
    char path[64];
    lam_error error = {.message = ""};
    lam_sensors *l = (lam_sensors *)a;
    save(a, true, path);
    ck_assert_int_eq(lam_sensors_open(path, &l, &error), LAM_ERR_FORMAT);
    ck_assert_msg(strstr(error.message, says) != NULL, "%s", error.message);
    ck_assert_ptr_eq(l, a);
    unlink(path);
    fill(a);
}

START_TEST(wrong_values) {
    sample *a = test_allocate(1, sizeof *a);
    fill(a);
    a->weight[3] = -1e-3f;
    refused(a, "/sensors/weights[3] = -0.001, must be at least 0");
    a->off[4] = NAN;
    refused(a, "/sensors/weights_off[4] = nan, must be a number");
    a->element[5] = N;
    refused(a, "/sensors/indices[5] = 50, must be below 50");
    a->start[2] = a->start[1] - 1;
    refused(a, "/sensors/indptr[2] = 3, must rise from 0 to 120");
    a->sky[7] = -1;
    refused(a, "/sensors/sky[0][7] = -1, must be at least 0");
    a->receivers[2].kind = (receiver_kind)9;
    refused(a, "/sensors/receiver[2] = 9, must be below 4");
    a->receivers[2].at[1] = INFINITY;
    refused(a, "/sensors/place[2][1] is no number");
    a->sets[0].kind = (sensor_set_kind)12;
    refused(a, "/sensors/kind[0] = 12, must be below 8");
    a->receivers[12].kind = RECEIVER_HARMONIC;
    refused(a, "/sensors/receiver[12] = 4, must be 7");
    a->sets[3].kind = SENSOR_CUBES;
    refused(a, "/sensors/receiver[9] = 4, must be below 4");
    a->sets[2].count = 4;
    refused(a, "/sensors/receiver[9] = 4, must be below 4");
    a->sets[2].count = 2;
    a->sets[2].kind = SENSOR_PROBES;
    refused(a, "/sensors/kind[2] is of probes, of 2 receivers, must be of a multiple of 9");
    a->weight[a->start[9]] = -1;
    refused(a, "must be at least 0");
    a->sets[0].count = 50;
    refused(a, "/sensors/first[1] = 50, must rise from 0 to 27");
    a->sets[1].spacing[0] = -1;
    refused(a, "/sensors/spacing[2] = -1, must be at least 0");
    a->eyes[1] = S;
    refused(a, "/sensors/eyes[1] = 27, must be below 27");
    a->eyes[1] = a->eyes[0];
    refused(a, "/sensors/eyes[1] = 1, must be above 1");
    a->seen[3].area = -1;
    refused(a, "/sensors/seen[16] = -1, must be at least 0");
    a->seen[3].position = .5;
    refused(a, "/sensors/seen[1][1] has a position of 0.5, must be 0 or at least 1");
    a->seen[2].seen = 1.5;
    refused(a, "/sensors/seen[1][0] has a position of 2, must be 0 or at least 1, and passes 1.5, must be at "
               "most 1");
    free(a);
}
END_TEST

START_TEST(stores_without_sensors) {
    char path[64];
    lam_error error = {0};
    lam_sensors *l = (lam_sensors *)&error;
    store *s = NULL;
    sensor_list list = {.n = 5};
    float *reflectance = test_allocate(C * N, sizeof *reflectance);
    snprintf(path, sizeof path, "/tmp/lambert-sensors-%d.h5", (int)getpid());
    ck_ok(store_create(path, &s, &error));
    ck_ok(store_write(s, "/mesh/reflectance", STORE_F32, 2, (size_t[]){C, N}, reflectance, &error));
    ck_ok(store_seal(s, &error));
    ck_ok(lam_sensors_open(path, &l, &error));
    ck_assert_ptr_null(l);
    ck_ok(store_open(path, &s, &error));
    ck_ok(sensors_load_list(s, &list, &error));
    ck_assert_uint_eq(list.n, 0);
    store_close(s);
    unlink(path);
    free(reflectance);
    ck_assert_int_eq(lam_sensors_open(NULL, &l, &error), LAM_ERR_ARGUMENT);
}
END_TEST

int main(void) {
    Suite *s = suite_create("sensors in a store");
    TCase *c = tcase_create("all");
    tcase_add_test(c, values_and_their_transpose);
    tcase_add_test(c, light_and_sight_of_luminaires);
    tcase_add_test(c, sets_and_receivers);
    tcase_add_test(c, wrong_values);
    tcase_add_test(c, stores_without_sensors);
    suite_add_tcase(s, c);
    return suite_run(s);
}
