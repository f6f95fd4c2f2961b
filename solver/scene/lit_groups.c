#include "solver/scene/lit_groups.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

bool group_name_is_window(const char *name) {
    static const char *const words[] = {"window", "glass", "glazing", "pane"};
    for (; *name != '\0'; name++)
        for (size_t k = 0; k < sizeof words / sizeof *words; k++)
            if (strncasecmp(name, words[k], strlen(words[k])) == 0) return true;
    return false;
}

lam_status lit_groups_find(const mesh *m, size_t lights_most, uint8_t *light_of, size_t *lights,
                           lam_error *error) {
    bool windows = false;
    *lights = 0;
    memset(light_of, LIT_NOT, m->n_groups);
    if (m->n_groups < 2) return LAM_OK;
    double *area = memory_allocate(m->n_groups, sizeof *area, "groups that are lit", error);
    if (area == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < m->n; i++) area[m->group[i]] += m->area[i];
    for (size_t g = 0; g < m->n_groups && lights_most > 0; g++) {
        if (!group_name_is_window(m->group_names[g]) || !(area[g] > 0)) continue;
        light_of[g] = 0;
        windows = true;
    }
    *lights = windows ? 1 : 0;
    while (*lights < lights_most) {
        size_t largest = m->n_groups;
        for (size_t g = 0; g < m->n_groups; g++)
            if (light_of[g] == LIT_NOT && area[g] > 0 && (largest == m->n_groups || area[g] > area[largest]))
                largest = g;
        if (largest == m->n_groups) break;
        light_of[largest] = (uint8_t)(*lights)++;
    }
    free(area);
    return LAM_OK;
}
