/* Measures, bounds and the hash of a mesh; refinement, order and storage have files of their own. */
#include "solver/scene/mesh.h"

#include "solver/scene/glass.h"
#include "solver/scene/plane.h"
#include "solver/scene/texture.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

void mesh_free(mesh *m) {
    free(m->vertices);
    free(m->elements);
    free(m->area);
    free(m->normal);
    free(m->group);
    free(m->group_names);
    free(m->overlap);
    free(m->glass);
    scene_faces_free(&m->faces);
    free(m->reflectance);
    free(m->emission);
    free(m->has_back);
    free(m->buried);
    mesh_textures_release(m);
    free(m->cameras);
    free(m->punctual);
    mesh_pictures_drop(m);
    *m = (mesh){0};
}

static void cross_of_differences(const double a[3], const double b[3], const double c[3], const double d[3],
                                 double out[3]) {
    const double u[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    const double v[3] = {d[0] - c[0], d[1] - c[1], d[2] - c[2]};
    out[0] = u[1] * v[2] - u[2] * v[1];
    out[1] = u[2] * v[0] - u[0] * v[2];
    out[2] = u[0] * v[1] - u[1] * v[0];
}

lam_status mesh_measure(mesh *m, lam_error *error) {
    lam_status status = LAM_OK;
    double *area = NULL;
    float(*normal)[3] = NULL;
    area = memory_allocate(m->n, sizeof *area, "element areas", error);
    normal = memory_allocate(m->n, sizeof *normal, "element normals", error);
    if (area == NULL || normal == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < m->n; i++) {
        const uint32_t *e = m->elements[i];
        const size_t corners = mesh_corners(m, i);
        for (size_t k = 0; k < corners; k++)
            if (e[k] >= m->n_vertices)
                FAIL(error, LAM_ERR_ARGUMENT, "element %zu: vertex index %u, there are %zu vertices", i, e[k],
                     m->n_vertices);
        const double(*v)[3] = (const double(*)[3])m->vertices;
        double twice[3]; /* twice the area vector of a planar quad: the cross product of its diagonals */
        if (corners == 3)
            cross_of_differences(v[e[0]], v[e[1]], v[e[0]], v[e[2]], twice);
        else
            cross_of_differences(v[e[0]], v[e[2]], v[e[1]], v[e[3]], twice);
        const double length = sqrt(twice[0] * twice[0] + twice[1] * twice[1] + twice[2] * twice[2]);
        if (!(length > 0) || !isfinite(length))
            FAIL(error, LAM_ERR_ARGUMENT, "element %zu: area %g, must be positive and finite", i, length / 2);
        area[i] = length / 2;
        for (int k = 0; k < 3; k++) normal[i][k] = (float)(twice[k] / length);
    }
    free(m->area);
    free(m->normal);
    m->area = area;
    m->normal = normal;
    area = NULL;
    normal = NULL;
done:
    free(area);
    free(normal);
    return status;
}

void mesh_geometry_hash(const mesh *m, char hash[33]) {
    struct {
        XXH128_hash_t vertices, elements;
        uint64_t n_vertices, n, two_sided;
    } parts;
    memset(&parts, 0, sizeof parts); /* padding is hashed too */
    parts.vertices = XXH3_128bits(m->vertices, m->n_vertices * sizeof *m->vertices);
    parts.elements = XXH3_128bits(m->elements, m->n * sizeof *m->elements);
    parts.n_vertices = m->n_vertices;
    parts.n = m->n;
    parts.two_sided = m->two_sided;
    XXH128_canonical_t bytes;
    XXH128_canonicalFromHash(&bytes, XXH3_128bits(&parts, sizeof parts));
    for (size_t i = 0; i < sizeof bytes.digest; i++) {
        hash[2 * i] = "0123456789abcdef"[bytes.digest[i] >> 4];
        hash[2 * i + 1] = "0123456789abcdef"[bytes.digest[i] & 15];
    }
    hash[32] = '\0';
}

void mesh_box(const mesh *m, double low[3], double high[3]) {
    for (int k = 0; k < 3; k++) low[k] = high[k] = m->n_vertices > 0 ? m->vertices[0][k] : 0;
    for (size_t v = 1; v < m->n_vertices; v++)
        for (int k = 0; k < 3; k++) {
            low[k] = fmin(low[k], m->vertices[v][k]);
            high[k] = fmax(high[k], m->vertices[v][k]);
        }
}

void mesh_bounds(const mesh *m, double centre[3], double *radius) {
    double low[3], high[3], square = 0;
    mesh_box(m, low, high);
    for (int k = 0; k < 3; k++) {
        centre[k] = low[k] + (high[k] - low[k]) / 2;
        square += (high[k] - low[k]) * (high[k] - low[k]);
    }
    *radius = sqrt(square) / 2;
}

void mesh_centroid(const mesh *m, size_t element, double centroid[3]) {
    const uint32_t *e = m->elements[element];
    const double *a = m->vertices[e[0]], *b = m->vertices[e[1]], *c = m->vertices[e[2]];
    if (mesh_corners(m, element) == 3) {
        for (int k = 0; k < 3; k++) centroid[k] = a[k] + ((b[k] - a[k]) + (c[k] - a[k])) / 3;
        return;
    }
    const double *d = m->vertices[e[3]];
    const double area_abc = triangle_area(a, b, c), area_acd = triangle_area(a, c, d);
    const double share = area_abc + area_acd > 0 ? area_acd / (area_abc + area_acd) : 0;
    for (int k = 0; k < 3; k++)
        centroid[k] = a[k] + ((c[k] - a[k]) + (1 - share) * (b[k] - a[k]) + share * (d[k] - a[k])) / 3;
}

/* Renumbers the groups that still have elements. Names lie in one block, in order. number [n_groups] is
 * scratch. */
static void drop_empty_groups(mesh *m, uint32_t *number) {
    uint32_t kept = 0;
    memset(number, 0, m->n_groups * sizeof *number);
    for (size_t i = 0; i < m->n; i++) number[m->group[i]] = 1;
    for (size_t g = 0; g < m->n_groups; g++) {
        if (number[g] == 0) continue;
        m->group_names[kept] = m->group_names[g];
        if (m->overlap != NULL) m->overlap[kept] = m->overlap[g];
        if (m->glass != NULL) m->glass[kept] = m->glass[g];
        number[g] = kept++;
    }
    for (size_t i = 0; i < m->n; i++) m->group[i] = number[m->group[i]];
    m->n_groups = kept;
    if (m->glass != NULL) m->n_glass = kept;
}

lam_status mesh_drop(mesh *m, const bool *dropped, lam_error *error) {
    const size_t before = m->n;
    size_t n = 0;
    uint32_t *number = memory_allocate(m->n_groups, sizeof *number, "groups", error);
    if (number == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < before; i++) n += !dropped[i];
    assert(n > 0 && m->faces.n_parts == 0 && m->buried == NULL);
    for (size_t c = 0, to = 0; c < m->n_channels; c++)
        for (size_t i = 0; i < before; i++) {
            if (dropped[i]) continue;
            m->reflectance[to] = m->reflectance[c * before + i];
            m->emission[to++] = m->emission[c * before + i];
        }
    for (size_t i = 0, to = 0; i < before; i++) {
        if (dropped[i]) continue;
        memmove(m->elements[to], m->elements[i], sizeof *m->elements);
        memmove(m->normal[to], m->normal[i], sizeof *m->normal);
        m->area[to] = m->area[i];
        if (m->textured_face != NULL) m->textured_face[to] = m->textured_face[i];
        if (m->has_back != NULL) m->has_back[to] = m->has_back[i];
        if (m->faces.of != NULL) m->faces.of[to] = m->faces.of[i];
        m->group[to++] = m->group[i];
    }
    m->n = n;
    drop_empty_groups(m, number);
    free(number);
    return LAM_OK;
}
