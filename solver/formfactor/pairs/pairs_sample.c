/* The work that pairs take, counted on a sample of them, and its seconds by fixed costs of each kind of work.
 */
#include "solver/formfactor/pairs/pairs_sample.h"

#include "solver/base/clock.h"
#include "solver/formfactor/pairs/cluster_links.h"
#include "solver/formfactor/pairs/few_occluders.h"
#include "solver/formfactor/pairs/pair_far.h"
#include "solver/formfactor/pairs/ray_crossings.h"

#include <math.h>
#include <stdlib.h>

/* The scene and the structures that a sample is drawn from. */
typedef struct sample_run {
    const mesh *m;
    const pairs_options *options;
    pair_factor_rules rules;
    polygon *polygons; /* [n], by element */
    occlusion occlusion;
    few_occluders few;
    bool projects; /* pairs with few occluders */
    cluster_tree tree;
    pair_far_table far;
    cluster_links links;
} sample_run;

/* Of the pairs whose segments agree, those that a neighbour's verdict makes mixed all the same: measured .26
 * (a Cornell box of 5,005 elements) to .47 (a furnished room of 516 triangles), but they ask for fewer
 * segments than the mean. */
static const double at_border = .2;

/* Counts a pair that is projected; false where it has too many occluders. */
static bool count_projection(const sample_run *run, uint32_t i, uint32_t j, double g,
                             const link_occluders *among, pairs_work *work) {
    double share;
    if (!run->projects) return false;
    work->sifted++;
    const double tolerance = few_occluders_tolerance(&run->few, i, j, g, run->options->accuracy);
    const few_verdict found =
        few_occluders_share(&run->few, among, i, j, g, tolerance, &share, &work->projection);
    work->seen += found == FEW_OPEN || found == FEW_PARTIAL;
    if (found == FEW_PARTIAL) work->saved += occlusion_segments(&run->occlusion, i, j, g);
    return found != FEW_UNDECIDED;
}

/* Counts the pairs of the position with first ... last-1; among: NULL for an open link. */
static void count_row(const sample_run *run, uint32_t position, uint32_t first, uint32_t last,
                      const link_occluders *among, pairs_work *work) {
    enum { PIECE = 64 };
    const uint32_t i = run->tree.element[position];
    for (uint32_t begin = first; begin < last; begin += PIECE) {
        double exchange[PIECE];
        const uint32_t count = last - begin < PIECE ? last - begin : PIECE;
        pair_far_row(&run->far, position, begin, count, exchange);
        work->tried += count;
        for (uint32_t c = 0; c < count; c++) {
            const uint32_t j = run->tree.element[begin + c];
            double g = exchange[c], seen;
            if (g < 0) {
                g = pair_factor_exchange(&run->rules, &run->polygons[i], &run->polygons[j],
                                         run->options->tolerance);
                work->close++;
            }
            if (!((float)g > 0) || 2 * g / (run->m->area[i] + run->m->area[j]) < run->options->threshold)
                continue;
            work->facing++;
            if (among == NULL) {
                work->seen++;
                continue;
            }
            if (count_projection(run, i, j, g, among, work)) continue;
            work->tests++;
            const occlusion_verdict verdict = occlusion_test(&run->occlusion, i, j, g, &seen);
            work->seen += verdict != OCCLUSION_TOTAL;
            if (occlusion_test_suffices(&run->occlusion, i, j, g)) continue;
            work->segments +=
                (verdict == OCCLUSION_PARTIAL ? 1 : at_border) * occlusion_segments(&run->occlusion, i, j, g);
        }
    }
}

/* The rows of all links, one after the other, of which every step-th is counted: some of the pairs of a large
 * scene, a sixteenth of those of a small one, where a sample should cost little beside the work itself. */
static void count_rows(const sample_run *run, double n_pairs, pairs_work *work, pairs_trial *trial) {
    enum { LEAST = 4000, MOST = 40000, SHARE = 16 };
    const double wanted = fmin(fmax(n_pairs / SHARE, LEAST), MOST);
    const double step = fmax(1, floor(n_pairs / wanted));
    double at = 0, rows = 0, taken = 0, next = floor(step / 2), started = 0, seconds = 0;
    for (size_t k = 0; k < run->links.n; k++) {
        const cluster_link *l = &run->links.links[k];
        const cluster *a = &run->tree.clusters[l->a], *b = &run->tree.clusters[l->b];
        for (uint32_t p = a->first; p < a->last; p++) {
            const uint32_t first = b->first > p ? b->first : p + 1;
            if (first >= b->last) continue;
            rows += b->last - first;
            at++;
            if (at <= next) continue;
            next += step;
            taken += b->last - first;
            link_occluders among = {.count = OCCLUDERS_UNCOUNTED};
            if (!l->open && run->projects) {
                shaft s;
                cluster_shaft_init(&s, a, b, run->few.occluders.slack);
                link_occluders_find(&run->few.occluders, &s, a, b,
                                    link_occluders_projected(&run->few.occluders), &among);
            }
            started = clock_thread_seconds();
            count_row(run, p, first, b->last, l->open ? NULL : &among, work);
            seconds += clock_thread_seconds() - started;
        }
    }
    if (trial != NULL) *trial = (pairs_trial){.work = *work, .seconds = seconds};
    const double scale = taken > 0 ? rows / taken : 0;
    work->tried *= scale;
    work->close *= scale;
    work->facing *= scale;
    work->seen *= scale;
    work->tests *= scale;
    work->sifted *= scale;
    work->projection *= scale;
    work->saved *= scale;
    work->segments *= scale;
}

static void scale_to_all(const sample_run *run, pairs_work *work) {
    const double all = 1 / run->links.share;
    const cluster_link_work *l = &run->links.work;
    work->shafts = all * l->shafts;
    work->candidates = all * l->candidates;
    work->occlusion = all * l->occlusion;
    work->hidden = all * l->hidden;
    work->tried *= all;
    work->close *= all;
    work->facing *= all;
    work->seen *= all;
    work->tests *= all;
    work->sifted *= all;
    work->projection *= all;
    work->saved *= all;
    work->segments *= all;
}

/* The sample of links is a sixty-fourth of the descent, of few elements all of it. */
lam_status pairs_sample(const mesh *m, const visibility *v, const pairs_options *options, pairs_work *out,
                        pairs_trial *trial, lam_error *error) {
    enum { SAMPLED_FROM = 1500, ONE_OF = 64 };
    lam_status status = LAM_OK;
    const double slack = visibility_rounding(v);
    sample_run run = {.m = m, .options = options};
    pairs_work work = {0};
    cluster_link_options how = {.threshold = options->threshold,
                                .slack = slack,
                                .one_of = m->n < SAMPLED_FROM ? 1 : ONE_OF,
                                .progress = options->progress};
    double n_pairs = 0;
    pair_factor_rules_init(&run.rules);
    run.polygons = memory_allocate(m->n, sizeof *run.polygons, "pairs", error);
    if (run.polygons == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < m->n; i++) polygon_of_element(m, i, &run.polygons[i]);
    run.occlusion = (occlusion){.v = v,
                                .area = m->area,
                                .polygons = run.polygons,
                                .rules = &run.rules,
                                .tolerance = options->tolerance,
                                .accuracy = options->accuracy,
                                .segments = options->segments,
                                .seed = options->seed};
    if (options->occluders > 0) {
        TRY(few_occluders_make(m, v, run.polygons, &run.rules, options->seed, options->occluders, &run.few,
                               error));
        if (few_occluders_apply(&run.few)) how.occluders = &run.few.occluders;
    }
    TRY(cluster_tree_build(m, slack, &run.tree, error));
    TRY(pair_far_table_build(run.polygons, &run.tree, &run.rules, options->tolerance, &run.far, error));
    TRY(cluster_links_find(m, &run.tree, &run.occlusion, &how, &run.links, error));
    run.projects = options->occluders > 0 && few_occluders_pay(&run.few, &run.tree, &run.links);
    for (size_t k = 0; k < run.links.n; k++) {
        const cluster *a = &run.tree.clusters[run.links.links[k].a],
                      *b = &run.tree.clusters[run.links.links[k].b];
        n_pairs += (double)(a->last - a->first) * (double)(b->last - b->first) / (a == b ? 2 : 1);
    }
    count_rows(&run, n_pairs, &work, trial);
    scale_to_all(&run, &work);
    *out = work;
done:
    free(run.polygons);
    few_occluders_free(&run.few);
    pair_far_table_free(&run.far);
    cluster_links_free(&run.links);
    cluster_tree_free(&run.tree);
    return status;
}

/* Seconds of one thread of an AMD EPYC with AVX-512, 2026, by fits to a furnished room (516 triangles), two
 * Cornell boxes, a maze, rooms, a canopy and a part of a town (12,541 triangles). */
static const double shaft_seconds = 5e-7, candidate_seconds = 8e-8, hidden_seconds = 5e-5,
                    tried_seconds = 5e-8, close_seconds = 3e-6, test_seconds = 9e-7, segment_seconds = 1.1e-7,
                    sift_seconds = 1e-6, projection_seconds = 7e-8, entry_seconds = 1e-7;

/* Of a ray: each box of a triangle that it crosses, less boxes_free, and at least ray_seconds; of a row,
 * beside its rays. By fits to processor seconds, with other work beside, of 512 to 8,192 rays in a furnished
 * room, a Cornell box, rooms, a city, a canopy, two parts of a town and a hotel room: 59 ns (2.8 boxes) to
 * 345 (11). */
static const double ray_seconds = 3e-8, box_seconds = 2.65e-8, boxes_free = .3, row_seconds = 2.4e-5;
/* Few rays beside all pairs: not worth a sample. */
static const double few_ray_seconds = 1e-7;

/* Entries of the triangle per ray that hits: many hit what others hit. */
static const double ray_entries = .3;

/* Seconds of all rays of a recipe, and the entries that they make. */
static lam_status rays_forecast(const mesh *m, const recipe *r, pairs_cost *out, lam_error *error) {
    enum { SEED = 1 }; /* the choice of a recipe does not depend on --seed */
    lam_status status = LAM_OK;
    const double n = (double)m->n, rays = n * (double)r->rays;
    ray_crossings w;
    *out = (pairs_cost){.seconds = rays * few_ray_seconds};
    if (r->method == RECIPE_PAIRS) return LAM_OK;
    TRY(ray_crossings_sample(m, SEED, &w, error));
    const double each = fmax((w.boxes - boxes_free) * box_seconds, ray_seconds);
    *out = (pairs_cost){.seconds = rays * each + n * row_seconds,
                        .entries = fmin(rays * w.hits * ray_entries, n * n / 2),
                        .hits = w.hits};
done:
    return status;
}

double sample_pace(double seconds, double expected) {
    static const double too_short = 1e-3, most = 8;
    if (!(seconds > too_short) || !(expected > 0)) return 1;
    return fmin(fmax(seconds / expected, 1 / most), most);
}

/* Of rows of pairs, without their segments, which the sample does not cast. */
static double rows_seconds(const pairs_work *w) {
    return w->tried * tried_seconds + w->close * close_seconds + w->tests * test_seconds +
           w->sifted * sift_seconds + w->projection * projection_seconds;
}

lam_status pairs_forecast(const mesh *m, const recipe *r, const progress *p, pairs_cost *out,
                          lam_error *error) {
    lam_status status = LAM_OK;
    const double threshold = r->method == RECIPE_NEAR_PAIRS ? recipe_near(r) : 0;
    pairs_options options = pairs_options_of(r, m->n, threshold);
    pairs_work w = {0};
    pairs_trial trial = {.seconds = 0};
    visibility *v = NULL;
    pairs_cost of_rays;
    options.progress = p;
    TRY(rays_forecast(m, r, &of_rays, error));
    if (r->method != RECIPE_RAYS) {
        TRY(visibility_create(m, &v, error));
        TRY(pairs_sample(m, v, &options, &w, &trial, error));
    }
    const double least = w.segments > 0 ? options.segments_least * w.segments / (w.segments + w.saved) : 0;
    const double segments = fmin(fmax(w.segments, least), options.segments_most);
    const double entries = w.seen + of_rays.entries;
    const double links =
        w.shafts * shaft_seconds + w.candidates * candidate_seconds + w.hidden * hidden_seconds;
    const double rows = rows_seconds(&w), rest = segments * segment_seconds + entries * entry_seconds;
    const double pace = sample_pace(trial.seconds, rows_seconds(&trial.work));
    *out = (pairs_cost){.seconds = links + rows + rest + of_rays.seconds,
                        .measured = (links + rows) * pace + rest + of_rays.seconds,
                        .entries = 2 * entries,
                        .hits = of_rays.hits};
done:
    visibility_destroy(v);
    return status;
}
