#include "solver/shadow/sun_places.h"

#include "solver/base/parallel.h"
#include "solver/base/vector3.h"
#include "solver/shadow/shadow_private.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Receivers that a thread takes at once. */
enum { TOGETHER = 256 };

/* Faces about a place that are looked at, and those that it is moved off. */
enum { NEAR_MOST = 64, FACES_MOST = 3 };

struct sun_places {
    size_t n;
    placed_receiver *receivers; /* [n] */
    float (*at)[3];             /* [n], off faces, relative to the middle of the scene */
};

void sun_places_free(sun_places *p) {
    if (p == NULL) return;
    free(p->receivers);
    free(p->at);
    free(p);
}

size_t sun_places_bytes(size_t n) {
    return sizeof(sun_places) + n * (sizeof(placed_receiver) + 3 * sizeof(float));
}

static bool box_holds(const shadow_node *node, int k, const double at[3], double reach) {
    for (int d = 0; d < 3; d++)
        if (!(at[d] >= (double)node->low[d][k] - reach && at[d] <= (double)node->high[d][k] + reach))
            return false;
    return true;
}

static bool is_known(const uint32_t *found, size_t n, uint32_t element) {
    for (size_t k = 0; k < n; k++)
        if (found[k] == element) return true;
    return false;
}

/* Adds elements about a place to n that are found; at most NEAR_MOST. */
static size_t find_near(const shadow_tree *t, const double at[3], double reach, uint32_t *found, size_t n) {
    uint32_t waiting[SHADOW_STACK];
    size_t n_waiting = t->n_pieces > 0;
    waiting[0] = 0;
    while (n_waiting > 0) {
        const shadow_node *node = &t->nodes[waiting[--n_waiting]];
        for (int k = 0; k < SHADOW_WIDTH; k++) {
            if (!box_holds(node, k, at, reach)) continue;
            if (node->count[k] == 0) {
                waiting[n_waiting++] = node->child[k];
                continue;
            }
            for (uint32_t p = node->child[k]; p < node->child[k] + node->count[k] && n < NEAR_MOST; p++) {
                const uint32_t element = t->pieces[p] >> 1;
                if (!is_known(found, n, element)) found[n++] = element;
            }
        }
    }
    return n;
}

/* True where a point of the plane of an element lies in it, or no further than slack from its rim. */
static bool is_over(const shadow_tree *t, uint32_t element, const double normal[3], const double at[3],
                    double slack) {
    const int n = t->shape[element] == SHADOW_TRIANGLE ? 3 : 4;
    for (int c = 0; c < n; c++) {
        const float *a = t->corners[element][c], *b = t->corners[element][(c + 1) % n];
        double edge[3], way[3], inwards[3];
        for (int d = 0; d < 3; d++) {
            edge[d] = (double)b[d] - (double)a[d];
            way[d] = at[d] - (double)a[d];
        }
        cross3(normal, edge, inwards);
        if (dot3(inwards, way) < -slack * sqrt(dot3(inwards, inwards))) return false;
    }
    return true;
}

/* Moves a place off the faces that it lies on. */
static void leave_faces(const shadow_tree *t, const placed_receiver *r, float out[3]) {
    static const double against = -.9; /* cosine: it looks into the face */
    const double rounding = (double)t->rounding, clear = 2 * rounding;
    /* rounding = 4 2^-24 radius */
    const double near = fmax(fmin(1e-3, 1e-4 * rounding * 0x1p22), 4 * rounding);
    double at[3], left[FACES_MOST][3];
    uint32_t found[NEAR_MOST];
    size_t n_left = 0;
    subtract3(r->at, t->middle, at);
    size_t n = find_near(t, at, near, found, 0);
    if (t->panes.tree != NULL) n = find_near(t->panes.tree, at, near, found, n);
    for (size_t k = 0; k < n && n_left < FACES_MOST; k++) {
        double normal[3], height = 0;
        for (int d = 0; d < 3; d++) {
            normal[d] = (double)t->normal[found[k]][d];
            height += (at[d] - (double)t->corners[found[k]][0][d]) * normal[d];
        }
        const bool behind = dot3(normal, r->axis) < against;
        bool apart = !(height >= (behind ? -clear : -near) && height < clear);
        for (size_t other = 0; other < n_left; other++)
            apart = apart || (behind ? -1 : 1) * dot3(left[other], normal) < -.5;
        if (apart || !is_over(t, found[k], normal, at, near)) continue;
        for (int d = 0; d < 3; d++) {
            at[d] += ((behind ? -clear : clear) - height) * normal[d];
            left[n_left][d] = (behind ? -1 : 1) * normal[d];
        }
        n_left++;
    }
    for (int d = 0; d < 3; d++) out[d] = (float)at[d];
}

lam_status sun_places_create(const shadow_tree *t, size_t n, const placed_receiver *receivers,
                             sun_places **out, lam_error *error) {
    lam_status status = LAM_OK;
    static const char what[] = "the sun at sensors";
    sun_places *p = memory_allocate(1, sizeof *p, what, error);
    if (p == NULL) return LAM_ERR_MEMORY;
    p->n = n;
    p->receivers = memory_allocate(n, sizeof *p->receivers, what, error);
    p->at = memory_allocate(n, sizeof *p->at, what, error);
    if (p->receivers == NULL || p->at == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) {
        p->receivers[i] = receivers[i];
        leave_faces(t, &receivers[i], p->at[i]);
    }
    *out = p;
    p = NULL;
done:
    sun_places_free(p);
    return status;
}

typedef struct casting {
    const sun_places *places;
    const shadow_tree *tree;
    size_t n_blocks; /* of receivers */
    const double (*direction)[3];
    float *const *seen;
} casting;

/* The part of the sun that comes to a place. Each ray goes by itself: those of a packet meet all boxes that
 * the box of their origins does, which in a room of sensors is most of them. */
static double passed_to(const shadow_tree *t, const float at[3], const float direction[3], uint32_t *last) {
    shadow_rays rays = {.n = 1};
    double passed[SHADOW_PACKET];
    for (int d = 0; d < 3; d++) rays.at[d][0] = at[d];
    const unsigned open = shadow_tree_open(t, SHADOW_NO_ELEMENT, direction, &rays, last);
    if (open == 0) return 0;
    shadow_tree_pass(t, direction, &rays, open, passed);
    return passed[0];
}

/* A piece is a block of receivers in one direction. */
static void cast(const void *job, size_t thread, size_t first, size_t end) {
    const casting *c = job;
    const sun_places *p = c->places;
    (void)thread;
    for (size_t piece = first; piece < end; piece++) {
        const double *d = c->direction[piece / c->n_blocks];
        const float direction[3] = {(float)d[0], (float)d[1], (float)d[2]};
        float *seen = c->seen[piece / c->n_blocks];
        const size_t from = piece % c->n_blocks * TOGETHER,
                     to = from + TOGETHER < p->n ? from + TOGETHER : p->n;
        uint32_t last = 0;
        for (size_t i = from; i < to; i++) {
            const placed_receiver *r = &p->receivers[i];
            const double weight = M_PI * receiver_weight_density(r->kind, r->axis, r->look, d);
            seen[i] = weight > 0 ? (float)(weight * passed_to(c->tree, p->at[i], direction, &last)) : 0;
        }
    }
}

void sun_places_find(const sun_places *p, const shadow_tree *t, size_t n_threads, size_t n_directions,
                     const double (*direction)[3], float *const *seen) {
    const casting c = {.places = p,
                       .tree = t,
                       .n_blocks = (p->n + TOGETHER - 1) / TOGETHER,
                       .direction = direction,
                       .seen = seen};
    parallel_share(n_threads, c.n_blocks * n_directions, 1, cast, &c);
}
