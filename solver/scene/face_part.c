#include "solver/scene/face_part.h"

#include "solver/scene/plane.h"

#include <math.h>
#include <string.h>

face_part face_part_of(const mesh *m, uint32_t face, const face_frame *frame) {
    face_part whole = {.face = face, .n = (uint32_t)mesh_corners(m, face), .next = FACE_PART_NONE};
    for (size_t k = 0; k < whole.n; k++) {
        memcpy(whole.corner[k].at, m->vertices[m->elements[face][k]], sizeof whole.corner[k].at);
        face_frame_flatten(frame, whole.corner[k].at, whole.corner[k].flat);
    }
    return whole;
}

size_t face_part_pieces(size_t corners) {
    return corners <= 4 ? 1 : (corners - 1) / 2;
}

double face_part_area(const face_part *p) {
    double twice = 0;
    for (size_t k = 1; k + 1 < p->n; k++)
        twice += plane_turn(p->corner[0].flat, p->corner[k].flat, p->corner[k + 1].flat);
    return twice / 2;
}

bool face_part_sides(const face_part *p, const flat_line *line, double tolerance, double *distance) {
    double least = 0, most = 0;
    for (size_t k = 0; k < p->n; k++) {
        distance[k] = flat_line_distance(line, p->corner[k].flat);
        least = fmin(least, distance[k]);
        most = fmax(most, distance[k]);
    }
    if (!(most > tolerance && least < -tolerance)) return false;
    for (size_t k = 0; k < p->n; k++) {
        const double before = fabs(distance[(k + p->n - 1) % p->n]), after = fabs(distance[(k + 1) % p->n]);
        if (fabs(distance[k]) <= tolerance && fabs(distance[k]) < before && fabs(distance[k]) <= after)
            distance[k] = 0;
    }
    return true;
}

bool face_part_divide(const face_part *p, const double *distance, face_part out[2]) {
    for (int side = 0; side < 2; side++) {
        face_part *to = &out[side];
        *to = (face_part){.face = p->face, .next = FACE_PART_NONE};
        for (size_t k = 0; k < p->n; k++) {
            const part_corner *a = &p->corner[k], *b = &p->corner[(k + 1) % p->n];
            const double here = distance[k], there = distance[(k + 1) % p->n];
            if (side == 0 ? here >= 0 : here <= 0) {
                if (to->n == FACE_PART_CORNERS) return false;
                to->corner[to->n++] = *a;
            }
            if (!(here * there < 0)) continue;
            if (to->n == FACE_PART_CORNERS) return false;
            part_corner *x = &to->corner[to->n++];
            const double share = here / (here - there);
            for (int d = 0; d < 2; d++) x->flat[d] = a->flat[d] + share * (b->flat[d] - a->flat[d]);
            for (int d = 0; d < 3; d++) x->at[d] = a->at[d] + share * (b->at[d] - a->at[d]);
        }
    }
    return true;
}

/* 4 sqrt(3) area / squared lengths of sides summed: 1 of an equilateral triangle, 0 of a sliver. */
static double roundness(const face_part *p) {
    double squares = 0;
    for (size_t k = 0; k < p->n; k++) {
        const double length = plane_distance(p->corner[k].flat, p->corner[(k + 1) % p->n].flat);
        squares += length * length;
    }
    return 4 * sqrt(3.0) * face_part_area(p) / squares;
}

static face_part part_between(const face_part *p, size_t from, size_t to) {
    face_part out = {.face = p->face, .next = FACE_PART_NONE};
    for (size_t k = from;; k = (k + 1) % p->n) {
        out.corner[out.n++] = p->corner[k];
        if (k == to) return out;
    }
}

void face_part_halve(const face_part *p, face_part out[2], size_t diagonal[2]) {
    double best = -1;
    for (size_t i = 0; i < p->n; i++)
        for (size_t j = i + 2; j < p->n; j++) {
            if (i == 0 && j == p->n - 1u) continue;
            const face_part a = part_between(p, i, j), b = part_between(p, j, i);
            if (face_part_pieces(a.n) + face_part_pieces(b.n) > face_part_pieces(p->n)) continue;
            const double worse = fmin(roundness(&a), roundness(&b));
            if (!(worse > best)) continue;
            best = worse;
            out[0] = a;
            out[1] = b;
            diagonal[0] = i;
            diagonal[1] = j;
        }
}

static mesh_cell cell_of(const face_part *p) {
    mesh_cell c = {.face = p->face, .n = p->n};
    for (size_t k = 0; k < p->n; k++) memcpy(c.corner[k], p->corner[k].at, sizeof c.corner[k]);
    return c;
}

/* Depth: log2 of its corners. */
void face_part_cells(const face_part *p, mesh_cell *cells, size_t *n) {
    face_part halves[2];
    size_t diagonal[2];
    if (p->n <= 4) {
        cells[(*n)++] = cell_of(p);
        return;
    }
    face_part_halve(p, halves, diagonal);
    for (int k = 0; k < 2; k++) face_part_cells(&halves[k], cells, n);
}
