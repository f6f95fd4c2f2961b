/* Panes: groups whose materials let light pass, and those of --glass. */
#include "solver/light/emission.h"
#include "solver/precompute/stages.h"
#include "solver/scene/glass.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* One --glass GROUP=T[,FACES]; length: of the group's name. */
static lam_status parse_glass(const char *text, size_t *length, struct group_glass *out, lam_error *error) {
    const char *const equals = strrchr(text, '=');
    char *end = NULL;
    *out = (struct group_glass){.faces = 1};
    if (equals == NULL || equals == text)
        return status_fail(error, LAM_ERR_ARGUMENT,
                           "--glass %.200s: must be GROUP=T, as in window=.78, or GROUP=T,FACES", text);
    *length = (size_t)(equals - text);
    out->transmittance = strtod(equals + 1, &end);
    if (end == equals + 1 || !(out->transmittance >= 0 && out->transmittance <= 1))
        return status_fail(error, LAM_ERR_ARGUMENT,
                           "--glass %.200s: the transmittance must be a number from 0 to 1", text);
    if (*end == ',') {
        const char *const count = end + 1;
        out->faces = strtod(count, &end);
        if (end == count || !(out->faces >= 1 && out->faces <= GLASS_FACES_MOST) ||
            out->faces != floor(out->faces))
            return status_fail(error, LAM_ERR_ARGUMENT,
                               "--glass %.200s: the faces that a ray crosses one behind the other must be a "
                               "whole number from 1 to %d",
                               text, GLASS_FACES_MOST);
    }
    if (*end != '\0')
        return status_fail(error, LAM_ERR_ARGUMENT, "--glass %.200s: '%.20s' is left over behind the numbers",
                           text, end);
    return LAM_OK;
}

static lam_status take_glass(mesh *m, const group_index *groups, const char *text, lam_error *error) {
    lam_status status = LAM_OK;
    struct group_glass glass;
    const uint32_t *found = NULL;
    char miss[GROUP_MISS];
    size_t length = 0;
    TRY(parse_glass(text, &length, &glass, error));
    const size_t n_found = group_index_find(groups, text, length, &found);
    if (n_found == 0) {
        group_index_miss(groups, text, length, miss);
        FAIL(error, LAM_ERR_ARGUMENT, "--glass %.200s: the scene has %s", text, miss);
    }
    for (size_t k = 0; k < n_found; k++) TRY(mesh_set_glass(m, found[k], &glass, error));
done:
    return status;
}

/* Names the first panes with what they pass. */
static void log_panes(const precompute_job *job, const mesh *m, const glass_report *report) {
    enum { NAMED = 5 };
    char list[512] = "";
    size_t used = 0, named = 0;
    for (size_t g = 0; g < m->n_glass && named < NAMED; g++) {
        const struct group_glass *glass = &m->glass[g];
        if (!(glass->transmittance > 0)) continue;
        used += (size_t)snprintf(list + used, sizeof list - used, "%s%.60s %.3g", named == 0 ? "" : ", ",
                                 m->group_names[g], glass->transmittance);
        if (glass->faces > 1)
            used += (size_t)snprintf(list + used, sizeof list - used, " in %g faces", glass->faces);
        named++;
    }
    if (report->groups > named)
        snprintf(list + used, sizeof list - used, ", %zu more", report->groups - named);
    terminal_log(job->t, "light passes %zu face%s of panes%s: %s", report->faces,
                 report->faces == 1 ? "" : "s", m->glass_by_angle ? ", less of it aslant" : "", list);
    if (report->limited > 0)
        terminal_warn(job->t,
                      "%zu face%s of panes reflect up to %.3g beside what they pass: limited, so that both "
                      "are 1 at most",
                      report->limited, report->limited == 1 ? "" : "s", report->limited_most);
}

lam_status scene_take_glass(const precompute_job *job, precompute_scene *scene, lam_error *error) {
    lam_status status = LAM_OK;
    const option_list *given = &job->options->glass;
    mesh *const m = &scene->m;
    emission_scene named = {.m = NULL};
    glass_report report;
    if (given->count > 0) TRY(emission_scene_create(m, &named, error));
    for (size_t k = 0; k < given->count; k++) TRY(take_glass(m, &named.groups, given->items[k], error));
    m->glass_given = given->count > 0;
    m->glass_by_angle = job->options->glass_law == GLASS_BY_ANGLE;
    TRY(mesh_settle_glass(m, &report, error));
    if (report.groups > 0) log_panes(job, m, &report);
done:
    emission_scene_free(&named);
    return status;
}
