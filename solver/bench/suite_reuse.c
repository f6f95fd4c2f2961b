/* Suite reuse: the experiments of Castro et al. on the Cornell box: the light of 30 positions
 * of a lamp by paths of their own (A) and by paths that serve all positions (B, C, D). */
#include "solver/base/clock.h"
#include "solver/bench/bench.h"
#include "solver/bench/scenes.h"
#include "solver/walk/reuse.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { POSITIONS = 30, WAYS = 4, FRAMES = 3, RUNS = 4, RESOLUTION = 64, EXPERIMENTS = 2 };

static const char *const way_names[WAYS] = {"A, own paths", "B, reused, rays", "C, reused, maps",
                                            "D, reused, hemicubes"};
static const reuse_way ways[WAYS] = {REUSE_NONE, REUSE_EXACT, REUSE_MAPS, REUSE_CUBES};
/* Frames 1, 15 and 20 of the paper, from 0. */
static const size_t frames[FRAMES] = {0, 14, 19};

/* Table 1: MSE of A over that of the others, frames 1 and 15, and the relative efficiencies of both; of
 * experiment 2 the relative efficiency of one frame. */
static const double paper_ratio[WAYS][2] = {{1, 1}, {2.4, 6.3}, {2.5, 7.2}, {2.2, 7.0}};
static const double paper_efficiency[WAYS][2] = {{1, 1}, {.61, 1.62}, {1.97, 5.64}, {2.21, 6.93}};
static const double paper_second[WAYS] = {1, 1.8, 7.9, 9.8};

/* The box around a mesh. */
static void bounds(const mesh *m, double low[3], double high[3]) {
    for (int d = 0; d < 3; d++) {
        low[d] = INFINITY;
        high[d] = -INFINITY;
    }
    for (size_t v = 0; v < m->n_vertices; v++)
        for (int d = 0; d < 3; d++) {
            low[d] = fmin(low[d], m->vertices[v][d]);
            high[d] = fmax(high[d], m->vertices[v][d]);
        }
}

/* Experiment 0: half an ellipse through the upper half of the box, x = 1/2 - .3 cos a, z = .6 + .25 sin a for
 * a from 0 to pi, in parts of the box, while the lamp turns by a - pi/2 about y, so that it looks away from
 * the middle of the curve's ends. Experiment 1: a diagonal at z = .95, looking down. */
static void pose_of(int experiment, size_t k, const double low[3], const double high[3], light_pose *p) {
    const double t = (double)k / (POSITIONS - 1), a = M_PI * t;
    const double turned = experiment == 0 ? .5 * (a - M_PI / 2) : 0;
    const double part[3] = {experiment == 0 ? .5 - .3 * cos(a) : .2 + .6 * t,
                            experiment == 0 ? .5 : .2 + .6 * t, experiment == 0 ? .6 + .25 * sin(a) : .95};
    const double turn[3][3] = {{cos(turned), 0, -sin(turned)}, {0, 1, 0}, {sin(turned), 0, cos(turned)}};
    memcpy(p->turn, turn, sizeof turn);
    for (int d = 0; d < 3; d++) p->move[d] = low[d] + part[d] * (high[d] - low[d]);
}

/* A square of a twentieth of the box that looks down, at 30 positions. */
static lam_status lamp(int experiment, const mesh *m, moving_light *out, lam_error *error) {
    static const double square[4][2] = {{-1, -1}, {-1, 1}, {1, 1}, {1, -1}};
    lam_status status = LAM_OK;
    double low[3], high[3];
    moving_light l = {.n_corners = 0};
    bounds(m, low, high);
    double(*corner)[3] = memory_allocate(4, sizeof *corner, "lamp", error);
    if (corner == NULL) return LAM_ERR_MEMORY;
    for (int k = 0; k < 4; k++)
        for (int d = 0; d < 2; d++) corner[k][d] = square[k][d] * .025 * (high[0] - low[0]);
    TRY(moving_light_create(4, corner, &l, error));
    l.pose = memory_allocate(POSITIONS, sizeof *l.pose, "lamp", error);
    if (l.pose == NULL) TRY(LAM_ERR_MEMORY);
    l.n = POSITIONS;
    for (size_t k = 0; k < POSITIONS; k++) {
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

/* Radiosity B = rho H of channel 0, frame k, element i. */
static double radiosity(const mesh *m, const reuse_estimates *e, size_t k, size_t i) {
    return (double)m->reflectance[i] * (double)e->H[k * m->n + i];
}

/* The figures of several runs of one way. */
typedef struct verdict {
    double seconds, maps, trace, reuse, rays; /* means of a run; processor seconds */
    double mse[FRAMES], bias[FRAMES];         /* mean squares over the area: without the bias, and of it */
    double flicker; /* mean square of what differences of neighbouring frames are off by */
} verdict;

/* Mean squares over the area of mean - truth, and of the runs around their mean. sum, square: [POSITIONS][n]
 * of B over the runs. */
static void judge(const mesh *m, size_t runs, const double *sum, const double *square,
                  const reuse_estimates *truth, verdict *out) {
    double area = 0;
    for (size_t i = 0; i < m->n; i++) area += m->area[i];
    for (int f = 0; f < FRAMES; f++) {
        double spread = 0, off = 0;
        for (size_t i = 0; i < m->n; i++) {
            const size_t k = frames[f] * m->n + i;
            const double mean = sum[k] / (double)runs;
            const double variance =
                fmax(0, square[k] / (double)runs - mean * mean) * (double)runs / ((double)runs - 1);
            const double wrong = mean - radiosity(m, truth, frames[f], i);
            spread += m->area[i] * variance;
            off += m->area[i] * (wrong * wrong - variance / (double)runs);
        }
        out->mse[f] = spread / area;
        out->bias[f] = fmax(0, off / area);
    }
}

/* Frame differences of one run beside those of the truth. */
static double flicker_of(const mesh *m, const reuse_estimates *e, const reuse_estimates *truth) {
    double off = 0, area = 0;
    for (size_t i = 0; i < m->n; i++) area += m->area[i];
    for (size_t k = 0; k + 1 < POSITIONS; k++)
        for (size_t i = 0; i < m->n; i++) {
            const double step = radiosity(m, e, k + 1, i) - radiosity(m, e, k, i),
                         right = radiosity(m, truth, k + 1, i) - radiosity(m, truth, k, i);
            off += m->area[i] * (step - right) * (step - right);
        }
    return off / (area * (POSITIONS - 1));
}

static lam_status try_way(const bench_run *run, const walk_scene *s, const mesh *m, const moving_light *l,
                          reuse_way way, size_t paths, const reuse_estimates *truth, verdict *out,
                          lam_error *error) {
    lam_status status = LAM_OK;
    reuse_estimates e = {.n = 0};
    verdict v = {.rays = 0};
    double *sum = memory_allocate(POSITIONS, m->n * sizeof *sum, "runs", error);
    double *square = memory_allocate(POSITIONS, m->n * sizeof *square, "runs", error);
    if (sum == NULL || square == NULL) TRY(LAM_ERR_MEMORY);
    for (uint64_t r = 0; r < RUNS; r++) {
        const reuse_problem problem = {.light = l,
                                       .way = way,
                                       .paths = paths,
                                       .resolution = RESOLUTION,
                                       .seed = run->seed + 1 + r,
                                       .progress = run->progress,
                                       .stage = "paths"};
        const double begun = clock_processor_seconds();
        TRY(bench_check(run, error));
        TRY(walk_reuse(s, &problem, &e, error));
        v.seconds += (clock_processor_seconds() - begun) / RUNS;
        v.maps += e.maps_seconds / RUNS;
        v.trace += e.trace_seconds / RUNS;
        v.reuse += e.reuse_seconds / RUNS;
        v.rays += e.rays / RUNS;
        v.flicker += flicker_of(m, &e, truth) / RUNS;
        for (size_t k = 0; k < POSITIONS; k++)
            for (size_t i = 0; i < m->n; i++) {
                const double B = radiosity(m, &e, k, i);
                sum[k * m->n + i] += B;
                square[k * m->n + i] += B * B;
            }
        reuse_estimates_free(&e);
    }
    judge(m, RUNS, sum, square, truth, &v);
    *out = v;
done:
    reuse_estimates_free(&e);
    free(sum);
    free(square);
    return status;
}

static void add_row(int experiment, const mesh *m, size_t paths, int way, const verdict v[WAYS], table *out) {
    const verdict *own = &v[0], *of = &v[way];
    table_number(out, experiment + 1);
    table_number(out, (double)m->n);
    table_number(out, (double)paths);
    table_text(out, way_names[way]);
    table_number(out, of->rays);
    table_number(out, of->seconds);
    table_number(out, of->maps);
    table_number(out, of->trace);
    table_number(out, of->reuse);
    for (int f = 0; f < FRAMES; f++) table_number(out, own->mse[f] / of->mse[f]);
    for (int f = 0; f < FRAMES; f++)
        table_number(out, own->seconds * own->mse[f] / (of->seconds * of->mse[f]));
    for (int f = 0; f < FRAMES; f++) table_number(out, of->bias[f] / of->mse[f]);
    table_number(out, own->flicker / of->flicker);
    for (int f = 0; f < 2; f++) table_number(out, experiment == 0 ? paper_ratio[way][f] : NAN);
    for (int f = 0; f < 2; f++)
        table_number(out, experiment == 0 ? paper_efficiency[way][f] : f == 1 ? paper_second[way] : NAN);
}

static lam_status measure(const bench_run *run, int experiment, const mesh *m, const walk_scene *s,
                          table *out, lam_error *error) {
    static const size_t paths[3][2] = {{640, 0}, {12800, 51200}, {51200, 200000}};
    enum { TRUTH = 16 }; /* times the paths of a run */
    lam_status status = LAM_OK;
    moving_light l = {.n_corners = 0};
    reuse_estimates truth = {.n = 0};
    TRY(lamp(experiment, m, &l, error));
    for (int k = 0; k < 2 && paths[run->scale][k] > 0; k++) {
        const size_t count = paths[run->scale][k];
        verdict v[WAYS];
        const reuse_problem many = {.light = &l,
                                    .way = REUSE_EXACT,
                                    .paths = TRUTH * count,
                                    .seed = run->seed,
                                    .progress = run->progress,
                                    .stage = "reference"};
        reuse_estimates_free(&truth);
        TRY(walk_reuse(s, &many, &truth, error));
        for (int w = 0; w < WAYS; w++) TRY(try_way(run, s, m, &l, ways[w], count, &truth, &v[w], error));
        for (int w = 0; w < WAYS; w++) add_row(experiment, m, count, w, v, out);
        bench_say(run, "experiment %d, %zu paths: B %.2g times the efficiency of A in frame 15",
                  experiment + 1, count, v[0].seconds * v[0].mse[1] / (v[1].seconds * v[1].mse[1]));
    }
done:
    reuse_estimates_free(&truth);
    moving_light_free(&l);
    return status;
}

lam_status bench_reuse(const bench_run *run, lam_error *error) {
    static const table_column columns[] = {
        {"experiment", "", "1: a curve with changing orientation, 2: a diagonal below the ceiling"},
        {"elements", "", "n, Cornell box"},
        {"paths", "", "from each of 30 positions"},
        {"approach", NULL, "of the paper"},
        {"rays_per_path", "", "l, the first ray included"},
        {"seconds", "s", "processor time of all positions"},
        {"maps_s", "s", "of these: visibility maps (figure 10)"},
        {"trace_s", "s", "walks"},
        {"reuse_s", "s", "weights of all positions, visibility included (figure 10)"},
        {"mse_1", "", "MSE of A over this one's, frame 1, both without bias"},
        {"mse_15", "", "frame 15"},
        {"mse_20", "", "frame 20"},
        {"efficiency_1", "", "time x MSE of A over this one's, frame 1"},
        {"efficiency_15", "", "frame 15"},
        {"efficiency_20", "", "frame 20"},
        {"bias_1", "", "square of the bias over MSE, frame 1: below about .3 it is noise"},
        {"bias_15", "", "frame 15"},
        {"bias_20", "", "frame 20"},
        {"flicker", "", "mean square error of differences of neighbouring frames, A over this one"},
        {"paper_mse_1", "", "table 1"},
        {"paper_mse_15", "", "table 1"},
        {"paper_efficiency_1", "", "table 1"},
        {"paper_efficiency_15", "", "table 1; of experiment 2 the frame that it gives"}};
    static const size_t elements[3] = {150, 1500, 2560};
    lam_status status = LAM_OK;
    mesh m = {0};
    walk_scene *s = NULL;
    table out = {.name = "positions",
                 .title = "Light of 30 positions of a lamp by reused paths (Castro et al., table 1)",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    TRY(scene_cornell(elements[run->scale], &m, error));
    TRY(walk_scene_create(&m, CLOSURE_MEASURED, &s, error));
    for (int experiment = 0; experiment < EXPERIMENTS; experiment++)
        TRY(measure(run, experiment, &m, s, &out, error));
    TRY(bench_table(run, &out, error));
done:
    walk_scene_free(s);
    mesh_free(&m);
    table_free(&out);
    return status;
}
