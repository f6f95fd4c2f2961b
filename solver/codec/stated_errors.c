#include "solver/codec/stated_errors.h"

#include "solver/operator/blocks/importance.h"
#include "store/groups.h"

#include <math.h>
#include <stdlib.h>

void stated_errors_free(stated_errors *e) {
    free(e->read);
    free(e->emits);
    error_by_group_free(&e->by_group);
    emitters_error_free(&e->emitters);
    *e = (stated_errors){.n = 0};
}

/* A stated error of the scene's own lights, or else of single elements. */
static stated_error error_of(const error_report *report, bool of_receivers) {
    const error_group *const groups[] = {&report->lights, &report->single};
    static const char *const names[] = {"lights", "single"};
    stated_error found = {.known = false};
    for (size_t i = 0; i < sizeof groups / sizeof groups[0] && !found.known; i++) {
        const error_group *g = groups[i];
        found.light = names[i];
        found.relative = of_receivers ? g->receivers.total_relative : g->total_relative.mean;
        found.indirect = of_receivers ? g->receivers.total_indirect : g->total_indirect.mean;
        found.known = found.relative >= 0 && isfinite(found.relative) && found.indirect >= 0 &&
                      isfinite(found.indirect);
    }
    return found;
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
    importance weights = {.n = 0};
    stated_figures figures = {.repair = 0};
    stated_errors made = {.n = n};
    TRY(stated_figures_load(s, &shape, &figures, error));
    const mesh_figures *mesh = &figures.mesh;
    made.all = error_of(&figures.report, false);
    made.mesh = mesh->lights > 0 ? mesh->lights : mesh->even;
    made.mesh_of_skies = fmax(mesh->sky_even, mesh->sky_cloudy);
    TRY(importance_load(s, n, &weights, error));
    TRY(find_members(weights.read, n, &made.read, error));
    TRY(find_members(weights.emits, n, &made.emits, error));
    if (made.read != NULL) made.receivers = error_of(&figures.report, true);
    about.read = made.read;
    TRY(error_by_group_make(s, &about, &figures, &made.by_group, error));
    TRY(emitters_error_make(&about, op, &figures, &made.emitters, error));
    *out = made;
    made = (stated_errors){.n = 0};
done:
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
    notes->mesh = scope.sky && e->mesh_of_skies > 0 ? e->mesh_of_skies : e->mesh;
    notes->error_light = of->light;
    notes->error_of = e->read == NULL || strange ? NULL : receivers ? "receivers" : "all";
    notes->error_from = e->emits == NULL ? NULL : strange ? "others" : "sources";
}

void stated_error_add_mesh(double mesh, double *relative, double *indirect) {
    if (!isfinite(*indirect)) return; /* it is divided by reflected light that is 0 */
    const double both = hypot(*indirect, mesh);
    *relative = *indirect > 0 ? *relative * (both / *indirect) : hypot(*relative, mesh);
    *indirect = both;
}
