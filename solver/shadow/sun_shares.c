#include "solver/shadow/sun_shares.h"

#include "solver/base/parallel.h"
#include "solver/base/random.h"

#include <math.h>

/* An element of which the sun reaches a part is looked at by so many points. */
enum { FINER_POINTS = 8 * SUN_POINTS };

/* Elements that a thread takes at once. */
enum { TOGETHER = 256 };

/* An element as one parallelogram or triangle, or as two triangles. */
typedef struct area {
    float corner[3], edge[3][3]; /* to the other corners */
    bool folded;                 /* of triangles: u and w are those of a square folded along its diagonal */
    float first_share;           /* of the area that the first triangle takes */
    double turn[2];              /* where the lattice begins */
} area;

static float twice_area(const float one[3], const float other[3]) {
    const float x = one[1] * other[2] - one[2] * other[1], y = one[2] * other[0] - one[0] * other[2],
                z = one[0] * other[1] - one[1] * other[0];
    return sqrtf(x * x + y * y + z * z);
}

static void area_set(const shadow_tree *t, size_t element, area *a) {
    /* The shift of the sample of an element with itself (sample.h of formfactor/visibility). */
    const uint64_t turn = random_hash(random_hash(random_hash(SUN_SEED) ^ random_hash(element + 1)) ^
                                      random_hash(element + 0x100000001u));
    shadow_shape shape;
    const float(*corner)[3] = shadow_tree_corners(t, element, &shape);
    for (int d = 0; d < 3; d++) {
        a->corner[d] = corner[0][d];
        for (int c = 1; c < 4; c++) a->edge[c - 1][d] = corner[c][d] - corner[0][d];
    }
    a->first_share = 1;
    a->folded = shape != SHADOW_PARALLELOGRAM;
    if (shape == SHADOW_QUAD) {
        const float first = twice_area(a->edge[0], a->edge[1]), second = twice_area(a->edge[1], a->edge[2]);
        a->first_share = first / (first + second);
    }
    a->turn[0] = (double)(uint32_t)turn * 0x1p-32;
    a->turn[1] = (double)(turn >> 32) * 0x1p-32;
}

/* Point k of n, a Kronecker lattice: in strip k along u, at multiples of the golden section along w. */
static void place(const area *a, size_t k, size_t n, shadow_rays *to) {
    double along = a->turn[1] + (double)k * .6180339887498949;
    float u = (float)(((double)k + a->turn[0]) / (double)n), w = (float)(along - floor(along));
    const float *one = a->edge[0], *other = a->folded ? a->edge[1] : a->edge[2];
    if (a->folded) {
        /* The halves of the square on either side of its diagonal, each sheared onto half of the triangle,
         * which preserves area (Heitz 2019). */
        if (u < a->first_share) {
            u /= a->first_share;
        } else {
            u = (u - a->first_share) / (1 - a->first_share);
            one = a->edge[1];
            other = a->edge[2];
        }
        const float half = .5f * fminf(u, w);
        u -= half;
        w -= half;
    }
    for (int d = 0; d < 3; d++) to->at[d][to->n] = a->corner[d] + u * one[d] + w * other[d];
}

/* The share of the sun that n points of an element get. */
static double share_of(const shadow_tree *t, const area *a, size_t element, const float direction[3],
                       size_t n, uint32_t *last) {
    const bool panes = shadow_tree_has_panes(t);
    double sum = 0;
    for (size_t first = 0; first < n; first += SHADOW_PACKET) {
        shadow_rays rays = {.n = 0};
        for (size_t k = first; k < n && rays.n < SHADOW_PACKET; k++, rays.n++) place(a, k, n, &rays);
        const unsigned open = shadow_tree_open(t, element, direction, &rays, last);
        if (!panes) {
            sum += __builtin_popcount(open);
            continue;
        }
        double passed[SHADOW_PACKET];
        shadow_tree_pass(t, direction, &rays, open, passed);
        for (size_t k = 0; k < rays.n; k++)
            if (open >> k & 1) sum += passed[k];
    }
    return sum / (double)n;
}

typedef struct casting {
    const shadow_tree *tree;
    size_t n_blocks; /* of elements */
    const double (*direction)[3];
    float *const *seen;
} casting;

/* The elements first ... end - 1 in one direction. */
static void cast_block(const shadow_tree *t, size_t first, size_t end, const double d[3], float *seen) {
    const float direction[3] = {(float)d[0], (float)d[1], (float)d[2]};
    uint32_t last = 0;
    for (size_t i = first; i < end; i++) {
        const float *normal = shadow_tree_normal(t, i);
        const double facing = (double)normal[0] * d[0] + (double)normal[1] * d[1] + (double)normal[2] * d[2];
        area a;
        seen[i] = 0;
        if (!(facing > 0)) continue;
        area_set(t, i, &a);
        double share = share_of(t, &a, i, direction, SUN_POINTS, &last);
        if (share > 0 && share < 1) share = share_of(t, &a, i, direction, FINER_POINTS, &last);
        seen[i] = (float)(facing * share);
    }
}

/* A piece is a block of elements in one direction. */
static void cast(const void *job, size_t thread, size_t first, size_t end) {
    const casting *c = job;
    const size_t n = shadow_tree_elements(c->tree);
    (void)thread;
    for (size_t piece = first; piece < end; piece++) {
        const size_t k = piece / c->n_blocks, from = piece % c->n_blocks * TOGETHER;
        cast_block(c->tree, from, from + TOGETHER < n ? from + TOGETHER : n, c->direction[k], c->seen[k]);
    }
}

void sun_shares_find(const shadow_tree *t, size_t n_threads, size_t n_directions,
                     const double (*direction)[3], float *const *seen) {
    const casting c = {.tree = t,
                       .n_blocks = (shadow_tree_elements(t) + TOGETHER - 1) / TOGETHER,
                       .direction = direction,
                       .seen = seen};
    parallel_share(n_threads, c.n_blocks * n_directions, 1, cast, &c);
}
