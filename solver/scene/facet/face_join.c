/* Faces of one material and one group that lie in a plane, joined into larger ones. */
#include "solver/scene/facet/face_join.h"

#include "solver/scene/facet/polygon_join.h"
#include "solver/scene/mesh_cells.h"
#include "solver/scene/mesh_refined.h"
#include "solver/scene/texture.h"

#include <stdlib.h>
#include <string.h>

/* Corners that deviate less, in radii of the scene, lie in a line or a plane. */
static const double flat = 1e-7;

/* A face by all that its parts inherit. */
typedef struct labelled_face {
    const mesh *m;
    uint32_t face;
} labelled_face;

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
    if (!is_textured(m, i) && !is_textured(m, j)) return 0;
    return i < j ? -1 : i > j;
}

static int by_material(const void *left, const void *right) {
    const labelled_face *a = left, *b = right;
    const int order = compare_material(a->m, a->face, b->face);
    if (order != 0) return order;
    return a->face < b->face ? -1 : a->face > b->face;
}

/* label [n]: the first face of the same material and group. */
static lam_status label_faces(const mesh *m, uint32_t *label, lam_error *error) {
    labelled_face *order = memory_allocate(m->n, sizeof *order, "joined faces", error);
    if (order == NULL) return LAM_ERR_MEMORY;
    for (uint32_t i = 0; i < m->n; i++) order[i] = (labelled_face){m, i};
    qsort(order, m->n, sizeof *order, by_material);
    for (size_t k = 0; k < m->n; k++) {
        const uint32_t face = order[k].face;
        const bool same = k > 0 && compare_material(m, order[k - 1].face, face) == 0;
        label[face] = same ? label[order[k - 1].face] : face;
    }
    free(order);
    return LAM_OK;
}

static lam_status make_mesh(const mesh *m, size_t n, const joined_polygon *faces, mesh *out,
                            lam_error *error) {
    lam_status status = LAM_OK;
    refined_mesh joined = {.n = 0};
    TRY(refined_mesh_begin(m, n, &joined, error));
    for (size_t i = 0; i < n; i++) {
        double corner[4][3];
        for (uint32_t c = 0; c < faces[i].n; c++)
            memcpy(corner[c], m->vertices[faces[i].corner[c]], sizeof corner[c]);
        joined.face[i] = faces[i].first;
        TRY(refined_mesh_add(&joined, i, faces[i].n, (const double(*)[3])corner, error));
    }
    TRY(refined_mesh_end(&joined, m, out, error));
done:
    refined_mesh_free(&joined);
    return status;
}

lam_status faces_join(mesh *m, lam_error *error) {
    lam_status status = LAM_OK;
    uint32_t *label = memory_allocate(m->n, sizeof *label, "joined faces", error);
    joined_polygon *faces = NULL;
    size_t n_faces = 0;
    double centre[3], radius;
    mesh joined = {0};
    if (label == NULL) TRY(LAM_ERR_MEMORY);
    TRY(label_faces(m, label, error));
    mesh_bounds(m, centre, &radius);
    const polygon_joining how = {.n = m->n,
                                 .polygons = (const uint32_t(*)[4])m->elements,
                                 .label = label,
                                 .within_labels = true,
                                 .corners = 4,
                                 .slack = flat * radius};
    TRY(polygons_join(m, &how, &faces, &n_faces, error));
    if (n_faces == m->n) goto done;
    TRY(make_mesh(m, n_faces, faces, &joined, error));
    mesh_replace(m, &joined);
done:
    free(label);
    free(faces);
    return status;
}
