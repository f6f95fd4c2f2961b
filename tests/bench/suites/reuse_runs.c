#include "tests/bench/suites/reuse_runs.h"

#include "solver/base/clock.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void pose_of(int experiment, size_t k, const double low[3], const double high[3], light_pose *p) {
    const double t = (double)k / (REUSE_POSITIONS - 1), a = M_PI * t;
    const double turned = experiment == 0 ? .5 * (a - M_PI / 2) : 0;
    const double part[3] = {experiment == 0 ? .5 - .3 * cos(a) : .2 + .6 * t,
                            experiment == 0 ? .5 : .2 + .6 * t, experiment == 0 ? .6 + .25 * sin(a) : .95};
    const double turn[3][3] = {{cos(turned), 0, -sin(turned)}, {0, 1, 0}, {sin(turned), 0, cos(turned)}};
    memcpy(p->turn, turn, sizeof turn);
    for (int d = 0; d < 3; d++) p->move[d] = low[d] + part[d] * (high[d] - low[d]);
}

lam_status reuse_lamp(int experiment, double size, const mesh *m, moving_light *out, lam_error *error) {
    static const double square[4][2] = {{-1, -1}, {-1, 1}, {1, 1}, {1, -1}};
    lam_status status = LAM_OK;
    double low[3], high[3];
    moving_light l = {.n_corners = 0};
    mesh_box(m, low, high);
    double(*corner)[3] = memory_allocate(4, sizeof *corner, "lamp", error);
    if (corner == NULL) return LAM_ERR_MEMORY;
    for (int k = 0; k < 4; k++)
        for (int d = 0; d < 2; d++) corner[k][d] = square[k][d] * .5 * size * (high[0] - low[0]);
    TRY(moving_light_create(4, corner, &l, error));
    l.pose = memory_allocate(REUSE_POSITIONS, sizeof *l.pose, "lamp", error);
    if (l.pose == NULL) TRY(LAM_ERR_MEMORY);
    l.n = REUSE_POSITIONS;
    for (size_t k = 0; k < REUSE_POSITIONS; k++) {
        pose_of(experiment, k, low, high, &l.pose[k]);
        if (asprintf(&l.pose[k].name, "frame %zu", k + 1) < 0) {
            l.pose[k].name = NULL;
            FAIL(error, LAM_ERR_MEMORY, "lamp: out of memory");
        }
    }
    for (size_t c = 0; c < MOVING_LIGHT_CHANNELS; c++) l.emission[c] = 1;
    *out = l;
    l = (moving_light){.n_corners = 0};
done:
    moving_light_free(&l);
    return status;
}

void reuse_answers_free(reuse_answers *a) {
    for (int r = 0; r < REUSE_RUNS; r++) free(a->H[r]);
    *a = (reuse_answers){.H = {NULL}};
}

/* The sum over the runs of d and d^2, where d is the difference of an answer from the exact one. */
typedef struct differences {
    double sum, square;
} differences;

static void differences_add(differences *d, double off) {
    d->sum += off;
    d->square += off * off;
}

/* The squared mean, without the part of it that the scatter of the runs has. */
static double squared_bias(const differences *d) {
    const double mean = d->sum / REUSE_RUNS;
    const double variance = (d->square / REUSE_RUNS - mean * mean) / (REUSE_RUNS - 1);
    return mean * mean - variance;
}

/* Biases of the positions and of the steps between them. */
static void judge_bias(const mesh *m, const reuse_answers *of, const reuse_answers *exact, double area,
                       reuse_verdict *v) {
    const size_t s = REUSE_POSITIONS, rows = m->n_channels * s;
    for (size_t row = 0; row < rows; row++)
        for (size_t i = 0; i < m->n; i++) {
            const size_t l = row % s, at = row * m->n + i;
            const double rho = (double)m->reflectance[row / s * m->n + i];
            differences here = {0, 0}, step = {0, 0};
            for (int r = 0; r < REUSE_RUNS; r++) {
                const double off = rho * ((double)of->H[r][at] - (double)exact->H[r][at]);
                differences_add(&here, off);
                if (l + 1 == s) continue;
                const size_t next = at + m->n;
                differences_add(&step, rho * ((double)of->H[r][next] - (double)exact->H[r][next]) - off);
            }
            v->bias[l] += m->area[i] * squared_bias(&here) / area;
            if (l + 1 < s) v->flicker_bias += m->area[i] * squared_bias(&step) / (area * (double)(s - 1));
        }
    for (size_t l = 0; l < s; l++) v->bias[l] = fmax(0, v->bias[l]);
    v->flicker_bias = fmax(0, v->flicker_bias);
}

/* Adds the variances of one run, which its covariance states. */
static void add_variances(const reuse_estimates *e, double area, reuse_verdict *v) {
    const size_t s = REUSE_POSITIONS;
    const double *K = e->covariance;
    for (size_t l = 0; l < s; l++) v->mse[l] += K[l * s + l] / (area * REUSE_RUNS);
    for (size_t l = 0; l + 1 < s; l++)
        v->flicker += (K[l * s + l] + K[(l + 1) * s + l + 1] - 2 * K[l * s + l + 1]) /
                      (area * REUSE_RUNS * (double)(s - 1));
}

lam_status reuse_try(const bench_run *run, const reuse_setting *how, const reuse_answers *exact,
                     reuse_answers *kept, reuse_verdict *out, lam_error *error) {
    lam_status status = LAM_OK;
    reuse_estimates e = {.n = 0};
    reuse_answers answers = {.H = {NULL}};
    reuse_verdict v = {.rays = 0};
    double area = 0;
    for (size_t i = 0; i < how->m->n; i++) area += how->m->area[i] * (double)how->m->n_channels;
    for (int r = 0; r < REUSE_RUNS; r++) {
        const reuse_problem problem = {.light = how->light,
                                       .way = how->way,
                                       .even = how->even,
                                       .paths = how->paths,
                                       .resolution = how->resolution,
                                       .seed = run->seed + 1 + (uint64_t)r,
                                       .progress = run->progress,
                                       .stage = "paths"};
        const double begun = clock_processor_seconds();
        TRY(bench_check(run, error));
        TRY(walk_reuse(how->scene, &problem, &e, error));
        v.seconds += (clock_processor_seconds() - begun) / REUSE_RUNS;
        v.maps += e.maps_seconds / REUSE_RUNS;
        v.trace += e.trace_seconds / REUSE_RUNS;
        v.reuse += e.reuse_seconds / REUSE_RUNS;
        v.rays += e.rays / REUSE_RUNS;
        add_variances(&e, area, &v);
        answers.H[r] = e.H;
        e.H = NULL;
        reuse_estimates_free(&e);
    }
    if (exact != NULL) judge_bias(how->m, &answers, exact, area, &v);
    if (kept != NULL) {
        *kept = answers;
        answers = (reuse_answers){.H = {NULL}};
    }
    *out = v;
done:
    reuse_estimates_free(&e);
    reuse_answers_free(&answers);
    return status;
}
