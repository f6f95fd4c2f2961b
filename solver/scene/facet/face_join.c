/* Faces of one material and one group that lie in a plane, joined into larger ones. */
#include "solver/scene/facet/face_join.h"

#include "solver/scene/facet/polygon_join.h"
#include "solver/scene/mesh_cells.h"
#include "solver/scene/texture.h"

#include <stdlib.h>
#include <string.h>

/* Corners that deviate less, in radii of the scene, lie in a line or a plane. */
static const double flat = 1e-7;

static int compare_bits(const float *values, size_t n, size_t n_channels, uint32_t i, uint32_t j) {
    for (size_t c = 0; c < n_channels; c++) {
        const int order = memcmp(&values[c * n + i], &values[c * n + j], sizeof *values);
        if (order != 0) return order;
    }
    return 0;
}

static bool is_textured(const mesh *m, uint32_t face) {
    return m->textured_face != NULL && m->textured_face[face] != TEXTURE_NONE;
}

/* 0 where the faces may be one. The image of a texture is laid on each face by itself. */
static int compare_material(const mesh *m, uint32_t i, uint32_t j) {
    if (m->group[i] != m->group[j]) return m->group[i] < m->group[j] ? -1 : 1;
    const int reflectance = compare_bits(m->reflectance, m->n, m->n_channels, i, j);
    if (reflectance != 0) return reflectance;
    const int emission = compare_bits(m->emission, m->n, m->n_channels, i, j);
    if (emission != 0) return emission;
    if (m->has_back != NULL && m->has_back[i] != m->has_back[j]) return m->has_back[i] ? 1 : -1;
    if (!is_textured(m, i) && !is_textured(m, j)) return 0;
    return i < j ? -1 : i > j;
}

static int by_material(const void *left, const void *right, void *of) {
    const uint32_t i = *(const uint32_t *)left, j = *(const uint32_t *)right;
    const int order = compare_material(of, i, j);
    if (order != 0) return order;
    return i < j ? -1 : i > j;
}

/* label [n]: the first face of the same material and group. */
static lam_status label_faces(mesh *m, uint32_t *label, lam_error *error) {
    uint32_t *order = memory_allocate(m->n, sizeof *order, "joined faces", error);
    if (order == NULL) return LAM_ERR_MEMORY;
    for (uint32_t i = 0; i < m->n; i++) order[i] = i;
    qsort_r(order, m->n, sizeof *order, by_material, m);
    for (size_t k = 0; k < m->n; k++) {
        const bool same = k > 0 && compare_material(m, order[k - 1], order[k]) == 0;
        label[order[k]] = same ? label[order[k - 1]] : order[k];
    }
    free(order);
    return LAM_OK;
}

/* cells [n], the caller's. */
static lam_status cells_of(const mesh *m, size_t n, const joined_polygon *faces, mesh_cell **out,
                           lam_error *error) {
    mesh_cell *cells = memory_allocate(n, sizeof *cells, "joined faces", error);
    if (cells == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < n; i++) {
        cells[i].face = faces[i].first;
        cells[i].n = faces[i].n;
        for (uint32_t c = 0; c < faces[i].n; c++)
            memcpy(cells[i].corner[c], m->vertices[faces[i].corner[c]], sizeof cells[i].corner[c]);
    }
    *out = cells;
    return LAM_OK;
}

void faces_before_free(faces_before *b) {
    free(b->vertices);
    free(b->elements);
    free(b->face);
    free(b->start);
    free(b->order);
    *b = (faces_before){.n = 0};
}

/* Takes the faces of m over, of which each became a part of the face joined[k] of by, and numbers those. */
static lam_status keep_before(mesh *m, const uint32_t *joined, mesh *by, faces_before *out,
                              lam_error *error) {
    lam_status status = LAM_OK;
    faces_before b = {.n_joined = by->n};
    b.start = memory_allocate(by->n + 1, sizeof *b.start, "joined faces", error);
    b.order = memory_allocate(m->n, sizeof *b.order, "joined faces", error);
    if (b.start == NULL || b.order == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < m->n; k++)
        if (joined[k] != MESH_NO_VERTEX) b.start[joined[k]]++;
    for (size_t j = 0; j < by->n; j++) b.start[j + 1] += b.start[j];
    for (size_t k = m->n; k-- > 0;) /* the ends become the beginnings */
        if (joined[k] != MESH_NO_VERTEX) b.order[--b.start[joined[k]]] = (uint32_t)k;
    b.n = m->n;
    b.vertices = m->vertices, b.elements = m->elements, b.face = m->faces.of;
    m->vertices = NULL, m->elements = NULL, m->faces.of = NULL;
    for (uint32_t j = 0; j < by->n; j++) by->faces.of[j] = j;
    *out = b;
    b = (faces_before){.n = 0};
done:
    faces_before_free(&b);
    return status;
}

lam_status faces_join(mesh *m, faces_before *before, lam_error *error) {
    lam_status status = LAM_OK;
    uint32_t *label = memory_allocate(m->n, sizeof *label, "joined faces", error);
    joined_polygon *faces = NULL;
    mesh_cell *cells = NULL;
    uint32_t *unions = memory_allocate(m->n, sizeof *unions, "joined faces", error);
    size_t n_faces = 0;
    double centre[3], radius;
    mesh joined = {0};
    if (label == NULL || unions == NULL) TRY(LAM_ERR_MEMORY);
    TRY(label_faces(m, label, error));
    mesh_bounds(m, centre, &radius);
    const polygon_join_options how = {.n = m->n,
                                      .polygons = (const uint32_t(*)[4])m->elements,
                                      .label = label,
                                      .within_labels = true,
                                      .corners = 4,
                                      .slack = flat * radius,
                                      .joined = unions};
    TRY(polygons_join(m, &how, &faces, &n_faces, error));
    if (n_faces == m->n) goto done;
    TRY(cells_of(m, n_faces, faces, &cells, error));
    TRY(mesh_of_cells(m, n_faces, cells, &joined, error));
    if (before == NULL) scene_faces_free(&joined.faces);
    if (before != NULL && m->faces.of != NULL) TRY(keep_before(m, unions, &joined, before, error));
    mesh_replace(m, &joined);
done:
    mesh_free(&joined);
    free(unions);
    free(label);
    free(faces);
    free(cells);
    return status;
}
