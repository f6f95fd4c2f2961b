#include "solver/formfactor/blocks/blocks_sample.h"

#include "solver/base/clock.h"
#include "solver/formfactor/blocks/block_walk.h"

#include <math.h>
#include <stdlib.h>

/* Stages of the sample: pairs of nodes with this share of all pairs of elements, and with a quarter of it,
 * and so on, are halved in number. Most blocks are smaller than the last. */
static const double first_share = 1. / 1024, next_share = 1. / 4;
enum { STAGES = 6 };

lam_status blocks_sample(block_scene *scene, const block_options *options, block_report *out,
                         blocks_trial *trial, lam_error *error) {
    lam_status status = LAM_OK;
    uint32_t *roots = NULL;
    size_t n_roots = 0;
    block_finder *const k = &scene->finder;
    const double n = (double)k->tree->n;
    block_walk w = {.finder = k, .sampling = {.n_stages = STAGES}, .error = error};
    for (int s = 0; s < STAGES; s++) w.sampling.limit[s] = .5 * n * n * first_share * pow(next_share, s);
    TRY(block_finder_set(k, options, error));
    TRY(block_finder_planes(k, &roots, &n_roots, error));
    const double started = clock_thread_seconds();
    for (size_t i = 0; i < n_roots; i++) {
        if (progress_cancelled(options->progress)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
        for (size_t j = k->joined ? i : i + 1; j < n_roots; j++) {
            TRY(block_walk_visit(&w, roots[i], roots[j]));
            w.found.count = w.through.count = 0; /* only the report counts */
        }
    }
    if (trial != NULL) {
        *trial = (blocks_trial){.work = w.report, .seconds = clock_thread_seconds() - started};
        for (int s = 1; s <= STAGES; s++) block_report_add(&w.sampling.part[s], 1, &trial->work);
        trial->work.joined = k->joined;
    }
    *out = w.report;
    for (int s = 1; s <= STAGES; s++) block_report_add(&w.sampling.part[s], (double)(1 << s), out);
    out->joined = k->joined;
done:
    free(w.found.list);
    free(w.through.list);
    free(roots);
    return status;
}

/* Seconds of one thread of an AMD EPYC with AVX-512, 2026, by a fit to a closed Cornell box, a maze, rooms, a
 * patio, an anechoic chamber, three cities and an atrium of about 1,500 and 6,000 elements at three or four
 * bounds each (.04 to 10 s; these say .76 to 1.19 times as much). A linear block takes no more than its
 * visit, and a candidate of a segment next to nothing, as most segments have few. */
static const double visit_seconds = 1.4e-7, sifted_seconds = 7e-8, even_seconds = 6e-8, pair_seconds = 3.6e-7,
                    shaded_seconds = 2.8e-7, shaded_pair_seconds = 2e-7, segment_seconds = 1.2e-8,
                    line_seconds = 4e-8, cast_seconds = 3.5e-7;
/* A pair where elements touch at angles everywhere: a bowl of 40,000 triangles. */
static const double joined_pair_seconds = 3e-6;
/* Sorting and balancing, per block and per element: what is left beside the walk in closed Cornell boxes of
 * 10,249 to 163,687 elements, rooms and patios of 10,000 and 40,000; form factors are forecast at .75 to 1.33
 * times what they take in 18 scenes of 1,500 to 163,687. */
static const double finish_seconds = 1.7e-7, element_seconds = 2.5e-6;
/* A judge takes blocks of half the bound: single pairs are as many, of other blocks there are so many times
 * as many; their segments are cast against the whole scene, and they are balanced to a coarser tolerance. The
 * numbers come from two Cornell boxes, rooms, a maze and a patio, whose blocks became 1.11 to 1.9 times as
 * many. */
static const double finer_times = 1.9, scene_seconds = 6.5e-8, finer_finish = .7;
/* Pairs beyond the bound get 2^(1/.7) times as many segments then, those within it as many. */
static const double finer_segments = 1.4;

/* The seconds of the walk alone. */
static double walk_seconds(const block_report *w) {
    return w->visits * visit_seconds + w->sifted * sifted_seconds + w->sampled * even_seconds +
           w->pairs * (w->joined ? joined_pair_seconds : pair_seconds) + w->shaded * shaded_seconds +
           w->shaded_pairs * shaded_pair_seconds + w->segments * segment_seconds + w->lines * line_seconds +
           w->cast * cast_seconds;
}

static double count_of(const block_report *w) {
    return w->linear + w->even + w->pairs + w->shaded + w->shaded_pairs;
}

static double finish_of(const block_scene *scene, const block_report *w) {
    return count_of(w) * finish_seconds + (double)scene->nodes.n * element_seconds;
}

/* The seconds of the blocks w, which a judge finds against the whole scene. */
static double judge_seconds(const block_scene *scene, const block_report *w, double pace) {
    return (walk_seconds(w) + w->segments * scene_seconds) * pace + finish_of(scene, w) * finer_finish;
}

/* The blocks of half the bound by those of the bound: single pairs, which cost most where elements touch at
 * angles, are as many. The walk and the segments grow with all blocks. */
static block_report finer_of(const block_report *w) {
    const double blocks = count_of(w), single = blocks > 0 ? (w->pairs + w->shaded_pairs) / blocks : 0;
    const double more = single + (1 - single) * finer_times;
    block_report finer = *w;
    finer.segments += finer.replaced; /* a judge has no lists, and so no lines */
    finer.lines = 0;
    double *const grow[] = {&finer.visits, &finer.sifted, &finer.segments, &finer.cast};
    double *const others[] = {&finer.linear, &finer.even, &finer.sampled, &finer.shaded};
    for (size_t k = 0; k < sizeof grow / sizeof *grow; k++) *grow[k] *= more;
    for (size_t k = 0; k < sizeof others / sizeof *others; k++) *others[k] *= finer_times;
    finer.segments *= finer_segments;
    return finer;
}

/* Receivers' blocks of half the bound are found by another importance: a sample of their own tells. */
static lam_status sample_finer(block_scene *scene, const recipe *r, const importance *read, const progress *p,
                               block_report *out, lam_error *error) {
    lam_status status = LAM_OK;
    const recipe half = recipe_of_judge(r, r->rays, 0);
    block_options options = block_options_of(&half);
    importance even = {.n = 0};
    TRY(importance_even_out(read, &even, error));
    options.progress = p;
    options.importance = &even;
    TRY(blocks_sample(scene, &options, out, NULL, error));
done:
    importance_free(&even);
    return status;
}

lam_status blocks_forecast(block_scene *scene, const recipe *r, const importance *read, const progress *p,
                           factor_cost *out, lam_error *error) {
    lam_status status = LAM_OK;
    block_options options = block_options_of(r);
    block_report w, finer;
    blocks_trial trial;
    options.progress = p;
    options.importance = read;
    TRY(blocks_sample(scene, &options, &w, &trial, error));
    const double blocks = count_of(&w), walk = walk_seconds(&w), finish = finish_of(scene, &w);
    const double pace = factor_cost_pace(trial.seconds, walk_seconds(&trial.work));
    if (read != NULL)
        TRY(sample_finer(scene, r, read, p, &finer, error));
    else
        finer = finer_of(&w);
    *out = (factor_cost){.seconds = walk + finish,
                         .measured = walk * pace + finish,
                         .entries = 2 * blocks,
                         .finer = judge_seconds(scene, &finer, pace)};
done:
    return status;
}
