#include "solver/verbs/store_error.h"

#include "solver/codec/answer.h"

static void warn_of_others(size_t others, size_t count, bool at_sensors, terminal *t) {
    if (others == 0) return;
    if (at_sensors)
        terminal_warn(
            t,
            "the store was built for other receivers than sensors: light that %zu of %zu elements send "
            "there is only roughly right",
            others, count);
    else
        terminal_warn(
            t,
            "%zu of %zu elements are no receivers, which the store was built for: their light is only "
            "roughly right",
            others, count);
}

void store_error_take(const stated_errors *stated, const emission *light, bool at_sensors, size_t n_selected,
                      const uint32_t *selected, terminal *t, solution *out) {
    answer_notes notes = {.has_error = false};
    const size_t C = out->m->n_channels, count = at_sensors || selected == NULL ? stated->n : n_selected;
    const size_t others =
        at_sensors ? stated_errors_others_of_sensors(stated) : stated_errors_others(stated, count, selected);
    const size_t vectors = light->E == NULL ? 0 : light->steady ? 1 : light->n_vectors;
    const answer_scope scope = {.receivers_only = others == 0,
                                .strange = light->L != NULL || (light->D != NULL && !stated->luminaires) ||
                                           stated_errors_is_strange(stated, vectors * C, light->E),
                                .sky = light->L != NULL && emission_is_dark(light, stated->n, C, vectors)};
    stated_errors_note(stated, scope, &notes);
    if (notes.has_error) out->relative = notes.relative_mean;
    if (notes.has_error) out->indirect = notes.indirect_mean;
    out->head = notes.head;
    if (notes.has_error) out->error_light = notes.error_light;
    out->error_of = notes.error_of;
    out->error_from = notes.error_from;
    warn_of_others(others, count, at_sensors, t);
    if (stated->emits != NULL && scope.strange)
        terminal_warn(t, "there is light from elsewhere than the sources, which the store was built for: the "
                         "answer is only roughly right, and no error is stated for it");
}
