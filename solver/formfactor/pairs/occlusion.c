#include "solver/formfactor/pairs/occlusion.h"

#include "solver/formfactor/visibility/sample.h"

#include <math.h>
#include <string.h>

enum { SEGMENTS_MOST = 1 << 22 };

/* Segments that leave the factor F a standard error of about accuracy: those of this sequence leave the seen
 * share one of about 1.6 N^-3/4 (measured on a plate between two plates, from 16 to 165,000). */
static size_t segments_for(const look *l, double F, double accuracy) {
    const double wanted = fmin(pow(1.6 * F / accuracy, 4. / 3), SEGMENTS_MOST);
    const size_t packets = ((size_t)wanted + VISIBILITY_PACKET - 1) / VISIBILITY_PACKET;
    const size_t segments = packets * VISIBILITY_PACKET;
    return segments > l->segments ? segments : l->segments;
}

/* Segments of the first look: one packet, more for a factor that matters more. */
static size_t first_segments(double F) {
    enum { MOST = 256 };
    const double packets = ceil(fmin(F / 1e-3, MOST / VISIBILITY_PACKET));
    return packets > 1 ? (size_t)packets * VISIBILITY_PACKET : VISIBILITY_PACKET;
}

/* The larger of F_ij and F_ji. */
static double factor_of(const look *l, uint32_t i, uint32_t j, double g) {
    return g / fmin(l->area[i], l->area[j]);
}

/* Eight segments, from points of elements to points of others, and the kernel of each: cos cos' / r^2 times
 * the areas that the two points stand for. */
typedef struct bundle {
    ray_packet segments;
    uint32_t from[VISIBILITY_PACKET], to[VISIBILITY_PACKET];
    double kernel[VISIBILITY_PACKET];
} bundle;

/* Lane k joins the point x[0], x[1] of a, the polygon of i or a piece of it, with x[2], x[3] of b. */
static void bundle_set(bundle *s, const look *l, int k, uint32_t i, const polygon *a, uint32_t j,
                       const polygon *b, const double x[4]) {
    double points[2][3], r2 = 0, leaving = 0, arriving = 0;
    float origin[3], end[3];
    const double area = polygon_point(a, x[0], x[1], points[0]) * polygon_point(b, x[2], x[3], points[1]);
    visibility_recentre(l->v, points[0], origin);
    visibility_recentre(l->v, points[1], end);
    for (int d = 0; d < 3; d++) {
        const double r = points[1][d] - points[0][d];
        r2 += r * r;
        leaving += r * a->normal[d];
        arriving -= r * b->normal[d];
        s->segments.origin[d][k] = origin[d];
        s->segments.direction[d][k] = end[d] - origin[d];
    }
    s->kernel[k] = leaving > 0 && arriving > 0 ? area * leaving * arriving / (r2 * r2) : 0;
    s->from[k] = i;
    s->to[k] = j;
}

/* Two elements, or pieces of them, and the sequence of points on them. */
typedef struct joined {
    uint32_t i, j;
    const polygon *a, *b;
    pair_sampler sampler;
} joined;

/* The same as bundle_set for all lanes of two affine polygons, the areas left out: they are the same for all
 * points of such a polygon, and only ratios of kernels count. */
static void bundle_of_affine(bundle *s, const look *l, const joined *two, size_t first) {
    double x[4][VISIBILITY_PACKET], from[3][VISIBILITY_PACKET], to[3][VISIBILITY_PACKET];
    float end[3][VISIBILITY_PACKET];
    pair_sampler_packet(&two->sampler, (uint32_t)first, x);
    polygon_affine_points(two->a, x[0], x[1], from);
    polygon_affine_points(two->b, x[2], x[3], to);
    visibility_recentre_packet(l->v, from, s->segments.origin);
    visibility_recentre_packet(l->v, to, end);
    for (int d = 0; d < 3; d++)
        for (int k = 0; k < VISIBILITY_PACKET; k++)
            s->segments.direction[d][k] = end[d][k] - s->segments.origin[d][k];
    const double *n_a = two->a->normal, *n_b = two->b->normal;
    for (int k = 0; k < VISIBILITY_PACKET; k++) {
        const double r[3] = {to[0][k] - from[0][k], to[1][k] - from[1][k], to[2][k] - from[2][k]};
        const double r2 = r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
        const double leaving = r[0] * n_a[0] + r[1] * n_a[1] + r[2] * n_a[2];
        const double arriving = -(r[0] * n_b[0] + r[1] * n_b[1] + r[2] * n_b[2]);
        s->kernel[k] = leaving > 0 && arriving > 0 ? leaving * arriving / (r2 * r2) : 0;
        s->from[k] = two->i;
        s->to[k] = two->j;
    }
}

static void bundle_of(bundle *s, const look *l, const joined *two, size_t first) {
    if (two->a->affine && two->b->affine) {
        bundle_of_affine(s, l, two, first);
        return;
    }
    for (int k = 0; k < VISIBILITY_PACKET; k++) {
        double x[4];
        pair_sampler_place(&two->sampler, (uint32_t)first + (uint32_t)k, x);
        bundle_set(s, l, k, two->i, two->a, two->j, two->b, x);
    }
}

/* Casts segments first ... first+7; returns which are blocked. */
static unsigned cast(const look *l, const joined *two, size_t first, double kernel[VISIBILITY_PACKET]) {
    bundle s;
    bundle_of(&s, l, two, first);
    memcpy(kernel, s.kernel, sizeof s.kernel);
    return visibility_blocked(l->v, &s.segments, VISIBILITY_PACKET, s.from, s.to);
}

bool look_suffices(const look *l, uint32_t i, uint32_t j, double g) {
    return segments_for(l, factor_of(l, i, j, g), l->accuracy) <= VISIBILITY_PACKET;
}

look_verdict look_first(const look *l, uint32_t i, uint32_t j, double g, double *seen) {
    const size_t segments = first_segments(factor_of(l, i, j, g));
    double part = 0, all = 0;
    bool any_open = false, any_blocked = false;
    joined two = {.i = i, .j = j, .a = &l->polygons[i], .b = &l->polygons[j]};
    pair_sampler_init(&two.sampler, l->seed, i, j);
    for (size_t first = 0; first < segments && !(any_open && any_blocked); first += VISIBILITY_PACKET) {
        double kernel[VISIBILITY_PACKET];
        const unsigned blocked = cast(l, &two, first, kernel);
        for (int k = 0; k < VISIBILITY_PACKET; k++) {
            if (kernel[k] <= 0) continue; /* behind either element: it says nothing */
            any_open = any_open || (blocked >> k & 1) == 0;
            any_blocked = any_blocked || (blocked >> k & 1) != 0;
            all += kernel[k];
            if ((blocked >> k & 1) == 0) part += kernel[k];
        }
    }
    *seen = all > 0 ? g * part / all : g;
    if (any_open == any_blocked) return LOOK_MIXED;
    return any_open ? LOOK_OPEN : LOOK_HIDDEN;
}

/* Share of two pieces that is seen: sum k V / sum k. */
static double seen_share(const look *l, const joined *two, size_t n_segments) {
    double seen = 0, all = 0;
    for (size_t first = 0; first < n_segments; first += VISIBILITY_PACKET) {
        double kernel[VISIBILITY_PACKET];
        const unsigned blocked = cast(l, two, first, kernel);
        for (int k = 0; k < VISIBILITY_PACKET; k++) {
            all += kernel[k];
            if ((blocked >> k & 1) == 0) seen += kernel[k];
        }
    }
    return all > 0 ? seen / all : 0;
}

/* A pair that is looked at in pieces. */
typedef struct dissection {
    uint32_t i, j;
    double segments_per_area; /* of exchange: each piece gets its share of the pair's segments */
} dissection;

/* How many segments out of one are worth something: (sum k)^2 / (N sum k^2), 1 where the kernel is the same
 * everywhere. */
static double worth(const look *l, const joined *two) {
    enum { SEGMENTS = 64 };
    double sum = 0, sum2 = 0;
    for (size_t first = 0; first < SEGMENTS; first += VISIBILITY_PACKET) {
        bundle s;
        bundle_of(&s, l, two, first);
        for (int k = 0; k < VISIBILITY_PACKET; k++) {
            sum += s.kernel[k];
            sum2 += s.kernel[k] * s.kernel[k];
        }
    }
    return sum2 > 0 ? sum * sum / (SEGMENTS * sum2) : 0;
}

/* Whether the kernel varies little enough over two pieces. Where they nearly touch it is so steep that a few
 * segments need not even notice. */
static bool is_even(const look *l, const joined *two) {
    const double enough = .4, size = two->a->radius + two->b->radius;
    double apart2 = 0;
    for (int d = 0; d < 3; d++) {
        const double r = two->a->centre[d] - two->b->centre[d];
        apart2 += r * r;
    }
    return apart2 > .5 * size * size && worth(l, two) > enough;
}

/* The exchange area that is not hidden. While the kernel varies too much over two pieces the larger is
 * halved, as often as splits allow, unless one packet is all that their share of it asks for. path tells the
 * pieces' samples apart. */
static double seen_exchange(const look *l, const dissection *pair, const polygon *a, const polygon *b,
                            int splits, uint64_t path) {
    enum { MOST_SPLITS = 14 };
    const double g = pair_exchange(l->rules, a, b, l->tolerance);
    if (g <= 0) return 0;
    joined two = {.i = pair->i, .j = pair->j, .a = a, .b = b};
    pair_sampler_init(&two.sampler, l->seed + path, pair->i, pair->j);
    const double packets = ceil(g * pair->segments_per_area / VISIBILITY_PACKET);
    if (splits == MOST_SPLITS || packets <= 1 || is_even(l, &two))
        return g * seen_share(l, &two, (size_t)packets * VISIBILITY_PACKET);
    const bool of_a = a->radius > b->radius;
    polygon halves[2];
    double sum = 0;
    polygon_halve(of_a ? a : b, halves);
    for (uint64_t h = 0; h < 2; h++)
        sum += seen_exchange(l, pair, of_a ? &halves[h] : a, of_a ? b : &halves[h], splits + 1,
                             path * 3 + h + 1);
    return sum;
}

/* Where what is seen of a large factor is still above .1, its own error counts, not the absolute one: the
 * accuracy that suffices, from a few segments. */
static double accuracy_for(const look *l, uint32_t i, uint32_t j, double F) {
    enum { PILOT = 64 };
    if (F <= .1) return l->accuracy;
    joined two = {.i = i, .j = j, .a = &l->polygons[i], .b = &l->polygons[j]};
    pair_sampler_init(&two.sampler, l->seed, i, j);
    return l->accuracy * fmax(1, 10 * F * seen_share(l, &two, PILOT));
}

double look_segments(const look *l, uint32_t i, uint32_t j, double g) {
    /* Half of a factor above .1 may be seen: see accuracy_for. */
    const double F = factor_of(l, i, j, g);
    return (double)segments_for(l, F, l->accuracy * fmax(1, 5 * F));
}

double look_closely(const look *l, uint32_t i, uint32_t j, double g) {
    const double F = factor_of(l, i, j, g), accuracy = accuracy_for(l, i, j, F);
    const dissection pair = {.i = i, .j = j, .segments_per_area = (double)segments_for(l, F, accuracy) / g};
    /* The pieces sum to the whole within the tolerance; nothing between may raise it. */
    return fmin(g, seen_exchange(l, &pair, &l->polygons[i], &l->polygons[j], 0, 0));
}

bool look_is_hidden(const look *l, const cluster_tree *t, const cluster *a, const cluster *b, double factor) {
    enum { LEAST = 128, MOST = 1024 };
    const double wanted = factor / l->accuracy;
    if (wanted > MOST) return false;
    const size_t segments = wanted > LEAST ? (size_t)wanted : LEAST;
    const uint32_t n_a = a->last - a->first, n_b = b->last - b->first;
    /* One by one they would be cheaper. */
    if ((double)VISIBILITY_PACKET * n_a * n_b < (double)segments) return false;
    size_t blocked = 0;
    pair_sampler sampler, elements;
    pair_sampler_init(&sampler, l->seed, a->first, b->first);
    pair_sampler_init(&elements, ~l->seed, a->first, b->first);
    for (uint32_t index = 0; blocked < segments; index += VISIBILITY_PACKET) {
        /* Clusters of which few elements face each other are better taken apart. */
        if (index > 64 && blocked < index / 4) return false;
        bundle s;
        unsigned facing = 0;
        for (uint32_t k = 0; k < VISIBILITY_PACKET; k++) {
            double which[4], x[4];
            pair_sampler_place(&elements, index + k, which);
            pair_sampler_place(&sampler, index + k, x);
            const uint32_t i = t->element[a->first + (uint32_t)(which[0] * n_a)];
            const uint32_t j = t->element[b->first + (uint32_t)(which[1] * n_b)];
            bundle_set(&s, l, (int)k, i, &l->polygons[i], j, &l->polygons[j], x);
            facing |= (unsigned)(s.kernel[k] > 0) << k;
        }
        /* A segment behind either element says nothing. */
        if ((facing & ~visibility_blocked(l->v, &s.segments, VISIBILITY_PACKET, s.from, s.to)) != 0)
            return false;
        blocked += (size_t)__builtin_popcount(facing);
    }
    return true;
}
