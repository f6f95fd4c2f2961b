#include "solver/precompute/recipe_choice.h"

#include <string.h>

/* The accuracy that a quality stands for. */
typedef struct quality_level {
    const char *name;
    double noise_share; /* of rays: part of epsilon that their noise may be */
    double filtered;    /* the same where the method takes most of it out again */
    double accuracy;    /* of pairs: standard error of a factor that is partly hidden; 0: plain rays */
} quality_level;

static const quality_level levels[] = {
    {"draft", 1. / 2, 2.5, 0},
    {"normal", 1. / 4, 1.25, 7e-5},
    /* A third of the 2e-4 that a partly hidden factor of .1 may be off by. */
    {"high", 1. / 8, .625, 7e-6},
};

static const quality_level *level_of(const char *name) {
    size_t k = 0;
    while (k + 1 < sizeof levels / sizeof levels[0] && strcmp(levels[k].name, name) != 0) k++;
    return &levels[k];
}

size_t choice_rays(const choice_request *asked) {
    if (asked->rays != CHOICE_AUTO) return (size_t)asked->rays;
    const quality_level *level = level_of(asked->quality);
    return recipe_auto_rays(asked->epsilon, asked->filtered ? level->filtered : level->noise_share);
}

recipe choice_recipe(const choice_request *asked, bool all_pairs) {
    const quality_level *level = level_of(asked->quality);
    recipe r = {.method = RECIPE_RAYS, .rays = choice_rays(asked), .seed = asked->seed};
    if (asked->resolution > 0)
        return (recipe){.method = RECIPE_HEMICUBE, .resolution = asked->resolution, .seed = asked->seed};
    if (asked->rays != CHOICE_AUTO || level->accuracy == 0) return r;
    r.method = all_pairs ? RECIPE_PAIRS : RECIPE_NEAR_PAIRS;
    r.accuracy = level->accuracy;
    if (all_pairs && !asked->sky) r.rays = RECIPE_RAYS_FEW;
    return r;
}
