#include "solver/formfactor/pairs/pairs.h"

#include "solver/formfactor/pairs/cluster_links.h"
#include "solver/formfactor/pairs/pairs_refine.h"
#include "solver/formfactor/pairs/pairs_twice.h"

#include <math.h>
#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The mean factor of a pair, (A_i F_ij + A_j F_ji) / (A_i + A_j). Two ray estimates merged by their inverse
 * variances (upper.h) have the variance this / (2 rays) in S = A^1/2 F A^-1/2. */
static double factor_of(const pairs_run *run, uint32_t i, uint32_t j, double g) {
    return 2 * g / (run->on.m->area[i] + run->on.m->area[j]);
}

/* Settles a pair with few occluders by projection: g becomes its visible part. PAIR_UNKNOWN: it has more, or
 * eight segments are enough and nothing is proven. */
static int project(const pairs_run *run, uint32_t i, uint32_t j, const link_occluders *among, double *g) {
    double share = 1, work = 0;
    if (!pair_ground_projects(&run->on, i, j, *g)) {
        pair_occluders between;
        const few_verdict proven = few_occluders_between(&run->on.few, among, i, j, &between);
        if (proven == FEW_HIDDEN) *g = 0;
        return proven == FEW_OPEN     ? PAIR_CERTAIN
               : proven == FEW_HIDDEN ? PAIR_HIDDEN | PAIR_EXACT
                                      : PAIR_UNKNOWN;
    }
    const double tolerance = few_occluders_tolerance(&run->on.few, i, j, *g, run->on.options->accuracy);
    const few_verdict found = few_occluders_share(&run->on.few, among, i, j, *g, tolerance, &share, &work);
    *g *= share;
    return found == FEW_UNDECIDED ? PAIR_UNKNOWN
           : found == FEW_OPEN    ? PAIR_CERTAIN
           : found == FEW_HIDDEN  ? PAIR_HIDDEN | PAIR_EXACT
                                  : PAIR_MIXED | PAIR_EXACT;
}

/* The occlusion of a pair by projection, or its occlusion test; where that is accurate enough the pair is
 * settled, and g becomes its visible part unless nothing was seen. among: the occluders of the link, unless
 * pairs need none. */
static int look_at(const pairs_run *run, uint32_t i, uint32_t j, link_occluders *among, double *g) {
    double seen;
    const known_pairs *known = run->on.options->known;
    const int before = known != NULL ? known_pairs_look(known, i, j, run->on.options->seed, g) : PAIR_UNKNOWN;
    if (before != PAIR_UNKNOWN) return before;
    const int projected = run->on.projects ? project(run, i, j, among, g) : PAIR_UNKNOWN;
    if (projected != PAIR_UNKNOWN) return projected;
    segment_list list, *tested = NULL;
    if (run->listed != NULL && among->count != OCCLUDERS_UNCOUNTED) {
        list = (segment_list){among->count, among->of};
        tested = &list;
    }
    const occlusion_verdict verdict = occlusion_test(&run->on.occlusion, tested, i, j, *g, &seen);
    const int state = verdict == OCCLUSION_NONE    ? PAIR_OPEN
                      : verdict == OCCLUSION_TOTAL ? PAIR_HIDDEN
                                                   : PAIR_MIXED;
    if (!occlusion_test_suffices(&run->on.occlusion, i, j, *g)) return state;
    if (state != PAIR_HIDDEN) *g = seen;
    return state | PAIR_SETTLED;
}

/* The occluders of a link, which its pairs are projected with or tested against. */
static link_occluders *among_tested(const pairs_run *run, leaf_reaches *to, reach *r) {
    const occluders *o = &run->on.few.occluders;
    const int most = run->on.projects ? link_occluders_projected(o) : TESTED_OCCLUDERS_MOST;
    return leaf_reaches_among(&run->on.tree, o, most, to, r);
}

/* The pairs of one position: unoccluded exchange areas and, unless the shaft was empty, occlusion tests. */
static bool find_row(const pairs_run *run, uint32_t position, leaf_reaches *to, pair_block *block) {
    enum { PIECE = 64 };
    const uint32_t i = run->on.tree.element[position];
    for (size_t k = 0; k < to->n; k++) {
        reach *r = &to->reaches[k];
        link_occluders *among = NULL;
        const uint32_t begin = r->first > position ? r->first : position + 1;
        for (uint32_t first = begin; first < r->last; first += PIECE) {
            double exchange[PIECE];
            const uint32_t count = r->last - first < PIECE ? r->last - first : PIECE;
            if (!pair_block_reserve(block, count)) return false;
            pair_far_row(&run->on.far, position, first, count, exchange);
            for (uint32_t c = 0; c < count; c++) {
                const uint32_t j = run->on.tree.element[first + c];
                double g = exchange[c];
                if (g < 0)
                    g = pair_factor_exchange(&run->on.rules, &run->on.polygons[i], &run->on.polygons[j],
                                             run->on.options->tolerance);
                if (!((float)g > 0) || factor_of(run, i, j, g) < run->on.options->threshold) continue;
                if (among == NULL && !r->open && (run->on.projects || run->listed != NULL)) {
                    among = among_tested(run, to, r);
                    if (among == NULL) return false;
                }
                const int state = r->open ? PAIR_CERTAIN : look_at(run, i, j, among, &g);
                pair_block_add(block, first + c, (float)g, (uint8_t)state);
            }
        }
    }
    return true;
}

static bool find_block(pairs_run *run, size_t index, leaf_reaches *to) {
    pair_block *block = &run->rows.blocks[index];
    const size_t first = pair_rows_first(index), length = pair_rows_length(&run->rows, index);
    bool enough = true;
    for (size_t r = 0; r < length && enough; r++) {
        const size_t at = first + r;
        block->begin[r] = block->used;
        if (r == 0 || run->leaf[at] != run->leaf[at - 1])
            enough = leaf_reaches_find(&run->on.tree, &run->on.links, run->parent, run->leaf[at], to);
        enough = enough && find_row(run, (uint32_t)at, to, block);
    }
    for (size_t r = length; r <= PAIR_BLOCK_ROWS; r++) block->begin[r] = block->used;
    pair_block_shrink(block);
    return enough;
}

/* One pass over all blocks, either of tests or of estimates, and its scratch file. */
typedef struct pass {
    pairs_run *run;
    bool refine;
    double share_before, share; /* of the work, for the progress line */
    row_file *file;             /* NULL: none */
    size_t finished, kept;      /* rows */
    bool stop;
    lam_status status;
    lam_error error;
    pairs_report report;
} pass;

static void pass_fail(pass *p, lam_status status, const lam_error *error) {
#pragma omp critical(pairs_failure)
    if (p->status == LAM_OK) {
        p->status = status;
        p->error = *error;
    }
#pragma omp atomic write
    p->stop = true;
}

static void add_report(pairs_report *sum, const pairs_report *more) {
    sum->facing += more->facing;
    sum->certain += more->certain;
    sum->settled += more->settled;
    sum->open += more->open;
    sum->hidden += more->hidden;
    sum->projected += more->projected;
    sum->mixed += more->mixed;
}

/* Computes one block of a pass, or reads it from the file. */
static lam_status pass_block(pass *p, size_t index, leaf_reaches *to, pairs_report *more, lam_error *error) {
    pairs_run *run = p->run;
    const bool known = p->file != NULL && row_file_has(p->file, index);
    if (known) {
        const lam_status status =
            p->refine ? pair_rows_fetch_exchange(&run->rows, index, run->on.tree.element, p->file, error)
                      : pair_rows_fetch(&run->rows, index, run->on.tree.element, p->file, error);
        if (status != LAM_OK) return status;
    }
    const bool enough =
        p->refine ? pairs_refine_block(run, index, known, to, more) : known || find_block(run, index, to);
    if (!enough)
        return status_fail(error, LAM_ERR_MEMORY, "pairs of %zu elements: out of memory; use --quality draft",
                           run->on.m->n);
    if (p->file == NULL || known) return LAM_OK;
    lam_status status;
#pragma omp critical(pairs_file)
    status = pair_rows_append(&run->rows, index, run->on.tree.element, p->file, error);
    return status;
}

static lam_status pass_run(pass *p, lam_error *error) {
    pairs_run *run = p->run;
    const pairs_options *o = run->on.options;
    const size_t n_threads = (size_t)omp_get_max_threads();
    leaf_reaches *reaches = memory_allocate(n_threads, sizeof *reaches, "pairs", error);
    if (reaches == NULL) return LAM_ERR_MEMORY;
    if (p->file != NULL) p->kept = row_file_kept(p->file);
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t b = 0; b < run->rows.n_blocks; b++) {
        bool stop;
        lam_error why = {0};
        pairs_report more = {0};
#pragma omp atomic read
        stop = p->stop;
        if (stop) continue;
        const lam_status status = pass_block(p, b, &reaches[omp_get_thread_num()], &more, &why);
        if (status != LAM_OK) pass_fail(p, status, &why);
#pragma omp critical(pairs_progress)
        {
            add_report(&p->report, &more);
            p->finished += pair_rows_length(&run->rows, b);
            progress_report(o->progress, o->stage,
                            p->share_before + p->share * (double)p->finished / (double)run->on.m->n);
        }
        if (progress_cancelled(o->progress))
            pass_fail(p, status_fail(&why, LAM_ERR_CANCELLED, "cancelled"), &why);
    }
    for (size_t k = 0; k < n_threads; k++) leaf_reaches_free(&reaches[k]);
    free(reaches);
    if (p->status != LAM_OK && error != NULL) *error = p->error;
    return p->status;
}

/* The file of a pass in the scratch folder; none without one. */
static lam_status open_file(const pairs_run *run, const char *suffix, row_file **out, lam_error *error) {
    const pairs_options *o = run->on.options;
    char name[64], geometry[33];
    if (o->scratch == NULL) return LAM_OK;
    snprintf(name, sizeof name, "%s.%s", o->scratch_name, suffix);
    mesh_geometry_hash(run->on.m, geometry);
    return pair_rows_open(o->scratch, name, geometry, o->recipe, run->on.m->n, run->on.tree.element, out,
                          error);
}

static lam_status run_passes(pairs_run *run, pairs_report *report, size_t *kept, lam_error *error) {
    lam_status status = LAM_OK;
    pass find = {.run = run, .share_before = .1, .share = .5},
         refine = {.run = run, .refine = true, .share_before = .6, .share = .4};
    TRY(open_file(run, "found", &find.file, error));
    TRY(open_file(run, "seen", &refine.file, error));
    TRY(pass_run(&find, error));
    TRY(pairs_share_segments(run, error));
    TRY(pass_run(&refine, error));
    *report = refine.report;
    report->accuracy = run->on.occlusion.accuracy;
    if (kept != NULL) *kept = find.kept;
done:
    row_file_close(find.file);
    row_file_close(refine.file);
    return status;
}

static lam_status find_parents(pairs_run *run, lam_error *error) {
    const cluster_tree *t = &run->on.tree;
    run->parent = memory_allocate(t->n_clusters, sizeof *run->parent, "pairs", error);
    run->leaf = memory_allocate(t->n, sizeof *run->leaf, "pairs", error);
    if (run->parent == NULL || run->leaf == NULL) return LAM_ERR_MEMORY;
    for (size_t c = 0; c < t->n_clusters; c++) {
        const cluster *one = &t->clusters[c];
        if (cluster_is_leaf(one))
            for (uint32_t p = one->first; p < one->last; p++) run->leaf[p] = (uint32_t)c;
        else
            for (int k = 0; k < 2; k++) run->parent[one->child[k]] = (uint32_t)c;
    }
    return LAM_OK;
}

/* Moves the pairs that were found. */
static void keep_pairs(pairs_run *run, known_pairs *to) {
    *to = (known_pairs){run->rows, run->on.tree.position};
    run->rows = (pair_rows){.n = 0};
    run->on.tree.position = NULL;
}

lam_status pairs_exchange(const mesh *m, const visibility *v, const pairs_options *options, csr *G,
                          pairs_report *report, size_t *kept, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = m->n;
    pairs_run run = {.listed = NULL};
    TRY(pair_ground_find(m, v, options, 1, &run.on, error));
    if (run.on.lists) {
        TRY(segment_occluders_make(&run.on.few.occluders, visibility_centre(v), &run.listed, error));
        run.on.occlusion.occluders = run.listed;
    }
    run.neighbours = memory_allocate(n, sizeof *run.neighbours, "pairs", error);
    if (run.neighbours == NULL) TRY(LAM_ERR_MEMORY);
    TRY(element_neighbours_find(m, run.neighbours, error));
    TRY(pair_rows_create(n, &run.rows, error));
    TRY(find_parents(&run, error));
    TRY(run_passes(&run, report, kept, error));
    report->hidden += run.on.links.hidden_pairs;
    report->facing += run.on.links.hidden_pairs;
    TRY(pair_rows_gather(&run.rows, run.on.tree.element, options->keep_hidden, G, error));
    if (options->keep != NULL) keep_pairs(&run, options->keep);
done:
    pair_rows_free(&run.rows);
    pair_demand_free(&run.demand);
    free(run.neighbours);
    free(run.parent);
    free(run.leaf);
    free(run.listed);
    pair_ground_free(&run.on);
    return status;
}

/* The bound on segments for all mixed pairs: 32,768 per element and at least 64 million at the accuracy of
 * normal quality, 7e-5, scaled by the law of their error. */
static double segments_most(size_t n, double accuracy) {
    const double an_element = 32768, enough = 64e6, normal = 7e-5;
    return fmax(an_element * (double)n, enough) * pow(normal / accuracy, 1 / SEGMENTS_POWER);
}

/* Few elements need few segments for the accuracy asked for. Half a second more makes their large factors
 * nearly ten times more accurate. */
static const double segments_least = 8e6;

pairs_options pairs_options_of(const recipe *r, size_t n, double threshold) {
    const bool near = threshold > 0;
    return (pairs_options){.tolerance = recipe_tolerance(r),
                           .accuracy = recipe_accuracy(r),
                           .segments = VISIBILITY_PACKET,
                           .segments_least = near ? 0 : segments_least,
                           .segments_most =
                               near ? (double)n * (double)r->rays : segments_most(n, r->accuracy),
                           .occluders = near ? 0 : UNCUT_OCCLUDERS_MOST,
                           .threshold = threshold,
                           .keep_hidden = near,
                           .seed = r->seed,
                           .recipe = r};
}

lam_status pairs_find(const mesh *m, const visibility *v, const form_factor_options *options,
                      double threshold, form_factors *f, csr *G, lam_error *error) {
    pairs_options how = pairs_options_of(&options->recipe, m->n, threshold);
    how.progress = options->progress;
    how.stage = options->stage;
    how.scratch = options->scratch;
    how.scratch_name = options->scratch_name;
    return pairs_exchange(m, v, &how, G, &f->pairs, &f->rows_kept, error);
}
