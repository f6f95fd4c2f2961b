#include "solver/scene/glass.h"

#include "solver/scene/coincident.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

double mesh_pane_passes(const mesh *m, size_t element, double cosine) {
    return glass_passes(&m->glass[m->group[element]], m->glass_by_angle, cosine);
}

size_t mesh_pane_groups(const mesh *m) {
    size_t n = 0, fronts = 0;
    for (size_t i = 0; m->glass != NULL && i < m->n - m->n_backs; i++)
        if (m->group[i] >= fronts) fronts = m->group[i] + (size_t)1;
    for (size_t g = 0; g < fronts; g++) n += m->glass[g].transmittance > 0;
    return n;
}

lam_status mesh_set_glass(mesh *m, size_t group, const struct group_glass *glass, lam_error *error) {
    if (m->glass == NULL) m->glass = memory_allocate(m->n_groups, sizeof *m->glass, "panes", error);
    if (m->glass == NULL) return LAM_ERR_MEMORY;
    m->n_glass = m->n_groups;
    m->glass[group] = *glass;
    return LAM_OK;
}

lam_status mesh_copy_glass(const mesh *from, mesh *to, lam_error *error) {
    if (from->glass == NULL) return LAM_OK;
    to->glass = memory_allocate(from->n_glass, sizeof *to->glass, "panes", error);
    if (to->glass == NULL) return LAM_ERR_MEMORY;
    memcpy(to->glass, from->glass, from->n_glass * sizeof *to->glass);
    to->n_glass = from->n_glass;
    to->glass_by_angle = from->glass_by_angle;
    return LAM_OK;
}

/* The faces that are panes, as a mesh of their own that shares all else with m; *of [n_panes]: their numbers
 * in m. Freed by pane_faces_free. */
static lam_status pane_faces_take(const mesh *m, size_t n_panes, mesh *out, uint32_t **of, lam_error *error) {
    *out = *m;
    out->n = 0;
    out->has_back = NULL;
    out->elements = memory_allocate(n_panes, sizeof *out->elements, "panes", error);
    out->area = memory_allocate(n_panes, sizeof *out->area, "panes", error);
    out->normal = memory_allocate(n_panes, sizeof *out->normal, "panes", error);
    *of = memory_allocate(n_panes, sizeof **of, "panes", error);
    if (out->elements == NULL || out->area == NULL || out->normal == NULL || *of == NULL)
        return LAM_ERR_MEMORY;
    for (size_t i = 0; i < m->n; i++) {
        if (!mesh_is_pane(m, i)) continue;
        memcpy(out->elements[out->n], m->elements[i], sizeof *out->elements);
        memcpy(out->normal[out->n], m->normal[i], sizeof *out->normal);
        out->area[out->n] = m->area[i];
        (*of)[out->n++] = (uint32_t)i;
    }
    return LAM_OK;
}

static void pane_faces_free(mesh *panes) {
    free(panes->elements);
    free(panes->area);
    free(panes->normal);
}

/* The part of a face that others must cover for it to have a back: corners are rounded. */
static const double covered_least = .999;

/* Takes the marks of panes off faces that others cover from behind, however both are divided: each is the
 * back of the other. */
static lam_status unmark_sheets(mesh *m, size_t n_panes, lam_error *error) {
    lam_status status = LAM_OK;
    mesh panes = {.n = 0};
    uint32_t *of = NULL;
    double *shared = memory_allocate(n_panes, sizeof *shared, "panes", error);
    if (shared == NULL) TRY(LAM_ERR_MEMORY);
    TRY(pane_faces_take(m, n_panes, &panes, &of, error));
    TRY(mesh_find_sheets(&panes, shared, error));
    for (size_t k = 0; k < panes.n; k++)
        if (shared[k] >= covered_least * panes.area[k]) m->has_back[of[k]] = false;
done:
    pane_faces_free(&panes);
    free(of);
    free(shared);
    return status;
}

/* rho + T <= 1, in single precision, too; returns the largest rho before where it was more, else 0. */
static double limit_reflectance(mesh *m, size_t element) {
    const float most = (float)(1 - m->glass[m->group[element]].transmittance);
    double largest = 0;
    for (size_t c = 0; c < m->n_channels; c++) {
        float *const rho = &m->reflectance[c * m->n + element];
        if (*rho <= most) continue;
        largest = fmax(largest, (double)*rho);
        *rho = most;
    }
    return largest;
}

void mesh_limit_panes(mesh *m) {
    for (size_t i = 0; m->glass != NULL && i < m->n; i++)
        if (mesh_is_pane(m, i)) limit_reflectance(m, i);
}

lam_status mesh_settle_glass(mesh *m, glass_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    *report = (glass_report){.groups = 0};
    if (m->glass == NULL) return LAM_OK;
    for (size_t g = 0; g < m->n_groups; g++) report->groups += m->glass[g].transmittance > 0;
    if (m->has_back == NULL) m->has_back = memory_allocate(m->n, sizeof *m->has_back, "panes", error);
    if (m->has_back == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < m->n; i++) {
        if (!mesh_is_pane(m, i)) continue;
        report->faces++;
        m->has_back[i] = true;
        const double reflected = limit_reflectance(m, i);
        report->limited += reflected > 0;
        report->limited_most = fmax(report->limited_most, reflected);
    }
    TRY(unmark_sheets(m, report->faces, error));
done:
    return status;
}

lam_status mesh_save_glass(const mesh *m, store *s, lam_error *error) {
    const scene_glass glass = {.of = m->glass, .by_angle = m->glass_by_angle, .given = m->glass_given};
    return scene_glass_save(&glass, m->n_glass, s, error);
}

lam_status mesh_load_glass(store *s, mesh *m, lam_error *error) {
    scene_glass glass;
    const lam_status status = scene_glass_load(s, m->n_groups, &glass, error);
    m->glass = glass.of;
    m->n_glass = glass.of != NULL ? m->n_groups : 0;
    m->glass_by_angle = glass.by_angle;
    m->glass_given = glass.given;
    return status;
}
