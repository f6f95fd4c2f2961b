#include "solver/scene/coincident_cut.h"

#include "solver/base/array_grow.h"
#include "solver/base/array_sort.h"
#include "solver/scene/coincident_order.h"
#include "solver/scene/face_part.h"
#include "solver/scene/plane.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Parts that a face may become while it is cut, and parts of all faces beside four for each face. */
enum { PARTS_MOST = 1024, ALL_PARTS = 1 << 20 };

/* Parts with more corners are halved, so that each cut finds room for its corners. */
enum { CORNERS_BEFORE = 8 };

/* A face that loses a part of its place, and one that keeps it. */
typedef struct loss {
    uint32_t face, to;
    double area; /* m^2 */
} loss;

typedef struct part_list {
    face_part *parts;
    size_t n, capacity;
} part_list;

typedef struct cutter {
    const mesh *m;
    coincident_planes planes;
    part_list now, next; /* of the face that is cut */
    coincident_cuts made;
    size_t cell_capacity, dropped_capacity;
} cutter;

static int by_face(const void *a, const void *b) {
    const loss *p = a, *q = b;
    if (p->face != q->face) return p->face < q->face ? -1 : 1;
    return p->to < q->to ? -1 : p->to > q->to;
}

static lam_status add_part(part_list *l, const face_part *p, lam_error *error) {
    lam_status status = LAM_OK;
    if (p->n > CORNERS_BEFORE) {
        face_part halves[2];
        size_t diagonal[2];
        face_part_halve(p, halves, diagonal);
        for (int k = 0; k < 2; k++) TRY(add_part(l, &halves[k], error));
        return LAM_OK;
    }
    TRY(array_grow(&l->parts, &l->capacity, l->n + 1, sizeof *l->parts, "parts of faces", error));
    l->parts[l->n++] = *p;
done:
    return status;
}

/* True where all corners of a part are on the right of an edge of another one, or on it. */
static bool lies_outside(const face_part *p, const face_part *of, double width) {
    for (size_t k = 0; k < of->n; k++) {
        const flat_line edge = flat_line_through(of->corner[k].flat, of->corner[(k + 1) % of->n].flat);
        double most = -HUGE_VAL;
        for (size_t c = 0; c < p->n; c++) most = fmax(most, flat_line_distance(&edge, p->corner[c].flat));
        if (most <= width) return true;
    }
    return false;
}

/* Adds what a convex polygon leaves of a part: what lies outside of its first edge, of the rest what lies
 * outside of the second, and so on. */
static lam_status subtract(const face_part *part, const face_part *from, double width, part_list *to,
                           lam_error *error) {
    lam_status status = LAM_OK;
    face_part rest = *part;
    if (lies_outside(part, from, width) || lies_outside(from, part, width)) return add_part(to, part, error);
    for (size_t k = 0; k < from->n; k++) {
        const flat_line edge = flat_line_through(from->corner[k].flat, from->corner[(k + 1) % from->n].flat);
        double distance[FACE_PART_CORNERS], least = HUGE_VAL, most = -HUGE_VAL;
        face_part sides[2];
        for (size_t c = 0; c < rest.n; c++) {
            const double d = flat_line_distance(&edge, rest.corner[c].flat);
            least = fmin(least, d);
            most = fmax(most, d);
        }
        if (least >= -width) continue;
        if (most <= width) return add_part(to, &rest, error);
        if (!face_part_sides(&rest, &edge, width, distance)) continue;
        if (!face_part_divide(&rest, distance, sides)) return add_part(to, &rest, error);
        TRY(add_part(to, &sides[1], error));
        rest = sides[0];
    }
done:
    return status;
}

/* The corners of another face in a frame, counter-clockwise, whichever side that looks to. */
static face_part polygon_in(const mesh *m, uint32_t face, const face_frame *frame) {
    face_part p = face_part_of(m, face, frame);
    if (face_part_area(&p) >= 0) return p;
    for (size_t k = 0; k < p.n / 2; k++) {
        const part_corner c = p.corner[k];
        p.corner[k] = p.corner[p.n - 1 - k];
        p.corner[p.n - 1 - k] = c;
    }
    return p;
}

/* Parts that are narrower than what counts as one place go. */
static bool is_strip(const face_part *p, double width) {
    double perimeter = 0;
    for (size_t k = 0; k < p->n; k++)
        perimeter += plane_distance(p->corner[k].flat, p->corner[(k + 1) % p->n].flat);
    return !(2 * face_part_area(p) > width * perimeter);
}

/* Makes the parts of a face that n others leave. False where there would be too many. */
static lam_status cut_face(cutter *c, size_t n, const loss *losses, bool *fits, lam_error *error) {
    lam_status status = LAM_OK;
    const uint32_t face = losses[0].face;
    const face_frame frame = face_frame_of(c->m, face);
    const face_part whole = face_part_of(c->m, face, &frame);
    double widest = 0;
    *fits = true;
    c->now.n = 0;
    TRY(add_part(&c->now, &whole, error));
    for (size_t k = 0; k < n && *fits; k++) {
        const face_part other = polygon_in(c->m, losses[k].to, &frame);
        const double smaller = fmin(c->m->area[face], c->m->area[losses[k].to]);
        const double width = fmin(coincident_width(&c->planes, face, losses[k].to), 1e-2 * sqrt(smaller));
        widest = fmax(widest, width);
        c->next.n = 0;
        for (size_t p = 0; p < c->now.n; p++) TRY(subtract(&c->now.parts[p], &other, width, &c->next, error));
        const part_list swapped = c->now;
        c->now = c->next;
        c->next = swapped;
        *fits = c->now.n <= PARTS_MOST && c->made.n + c->now.n <= 4 * c->m->n + ALL_PARTS;
    }
    size_t kept = 0;
    for (size_t p = 0; p < c->now.n; p++)
        if (!is_strip(&c->now.parts[p], widest)) c->now.parts[kept++] = c->now.parts[p];
    c->now.n = kept;
done:
    return status;
}

static lam_status room_for(cutter *c, size_t more, lam_error *error) {
    lam_status status = LAM_OK;
    coincident_cuts *to = &c->made;
    TRY(array_grow(&to->cells, &c->cell_capacity, to->n + more, sizeof *to->cells, "parts of faces", error));
    TRY(array_grow(&to->dropped, &c->dropped_capacity, to->n + more, sizeof *to->dropped, "parts of faces",
                   error));
done:
    return status;
}

static lam_status keep_whole(cutter *c, uint32_t face, bool dropped, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(room_for(c, 1, error));
    c->made.dropped[c->made.n] = dropped;
    c->made.cells[c->made.n++] = mesh_cell_of(c->m, face);
done:
    return status;
}

/* Keeps the parts of a face that was cut. */
static lam_status keep_parts(cutter *c, uint32_t face, lam_error *error) {
    lam_status status = LAM_OK;
    coincident_cuts *to = &c->made;
    const size_t before = to->n;
    double lost = c->m->area[face];
    if (to->cut + to->covered == 0) mesh_centroid(c->m, face, to->first);
    if (c->now.n == 0) TRY(keep_whole(c, face, true, error));
    for (size_t p = 0; p < c->now.n; p++) {
        TRY(room_for(c, face_part_pieces(c->now.parts[p].n), error));
        face_part_cells(&c->now.parts[p], to->cells, &to->n);
    }
    for (size_t k = before; k < to->n && c->now.n > 0; k++) {
        to->dropped[k] = false;
        lost -= mesh_cell_area(&to->cells[k]);
    }
    to->cut += c->now.n > 0;
    to->covered += c->now.n == 0;
    to->parts += c->now.n > 0 ? to->n - before : 0;
    to->lost[c->m->group[face]] += fmax(lost, 0);
    to->area += fmax(lost, 0);
done:
    return status;
}

/* Losses, by face; an opposite pair loses both sides of one face. */
static lam_status find_losses(const mesh *m, const coincident_pairs *pairs, loss **out, lam_error *error) {
    lam_status status = LAM_OK;
    coincident_order order = {0};
    loss *losses = memory_allocate(pairs->n, sizeof *losses, "parts of faces", error);
    if (losses == NULL) return LAM_ERR_MEMORY;
    TRY(coincident_order_find(m, &order, error));
    for (size_t k = 0; k < pairs->n; k++) {
        const coincident_pair *p = &pairs->pairs[k];
        const bool first = coincident_comes_first(&order, p->first, p->second);
        losses[k] = (loss){first ? p->second : p->first, first ? p->first : p->second, p->area};
    }
    array_sort(losses, pairs->n, sizeof *losses, by_face);
    *out = losses;
    losses = NULL;
done:
    coincident_order_free(&order);
    free(losses);
    return status;
}

lam_status coincident_cuts_find(const mesh *m, const coincident_pairs *pairs, coincident_cuts *out,
                                lam_error *error) {
    lam_status status = LAM_OK;
    cutter c = {.m = m, .planes = coincident_planes_of(m)};
    loss *losses = NULL;
    c.made.lost = memory_allocate(m->n_groups, sizeof *c.made.lost, "parts of faces", error);
    if (c.made.lost == NULL) TRY(LAM_ERR_MEMORY);
    TRY(find_losses(m, pairs, &losses, error));
    for (uint32_t i = 0, k = 0; i < m->n; i++) {
        const uint32_t begin = k;
        bool fits = false;
        while (k < pairs->n && losses[k].face == i) k++;
        if (k > begin) TRY(cut_face(&c, k - begin, &losses[begin], &fits, error));
        c.made.whole += k > begin && !fits;
        TRY(fits ? keep_parts(&c, i, error) : keep_whole(&c, i, false, error));
    }
    *out = c.made;
    c.made = (coincident_cuts){.n = 0};
done:
    free(losses);
    free(c.now.parts);
    free(c.next.parts);
    coincident_cuts_free(&c.made);
    return status;
}

void coincident_cuts_free(coincident_cuts *c) {
    free(c->lost);
    free(c->cells);
    free(c->dropped);
    *c = (coincident_cuts){.n = 0};
}

lam_status coincident_cuts_make(mesh *m, const coincident_cuts *cuts, lam_error *error) {
    lam_status status = LAM_OK;
    mesh by = {0};
    if (cuts->cut + cuts->covered == 0) goto done;
    TRY(mesh_of_cells(m, cuts->n, cuts->cells, &by, error));
    mesh_replace(m, &by);
    if (cuts->covered > 0) TRY(mesh_drop(m, cuts->dropped, error));
done:
    return status;
}
