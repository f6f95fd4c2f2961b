#include "solver/scene/facet/facet_sides.h"

#include "solver/scene/tables.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Sides of a part at most: what they are cut at is looked for among all its corners. */
enum { SIDES_MOST = 8192 };

typedef struct on_side {
    double along;
    uint32_t vertex;
} on_side;

typedef struct cuts {
    on_side *at;
    size_t n, capacity;
} cuts;

double vertex_off_way(const mesh *m, uint32_t a, uint32_t v, uint32_t b) {
    const double *p = m->vertices[a], *q = m->vertices[b], *x = m->vertices[v];
    double along = 0, length = 0, off = 0;
    for (int d = 0; d < 3; d++) {
        along += (x[d] - p[d]) * (q[d] - p[d]);
        length += (q[d] - p[d]) * (q[d] - p[d]);
    }
    if (!(along > 0 && along < length)) return INFINITY;
    for (int d = 0; d < 3; d++) {
        const double e = x[d] - p[d] - along / length * (q[d] - p[d]);
        off += e * e;
    }
    return sqrt(off);
}

static int on_side_order(const void *a, const void *b) {
    const on_side *p = a, *q = b;
    return (p->along > q->along) - (p->along < q->along);
}

static int between_order(const void *a, const void *b) {
    const side *p = a, *q = b;
    const uint32_t p_low = p->from < p->to ? p->from : p->to, p_high = p->from < p->to ? p->to : p->from;
    const uint32_t q_low = q->from < q->to ? q->from : q->to, q_high = q->from < q->to ? q->to : q->from;
    if (p_low != q_low) return p_low < q_low ? -1 : 1;
    if (p_high != q_high) return p_high < q_high ? -1 : 1;
    return (p->from > q->from) - (p->from < q->from);
}

static lam_status append(side_list *list, side s, lam_error *error) {
    void *grown = array_grow(list->sides, &list->capacity, list->n + 1, sizeof *list->sides, "facets", error);
    if (grown == NULL) return LAM_ERR_MEMORY;
    list->sides = grown;
    list->sides[list->n++] = s;
    return LAM_OK;
}

/* Appends the side s, cut at the corners of all sides that lie on it. */
static lam_status cut_side(const mesh *m, double flat, const side *all, size_t n, side s, cuts *c,
                           side_list *out, lam_error *error) {
    lam_status status = LAM_OK;
    c->n = 0;
    for (size_t k = 0; k < n; k++) {
        const uint32_t v = all[k].from;
        if (v == s.from || v == s.to || vertex_off_way(m, s.from, v, s.to) > flat) continue;
        void *grown = array_grow(c->at, &c->capacity, c->n + 1, sizeof *c->at, "facets", error);
        if (grown == NULL) return LAM_ERR_MEMORY;
        c->at = grown;
        const double *p = m->vertices[s.from], *x = m->vertices[v];
        c->at[c->n++] = (on_side){hypot(hypot(x[0] - p[0], x[1] - p[1]), x[2] - p[2]), v};
    }
    if (c->n > 1) qsort(c->at, c->n, sizeof *c->at, on_side_order);
    uint32_t from = s.from;
    for (size_t k = 0; k < c->n; k++) {
        if (c->at[k].vertex == from) continue;
        TRY(append(out, (side){from, c->at[k].vertex, s.part}, error));
        from = c->at[k].vertex;
    }
    TRY(append(out, (side){from, s.to, s.part}, error));
done:
    return status;
}

/* Takes opposite sides out of sides[0] ... sides[n-1]; returns how many are left. */
static size_t cancel(side *sides, size_t n) {
    size_t left = 0;
    qsort(sides, n, sizeof *sides, between_order);
    for (size_t first = 0, last; first < n; first = last) {
        const side s = sides[first];
        size_t forward = 0;
        for (last = first; last < n && ((sides[last].from == s.from && sides[last].to == s.to) ||
                                        (sides[last].from == s.to && sides[last].to == s.from));
             last++)
            forward += sides[last].from == s.from;
        const size_t backward = last - first - forward;
        const side turned = {s.to, s.from, s.part};
        for (size_t k = backward; k < forward; k++) sides[left++] = s;
        for (size_t k = forward; k < backward; k++) sides[left++] = turned;
    }
    return left;
}

lam_status sides_cancel(const mesh *m, double flat, side_list *list, lam_error *error) {
    lam_status status = LAM_OK;
    side_list out = {.n = 0};
    cuts c = {.n = 0};
    for (size_t first = 0, last; first < list->n; first = last) {
        const side *all = list->sides + first;
        const size_t begin = out.n;
        for (last = first; last < list->n && list->sides[last].part == all->part; last++) {
        }
        const bool many = last - first > SIDES_MOST;
        for (size_t k = first; k < last; k++)
            if (many)
                TRY(append(&out, list->sides[k], error));
            else
                TRY(cut_side(m, flat, all, last - first, list->sides[k], &c, &out, error));
        if (!many) out.n = begin + cancel(out.sides + begin, out.n - begin);
    }
    free(list->sides);
    *list = out;
    out.sides = NULL;
done:
    free(c.at);
    free(out.sides);
    return status;
}
