/* Two samples of form factors, or finer blocks, become the references of the judge; they are kept where a
 * next trial has the same form factors. First light is found by rays or by blocks where rows say it too
 * coarsely. */
#include "solver/precompute/judging.h"

#include "solver/base/random.h"
#include "solver/formfactor/blocks/block_light.h"
#include "solver/formfactor/pairs/first_light.h"
#include "solver/formfactor/sky_sample.h"
#include "solver/formfactor/source.h"
#include "solver/operator/blocks/block_store.h"
#include "solver/precompute/trial.h"
#include "solver/scene/lit_groups.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The first light of one emission. */
typedef struct light_kept {
    float *E;      /* [n]; NULL: none is kept */
    double *H, *D; /* [n] */
    bool known;
} light_kept;

struct judge_references {
    recipe halves[2];
    form_factors half[2]; /* the samples; the first is about finer blocks */
    block_factors finer;  /* n = 0: samples */
    first_light *by_rays; /* the first light; both NULL: rows say it well enough */
    block_light *by_blocks;
    size_t n;
    bool keeps;
    sky_bounce sky[2];     /* samples of the first bounce; n = 0: none */
    double *reflects;      /* [m], of the ground: albedo times the tile's cosine */
    judged_sky light;      /* a view of these, and of the first bounce that is judged */
    const judging *judged; /* by whom the sky is asked for */
    light_kept lamp;       /* of several elements, which takes as long as that of many single ones */
};

static void light_kept_free(light_kept *l) {
    free(l->E);
    free(l->H);
    free(l->D);
    *l = (light_kept){.E = NULL};
}

void judge_references_free_samples(judge_references *r) {
    if (r == NULL) return;
    for (int h = 0; h < 2; h++) form_factors_free(&r->half[h]);
    block_factors_free(&r->finer);
    r->half[0] = r->half[1] = (form_factors){.row_sums = NULL};
    r->finer = (block_factors){.n = 0};
}

void judge_references_free(judge_references *r) {
    if (r == NULL) return;
    judge_references_free_samples(r);
    first_light_destroy(r->by_rays);
    block_light_destroy(r->by_blocks);
    light_kept_free(&r->lamp);
    for (int h = 0; h < 2; h++) sky_bounce_free(&r->sky[h]);
    free(r->reflects);
    free(r);
}

/* Of an entry of rows; of an element its nodes and places for the walk of light. */
static const double entry_bytes = 8, walk_bytes = 400, lamp_bytes = 20;

double judge_references_bytes(const judge_references *r) {
    if (r == NULL) return 0;
    double bytes = (r->by_blocks != NULL ? walk_bytes : 0) * (double)r->n + lamp_bytes * (double)r->n;
    if (r->finer.n > 0) bytes += (double)block_factors_bytes(&r->finer);
    for (int h = 0; h < 2; h++)
        if (r->sky[h].first_bounce != NULL)
            bytes += sizeof(float) * (double)r->sky[h].tiling.n_tiles * (double)r->n;
    for (int h = 0; h < 2; h++)
        if (r->half[h].F.indptr != NULL) bytes += entry_bytes * (double)(r->n + r->half[h].F.indptr[r->n]);
    return bytes;
}

static lam_status light_of(const judge_references *r, const float *E, double *H, double *D, bool *known,
                           lam_error *error) {
    if (r->by_blocks != NULL) return block_light_of(r->by_blocks, E, H, D, known, error);
    return first_light_of(r->by_rays, E, H, D, known, error);
}

/* Keeps the light of E, unless memory is short: it is found once more then. */
static void keep_light(judge_references *r, const float *E, const double *H, const double *D, bool known) {
    light_kept l = {.E = memory_allocate(r->n, sizeof *l.E, "direct illumination", NULL),
                    .H = memory_allocate(r->n, sizeof *l.H, "direct illumination", NULL),
                    .D = memory_allocate(r->n, sizeof *l.D, "direct illumination", NULL),
                    .known = known};
    if (l.E == NULL || l.H == NULL || l.D == NULL) {
        light_kept_free(&l);
        return;
    }
    memcpy(l.E, E, r->n * sizeof *E);
    memcpy(l.H, H, r->n * sizeof *H);
    memcpy(l.D, D, r->n * sizeof *D);
    r->lamp = l;
}

static lam_status light_for_judge(void *context, const float *E, double *H, double *D, bool *known,
                                  lam_error *error) {
    lam_status status = LAM_OK;
    judge_references *r = context;
    const light_kept *lamp = &r->lamp;
    size_t bright = 0;
    for (size_t i = 0; i < r->n; i++) bright += E[i] != 0;
    const bool keeps = r->keeps && bright > 1;
    if (keeps && lamp->E != NULL && memcmp(lamp->E, E, r->n * sizeof *E) == 0) {
        memcpy(H, lamp->H, r->n * sizeof *H);
        memcpy(D, lamp->D, r->n * sizeof *D);
        *known = lamp->known;
        return LAM_OK;
    }
    TRY(light_of(r, E, H, D, known, error));
    if (keeps && lamp->E == NULL) keep_light(r, E, H, D, *known);
done:
    return status;
}

/* Errors of blocks fall as the square root of their bound, or faster. Where the judge's bound is half that of
 * the blocks that are judged, an error e of its own makes sqrt(2) e of theirs; these are independent, so that
 * the distance of both solutions is sqrt(3) e, or more. With receivers it is between .63 and a quarter of
 * theirs, where importance is 1 and 1/16: about as much. */
static const double share_of_distance = .57735026918962576451;

/* Blocks of half the tolerance, found with other segments. With receivers the tolerance is down to a quarter
 * where there is little importance: errors of shadows go one way there, so that a reference which has half of
 * them hides as much. */
static lam_status make_blocks(const judging *j, judge_references *r, lam_error *error) {
    lam_status status = LAM_OK;
    const plane_tree *tree = j->problem->blocks->tree;
    importance judges = {.n = 0};
    if (j->importance != NULL) TRY(importance_even_out(j->importance, &judges, error));
    const form_factor_options how = {.recipe = j->halves[0],
                                     .progress = j->progress,
                                     .stage = j->stages[0],
                                     .importance = judges.n > 0 ? &judges : NULL};
    TRY(form_factors_make_blocks(j->m, j->order, tree, j->f, &how, &r->half[0], &r->finer, error));
done:
    importance_free(&judges);
    return status;
}

/* True where both samples share the pairs that are projected: rows in a scratch folder are of one sample. */
static bool shares_pairs(const judging *j) {
    return recipe_can(&j->halves[0], SOURCE_TWICE) && j->scratch == NULL;
}

/* Two independent samples, or a reference and the same disturbed by its noise. */
static lam_status make_halves(const judging *j, form_factors half[2], lam_error *error) {
    lam_status status = LAM_OK;
    if (shares_pairs(j)) {
        const form_factor_options both = {.recipe = j->halves[0], .progress = j->progress};
        return form_factors_make_twice(j->m, j->order, &both, j->halves[1].seed, j->stages, half, error);
    }
    for (int h = 0; h < 2; h++) {
        const form_factor_options how = {.recipe = j->halves[h],
                                         .progress = j->progress,
                                         .stage = j->stages[h],
                                         .scratch = j->scratch,
                                         .scratch_name = j->scratch_names[h],
                                         .large = j->large};
        TRY(form_factors_make(j->m, j->order, &how, &half[h], error));
        if (j->sampled != NULL) j->sampled(j->context, &half[h]);
    }
done:
    return status;
}

/* True where the form factors of references were made for the same recipe. */
static bool fits(const judging *j, const judge_references *r) {
    return r->half[0].row_sums != NULL && (r->finer.n > 0) == (j->problem->blocks != NULL) &&
           !recipes_differ(&r->halves[0], &j->halves[0]) && !recipes_differ(&r->halves[1], &j->halves[1]);
}

/* Rays of each of the two samples from an element, and towards each single tile by which it is judged. Their
 * noise is taken out, and what is left of it falls with the number of elements: few have more rays. */
enum { SKY_RAYS_LEAST = 512, SKY_RAYS_MOST = 2048, SKY_RAYS_OF_ALL = 1 << 21, TILE_RAYS = 32 };

static size_t sky_rays(size_t n) {
    const size_t rays = SKY_RAYS_OF_ALL / n;
    return rays < SKY_RAYS_LEAST ? SKY_RAYS_LEAST : rays > SKY_RAYS_MOST ? SKY_RAYS_MOST : rays;
}

/* Of the samples 0 and 1, and of single tiles. */
static uint64_t seed_of_sky(const judging *j, int sample, bool tiles) {
    return random_mix(j->first_light_seed + 1 + (uint64_t)sample + (tiles ? 2 : 0));
}

static lam_status sample_tiles(void *context, int sample, size_t count, const size_t *tiles, float *first,
                               lam_error *error) {
    const judge_references *r = context;
    return sky_sample_tiles(r->judged->m, &r->sky[sample], TILE_RAYS, seed_of_sky(r->judged, sample, true),
                            count, tiles, first, error);
}

static lam_status sample_pairs(void *context, int sample, size_t count, const size_t *elements,
                               const size_t *tiles, float *first, lam_error *error) {
    const judge_references *r = context;
    return sky_sample_pairs(r->judged->m, &r->sky[sample], TILE_RAYS, seed_of_sky(r->judged, sample, true),
                            count, elements, tiles, first, error);
}

/* The first bounce that one of the operator's own rays by the cosine adds. Those for the sky alone are half
 * as many where others are aimed at openings. Hemicubes have no rays. */
static double own_ray(const form_factors *f) {
    if (recipe_can(&f->recipe, SOURCE_RESOLUTION) || f->recipe.rays == 0) return 0;
    return M_PI * (f->n_aimed > 0 ? 2 : 1) / (double)f->recipe.rays;
}

/* The share of the variance of an operator's own first bounce in that of the mean of both samples: by the
 * rays of each. Hemicubes have no rays. */
static double own_share(const recipe *own, size_t n) {
    const bool by_rays = !recipe_can(own, SOURCE_RESOLUTION) && own->rays > 0;
    return by_rays ? fmin(1, 2 * (double)sky_rays(n) / (double)own->rays) : 1;
}

/* True where the sky is judged: one whose light is in the scene. */
static bool has_sky(const judging *j) {
    return j->by_group != NULL && j->f->sky.first_bounce != NULL && !j->f->closed;
}

/* The form factors and the light that are lacking: of few elements by a walk of the tree, or by pairs. */
static lam_status make_references(const judging *j, judge_references *r, lam_error *error) {
    lam_status status = LAM_OK;
    const bool blocks = j->problem->blocks != NULL;
    if (!fits(j, r)) {
        judge_references_free_samples(r);
        block_light_destroy(r->by_blocks);
        r->by_blocks = NULL;
        memcpy(r->halves, j->halves, sizeof r->halves);
        TRY(blocks ? make_blocks(j, r, error) : make_halves(j, r->half, error));
    }
    if (blocks && r->by_blocks == NULL)
        TRY(block_light_create(j->m, j->problem->blocks->tree, j->halves[0].accuracy, j->first_light_seed,
                               &r->by_blocks, error));
    /* The direct illumination of one element by rays is mostly noise. */
    if (!blocks && recipe_noise(&j->f->recipe) > 0 && r->by_rays == NULL)
        TRY(first_light_create(j->m, j->first_light_seed, &r->by_rays, error));
    if (!has_sky(j)) goto done;
    for (int h = 0; h < 2; h++) {
        const form_factor_options how = {
            .recipe = {.rays = sky_rays(j->m->n), .seed = seed_of_sky(j, h, false)},
            .openings = j->openings,
            .progress = j->progress,
            .stage = "the sky for the judge"};
        if (r->sky[h].first_bounce == NULL)
            TRY(sky_sample_make(j->m, j->order, &j->f->sky, &how, &r->sky[h], error));
    }
    const sky_tiling *tiling = &j->f->sky.tiling;
    if (r->reflects == NULL)
        r->reflects = memory_allocate(tiling->n_tiles, sizeof *r->reflects, "skies", error);
    if (r->reflects == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t t = 0; t < tiling->n_tiles; t++)
        r->reflects[t] = j->f->sky.ground_albedo * tiling->tiles[t].cosine;
    r->light = (judged_sky){.n_tiles = j->f->sky.tiling.n_tiles,
                            .own = j->f->sky.first_bounce,
                            .samples = {r->sky[0].first_bounce, r->sky[1].first_bounce},
                            .own_share = own_share(&j->f->recipe, j->m->n),
                            .tiles = sample_tiles,
                            .pairs = sample_pairs,
                            .tiles_context = r,
                            .own_ray = own_ray(j->f),
                            .ground = r->sky[0].ground,
                            .reflects = r->reflects};
    r->judged = j;
done:
    return status;
}

/* The blocks that are judged tell the noise of finer ones; one of two samples that of the other. */
static judge_input input_of(const judging *j, judge_references *r, const bool *people) {
    const bool blocks = r->finer.n > 0;
    const factor_product own =
        blocks ? block_factors_product(j->problem->blocks) : factor_product_of_rows(j->problem->F);
    return (judge_input){.problem = j->problem,
                         .row_sums = j->f->row_sums,
                         .emission = j->m->emission,
                         .read = j->importance != NULL ? j->importance->read : NULL,
                         .emits = j->importance != NULL ? j->importance->emits : NULL,
                         .group = j->by_group != NULL ? j->m->group : NULL,
                         .n_groups = j->m->n_groups,
                         .people = people,
                         .by_group = j->by_group,
                         .sky = has_sky(j) ? &r->light : NULL,
                         .own = own,
                         .independent = blocks ? block_factors_product(&r->finer)
                                               : factor_product_of_rows(&r->half[0].F),
                         .other = blocks ? own : factor_product_of_rows(&r->half[1].F),
                         .relation = blocks            ? REFERENCE_COARSER
                                     : shares_pairs(j) ? REFERENCE_DISTURBED
                                                       : REFERENCE_TWIN,
                         .other_share = blocks ? share_of_distance : 0,
                         .first_light = r->by_blocks != NULL || r->by_rays != NULL ? light_for_judge : NULL,
                         .first_light_context = r,
                         .probes = j->probes,
                         .probes_least = j->probes_least,
                         .seed = j->probes_seed,
                         .progress = j->progress};
}

lam_status judging_run(const judging *j, const lam_operator *op, error_report *out, lam_error *error) {
    lam_status status = LAM_OK;
    judge_references *r = NULL;
    bool *people = NULL;
    if (j->kept != NULL) {
        r = *j->kept;
        *j->kept = NULL;
    }
    if (r == NULL) {
        r = memory_allocate(1, sizeof *r, "references", error);
        if (r == NULL) TRY(LAM_ERR_MEMORY);
        r->n = j->m->n;
        r->keeps = j->kept != NULL;
    }
    TRY(make_references(j, r, error));
    people = memory_allocate(j->m->n_groups, sizeof *people, "references", error);
    if (people == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t g = 0; g < j->m->n_groups; g++) people[g] = group_name_is_window(j->m->group_names[g]);
    const judge_input input = input_of(j, r, people);
    TRY(judge_operator(op, &input, out, error));
    if (j->kept != NULL) {
        *j->kept = r;
        r = NULL;
    }
done:
    judge_references_free(r);
    free(people);
    return status;
}
