/* The work that pairs take, counted on a sample of them, and its seconds by fixed costs of each kind of work.
 */
#include "solver/formfactor/pairs/pairs_sample.h"

#include "solver/base/clock.h"
#include "solver/formfactor/pairs/pair_ground.h"
#include "solver/formfactor/rays/rays_cost.h"

#include <math.h>
#include <stdlib.h>

/* The share of the pairs whose segments agree that a neighbour's verdict makes mixed all the same: measured
 * .26 (a Cornell box of 5,005 elements) to .47 (a furnished room of 516 triangles), but they ask for fewer
 * segments than the mean. */
static const double at_border = .2;

/* A link whose pairs are counted, and the occluders between its clusters. */
typedef struct sampled_link {
    const cluster *a, *b;
    bool open;
    shaft within; /* not of an open link */
    link_occluders projected, listed;
    bool is_searched; /* for those listed */
} sampled_link;

/* The counts of a sample. due: segments since the occluders of a pair were listed. */
typedef struct sample_count {
    pairs_work work;
    double due;
    occlusion of_segments; /* at the accuracy that all mixed pairs together are relaxed or tightened to */
} sample_count;

/* Lists the occluders of a pair, whose segments stand for `share` of all. */
static void count_list(const pair_ground *run, uint32_t i, uint32_t j, double share, sampled_link *link,
                       pairs_work *work) {
    pair_occluders between;
    if (!link->is_searched)
        link_occluders_find(&run->few.occluders, &link->within, link->a, link->b, LINK_OCCLUDERS_MOST,
                            &link->listed);
    link->is_searched = true;
    if (few_occluders_between(&run->few, &link->listed, i, j, &between) == FEW_OPEN) {
        work->proven += share;
    } else if (between.count != OCCLUDERS_UNCOUNTED) {
        work->listed += share;
        work->list_tests += share * between.count;
    }
}

/* Counts the segments of a pair that takes them with some probability; a pair for every EACH of them is
 * looked at closely. */
static void count_segments(const pair_ground *run, uint32_t i, uint32_t j, double g, double probability,
                           sampled_link *link, sample_count *sum) {
    static const double each = 1024;
    const double segments = occlusion_segments(&sum->of_segments, i, j, g);
    const bool is_listed = run->lists && segments >= SEGMENTS_LISTED;
    sum->work.segments += probability * segments;
    sum->work.lists += is_listed ? probability : 0;
    sum->due += probability * segments;
    const double share = floor(sum->due / each) * each;
    sum->due -= share;
    if (share > 0 && is_listed) count_list(run, i, j, share, link, &sum->work);
}

/* Counts a pair that is projected; false where it has too many occluders. */
static bool count_projection(const pair_ground *run, uint32_t i, uint32_t j, double g,
                             const link_occluders *among, pairs_work *work) {
    double share;
    if (!run->projects) return false;
    work->sifted++;
    if (!pair_ground_projects(run, i, j, g)) {
        pair_occluders between;
        const few_verdict proven = few_occluders_between(&run->few, among, i, j, &between);
        work->seen += proven == FEW_OPEN;
        return proven != FEW_UNDECIDED;
    }
    const double tolerance = few_occluders_tolerance(&run->few, i, j, g, run->options->accuracy);
    const few_verdict found =
        few_occluders_share(&run->few, among, i, j, g, tolerance, &share, &work->projection);
    work->seen += found == FEW_OPEN || found == FEW_PARTIAL;
    if (found == FEW_PARTIAL) work->saved += occlusion_segments(&run->occlusion, i, j, g);
    return found != FEW_UNDECIDED;
}

/* Counts the pairs of the position with first ... last-1. */
static void count_row(const pair_ground *run, uint32_t position, uint32_t first, uint32_t last,
                      sampled_link *link, sample_count *sum) {
    enum { PIECE = 64 };
    pairs_work *const work = &sum->work;
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
            if (link->open) {
                work->seen++;
                continue;
            }
            if (count_projection(run, i, j, g, &link->projected, work)) continue;
            work->tests++;
            const occlusion_verdict verdict = occlusion_test(&run->occlusion, NULL, i, j, g, &seen);
            work->seen += verdict != OCCLUSION_TOTAL;
            if (occlusion_test_suffices(&run->occlusion, i, j, g)) continue;
            count_segments(run, i, j, g, verdict == OCCLUSION_PARTIAL ? 1 : at_border, link, sum);
        }
    }
}

static void scale_work(pairs_work *work, double scale) {
    double *const counts[] = {&work->tried,     &work->close,  &work->facing,     &work->seen,
                              &work->tests,     &work->sifted, &work->projection, &work->saved,
                              &work->segments,  &work->lists,  &work->proven,     &work->listed,
                              &work->list_tests};
    for (size_t k = 0; k < sizeof counts / sizeof *counts; k++) *counts[k] *= scale;
}

/* The rows of all links, one after the other, of which every step-th is counted: some of the pairs of a large
 * scene, a sixteenth of those of a small one, where a sample should cost little beside the work itself. */
static void count_rows(const pair_ground *run, double n_pairs, double accuracy, pairs_work *work,
                       pairs_trial *trial) {
    enum { LEAST = 4000, MOST = 40000, SHARE = 16 };
    const double wanted = fmin(fmax(n_pairs / SHARE, LEAST), MOST);
    const double step = fmax(1, floor(n_pairs / wanted));
    double at = 0, rows = 0, taken = 0, next = floor(step / 2), started = 0, seconds = 0;
    sample_count sum = {.due = 0, .of_segments = run->occlusion};
    sum.of_segments.accuracy = accuracy;
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
            sampled_link link = {.a = a, .b = b, .open = l->open, .projected.count = OCCLUDERS_UNCOUNTED};
            if (!l->open) cluster_shaft_init(&link.within, a, b, run->few.occluders.slack);
            if (!l->open && run->projects)
                link_occluders_find(&run->few.occluders, &link.within, a, b,
                                    link_occluders_projected(&run->few.occluders), &link.projected);
            started = clock_thread_seconds();
            count_row(run, p, first, b->last, &link, &sum);
            seconds += clock_thread_seconds() - started;
        }
    }
    if (trial != NULL) *trial = (pairs_trial){.work = sum.work, .seconds = seconds};
    *work = sum.work;
    scale_work(work, taken > 0 ? rows / taken / run->links.share : 0);
}

static void scale_to_all(const pair_ground *run, pairs_work *work) {
    const double all = 1 / run->links.share;
    const cluster_link_work *l = &run->links.work;
    work->shafts = all * l->shafts;
    work->candidates = all * l->candidates;
    work->occlusion = all * l->occlusion;
    work->hidden = all * l->hidden;
}

/* Segments of all mixed pairs together, between the least and the most that there may be. */
static double bounded_segments(const pairs_options *options, const pairs_work *w) {
    const double least =
        w->segments > 0 ? options->segments_least * w->segments / (w->segments + w->saved) : 0;
    return fmin(fmax(w->segments, least), options->segments_most);
}

/* The sample of links is a sixty-fourth of the descent, of few elements all of it. Rows are counted twice:
 * the first count tells to which accuracy the segments of all together are relaxed or tightened, and the
 * second one is timed, as a first one waits for memory more than the work itself does. */
lam_status pairs_sample(const mesh *m, const visibility *v, const pairs_options *options, pairs_work *out,
                        pairs_trial *trial, lam_error *error) {
    enum { SAMPLED_FROM = 1500, ONE_OF = 64 };
    lam_status status = LAM_OK;
    pair_ground run;
    pairs_work work = {0};
    double n_pairs = 0, accuracy = options->accuracy;
    TRY(pair_ground_find(m, v, options, m->n < SAMPLED_FROM ? 1 : ONE_OF, &run, error));
    for (size_t k = 0; k < run.links.n; k++) {
        const cluster *a = &run.tree.clusters[run.links.links[k].a],
                      *b = &run.tree.clusters[run.links.links[k].b];
        n_pairs += (double)(a->last - a->first) * (double)(b->last - b->first) / (a == b ? 2 : 1);
    }
    count_rows(&run, n_pairs, accuracy, &work, trial);
    if (work.segments > 0) accuracy *= pow(work.segments / bounded_segments(options, &work), SEGMENTS_POWER);
    count_rows(&run, n_pairs, accuracy, &work, trial);
    scale_to_all(&run, &work);
    if (trial != NULL) trial->link_seconds = run.links.work.seconds / run.links.share;
    *out = work;
done:
    pair_ground_free(&run);
    return status;
}

/* Seconds of one thread of an AMD EPYC with AVX-512, 2026, with other work beside it, by fits to a furnished
 * room (516 triangles), a pocket of 3,262, Cornell boxes, mazes, rooms, patios, atria, cities, anechoic rooms
 * and canopies of 900 to 4,000 elements: of exact counts they give .7 to 1.2 times what these take. Finding
 * links; the rows of pairs; segments against lists, of which a segment of a list and each occluder of it
 * count, and those cast into the scene. */
static const double shaft_seconds = 5e-7, candidate_seconds = 5e-8, hidden_seconds = 5e-5,
                    tried_seconds = 5e-8, close_seconds = 3.2e-6, test_seconds = 1.1e-6, sift_seconds = 7e-7,
                    projection_seconds = 6e-8, list_seconds = 8e-6, listed_seconds = 2e-8,
                    list_test_seconds = 1.2e-9, cast_seconds = 1.75e-7;

/* The rows of a sample lie apart, so that caches hold little of them: they take so many times as long as rows
 * in turn, 1.1 to 1.5 in these scenes. */
static const double times_apart = 1.35;

/* Few rays beside all pairs: not worth a sample. */
static const double few_ray_seconds = 1e-7;

/* The time of segments, which the sample does not cast; `all` are cast in place of those that were
 * counted. */
static double segments_seconds(const pairs_work *w, double all) {
    const double times = w->segments > 0 ? all / w->segments : 0;
    const double cast = fmax(w->segments - w->proven - w->listed, 0);
    return w->lists * list_seconds +
           times * (w->listed * listed_seconds + w->list_tests * list_test_seconds + cast * cast_seconds);
}

/* The time of rows of pairs, without their segments. */
static double rows_seconds_of(const pairs_work *w) {
    return w->tried * tried_seconds + w->close * close_seconds + w->tests * test_seconds +
           w->sifted * sift_seconds + w->projection * projection_seconds;
}

lam_status pairs_cost(const mesh *m, const recipe *r, double threshold, const progress *p, factor_cost *out,
                      lam_error *error) {
    lam_status status = LAM_OK;
    pairs_options options = pairs_options_of(r, m->n, threshold);
    pairs_work w = {0};
    pairs_trial trial = {.seconds = 0};
    visibility *v = NULL;
    factor_cost of_rays = {.seconds = (double)m->n * (double)r->rays * few_ray_seconds};
    options.progress = p;
    if (threshold > 0) TRY(rays_work(m, r->rays, &of_rays, error));
    TRY(visibility_create(m, &v, error));
    TRY(pairs_sample(m, v, &options, &w, &trial, error));
    const double segments = bounded_segments(&options, &w);
    const double entries = w.seen + of_rays.entries;
    const double links =
        w.shafts * shaft_seconds + w.candidates * candidate_seconds + w.hidden * hidden_seconds;
    const double cast = segments_seconds(&w, segments);
    const double rows = rows_seconds_of(&w), rest = cast + entries * factor_entry_seconds;
    const double pace = factor_cost_pace(trial.seconds, times_apart * rows_seconds_of(&trial.work));
    *out = (factor_cost){.seconds = links + rows + rest + of_rays.seconds,
                         .measured = trial.link_seconds + rows * pace + rest + of_rays.seconds,
                         .segments = cast,
                         .entries = 2 * entries,
                         .hits = of_rays.hits};
done:
    visibility_destroy(v);
    return status;
}

double pairs_cost_at(const factor_cost *cost, double accuracy, double other) {
    const double more = pow(accuracy / other, 1 / SEGMENTS_POWER);
    return cost->measured + (more - 1) * cost->segments;
}
