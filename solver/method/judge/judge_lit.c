#include "solver/method/judge/judge_lit.h"

#include "solver/method/judge/judge_black.h"
#include "solver/method/judge/judge_round.h"

#include <stdlib.h>
#include <string.h>

void lit_probes_free(lit_probes *s) {
    for (int k = 0; k < 3; k++) {
        free(s->E[k]);
        free(s->direct[k]);
        free(s->x[k]);
    }
    free(s->B);
    *s = (lit_probes){.most = 0};
}

lam_status lit_probes_make(const judge_input *input, size_t most, lit_probes *out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t vector = input->problem->n * input->problem->n_channels;
    lit_probes s = {.most = most,
                    .twins = input->relation == REFERENCE_TWIN && input->other.n > 0,
                    .apart = input->relation != REFERENCE_TWIN && input->other.n > 0};
    s.B = memory_allocate(most, vector * sizeof *s.B, "skies", error);
    if (s.B == NULL) TRY(LAM_ERR_MEMORY);
    for (int k = 0; k < 3; k++) {
        s.E[k] = memory_allocate(most, vector * sizeof *s.E[k], "skies", error);
        s.x[k] = memory_allocate(most, vector * sizeof *s.x[k], "skies", error);
        if (s.E[k] == NULL || s.x[k] == NULL) TRY(LAM_ERR_MEMORY);
        if (input->black == NULL) continue;
        s.direct[k] = memory_allocate(most, vector * sizeof *s.direct[k], "skies", error);
        if (s.direct[k] == NULL) TRY(LAM_ERR_MEMORY);
    }
    *out = s;
    s = (lit_probes){.most = 0};
done:
    lit_probes_free(&s);
    return status;
}

void lit_probes_light(const judge_input *input, size_t count, const float *L, const float *first,
                      const float *const *row, float *E, float *direct) {
    const build_problem *p = input->problem;
    const size_t n = p->n, C = p->n_channels, m = input->sky->n_tiles;
#pragma omp parallel for schedule(static)
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < count * C; k++) {
            const float *close = row != NULL ? row[k / C] : NULL;
            double H = 0;
            for (size_t t = 0; t < m; t++) {
                const double l = (double)L[k * m + t];
                if (l != 0) H += l * (double)(close != NULL ? close[i] : first[t * n + i]);
            }
            E[k * n + i] += (float)(H * (double)p->reflectance[k % C * n + i]);
            if (direct != NULL) direct[k * n + i] = (float)H;
        }
}

void lit_probes_light_all(const judge_input *input, const float *L, const float *const *row[2],
                          lit_probes *s) {
    const judged_sky *sky = input->sky;
    lit_probes_light(input, s->count, L, sky->own, NULL, s->E[0], s->direct[0]);
    for (int k = 0; k < 2; k++)
        lit_probes_light(input, s->count, L, sky->samples[k], row[k], s->E[k + 1], s->direct[k + 1]);
}

typedef struct corrections {
    size_t n, n_channels;
    double *x;
} corrections;

static void keep(void *context, size_t v, size_t channel, const double *x) {
    const corrections *to = context;
    memcpy(to->x + (v * to->n_channels + channel) * to->n, x, to->n * sizeof *x);
}

/* x [count][C][n]: corrections of the answers to emission k by F. */
static lam_status solve(const lam_operator *op, const judge_input *input, const factor_product *F,
                        const lit_probes *s, int k, double *x, lam_error *error) {
    const build_problem *p = input->problem;
    const reference_system system = reference_system_of(input, F);
    const reference_answers answers = {
        .op = op, .E = s->E[k], .B = s->B, .direct = s->direct[k], .progress = input->progress};
    corrections to = {p->n, p->n_channels, x};
    size_t *all = memory_allocate(s->count, sizeof *all, "skies", error);
    if (all == NULL) return LAM_ERR_MEMORY;
    for (size_t v = 0; v < s->count; v++) all[v] = v;
    const lam_status status = guided_reference_each(&system, &answers, s->count, all, keep, &to, error);
    free(all);
    return status;
}

/* A correction is converged to some thousandths of itself, and a second one to as much of those. */
enum { CORRECTIONS = 2 };

lam_status lit_probes_answer(const lam_operator *op, const judge_input *input, lit_probes *s,
                             lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = input->problem->n, all = s->count * input->problem->n_channels * n;
    for (size_t k = 0; k < all; k++) s->B[k] = judge_is_black(input, k % n) ? s->direct[0][k] : s->E[0][k];
    for (int times = 0; times < CORRECTIONS; times++) {
        TRY(solve(op, input, &input->own, s, 0, s->x[0], error));
        for (size_t k = 0; k < all; k++) s->B[k] = (float)((double)s->B[k] + s->x[0][k]);
    }
done:
    return status;
}

lam_status lit_probes_solve(const lam_operator *op, const judge_input *input, lit_probes *s,
                            lam_error *error) {
    lam_status status = LAM_OK;
    const size_t all = s->count * input->problem->n_channels * input->problem->n;
    TRY(solve(op, input, &input->independent, s, 1, s->x[0], error));
    TRY(solve(op, input, s->twins ? &input->other : &input->independent, s, 2, s->x[1], error));
    for (size_t k = 0; k < all; k++) s->E[1][k] = .5f * (s->E[1][k] + s->E[2][k]);
    for (size_t k = 0; s->direct[1] != NULL && k < all; k++)
        s->direct[1][k] = .5f * (s->direct[1][k] + s->direct[2][k]);
    if (!s->apart) goto done;
    TRY(solve(op, input, &input->other, s, 1, s->x[2], error));
    for (size_t k = 0; k < all; k++) {
        const double x = s->x[0][k], y = s->x[1][k];
        s->x[0][k] = .5 * (x + y);
        s->x[1][k] = .5 * (x - y);
    }
done:
    return status;
}

figure_probe lit_probes_at(const judge_input *input, const lit_probes *s, size_t v) {
    const size_t at = v * input->problem->n * input->problem->n_channels;
    return (figure_probe){.problem = input->problem,
                          .E = s->E[1] + at,
                          .B = s->B + at,
                          .x = s->x[0] + at,
                          .y = s->x[s->apart ? 2 : 1] + at,
                          .noise = s->apart ? s->x[1] + at : NULL,
                          .black = input->black,
                          .all_black = input->all_black,
                          .direct = s->direct[1] != NULL ? s->direct[1] + at : NULL,
                          .relation = s->apart ? input->relation : REFERENCE_TWIN,
                          .other_share = input->other_share};
}
