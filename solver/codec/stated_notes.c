#include "solver/codec/stated_notes.h"

#include <math.h>

static const char *const probes_advice = "precompute without --probes 0 measures it";

headline stated_headline(const error_report *report, const mesh_figures *mesh, const own_figures *own,
                         const char **light) {
    const stated_error lights = stated_error_of_group(&report->lights, false, "lights"),
                       sky = stated_error_of_sky(report),
                       groups = stated_error_of_group(&report->whole, false, "groups"),
                       random = stated_error_of_group(&report->random, false, "random");
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
                          .share = stated_error_of(report, false).share};
    }
    if (!h.known) return h;
    /* Of a sky the light is B, as nothing is emitted. */
    h.parts.rest = e == &sky ? e->relative : e->indirect;
    h.parts.mesh = e == &sky        ? stated_mesh_of_skies(mesh)
                   : e == &lights   ? stated_mesh_of_lights(mesh)
                   : e == &groups   ? (mesh->groups_together > 0 ? mesh->groups_together : mesh->groups)
                   : mesh->has_even ? mesh->even
                                    : -1;
    return h;
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
