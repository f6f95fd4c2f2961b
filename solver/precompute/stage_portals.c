/* Openings through which the sky is seen: groups of --portal, or those that the faces leave. */
#include "solver/formfactor/visibility/openings.h"
#include "solver/light/emission.h"
#include "solver/precompute/stages.h"

#include <stdlib.h>
#include <string.h>

/* The rectangle around the elements of a group, which are marked in dropped. */
static lam_status read_portal(const mesh *m, const group_index *groups, const char *name, bool *dropped,
                              plane_rectangle *out, lam_error *error) {
    lam_status status = LAM_OK;
    const uint32_t *found = NULL;
    const size_t n_found = group_index_find(groups, name, strlen(name), &found);
    double(*points)[3] = NULL;
    uint32_t(*edges)[2] = NULL;
    size_t n_elements = 0, n = 0;
    char miss[GROUP_MISS];
    if (n_found == 0) {
        group_index_miss(groups, name, strlen(name), miss);
        FAIL(error, LAM_ERR_ARGUMENT, "--portal %.200s: the scene has %s", name, miss);
    }
    for (size_t k = 0; k < n_found; k++) n_elements += groups->start[found[k] + 1] - groups->start[found[k]];
    points = memory_allocate(4 * n_elements + 1, sizeof *points, "--portal", error);
    edges = memory_allocate(4 * n_elements + 1, sizeof *edges, "--portal", error);
    if (points == NULL || edges == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < n_found; k++)
        for (uint32_t e = groups->start[found[k]]; e < groups->start[found[k] + 1]; e++) {
            const uint32_t i = groups->elements[e];
            const size_t corners = mesh_corners(m, i), first = n;
            dropped[i] = true;
            for (size_t c = 0; c < corners; c++, n++) {
                memcpy(points[n], m->vertices[m->elements[i][c]], sizeof *points);
                edges[n][0] = (uint32_t)n;
                edges[n][1] = (uint32_t)(first + (c + 1) % corners);
            }
        }
    if (!plane_rectangle_around((const double(*)[3])points, n, (const uint32_t(*)[2])edges, n,
                                openings_crack_width(m), out))
        FAIL(error, LAM_ERR_ARGUMENT,
             "--portal %.200s: its faces do not lie in one plane within %.2g m; make a group of each window",
             name, openings_crack_width(m));
done:
    free(points);
    free(edges);
    return status;
}

lam_status scene_take_portals(const precompute_job *job, precompute_scene *scene, lam_error *error) {
    lam_status status = LAM_OK;
    const option_list *names = &job->options->portals;
    mesh *const m = &scene->m;
    emission_scene named = {.m = NULL};
    size_t n_dropped = 0;
    bool *dropped = NULL;
    if (names->count == 0) return LAM_OK;
    dropped = memory_allocate(m->n, sizeof *dropped, "--portal", error);
    if (dropped == NULL) return LAM_ERR_MEMORY;
    TRY(emission_scene_create(m, &named, error));
    for (size_t k = 0; k < names->count; k++) {
        plane_rectangle around;
        TRY(read_portal(m, &named.groups, names->items[k], dropped, &around, error));
        TRY(face_openings_give(&scene->of_faces, &around, error));
    }
    scene->openings = &scene->of_faces;
    for (size_t i = 0; i < m->n; i++) n_dropped += dropped[i];
    if (n_dropped == m->n)
        FAIL(error, LAM_ERR_ARGUMENT, "--portal %.200s: every face of the scene is of a portal",
             names->items[0]);
    TRY(mesh_drop(m, dropped, error));
    terminal_log(job->t, "%zu face%s of portals, which are no elements", n_dropped,
                 n_dropped == 1 ? "" : "s");
done:
    emission_scene_free(&named);
    free(dropped);
    return status;
}

lam_status scene_find_openings(const precompute_job *job, precompute_scene *scene, lam_error *error) {
    lam_status status = LAM_OK;
    if (job->options->sky == NULL || scene->openings != NULL) return LAM_OK;
    TRY(face_openings_find(&scene->m, openings_crack_width(&scene->m), &scene->of_faces, error));
    scene->openings = &scene->of_faces;
    if (scene->of_faces.n_left > 0)
        terminal_log(job->t,
                     "the faces leave %zu openings; rays are aimed at none but the %zu largest, or give "
                     "--portal GROUP",
                     scene->of_faces.n + scene->of_faces.n_left, scene->of_faces.n);
done:
    return status;
}
