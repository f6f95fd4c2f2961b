#include "solver/formfactor/pairs/joined_occluders.h"

#include "solver/base/vector3.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Occluders of a node of the tree at most. */
enum { NODE_MOST = 2 };

void joined_occluders_free(joined_occluders *o) {
    free(o->of);
    free(o->list);
    free(o->nodes);
    *o = (joined_occluders){.n = 0};
}

/* Sets an occluder from its corners; false where it is thinner than slack. */
static bool set_occluder(joined_occluder *o, double slack) {
    double twice[3] = {0};
    for (int c = 1; c + 1 < o->n; c++) {
        double one[3], two[3], part[3];
        subtract3(o->corner[c], o->corner[0], one);
        subtract3(o->corner[c + 1], o->corner[0], two);
        cross3(one, two, part);
        for (int d = 0; d < 3; d++) twice[d] += part[d];
    }
    const double area = sqrt(dot3(twice, twice));
    double longest = 0;
    o->level = 0;
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
    return true;
}

/* True where the corners of two occluders are at the same places, in either direction. */
static bool coincide(const joined_occluder *a, const joined_occluder *b, double slack) {
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
    const joined_occluder *a = left, *b = right;
    for (int d = 0; d < 3; d++)
        if (a->low[d] < b->low[d] || a->low[d] > b->low[d]) return a->low[d] < b->low[d] ? -1 : 1;
    return (a->facet > b->facet) - (a->facet < b->facet);
}

/* The two sides of a sheet that are faces of their own hide the same. */
static void drop_twins(joined_occluders *o) {
    enum { NEAREST = 8 };
    size_t kept = 0;
    if (o->n > 0) qsort(o->of, o->n, sizeof *o->of, by_low);
    for (size_t k = 0; k < o->n; k++) {
        bool twin = false;
        for (size_t p = kept; p-- > 0 && !twin && kept - p <= NEAREST;)
            twin = coincide(&o->of[k], &o->of[p], o->slack);
        if (!twin) o->of[kept++] = o->of[k];
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
static void make_node(joined_occluders *o, node_key *keys, size_t at, uint32_t first, uint32_t count) {
    occluder_node node = {.first = first, .count = count};
    double low[3], high[3];
    for (int d = 0; d < 3; d++) node.low[d] = low[d] = INFINITY, node.high[d] = high[d] = -INFINITY;
    for (uint32_t k = first; k < first + count; k++)
        for (int d = 0; d < 3; d++) {
            const joined_occluder *one = &o->of[o->list[k]];
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
            const joined_occluder *one = &o->of[o->list[k]];
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

static lam_status make_tree(joined_occluders *o, lam_error *error) {
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

lam_status joined_occluders_make(const mesh *m, const facets *f, double slack, joined_occluders *out,
                                 lam_error *error) {
    lam_status status = LAM_OK;
    plane_joins joins = {.n = 0};
    joined_occluders o = {.slack = slack};
    TRY(plane_joins_make(m, f, slack, &joins, error));
    o.of = memory_allocate(joins.n, sizeof *o.of, "occluders", error);
    if (o.of == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < joins.n; k++) {
        joined_occluder made = {.n = joins.of[k].n, .facet = joins.of[k].facet};
        memcpy(made.corner, joins.of[k].corner, sizeof made.corner);
        if (set_occluder(&made, slack)) o.of[o.n++] = made;
    }
    drop_twins(&o);
    TRY(make_tree(&o, error));
    *out = o;
    o = (joined_occluders){.n = 0};
done:
    plane_joins_free(&joins);
    joined_occluders_free(&o);
    return status;
}

/* Heights of a box above a plane. */
static void box_heights(const cluster *c, const double normal[3], double level, double *low, double *high) {
    *low = *high = -level;
    for (int d = 0; d < 3; d++) {
        *low += normal[d] * (normal[d] > 0 ? c->low[d] : c->high[d]);
        *high += normal[d] * (normal[d] > 0 ? c->high[d] : c->low[d]);
    }
}

/* True where a segment between the two boxes may cross the occluder's plane. */
static bool is_between(const joined_occluder *o, const cluster *a, const cluster *b, double slack) {
    double low[2], high[2];
    box_heights(a, o->normal, o->level, &low[0], &high[0]);
    box_heights(b, o->normal, o->level, &low[1], &high[1]);
    return (low[0] < -slack && high[1] > slack) || (low[1] < -slack && high[0] > slack);
}

void joined_occluders_between(const joined_occluders *o, const shaft *s, const cluster *a, const cluster *b,
                              link_occluders *out) {
    enum { DEPTH = 64 };
    uint32_t stack[DEPTH];
    int depth = 0;
    out->count = 0;
    if (o->n > 0) stack[depth++] = 0;
    while (depth > 0) {
        const occluder_node *node = &o->nodes[stack[--depth]];
        if (shaft_misses_box(s, node->low, node->high)) continue;
        if (node->count == 0) {
            stack[depth++] = node->first;
            stack[depth++] = node->first + 1;
        }
        for (uint32_t k = 0; k < node->count; k++) {
            const joined_occluder *one = &o->of[o->list[node->first + k]];
            if (shaft_misses_points(s, one->n, one->corner) || !is_between(one, a, b, o->slack)) continue;
            if (out->count == LINK_OCCLUDERS_MOST) {
                out->count = OCCLUDERS_UNCOUNTED;
                return;
            }
            out->of[out->count++] = o->list[node->first + k];
        }
    }
}

static void box_corners(const cluster *c, double corner[8][3]) {
    for (int k = 0; k < 8; k++)
        for (int d = 0; d < 3; d++) corner[k][d] = k >> d & 1 ? c->high[d] : c->low[d];
}

/* All segments between corners of the boxes cross a convex occluder, so all others do. */
static bool hides(const joined_occluder *o, const double corner[2][8][3], double slack) {
    double height[2][8];
    for (int k = 0; k < 16; k++) height[k / 8][k % 8] = dot3(o->normal, corner[k / 8][k % 8]) - o->level;
    const double sign = height[0][0] > 0 ? 1 : -1;
    for (int k = 0; k < 8; k++)
        if (sign * height[0][k] <= slack || sign * height[1][k] >= -slack) return false;
    for (int i = 0; i < 8; i++)
        for (int k = 0; k < 8; k++) {
            const double t = height[0][i] / (height[0][i] - height[1][k]);
            double at[3];
            for (int d = 0; d < 3; d++) at[d] = corner[0][i][d] + t * (corner[1][k][d] - corner[0][i][d]);
            for (int e = 0; e < o->n; e++)
                if (dot3(o->edge[e], at) + o->edge[e][3] < -slack) return false;
        }
    return true;
}

bool joined_occluders_hide(const joined_occluders *o, const link_occluders *among, const cluster *a,
                           const cluster *b) {
    double corner[2][8][3];
    box_corners(a, corner[0]);
    box_corners(b, corner[1]);
    for (int k = 0; k < among->count; k++)
        if (hides(&o->of[among->of[k]], (const double(*)[8][3])corner, o->slack)) return true;
    return false;
}
