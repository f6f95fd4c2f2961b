#include "solver/operator/stated/stated_errors.h"

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
stated_error stated_error_of_group(const error_group *g, bool of_receivers, const char *light) {
    stated_error e = {.light = light};
    e.relative = of_receivers ? g->receivers.total_relative : g->total_relative.mean;
    e.indirect = of_receivers ? g->receivers.total_indirect : g->total_indirect.mean;
    e.share = share_of(of_receivers ? g->receivers.operator_indirect : g->operator_indirect.mean, e.indirect);
    e.known = is_figure(e.relative) && is_figure(e.indirect);
    return e;
}

/* A stated error of the scene's own lights, or else of single elements. */
stated_error stated_error_of(const error_report *report, bool of_receivers) {
    const stated_error lights = stated_error_of_group(&report->lights, of_receivers, "lights");
    return lights.known ? lights : stated_error_of_group(&report->single, of_receivers, "single");
}

/* Of skies no probe is compared with the operator's own form factors: the error of the operator is that of
 * random emission, over all light. */
stated_error stated_error_of_sky(const error_report *report) {
    stated_error e = stated_error_of_group(&report->sky, false, "sky");
    if (e.known) e.share = fmax(share_of(report->random.operator_relative.mean, e.relative), 0);
    return e;
}

double stated_mesh_of_lights(const mesh_figures *m) {
    return m->has_lights ? m->lights : m->has_even ? m->even : -1;
}

double stated_mesh_of_skies(const mesh_figures *m) {
    return m->has_skies ? fmax(m->sky_even, m->sky_cloudy) : -1;
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
    made.all = stated_error_of(&figures.report, false);
    made.sky = stated_error_of_sky(&figures.report);
    made.mesh = stated_mesh_of_lights(mesh);
    made.mesh_of_skies = stated_mesh_of_skies(mesh);
    TRY(importance_load(s, n, &weights, error));
    TRY(find_members(weights.read, n, &made.read, error));
    TRY(find_members(weights.emits, n, &made.emits, error));
    made.sensors = weights.sensors;
    made.luminaires = weights.luminaires;
    if (made.read != NULL) made.receivers = stated_error_of(&figures.report, true);
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

bool stated_errors_know(const stated_errors *e, const lam_luminaires *luminaires, size_t n_tiles, bool sky,
                        bool lamps) {
    const group_errors *figures = &e->by_group.figures;
    return e->by_group.n_bins > 0 && e->emitters.figures.s == 0 &&
           (!lamps || luminaires_know_errors(luminaires, figures->n_groups)) &&
           (!sky || (n_tiles > 0 && figures->n_tiles == n_tiles));
}

emission_size stated_sky_size(const stated_errors *e, size_t n_channels, const float *L) {
    const group_errors *figures = &e->by_group.figures;
    const size_t m = figures->n_tiles;
    emission_size size = {.power2 = 0};
    for (size_t c = 0; L != NULL && c < n_channels; c++)
        emission_size_add(&size, m, figures->sky_power + c * m, L + c * m);
    return size;
}
