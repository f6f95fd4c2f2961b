#include "support/transport.h"

#include "solver/base/random.h"

double sum_roundings(size_t count) {
    return (count < 128 ? (double)count : 128.0) + 6.0;
}

static void make_exact(transport *t, const transport_parts *parts) {
    const double *F = parts->F;
    lam_error error = {.message = ""};
    size_t n = t->n, square = n * n;
    float *P = test_allocate(t->n_channels * square, sizeof *P);
    for (size_t c = 0; c < t->n_channels; c++) {
        float *rounded = test_allocate(square, sizeof *rounded);
        bounced_light(n, F, t->reflectance + c * n, t->P + c * square);
        for (size_t e = 0; e < square; e++) {
            rounded[e] = (float)t->P[c * square + e];
            /* The diagonal is kept as 1 + P_ii. */
            t->magnitude[c * square + e] = fabs(t->P[c * square + e]) + (e % (n + 1) == 0 ? 1.0 : 0.0);
        }
        float *positions = in_positions(t->order, n, n, true, rounded);
        memcpy(P + c * square, positions, square * sizeof *P);
        free(positions);
        free(rounded);
    }
    t->roundings = 2 + sum_roundings(n);
    ck_assert_msg(operator_exact_create(n, t->n_channels, t->reflectance, P, &t->op, &error) == LAM_OK, "%s",
                  error.message);
}

/* Every third entry of the inverse; grey also what was left out of each row, spread by weights, and rows 20
 * to 29 without any entry. */
static void make_sparse(transport *t, const transport_parts *parts) {
    const double *F = parts->F;
    lam_error error = {.message = ""};
    const size_t n = t->n, C = t->n_channels;
    sparse_arrays arrays = {.M = test_allocate(C, sizeof *arrays.M)};
    if (C == 1) {
        arrays.delta = test_allocate(n, sizeof *arrays.delta);
        arrays.weight = test_allocate(n, sizeof *arrays.weight);
        for (size_t p = 0; p < n; p++)
            arrays.weight[p] = (float)(2. * (double)(p + 1) / (double)(n * (n + 1)));
    }
    if (strstr(t->name, "parts") != NULL) {
        arrays.part = test_allocate(n, sizeof *arrays.part);
        for (size_t p = 0; p < n; p++) arrays.part[p] = p % 5 < 2 ? 0 : 2; /* the part 1 is empty */
    }
    for (size_t c = 0; c < C; c++) {
        double *P = t->P + c * n * n, *magnitude = t->magnitude + c * n * n;
        csr *M = &arrays.M[c];
        *M = (csr){.n = n,
                   .indptr = test_allocate(n + 1, sizeof *M->indptr),
                   .indices = test_allocate(n * n, sizeof *M->indices),
                   .data = test_allocate(n * n, sizeof *M->data)};
        bounced_light(n, F, t->reflectance + c * n, P);
        for (size_t p = 0; p < n; p++) {
            const size_t i = t->order != NULL ? t->order[p] : p;
            uint64_t last = M->indptr[p];
            double lost = 0;
            for (size_t q = 0; q < n; q++) {
                const size_t j = t->order != NULL ? t->order[q] : q;
                const bool kept = (p + q) % 3 == 0 && (C > 1 || p < 20 || p >= 30);
                lost += kept ? 0 : P[i * n + j];
                if (kept) {
                    M->indices[last] = (uint32_t)q;
                    M->data[last++] = (float)P[i * n + j];
                }
                P[i * n + j] = kept ? (double)(float)P[i * n + j] : 0;
            }
            M->indptr[p + 1] = last;
            if (arrays.delta != NULL) arrays.delta[p] = (float)lost;
            for (size_t q = 0; q < n; q++) {
                const size_t j = t->order != NULL ? t->order[q] : q;
                const bool lit = arrays.part == NULL || arrays.part[p] == arrays.part[q];
                const double spread =
                    arrays.delta != NULL && lit ? (double)arrays.delta[p] * (double)arrays.weight[q] : 0;
                magnitude[i * n + j] = fabs(P[i * n + j]) + fabs(spread);
                P[i * n + j] += spread;
            }
        }
    }
    t->roundings = 4 + sum_roundings(n); /* delta: its product and its place in the sum */
    ck_assert_msg(operator_sparse_create(n, C, t->reflectance, &arrays, &t->op, &error) == LAM_OK, "%s",
                  error.message);
}

double transport_area(size_t element) {
    const double root = 1 + (double)(element % 3) / 4;
    return root * root;
}

/* P += R' missing 1^T A / light, missing of numbers that half precision has. */
static void make_up_for_even_light(transport *t, const double *area, uint64_t *state) {
    lam_error error = {.message = ""};
    const size_t n = t->n, C = t->n_channels;
    double *missing = test_allocate(C * n, sizeof *missing), *light = test_allocate(C, sizeof *light);
    for (size_t c = 0; c < C; c++) {
        light[c] = 50 + 100 * random_lcg_unit(state);
        for (size_t p = 0; p < n; p++) missing[c * n + p] = floor(64 * random_lcg_unit(state) - 24) / 64;
        for (size_t p = 0; p < n; p++)
            for (size_t q = 0; q < n; q++) {
                const size_t i = t->order != NULL ? t->order[p] : p, j = t->order != NULL ? t->order[q] : q;
                const double by = rho_or_one(t->reflectance[c * n + i]) * missing[c * n + p];
                t->P[(c * n + i) * n + j] += by * area[q] / light[c];
                t->magnitude[(c * n + i) * n + j] += fabs(by) * area[q] / light[c];
            }
    }
    ck_assert_msg(operator_hierarchical_correct(t->op, missing, light, &error) == LAM_OK, "%s",
                  error.message);
    free(missing);
    free(light);
}

/* P = R' A^-1/2 W^T K W A^1/2, K random, symmetric and of few numbers, multiples of the steps; of more
 * channels it is made up for even light, too. Channels that are alike have one K. */
static void make_hierarchical(transport *t, const transport_parts *parts) {
    uint64_t *state = parts->state;
    lam_error error = {.message = ""};
    const size_t n = t->n, C = t->n_channels, square = n * n;
    hierarchical_arrays arrays = {.K = test_allocate(C, sizeof *arrays.K),
                                  .step = test_allocate(n, sizeof *arrays.step)};
    for (size_t i = 0; i < n; i++) arrays.step[i] = .125f;
    double *W = test_allocate(square, sizeof *W), *size = test_allocate(square, sizeof *size),
           *area = test_allocate(n, sizeof *area), *K = test_allocate(square, sizeof *K);
    const double roundings = random_basis(n, state, &arrays.basis, W, size);
    for (size_t p = 0; p < n; p++) area[p] = transport_area(t->order != NULL ? t->order[p] : p);
    for (size_t c = 0; c < C; c++) {
        const size_t like = operator_like_channel(n, t->reflectance, c);
        if (like < c) {
            memcpy(t->P + c * square, t->P + like * square, square * sizeof *t->P);
            memcpy(t->magnitude + c * square, t->magnitude + like * square, square * sizeof *t->magnitude);
            continue;
        }
        csr *upper = &arrays.K[c];
        *upper = (csr){.n = n,
                       .indptr = test_allocate(n + 1, sizeof *upper->indptr),
                       .indices = test_allocate(square, sizeof *upper->indices),
                       .data = test_allocate(square, sizeof *upper->data)};
        memset(K, 0, square * sizeof *K);
        for (size_t i = 0; i < n; i++) {
            uint64_t last = upper->indptr[i];
            for (size_t j = i; j < n; j++) {
                if (i != j && random_lcg_unit(state) > .05) continue;
                const double value = floor(200 * random_lcg_unit(state) - 50) / 64;
                K[i * n + j] = K[j * n + i] = value;
                upper->indices[last] = (uint32_t)j;
                upper->data[last++] = (float)value;
            }
            upper->indptr[i + 1] = last;
        }
        double *half = test_allocate(square, sizeof *half),
               *half_size = test_allocate(square, sizeof *half_size);
        for (size_t i = 0; i < n; i++)
            for (size_t k = 0; k < n; k++)
                for (size_t p = 0; p < n && K[i * n + k] != 0; p++) {
                    half[i * n + p] += K[i * n + k] * W[k * n + p];
                    half_size[i * n + p] += fabs(K[i * n + k]) * size[k * n + p];
                }
        for (size_t p = 0; p < n; p++)
            for (size_t q = 0; q < n; q++) {
                const size_t i = t->order != NULL ? t->order[p] : p, j = t->order != NULL ? t->order[q] : q;
                const double scale = rho_or_one(t->reflectance[c * n + i]) * sqrt(area[q] / area[p]);
                double sum = 0, sum_size = 0;
                for (size_t k = 0; k < n; k++) {
                    sum += W[k * n + p] * half[k * n + q];
                    sum_size += size[k * n + p] * half_size[k * n + q];
                }
                t->P[c * square + i * n + j] = scale * sum;
                t->magnitude[c * square + i * n + j] = scale * sum_size;
            }
        free(half);
        free(half_size);
    }
    /* Two transforms, K's rows, A^1/2 x, rho' / A^1/2, its product. */
    t->roundings = 2 * roundings + sum_roundings(n) + 4;
    ck_assert_msg(
        operator_hierarchical_create(n, C, t->reflectance, area, t->order, &arrays, &t->op, &error) == LAM_OK,
        "%s", error.message);
    if (C > 1) make_up_for_even_light(t, area, state);
    free(W);
    free(size);
    free(area);
    free(K);
}

/* x [n][k] as a precision keeps it, so that narrowing it changes nothing any more (i8: but one rounding, of
 * the product with the scale). */
static void round_to(panel_precision precision, size_t n, size_t k, float *x) {
    lam_error error = {.message = ""};
    panel wide, narrow;
    if (precision == PANEL_F32) return;
    ck_assert(panel_create(n, k, x, "x", &wide, &error) == LAM_OK);
    ck_assert_msg(panel_convert(&wide, precision, "x", &narrow, &error) == LAM_OK, "%s", error.message);
    panel_copy_rows(&narrow, x);
    panel_free(&wide);
    panel_free(&narrow);
}

/* P = -Y V^T takes the place of P = rho' F M, which Y and V no longer are once they are rounded. */
static void product_of_factors(transport *t, const float *Y, const float *V) {
    const size_t n = t->n, k = t->k;
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) {
            t->P[i * n + j] = t->magnitude[i * n + j] = 0;
            for (size_t b = 0; b < k; b++) {
                const double product = -(double)Y[i * k + b] * (double)V[j * k + b];
                t->P[i * n + j] += product;
                t->magnitude[i * n + j] += fabs(product);
            }
        }
}

/* Makes factors of two meshes: U has row sums up to .95, V has one weight a row, of a patch that is one run
 * of positions; patches have 1 element or many, and weights sum to 1 or (unweighted) are 1. I is [k+1]. */
static void random_two_mesh(size_t n, size_t k, const uint32_t *order, bool weighted, float *U, float *V,
                            uint64_t *begin, uint64_t *state) {
    for (size_t p = 1; p <= k; p++) begin[p] = p + (n - k) * p * p * p / (k * k * k);
    for (size_t p = 0; p < k; p++) {
        double area = 0, share[512];
        ck_assert(begin[p + 1] > begin[p] && begin[p + 1] - begin[p] < 512);
        for (uint64_t j = begin[p]; j < begin[p + 1]; j++)
            area += share[j - begin[p]] = 0.1 + random_lcg_unit(state);
        for (uint64_t j = begin[p]; j < begin[p + 1]; j++)
            V[(order ? order[j] : j) * k + p] = weighted ? (float)(share[j - begin[p]] / area) : 1.0f;
    }
    for (size_t i = 0; i < n; i++) {
        double sum = 0;
        for (size_t p = 0; p < k; p++) {
            U[i * k + p] = random_lcg_unit(state) < 0.4 ? (float)random_lcg_unit(state) : 0.0f;
            sum += (double)U[i * k + p] * (weighted ? 1.0 : (double)(begin[p + 1] - begin[p]));
        }
        for (size_t p = 0; p < k && sum > 0; p++) U[i * k + p] = (float)(0.95 * (double)U[i * k + p] / sum);
    }
}

/* The operator of two meshes from a V that is one: left [n][k] and core as of low rank. */
static lam_status create_two_mesh(const transport *t, float *left, const float *V_positions,
                                  const uint64_t *begin, float *core, lam_operator **op, lam_error *error) {
    size_t n = t->n, k = t->k;
    two_mesh_arrays arrays = {.left = left, .core = core};
    arrays.begin = test_allocate(k + 1, sizeof *arrays.begin);
    memcpy(arrays.begin, begin, (k + 1) * sizeof *begin);
    arrays.coherence = test_allocate(k, sizeof *arrays.coherence);
    float *weight = test_allocate(n, sizeof *weight);
    bool ones = true;
    for (size_t p = 0; p < k; p++) {
        arrays.coherence[p] = (float)p / (float)k;
        for (uint64_t j = begin[p]; j < begin[p + 1]; j++) {
            weight[j] = V_positions[j * k + p];
            ones = ones && weight[j] == 1;
        }
    }
    if (ones)
        free(weight);
    else
        arrays.weight = weight;
    return operator_two_mesh_create(n, k, t->n_channels, t->reflectance, &arrays, op, error);
}

/* Y = -rho' U core for one channel, magnitude |U| |core| |V|^T rho' for all. With I, V is that of two meshes.
 */
static void make_low_rank(transport *t, const transport_parts *parts) {
    const double *F = parts->F;
    const float *U = parts->U, *V = parts->V;
    const uint64_t *begin = parts->begin;
    const bool folded = strstr(t->name, "folded") != NULL;
    lam_error error = {.message = ""};
    size_t n = t->n, k = t->k;
    float *core = test_allocate(t->n_channels * k * k, sizeof *core), *Y = test_allocate(n * k, sizeof *Y);
    double *K = test_allocate(k * k, sizeof *K), *left = test_allocate(n * k, sizeof *left);
    for (size_t c = 0; c < t->n_channels; c++) {
        const float *rho = t->reflectance + c * n;
        bounced_light(n, F, rho, t->P + c * n * n);
        for (size_t a = 0; a < k; a++) /* core = (I - V^T R U)^-1 */
            for (size_t b = 0; b < k; b++) {
                K[a * k + b] = a == b ? 1.0 : 0.0;
                for (size_t i = 0; i < n; i++)
                    K[a * k + b] -= (double)V[i * k + a] * (double)rho[i] * (double)U[i * k + b];
            }
        invert(k, K);
        for (size_t e = 0; e < k * k; e++) core[c * k * k + e] = (float)K[e];
        for (size_t i = 0; i < n; i++)
            for (size_t b = 0; b < k; b++) {
                double sum = 0;
                left[i * k + b] = 0;
                for (size_t a = 0; a < k; a++) {
                    double product = rho_or_one(rho[i]) * (double)U[i * k + a] * K[a * k + b];
                    sum += product;
                    left[i * k + b] += fabs(product);
                }
                Y[i * k + b] = (float)-sum;
            }
        for (size_t i = 0; i < n; i++)
            for (size_t j = 0; j < n; j++)
                for (size_t b = 0; b < k; b++)
                    t->magnitude[(c * n + i) * n + j] += left[i * k + b] * fabs((double)V[j * k + b]);
    }
    if (folded) round_to(t->precision, n, k, Y);
    if (folded && t->precision != PANEL_F32) product_of_factors(t, Y, V);
    float *V_positions = in_positions(t->order, n, k, false, V);
    lam_status status;
    if (folded) { /* Y rounded; V^T E, Y t */
        float *rows = in_positions(t->order, n, k, false, Y);
        t->roundings = 1 + sum_roundings(n) + sum_roundings(k);
        if (begin != NULL)
            status = create_two_mesh(t, rows, V_positions, begin, NULL, &t->op, &error);
        else
            status = operator_low_rank_create_folded(n, k, t->reflectance, rows, V_positions, &t->op, &error);
        free(core);
    } else { /* core rounded; V^T E, core t, U t, rho' */
        float *rows = in_positions(t->order, n, k, false, U);
        t->roundings = 2 + sum_roundings(n) + 2 * sum_roundings(k);
        if (begin != NULL)
            status = create_two_mesh(t, rows, V_positions, begin, core, &t->op, &error);
        else
            status = operator_low_rank_create_factored(n, k, t->n_channels, t->reflectance, rows, V_positions,
                                                       core, &t->op, &error);
    }
    if (begin != NULL) free(V_positions);
    ck_assert_msg(status == LAM_OK, "%s", error.message);
    if (t->precision != PANEL_F32) { /* a scale's division and product, with V^T E and with t */
        lam_operator *wide = t->op;
        t->roundings += 4;
        ck_assert_msg(operator_narrow(wide, t->precision, &t->op, &error) == LAM_OK, "%s", error.message);
        lam_operator_close(wide);
    }
    free(Y);
    free(K);
    free(left);
}

void relight(transport *t, const transport_parts *parts) {
    lam_error error = {.message = ""};
    transport first = *t;
    first.reflectance = random_reflectance(t->n, t->n_channels, parts->state);
    first.P = test_allocate(t->n_channels * t->n * t->n, sizeof *first.P);
    first.magnitude = test_allocate(t->n_channels * t->n * t->n, sizeof *first.magnitude);
    make_low_rank(&first, parts);
    ck_assert(operator_set_order(first.op, t->order, &error) == LAM_OK);
    lam_operator_close(t->op);
    ck_assert_msg(operator_relight(first.op, t->reflectance, NULL, &t->op, &error) == LAM_OK, "%s",
                  error.message);
    t->lender = first.op;
    free(first.reflectance);
    free(first.P);
    free(first.magnitude);
}

transport transport_make(transport_kind kind, bool ordered) {
    static const struct {
        const char *name, *kind;
        panel_precision precision;
        void (*make)(transport *t, const transport_parts *parts);
    } kinds[] = {
#define TRANSPORT_ROW(id, name, kind, precision, make) {name, kind, precision, make},
        TRANSPORT_LIST(TRANSPORT_ROW)};
    lam_error error = {.message = ""};
    uint64_t state = 11 + (uint64_t)kind;
    const bool colour = strstr(kinds[kind].name, "3 channels") != NULL;
    const bool two_mesh = strcmp(kinds[kind].kind, "two_mesh") == 0;
    uint64_t begin[64] = {0};
    transport t = {.name = kinds[kind].name,
                   .kind = kinds[kind].kind,
                   .n = 151,
                   .k = 21,
                   .n_channels = colour ? 3 : 1,
                   .precision = kinds[kind].precision};
    size_t n = t.n, k = t.k;
    float *U = test_allocate(n * k, sizeof *U), *V = test_allocate(n * k, sizeof *V);
    double *F = test_allocate(n * n, sizeof *F);
    if (ordered) t.order = random_order(n, &state);
    if (two_mesh) {
        random_two_mesh(n, k, t.order, colour, U, V, begin, &state);
        round_to(t.precision, n, k, U);
    } else {
        random_factors(n, k, U, V, &state);
        round_to(t.precision, n, k, U);
        round_to(t.precision, n, k, V);
    }
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++)
            for (size_t b = 0; b < k; b++) F[i * n + j] += (double)U[i * k + b] * (double)V[j * k + b];
    t.reflectance = random_reflectance(n, t.n_channels, &state);
    if (strstr(t.name, "alike") != NULL)
        memcpy(t.reflectance + 2 * n, t.reflectance, n * sizeof *t.reflectance);
    t.P = test_allocate(t.n_channels * n * n, sizeof *t.P);
    t.magnitude = test_allocate(t.n_channels * n * n, sizeof *t.magnitude);
    const transport_parts parts = {F, U, V, two_mesh ? begin : NULL, &state};
    kinds[kind].make(&t, &parts);
    if (strstr(t.name, "relit") != NULL)
        relight(&t, &parts);
    else if (ordered)
        ck_assert(operator_set_order(t.op, t.order, &error) == LAM_OK);
    t.F = F;
    free(U);
    free(V);
    return t;
}

void transport_free(transport *t) {
    lam_operator_close(t->op);
    lam_operator_close(t->lender);
    free(t->reflectance);
    free(t->F);
    free(t->P);
    free(t->magnitude);
    free(t->order);
}

transport *transport_kept(int index) {
    static transport kept[TRANSPORTS];
    if (kept[index].op == NULL)
        kept[index] = transport_make((transport_kind)(index % TRANSPORT_KINDS), index >= TRANSPORT_KINDS);
    return &kept[index];
}

void transport_keep_all(void) {
    for (int i = 0; i < TRANSPORTS; i++) (void)transport_kept(i);
}

void transport_free_all(void) {
    for (int i = 0; i < TRANSPORTS; i++) {
        transport *t = transport_kept(i);
        transport_free(t);
        *t = (transport){.op = NULL};
    }
}

void quantity_row(lam_quantity quantity, float rho, double *direct, double *scale) {
    *direct = quantity == LAM_RADIOSITY ? 1.0 : 0.0;
    *scale = quantity == LAM_IRRADIANCE ? 1.0 / rho_or_one(rho) : rho > 0 ? 1.0 : 0.0;
}

float *random_vectors(size_t count, uint64_t seed) {
    float *x = test_allocate(count, sizeof *x);
    for (size_t i = 0; i < count; i++) x[i] = (float)(random_lcg_unit(&seed) * 2 - 0.999);
    return x;
}

float *transport_apply(const lam_operator *op, bool adjoint, size_t n_rhs, lam_quantity quantity,
                       const float *in) {
    lam_error error = {.message = ""};
    size_t count = n_rhs * lam_operator_channels(op) * lam_operator_elements(op);
    size_t work_bytes = lam_operator_work_bytes(op, n_rhs);
    void *work = malloc(work_bytes);
    float *out = test_allocate(count, sizeof *out);
    ck_assert_uint_gt(work_bytes, 0);
    memset(work, 0xff, work_bytes);
    for (size_t i = 0; i < count; i++) out[i] = NAN;
    lam_status status =
        adjoint ? lam_operator_apply_adjoint(op, n_rhs, quantity, in, out, work, work_bytes, &error)
                : lam_operator_apply(op, n_rhs, quantity, in, out, work, work_bytes, &error);
    ck_assert_msg(status == LAM_OK, "%s", error.message);
    free(work);
    return out;
}
