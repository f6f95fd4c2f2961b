#include "solver/formfactor/visibility/occluders.h"

#include "solver/base/union_find.h"
#include "solver/base/vector3.h"
#include "solver/scene/glass.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Occluders of a node of the tree at most. */
enum { NODE_MOST = 2 };

void occluders_free(occluders *o) {
    free(o->of);
    free(o->list);
    free(o->nodes);
    free(o->set_of_facet);
    *o = (occluders){.n = 0};
}

/* Sets an occluder from its corners; false where it is thinner than slack. */
static bool set_occluder(const mesh *m, const joined_polygon *piece, double slack, occluder *o) {
    double twice[3] = {0}, longest = 0;
    *o = (occluder){.n = (int)piece->n, .facet = piece->label};
    for (int c = 0; c < o->n; c++) memcpy(o->corner[c], m->vertices[piece->corner[c]], sizeof o->corner[c]);
    for (int c = 1; c + 1 < o->n; c++) {
        double one[3], two[3], part[3];
        subtract3(o->corner[c], o->corner[0], one);
        subtract3(o->corner[c + 1], o->corner[0], two);
        cross3(one, two, part);
        for (int d = 0; d < 3; d++) twice[d] += part[d];
    }
    const double area = sqrt(dot3(twice, twice));
    for (int d = 0; d < 3; d++) o->low[d] = INFINITY, o->high[d] = -INFINITY;
    for (int c = 0; c < o->n; c++) {
        double along[3];
        subtract3(o->corner[(c + 1) % o->n], o->corner[c], along);
        longest = fmax(longest, dot3(along, along));
        for (int d = 0; d < 3; d++) {
            o->low[d] = fmin(o->low[d], o->corner[c][d]);
            o->high[d] = fmax(o->high[d], o->corner[c][d]);
        }
    }
    for (int d = 0; d < 3; d++) o->middle[d] = .5 * (o->low[d] + o->high[d]);
    for (int c = 0; c < o->n; c++) {
        double to[3];
        subtract3(o->corner[c], o->middle, to);
        o->radius = fmax(o->radius, sqrt(dot3(to, to)));
    }
    longest = sqrt(longest);
    if (!(area > slack * longest)) return false;
    for (int d = 0; d < 3; d++) o->normal[d] = twice[d] / area;
    for (int c = 0; c < o->n; c++) o->level += dot3(o->normal, o->corner[c]) / o->n;
    for (int c = 0; c < o->n; c++) {
        double along[3], inward[3];
        subtract3(o->corner[(c + 1) % o->n], o->corner[c], along);
        cross3(o->normal, along, inward);
        const double length = sqrt(dot3(inward, inward));
        if (!(length > 0)) return false;
        for (int d = 0; d < 3; d++) o->edge[c][d] = inward[d] / length;
        o->edge[c][3] = -dot3(o->edge[c], o->corner[c]);
    }
    for (int c = 0; c < OCCLUDER_CORNERS; c++)
        for (int d = 0; d < 4; d++) o->across[d][c] = o->edge[c % o->n][d];
    return true;
}

/* True where the corners of two occluders are at the same places, in either direction. */
static bool coincide(const occluder *a, const occluder *b, double slack) {
    if (a->n != b->n) return false;
    for (int c = 0; c < a->n; c++) {
        bool found = false;
        for (int k = 0; k < b->n && !found; k++) {
            double apart[3];
            subtract3(a->corner[c], b->corner[k], apart);
            found = dot3(apart, apart) <= slack * slack;
        }
        if (!found) return false;
    }
    return true;
}

static int by_low(const void *left, const void *right) {
    const occluder *a = left, *b = right;
    for (int d = 0; d < 3; d++)
        if (a->low[d] < b->low[d] || a->low[d] > b->low[d]) return a->low[d] < b->low[d] ? -1 : 1;
    return (a->facet > b->facet) - (a->facet < b->facet);
}

/* The two sides of a sheet that are faces of their own hide the same. */
static void drop_twins(occluders *o) {
    enum { NEAREST = 8 };
    size_t kept = 0;
    if (o->n > 0) qsort(o->of, o->n, sizeof *o->of, by_low);
    for (size_t k = 0; k < o->n; k++) {
        bool twin = false;
        occluder *last = NULL;
        for (size_t p = kept; p > 0 && !twin && kept - p < NEAREST; p--) {
            last = &o->of[p - 1];
            twin = coincide(&o->of[k], last, o->slack);
        }
        if (!twin)
            o->of[kept++] = o->of[k];
        else if (o->of[k].pane == MESH_NO_VERTEX)
            last->pane = MESH_NO_VERTEX;
    }
    o->n = kept;
}

typedef struct node_key {
    double value;
    uint32_t occluder;
} node_key;

static int by_value(const void *left, const void *right) {
    const node_key *a = left, *b = right;
    if (a->value < b->value || a->value > b->value) return a->value < b->value ? -1 : 1;
    return (a->occluder > b->occluder) - (a->occluder < b->occluder);
}

/* The node of list[first] ... list[first + count - 1], halved where the middles of the boxes spread most. */
static void make_node(occluders *o, node_key *keys, size_t at, uint32_t first, uint32_t count) {
    occluder_node node = {.first = first, .count = count};
    double low[3], high[3];
    for (int d = 0; d < 3; d++) node.low[d] = low[d] = INFINITY, node.high[d] = high[d] = -INFINITY;
    for (uint32_t k = first; k < first + count; k++)
        for (int d = 0; d < 3; d++) {
            const occluder *one = &o->of[o->list[k]];
            const double middle = .5 * (one->low[d] + one->high[d]);
            low[d] = fmin(low[d], middle);
            high[d] = fmax(high[d], middle);
            node.low[d] = fmin(node.low[d], one->low[d]);
            node.high[d] = fmax(node.high[d], one->high[d]);
        }
    if (count > NODE_MOST) {
        int axis = 0;
        for (int d = 1; d < 3; d++)
            if (high[d] - low[d] > high[axis] - low[axis]) axis = d;
        for (uint32_t k = first; k < first + count; k++) {
            const occluder *one = &o->of[o->list[k]];
            keys[k] = (node_key){one->low[axis] + one->high[axis], o->list[k]};
        }
        qsort(keys + first, count, sizeof *keys, by_value);
        for (uint32_t k = first; k < first + count; k++) o->list[k] = keys[k].occluder;
        const size_t child = o->n_nodes;
        o->n_nodes += 2;
        make_node(o, keys, child, first, count / 2);
        make_node(o, keys, child + 1, first + count / 2, count - count / 2);
        node.first = (uint32_t)child;
        node.count = 0;
    }
    o->nodes[at] = node;
}

static lam_status make_tree(occluders *o, lam_error *error) {
    node_key *keys = memory_allocate(o->n, sizeof *keys, "occluders", error);
    o->list = memory_allocate(o->n, sizeof *o->list, "occluders", error);
    o->nodes = memory_allocate(2 * o->n + 1, sizeof *o->nodes, "occluders", error);
    const bool enough = keys != NULL && o->list != NULL && o->nodes != NULL;
    if (enough) {
        for (size_t k = 0; k < o->n; k++) o->list[k] = (uint32_t)k;
        o->n_nodes = 1;
        make_node(o, keys, 0, 0, (uint32_t)o->n);
    }
    free(keys);
    return enough ? LAM_OK : LAM_ERR_MEMORY;
}

/* The group of a facet of a pane, from 1 on; 0: it is opaque. */
static uint32_t pane_of_facet(const mesh *m, const facets *f, size_t facet) {
    const uint32_t element = f->elements[f->first[facet]];
    return mesh_is_pane(m, element) ? m->group[element] + 1 : 0;
}

lam_status occluders_make(const mesh *m, const facets *f, double slack, occluders *out, lam_error *error) {
    lam_status status = LAM_OK;
    joined_polygon *pieces = NULL;
    size_t n_pieces = 0;
    occluders o = {.slack = slack, .n_facets = f->n, .glass = m->glass != NULL ? m : NULL};
    uint32_t *panes = memory_allocate(f->n, sizeof *panes, "occluders", error);
    o.set_of_facet = memory_allocate(f->n, sizeof *o.set_of_facet, "occluders", error);
    if (o.set_of_facet == NULL || panes == NULL) TRY(LAM_ERR_MEMORY);
    for (uint32_t k = 0; k < f->n; k++) {
        o.set_of_facet[k] = k;
        panes[k] = pane_of_facet(m, f, k);
    }
    const polygon_join_options how = {.n = f->n_pieces,
                                      .polygons = (const uint32_t(*)[4])f->pieces,
                                      .label = f->piece_facet,
                                      .kinds = panes,
                                      .split = true,
                                      .label_sets = o.set_of_facet,
                                      .corners = OCCLUDER_CORNERS,
                                      .slack = slack};
    TRY(polygons_join(m, &how, &pieces, &n_pieces, error));
    o.of = memory_allocate(n_pieces, sizeof *o.of, "occluders", error);
    if (o.of == NULL) TRY(LAM_ERR_MEMORY);
    for (uint32_t k = 0; k < f->n; k++) o.set_of_facet[k] = union_find_root(o.set_of_facet, k);
    for (size_t k = 0; k < n_pieces; k++) {
        const uint32_t facet = f->piece_facet[pieces[k].first];
        if (!set_occluder(m, &pieces[k], slack, &o.of[o.n])) continue;
        o.of[o.n].pane = panes[facet] != 0 ? f->elements[f->first[facet]] : MESH_NO_VERTEX;
        o.of[o.n++].set = o.set_of_facet[facet];
    }
    drop_twins(&o);
    TRY(make_tree(&o, error));
    *out = o;
    o = (occluders){.n = 0};
done:
    free(pieces);
    free(panes);
    occluders_free(&o);
    return status;
}

occluder_search occluder_search_begin(const occluders *o, const shaft *within) {
    occluder_search s;
    s.all = o;
    s.within = within;
    s.depth = 0;
    if (o->n > 0) s.stack[s.depth++] = 0;
    return s;
}

bool occluder_search_next(occluder_search *s, const uint32_t **found, uint32_t *count) {
    while (s->depth > 0) {
        const occluder_node *node = &s->all->nodes[s->stack[--s->depth]];
        if (shaft_misses_box(s->within, node->low, node->high)) continue;
        if (node->count > 0) {
            *found = s->all->list + node->first;
            *count = node->count;
            return true;
        }
        s->stack[s->depth++] = node->first;
        s->stack[s->depth++] = node->first + 1;
    }
    return false;
}
