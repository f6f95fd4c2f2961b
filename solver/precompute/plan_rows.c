/* The rows of form factors that options, the number of elements and memory allow. */
#include "solver/precompute/plan.h"

#include <math.h>
#include <string.h>

/* The options that decide. */
typedef struct rows_request {
    factor_quality quality;
    double epsilon;
    const factor_source *source; /* by its name; NULL: the best of all */
    uint64_t rays;               /* OPTION_AUTO */
    size_t resolution;
    uint64_t seed;
    scene_closure closure;
    size_t least_rays; /* of rays that are not given */
    bool rays_alone;   /* no pairs */
    bool sky_alone;    /* the only light */
    bool sky;          /* light that leaves the scene matters too */
    bool filtered;     /* the method takes out most of the noise of rays: few are enough */
    bool rounded;      /* all pairs follow epsilon */
} rows_request;

/* The accuracy that a quality stands for. */
typedef struct quality_level {
    double noise_share; /* of rays: part of epsilon that their noise may be */
    double filtered;    /* the same where the method takes most of it out again */
    double accuracy;    /* of pairs: standard error of a factor that is partly hidden; 0: plain rays */
} quality_level;

static const quality_level levels[] = {
    [QUALITY_DRAFT] = {1. / 2, 2.5, 0},
    [QUALITY_NORMAL] = {1. / 4, 1.25, 7e-5},
    /* A third of the 2e-4 that a partly hidden factor of .1 may be off by. */
    [QUALITY_HIGH] = {1. / 8, .625, 7e-6},
};

double plan_finest_accuracy(void) {
    return levels[QUALITY_HIGH].accuracy;
}

/* Rows that are kept are for other operators, too; and what an element sees of a sky is what its row leaves
 * of 1, on which all errors of the row fall. */
bool plan_pairs_follow_epsilon(const precompute_job *job, const build_method *method) {
    const precompute_options *o = job->options;
    return !o->keep_form_factors && !o->from_store && o->sky == NULL &&
           (method_has_option(method, "epsilon") || job->kept_epsilon > 0);
}

/* True where a sky is all the light, and no error is asked for: its rays tell the form factors, too, as what
 * they miss of a tile is most of the error, beside which pairs are no use. */
static bool is_sky_alone(const precompute_job *job) {
    const precompute_options *o = job->options;
    return o->emitters != NULL && strcmp(o->emitters, "sky") == 0 && job->kept_epsilon == 0 &&
           o->quality == QUALITY_NORMAL && !o->keep_form_factors;
}

/* Beside hemicubes only the judge casts rays, and --quality is not about the judge. */
static rows_request request_of(const precompute_job *job, const precompute_plan *plan) {
    const precompute_options *o = job->options;
    const factor_source *const source = source_asked(o->form_factors);
    const bool hemicube = source != NULL && (source->flags & SOURCE_RESOLUTION);
    return (rows_request){.quality = hemicube ? QUALITY_NORMAL : o->quality,
                          .epsilon = o->build.epsilon,
                          .source = source,
                          .rays = hemicube && !o->from_store ? OPTION_AUTO : o->rays,
                          .resolution = (size_t)o->resolution,
                          .seed = o->seed,
                          .closure = o->closed,
                          .least_rays = plan->weighed.least_rays,
                          .rays_alone = plan->weighed.rays_alone || is_sky_alone(job),
                          .sky_alone = is_sky_alone(job),
                          .sky = o->sky != NULL,
                          .filtered = (plan->method->flags & METHOD_FILTERS_NOISE) != 0,
                          .rounded = plan_pairs_follow_epsilon(job, plan->method)};
}

/* Of rays where a sky is all the light, one in so many is left: in a city of 1,000 elements single tiles are
 * then off by .035, as much as by the mesh, and a year by .003, after 2.5 s of a processor; with all of them
 * by .013 and .001 after 4.3 s, by pairs as much after 10. */
enum { SKY_ALONE_SHARE = 4 };

/* Rays that keep the noise of the samples the quality's part below epsilon, or the number given. */
static size_t rays_of(const rows_request *asked) {
    if (asked->rays != OPTION_AUTO) return (size_t)asked->rays;
    const quality_level *const level = &levels[asked->quality];
    const size_t rays =
        recipe_auto_rays(asked->epsilon, asked->filtered ? level->filtered : level->noise_share);
    const size_t wanted = asked->sky_alone ? rays / SKY_ALONE_SHARE : rays;
    return wanted > asked->least_rays ? wanted : asked->least_rays;
}

/* The recipe: that of a source that was asked for by its name, plain rays where their number is given or at
 * draft, else pairs, all where that is affordable and else the near ones. */
static recipe recipe_asked(const rows_request *asked, bool all_pairs) {
    const quality_level *const level = &levels[asked->quality];
    recipe r = {.source = &source_rays,
                .rays = rays_of(asked),
                .resolution = asked->resolution,
                .seed = asked->seed,
                .closure = asked->closure};
    if (asked->source != NULL && asked->source->asked != NULL) return asked->source->asked(&r);
    r.resolution = 0;
    if (asked->rays != OPTION_AUTO || level->accuracy == 0 || asked->rays_alone) return r;
    r.source = all_pairs ? &source_pairs : &source_near_pairs;
    r.accuracy = level->accuracy;
    if (all_pairs && asked->rounded) r.accuracy *= recipe_coarser(asked->epsilon);
    if (all_pairs && !asked->sky) r.rays = RAYS_BESIDE_PAIRS;
    return r;
}

recipe plan_pairs_recipe(const precompute_job *job, const precompute_plan *plan) {
    const rows_request asked = request_of(job, plan);
    return recipe_asked(&asked, true);
}

recipe plan_near_recipe(const precompute_job *job, const precompute_plan *plan) {
    const rows_request asked = request_of(job, plan);
    return recipe_asked(&asked, false);
}

/* Two samples of half of the rays each are more than a judge of many elements needs, as its noise falls with
 * all rays together: in a hotel room of 123,687 elements and 1,024 rays it was .00004 of the random light,
 * whose error is .0085. Above so many rays a sample has a quarter of them. */
static const double judge_rays_enough = 0x1p24;

recipe plan_judge_recipe(const precompute_job *job, const precompute_plan *plan, double n, uint64_t seed) {
    const rows_request asked = request_of(job, plan);
    recipe of = plan->recipe;
    if (job->options->from_store && recipe_source(&of) == &source_rays && asked.rays != OPTION_AUTO)
        of.rays = (size_t)asked.rays;
    recipe judges = recipe_of_judge(&of, rays_of(&asked), seed);
    if (recipe_source(&of) == &source_rays && n * (double)of.rays > judge_rays_enough) judges.rays /= 2;
    return judges;
}

lam_status plan_expect_method(const precompute_job *job, const precompute_scene *scene, double n,
                              double noise, const build_method **method, bool *final, lam_error *error) {
    lam_status status = LAM_OK;
    /* A sky and the emitters of a file are not read yet. */
    const build_problem problem = {.n = (size_t)n, .n_channels = scene->m.n_channels, .noise = noise};
    decision d = {.n_candidates = 0};
    TRY(choose_method(&problem, &job->options->build, false, &d, error));
    *method = d.taken->method;
    *final = d.final;
done:
    decision_free(&d);
    return status;
}

/* Rows of more bytes than these are computed a second time for the judge, not held. */
static const double held_most = 0x1p26;

/* Sets streamed where only a method that can use a stream asks for rows of n elements, and they would take
 * much memory. */
static lam_status choose_stream(const precompute_job *job, const precompute_scene *scene, double n,
                                precompute_plan *plan, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = job->options;
    const double bytes = 8 * n * fmin(n, 2 * (double)plan->recipe.rays);
    const bool kept = o->keep_form_factors || o->from_store || o->scratch != NULL;
    const build_method *method;
    bool final;
    plan->streamed = false;
    if (scene->m.glass != NULL) return LAM_OK; /* light through panes is added to rows that are held */
    if (kept || job->holds || !ray_rows_can(&plan->recipe) || !(bytes > held_most)) return LAM_OK;
    TRY(plan_expect_method(job, scene, n, recipe_noise(&plan->recipe), &method, &final, error));
    plan->streamed = final && (method->flags & METHOD_STREAMS);
done:
    return status;
}

lam_status plan_rows(const precompute_job *job, const precompute_scene *scene, double n,
                     precompute_plan *plan, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = job->options;
    bool final;
    if (n > 4e9)
        FAIL(error, LAM_ERR_MEMORY, "%s: %.3g elements, must be below 4e9; refine less", o->input, n);
    TRY(plan_expect_method(job, scene, n, 0, &plan->method, &final, error));
    const rows_request asked = request_of(job, plan);
    const int disk_too = o->scratch != NULL;
    const bool pairs_too =
        !plan->weighed.too_slow && (n <= PLAN_PAIRS_ELEMENTS || n <= (double)rays_of(&asked));
    for (int way = 0; way <= 2 * disk_too + 1; way++) {
        const bool all_pairs = way % 2 == 0;
        if (all_pairs && !pairs_too) continue;
        plan->large = way >= 2;
        if (!o->from_store) plan->recipe = recipe_asked(&asked, all_pairs);
        TRY(choose_stream(job, scene, n, plan, error));
        if (plan_fits(job, scene, plan, n)) break;
    }
done:
    return status;
}
