/* The standard error of the visible share of a pair by N segments, whose law occlusion.c has:
 *
 *     bench_segments SCENE [LEAST]
 *
 * Over pairs with a factor above LEAST that see between .01 and .99 of each other, against 2^17 segments of
 * another seed. As CSV. */
#include "solver/base/random.h"
#include "solver/formfactor/pairs/affine_segments.h"
#include "solver/formfactor/pairs/pair_factor.h"
#include "solver/formfactor/visibility/sample.h"
#include "solver/scene/import/import.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { PAIRS = 300, SEEDS = 4, NUMBERS = 17, FINEST = 1 << 17 };
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

int main(int argc, char **argv) {
    mesh m = {0};
    lam_error error = {.message = ""};
    import_report report;
    visibility *v;
    pair_factor_rules rules;
    const import_options plain = {.unit = 1, .reflectance = -1};
    if (argc < 2 || scene_import(argv[1], &plain, &m, &report, &error) != LAM_OK ||
        visibility_create(&m, &v, &error) != LAM_OK) {
        fprintf(stderr, "bench_segments SCENE [LEAST]: %s\n", error.message);
        return 1;
    }
    const double least = argc > 2 ? atof(argv[2]) : 1e-3;
    double sum2[NUMBERS] = {0};
    int n = 0;
    uint64_t seed = 3;
    pair_factor_rules_init(&rules);
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
        n++;
        for (int k = 0; k < NUMBERS; k++)
            for (uint64_t s = 0; s < SEEDS; s++) {
                const double off = share(v, &maps, i, j, 100 + s, numbers[k], NULL) - exact;
                sum2[k] += off * off / SEEDS;
            }
    }
    printf("segments,standard error of %d pairs\n", n);
    for (int k = 0; k < NUMBERS; k++) printf("%u,%.5f\n", numbers[k], sqrt(sum2[k] / n));
    visibility_destroy(v);
    mesh_free(&m);
    return 0;
}
