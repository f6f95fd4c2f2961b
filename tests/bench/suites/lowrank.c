/* Suite lowrank: the low-rank family at the sizes of both papers. Here: its scenes, one factorization, one
 * operator. */
#include "tests/bench/suites/lowrank.h"
#include "solver/base/clock.h"
#include "solver/method/norm.h"
#include "solver/scene/surfaces.h"
#include "tests/bench/suites/formfactors.h"
#include "tests/bench/suites/scenes.h"
#include "tests/bench/suites/stats.h"

#include <errno.h>
#include <malloc.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* Above this many elements all pairs would take minutes. */
enum { PAIRS_MOST = 24000, RAYS = 4096, REPEATS_MOST = 9 };

void lowrank_scene_free(lowrank_scene *s) {
    form_factors_free(&s->f);
    free(s->z_order);
    free(s->mesh_order);
    free(s->centre);
    free(s->surface);
    mesh_free(&s->m);
    *s = (lowrank_scene){0};
}

recipe lowrank_recipe(const bench_run *run, size_t elements) {
    return elements <= PAIRS_MOST ? formfactors_pairs(7e-5, run->seed) : formfactors_rays(RAYS, run->seed);
}

lam_status lowrank_open(const bench_run *run, const char *name, mesh *m, const recipe *how,
                        lowrank_scene *out, lam_error *error) {
    lam_status status = LAM_OK;
    lowrank_scene s = {.name = name, .m = *m};
    size_t n_surfaces;
    *m = (mesh){0};
    TRY(formfactors_order(&s.m, &s.z_order, error));
    s.mesh_order = memory_allocate(s.m.n, sizeof *s.mesh_order, "scene", error);
    s.centre = memory_allocate(s.m.n, sizeof *s.centre, "scene", error);
    s.surface = memory_allocate(s.m.n, sizeof *s.surface, "scene", error);
    if (s.mesh_order == NULL || s.centre == NULL || s.surface == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < s.m.n; i++) {
        s.mesh_order[i] = (uint32_t)i;
        mesh_centroid(&s.m, i, s.centre[i]);
    }
    TRY(mesh_surfaces(&s.m, s.surface, &n_surfaces, error));
    if (how != NULL) TRY(lowrank_trace(run, &s, how, error));
    *out = s;
    s = (lowrank_scene){0};
done:
    lowrank_scene_free(&s);
    return status;
}

lam_status lowrank_trace(const bench_run *run, lowrank_scene *s, const recipe *how, lam_error *error) {
    lam_status status = LAM_OK;
    TRY(formfactors_make_timed(run, &s->m, s->z_order, how, "form factors", &s->f, &s->seconds, error));
    if (s->f.F.indptr == NULL) TRY(form_factors_expand(&s->f, s->m.area, error));
    bench_say(run, "%s of %zu elements: form factors in %.1f s", s->name, s->m.n, s->seconds);
done:
    return status;
}

static lam_status open_usual(const bench_run *run, const char *name, mesh *m, lowrank_scene *out,
                             lam_error *error) {
    const recipe how = lowrank_recipe(run, m->n);
    return lowrank_open(run, name, m, &how, out, error);
}

/* Cuts a wall into u x v parallelograms, each one piece or two triangles. */
static size_t add_wall(scene_piece *pieces, const double corner[3], const double along[3],
                       const double across[3], size_t u, size_t v, bool triangles) {
    size_t n = 0;
    for (size_t i = 0; i < u; i++)
        for (size_t k = 0; k < v; k++) {
            scene_piece p = {.triangle = triangles};
            for (int d = 0; d < 3; d++) {
                p.along[d] = along[d] / (double)u;
                p.across[d] = across[d] / (double)v;
                p.corner[d] = corner[d] + p.along[d] * (double)i + p.across[d] * (double)k;
            }
            pieces[n++] = p;
            if (!triangles) continue;
            scene_piece other = p;
            for (int d = 0; d < 3; d++) {
                other.corner[d] = p.corner[d] + p.along[d] + p.across[d];
                other.along[d] = -p.along[d];
                other.across[d] = -p.across[d];
            }
            pieces[n++] = other;
        }
    return n;
}

lam_status lowrank_bare_room(const bench_run *run, size_t divisions, lowrank_scene *out, lam_error *error) {
    /* floor, ceiling, left, right, back: fronts inside */
    static const double walls[5][3][3] = {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
                                          {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}},
                                          {{0, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                                          {{1, 0, 0}, {0, 0, 1}, {0, 1, 0}},
                                          {{0, 1, 0}, {1, 0, 0}, {0, 0, 1}}};
    lam_status status = LAM_OK;
    mesh m = {0};
    size_t n = 0;
    scene_piece *pieces = memory_allocate(10 * divisions * divisions, sizeof *pieces, "scene", error);
    if (pieces == NULL) TRY(LAM_ERR_MEMORY);
    for (int w = 0; w < 5; w++)
        n += add_wall(pieces + n, walls[w][0], walls[w][1], walls[w][2], divisions, divisions, true);
    TRY(scene_of_pieces(pieces, n, &m, error));
    TRY(lowrank_open(run, "open room", &m, NULL, out, error));
done:
    free(pieces);
    mesh_free(&m);
    return status;
}

lam_status lowrank_room(const bench_run *run, size_t divisions, lowrank_scene *out, lam_error *error) {
    lam_status status = LAM_OK;
    lowrank_scene s = {.name = NULL};
    TRY(lowrank_bare_room(run, divisions, &s, error));
    const recipe how = lowrank_recipe(run, s.m.n);
    TRY(lowrank_trace(run, &s, &how, error));
    *out = s;
    s = (lowrank_scene){.name = NULL};
done:
    lowrank_scene_free(&s);
    return status;
}

lam_status lowrank_cornell(const bench_run *run, size_t elements, lowrank_scene *out, lam_error *error) {
    lam_status status = LAM_OK;
    mesh m = {0};
    TRY(scene_cornell(elements, &m, error));
    TRY(open_usual(run, "cornell", &m, out, error));
done:
    mesh_free(&m);
    return status;
}

/* Cuts rectangles into cells of about one size. */
typedef struct builder {
    double cell;
    scene_piece *pieces; /* NULL: only counted */
    size_t n;
} builder;

static void add_rectangle(builder *b, double x, double y, double z, const double along[3],
                          const double across[3]) {
    double size[2] = {0, 0};
    for (int d = 0; d < 3; d++) {
        size[0] += along[d] > 0 ? along[d] : -along[d];
        size[1] += across[d] > 0 ? across[d] : -across[d];
    }
    const size_t u = (size_t)(size[0] / b->cell + .999), v = (size_t)(size[1] / b->cell + .999);
    const double corner[3] = {x, y, z};
    if (b->pieces != NULL) add_wall(b->pieces + b->n, corner, along, across, u, v, false);
    b->n += u * v;
}

/* The four sides of a shaft x0 ... x1, y0 ... y1, z0 ... z1, fronts outside or inside. */
static void add_sides(builder *b, const double at[3][2], bool outside) {
    const double w = at[0][1] - at[0][0], d = at[1][1] - at[1][0], h = at[2][1] - at[2][0], z = at[2][0];
    const double up[3] = {0, 0, h}, east[3] = {w, 0, 0}, north[3] = {0, d, 0};
    const double *first[4] = {outside ? east : up, outside ? up : east, outside ? up : north,
                              outside ? north : up};
    const double *second[4] = {outside ? up : east, outside ? east : up, outside ? north : up,
                               outside ? up : north};
    const double x[4] = {at[0][0], at[0][0], at[0][0], at[0][1]},
                 y[4] = {at[1][0], at[1][1], at[1][0], at[1][0]};
    for (int k = 0; k < 4; k++) add_rectangle(b, x[k], y[k], z, first[k], second[k]);
}

/* A ring between two squares about (8, 8), half sizes inner and outer, at height z, facing up or down. */
static void add_ring(builder *b, double inner, double outer, double z, bool up) {
    const double strips[4][4] = {{8 - outer, 8 - outer, 2 * outer, outer - inner},
                                 {8 - outer, 8 + inner, 2 * outer, outer - inner},
                                 {8 - outer, 8 - inner, outer - inner, 2 * inner},
                                 {8 + inner, 8 - inner, outer - inner, 2 * inner}};
    for (int k = 0; k < 4; k++) {
        const double east[3] = {strips[k][2], 0, 0}, north[3] = {0, strips[k][3], 0};
        add_rectangle(b, strips[k][0], strips[k][1], z, up ? east : north, up ? north : east);
    }
}

/* A court of 8 m under the sky, galleries of 4 m about it on two storeys of 3 m, a column every 2 m. */
static void add_patio(builder *b) {
    const double east[3] = {16, 0, 0}, north[3] = {0, 16, 0};
    const double outer[3][2] = {{0, 16}, {0, 16}, {0, 6.5}};
    add_rectangle(b, 0, 0, 0, east, north);
    add_sides(b, outer, false);
    add_ring(b, 4, 8, 3, false); /* the slab between the storeys: below, above, and its edge to the court */
    add_ring(b, 4, 8, 3.5, true);
    const double edge[3][2] = {{4, 12}, {4, 12}, {3, 3.5}};
    add_sides(b, edge, false);
    add_ring(b, 4, 8, 6.5, false);
    for (int storey = 0; storey < 2; storey++)
        for (int side = 0; side < 4; side++)
            for (int k = 0; k < 4; k++) {
                const double along = 4 + 2 * k, at = side % 2 == 0 ? 3.6 : 12.4;
                const double x = side < 2 ? along : at, y = side < 2 ? at : along + 2,
                             z = storey == 0 ? 0 : 3.5;
                const double column[3][2] = {{x - .2, x + .2}, {y - .2, y + .2}, {z, z + 3}};
                add_sides(b, column, true);
            }
}

lam_status lowrank_patio(const bench_run *run, size_t elements, lowrank_scene *out, lam_error *error) {
    lam_status status = LAM_OK;
    mesh m = {0};
    builder b = {.cell = 4};
    for (;; b.cell *= .98) {
        b.n = 0;
        add_patio(&b);
        if (b.n >= elements) break;
    }
    b.pieces = memory_allocate(b.n, sizeof *b.pieces, "scene", error);
    if (b.pieces == NULL) TRY(LAM_ERR_MEMORY);
    b.n = 0;
    add_patio(&b);
    TRY(scene_of_pieces(b.pieces, b.n, &m, error));
    TRY(open_usual(run, "patio", &m, out, error));
done:
    free(b.pieces);
    mesh_free(&m);
    return status;
}

lam_status lowrank_box_and_patio(const bench_run *run, const size_t sizes[2], lowrank_of_scene *one,
                                 table *out, lam_error *error) {
    lam_status status = LAM_OK;
    lowrank_scene s = {.name = NULL};
    for (int k = 0; k < 2; k++) {
        TRY(k == 0 ? lowrank_cornell(run, sizes[0], &s, error) : lowrank_patio(run, sizes[1], &s, error));
        TRY(one(run, &s, k == 1, out, error));
        lowrank_scene_free(&s);
    }
    TRY(bench_table(run, out, error));
done:
    lowrank_scene_free(&s);
    return status;
}

factorizer_options lowrank_options(const bench_run *run, double epsilon, size_t rank) {
    return (factorizer_options){.epsilon = epsilon,
                                .rank = rank,
                                .budget = {.alpha = .5},
                                .levels = -1,
                                .iterations = -1,
                                .seed = run->seed,
                                .progress = run->progress};
}

/* A line of /proc/self/status in bytes, 0 where there is none. */
static double memory_of(const char *name) {
    char line[256];
    double kib = 0;
    FILE *f = fopen("/proc/self/status", "r");
    if (f == NULL) return 0;
    while (fgets(line, sizeof line, f) != NULL)
        if (strncmp(line, name, strlen(name)) == 0) kib = strtod(line + strlen(name) + 1, NULL);
    fclose(f);
    return 1024 * kib;
}

double lowrank_begin_peak(void) {
    malloc_trim(0);
    const double now = memory_of("VmRSS:");
    FILE *f = fopen("/proc/self/clear_refs", "w");
    if (f == NULL) return now;
    fputs("5", f);
    fclose(f);
    return now;
}

double lowrank_peak(double before) {
    return memory_of("VmHWM:") - before;
}

lam_status lowrank_factorize(const bench_run *run, const lowrank_scene *s, const char *name,
                             const factorizer_options *options, bool in_z_order, size_t repeats,
                             lowrank_result *out, lam_error *error) {
    lam_status status = LAM_OK;
    row_source rows;
    scaled_matrix S = {0};
    tall_factors f = {0};
    double seconds[REPEATS_MOST], before;
    if (repeats > REPEATS_MOST) repeats = REPEATS_MOST;
    row_source_of_csr(&rows, &s->f.F);
    TRY(scaled_init(&S, &rows, s->m.area, in_z_order ? s->z_order : s->mesh_order, error));
    before = lowrank_begin_peak();
    for (size_t k = 0; k < repeats; k++) {
        TRY(bench_check(run, error));
        tall_factors_free(&f);
        const double started = clock_seconds();
        TRY(factorize(name, &S, options, &f, &out->report, error));
        seconds[k] = clock_seconds() - started;
    }
    out->peak = lowrank_peak(before);
    out->seconds = stats_median(seconds, repeats);
    out->rank = f.rank;
    TRY(norm_of_error(&S, &f, run->progress, &out->real, error));
done:
    tall_factors_free(&f);
    scaled_free(&S);
    return status;
}

build_problem lowrank_problem(const lowrank_scene *s) {
    return (build_problem){.n = s->m.n,
                           .n_channels = s->m.n_channels,
                           .area = s->m.area,
                           .reflectance = s->m.reflectance,
                           .F = &s->f.F,
                           .order = s->z_order,
                           .noise = recipe_noise(&s->f.recipe),
                           .centre = (const double(*)[3])s->centre,
                           .normal = (const float(*)[3])s->m.normal,
                           .surface = s->surface};
}

/* The kind emitters takes weights of its emitters in place of an emission. */
static lam_status answer(const lam_operator *op, const float *E, float *B, void *work, size_t bytes,
                         lam_error *error) {
    if (lam_operator_emitters(op) > 0)
        return lam_operator_apply_emitters(op, 1, LAM_RADIOSITY, E, 0, NULL, B, work, bytes, error);
    return lam_operator_apply(op, 1, LAM_RADIOSITY, E, B, work, bytes, error);
}

lam_status lowrank_time_answer(const lam_operator *op, size_t solves, double *median, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = lam_operator_elements(op) * lam_operator_channels(op);
    double seconds[LOWRANK_SOLVES_MOST];
    float *E = NULL, *B = NULL;
    void *work = NULL;
    const size_t bytes = lam_operator_work_bytes(op, 1);
    E = memory_allocate(n, sizeof *E, "an answer", error);
    B = memory_allocate(n, sizeof *B, "an answer", error);
    work = memory_allocate(1, bytes, "an answer", error);
    if (E == NULL || B == NULL || work == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) E[i] = (float)(i % 7);
    for (size_t k = 0; k < solves; k++) {
        const double started = clock_seconds();
        TRY(answer(op, E, B, work, bytes, error));
        seconds[k] = clock_seconds() - started;
    }
    *median = stats_median(seconds, solves);
done:
    free(E);
    free(B);
    free(work);
    return status;
}

lam_status lowrank_stored_bytes(const lam_operator *op, double *bytes, lam_error *error) {
    lam_status status = LAM_OK;
    const char *parent = getenv("TMPDIR");
    char path[4096];
    struct stat about;
    store *s = NULL;
    if (parent == NULL || parent[0] == '\0') parent = "/tmp";
    snprintf(path, sizeof path, "%s/lambert-bench-%ld.h5", parent, (long)getpid());
    TRY(store_create(path, &s, error));
    TRY(operator_save(op, s, error));
    store *const sealing = s;
    s = NULL;
    TRY(store_seal(sealing, error));
    if (stat(path, &about) != 0) FAIL(error, LAM_ERR_IO, "%s: %s", path, strerror(errno));
    *bytes = (double)about.st_size;
done:
    store_close(s);
    unlink(path);
    return status;
}

lam_status lowrank_judge(const bench_run *run, const lowrank_scene *s, const lowrank_case *of,
                         lowrank_verdict *out, lam_error *error) {
    lam_status status = LAM_OK;
    build_problem problem = lowrank_problem(s);
    build_options how = build_presets(of->method);
    const judge_input input = {.problem = &problem,
                               .row_sums = s->f.row_sums,
                               .emission = s->m.emission,
                               .own = factor_product_of_rows(problem.F),
                               .independent = of->independent != NULL
                                                  ? factor_product_of_rows(of->independent)
                                                  : (factor_product){.n = 0},
                               .first_light = of->first != NULL ? first_light_for_judge : NULL,
                               .first_light_context = of->first,
                               .probes = s->m.n < of->probes ? s->m.n : of->probes,
                               .seed = run->seed,
                               .progress = run->progress};
    lowrank_verdict verdict = {.bytes = 0};
    lam_operator *op = NULL;
    problem.emitters = of->emitters;
    TRY(bench_check(run, error));
    how.seed = run->seed;
    how.progress = run->progress;
    TRY(build_set(&how, "factorizer", of->factorizer, error));
    TRY(build_set_number(&how, "epsilon", of->epsilon, error));
    if (of->rank > 0) TRY(build_set_number(&how, "rank", (double)of->rank, error));
    if (of->threshold > 0) TRY(build_set_number(&how, "threshold", of->threshold, error));
    if (of->assign != NULL) TRY(build_set(&how, "assign", of->assign, error));
    TRY(build_operator(&problem, &how, &op, &verdict.built, error));
    TRY(lowrank_time_answer(op, LOWRANK_SOLVES_MOST, &verdict.answer_seconds, error));
    TRY(judge_operator(op, &input, &verdict.judged, error));
    verdict.bytes = (double)lam_operator_bytes(op);
    if (of->weighed) TRY(lowrank_stored_bytes(op, &verdict.stored, error));
    *out = verdict;
done:
    lam_operator_close(op);
    return status;
}

enum { ROOMS_MOST = 4 };

lam_status bench_lowrank(const bench_run *run, lam_error *error) {
    /* 640 and 2,560 elements; 2,560 and 10,240; all sizes of the thesis */
    static const size_t divisions[3][ROOMS_MOST] = {{8, 16, 0, 0}, {16, 32, 0, 0}, {16, 32, 64, 128}};
    lam_status status = LAM_OK;
    lowrank_scene rooms[ROOMS_MOST] = {{.name = NULL}};
    const lowrank_scene *all[ROOMS_MOST];
    size_t n = 0;
    for (; n < ROOMS_MOST && divisions[run->scale][n] > 0; n++) {
        TRY(lowrank_room(run, divisions[run->scale][n], &rooms[n], error));
        all[n] = &rooms[n];
    }
    const lowrank_scene *first = all[0];
    const size_t small = run->scale == BENCH_QUICK ? 1 : 2;
    TRY(lowrank_of_alpha(run, first, error));
    TRY(lowrank_of_compression(run, first, error));
    TRY(lowrank_of_levels(run, all, small, error));
    TRY(lowrank_of_order(run, all, n, error));
    TRY(lowrank_of_factorizers(run, all, n < 3 ? n : 3, error));
    TRY(lowrank_of_rank(run, all, n, error));
    TRY(lowrank_of_streamed(run, error));
    TRY(lowrank_of_radiosity(run, error));
    TRY(lowrank_of_frames(run, error));
    TRY(lowrank_of_methods(run, error));
    TRY(lowrank_of_two_meshes(run, error));
    TRY(lowrank_of_relaxation(run, error));
    TRY(lowrank_of_index_vector(run, error));
done:
    for (size_t k = 0; k < ROOMS_MOST; k++) lowrank_scene_free(&rooms[k]);
    return status;
}
