/* The standard errors of the visible share of a pair by N segments and by N lines, whose laws occlusion.h
 * has, and the time of one of each:
 *
 *     bench_segments SCENE [LEAST]
 *
 * Over pairs with a factor above LEAST that see between .01 and .99 of each other, against 2^16 lines of
 * another seed; 2^17 segments differ from those by what is printed. Occluders are those that a plane of their
 * own or of an edge does not hold apart from the pair. As CSV. */
#include "solver/base/clock.h"
#include "solver/base/random.h"
#include "solver/base/vector3.h"
#include "solver/formfactor/exchange/affine_segments.h"
#include "solver/formfactor/exchange/pair_factor.h"
#include "solver/formfactor/sight/visible_lines.h"
#include "solver/formfactor/visibility/occluders.h"
#include "solver/formfactor/visibility/sample.h"
#include "solver/scene/import/import.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { PAIRS = 300, SEEDS = 4, NUMBERS = 17, FINEST = 1 << 17, LINES_FINEST = 1 << 16 };
static const uint32_t numbers[NUMBERS] = {8,   16,  24,  32,  48,   64,   96,   128, 192,
                                          256, 384, 512, 768, 1024, 1536, 2048, 8192};

/* *effective: (sum K)^2 / (N sum K^2). */
static double share(const visibility *v, const affine_pair *maps, uint32_t i, uint32_t j, uint64_t seed,
                    uint32_t n, double *effective) {
    pair_sampler s;
    double seen = 0, all = 0, squares = 0;
    const uint32_t from[VISIBILITY_PACKET] = {i, i, i, i, i, i, i, i},
                   to[VISIBILITY_PACKET] = {j, j, j, j, j, j, j, j};
    pair_sampler_init(&s, seed, i, j);
    for (uint32_t first = 0; first < n; first += VISIBILITY_PACKET) {
        double x[4][VISIBILITY_PACKET], K[VISIBILITY_PACKET];
        ray_packet segments;
        pair_sampler_packet(&s, first, x);
        affine_segments(maps, x, visibility_centre(v), segments.origin, segments.direction, K);
        const unsigned blocked = visibility_blocked(v, &segments, VISIBILITY_PACKET, from, to);
        for (int k = 0; k < VISIBILITY_PACKET; k++) {
            all += K[k];
            squares += K[k] * K[k];
            if ((blocked >> k & 1) == 0) seen += K[k];
        }
    }
    if (effective != NULL) *effective = squares > 0 ? all * all / (n * squares) : 0;
    return all > 0 ? seen / all : 0;
}

/* Occluders between pairs. */
typedef struct pieces {
    occluders all;
    segment_occluder *of;
    uint32_t *listed;
    double seconds, lines; /* of lines, and their number */
} pieces;

/* True where all corners of both polygons are at most at the height 0 of n . x + level. */
static bool is_below(const double n[3], double level, const polygon *a, const polygon *b) {
    double most = -INFINITY;
    for (int c = 0; c < a->n; c++) most = fmax(most, dot3(n, a->corner[c]) + level);
    for (int c = 0; c < b->n; c++) most = fmax(most, dot3(n, b->corner[c]) + level);
    return most <= 0;
}

static bool is_apart(const occluder *o, double slack, const polygon *a, const polygon *b) {
    const double back[3] = {-o->normal[0], -o->normal[1], -o->normal[2]};
    if (is_below(o->normal, -o->level - slack, a, b) || is_below(back, o->level - slack, a, b)) return true;
    for (int side = 0; side < 2; side++) { /* or in the plane of either */
        const polygon *p = side == 0 ? a : b;
        if (is_below(o->normal, -o->level - slack, p, p) && is_below(back, o->level - slack, p, p))
            return true;
    }
    for (int e = 0; e < o->n; e++)
        if (is_below(o->edge[e], o->edge[e][3], a, b)) return true;
    return false;
}

static double share_of_lines(pieces *k, const visibility *v, segment_list *list, const affine_pair *maps,
                             uint32_t i, uint32_t j, uint64_t seed, uint32_t n) {
    const double started = clock_seconds();
    line_pair lines;
    line_sums sums = {0, 0};
    pair_sampler s;
    if (!line_pair_choose(k->of, list, &maps->from, &maps->to, visibility_centre(v), &lines)) return NAN;
    pair_sampler_init(&s, seed, i, j);
    for (uint32_t first = 0; first < n; first += VISIBLE_LINES) {
        double x[4][VISIBLE_LINES];
        pair_sampler_packet(&s, first, x);
        visible_lines_add(k->of, list, &lines, visibility_centre(v), (const double(*)[VISIBLE_LINES])x,
                          &sums);
    }
    k->seconds += clock_seconds() - started;
    k->lines += n;
    return sums.all > 0 ? sums.seen / sums.all : 1;
}

int main(int argc, char **argv) {
    mesh m = {0};
    lam_error error = {.message = ""};
    import_report report;
    visibility *v;
    pair_factor_rules rules;
    pieces k = {.lines = 0};
    const import_options plain = {.unit = 1, .reflectance = -1};
    if (argc < 2 || scene_import(argv[1], &plain, &m, &report, &error) != LAM_OK ||
        visibility_create(&m, &v, &error) != LAM_OK) {
        fprintf(stderr, "bench_segments SCENE [LEAST]: %s\n", error.message);
        return 1;
    }
    const double least = argc > 2 ? atof(argv[2]) : 1e-3;
    double sum2[NUMBERS] = {0}, of_lines[NUMBERS] = {0}, apart2 = 0, seconds = 0, segments = 0, listed = 0;
    const double slack = 8 * visibility_rounding(v);
    int n = 0;
    uint64_t seed = 3;
    pair_factor_rules_init(&rules);
    if (occluders_make(&m, visibility_facets(v), visibility_rounding(v), &k.all, &error) != LAM_OK ||
        segment_occluders_make(&k.all, visibility_centre(v), &k.of, &error) != LAM_OK ||
        (k.listed = malloc(k.all.n * sizeof *k.listed)) == NULL) {
        fprintf(stderr, "bench_segments: %s\n", error.message);
        return 1;
    }
    for (size_t tries = 0; n < PAIRS && tries < 4000000; tries++) {
        const uint32_t i = (uint32_t)(random_unit(&seed) * (double)m.n),
                       j = (uint32_t)(random_unit(&seed) * (double)m.n);
        polygon a, b;
        double effective;
        if (i >= j) continue;
        polygon_of_element(&m, i, &a);
        polygon_of_element(&m, j, &b);
        const double g = pair_factor_exchange(&rules, &a, &b, 1e-3) / fmin(m.area[i], m.area[j]);
        if (g < least) continue;
        const affine_pair maps = {affine_map_of(&a), affine_map_of(&b)};
        double exact = share(v, &maps, i, j, 9, 64, &effective);
        if (effective < .4 || exact <= 0 || exact >= 1) continue;
        exact = share(v, &maps, i, j, 99, FINEST, NULL);
        if (exact < .01 || exact > .99) continue;
        segment_list list = {.count = 0, .of = k.listed};
        for (uint32_t o = 0; o < k.all.n; o++)
            if (!is_apart(&k.all.of[o], slack, &a, &b)) k.listed[list.count++] = o;
        const double by_lines = share_of_lines(&k, v, &list, &maps, i, j, 99, LINES_FINEST);
        if (isnan(by_lines)) continue; /* quads that have no lines, or too long a list */
        n++;
        listed += list.count;
        apart2 += (by_lines - exact) * (by_lines - exact);
        for (int number = 0; number < NUMBERS; number++)
            for (uint64_t s = 0; s < SEEDS; s++) {
                const double started = clock_seconds();
                const double off = share(v, &maps, i, j, 100 + s, numbers[number], NULL) - by_lines;
                seconds += clock_seconds() - started;
                segments += numbers[number];
                sum2[number] += off * off / SEEDS;
                const double other =
                    share_of_lines(&k, v, &list, &maps, i, j, 100 + s, numbers[number]) - by_lines;
                of_lines[number] += other * other / SEEDS;
            }
    }
    printf("number,by segments of %d pairs,by lines\n", n);
    for (int number = 0; number < NUMBERS; number++)
        printf("%u,%.5f,%.5f\n", numbers[number], sqrt(sum2[number] / n), sqrt(of_lines[number] / n));
    fprintf(stderr,
            "%.3g occluders a pair; 2^16 lines and 2^17 segments apart by %.5f; %.0f ns a line, %.0f ns a "
            "segment "
            "against the scene\n",
            listed / n, sqrt(apart2 / n), 1e9 * k.seconds / k.lines, 1e9 * seconds / segments);
    free(k.of);
    free(k.listed);
    occluders_free(&k.all);
    visibility_destroy(v);
    mesh_free(&m);
    return 0;
}
