/* Suite reuse: the experiments of Castro et al. on the Cornell box: the light of 30 positions of a lamp by
 * paths of their own (A) and by paths that serve all positions (B, C, D, and E, ours); the bias of maps; and
 * the speed of walks beside that of Embree alone. */
#include "tests/bench/suites/reuse_runs.h"
#include "tests/bench/suites/scenes.h"

#include <math.h>
#include <omp.h>
#include <stdlib.h>

enum { WAYS = 6, UNEVEN = 4, FRAMES = 3, RESOLUTION = 64, EXPERIMENTS = 2, COUNTS = 4 };

static const char *const way_names[WAYS] = {"A, own paths",     "B, reused, rays",
                                            "C, reused, maps",  "D, reused, hemicubes",
                                            "B, uneven counts", "E, from lit elements"};
static const reuse_way ways[WAYS] = {REUSE_NONE,  REUSE_EXACT, REUSE_MAPS,
                                     REUSE_CUBES, REUSE_EXACT, REUSE_ELEMENTS};
/* Frames 1, 15 and 20 of the paper, from 0. */
static const size_t frames[FRAMES] = {0, 14, 19};
/* The lamp's part of the box's width. */
static const double lamp_size = .05;

/* Table 1: MSE of A over that of the others, frames 1 and 15, and the relative efficiencies of both; of
 * experiment 2 the relative efficiency of frame 20. */
static const double paper_ratio[WAYS][2] = {{1, 1},     {2.4, 6.3}, {2.5, 7.2},
                                            {2.2, 7.0}, {NAN, NAN}, {NAN, NAN}};
static const double paper_efficiency[WAYS][2] = {{1, 1},       {.61, 1.62}, {1.97, 5.64},
                                                 {2.21, 6.93}, {NAN, NAN},  {NAN, NAN}};
static const double paper_second[WAYS] = {1, 1.8, 7.9, 9.8, NAN, NAN};

static double mean_of(const double x[REUSE_POSITIONS]) {
    double sum = 0;
    for (size_t l = 0; l < REUSE_POSITIONS; l++) sum += x[l] / REUSE_POSITIONS;
    return sum;
}

static double largest_of(const double x[REUSE_POSITIONS]) {
    double most = 0;
    for (size_t l = 0; l < REUSE_POSITIONS; l++) most = fmax(most, x[l]);
    return most;
}

static void add_row(int experiment, const mesh *m, size_t paths, int way, const reuse_verdict v[WAYS],
                    table *out) {
    const reuse_verdict *own = &v[0], *of = &v[way];
    /* The paper counts l rays of a path, and 29 for visibility, of which those that find nothing in the way
     * are 1/1.3 of the others. */
    const double law = ways[way] == REUSE_EXACT ? 1 / (1 + (REUSE_POSITIONS - 1) / (1.3 * of->rays)) : NAN;
    table_number(out, experiment + 1);
    table_number(out, (double)m->n);
    table_number(out, (double)paths);
    table_text(out, way_names[way]);
    table_number(out, of->rays);
    table_number(out, of->seconds);
    table_number(out, of->maps);
    table_number(out, of->trace);
    table_number(out, of->reuse);
    table_number(out, of->reuse / of->trace);
    for (int f = 0; f < FRAMES; f++) table_number(out, of->mse[frames[f]]);
    for (int f = 0; f < FRAMES; f++) table_number(out, own->mse[frames[f]] / of->mse[frames[f]]);
    table_number(out, mean_of(own->mse) / mean_of(of->mse));
    table_number(out, largest_of(own->mse) / largest_of(of->mse));
    for (int f = 0; f < FRAMES; f++)
        table_number(out, own->seconds * own->mse[frames[f]] / (of->seconds * of->mse[frames[f]]));
    for (int f = 0; f < FRAMES; f++) table_number(out, law * own->mse[frames[f]] / of->mse[frames[f]]);
    for (int f = 0; f < FRAMES; f++) table_number(out, of->bias[frames[f]] / of->mse[frames[f]]);
    table_number(out, own->flicker / of->flicker);
    table_number(out, own->flicker / (of->flicker + of->flicker_bias));
    for (int f = 0; f < 2; f++) table_number(out, experiment == 0 ? paper_ratio[way][f] : NAN);
    for (int f = 0; f < 2; f++) table_number(out, experiment == 0 ? paper_efficiency[way][f] : NAN);
    table_number(out, experiment == 1 ? paper_second[way] : NAN);
}

static lam_status measure(const bench_run *run, int experiment, const mesh *m, const walk_scene *s,
                          table *out, lam_error *error) {
    static const size_t paths[3][COUNTS] = {
        {160, 640, 0, 0}, {800, 3200, 12800, 51200}, {3200, 12800, 51200, 200000}};
    lam_status status = LAM_OK;
    moving_light l = {.n_corners = 0};
    reuse_answers exact = {.H = {NULL}};
    TRY(reuse_lamp(experiment, lamp_size, m, &l, error));
    for (int k = 0; k < COUNTS && paths[run->scale][k] > 0; k++) {
        static const int order[WAYS] = {1, 0, 2, 3, 4, 5}; /* the exact way first: others are judged by it */
        reuse_verdict v[WAYS];
        for (int o = 0; o < WAYS; o++) {
            const int w = order[o];
            const bool maps = ways[w] == REUSE_MAPS || ways[w] == REUSE_CUBES;
            const reuse_setting how = {.scene = s,
                                       .m = m,
                                       .light = &l,
                                       .way = ways[w],
                                       .even = w == UNEVEN,
                                       .paths = paths[run->scale][k],
                                       .resolution = RESOLUTION};
            TRY(reuse_try(run, &how, maps ? &exact : NULL, w == 1 ? &exact : NULL, &v[w], error));
        }
        reuse_answers_free(&exact);
        for (int w = 0; w < WAYS; w++) add_row(experiment, m, paths[run->scale][k], w, v, out);
        bench_say(run,
                  "experiment %d, %zu paths: B, C, D, E %.2g, %.2g, %.2g, %.2g times the efficiency of A in "
                  "frame 15",
                  experiment + 1, paths[run->scale][k],
                  v[0].seconds * v[0].mse[14] / (v[1].seconds * v[1].mse[14]),
                  v[0].seconds * v[0].mse[14] / (v[2].seconds * v[2].mse[14]),
                  v[0].seconds * v[0].mse[14] / (v[3].seconds * v[3].mse[14]),
                  v[0].seconds * v[0].mse[14] / (v[5].seconds * v[5].mse[14]));
    }
done:
    reuse_answers_free(&exact);
    moving_light_free(&l);
    return status;
}

static lam_status positions(const bench_run *run, const mesh *m, const walk_scene *s, lam_error *error) {
    static const table_column columns[] = {
        {"experiment", "", "1: a curve with changing orientation, 2: a diagonal below the ceiling"},
        {"elements", "", "n, Cornell box"},
        {"paths", "", "from each of 30 positions"},
        {"approach", NULL, "of the paper; uneven counts: paths of positions by a pilot; E: ours"},
        {"rays_per_path", "", "l, the first ray included"},
        {"seconds", "s", "processor time of all positions"},
        {"maps_s", "s", "of these: visibility maps (figure 10)"},
        {"trace_s", "s", "walks"},
        {"reuse_s", "s", "weights of all positions, visibility included (figure 10)"},
        {"reuse_part", "", "of the time of walks"},
        {"variance_1", "", "mean square error without bias, frame 1 (figure 9)"},
        {"variance_15", "", "frame 15 (figure 9)"},
        {"variance_20", "", "frame 20"},
        {"mse_1", "", "MSE of A over this one's, frame 1, both without bias"},
        {"mse_15", "", "frame 15"},
        {"mse_20", "", "frame 20"},
        {"mse_mean", "", "of the means over all frames"},
        {"mse_largest", "", "of the largest of all frames"},
        {"efficiency_1", "", "time x MSE of A over this one's, frame 1"},
        {"efficiency_15", "", "frame 15"},
        {"efficiency_20", "", "frame 20"},
        {"law_1", "", "mse_1 / (1 + 29 / (1.3 l)): the efficiency that the rays of B would give"},
        {"law_15", "", "frame 15"},
        {"law_20", "", "frame 20"},
        {"bias_1", "", "square of the bias over MSE, frame 1"},
        {"bias_15", "", "frame 15"},
        {"bias_20", "", "frame 20"},
        {"flicker", "", "variance of differences of neighbouring frames, A over this one"},
        {"flicker_biased", "", "the same, with the bias of this one"},
        {"paper_mse_1", "", "table 1"},
        {"paper_mse_15", "", "table 1"},
        {"paper_efficiency_1", "", "table 1"},
        {"paper_efficiency_15", "", "table 1"},
        {"paper_efficiency_20", "", "of experiment 2"}};
    lam_status status = LAM_OK;
    table out = {.name = "positions",
                 .title = "Light of 30 positions of a lamp by reused paths (Castro et al., table 1)",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    for (int experiment = 0; experiment < EXPERIMENTS; experiment++)
        TRY(measure(run, experiment, m, s, &out, error));
    TRY(bench_table(run, &out, error));
done:
    table_free(&out);
    return status;
}

static void add_bias(double size, size_t resolution, int way, const reuse_verdict *exact,
                     const reuse_verdict *v, table *out) {
    table_number(out, size);
    table_number(out, (double)resolution);
    table_text(out, way_names[way]);
    table_number(out, v->maps);
    for (int f = 0; f < 2; f++) {
        const size_t at = frames[f];
        table_number(out, v->mse[at] / exact->mse[at]);
        table_number(out, (v->mse[at] + v->bias[at]) / exact->mse[at]);
    }
    table_number(out, mean_of(v->bias));
    table_number(out, sqrt(mean_of(v->bias) / mean_of(exact->mse)));
}

/* The bias of C and D by resolution and by the size of the lamp. */
static lam_status maps(const bench_run *run, const mesh *m, const walk_scene *s, lam_error *error) {
    enum { SIZES = 3, RESOLUTIONS = 5 };
    static const table_column columns[] = {{"lamp", "", "its part of the width of the box"},
                                           {"resolution", "", "cells along the side of a map"},
                                           {"approach", NULL, "of the paper"},
                                           {"maps_s", "s", "building of all maps"},
                                           {"mse_1", "", "MSE without bias over that of B, frame 1"},
                                           {"biased_1", "", "the same with the bias"},
                                           {"mse_15", "", "frame 15"},
                                           {"biased_15", "", "frame 15"},
                                           {"bias", "", "square of the bias, mean over frames"},
                                           {"bias_of_error", "", "bias over the standard error of B"}};
    static const double sizes[SIZES] = {.05, .0125, .2};
    static const size_t cells[RESOLUTIONS] = {16, 64, 32, 128, 256}, paths[3] = {640, 12800, 51200};
    const bool quick = run->scale == BENCH_QUICK;
    lam_status status = LAM_OK;
    moving_light l = {.n_corners = 0};
    reuse_answers exact = {.H = {NULL}};
    table out = {.name = "maps",
                 .title = "Bias of visibility maps by resolution and size of the lamp",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    for (int k = 0; k < (quick ? 1 : SIZES); k++) {
        reuse_verdict of_exact, v;
        TRY(reuse_lamp(0, sizes[k], m, &l, error));
        reuse_setting how = {.scene = s, .m = m, .light = &l, .way = REUSE_EXACT, .paths = paths[run->scale]};
        TRY(reuse_try(run, &how, NULL, &exact, &of_exact, error));
        for (int w = 2; w < 4; w++)
            for (int c = 0; c < (quick ? 2 : RESOLUTIONS); c++) {
                how.way = ways[w];
                how.resolution = cells[c];
                TRY(reuse_try(run, &how, &exact, NULL, &v, error));
                add_bias(sizes[k], cells[c], w, &of_exact, &v, &out);
            }
        reuse_answers_free(&exact);
        moving_light_free(&l);
    }
    TRY(bench_table(run, &out, error));
done:
    reuse_answers_free(&exact);
    moving_light_free(&l);
    table_free(&out);
    return status;
}

/* The walks of A, and their rays again by Embree alone; the best of several passes of each. */
static lam_status add_speed(const bench_run *run, const char *name, const mesh *m, const walk_scene *s,
                            table *out, lam_error *error) {
    enum { PASSES = 3 };
    static const size_t paths[3] = {1600, 25600, 102400};
    lam_status status = LAM_OK;
    moving_light l = {.n_corners = 0};
    reuse_estimates e = {.n = 0};
    walk_log log = {.capacity = paths[run->scale]};
    double walks = INFINITY, bare = INFINITY, rays = 0;
    log.packets = memory_allocate(log.capacity, sizeof *log.packets, "rays", error);
    if (log.packets == NULL) TRY(LAM_ERR_MEMORY);
    TRY(reuse_lamp(0, lamp_size, m, &l, error));
    for (int pass = 0; pass < PASSES; pass++) {
        double seconds;
        const reuse_problem problem = {.light = &l,
                                       .way = REUSE_NONE,
                                       .paths = paths[run->scale],
                                       .seed = run->seed,
                                       .log = &log,
                                       .progress = run->progress,
                                       .stage = "paths"};
        reuse_estimates_free(&e);
        log.count = 0;
        TRY(walk_reuse(s, &problem, &e, error));
        TRY(walk_log_bare_seconds(s, &log, &seconds, error));
        rays = e.rays;
        walks = fmin(walks, e.trace_seconds / ((double)e.paths * REUSE_POSITIONS * e.rays));
        bare = fmin(bare, seconds / ((double)log.count * VISIBILITY_PACKET));
    }
    table_text(out, name);
    table_number(out, (double)m->n);
    table_number(out, omp_get_max_threads());
    table_number(out, rays);
    table_number(out, 1e-6 / (walks * rays));
    table_number(out, walks * 1e9);
    table_number(out, bare * 1e9);
    table_number(out, bare / walks);
done:
    reuse_estimates_free(&e);
    moving_light_free(&l);
    free(log.packets);
    return status;
}

static lam_status speed(const bench_run *run, const mesh *cornell, const walk_scene *s, lam_error *error) {
    static const table_column columns[] = {
        {"scene", NULL, "scene"},
        {"elements", "", "n"},
        {"threads", "", "of both"},
        {"rays_per_path", "", "l"},
        {"mpaths_per_s", "1/s", "millions of paths of approach A a second of one processor"},
        {"walk_ns", "ns", "processor time of a ray of these, with all that its walk does"},
        {"bare_ns", "ns", "of the same ray in a loop over Embree's packets of 8"},
        {"ratio", "", "speed of walks over that of the bare loop"}};
    lam_status status = LAM_OK;
    mesh room = {0};
    walk_scene *walks = NULL;
    table out = {.name = "speed",
                 .title = "Rays of walks beside Embree alone",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    TRY(add_speed(run, "cornell", cornell, s, &out, error));
    if (run->scene != NULL)
        TRY(scene_file(run->scene, &room, error));
    else
        TRY(scene_furnished(&room, error));
    TRY(walk_scene_create(&room, CLOSURE_MEASURED, &walks, error));
    TRY(add_speed(run, run->scene != NULL ? run->scene : "furnished", &room, walks, &out, error));
    TRY(bench_table(run, &out, error));
done:
    walk_scene_free(walks);
    mesh_free(&room);
    table_free(&out);
    return status;
}

lam_status bench_reuse(const bench_run *run, lam_error *error) {
    static const size_t elements[3] = {150, 1500, 2560};
    lam_status status = LAM_OK;
    mesh m = {0};
    walk_scene *s = NULL;
    TRY(scene_cornell(elements[run->scale], &m, error));
    TRY(walk_scene_create(&m, CLOSURE_MEASURED, &s, error));
    TRY(positions(run, &m, s, error));
    TRY(maps(run, &m, s, error));
    TRY(speed(run, &m, s, error));
done:
    walk_scene_free(s);
    mesh_free(&m);
    return status;
}
