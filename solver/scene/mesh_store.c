/* /mesh and /cameras of a store: written as it is, read back with every index and value checked. */
#include "solver/base/scene/scene_backs.h"
#include "solver/base/scene/scene_buried.h"
#include "solver/base/scene/scene_lights.h"
#include "solver/scene/mesh.h"

#include "solver/scene/coincident.h"
#include "solver/scene/glass.h"
#include "solver/scene/texture.h"
#include "store/groups.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

lam_status mesh_save(const mesh *m, const double *row_sums, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    char hash[33];
    const char up[2] = {m->up, '\0'};
    const size_t of_vertices[2] = {m->n_vertices, 3}, of_elements[2] = {m->n, 4}, of_normals[2] = {m->n, 3};
    const size_t of_channels[2] = {m->n_channels, m->n};
    mesh_geometry_hash(m, hash);
    TRY(store_write(s, STORE_MESH "/vertices", STORE_F64, 2, of_vertices, m->vertices, error));
    TRY(store_write(s, STORE_MESH "/elements", STORE_U32, 2, of_elements, m->elements, error));
    TRY(store_write(s, STORE_MESH "/area", STORE_F64, 1, &m->n, m->area, error));
    TRY(store_write(s, STORE_MESH "/normal", STORE_F32, 2, of_normals, m->normal, error));
    TRY(store_write(s, STORE_MESH "/reflectance", STORE_F32, 2, of_channels, m->reflectance, error));
    TRY(store_write(s, STORE_MESH "/emission", STORE_F32, 2, of_channels, m->emission, error));
    TRY(store_write(s, STORE_MESH "/group", STORE_U32, 1, &m->n, m->group, error));
    TRY(store_write_texts(s, STORE_MESH "/group_names", m->n_groups, (const char *const *)m->group_names,
                          error));
    TRY(scene_faces_save(&m->faces, m->n, m->n - m->n_backs, m->area, s, error));
    TRY(scene_buried_save(m->buried, m->n, s, error));
    if (m->overlap != NULL)
        TRY(store_write(s, STORE_MESH "/overlap", STORE_F64, 1, &m->n_groups, m->overlap, error));
    TRY(mesh_save_glass(m, s, error));
    if (m->overlap != NULL) TRY(store_set_number(s, STORE_MESH, "overlap_area", mesh_overlap_area(m), error));
    if (row_sums != NULL) TRY(store_write(s, STORE_MESH "/row_sums", STORE_F64, 1, &m->n, row_sums, error));
    TRY(scene_pictures_save(m->pictures, m->n, s, error));
    TRY(store_set_text(s, STORE_MESH, "geometry_hash", hash, error));
    TRY(store_set_text(s, STORE_MESH, "source_hash", m->source_hash, error));
    TRY(store_set_text(s, STORE_MESH, "name", m->name, error));
    TRY(store_set_text(s, STORE_MESH, "up", up, error));
    TRY(store_set_number(s, STORE_MESH, "unit", m->unit, error));
    if (m->rounding > 0) TRY(store_set_number(s, STORE_MESH, "rounding", m->rounding, error));
    TRY(scene_lights_save(m->lights, s, error));
    TRY(scene_backs_save(m->n_backs, m->two_sided, s, error));
    TRY(scene_cameras_save(m->n_cameras, m->cameras, s, error));
done:
    return status;
}

/* An attribute of /mesh into a fixed array. */
static lam_status load_text(store *s, const char *name, char *out, size_t size, lam_error *error) {
    lam_status status = LAM_OK;
    char *text = NULL;
    TRY(store_get_text(s, STORE_MESH, name, &text, error));
    if (strlen(text) >= size)
        FAIL(error, LAM_ERR_FORMAT, "%s: /mesh attribute %s is longer than %zu bytes", store_path(s), name,
             size - 1);
    strcpy(out, text);
done:
    free(text);
    return status;
}

static lam_status load_attributes(store *s, mesh *m, lam_error *error) {
    lam_status status = LAM_OK;
    char up[8];
    TRY(load_text(s, "source_hash", m->source_hash, sizeof m->source_hash, error));
    TRY(load_text(s, "name", m->name, sizeof m->name, error));
    TRY(load_text(s, "up", up, sizeof up, error));
    TRY(store_get_number(s, STORE_MESH, "unit", &m->unit, error));
    if (store_has_attribute(s, STORE_MESH, "rounding"))
        TRY(store_get_number(s, STORE_MESH, "rounding", &m->rounding, error));
    if (strlen(up) != 1 || strchr("xyz", up[0]) == NULL)
        FAIL(error, LAM_ERR_FORMAT, "%s: /mesh attribute up is '%s', must be x, y or z", store_path(s), up);
    if (!(m->rounding >= 0) || !isfinite(m->rounding))
        FAIL(error, LAM_ERR_FORMAT, "%s: /mesh attribute rounding is %g, must be 0 or more", store_path(s),
             m->rounding);
    if (!(m->unit > 0) || !isfinite(m->unit))
        FAIL(error, LAM_ERR_FORMAT, "%s: /mesh attribute unit is %g, must be positive", store_path(s),
             m->unit);
    m->up = up[0];
    TRY(scene_lights_load(s, &m->lights, error));
done:
    return status;
}

/* Reads an array of doubles and checks that low <= value (low < value when strict) and that it is finite. */
static lam_status load_f64(store *s, const char *name, size_t n, double low, bool strict, double **out,
                           lam_error *error) {
    lam_status status = LAM_OK;
    void *data = NULL;
    TRY(store_read(s, name, STORE_F64, 1, &n, &data, error));
    const double *values = data;
    for (size_t i = 0; i < n; i++)
        if (!isfinite(values[i]) || values[i] < low || (strict && values[i] == low))
            FAIL(error, LAM_ERR_FORMAT, "%s: %s[%zu] = %g, must be %s %g and finite", store_path(s), name, i,
                 values[i], strict ? "above" : "at least", low);
    *out = data;
    data = NULL;
done:
    free(data);
    return status;
}

static lam_status load_geometry(store *s, mesh *m, lam_error *error) {
    lam_status status = LAM_OK;
    void *data = NULL;
    size_t of_vertices[2] = {SIZE_MAX, 3}, of_elements[2] = {SIZE_MAX, 4};
    char stated[33], found[33];
    TRY(store_read(s, STORE_MESH "/vertices", STORE_F64, 2, of_vertices, &data, error));
    m->vertices = data;
    m->n_vertices = of_vertices[0];
    TRY(store_read(s, STORE_MESH "/elements", STORE_U32, 2, of_elements, &data, error));
    m->elements = data;
    m->n = of_elements[0];
    for (size_t v = 0; v < m->n_vertices; v++)
        for (int k = 0; k < 3; k++)
            if (!isfinite(m->vertices[v][k]))
                FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/vertices[%zu][%d] = %g, must be finite", store_path(s),
                     v, k, m->vertices[v][k]);
    for (size_t i = 0; i < m->n; i++)
        for (int k = 0; k < 4; k++)
            if (m->elements[i][k] >= m->n_vertices && !(k == 3 && m->elements[i][k] == MESH_NO_VERTEX))
                FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/elements[%zu][%d] = %u, there are %zu vertices",
                     store_path(s), i, k, m->elements[i][k], m->n_vertices);
    if (m->n == 0 || m->n >= MESH_NO_VERTEX)
        FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/elements holds %zu elements, must be 1 to 2^32 - 2",
             store_path(s), m->n);
    TRY(scene_backs_load(s, m->n, &m->n_backs, &m->two_sided, error));
    TRY(load_text(s, "geometry_hash", stated, sizeof stated, error));
    mesh_geometry_hash(m, found);
    if (strcmp(stated, found) != 0)
        FAIL(error, LAM_ERR_DAMAGED, "%s: /mesh: geometry_hash says %s, the geometry has %s", store_path(s),
             stated, found);
done:
    return status;
}

/* reflectance or emission: [C][n], at least 0 and below limit. */
static lam_status load_channels(store *s, const char *name, float limit, size_t dims[2], float **out,
                                lam_error *error) {
    lam_status status = LAM_OK;
    void *data = NULL;
    TRY(store_read(s, name, STORE_F32, 2, dims, &data, error));
    const float *values = data;
    for (size_t i = 0; i < dims[0] * dims[1]; i++)
        if (!(values[i] >= 0) || !(values[i] < limit))
            FAIL(error, LAM_ERR_FORMAT, "%s: %s[%zu][%zu] = %g, must be in [0, %g)", store_path(s), name,
                 i / dims[1], i % dims[1], (double)values[i], (double)limit);
    *out = data;
    data = NULL;
done:
    free(data);
    return status;
}

lam_status mesh_load(store *s, mesh *m, double **row_sums, lam_error *error) {
    lam_status status = LAM_OK;
    mesh loaded = {0};
    double *sums = NULL;
    void *data = NULL;
    TRY(load_attributes(s, &loaded, error));
    TRY(load_geometry(s, &loaded, error));
    TRY(load_f64(s, STORE_MESH "/area", loaded.n, 0, true, &loaded.area, error));
    size_t of_normals[2] = {loaded.n, 3};
    TRY(store_read(s, STORE_MESH "/normal", STORE_F32, 2, of_normals, &data, error));
    loaded.normal = data;
    for (size_t i = 0; i < loaded.n; i++)
        for (int k = 0; k < 3; k++)
            if (!isfinite(loaded.normal[i][k]))
                FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/normal[%zu][%d] = %g, must be finite", store_path(s),
                     i, k, (double)loaded.normal[i][k]);
    size_t of_channels[2] = {SIZE_MAX, loaded.n};
    TRY(load_channels(s, STORE_MESH "/reflectance", 1.f, of_channels, &loaded.reflectance, error));
    if (of_channels[0] == 0)
        FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/reflectance has no channel", store_path(s));
    loaded.n_channels = of_channels[0];
    TRY(load_channels(s, STORE_MESH "/emission", INFINITY, of_channels, &loaded.emission, error));
    TRY(store_read_texts(s, STORE_MESH "/group_names", &loaded.n_groups, &loaded.group_names, error));
    TRY(store_read(s, STORE_MESH "/group", STORE_U32, 1, &loaded.n, &data, error));
    loaded.group = data;
    for (size_t i = 0; i < loaded.n; i++)
        if (loaded.group[i] >= loaded.n_groups)
            FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/group[%zu] = %u, there are %zu group names", store_path(s),
                 i, loaded.group[i], loaded.n_groups);
    TRY(scene_faces_load(s, loaded.n, loaded.n - loaded.n_backs, &loaded.faces, error));
    TRY(scene_buried_load(s, loaded.n, &loaded.buried, error));
    if (store_has(s, STORE_MESH "/overlap")) {
        TRY(load_f64(s, STORE_MESH "/overlap", loaded.n_groups, 0, false, &loaded.overlap, error));
        for (size_t g = 0; g < loaded.n_groups; g++)
            if (loaded.overlap[g] > 1)
                FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/overlap[%zu] = %g, must be at most 1", store_path(s),
                     g, loaded.overlap[g]);
    }
    TRY(mesh_load_glass(s, &loaded, error));
    if (store_has(s, STORE_MESH "/row_sums") || store_has(s, STORE_FORM_FACTORS) || store_has(s, STORE_SKY))
        TRY(load_f64(s, STORE_MESH "/row_sums", loaded.n, 0, false, &sums, error));
    TRY(scene_cameras_load(s, &loaded.n_cameras, &loaded.cameras, error));
    TRY(scene_pictures_load(s, loaded.n, &loaded.pictures, error));
    *m = loaded;
    loaded = (mesh){0};
    if (row_sums != NULL) {
        *row_sums = sums;
        sums = NULL;
    }
done:
    mesh_free(&loaded);
    free(sums);
    return status;
}
