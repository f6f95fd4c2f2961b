#include "tests/bench/suites/mesh_skies.h"

#include "solver/adapt/mesh_error.h"
#include "solver/base/random.h"
#include "tests/bench/suites/mesh_truths.h"
#include "tests/bench/suites/scenes.h"

#include <math.h>
#include <stdlib.h>

static const table_column columns[] = {
    {"scene", NULL, "scene"},
    {"sky", NULL, "even, or cloudy: random radiances from .2 to 1"},
    {"elements", "", "n"},
    {"direct", "",
     "error of the sky's own light as a constant on each element, against a mesh 16 times finer"},
    {"constant", "", "error of all light that is reflected, likewise"},
    {"stated", "", "the error as a store states it, from the answer alone"},
};

static const char *const sky_names[MESH_LIGHTS] = {"even", "cloudy"};

typedef struct sky_scene {
    const char *name, *kind; /* kind: of a generated one; NULL: the furnished room with a window */
    size_t elements;
} sky_scene;

/* A mesh, its answers to the skies, and their first bounce alone. */
typedef struct sky_answers {
    lowrank_scene s;
    float *first; /* rho H0 [MESH_LIGHTS][C][n] */
    double *x;    /* the light beyond that */
    double *L;    /* [MESH_LIGHTS][n_tiles + 1] */
} sky_answers;

static void sky_answers_free(sky_answers *a) {
    lowrank_scene_free(&a->s);
    free(a->first);
    free(a->x);
    free(a->L);
}

/* The ground is black. */
static void set_skies(size_t n_tiles, uint64_t seed, double *L) {
    for (size_t t = 0; t < n_tiles; t++) {
        L[t] = 1;
        L[n_tiles + 1 + t] = .2 + .8 * random_unit(&seed);
    }
}

/* Takes the mesh over. */
static lam_status solve(const bench_run *run, const char *name, mesh *m, sky_answers *out, lam_error *error) {
    lam_status status = LAM_OK;
    sky_answers a = {.x = NULL};
    TRY(lowrank_open(run, name, m, NULL, &a.s, error));
    const size_t n = a.s.m.n, C = a.s.m.n_channels;
    const form_factor_options how = {.recipe = lowrank_recipe(run, n),
                                     .progress = run->progress,
                                     .stage = "form factors",
                                     .sky = "tregenza"};
    TRY(form_factors_make(&a.s.m, a.s.z_order, &how, &a.s.f, error));
    if (a.s.f.F.indptr == NULL) TRY(form_factors_expand(&a.s.f, a.s.m.area, error));
    const sky_bounce *sky = &a.s.f.sky;
    const size_t tiles = sky->tiling.n_tiles;
    a.L = memory_allocate(MESH_LIGHTS, (tiles + 1) * sizeof *a.L, "skies", error);
    a.first = memory_allocate(MESH_LIGHTS, C * n * sizeof *a.first, "skies", error);
    if (a.L == NULL || a.first == NULL) TRY(LAM_ERR_MEMORY);
    set_skies(tiles, run->seed, a.L);
    for (size_t l = 0; l < MESH_LIGHTS; l++)
        for (size_t i = 0; i < n; i++) {
            double H = 0;
            for (size_t t = 0; t < tiles; t++)
                H += a.L[l * (tiles + 1) + t] * (double)sky->first_bounce[t * n + i];
            for (size_t c = 0; c < C; c++)
                a.first[(l * C + c) * n + i] = (float)(H * (double)a.s.m.reflectance[c * n + i]);
        }
    TRY(mesh_converged(run, &a.s, a.first, &a.x, error));
    *out = a;
    a = (sky_answers){.x = NULL};
done:
    sky_answers_free(&a);
    return status;
}

/* The share of light that its constants on coarse elements leave out; all: beyond the first bounce, too. */
static double error_of(const sky_answers *coarse, const sky_answers *fine, size_t light, bool all) {
    const mesh *m = &fine->s.m;
    const size_t vector = coarse->s.m.n * m->n_channels;
    double off = 0, there = 0;
    for (size_t k = 0; k < MESH_FINER * vector; k++) {
        const size_t at = light * MESH_FINER * vector + k, from = light * vector + k / MESH_FINER;
        const double truth = (double)fine->first[at] + (all ? fine->x[at] : 0),
                     constant = (double)coarse->first[from] + (all ? coarse->x[from] : 0);
        off += m->area[k % m->n] * (constant - truth) * (constant - truth);
        there += m->area[k % m->n] * truth * truth;
    }
    return sqrt(off / there);
}

static lam_status add_scene(const bench_run *run, const sky_scene *scene, table *out, lam_error *error) {
    lam_status status = LAM_OK;
    const generate_options how = {.kind = scene->kind,
                                  .elements = scene->elements,
                                  .reflectance = -1,
                                  .seed = 1,
                                  .variant = 1,
                                  .terrain = "flat"};
    const mesh_refinement even = {.elements = scene->elements};
    mesh m = {0}, divided = {0};
    sky_answers coarse = {.x = NULL}, fine = {.x = NULL};
    float *B = NULL, *E = NULL;
    double stated[MESH_LIGHTS];
    TRY(bench_check(run, error));
    if (scene->kind != NULL)
        TRY(scene_generated(&how, &m, error));
    else
        TRY(scene_window(&m, error));
    if (scene->kind == NULL) TRY(mesh_refine(&m, &even, error));
    TRY(mesh_divide(&m, &divided, error));
    TRY(solve(run, scene->name, &divided, &fine, error));
    TRY(solve(run, scene->name, &m, &coarse, error));
    const size_t all = MESH_LIGHTS * coarse.s.m.n_channels * coarse.s.m.n;
    B = memory_allocate(all, sizeof *B, "answers", error);
    E = memory_allocate(all, sizeof *E, "answers", error);
    if (B == NULL || E == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < all; i++) B[i] = coarse.first[i] + (float)coarse.x[i];
    const gather_sky skies = {.tiling = &coarse.s.f.sky.tiling, .L = coarse.L};
    TRY(mesh_error(&coarse.s.m, MESH_LIGHTS, E, B, false, &skies, NULL, run->seed, run->progress, stated,
                   NULL, error));
    for (size_t l = 0; l < MESH_LIGHTS; l++) {
        table_text(out, scene->name);
        table_text(out, sky_names[l]);
        table_number(out, (double)coarse.s.m.n);
        table_number(out, error_of(&coarse, &fine, l, false));
        table_number(out, error_of(&coarse, &fine, l, true));
        table_number(out, stated[l]);
    }
done:
    free(B);
    free(E);
    sky_answers_free(&coarse);
    sky_answers_free(&fine);
    mesh_free(&m);
    mesh_free(&divided);
    return status;
}

lam_status mesh_skies(const bench_run *run, lam_error *error) {
    static const sky_scene scenes[] = {
        {"cornell", "cornell", 150}, {"window", NULL, 400}, {"patio", "patio", 250}, {"city", "city", 250}};
    lam_status status = LAM_OK;
    table out = {.name = "skies",
                 .title = "Light of skies that a mesh leaves out, constant on elements",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    for (size_t k = 0; k < (run->scale == BENCH_QUICK ? 1 : sizeof scenes / sizeof *scenes); k++)
        TRY(add_scene(run, &scenes[k], &out, error));
    TRY(bench_table(run, &out, error));
done:
    table_free(&out);
    return status;
}
