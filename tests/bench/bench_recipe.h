/* The recipe argument of the drivers of form factors. */
#ifndef LAMBERT_TESTS_BENCH_RECIPE_H
#define LAMBERT_TESTS_BENCH_RECIPE_H

#include "solver/formfactor/recipe.h"
#include "solver/formfactor/source.h"

#include <stdlib.h>
#include <string.h>

/* "4096" (rays), "pairs" or "near:4096", pairs to the accuracy of normal quality; false for anything else. */
static inline bool bench_recipe(const char *text, uint64_t seed, recipe *out) {
    const double normal = 7e-5;
    const bool near = strncmp(text, "near:", 5) == 0;
    *out = (recipe){
        .source = near ? &source_near_pairs : &source_rays, .seed = seed, .accuracy = near ? normal : 0};
    if (strcmp(text, "pairs") == 0 || strncmp(text, "pairs@", 6) == 0)
        *out = (recipe){.source = &source_pairs, .rays = 256, .seed = seed, .accuracy = normal};
    else
        out->rays = strtoull(near ? text + 5 : text, NULL, 10);
    return out->rays > 0;
}

/* The file after an @, NULL: none. */
static inline const char *bench_recipe_file(const char *text) {
    const char *at = strchr(text, '@');
    return at != NULL ? at + 1 : NULL;
}

#endif
