/* The parts of a run at its beginning and at its end, and the tree of elements that samples and blocks share.
 */
#include "solver/precompute/parts.h"

#include "solver/base/clock.h"

#include <stdlib.h>

static double memory_of(const precompute_options *o) {
    const uint64_t available = memory_available();
    if (o->memory > 0) return (double)o->memory;
    return available > 0 ? .7 * (double)available : 0x1p60;
}

precompute_parts parts_begin(const precompute_options *options, terminal *t) {
    return (precompute_parts){.job = {.options = options,
                                      .t = t,
                                      .progress = terminal_progress(t),
                                      .memory = memory_of(options),
                                      .started = clock_seconds(),
                                      .started_used = clock_processor_seconds()},
                              .course = {.epsilon = options->build.epsilon}};
}

static void scene_free(precompute_scene *scene) {
    mesh_free(&scene->m);
    free(scene->order);
    free(scene->centre);
    free(scene->surface);
    block_scene_destroy(scene->ready);
    plane_tree_free(&scene->tree);
    face_openings_free(&scene->of_faces);
    emitter_list_free(&scene->emitters);
    importance_free(&scene->importance);
    luminaire_columns_free(&scene->luminaires);
    scene_sensors_free(&scene->sensors);
}

void parts_free(precompute_parts *p) {
    scene_free(&p->scene);
    form_factors_free(&p->factors.f);
    block_factors_free(&p->factors.blocks);
    ray_rows_destroy(p->factors.rays);
    scratch_close(p->factors.scratch, false);
    lam_operator_close(p->made.op);
    group_errors_free(&p->made.by_group);
    mesh_figures_free(&p->made.errors_of_mesh);
    trial_made_free(&p->course.best);
    judge_references_free(p->course.references);
    moving_light_free(&p->walked.light);
    reuse_estimates_free(&p->walked.paths);
    free(p->walked.position_errors);
}

finished_trial parts_view(const precompute_parts *p) {
    return (finished_trial){&p->job, &p->scene, &p->plan, &p->factors, &p->made, &p->course};
}

lam_status scene_make_tree(precompute_scene *scene, lam_error *error) {
    return scene->tree.n > 0 ? LAM_OK : form_factors_tree(&scene->m, &scene->tree, error);
}

void scene_forget_ready(precompute_scene *scene) {
    block_scene_destroy(scene->ready);
    scene->ready = NULL;
}
