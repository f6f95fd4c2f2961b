/* The sums over batches of reused paths: means, standard errors, and the covariance of positions, which
 * shared paths make correlated. */
#include "solver/walk/reuse_sums.h"

#include "solver/base/cpu.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Rows that go into the covariance together: one pass over it for all. Numbers of the covariances of groups
 * at most. */
enum { SUMS_ROWS = 8, SUMS_GROUPS_MOST = 1 << 18 };

#define CPU_KERNELS "solver/walk/reuse_sums_kernels.inc"
#include "solver/base/cpu_kernels.inc"

void reuse_deposit(size_t n, size_t s, size_t C, const walk_stream *w, const uint32_t *element,
                   const float *weight, double *later) {
    typedef void deposit(size_t, size_t, size_t, const walk_stream *, const uint32_t *, const float *,
                         double *);
    static deposit *const deposits[] = CPU_TABLE(deposit_portable, deposit_avx2, deposit_avx512);
    deposits[cpu_best()](n, s, C, w, element, weight, later);
}

void reuse_sums_free(reuse_sums *t) {
    free(t->gain);
    free(t->norm);
    free(t->mean);
    free(t->square);
    free(t->direct);
    free(t->covariance);
    free(t->means);
    free(t->group_area);
    free(t->deviation);
    free(t->left);
    free(t->right);
    free(t->black.of);
    *t = (reuse_sums){.s = 0};
}

size_t reuse_sums_groups(const mesh *m, size_t s) {
    return m->n_groups > 0 && s * s <= SUMS_GROUPS_MOST / m->n_groups ? m->n_groups * s * s : 0;
}

lam_status black_groups_find(const mesh *m, black_groups *out, lam_error *error) {
    bool *black = memory_allocate(m->n_groups, sizeof *black, "paths", error);
    if (black == NULL) return LAM_ERR_MEMORY;
    *out = (black_groups){.of = black, .all = true};
    for (size_t g = 0; g < m->n_groups; g++) black[g] = true;
    for (size_t k = 0; k < m->n * m->n_channels; k++)
        if (m->reflectance[k] > 0) black[m->group[k % m->n]] = out->all = false;
    return LAM_OK;
}

static size_t group_of(const reuse_sums *t, size_t element) {
    return t->groups > 1 ? t->m->group[element] : 0;
}

lam_status reuse_sums_create(const mesh *m, const moving_light *light, bool shared, reuse_sums *out,
                             lam_error *error) {
    const size_t s = light->n, size = m->n * m->n_channels * s;
    reuse_sums t = {.m = m, .light = light, .s = s, .shared = shared};
    t.gain = memory_allocate(m->n, m->n_channels * sizeof *t.gain, "paths", error);
    t.norm = memory_allocate(m->n, m->n_channels * sizeof *t.norm, "paths", error);
    t.mean = memory_allocate(size, sizeof *t.mean, "paths", error);
    t.square = memory_allocate(size, sizeof *t.square, "paths", error);
    t.direct = memory_allocate(m->n, s * sizeof *t.direct, "paths", error);
    t.groups = reuse_sums_groups(m, s) > 0 ? m->n_groups : 1;
    t.covariance = memory_allocate(t.groups, s * s * sizeof *t.covariance, "paths", error);
    t.means = memory_allocate(t.groups, s * s * sizeof *t.means, "paths", error);
    t.group_area = memory_allocate(t.groups, sizeof *t.group_area, "paths", error);
    t.deviation = memory_allocate(t.groups, m->n_channels * s * sizeof *t.deviation, "paths", error);
    t.left = memory_allocate(SUMS_ROWS, s * sizeof *t.left, "paths", error);
    t.right = memory_allocate(SUMS_ROWS, s * sizeof *t.right, "paths", error);
    if (t.gain == NULL || t.norm == NULL || t.mean == NULL || t.square == NULL || t.direct == NULL ||
        t.covariance == NULL || t.means == NULL || t.group_area == NULL || t.deviation == NULL ||
        t.left == NULL || t.right == NULL) {
        reuse_sums_free(&t);
        return LAM_ERR_MEMORY;
    }
    if (black_groups_find(m, &t.black, error) != LAM_OK) {
        reuse_sums_free(&t);
        return LAM_ERR_MEMORY;
    }
    for (size_t i = 0; i < m->n; i++)
        for (size_t c = 0; c < m->n_channels; c++) {
            const double rho = reuse_reflectance(m, &t.black, t.groups > 1, c, i);
            t.gain[i * m->n_channels + c] = light->emission[c] * light->area / m->area[i];
            t.norm[i * m->n_channels + c] = m->area[i] * rho * rho;
        }
    for (size_t i = 0; i < m->n; i++) t.group_area[group_of(&t, i)] += m->area[i];
    *out = t;
    return LAM_OK;
}

/* The batch's deviations of the means of groups. */
static void add_means(reuse_sums *t) {
    const size_t s = t->s, C = t->m->n_channels;
    const double step = 1 / (double)t->batches;
    for (size_t g = 0; g < t->groups; g++)
        for (size_t c = 0; c < C; c++) {
            const double *d = t->deviation + (g * C + c) * s;
            const double factor = (1 - step) / (t->group_area[g] * t->group_area[g]);
            double *const K = t->means + g * s * s;
            for (size_t j = 0; j < s; j++)
                for (size_t l = j; l < s && t->shared; l++) K[j * s + l] += factor * d[j] * d[l];
            for (size_t l = 0; l < s && !t->shared; l++) K[l * s + l] += factor * d[l] * d[l];
        }
    memset(t->deviation, 0, t->groups * C * s * sizeof *t->deviation);
}

static void add_alone(reuse_sums *t, const double *sum) {
    const size_t n = t->m->n, C = t->m->n_channels;
    const double step = 1 / (double)t->batches;
    for (size_t l = 0; l < t->s; l++) {
        double *const mean = t->mean + l * n * C, *const square = t->square + l * n * C;
        double *const direct = t->direct + l * n;
        for (size_t i = 0; i < n; i++) {
            const size_t g = group_of(t, i);
            const double *const of = sum + (l * n + i) * (C + 1);
            double spread = 0;
            direct[i] += of[0];
            for (size_t k = i * C; k < (i + 1) * C; k++) {
                const double off = t->gain[k] * (of[0] + of[1 + k - i * C]) - mean[k];
                const double more = (1 - step) * off * off;
                mean[k] += step * off;
                square[k] += more;
                spread += t->norm[k] * more;
                t->deviation[(g * C + k - i * C) * t->s + l] += sqrt(t->norm[k] * t->m->area[i]) * off;
            }
            t->covariance[(g * t->s + l) * t->s + l] += spread;
        }
    }
}

typedef void outer(size_t, const double *, const double *, double *);

/* The rows that wait go into the covariance of a group. */
static void add_rows(reuse_sums *t, outer *product, size_t group, size_t *rows) {
    const size_t s = t->s;
    if (*rows == 0) return;
    memset(t->left + *rows * s, 0, (SUMS_ROWS - *rows) * s * sizeof *t->left);
    product(s, t->left, t->right, t->covariance + group * s * s);
    *rows = 0;
}

static void add_shared(reuse_sums *t, const double *first, const double *later) {
    typedef void move_mean(size_t, double, double, const double *, const double *, double *, double *,
                           double *);
    static move_mean *const moves[] = CPU_TABLE(move_portable, move_avx2, move_avx512);
    static outer *const outers[] = CPU_TABLE(outer_portable, outer_avx2, outer_avx512);
    const cpu_level level = cpu_best();
    const mesh *m = t->m;
    const size_t s = t->s, C = m->n_channels;
    const double step = 1 / (double)t->batches;
    size_t rows = 0, group = 0;
    for (size_t i = 0; i < m->n; i++) {
        const size_t own = group_of(t, i);
        if (own != group) add_rows(t, outers[level], group, &rows);
        group = own;
        for (size_t l = 0; l < s; l++) t->direct[i * s + l] += first[i * s + l];
        for (size_t c = 0; c < C; c++) {
            const size_t at = (i * C + c) * s;
            const double factor = t->norm[i * C + c] * (1 - step);
            double *const left = t->left + rows * s, *const right = t->right + rows * s;
            moves[level](s, t->gain[i * C + c], step, first + i * s, later + at, t->mean + at, t->square + at,
                         right);
            double *const deviation = t->deviation + (group * C + c) * s;
            const double share = sqrt(t->norm[i * C + c] * m->area[i]);
            for (size_t l = 0; l < s; l++) left[l] = factor * right[l];
            for (size_t l = 0; l < s; l++) deviation[l] += share * right[l];
            if (++rows == SUMS_ROWS) add_rows(t, outers[level], group, &rows);
        }
    }
    add_rows(t, outers[level], group, &rows);
}

void reuse_sums_add(reuse_sums *t, const double *first, const double *later) {
    t->batches++;
    if (t->shared)
        add_shared(t, first, later);
    else
        add_alone(t, first);
    add_means(t);
}

void reuse_sums_end(const reuse_sums *t, reuse_estimates *e) {
    const size_t n = e->n, C = e->n_channels, s = t->s;
    const double batches = (double)t->batches, of_mean = 1 / (batches * (batches - 1));
    for (size_t i = 0; i < n; i++) {
        for (size_t l = 0; l < s; l++) {
            const double sum = t->direct[t->shared ? i * s + l : l * n + i];
            e->direct[l * n + i] = (float)(sum * t->light->area / (t->m->area[i] * batches));
        }
        for (size_t c = 0; c < C; c++)
            for (size_t l = 0; l < s; l++) {
                const size_t from = t->shared ? (i * C + c) * s + l : (l * n + i) * C + c,
                             to = (c * s + l) * n + i;
                e->H[to] = (float)t->mean[from];
                e->error[to] = (float)sqrt(t->square[from] * of_mean);
            }
    }
    memset(e->covariance, 0, s * s * sizeof *e->covariance);
    for (size_t g = 0; g < t->groups; g++)
        for (size_t j = 0; j < s; j++)
            for (size_t l = j; l < s; l++) {
                const size_t from = (g * s + j) * s + l, mirror = (g * s + l) * s + j;
                const double own = t->covariance[from] * of_mean;
                if (t->black.all || t->groups == 1 || !t->black.of[g]) e->covariance[j * s + l] += own;
                e->covariance[l * s + j] = e->covariance[j * s + l];
                if (e->of_groups == NULL) continue;
                e->of_groups[from] = e->of_groups[mirror] = own;
                e->of_means[from] = e->of_means[mirror] = t->means[from] * of_mean;
            }
}
