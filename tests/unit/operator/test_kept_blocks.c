/* Form factors kept as blocks: stores give back the same bits, products stay within their bound, refined
 * answers within their certificate of a dense solve. F is expanded in long double from its formula. */
#include "solver/base/random.h"
#include "solver/operator/refine/form_factor_rows.h"
#include "solver/operator/refine/refinement.h"
#include "support/failing_memory.h"
#include "support/random_blocks.h"
#include "support/suite.h"

#include <float.h>
#include <omp.h>
#include <unistd.h>

static lam_error error;

/* Two planes of uneven grids, one row of elements, and single elements. */
enum { WIDTH = 8, FIRST = 56, SECOND = 40, ROW = 11, SINGLES = 4, ELEMENTS = FIRST + SECOND + ROW + SINGLES };
enum { ROUNDS = 6000, SWEEPS = 40 };

static void make_places(double (*centre)[3], float (*normal)[3], double *area, uint64_t *seed) {
    for (size_t i = 0; i < ELEMENTS; i++) {
        const size_t k = i < FIRST ? i : i < FIRST + SECOND ? i - FIRST : i - FIRST - SECOND;
        const double along = (double)(k % WIDTH) + .3 * random_lcg_unit(seed), across = (double)(k / WIDTH);
        const double at[3] = {along, across, 0};
        const size_t turn = i < FIRST ? 0 : i < FIRST + SECOND ? 1 : 2;
        for (size_t d = 0; d < 3; d++) centre[i][(d + turn) % 3] = at[d] - (d == 2 ? 9. : 0.);
        normal[i][(2 + turn) % 3] = 1;
        if (i >= FIRST + SECOND) centre[i][0] = (double)(k * k) / 9;
        if (i >= ELEMENTS - SINGLES)
            for (int d = 0; d < 3; d++) centre[i][d] = 4 * random_lcg_unit(seed);
        if (i >= ELEMENTS - SINGLES) {
            const double turned = (double)(i - FIRST - SECOND) / 3;
            normal[i][0] = (float)cos(turned);
            normal[i][1] = 0;
            normal[i][2] = (float)sin(turned);
        }
        area[i] = .1 + random_lcg_unit(seed);
    }
}

/* Non-negative blocks with rows that sum to `most` at most; the tree is a place of its own. */
typedef struct subject {
    plane_tree tree;
    block_factors f;
    double area[ELEMENTS]; /* by element */
} subject;

static subject *make_subject(uint64_t seed, double most) {
    subject *s = test_allocate(1, sizeof *s);
    double(*centre)[3] = test_allocate(ELEMENTS, sizeof *centre);
    double one[ELEMENTS], sums[ELEMENTS];
    float(*normal)[3] = test_allocate(ELEMENTS, sizeof *normal);
    size_t reduced;
    make_places(centre, normal, s->area, &seed);
    ck_ok(plane_tree_make(ELEMENTS, (const double(*)[3])centre, (const float(*)[3])normal, NULL, NULL,
                          PLANE_LEAF, &s->tree, &error));
    ck_ok(block_factors_begin(&s->tree, s->area, (const double(*)[3])centre, &s->f, &error));
    random_blocks(&s->f, ROUNDS, &seed);
    ck_ok(block_factors_end(&s->f, &error));
    ck_ok(block_factors_reduce(&s->f, &reduced, &error));
    ck_assert_uint_gt(reduced, 20);
    s->f.balance = test_allocate(ELEMENTS, sizeof *s->f.balance);
    for (size_t p = 0; p < ELEMENTS; p++) s->f.balance[p] = one[p] = 1;
    for (int sweep = 0; sweep < SWEEPS; sweep++) {
        ck_ok(block_factors_multiply(&s->f, 1, one, sums, &error));
        for (size_t p = 0; p < ELEMENTS; p++)
            if (sums[p] > 0) s->f.balance[p] *= sqrt(most / sums[p]);
    }
    ck_ok(block_factors_multiply(&s->f, 1, one, sums, &error));
    for (size_t p = 0; p < ELEMENTS; p++)
        if (sums[p] > most) s->f.balance[p] *= most / sums[p];
    free(centre);
    free(normal);
    return s;
}

static void subject_free(subject *s) {
    block_factors_free(&s->f);
    plane_tree_free(&s->tree);
    free(s);
}

/* F [n][n] by element, from the formula. */
static long double *expand(const subject *s) {
    const block_factors *f = &s->f;
    long double *F = test_allocate(ELEMENTS * ELEMENTS, sizeof *F);
    for (size_t k = 0; k < f->n_blocks; k++) {
        const cluster_block *block = &f->blocks[k];
        for (size_t p = f->nodes[block->a].begin; p < f->nodes[block->a].end; p++)
            for (size_t q = f->nodes[block->b].begin; q < f->nodes[block->b].end; q++) {
                double x[BLOCK_FUNCTIONS], y[BLOCK_FUNCTIONS];
                long double value = 0;
                block_functions_at(f, block->a, p, x);
                block_functions_at(f, block->b, q, y);
                for (int r = 0; r < BLOCK_FUNCTIONS; r++)
                    for (int c = 0; c < BLOCK_FUNCTIONS; c++)
                        value += (long double)x[r] * (long double)block->L[r][c] * (long double)y[c];
                value *= (long double)f->balance[p] * (long double)f->balance[q];
                const size_t i = f->order[p], j = f->order[q];
                F[i * ELEMENTS + j] += value * (long double)s->area[j];
                F[j * ELEMENTS + i] += value * (long double)s->area[i];
            }
    }
    return F;
}

static void save(const subject *s, const char *path) {
    store *out;
    const size_t n = ELEMENTS;
    ck_ok(store_create(path, &out, &error));
    ck_ok(store_write(out, "/mesh/area", STORE_F64, 1, &n, s->area, &error));
    ck_ok(block_factors_save(&s->f, out, &error));
    ck_ok(store_set_text(out, "/form_factors", "storage", "blocks", &error));
    ck_ok(store_seal(out, &error));
}

START_TEST(a_store_gives_back_the_same_bits) {
    subject *s = make_subject(3, .9);
    const char *path = "kept-blocks.h5";
    plane_tree tree;
    block_factors f;
    store *in;
    double x[ELEMENTS], y[ELEMENTS], again[ELEMENTS];
    uint64_t seed = 4;
    size_t kept, most;
    save(s, path);
    ck_ok(store_open(path, &in, &error));
    ck_ok(block_factors_load(in, ELEMENTS, s->area, &tree, &f, &error));
    ck_ok(block_factors_stored(in, &kept, &most, &error));
    ck_assert_uint_eq(kept, block_factors_bytes(&s->f));
    ck_assert_uint_gt(most, kept);
    ck_assert_uint_eq(tree.n_frames, s->tree.n_frames);
    ck_assert_mem_eq(tree.frames, s->tree.frames, tree.n_frames * sizeof *tree.frames);
    ck_assert_mem_eq(tree.order, s->tree.order, ELEMENTS * sizeof *tree.order);
    ck_assert_uint_eq(f.n_blocks, s->f.n_blocks);
    for (size_t t = 0; t < tree.n_clusters; t++) {
        const plane_cluster *a = &tree.clusters[t], *b = &s->tree.clusters[t];
        ck_assert(a->begin == b->begin && a->end == b->end && a->leaf == b->leaf && a->frame == b->frame);
        ck_assert(a->leaf || a->left == b->left);
        ck_assert_uint_eq(f.nodes[t].parent, s->f.nodes[t].parent);
        ck_assert_mem_eq(f.nodes[t].over, s->f.nodes[t].over, sizeof f.nodes[t].over);
    }
    for (size_t k = 0; k < ELEMENTS; k++) x[k] = random_lcg_unit(&seed) - .3;
    ck_ok(block_factors_multiply(&s->f, 1, x, y, &error));
    ck_ok(block_factors_multiply(&f, 1, x, again, &error));
    ck_assert_mem_eq(y, again, sizeof y);
    store_close(in);
    unlink(path);
    block_factors_free(&f);
    plane_tree_free(&tree);
    subject_free(s);
}
END_TEST

static lam_form_factors *handle(subject *s) {
    lam_form_factors *F;
    plane_tree tree = s->tree;
    block_factors f = s->f;
    s->tree = (plane_tree){.n = 0};
    s->f = (block_factors){.n = 0};
    f.tree = &tree;
    ck_ok(form_factors_of_blocks(&tree, &f, &F, &error));
    return F;
}

START_TEST(bounds_of_products_hold) {
    subject *s = make_subject(7, 1);
    const size_t n = ELEMENTS;
    long double *F = expand(s);
    lam_form_factors *kept = handle(s);
    double x[ELEMENTS], y[ELEMENTS];
    const double *from = x;
    double *to = y;
    uint64_t seed = 5;
    void *work = test_allocate(block_factors_work(&kept->blocks->f, 1), 1);
    size_t tight = 0;
    ck_assert_double_lt(kept->blocks->rounding, 1e-12);
    for (int round = 0; round < 20; round++) {
        const block_vectors one = {1, 1, true, &from, &to};
        for (size_t i = 0; i < n; i++) x[i] = round == 0 ? 1 : 2 * random_lcg_unit(&seed) - 1;
        block_factors_apply(&kept->blocks->f, &one, work, 2);
        for (size_t i = 0; i < n; i++) {
            long double sum = 0, row = 0, norm = 0;
            for (size_t j = 0; j < n; j++) {
                const long double entry = F[i * n + j];
                ck_assert(entry >= 0);
                sum += entry * (long double)x[j];
                row += entry;
                norm += entry * entry / (long double)s->area[j];
            }
            ck_assert(fabsl((long double)y[i] - sum) <= (long double)kept->blocks->rounding);
            ck_assert((long double)kept->row_sums[i] >= row && (long double)kept->row_sums[i] < row + 1e-11L);
            ck_assert((long double)kept->row_norms[i] >= sqrtl(norm));
            tight += (long double)kept->row_norms[i] < 1.6L * sqrtl(norm);
        }
    }
    ck_assert_uint_gt(tight, 10 * n);
    ck_assert_uint_gt(lam_form_factors_bytes(kept), kept->blocks->f.n_blocks * 2 * sizeof(cluster_block));
    lam_form_factors_close(kept);
    free(work);
    free(F);
    subject_free(s);
}
END_TEST

/* Solves A x = b by elimination with pivots; A [n][n] and b [n][m] are overwritten. */
static void solve(size_t n, size_t m, long double *A, long double *b) {
    for (size_t k = 0; k < n; k++) {
        size_t best = k;
        for (size_t i = k; i < n; i++)
            if (fabsl(A[i * n + k]) > fabsl(A[best * n + k])) best = i;
        for (size_t j = 0; j < n; j++) {
            const long double was = A[k * n + j];
            A[k * n + j] = A[best * n + j];
            A[best * n + j] = was;
        }
        for (size_t j = 0; j < m; j++) {
            const long double was = b[k * m + j];
            b[k * m + j] = b[best * m + j];
            b[best * m + j] = was;
        }
        for (size_t i = 0; i < n; i++) {
            const long double factor = i == k ? 0 : A[i * n + k] / A[k * n + k];
            for (size_t j = k; j < n && factor != 0; j++) A[i * n + j] -= factor * A[k * n + j];
            for (size_t j = 0; j < m && factor != 0; j++) b[i * m + j] -= factor * b[k * m + j];
        }
    }
    for (size_t k = 0; k < n; k++)
        for (size_t j = 0; j < m; j++) b[k * m + j] /= A[k * n + k];
}

/* (I - R F)^-1 [n][n] */
static long double *inverse(const long double *F, const float *rho) {
    const size_t n = ELEMENTS;
    long double *A = test_allocate(n * n, sizeof *A), *inverted = test_allocate(n * n, sizeof *inverted);
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j < n; j++) A[i * n + j] = (i == j) - (long double)rho[i] * F[i * n + j];
        inverted[i * n + i] = 1;
    }
    solve(n, n, A, inverted);
    free(A);
    return inverted;
}

/* As many as share a product, and one more. */
enum { LIGHTS = BLOCK_VECTORS + 1 };

/* One element, some, all alike, nothing, anything. */
static void light(size_t C, int which, double *E, double *H0) {
    uint64_t seed = 9 + (uint64_t)which;
    for (size_t k = 0; k < C * ELEMENTS; k++) {
        const size_t i = k % ELEMENTS;
        const double any = random_lcg_unit(&seed);
        E[k] = which == 0 ? 3. * (i == 17) : which == 1 ? i % 9 == 0 : which == 2 ? 1 : which == 4 ? 0 : any;
        H0[k] = which == 3 || i % 4 == 0 ? 2 * random_lcg_unit(&seed) : 0;
    }
}

static const double tolerances[] = {.1, 1e-3, 1e-6, 1e-9};

typedef struct refined_case {
    float rho;
    size_t n_channels;
    double most; /* row sum */
} refined_case;
static const refined_case cases[] = {{.5f, 1, 1}, {.9f, 3, 1}, {.99f, 1, 1}, {.7f, 1, .6}};

/* The error of every answer is at most its certificate, and the certificate at most what was asked for. */
START_TEST(certificates_hold) {
    const refined_case *how = &cases[_i];
    const size_t n = ELEMENTS, C = how->n_channels;
    subject *s = make_subject(20 + (uint64_t)_i, how->most);
    long double *F = expand(s), *M[3];
    float *rho = test_allocate(C * n, sizeof *rho), *P = test_allocate(C * n * n, sizeof *P);
    double *E = test_allocate(LIGHTS * C * n, sizeof *E), *H0 = test_allocate(LIGHTS * C * n, sizeof *H0),
           *out = test_allocate(LIGHTS * C * n, sizeof *out), certificates[LIGHTS];
    size_t iterations[LIGHTS];
    uint64_t seed = 2;
    lam_operator *op = NULL;
    lam_refiner *refiner = NULL;
    for (size_t c = 0; c < C; c++) {
        for (size_t i = 0; i < n; i++) rho[c * n + i] = i % 13 == 5 ? 0 : how->rho - .1f * (float)(i % 4);
        M[c] = inverse(F, rho + c * n);
        /* The operator that gives directions is off by a hundredth of each number. */
        for (size_t k = 0; k < n * n; k++)
            P[c * n * n + k] =
                (float)((M[c][k] - (k % (n + 1) == 0)) * (1 + .02 * (random_lcg_unit(&seed) - .5)));
    }
    ck_ok(operator_exact_create(n, C, rho, P, &op, &error));
    lam_operator_set_threads(op, 2);
    lam_form_factors *kept = handle(s);
    ck_ok(lam_refiner_create(op, kept, &refiner, &error));
    for (int which = 0; which < LIGHTS; which++)
        light(C, which, E + (size_t)which * C * n, H0 + (size_t)which * C * n);
    double largest_share = 0;
    for (size_t k = 0; k < sizeof tolerances / sizeof *tolerances; k++)
        for (lam_quantity q = LAM_RADIOSITY; q <= LAM_INDIRECT; q++)
            for (int lit = 0; lit < 2; lit++) {
                ck_assert_msg(lam_refine(refiner, LIGHTS, q, E, lit ? H0 : NULL, NULL, tolerances[k], out,
                                         certificates, iterations, &error) == LAM_OK,
                              "%s", error.message);
                for (size_t v = 0; v < LIGHTS; v++) {
                    long double worst = 0, indirect = 0, largest = 0;
                    for (size_t row = v * C; row < (v + 1) * C; row++) {
                        const float *r = rho + row % C * n;
                        long double e[ELEMENTS], B[ELEMENTS];
                        for (size_t i = 0; i < n; i++)
                            e[i] = (long double)E[row * n + i] +
                                   (lit ? (long double)r[i] * (long double)H0[row * n + i] : 0);
                        for (size_t i = 0; i < n; i++) {
                            B[i] = 0;
                            for (size_t j = 0; j < n; j++) B[i] += M[row % C][i * n + j] * e[j];
                        }
                        for (size_t i = 0; i < n; i++) {
                            long double right = q == LAM_INDIRECT ? B[i] - e[i] : B[i];
                            if (q == LAM_IRRADIANCE) {
                                right = lit ? (long double)H0[row * n + i] : 0;
                                for (size_t j = 0; j < n; j++) right += F[i * n + j] * B[j];
                            }
                            worst = fmaxl(worst, fabsl((long double)out[row * n + i] - right));
                            indirect = fmaxl(indirect, fabsl(B[i] - e[i]));
                            largest = fmaxl(largest, fabsl(right));
                        }
                    }
                    /* Sums of n products in long double, n cond 2^-64 of the largest. */
                    const long double slack = 0x1p-50L * largest;
                    ck_assert_msg(worst <= (long double)certificates[v] + slack,
                                  "light %zu, quantity %d, tolerance %g: off by %Lg, certified %g", v, (int)q,
                                  tolerances[k], worst, certificates[v]);
                    if (q != LAM_IRRADIANCE && C == 1)
                        ck_assert((long double)certificates[v] <=
                                  (long double)tolerances[k] * (1 + (long double)tolerances[k]) * indirect +
                                      slack);
                    if (certificates[v] > 0)
                        largest_share = fmax(largest_share, (double)(worst / (long double)certificates[v]));
                }
            }
    /* They are bounds of this world. */
    ck_assert_double_gt(largest_share, 1e-2);
    lam_refiner_free(refiner);
    lam_form_factors_close(kept);
    lam_operator_close(op);
    for (size_t c = 0; c < C; c++) free(M[c]);
    free(F);
    free(rho);
    free(E);
    free(H0);
    free(out);
    subject_free(s);
}
END_TEST

/* A certificate counts the rounding of products: of those that found the answer, and of the one that gives
 * the irradiance of a black scene. */
START_TEST(rounding_counts) {
    static const double rounding = 1e-3;
    static const lam_quantity quantities[] = {LAM_INDIRECT, LAM_IRRADIANCE};
    const size_t n = ELEMENTS;
    for (int black = 0; black < 2; black++) {
        subject *s = make_subject(41, .9);
        float rho[ELEMENTS], *P = test_allocate(n * n, sizeof *P);
        double E[ELEMENTS], out[ELEMENTS], certificate;
        size_t iterations;
        lam_operator *op = NULL;
        lam_refiner *refiner = NULL;
        for (size_t i = 0; i < n; i++) {
            rho[i] = black ? 0 : .5f;
            E[i] = 1;
        }
        ck_ok(operator_exact_create(n, 1, rho, P, &op, &error));
        lam_form_factors *kept = handle(s);
        kept->blocks->rounding = rounding;
        ck_ok(lam_refiner_create(op, kept, &refiner, &error));
        ck_ok(lam_refine(refiner, 1, quantities[black], E, NULL, NULL, .5, out, &certificate, &iterations,
                         &error));
        ck_assert_double_ge(certificate, (black ? 1 : .5) * rounding);
        if (!black)
            ck_assert_int_eq(lam_refine(refiner, 1, LAM_INDIRECT, E, NULL, NULL, rounding / 10, out,
                                        &certificate, &iterations, &error),
                             LAM_ERR_NUMERIC);
        lam_refiner_free(refiner);
        lam_form_factors_close(kept);
        lam_operator_close(op);
        subject_free(s);
    }
}
END_TEST

/* Rows that sum to more than 1 give no certificate, and no store is read with them. */
START_TEST(rows_above_one_are_refused) {
    subject *s = make_subject(31, 1.001);
    plane_tree tree = s->tree;
    block_factors f = s->f;
    lam_form_factors *F = NULL;
    f.tree = &tree;
    s->tree = (plane_tree){.n = 0};
    s->f = (block_factors){.n = 0};
    ck_assert_int_eq(form_factors_of_blocks(&tree, &f, &F, &error), LAM_ERR_FORMAT);
    ck_assert_ptr_nonnull(strstr(error.message, "must be at most 1"));
    ck_assert(F == NULL && tree.order == NULL && f.blocks == NULL);
    subject_free(s);
}
END_TEST

/* Each allocation that fails leaves an error and nothing behind. */
START_TEST(memory_runs_out) {
    subject *s = make_subject(3, .9);
    const char *path = "kept-blocks-memory.h5";
    store *in;
    int failed = 0;
    save(s, path);
    ck_ok(store_open(path, &in, &error));
    for (long left = 0;; left++) {
        lam_form_factors *F = NULL;
        allocations_left = left;
        const lam_status status = form_factors_open(in, &F, &error);
        allocations_left = -1;
        ck_assert((status == LAM_OK) == (F != NULL));
        lam_form_factors_close(F);
        if (status == LAM_OK) break;
        ck_assert_int_eq(status, LAM_ERR_MEMORY);
        failed++;
    }
    ck_assert_int_gt(failed, 20);
    store_close(in);
    unlink(path);
    subject_free(s);
}
END_TEST

int main(void) {
    Suite *suite = suite_create("kept blocks");
    TCase *tests = tcase_create("kept blocks");
    tcase_set_timeout(tests, 300);
    tcase_add_test(tests, a_store_gives_back_the_same_bits);
    tcase_add_test(tests, bounds_of_products_hold);
    tcase_add_loop_test(tests, certificates_hold, 0, (int)(sizeof cases / sizeof *cases));
    tcase_add_test(tests, rounding_counts);
    tcase_add_test(tests, rows_above_one_are_refused);
    tcase_add_test(tests, memory_runs_out);
    suite_add_tcase(suite, tests);
    return suite_run(suite);
}
