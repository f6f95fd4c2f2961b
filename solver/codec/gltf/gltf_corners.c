/* The parts of a glTF file with corners that elements share: polygons, and the weights of corners. */
#include "solver/codec/gltf/gltf_polygon.h"
#include "solver/codec/gltf/gltf_writer.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A place of an element's polygon: `share` of the way from a corner to the next. */
typedef struct ring_place {
    size_t corner;
    float share;
} ring_place;

/* Where the places to write next are. */
typedef struct part_writer {
    gltf_writer *w;
    char *position, *normal, *element, *face, *corner, *index, *texcoord, *reflectance;
    uint32_t written; /* vertices */
    uint32_t *next, (*triangles)[3];
    ring_place *places; /* of the element */
} part_writer;

static const uint32_t *ring_of(const gltf_mesh *m, size_t i) {
    return m->corners->nodes->ring + m->corners->nodes->ring_start[i];
}

static const bool *inside_of(const gltf_mesh *m, size_t i) {
    return m->corners->nodes->inside + m->corners->nodes->ring_start[i];
}

size_t gltf_count_shared(const gltf_mesh *m, const gltf_part *p) {
    const uint32_t *elements = gltf_elements_of(m, p->group);
    size_t count = 0;
    for (size_t j = 0; j < p->n_elements; j++) {
        const uint32_t *ring = ring_of(m, elements[j]);
        const size_t places = gltf_ring_count(m, elements[j]);
        for (size_t k = 0; k < places; k++)
            if (ring[k] >= p->vertex + count) count = ring[k] - p->vertex + 1;
    }
    return count;
}

static double distance(const double a[3], const double b[3]) {
    double square = 0;
    for (int d = 0; d < 3; d++) square += (a[d] - b[d]) * (a[d] - b[d]);
    return sqrt(square);
}

static void find_places(const gltf_mesh *m, size_t i, ring_place *places) {
    const size_t count = gltf_ring_count(m, i), corners = gltf_corners_of(m, i);
    const bool *inside = inside_of(m, i);
    size_t corner = 0;
    for (size_t k = 0; k < count; k++) {
        corner += k > 0 && !inside[k];
        places[k] = (ring_place){corner, 0};
        if (!inside[k]) continue;
        const double *a = m->vertices[m->elements[i][corner]],
                     *b = m->vertices[m->elements[i][(corner + 1) % corners]];
        const double length = distance(a, b);
        if (length > 0)
            places[k].share = (float)fmin(1, distance(a, m->vertices[gltf_ring_vertex(m, i, k)]) / length);
    }
}

static void mix(const float *a, const float *b, float share, size_t count, float *out) {
    for (size_t d = 0; d < count; d++) out[d] = share > 0 ? a[d] + share * (b[d] - a[d]) : a[d];
}

/* Writes a place of element i, the jth of its group. */
static void put_place(part_writer *at, const gltf_part *p, size_t j, size_t i, size_t k) {
    const gltf_writer *w = at->w;
    const gltf_mesh *m = w->m;
    const ring_place *place = &at->places[k];
    const size_t after = (place->corner + 1) % gltf_corners_of(m, i);
    float normal[3], texcoord[2], length = 0;
    mix(w->normals[4 * j + place->corner], w->normals[4 * j + after], place->share, 3, normal);
    for (int d = 0; d < 3; d++) length += normal[d] * normal[d];
    for (int d = 0; d < 3 && place->share > 0 && length > 0; d++) normal[d] /= sqrtf(length);
    at->position = gltf_put_vector(at->position, w->s.position[gltf_ring_vertex(m, i, k)]);
    at->normal = gltf_put_vector(at->normal, normal);
    at->element = gltf_put_float(at->element, (float)i);
    at->face = gltf_put_float(at->face, gltf_face_number(m, i));
    at->corner = gltf_put_float(at->corner, (float)ring_of(m, i)[k]);
    at->written++;
    if (p->surface == PICTURE_NONE) return;
    const float(*of)[2] = (const float(*)[2])w->pictures->texcoord[i];
    mix(of[place->corner], of[after], place->share, 2, texcoord);
    at->texcoord = gltf_put_float(gltf_put_float(at->texcoord, texcoord[0]), texcoord[1]);
    for (size_t c = 0; c < 3; c++)
        at->reflectance =
            gltf_put_float(at->reflectance, m->reflectance[(m->n_channels == 3 ? c * m->n : 0) + i]);
}

/* Writes the vertices of an element: of shared ones those that no element before it has, which are its
 * corners and then those inside its edges, as they are numbered. */
static void put_vertices(part_writer *at, const gltf_part *p, size_t j, size_t i) {
    const gltf_mesh *m = at->w->m;
    const size_t count = gltf_ring_count(m, i);
    const bool *inside = inside_of(m, i);
    find_places(m, i, at->places);
    for (int pass = 0; pass < (m->corners->shared ? 2 : 1); pass++)
        for (size_t k = 0; k < count; k++)
            if (!m->corners->shared ||
                (inside[k] == (pass == 1) && ring_of(m, i)[k] == p->vertex + at->written))
                put_place(at, p, j, i, k);
}

static void put_triangles(part_writer *at, const gltf_part *p, size_t i, uint32_t first) {
    const gltf_mesh *m = at->w->m;
    const size_t count = gltf_ring_count(m, i);
    gltf_polygon(count, inside_of(m, i), at->next, at->triangles);
    for (size_t t = 0; t + 2 < count; t++)
        for (int k = 0; k < 3; k++) {
            const uint32_t place = at->triangles[t][k];
            at->index = gltf_put(at->index, m->corners->shared ? ring_of(m, i)[place] - (uint32_t)p->vertex
                                                               : first + place);
        }
}

lam_status gltf_put_corners(gltf_writer *w, const gltf_part *p, char *to, lam_error *error) {
    lam_status status = LAM_OK;
    const gltf_mesh *m = w->m;
    const uint32_t *elements = gltf_elements_of(m, p->group);
    size_t most = 4;
    part_writer at = {.w = w,
                      .position = to + w->view[GLTF_VIEW_POSITION] + 12 * p->vertex,
                      .normal = to + w->view[GLTF_VIEW_NORMAL] + 12 * p->vertex,
                      .element = to + w->view[GLTF_VIEW_ELEMENT] + 4 * p->vertex,
                      .face = to + w->view[GLTF_VIEW_FACE] + 4 * p->vertex,
                      .corner = to + w->view[w->map_view] + 4 * p->vertex,
                      .index = to + w->view[GLTF_VIEW_INDEX] + 4 * p->index};
    if (p->surface != PICTURE_NONE) {
        at.texcoord = to + w->view[GLTF_VIEW_TEXCOORD] + 8 * p->textured_vertex;
        at.reflectance = to + w->view[GLTF_VIEW_REFLECTANCE] + 12 * p->textured_vertex;
    }
    for (size_t j = 0; j < p->n_elements; j++)
        if (gltf_ring_count(m, elements[j]) > most) most = gltf_ring_count(m, elements[j]);
    at.next = memory_allocate(most, sizeof *at.next, "glTF", error);
    at.triangles = memory_allocate(most, sizeof *at.triangles, "glTF", error);
    at.places = memory_allocate(most, sizeof *at.places, "glTF", error);
    if (at.next == NULL || at.triangles == NULL || at.places == NULL) TRY(LAM_ERR_MEMORY);
    TRY(corner_normals_of_group(&w->s, p->group, w->normals, error));
    for (size_t j = 0; j < p->n_elements; j++) {
        const uint32_t first = at.written;
        put_vertices(&at, p, j, elements[j]);
        put_triangles(&at, p, elements[j], first);
    }
    assert(at.written == p->n_vertices);
done:
    free(at.next);
    free(at.triangles);
    free(at.places);
    return status;
}

/* Parts, first, columns, weights. */
size_t gltf_blob_bytes(const gltf_writer *w, size_t k) {
    const corner_matrix *m = w->m->corners->matrix;
    return sizeof(uint32_t) * (k == 0   ? m->n_nodes + 1
                               : k == 1 ? m->rows.n_rows + 1
                                        : m->rows.first[m->rows.n_rows]);
}

void gltf_put_blobs(const gltf_writer *w, char *to) {
    if (w->n_blobs == 0) return;
    const corner_matrix *m = w->m->corners->matrix;
    const corner_rows *rows = &m->rows;
    const size_t *view = w->view + w->n_views + w->n_images, count = rows->first[rows->n_rows];
    char *parts = to + view[0], *first = to + view[1], *columns = to + view[2], *weights = to + view[3];
    for (size_t j = 0; j <= m->n_nodes; j++) parts = gltf_put(parts, m->parts[j]);
    for (size_t j = 0; j <= rows->n_rows; j++) first = gltf_put(first, rows->first[j]);
    for (size_t k = 0; k < count; k++) {
        columns = gltf_put(columns, rows->columns[k]);
        weights = gltf_put_float(weights, rows->weights[k]);
    }
}
