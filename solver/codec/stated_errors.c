#include "solver/codec/stated_errors.h"

#include "solver/operator/blocks/importance.h"
#include "store/groups.h"
#include "store/status.h"

#include <math.h>
#include <stdlib.h>

void stated_errors_free(stated_errors *e) {
    free(e->read);
    free(e->emits);
    error_by_group_free(&e->by_group);
    emitters_error_free(&e->emitters);
    *e = (stated_errors){.n = 0};
}

static bool is_figure(double x) {
    return x >= 0 && isfinite(x);
}

/* The operator's own part of a squared error; negative: it was not measured. */
static double share_of(double of_operator, double all) {
    if (!is_figure(of_operator)) return -1;
    return all > 0 ? fmin(of_operator * of_operator / (all * all), 1) : 0;
}

/* The errors of a group of probes. */
static stated_error error_of_group(const error_group *g, bool of_receivers, const char *light) {
    stated_error e = {.light = light};
    e.relative = of_receivers ? g->receivers.total_relative : g->total_relative.mean;
    e.indirect = of_receivers ? g->receivers.total_indirect : g->total_indirect.mean;
    e.share = share_of(of_receivers ? g->receivers.operator_indirect : g->operator_indirect.mean, e.indirect);
    e.known = is_figure(e.relative) && is_figure(e.indirect);
    return e;
}

/* A stated error of the scene's own lights, or else of single elements. */
static stated_error error_of(const error_report *report, bool of_receivers) {
    const stated_error lights = error_of_group(&report->lights, of_receivers, "lights");
    return lights.known ? lights : error_of_group(&report->single, of_receivers, "single");
}

/* Of skies no probe is compared with the operator's own form factors: the error of the operator is that of
 * random emission, over all light. */
static stated_error error_of_sky(const error_report *report) {
    stated_error e = error_of_group(&report->sky, false, "sky");
    if (e.known) e.share = fmax(share_of(report->random.operator_relative.mean, e.relative), 0);
    return e;
}

static double mesh_of_lights(const mesh_figures *m) {
    return m->has_lights ? m->lights : m->has_even ? m->even : -1;
}

static double mesh_of_skies(const mesh_figures *m) {
    return m->has_skies ? fmax(m->sky_even, m->sky_cloudy) : -1;
}

static const char *const probes_advice = "precompute without --probes 0 measures it";

headline stated_headline(const error_report *report, const mesh_figures *mesh, const own_figures *own,
                         const char **light) {
    const stated_error lights = error_of_group(&report->lights, false, "lights"), sky = error_of_sky(report),
                       groups = error_of_group(&report->whole, false, "groups"),
                       random = error_of_group(&report->random, false, "random");
    /* A group that is the whole scene is the light of all elements. */
    const bool by_groups =
        groups.known && mesh->has_groups && mesh->groups_emitters < .999 * mesh->even_emitters;
    const stated_error *e = lights.known ? &lights : sky.known ? &sky : by_groups ? &groups : &random;
    headline h = {.known = e->known, .share = e->share, .advice = e->known ? NULL : probes_advice};
    *light = e->light;
    if (own->known) {
        *light = "lights";
        return (headline){.known = true,
                          .parts = {.rest = own->rest, .mesh = own->mesh},
                          .share = error_of(report, false).share};
    }
    if (!h.known) return h;
    /* Of a sky the light is B, as nothing is emitted. */
    h.parts.rest = e == &sky ? e->relative : e->indirect;
    h.parts.mesh = e == &sky        ? mesh_of_skies(mesh)
                   : e == &lights   ? mesh_of_lights(mesh)
                   : e == &groups   ? (mesh->groups_together > 0 ? mesh->groups_together : mesh->groups)
                   : mesh->has_even ? mesh->even
                                    : -1;
    return h;
}

/* *out [n]: true where a weight is above 0; NULL of NULL. */
static lam_status find_members(const float *weights, size_t n, bool **out, lam_error *error) {
    if (weights == NULL) return LAM_OK;
    *out = memory_allocate(n, sizeof **out, "receivers and sources", error);
    if (*out == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < n; i++) (*out)[i] = weights[i] > 0;
    return LAM_OK;
}

lam_status stated_errors_read(store *s, const error_scene *scene, const lam_operator *op, stated_errors *out,
                              lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = scene->n;
    const figures_shape shape = {scene->n_groups, scene->n_channels, emitters_error_count(op)};
    error_scene about = *scene;
    double *overlap = NULL;
    importance weights = {.n = 0};
    stated_figures figures = {.repair = 0};
    stated_errors made = {.n = n};
    TRY(stated_figures_load(s, &shape, &figures, error));
    const mesh_figures *mesh = &figures.mesh;
    made.all = error_of(&figures.report, false);
    made.sky = error_of_sky(&figures.report);
    made.mesh = mesh_of_lights(mesh);
    made.mesh_of_skies = mesh_of_skies(mesh);
    TRY(importance_load(s, n, &weights, error));
    TRY(find_members(weights.read, n, &made.read, error));
    TRY(find_members(weights.emits, n, &made.emits, error));
    made.sensors = weights.sensors;
    made.luminaires = weights.luminaires;
    if (made.read != NULL) made.receivers = error_of(&figures.report, true);
    about.read = made.read;
    about.emits = made.emits;
    if (figures.by_group.n_rows > 0) TRY(error_overlap_load(s, scene->n_groups, &overlap, error));
    TRY(error_by_group_make(&about, overlap, &figures, &made.by_group, error));
    TRY(emitters_error_make(&about, op, &figures, &made.emitters, error));
    *out = made;
    made = (stated_errors){.n = 0};
done:
    free(overlap);
    importance_free(&weights);
    stated_figures_free(&figures);
    stated_errors_free(&made);
    return status;
}

static size_t count_others(const bool *members, size_t count, const uint32_t *selected) {
    size_t others = 0;
    for (size_t k = 0; members != NULL && k < count; k++)
        others += !members[selected != NULL ? selected[k] : k];
    return others;
}

size_t stated_errors_others(const stated_errors *e, size_t count, const uint32_t *selected) {
    return count_others(e->read, count, selected);
}

size_t stated_errors_others_of_sensors(const stated_errors *e) {
    return e->sensors ? 0 : count_others(e->read, e->n, NULL);
}

size_t stated_errors_strangers(const stated_errors *e, size_t count, const uint32_t *selected) {
    return count_others(e->emits, count, selected);
}

bool stated_errors_is_strange(const stated_errors *e, size_t n_rows, const float *E) {
    bool strange = false;
    if (e->emits == NULL) return false;
    for (size_t row = 0; row < n_rows && !strange; row++)
        for (size_t i = 0; i < e->n; i++) strange |= E[row * e->n + i] != 0 && !e->emits[i];
    return strange;
}

void stated_errors_note(const stated_errors *e, answer_scope scope, answer_notes *notes) {
    const bool receivers = scope.receivers_only && e->read != NULL;
    const bool strange = scope.strange && e->emits != NULL;
    const stated_error *of = receivers ? &e->receivers : &e->all;
    notes->has_error = of->known && !strange;
    notes->relative_mean = of->relative;
    notes->indirect_mean = of->indirect;
    const bool sky = scope.sky && e->sky.known && !receivers;
    notes->head = (headline){
        .known = notes->has_error,
        .parts = {.rest = sky ? e->sky.relative : of->indirect,
                  .mesh = scope.sky && e->mesh_of_skies >= 0 ? e->mesh_of_skies : e->mesh},
        .share = sky ? e->sky.share : of->share,
        .advice = strange ? "precompute with --sources that name all that emits, or without" : probes_advice};
    notes->error_light = of->light;
    notes->error_of = e->read == NULL || strange ? NULL : receivers ? "receivers" : "all";
    notes->error_from = e->emits == NULL ? NULL : strange ? "others" : "sources";
}
