/* Rows of means: what they answer against the matrix written out, that they are kept, shared, and go when
 * they are too many, though not from under who uses them. */
#include "server/scene/adjoint_rows.h"
#include "server/scene/scene.h"
#include "solver/operator/operator.h"
#include "support/failing_memory.h"
#include "support/suite.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

enum { N = 6, C = 2, N_GROUPS = 5 };

/* Elements 0 and 3 are g0, 1 g1, 2 and 5 g2, 4 g3; g4 is empty. Element 1 is black in both channels. */
static const uint32_t group_of[N] = {0, 1, 2, 0, 3, 2};
static const double area[N] = {1, 2, .5, 3, 1, 4};
static const float reflectance[C * N] = {.5f, 0, .3f, .7f, .6f, .2f, .1f, 0, .4f, .5f, .8f, .3f};

typedef struct fixture {
    scene s;
    float P[C][N][N]; /* M - I; where rho is 0 as if it were 1 */
    batch_workspace workspace;
    memory_ledger ledger; /* shared with whatever else is served */
} fixture;

/* As row_bytes says. */
static const size_t row_size = sizeof(adjoint_row) + C * (N_GROUPS * sizeof(double) + N * sizeof(float));

static void setup(fixture *f, size_t rows) {
    memset(f, 0, sizeof *f);
    char **names = calloc(1, N_GROUPS * (sizeof *names + 8));
    uint32_t *group = malloc(sizeof group_of);
    float *P = malloc(sizeof f->P);
    ck_assert(names != NULL && group != NULL && P != NULL);
    for (size_t g = 0; g < N_GROUPS; g++) {
        names[g] = (char *)(names + N_GROUPS) + 8 * g;
        sprintf(names[g], "g%zu", g);
    }
    memcpy(group, group_of, sizeof group_of);
    ck_assert_int_eq(group_index_make(N, 0, group, N_GROUPS, names, &f->s.groups, NULL), LAM_OK);
    free(group);
    /* Exact in single precision, also as 1 + P. */
    for (size_t k = 0; k < C * N * N; k++) (&f->P[0][0][0])[k] = (float)((k * 7 + 3) % 13) / 16;
    memcpy(P, f->P, sizeof f->P);
    ck_assert_int_eq(operator_exact_create(N, C, reflectance, P, &f->s.op, NULL), LAM_OK);
    f->s.n = N;
    f->s.n_channels = C;
    f->s.reflectance = reflectance;
    f->s.area = area;
    atomic_init(&f->ledger.room, SIZE_MAX);
    ck_assert_int_eq(row_cache_create(rows * row_size, &f->ledger, &f->s.rows, NULL), LAM_OK);
    ck_assert_uint_eq(adjoint_rows_capacity(&f->s), rows);
}

static void teardown(fixture *f) {
    row_cache_destroy(f->s.rows);
    ck_assert_uint_eq(atomic_load(&f->ledger.taken), 0);
    lam_operator_close(f->s.op);
    group_index_free(&f->s.groups);
    free(f->workspace.bytes);
}

/* A request for the mean of one group; element 1 shines, and group g2, in the second of two vectors. */
static radiosity_request make_request(const fixture *f, size_t g, lam_quantity quantity) {
    radiosity_request request = {.n_rhs = 2, .quantity = quantity};
    const codec_scene about = {
        .n = N, .n_channels = C, .groups = &f->s.groups, .max_batch = 4, .max_bytes = 4096};
    char name[8];
    const uint32_t *found = NULL;
    problem why = {0};
    sprintf(name, "g%zu", g);
    ck_assert_uint_eq(group_index_find(&f->s.groups, name, 2, &found), 1);
    ck_assert(reduce_request_add(&request.reduce, name, 2, found, 1, &why));
    ck_assert(radiosity_request_spot(&request, &about, 1, false, (float[]){3, 5}, &why));
    ck_assert(radiosity_request_spot(&request, &about, 2, true, (float[]){2, 0}, &why));
    return request;
}

/* The mean of the second vector in channel c, all written out. */
static double mean_of(const fixture *f, size_t g, lam_quantity quantity, size_t c) {
    double sum = 0, total = 0;
    for (size_t i = 0; i < N; i++) {
        if (group_of[i] != g) continue;
        const float rho = reflectance[c * N + i];
        double bounced = 0, E_i = 0;
        for (size_t j = 0; j < N; j++) {
            const double E = j == 1 ? (c == 0 ? 3 : 5) : group_of[j] == 2 && c == 0 ? 2 : 0;
            bounced += (double)f->P[c][i][j] * E;
            if (j == i) E_i = E;
        }
        const double indirect = rho > 0 ? bounced : 0;
        const double q = quantity == LAM_RADIOSITY  ? E_i + indirect
                         : quantity == LAM_INDIRECT ? indirect
                                                    : bounced / (rho > 0 ? (double)rho : 1.0);
        sum += area[i] * q;
        total += area[i];
    }
    return sum / total;
}

/* True where the row answers as it should. */
static void judge(const fixture *f, const adjoint_row *row, const radiosity_request *request, size_t g) {
    double means[2 * C];
    ck_assert(adjoint_row_answers(&f->s, row, request));
    adjoint_row_means(&f->s, row, request, NULL, means);
    ck_assert_uint_eq(adjoint_row_work(&f->s, request), C * (2 + 2));
    for (size_t c = 0; c < C; c++) {
        ck_assert(means[c] == 0);
        /* Some ten products, each rounded to 6e-8. */
        if (g < 4) {
            const double wanted = mean_of(f, g, request->quantity, c);
            ck_assert_double_eq_tol(means[C + c], wanted, 2e-6 * fabs(wanted) + 1e-30);
        } else {
            ck_assert(row->area == 0 && means[C + c] == 0);
        }
    }
}

START_TEST(rows_answer_and_are_kept) {
    fixture f;
    setup(&f, 15);
    adjoint_row *first[3][N_GROUPS];
    for (int round = 0; round < 2; round++)
        for (int q = LAM_RADIOSITY; q <= LAM_INDIRECT; q++)
            for (size_t g = 0; g < N_GROUPS; g++) {
                radiosity_request request = make_request(&f, g, (lam_quantity)q);
                adjoint_row *row = NULL;
                problem why = {0};
                ck_assert(adjoint_rows_find(&f.s, &request, &row) == (round == 1));
                if (round == 0) ck_assert(adjoint_rows_get(&f.s, &request, 0, 1, &f.workspace, &row, &why));
                if (round == 0) first[q][g] = row;
                ck_assert_ptr_eq(first[q][g], row);
                judge(&f, row, &request, g);
                adjoint_rows_release(&f.s, 1, &row);
                radiosity_request_free(&request);
            }
    teardown(&f);
}
END_TEST

/* Three have room: the one that was unused for longest goes, and is still whole for who holds it. */
START_TEST(the_oldest_row_goes) {
    fixture f;
    setup(&f, 3);
    radiosity_request requests[5];
    adjoint_row *row[5], *again;
    problem why = {0};
    for (size_t g = 0; g < 5; g++) requests[g] = make_request(&f, g, LAM_RADIOSITY);
    for (size_t g = 0; g < 3; g++)
        ck_assert(adjoint_rows_get(&f.s, &requests[g], 0, 1, &f.workspace, &row[g], &why));
    ck_assert(adjoint_rows_find(&f.s, &requests[0], &again));
    ck_assert_ptr_eq(again, row[0]);
    adjoint_rows_release(&f.s, 1, &again);
    ck_assert(adjoint_rows_get(&f.s, &requests[3], 0, 1, &f.workspace, &row[3], &why));
    ck_assert(!adjoint_rows_find(&f.s, &requests[1], &again));
    judge(&f, row[1], &requests[1], 1);
    for (size_t g = 0; g < 4; g++) {
        if (g == 1) continue;
        ck_assert(adjoint_rows_find(&f.s, &requests[g], &again));
        ck_assert_ptr_eq(again, row[g]);
        adjoint_rows_release(&f.s, 1, &again);
    }
    adjoint_rows_release(&f.s, 4, row);
    ck_assert(adjoint_rows_get(&f.s, &requests[1], 0, 1, &f.workspace, &again, &why));
    judge(&f, again, &requests[1], 1);
    adjoint_rows_release(&f.s, 1, &again);
    for (size_t g = 0; g < 5; g++) radiosity_request_free(&requests[g]);
    teardown(&f);
}
END_TEST

/* Rows get the memory that others leave: fewer are kept, then none, and all answer. */
START_TEST(a_ledger_without_room) {
    fixture f;
    setup(&f, 15);
    adjoint_row *row, *again;
    problem why = {0};
    radiosity_request requests[4];
    for (size_t g = 0; g < 4; g++) requests[g] = make_request(&f, g, LAM_RADIOSITY);
    atomic_store(&f.ledger.room, 2 * row_size + 1);
    for (size_t g = 0; g < 4; g++) {
        ck_assert(adjoint_rows_get(&f.s, &requests[g], 0, 1, &f.workspace, &row, &why));
        judge(&f, row, &requests[g], g);
        adjoint_rows_release(&f.s, 1, &row);
        ck_assert_uint_eq(atomic_load(&f.ledger.taken), (g < 1 ? 1 : 2) * row_size);
        ck_assert_uint_eq(row_cache_held(f.s.rows), atomic_load(&f.ledger.taken));
    }
    ck_assert(!adjoint_rows_find(&f.s, &requests[1], &again));
    ck_assert(adjoint_rows_find(&f.s, &requests[3], &again));
    adjoint_rows_release(&f.s, 1, &again);
    atomic_store(&f.ledger.room, row_size - 1);
    ck_assert(adjoint_rows_get(&f.s, &requests[0], 0, 1, &f.workspace, &row, &why));
    judge(&f, row, &requests[0], 0);
    adjoint_rows_release(&f.s, 1, &row);
    ck_assert(!adjoint_rows_find(&f.s, &requests[0], &again));
    ck_assert_uint_eq(atomic_load(&f.ledger.taken), 0);
    atomic_store(&f.ledger.room, SIZE_MAX);
    ck_assert(adjoint_rows_get(&f.s, &requests[0], 0, 1, &f.workspace, &row, &why));
    adjoint_rows_release(&f.s, 1, &row);
    ck_assert_uint_eq(atomic_load(&f.ledger.taken), row_size);
    for (size_t g = 0; g < 4; g++) radiosity_request_free(&requests[g]);
    teardown(&f);
}
END_TEST

/* Whichever allocation fails: 503 and nothing lost; then, with memory, as if it had not been. */
START_TEST(memory_runs_out) {
    fixture f;
    setup(&f, 5);
    size_t failed = 0;
    for (size_t g = 0; g < 5; g++) {
        radiosity_request request = make_request(&f, g, LAM_IRRADIANCE);
        adjoint_row *row = NULL;
        problem why = {0};
        bool good = false;
        for (long k = 0; !good; k++) {
            ck_assert_int_lt(k, 20);
            allocations_left = k;
            good = adjoint_rows_get(&f.s, &request, 0, 1, &f.workspace, &row, &why);
            allocations_left = -1;
            ck_assert(good || why.status == 503);
            failed += !good;
        }
        judge(&f, row, &request, g);
        adjoint_rows_release(&f.s, 1, &row);
        radiosity_request_free(&request);
    }
    ck_assert_uint_eq(failed, 5 * 6); /* the pass, a row, its numbers, groups, tiles and luminaires */
    teardown(&f);
}
END_TEST

typedef struct client {
    fixture *f;
    double means[3 * N_GROUPS * 20][C];
} client;

static void *ask_often(void *context) {
    client *me = context;
    fixture *f = me->f;
    batch_workspace workspace = {0};
    for (size_t k = 0; k < 3 * N_GROUPS * 20; k++) {
        radiosity_request request = make_request(f, k % N_GROUPS, (lam_quantity)(k / N_GROUPS % 3));
        adjoint_row *row;
        problem why = {0};
        double means[2 * C];
        if (adjoint_rows_find(&f->s, &request, &row) ||
            adjoint_rows_get(&f->s, &request, 0, 1, &workspace, &row, &why)) {
            adjoint_row_means(&f->s, row, &request, NULL, means);
            memcpy(me->means[k], means + C, sizeof me->means[k]);
            adjoint_rows_release(&f->s, 1, &row);
        }
        radiosity_request_free(&request);
    }
    free(workspace.bytes);
    return NULL;
}

/* Rows come and go under all of them; the bits stay. */
START_TEST(many_threads_see_the_same) {
    enum { THREADS = 4 };
    static client clients[THREADS];
    pthread_t threads[THREADS];
    fixture f;
    setup(&f, 4);
    for (size_t t = 0; t < THREADS; t++) {
        clients[t].f = &f;
        ck_assert_int_eq(pthread_create(&threads[t], NULL, ask_often, &clients[t]), 0);
    }
    for (size_t t = 0; t < THREADS; t++) pthread_join(threads[t], NULL);
    for (size_t t = 0; t < THREADS; t++)
        ck_assert_mem_eq(clients[t].means, clients[0].means, sizeof clients[0].means);
    ck_assert_double_eq_tol(clients[0].means[0][0], mean_of(&f, 0, LAM_RADIOSITY, 0), 1e-5);
    teardown(&f);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("adjoint_rows");
    TCase *tcase = tcase_create("adjoint_rows");
    tcase_set_timeout(tcase, 120);
    tcase_add_test(tcase, rows_answer_and_are_kept);
    tcase_add_test(tcase, the_oldest_row_goes);
    tcase_add_test(tcase, a_ledger_without_room);
    tcase_add_test(tcase, memory_runs_out);
    tcase_add_test(tcase, many_threads_see_the_same);
    suite_add_tcase(suite, tcase);
    return suite_run(suite);
}
