/* Makes form factors by blocks of clusters: parts, balance of rows and what leaves. */
#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/source.h"

#include "solver/formfactor/blocks/blocks.h"
#include "solver/formfactor/blocks/blocks_importance.h"
#include "solver/formfactor/blocks/unhidden.h"
#include "solver/formfactor/glass/pane_factors.h"
#include "solver/formfactor/leaving.h"
#include "solver/formfactor/rays/rays.h"
#include "solver/formfactor/row_scaling.h"
#include "solver/formfactor/visibility/parts.h"

#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>

typedef struct balanced_blocks {
    block_factors *blocks;
    const double *ones;    /* [n] */
    void *work;            /* of a product */
    const double *outside; /* [n], the shares that leave to a sky or meet back faces; NULL: not balanced */
} balanced_blocks;

/* r_i = A_i ((F' 1)_i + d_i outside_i) with F' = D F D. */
static lam_status sums_of_blocks(void *context, const double *d, double *r, lam_error *error) {
    const balanced_blocks *of = context;
    const block_factors *blocks = of->blocks;
    const block_vectors vectors = {.count = 1, .step = 1, .x = &of->ones, .y = &r};
    (void)error;
    memcpy(blocks->balance, d, blocks->n * sizeof *d);
    block_factors_apply(blocks, &vectors, of->work, (size_t)omp_get_max_threads());
#pragma omp parallel for schedule(static)
    for (size_t p = 0; p < blocks->n; p++) {
        if (of->outside != NULL) r[p] += d[p] * of->outside[p];
        r[p] *= blocks->area[p];
    }
    return LAM_OK;
}

/* Sweeps of the balance of an open scene, where only rows that sum to more than 1 are scaled down, or of a
 * closed one that no scaling closes. */
enum { SWEEPS = 8 };

static lam_status balance_open(row_scaling *c, double *before, lam_error *error) {
    lam_status status = LAM_OK;
    for (size_t p = 0; p < c->n; p++) c->d[p] = 1;
    for (int sweep = 0; sweep < SWEEPS; sweep++) {
        TRY(c->sums(c->context, c->d, c->r, error));
        c->products++;
        for (size_t p = 0; p < c->n; p++) {
            if (sweep == 0) before[p] = fmax(c->r[p], c->area[p]);
            if (c->r[p] > c->area[p]) c->d[p] *= sqrt(c->area[p] / c->r[p]);
        }
    }
    /* The root leaves a rest above 1. */
    TRY(c->sums(c->context, c->d, c->r, error));
    c->products++;
    for (size_t p = 0; p < c->n; p++)
        if (c->r[p] > c->area[p]) c->d[p] *= c->area[p] / c->r[p];
done:
    return status;
}

/* Of a judge's blocks one in so many is cast against the whole scene: an occluder that the lists lack shows
 * in them, and all of them took the judge 1.4 to 1.8 times as long as none for the same figures (a Cornell
 * box of 3,550 elements, a room of 1,612). */
enum { JUDGE_SCENE_EVERY = 4 };

/* Row sums of a judge's blocks in closed scenes may be off by this: a thirtieth of the least errors of random
 * emission that were judged. */
static const double judge_balance = 3e-6;

/* No row sum is smaller than this: a scaling cannot make it 0. */
static const double least_target = 1e-9;

/* F' = D F D with the given row sums [n], by element, through panes included, to a tolerance (0: the least);
 * targets NULL: rows that sum to 1 in a closed scene, and to at most 1 in others. Beside a sky, whose many
 * rays tell each element's share outside better than a block tells its own, rows without targets sum to 1
 * with that share, which is scaled with them. Rows of buried elements are empty. Sets the row sums of f, and
 * how much they were repaired. */
static lam_status balance_blocks(form_factors *f, const mesh *m, block_factors *blocks, const double *targets,
                                 double tolerance, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = blocks->n;
    const bool closed = targets == NULL && leaving_nothing(f);
    const bool sky = targets == NULL && !closed && f->sky.first_bounce != NULL;
    const double *const through = f->through;
    double *outside = memory_allocate(n, sizeof *outside, "form factors", error);
    double *wanted = memory_allocate(n, sizeof *wanted, "form factors", error); /* A_i times the row sum */
    double *before = memory_allocate(n, sizeof *before, "form factors", error), area = 0;
    double *d = memory_allocate(n, sizeof *d, "form factors", error);
    double *r = memory_allocate(n, sizeof *r, "form factors", error);
    double *ones = memory_allocate(n, sizeof *ones, "form factors", error);
    void *work = memory_allocate(block_factors_work(blocks, 1), 1, "form factors", error);
    blocks->balance = memory_allocate(n, sizeof *blocks->balance, "form factors", error);
    f->row_sums = memory_allocate(n, sizeof *f->row_sums, "form factors", error);
    if (outside == NULL || wanted == NULL || before == NULL || d == NULL || r == NULL || ones == NULL ||
        work == NULL || blocks->balance == NULL || f->row_sums == NULL)
        TRY(LAM_ERR_MEMORY);
    for (size_t p = 0; p < n; p++) {
        ones[p] = 1;
        const uint32_t i = blocks->order[p];
        const double all = mesh_is_buried(m, i) && !sky ? 0 : 1 + (through != NULL ? through[i] : 0);
        const double target = targets != NULL ? targets[i] : all;
        outside[p] = sky ? leaving_outside(f, m, i) : 0;
        wanted[p] = blocks->area[p] * fmax(target, least_target);
    }
    balanced_blocks of = {blocks, ones, work, sky ? outside : NULL};
    row_scaling c = {.n = n,
                     .area = wanted,
                     .sums = sums_of_blocks,
                     .context = &of,
                     .sweeps_most = SWEEPS,
                     .tolerance = tolerance,
                     .d = d,
                     .r = r};
    TRY(closed || sky || targets != NULL ? row_scaling_settle(&c, before, error)
                                         : balance_open(&c, before, error));
    TRY(sums_of_blocks(&of, d, r, error));
    f->repair_products = c.products + 1;
    for (size_t p = 0; p < n; p++) {
        const double sum = r[p] / blocks->area[p], off = fabs(before[p] / wanted[p] - 1);
        area += blocks->area[p];
        f->row_sums[blocks->order[p]] =
            fmin(sum - d[p] * outside[p], 1 + (through != NULL ? through[blocks->order[p]] : 0));
        if (mesh_is_buried(m, blocks->order[p])) continue;
        f->repair_mean += blocks->area[p] * off;
        f->repair_max = fmax(f->repair_max, off);
        if (closed) f->closure_error = fmax(f->closure_error, fabs(sum - wanted[p] / blocks->area[p]));
    }
    f->repair_mean /= area;
done:
    free(outside);
    free(before);
    free(d);
    free(r);
    free(ones);
    free(work);
    free(wanted);
    return status;
}

/* The parts of a scene; NULL: one. */
static lam_status find_parts(const mesh *m, uint32_t **out, lam_error *error) {
    lam_status status = LAM_OK;
    size_t count = 0;
    visibility *v = NULL;
    uint32_t *part = memory_allocate(m->n, sizeof *part, "parts of the scene", error);
    if (part == NULL) return LAM_ERR_MEMORY;
    TRY(visibility_create(m, &v, error));
    TRY(visibility_parts(m, v, part, &count, error));
    if (count == 1) goto done;
    *out = part;
    part = NULL;
done:
    free(part);
    visibility_destroy(v);
    return status;
}

lam_status form_factors_tree(const mesh *m, plane_tree *out, lam_error *error) {
    lam_status status = LAM_OK;
    plane_tree tree = {.n = 0};
    uint32_t *part = NULL;
    double(*centre)[3] = memory_allocate(m->n, sizeof *centre, "centroids", error);
    const element_corners corners = {(const double(*)[3])m->vertices, (const uint32_t(*)[4])m->elements};
    if (centre == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < m->n; i++) mesh_centroid(m, i, centre[i]);
    TRY(plane_tree_make(m->n, (const double(*)[3])centre, (const float(*)[3])m->normal, &corners, NULL,
                        PLANE_LEAF, &tree, error));
    if (blocks_are_planar(&tree)) TRY(find_parts(m, &part, error));
    if (part != NULL) {
        plane_tree_free(&tree);
        TRY(plane_tree_make(m->n, (const double(*)[3])centre, (const float(*)[3])m->normal, &corners, part,
                            PLANE_LEAF, &tree, error));
    }
    TRY(plane_tree_look(m, &tree, error));
    *out = tree;
    tree = (plane_tree){.n = 0};
done:
    plane_tree_free(&tree);
    free(centre);
    free(part);
    return status;
}

/* Finds by rays if the scene is closed and has turned faces, and each element's share of the tiles of a sky
 * that f has. */
static lam_status find_outside(const mesh *m, const visibility *v, const uint32_t *order,
                               const form_factor_options *options, form_factors *f, lam_error *error) {
    lam_status status = LAM_OK;
    packed_rows counts = {0};
    const recipe *r = &options->recipe;
    const form_factor_options few = {.recipe = {.source = &source_rays, .rays = r->rays, .seed = r->seed},
                                     .without_rows = true,
                                     .openings = options->openings,
                                     .n_aimed = &f->n_aimed,
                                     .bounce = f->sky.first_bounce != NULL ? &f->sky : NULL};
    f->leaving = memory_allocate(m->n, sizeof *f->leaving, "form factors", error);
    f->absorbed = memory_allocate(m->n, sizeof *f->absorbed, "form factors", error);
    if (f->leaving == NULL || f->absorbed == NULL) TRY(LAM_ERR_MEMORY);
    TRY(rays_count(m, v, order, &few, &counts, f->leaving, f->absorbed, error));
    leaving_measure(f, m, v);
done:
    packed_rows_free(&counts);
    return status;
}

lam_status form_factors_make_blocks(const mesh *m, const uint32_t *order, const plane_tree *tree,
                                    const form_factors *judged, const form_factor_options *options,
                                    form_factors *out, block_factors *blocks, lam_error *error) {
    lam_status status = LAM_OK;
    const recipe *r = &options->recipe;
    form_factors f = {.recipe = *r};
    block_factors made = {.n = 0};
    const pane_samples through = panes_beside(r);
    block_scene *own = NULL, *scene = options->ready;
    double *targets = NULL;
    bool known = false;
    block_options how = block_options_of(r);
    how.scene_every = judged != NULL ? JUDGE_SCENE_EVERY : 0;
    how.progress = options->progress;
    how.stage = options->stage;
    TRY(recipe_check(r, error));
    if (scene == NULL) {
        TRY(block_scene_make(m, tree, &own, error));
        scene = own;
    }
    if (judged == NULL) {
        if (options->sky != NULL)
            TRY(sky_bounce_create(options->sky, m->up, options->ground_albedo, m->n, &f.sky, error));
        TRY(find_outside(m, block_scene_visibility(scene), order, options, &f, error));
    } else {
        f.closed = judged->closed;
        f.leaving_share = judged->leaving_share;
        f.absorbed_share = judged->absorbed_share;
        f.outlet = judged->outlet;
    }
    if (options->importance != NULL) {
        TRY(blocks_importance(m, block_scene_visibility(scene), tree, &how, options->importance, error));
        how.importance = options->importance;
    }
    TRY(blocks_find_in(scene, &how, &made, &f.blocks, &f.through, error));
    if (options->row_sums != NULL && judged != NULL && judged->through != NULL) {
        targets = memory_allocate(m->n, sizeof *targets, "form factors", error);
        if (targets == NULL) TRY(LAM_ERR_MEMORY);
        for (size_t i = 0; i < m->n; i++)
            targets[i] = options->row_sums[i] - judged->through[i] + (f.through != NULL ? f.through[i] : 0);
        known = true;
    }
    if (f.blocks.joined) {
        targets = memory_allocate(m->n, sizeof *targets, "form factors", error);
        if (targets == NULL) TRY(LAM_ERR_MEMORY);
        TRY(unhidden_row_sums(m, &known, targets, error));
    }
    TRY(balance_blocks(&f, m, &made, known ? targets : options->row_sums, judged != NULL ? judge_balance : 0,
                       error));
    if (f.sky.first_bounce != NULL) {
        TRY(leaving_to_sky(&f, m, error));
        TRY(panes_add_bounce(m, block_scene_visibility(scene), order, options, &through, &f.sky, NULL,
                             error));
    }
    *out = f;
    *blocks = made;
    f = (form_factors){0};
    made = (block_factors){.n = 0};
done:
    block_scene_destroy(own);
    free(targets);
    block_factors_free(&made);
    form_factors_free(&f);
    return status;
}
