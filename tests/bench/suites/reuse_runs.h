/* Runs of the suite reuse: a lamp that moves through a scene, and what each way to its light costs and misses
 * by. */
#ifndef LAMBERT_BENCH_REUSE_RUNS_H
#define LAMBERT_BENCH_REUSE_RUNS_H

#include "solver/walk/reuse.h"
#include "tests/bench/suites/bench.h"

enum { REUSE_POSITIONS = 30, REUSE_RUNS = 4 };

/* A square lamp that looks down, with `size` of the width of the box around a mesh, at 30 positions.
 * Experiment 0: half an ellipse through the upper half of the box, x = 1/2 - .3 cos a, z = .6 + .25 sin a for
 * a from 0 to pi, in parts of the box, y in the middle, while the lamp turns by (a - pi/2) / 2 about y.
 * Experiment 1: a diagonal at z = .95 from (.2, .2) to (.8, .8), without a turn. Freed by moving_light_free.
 */
lam_status reuse_lamp(int experiment, double size, const mesh *m, moving_light *out, lam_error *error);

/* One way to the light of all positions. */
typedef struct reuse_setting {
    const walk_scene *scene;
    const mesh *m;
    const moving_light *light;
    reuse_way way;
    bool even;
    size_t paths, resolution;
} reuse_setting;

/* Means of REUSE_RUNS runs. Squares are those of the radiosity, of all channels, per channel and area. */
typedef struct reuse_verdict {
    double seconds, maps, trace, reuse, rays; /* processor seconds of a run; rays of a path */
    double mse[REUSE_POSITIONS];              /* variance, from the stated covariance */
    double bias[REUSE_POSITIONS];             /* squared, against the exact way and the same seeds */
    double flicker;                           /* variance of the step between neighbouring positions, mean */
    double flicker_bias;                      /* squared bias of that */
} reuse_verdict;

/* The irradiance of every run [REUSE_RUNS][C][s][n]: kept of the exact way to compare others with. */
typedef struct reuse_answers {
    float *H[REUSE_RUNS];
} reuse_answers;

void reuse_answers_free(reuse_answers *a);

/* exact: NULL, or the answers of REUSE_EXACT with the same light, paths and seeds, which the bias is judged
 * by; kept: NULL, or takes the answers of these runs. */
lam_status reuse_try(const bench_run *run, const reuse_setting *how, const reuse_answers *exact,
                     reuse_answers *kept, reuse_verdict *out, lam_error *error);

#endif
