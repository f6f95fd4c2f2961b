/* --receivers, --importance and --sources: the elements that are read and those that emit, and from them the
 * importance of all. */
#include "solver/base/atomic_file.h"
#include "solver/light/emission.h"
#include "solver/precompute/stages.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* E [C][n]: every element of the groups NAME,NAME emits 1. */
static lam_status read_groups(const char *option, const char *names, const emission_scene *scene,
                              emission *out, lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = scene->m;
    char *name = memory_allocate(strlen(names) + 1, 1, option, error);
    if (name == NULL) return LAM_ERR_MEMORY;
    TRY(emission_allocate(option, m->n_channels, m->n, 1, &out->E, error));
    out->n_vectors = 1;
    for (const char *at = names;; at++) {
        const size_t length = strcspn(at, ",");
        memcpy(name, at, length);
        name[length] = '\0';
        TRY(emission_fill_group(scene, option, name, NULL, out->E, error));
        at += length;
        if (*at == '\0') break;
    }
done:
    free(name);
    return status;
}

static lam_status read_file(const char *path, const emission_scene *scene, emission *out, lam_error *error) {
    char extension[16];
    atomic_file_extension(path, extension);
    if (strcmp(extension, "npy") != 0 && strcmp(extension, "json") != 0)
        return status_fail(error, LAM_ERR_ARGUMENT, "--importance %.200s: must end in .npy or .json", path);
    return emission_read(path, scene, false, out, error);
}

/* out [n]: the largest of all channels over the largest of all elements, of groups NAME,NAME or, where groups
 * are NULL, of a file of one emission. */
static lam_status read_weights(const char *option, const char *groups, const char *file,
                               const emission_scene *scene, float **out, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = scene->m->n, C = scene->m->n_channels;
    emission read = {.E = NULL};
    float *w = NULL, most = 0;
    if (groups != NULL)
        TRY(read_groups(option, groups, scene, &read, error));
    else
        TRY(read_file(file, scene, &read, error));
    if (read.n_vectors != 1)
        FAIL(error, LAM_ERR_ARGUMENT, "--importance %.200s: has %zu vectors, must have 1", file,
             read.n_vectors);
    w = memory_allocate(n, sizeof *w, "importance", error);
    if (w == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < n * C; k++) w[k % n] = fmaxf(w[k % n], read.E[k]);
    for (size_t i = 0; i < n; i++) most = fmaxf(most, w[i]);
    if (!(most > 0))
        FAIL(error, LAM_ERR_ARGUMENT, "--importance %.200s: is 0 everywhere, must be above 0 somewhere",
             file);
    for (size_t i = 0; i < n; i++) w[i] /= most;
    *out = w;
    w = NULL;
done:
    emission_free(&read);
    free(w);
    return status;
}

lam_status scene_read_importance(const precompute_job *job, const precompute_plan *plan,
                                 precompute_scene *scene, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = job->options;
    const mesh *m = &scene->m;
    emission_scene named = {.m = NULL};
    importance made = {.n = m->n};
    if (o->receivers == NULL && o->importance == NULL && o->sources == NULL) return LAM_OK;
    TRY(emission_scene_create(m, &named, error));
    if (o->receivers != NULL || o->importance != NULL)
        TRY(read_weights("--receivers", o->receivers, o->importance, &named, &made.read, error));
    if (o->sources != NULL) TRY(read_weights("--sources", o->sources, NULL, &named, &made.emits, error));
    if (!(plan->method->flags & METHOD_READS)) goto done;
    scene->importance = made;
    made = (importance){.n = 0};
done:
    emission_scene_free(&named);
    importance_free(&made);
    return status;
}

/* Rows of a stream are found as the operator asks for them: a few rays of each element tell enough. */
static lam_status find_by_rays(const precompute_job *job, precompute_scene *scene, lam_error *error) {
    enum { RAYS = 64 };
    lam_status status = LAM_OK;
    const form_factor_options how = {.recipe = {.rays = RAYS, .seed = job->options->seed},
                                     .progress = &job->progress,
                                     .stage = "importance"};
    form_factors f = {.row_sums = NULL};
    TRY(form_factors_make(&scene->m, scene->order, &how, &f, error));
    const factor_product F = factor_product_of_rows(&f.F);
    TRY(importance_find(&F, scene->m.n_channels, scene->m.reflectance, scene->m.area, &scene->importance,
                        error));
done:
    form_factors_free(&f);
    return status;
}

lam_status scene_find_importance(const precompute_job *job, precompute_scene *scene,
                                 const precompute_plan *plan, const precompute_factors *factors,
                                 lam_error *error) {
    if (scene->importance.n == 0 || importance_is_found(&scene->importance)) return LAM_OK;
    if (plan->streamed) return find_by_rays(job, scene, error);
    const factor_product F = factors->blocks.n > 0 ? block_factors_product(&factors->blocks)
                                                   : factor_product_of_rows(&factors->f.F);
    return importance_find(&F, scene->m.n_channels, scene->m.reflectance, scene->m.area, &scene->importance,
                           error);
}
