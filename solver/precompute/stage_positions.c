/* The store of a moving light: an emitter for each of its positions, found by walks that need no form
 * factors (solver/walk/reuse.h). */
#include "solver/base/clock.h"
#include "solver/light/light_path.h"
#include "solver/method/emitters_options.h"
#include "solver/operator/emitters.h"
#include "solver/precompute/stages.h"

#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Cells along the side of a map (C), and pixels along the top of a hemicube (D). */
enum { MAP_CELLS = 256, CUBE_PIXELS = 256 };

/* A grey scene under a coloured light has the channels of the light. */
static lam_status take_colours(mesh *m, lam_error *error) {
    float **const arrays[] = {&m->reflectance, &m->emission};
    if (m->n_channels != 1) return LAM_OK;
    for (size_t k = 0; k < 2; k++) {
        float *wide = memory_allocate(MOVING_LIGHT_CHANNELS, m->n * sizeof *wide, "the mesh", error);
        if (wide == NULL) return LAM_ERR_MEMORY;
        for (size_t c = 0; c < MOVING_LIGHT_CHANNELS; c++)
            memcpy(wide + c * m->n, *arrays[k], m->n * sizeof *wide);
        free(*arrays[k]);
        *arrays[k] = wide;
    }
    m->n_channels = MOVING_LIGHT_CHANNELS;
    return LAM_OK;
}

/* The mesh of a store, whatever its operator is. */
static lam_status load_mesh(const precompute_job *job, precompute_scene *scene, lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL;
    TRY(store_open(job->options->input, &s, error));
    TRY(mesh_load(s, &scene->m, NULL, error));
    scene_take_lights(job, &scene->m);
    if (scene->m.n_channels != 1 && scene->m.n_channels != MOVING_LIGHT_CHANNELS)
        FAIL(error, LAM_ERR_ARGUMENT, "%s: has %zu channels, a moving light needs 1 or %d",
             job->options->input, scene->m.n_channels, MOVING_LIGHT_CHANNELS);
    if (job->options->reflectance >= 0)
        for (size_t i = 0; i < scene->m.n * scene->m.n_channels; i++)
            scene->m.reflectance[i] = (float)job->options->reflectance;
done:
    store_close(s);
    return status;
}

static lam_status read_light(const precompute_job *job, precompute_scene *scene, walked_light *walked,
                             const emitters_options *how, lam_error *error) {
    lam_status status = LAM_OK;
    const bool listed = how->positions != NULL;
    const light_path_request request = {.path = listed ? how->positions : how->path,
                                        .frames = listed ? 0 : (size_t)how->frames,
                                        .unit = job->options->from_store ? 1 : scene->m.unit,
                                        .lights = scene->m.lights};
    const light_conversion plain = {.from = scene->m.lights};
    bool coloured = false, converted = false;
    if (scene->m.glass != NULL)
        FAIL(error, LAM_ERR_ARGUMENT,
             "%s: the paths of --positions and --path do not pass panes; --glass GROUP=0 makes a group "
             "opaque, --portal GROUP takes it away",
             job->options->input);
    TRY(light_path_read(&request, &walked->light, &coloured, &converted, error));
    if (coloured) TRY(take_colours(&scene->m, error));
    const double *E = walked->light.emission;
    char of_channels[64];
    snprintf(of_channels, sizeof of_channels, coloured ? "%.4g, %.4g, %.4g" : "%.4g", E[0], E[1], E[2]);
    terminal_log(job->t, "%zu positions of a light of %.3g m2, %s %s", walked->light.n, walked->light.area,
                 of_channels, light_conversion_unit(&plain, true));
    if (converted) terminal_log(job->t, "converted by %g lm/W", WHITE_EFFICACY);
done:
    return status;
}

/* Fails before any walk where the sums of all threads, the estimates and the operator have no room. */
static lam_status check_memory(const precompute_job *job, const precompute_scene *scene,
                               const walked_light *walked, lam_error *error) {
    lam_status status = LAM_OK;
    const double n = (double)scene->m.n, C = (double)scene->m.n_channels, s = (double)walked->light.n;
    const double threads = (double)omp_get_max_threads();
    const double bytes = 8 * n * s * ((threads + 2) * C + threads + 1) + 4 * n * s * (4 * C + 1);
    if (bytes > job->memory)
        FAIL(
            error, LAM_ERR_MEMORY,
            "%zu positions of %zu elements take about %.2g GB with %d threads, --memory allows %.2g GB: give "
            "fewer positions, elements or --threads",
            walked->light.n, scene->m.n, 1e-9 * bytes, (int)threads, 1e-9 * job->memory);
done:
    return status;
}

static lam_status walk(const precompute_job *job, const precompute_scene *scene, walked_light *walked,
                       const emitters_options *how, lam_error *error) {
    lam_status status = LAM_OK;
    const reuse_way way = (reuse_way)(how->reuse[0] - 'A');
    const reuse_problem problem = {.light = &walked->light,
                                   .way = way,
                                   .paths = (size_t)how->paths,
                                   .even = true,
                                   .resolution = way == REUSE_CUBES ? CUBE_PIXELS : MAP_CELLS,
                                   .seed = precompute_seed(job->options->seed, SEED_POSITIONS),
                                   .progress = &job->progress,
                                   .stage = "paths"};
    walk_scene *walks = NULL;
    TRY(walk_scene_create(&scene->m, job->options->closed, &walks, error));
    TRY(walk_reuse(walks, &problem, &walked->paths, error));
    terminal_log(job->t, "%zu paths of each position, %.3g rays each", walked->paths.paths,
                 walked->paths.rays);
done:
    walk_scene_free(walks);
    return status;
}

static lam_status copy_names(const moving_light *l, char ***names, lam_error *error) {
    const char **list = memory_allocate(l->n, sizeof *list, "names of positions", error);
    if (list == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < l->n; k++) list[k] = l->pose[k].name;
    const lam_status status = emitter_names_copy(l->n, list, names, error);
    free(list);
    return status;
}

/* No element emits: the light is no part of the mesh. */
static lam_status make_operator(const precompute_scene *scene, made_operator *made, walked_light *walked,
                                lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = &scene->m;
    const size_t n = m->n, C = m->n_channels, s = walked->light.n;
    emitter_arrays a = {.s = s};
    TRY(copy_names(&walked->light, &a.names, error));
    a.T = memory_allocate(C * s, n * sizeof *a.T, "light of positions", error);
    a.ends = memory_allocate(C * s + 1, sizeof *a.ends, "light of positions", error);
    a.elements = memory_allocate(1, sizeof *a.elements, "light of positions", error);
    a.values = memory_allocate(1, sizeof *a.values, "light of positions", error);
    a.exitance = memory_allocate(C, sizeof *a.exitance, "light of positions", error);
    if (a.T == NULL || a.ends == NULL || a.elements == NULL || a.values == NULL || a.exitance == NULL)
        TRY(LAM_ERR_MEMORY);
    for (size_t c = 0; c < C; c++) {
        a.exitance[c] = (float)walked->light.emission[c];
        for (size_t k = 0; k < s; k++)
            for (size_t i = 0; i < n; i++) {
                const float rho = m->reflectance[c * n + i];
                a.T[(c * s + k) * n + i] = (rho > 0 ? rho : 1) * walked->paths.H[(c * s + k) * n + i];
            }
    }
    a.direct = walked->paths.direct;
    walked->paths.direct = NULL;
    TRY(operator_emitters_create(n, C, m->reflectance, &a, &made->op, error));
done:
    emitter_arrays_free(&a);
    return status;
}

static void report(const precompute_job *job, made_operator *made, const walked_light *walked,
                   const emitters_options *how) {
    static const char *const ways[] = {
        "A: every position by its own paths", "B: paths serve all positions, by a ray to each",
        "C: paths serve all positions, by maps", "D: paths serve all positions, by hemicubes",
        "E: walks from the elements that are lit serve all positions"};
    build_report *r = &made->built;
    r->method = method_find("emitters")->name;
    snprintf(r->detail, sizeof r->detail, "%zu paths of each; %s", walked->paths.paths,
             ways[how->reuse[0] - 'A']);
    snprintf(r->reason, sizeof r->reason, "emitters: %zu positions of a light asked for by --%s; %s",
             walked->light.n, how->positions != NULL ? "positions" : "path", r->detail);
    report_count(r, "paths", (double)walked->paths.paths);
    report_text(r, "reuse", how->reuse);
    report_number(r, "rays_of_path", walked->paths.rays);
    terminal_log(job->t, "%s", r->reason);
}

lam_status stage_positions(const precompute_job *job, precompute_scene *scene, made_operator *made,
                           walked_light *walked, lam_error *error) {
    lam_status status = LAM_OK;
    const emitters_options *how = emitters_options_of(&job->options->build);
    double started = clock_seconds();
    TRY(job->options->from_store ? load_mesh(job, scene, error) : stage_load_scene(job, scene, error));
    terminal_log_stage(job->t, "import", clock_seconds() - started);
    TRY(terminal_check(error));
    started = clock_seconds();
    if (!job->options->from_store) TRY(scene_refine(job, scene, error));
    scene_log_mesh(job, scene);
    TRY(read_light(job, scene, walked, how, error));
    TRY(check_memory(job, scene, walked, error));
    terminal_log_stage(job->t, "mesh", clock_seconds() - started);
    started = clock_seconds();
    TRY(walk(job, scene, walked, how, error));
    terminal_log_stage(job->t, "paths", clock_seconds() - started);
    started = clock_seconds();
    report(job, made, walked, how);
    TRY(walked_add_overlap(scene, made, walked, error));
    TRY(walked_judge(job, scene, made, walked, error));
    TRY(make_operator(scene, made, walked, error)); /* it takes the direct light over */
    lam_operator_set_threads(made->op, (size_t)omp_get_max_threads());
    terminal_log_stage(job->t, "judge", clock_seconds() - started);
    TRY(terminal_check(error));
done:
    return status;
}
