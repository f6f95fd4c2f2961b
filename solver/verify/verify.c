/* Checks of the file and the mesh, the form factors, and the scene it came from. */
#include "solver/verify/verify.h"

#include "solver/base/photometry.h"
#include "solver/scene/glass.h"
#include "solver/scene/import/import.h"
#include "store/groups.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void examination_free(examination *e) {
    lam_operator_close(e->op);
    form_factors_free(&e->f);
    block_factors_free(&e->blocks);
    importance_free(&e->importance);
    plane_tree_free(&e->tree);
    free(e->row_sums);
    free(e->compared);
    mesh_free(&e->m);
    store_close(e->s);
}

void check_say(check *c, verdict v, const char *format, ...) {
    va_list arguments;
    c->verdict = v;
    va_start(arguments, format);
    vsnprintf(c->detail, sizeof c->detail, format, arguments);
    va_end(arguments);
}

lam_status check_failed(check *c, lam_status status, const lam_error *error) {
    if (status == LAM_OK) return LAM_OK;
    if (status == LAM_ERR_MEMORY || status == LAM_ERR_CANCELLED || status == LAM_ERR_INTERNAL) return status;
    check_say(c, VERDICT_BROKEN, "%s", error->message);
    return LAM_OK;
}

lam_status verify_checksums(examination *e, check *c, lam_error *error) {
    check_say(c, VERDICT_OK, "every dataset is as it was written");
    return check_failed(c, store_verify(e->s, error), error);
}

/* Areas and normals against those of the vertices; the first that differs is named. */
static lam_status measure_again(const mesh *m, check *c, lam_error *error) {
    lam_status status = LAM_OK;
    mesh again = *m;
    again.area = NULL;
    again.normal = NULL;
    TRY(mesh_measure(&again, error));
    for (size_t i = 0; i < m->n; i++) {
        /* Stored in double and computed by the same sums: only the last bits may differ. */
        if (fabs(again.area[i] - m->area[i]) > 1e-9 * again.area[i]) {
            check_say(c, VERDICT_BROKEN, "area[%zu] = %.9g m2, its vertices give %.9g", i, m->area[i],
                      again.area[i]);
            break;
        }
        double turned = 0;
        for (int k = 0; k < 3; k++) turned += (double)again.normal[i][k] * (double)m->normal[i][k];
        if (fabs(turned - 1) > 1e-5) {
            check_say(c, VERDICT_BROKEN, "normal[%zu] is not that of its vertices", i);
            break;
        }
    }
done:
    free(again.area);
    free(again.normal);
    return status;
}

lam_status verify_mesh(examination *e, check *c, lam_error *error) {
    lam_status status = LAM_OK;
    char *recorded = NULL, hash[33];
    const lam_status loaded = mesh_load(e->s, &e->m, &e->row_sums, error);
    if (loaded != LAM_OK) return check_failed(c, loaded, error);
    e->has_mesh = true;
    const mesh *m = &e->m;
    const double most = mesh_row_most(m);
    const light_conversion plain = {.from = m->lights};
    const char *const unit = light_conversion_unit(&plain, true);
    check_say(c, VERDICT_OK, "%zu elements, %zu vertices, %zu groups, lights in %s", m->n, m->n_vertices,
              m->n_groups, unit);
    TRY(store_get_text(e->s, STORE_MESH, "geometry_hash", &recorded, error));
    mesh_geometry_hash(m, hash);
    if (strcmp(recorded, hash) != 0)
        check_say(c, VERDICT_BROKEN, "geometry_hash is %.32s, the mesh gives %s", recorded, hash);
    if (e->row_sums == NULL && !store_has(e->s, STORE_OPERATOR "/direct"))
        check_say(c, VERDICT_BROKEN, STORE_MESH "/row_sums is missing");
    for (size_t i = 0; i < m->n && e->row_sums != NULL && c->verdict == VERDICT_OK; i++)
        if (!(e->row_sums[i] >= 0 && e->row_sums[i] <= most + 1e-6))
            check_say(c, VERDICT_BROKEN, "row_sums[%zu] = %.9g, must be from 0 to %g", i, e->row_sums[i],
                      most);
    for (size_t i = 0; i < m->n_channels * m->n && c->verdict == VERDICT_OK; i++) {
        const double rho = (double)m->reflectance[i], emitted = (double)m->emission[i];
        if (!(rho >= 0 && rho < 1))
            check_say(c, VERDICT_BROKEN, "reflectance[%zu] = %g, must be at least 0 and below 1", i, rho);
        if (!(emitted >= 0 && isfinite(emitted)))
            check_say(c, VERDICT_BROKEN, "emission[%zu] = %g %s, must be at least 0", i, emitted, unit);
        if (mesh_is_pane(m, i % m->n) && rho > 1 - mesh_pane_passes(m, i % m->n, 1) + 1e-6)
            check_say(c, VERDICT_BROKEN,
                      "element %zu of a pane reflects %g and passes %g: more light than comes to it",
                      i % m->n, rho, mesh_pane_passes(m, i % m->n, 1));
    }
    if (c->verdict == VERDICT_OK) TRY(measure_again(m, c, error));
done:
    free(recorded);
    return check_failed(c, status, error);
}

static int compare_index(const void *a, const void *b) {
    const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

/* F[i][j], by search in row i. */
static double entry(const csr *F, size_t i, uint32_t j) {
    const uint32_t *first = F->indices + F->indptr[i];
    const uint32_t *at =
        bsearch(&j, first, (size_t)(F->indptr[i + 1] - F->indptr[i]), sizeof j, compare_index);
    return at == NULL ? 0 : (double)F->data[F->indptr[i] + (uint64_t)(at - first)];
}

/* Blocks have been checked once they are loaded; their row sums here. */
static lam_status verify_blocks(examination *e, check *c, lam_error *error) {
    const lam_status loaded = form_factors_load_blocks(e->s, &e->m, &e->tree, &e->blocks, &e->f, error);
    if (loaded != LAM_OK) {
        block_factors_free(&e->blocks);
        plane_tree_free(&e->tree);
        return check_failed(c, loaded, error);
    }
    for (size_t i = 0; i < e->m.n; i++) /* The same sums in another order at most. */
        if (!(fabs(e->f.row_sums[i] - e->row_sums[i]) <= 1e-6)) {
            check_say(c, VERDICT_BROKEN, "row %zu sums to %.9g, /mesh/row_sums says %.9g", i,
                      e->f.row_sums[i], e->row_sums[i]);
            return LAM_OK;
        }
    check_say(c, VERDICT_OK, "%zu blocks, none is negative, row sums agree with /mesh/row_sums",
              e->blocks.n_blocks);
    return LAM_OK;
}

lam_status verify_form_factors(examination *e, check *c, lam_error *error) {
    form_factor_storage how = STORAGE_ROWS;
    if (!e->has_mesh || !store_has(e->s, STORE_FORM_FACTORS)) {
        check_say(c, VERDICT_SKIPPED, e->has_mesh ? "none are kept" : "no mesh to compare with");
        return LAM_OK;
    }
    lam_status loaded = form_factors_storage(e->s, &how, error);
    if (loaded == LAM_OK && how == STORAGE_BLOCKS) return verify_blocks(e, c, error);
    if (loaded == LAM_OK) loaded = form_factors_load(e->s, &e->m, NULL, &e->f, error);
    if (loaded == LAM_OK) loaded = form_factors_expand(&e->f, e->m.area, error);
    if (loaded != LAM_OK) return check_failed(c, loaded, error);
    const csr *F = &e->f.F;
    const double *A = e->m.area;
    double worst = 0;
    const double most = mesh_row_most(&e->m);
    for (size_t i = 0; i < F->n; i++) {
        double sum = 0;
        for (uint64_t p = F->indptr[i]; p < F->indptr[i + 1]; p++) {
            const uint32_t j = F->indices[p];
            const double there = A[i] * (double)F->data[p], back = A[j] * entry(F, j, (uint32_t)i);
            sum += (double)F->data[p];
            if (there > 0 || back > 0) worst = fmax(worst, fabs(there - back) / fmax(there, back));
            if (j == i && F->data[p] > 0) {
                check_say(c, VERDICT_BROKEN, "F[%zu][%zu] = %g: a plane cannot see itself", i, i,
                          (double)F->data[p]);
                return LAM_OK;
            }
        }
        /* Single precision rounds each of the row's entries by 6e-8 of itself. */
        if (sum > most + 1e-6 || fabs(sum - e->row_sums[i]) > 1e-6) {
            check_say(c, VERDICT_BROKEN, "row %zu sums to %.9g, /mesh/row_sums says %.9g", i, sum,
                      e->row_sums[i]);
            return LAM_OK;
        }
    }
    check_say(c, worst <= 1e-6 ? VERDICT_OK : VERDICT_BROKEN,
              "reciprocity within %.2g (at most 1e-6), rows sum "
              "to at most %g",
              worst, most);
    return LAM_OK;
}

/* Per group of fronts: area, then area times reflectance and emission of every channel. Refinement changes
 * none. */
static double *group_content(const mesh *m, size_t width, lam_error *error) {
    double *content = memory_allocate(m->n_groups, width * sizeof *content, "groups", error);
    if (content == NULL) return NULL;
    for (size_t i = 0; i < m->n - m->n_backs; i++) {
        double *of = content + m->group[i] * width;
        of[0] += m->area[i];
        for (size_t k = 0; k < m->n_channels; k++) {
            of[1 + 2 * k] += m->area[i] * (double)m->reflectance[k * m->n + i];
            of[2 + 2 * k] += m->area[i] * (double)m->emission[k * m->n + i];
        }
    }
    return content;
}

/* Groups that are not of backs alone: these lie behind the others. */
static size_t count_front_groups(const mesh *m) {
    size_t n = 0;
    for (size_t i = 0; i < m->n - m->n_backs; i++)
        if (m->group[i] >= n) n = m->group[i] + (size_t)1;
    return n;
}

/* The panes of the scene now, where the file says what they are; those of the store, where --glass did. */
static lam_status settle_panes(const mesh *stored, mesh *now, lam_error *error) {
    lam_status status = LAM_OK;
    glass_report ignored;
    for (size_t g = 0; stored->glass_given && g < now->n_groups && g < stored->n_glass; g++)
        TRY(mesh_set_glass(now, g, &stored->glass[g], error));
    TRY(mesh_settle_glass(now, &ignored, error));
done:
    return status;
}

static double passes(const mesh *m, size_t group) {
    return m->glass != NULL ? m->glass[group].transmittance : 0;
}

/* The same groups with the same materials, by their fronts. */
static lam_status compare_groups(const mesh *stored, const mesh *now, check *c, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n_groups = count_front_groups(stored);
    const size_t width = 1 + 2 * stored->n_channels;
    double *a = NULL, *b = NULL;
    if (n_groups != now->n_groups || stored->n_channels != now->n_channels) {
        check_say(c, VERDICT_BROKEN, "stale: %zu groups in %zu channels, the scene has %zu in %zu", n_groups,
                  stored->n_channels, now->n_groups, now->n_channels);
        return LAM_OK;
    }
    a = group_content(stored, width, error);
    b = group_content(now, width, error);
    if (a == NULL || b == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t g = 0; g < n_groups && c->verdict == VERDICT_OK; g++) {
        bool same = strcmp(stored->group_names[g], now->group_names[g]) == 0;
        /* Sums over other pieces of the same faces. */
        for (size_t k = 0; k < width; k++)
            same = same && fabs(a[g * width + k] - b[g * width + k]) <=
                               1e-5 * fmax(fabs(a[g * width + k]), 1e-6 * a[g * width]);
        same = same && fabs(passes(stored, g) - passes(now, g)) <= 1e-9;
        if (!same)
            check_say(c, VERDICT_BROKEN, "stale: group %s has another material or size in the scene",
                      stored->group_names[g]);
    }
done:
    free(a);
    free(b);
    return status;
}

lam_status verify_scene(examination *e, check *c, lam_error *error) {
    lam_status status = LAM_OK;
    mesh now = {0};
    import_report report;
    double reflectance = -1;
    if (e->scene == NULL || !e->has_mesh) {
        check_say(c, VERDICT_SKIPPED, e->scene == NULL ? "no scene given" : "no mesh to compare with");
        return LAM_OK;
    }
    if (store_has_attribute(e->s, STORE_MESH, "reflectance_given"))
        TRY(store_get_number(e->s, STORE_MESH, "reflectance_given", &reflectance, error));
    const import_options how = {.unit = e->m.unit,
                                .up = e->m.up,
                                .reflectance = reflectance,
                                .two_sided = e->m.two_sided,
                                .fronts_only = e->m.n_backs == 0,
                                .assets = e->assets};
    TRY(scene_import(e->scene, &how, &now, &report, error));
    check_say(c, VERDICT_OK, "%s has the same geometry and materials", e->scene);
    if (strcmp(now.source_hash, e->m.source_hash) != 0)
        check_say(c, VERDICT_BROKEN, "stale: %s has another geometry (%s, stored: %s)", e->scene,
                  now.source_hash, e->m.source_hash);
    else
        TRY(settle_panes(&e->m, &now, error));
    if (c->verdict == VERDICT_OK) TRY(compare_groups(&e->m, &now, c, error));
done:
    mesh_free(&now);
    return check_failed(c, status, error);
}
