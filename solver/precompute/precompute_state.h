/* What the stages of a precompute hand on. Private to solver/precompute/. */
#ifndef LAMBERT_PRECOMPUTE_PRECOMPUTE_STATE_H
#define LAMBERT_PRECOMPUTE_PRECOMPUTE_STATE_H

#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/rays/ray_rows.h"
#include "solver/method/hierarchical/compress.h"
#include "solver/method/judge.h"
#include "solver/precompute/emitter_list.h"
#include "solver/precompute/forecast.h"
#include "solver/precompute/precompute.h"

typedef struct work {
    const precompute_options *options;
    terminal *t;
    progress progress;
    double memory;    /* bytes */
    scratch *scratch; /* NULL: none */
    mesh m;
    uint32_t *order;
    form_factors f;
    bool holds;                    /* somebody else asks for rows of F whatever the operator is */
    bool streamed;                 /* rows of F are found as the operator asks for them; f has none */
    ray_rows *rays;                /* of these, until the operator is built */
    row_stream stream;             /* of rays */
    compressed_factors compressed; /* of f; n is 0 where they are kept as they are, or not */
    recipe recipe;                 /* of f */
    bool large;                    /* its rows and the judge's lie in the scratch folder */
    size_t sky_tiles;
    size_t probes;
    emitter_wish emitters;
    lam_operator *op;
    build_report built;
    error_report errors;
} work;

/* The scene, or a store with its form factors: stage_scene.c. */
lam_status work_load_scene(work *w, lam_error *error);
lam_status work_load_store(work *w, lam_error *error);

/* Refines the mesh, orders it, chooses the recipe and sees that memory holds what it takes. */
lam_status work_prepare_mesh(work *w, lam_error *error);

/* Opens the folder for rows where one was given and is needed. */
lam_status work_take_scratch(work *w, lam_error *error);

/* The recipe of the judge's samples: with --rays given, of as many also where a store's form factors had
 * others. */
recipe work_judge_recipe(const work *w, uint64_t seed);

/* Whether something was asked for that operators of low rank alone have. */
bool work_is_low_rank(const precompute_options *o);

/* What n elements are going to take. */
forecast work_forecast(const work *w, double n);

/* Where large arrays lie; NULL: in memory. */
const large_place *work_large_place(const work *w);

/* Says how many rows were there already: precompute.c. */
void work_log_kept(work *w, const form_factors *f);

/* Frees all of it, and how much memory it may use: precompute.c. */
void work_free(work *w);
double work_memory(const precompute_options *o);

/* Form factors of a scene: precompute.c. */
lam_status work_trace(work *w, lam_error *error);

/* The rows of near pairs, if the recipe has any; the others are found while the operator is built. */
lam_status work_begin_stream(work *w, lam_error *error);

/* What methods are given; emitters: of work_emitters, as long as the problem is used. */
emitter_source work_emitters(const work *w);
build_problem work_problem(const work *w, const emitter_source *emitters);

/* Bytes of memory that form factors and mesh leave. */
size_t work_left(const work *w);

/* The operator and its errors: stage_operator.c. */
lam_status work_build(work *w, lam_error *error);
lam_status work_judge(work *w, lam_error *error);

/* Compresses the form factors where that was asked for and takes less than they do: stage_compress.c.
 */
lam_status work_compress(work *w, lam_error *error);

/* The sealed store: stage_store.c. */
lam_status work_save(work *w, lam_error *error);

#endif
