/* --receivers, --importance and --sources: the elements that are read and those that emit, or reflect the
 * light of luminaires, and from them the importance of all. */
#include "solver/base/atomic_file.h"
#include "solver/light/emission.h"
#include "solver/precompute/stages.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A group of the scene keeps its name. */
static bool means_luminaires(const emission_scene *scene, const char *name) {
    const uint32_t *found;
    return strcmp(name, SOURCES_LUMINAIRES) == 0 &&
           group_index_find(&scene->groups, name, strlen(name), &found) == 0;
}

/* E [C][n]: every element of the groups NAME,NAME emits 1. *luminaires: one of the names means these; NULL:
 * none may. */
static lam_status read_groups(const char *option, const char *names, const emission_scene *scene,
                              emission *out, bool *luminaires, lam_error *error) {
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
        if (luminaires != NULL && means_luminaires(scene, name))
            *luminaires = true;
        else
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
 * are NULL, of a file of one emission; 0 where luminaires are all that is named. */
static lam_status read_weights(const char *option, const char *groups, const char *file,
                               const emission_scene *scene, float **out, bool *luminaires, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = scene->m->n, C = scene->m->n_channels;
    emission read = {.E = NULL};
    float *w = NULL, most = 0;
    if (groups != NULL)
        TRY(read_groups(option, groups, scene, &read, luminaires, error));
    else
        TRY(read_file(file, scene, &read, error));
    if (read.n_vectors != 1)
        FAIL(error, LAM_ERR_ARGUMENT, "--importance %.200s: has %zu vectors, must have 1", file,
             read.n_vectors);
    w = memory_allocate(n, sizeof *w, "importance", error);
    if (w == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < n * C; k++) w[k % n] = fmaxf(w[k % n], read.E[k]);
    for (size_t i = 0; i < n; i++) most = fmaxf(most, w[i]);
    if (!(most > 0) && (luminaires == NULL || !*luminaires))
        FAIL(error, LAM_ERR_ARGUMENT, "--importance %.200s: is 0 everywhere, must be above 0 somewhere",
             file);
    for (size_t i = 0; most > 0 && i < n; i++) w[i] /= most;
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
        TRY(read_weights("--receivers", o->receivers, o->importance, &named, &made.read, NULL, error));
    if (o->sources != NULL)
        TRY(read_weights("--sources", o->sources, NULL, &named, &made.emits, &made.luminaires, error));
    if (made.luminaires && scene->luminaires.placed.n == 0)
        FAIL(error, LAM_ERR_ARGUMENT, "--sources luminaires: there are none; give --luminaires FILE too");
    if (!(plan->method->flags & METHOD_READS)) goto done;
    scene->importance = made;
    made = (importance){.n = 0};
done:
    emission_scene_free(&named);
    importance_free(&made);
    return status;
}

/* emits = max(emits, min(1, x_i / mean x)) of one luminaire: x = rho H, the light of it that an element sends
 * on, of the largest channel; the mean is by area over all that it lights. Less than the least importance is
 * none. */
static void add_luminaire(const mesh *m, const float *H, float *emits) {
    double light = 0, area = 0;
    for (int pass = 0; pass < 2; pass++)
        for (size_t i = 0; i < m->n; i++) {
            double rho = 0;
            for (size_t c = 0; c < m->n_channels; c++) rho = fmax(rho, (double)m->reflectance[c * m->n + i]);
            const double x = rho * (double)H[i];
            if (!(x > 0)) continue;
            if (pass == 0) {
                light += m->area[i] * x;
                area += m->area[i];
            } else {
                const double s = fmin(x * area / light, 1);
                if (s >= importance_least) emits[i] = fmaxf(emits[i], (float)s);
            }
        }
}

lam_status scene_light_sources(const precompute_job *job, precompute_scene *scene, lam_error *error) {
    importance *of = &scene->importance;
    size_t count = 0;
    if (of->n == 0 || !of->luminaires) return LAM_OK;
    for (size_t k = 0; k < scene->luminaires.placed.n; k++)
        add_luminaire(&scene->m, scene->luminaires.H + k * scene->m.n, of->emits);
    for (size_t i = 0; i < scene->m.n; i++) count += of->emits[i] > 0;
    if (count == 0)
        return status_fail(error, LAM_ERR_ARGUMENT,
                           "--sources luminaires: no element reflects any of their light");
    terminal_log(job->t, "sources: %zu of %zu elements, those that reflect light of luminaires with them",
                 count, scene->m.n);
    return LAM_OK;
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
