#include "solver/adapt/cell_points.h"

#include "solver/base/vector3.h"
#include "solver/scene/face_grid.h"

#include <stdlib.h>
#include <string.h>

face_plane face_plane_of(const mesh *m, size_t face) {
    const double normal[3] = {(double)m->normal[face][0], (double)m->normal[face][1],
                              (double)m->normal[face][2]};
    const size_t corners = mesh_corners(m, face);
    face_plane plane = {.x = {1, 0, 0}};
    double longest = 0;
    memcpy(plane.origin, m->vertices[m->elements[face][0]], sizeof plane.origin);
    for (size_t k = 0; k < corners; k++) {
        const double *from = m->vertices[m->elements[face][k]],
                     *to = m->vertices[m->elements[face][(k + 1) % corners]];
        const double length = point_distance(from, to);
        if (length <= longest) continue;
        longest = length;
        for (int d = 0; d < 3; d++) plane.x[d] = (to[d] - from[d]) / length;
    }
    cross3(normal, plane.x, plane.y);
    return plane;
}

void face_plane_at(const face_plane *plane, const double place[3], double out[2]) {
    double from[3];
    subtract3(place, plane->origin, from);
    out[0] = dot3(from, plane->x);
    out[1] = dot3(from, plane->y);
}

void cell_points_free(cell_points *p) {
    free(p->x);
    *p = (cell_points){.n = 0};
}

static size_t rows(size_t values) {
    return 3 + GATHER_HALVES * values;
}

size_t cell_points_bytes(size_t values) {
    return rows(values) * sizeof(float);
}

/* An empty set with room for some points. */
static lam_status make(size_t values, size_t room, cell_points *out, lam_error *error) {
    float *block =
        memory_allocate(rows(values) * (room > 0 ? room : 1), sizeof *block, "points of a mesh", error);
    if (block == NULL) return LAM_ERR_MEMORY;
    *out = (cell_points){.room = room,
                         .values = values,
                         .x = block,
                         .y = block + room,
                         .weight = block + 2 * room,
                         .H = block + 3 * room};
    return LAM_OK;
}

/* Row r of all, of which the first is x. */
static float *row(const cell_points *p, size_t r) {
    return p->x + r * p->room;
}

lam_status cell_points_reserve(cell_points *p, size_t values, size_t kept, size_t more, lam_error *error) {
    lam_status status = LAM_OK;
    cell_points made = {.n = 0};
    if (kept > p->n) kept = p->n;
    TRY(make(values, kept + more, &made, error));
    for (size_t r = 0; kept > 0 && r < rows(values); r++)
        memcpy(row(&made, r), row(p, r) + p->n - kept, kept * sizeof(float));
    made.n = kept;
    cell_points_free(p);
    *p = made;
done:
    return status;
}

lam_status cell_points_part(const cell_points *p, const float from[2], const float to[2], cell_points *left,
                            cell_points *right, lam_error *error) {
    lam_status status = LAM_OK;
    size_t n = 0;
    for (size_t k = 0; k < p->n; k++) n += left_of(from, to, p->x[k], p->y[k]) > 0;
    TRY(make(p->values, n, left, error));
    TRY(make(p->values, p->n - n, right, error));
    for (size_t k = 0; k < p->n; k++) {
        cell_points *of = left_of(from, to, p->x[k], p->y[k]) > 0 ? left : right;
        for (size_t r = 0; r < rows(p->values); r++) row(of, r)[of->n] = row(p, r)[k];
        of->n++;
    }
done:
    return status;
}
