/* Suite formfactors: errors of form factors, their cost, and the throughput of rays. */
#include "tests/bench/suites/formfactors.h"
#include "solver/base/clock.h"
#include "solver/formfactor/rays/rays.h"
#include "solver/formfactor/source.h"
#include "solver/formfactor/visibility/sample.h"
#include "tests/bench/suites/scenes.h"
#include "tests/bench/suites/stats.h"

#include <math.h>
#include <omp.h>
#include <stdlib.h>
#include <string.h>

/* Rays per element by which pairs find out whether a scene is closed; precompute takes as many. */
enum { FEW_RAYS = 256 };

recipe formfactors_rays(size_t rays, uint64_t seed) {
    return (recipe){.source = &source_rays, .rays = rays, .seed = seed};
}

recipe formfactors_hemicube(size_t resolution) {
    return (recipe){.source = &source_hemicube, .resolution = resolution};
}

recipe formfactors_pairs(double accuracy, uint64_t seed) {
    return (recipe){.source = &source_pairs, .rays = FEW_RAYS, .accuracy = accuracy, .seed = seed};
}

lam_status formfactors_make_timed(const bench_run *run, const mesh *m, const uint32_t *order,
                                  const recipe *how, const char *stage, form_factors *out, double *seconds,
                                  lam_error *error) {
    lam_status status = LAM_OK;
    const form_factor_options options = {.recipe = *how, .progress = run->progress, .stage = stage};
    TRY(bench_check(run, error));
    const double started = clock_seconds();
    TRY(form_factors_make(m, order, &options, out, error));
    *seconds = clock_seconds() - started;
done:
    return status;
}

static int compare_indices(const void *a, const void *b) {
    const uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
    return (x > y) - (x < y);
}

double formfactors_entry(const csr *F, size_t i, size_t j) {
    const uint32_t wanted = (uint32_t)j;
    const uint32_t *row = F->indices + F->indptr[i];
    const uint32_t *found =
        bsearch(&wanted, row, F->indptr[i + 1] - F->indptr[i], sizeof *row, compare_indices);
    return found != NULL ? (double)F->data[found - F->indices] : 0;
}

lam_status formfactors_order(const mesh *m, uint32_t **order, lam_error *error) {
    lam_status status = LAM_OK;
    uint32_t *out = memory_allocate(m->n, sizeof *out, "Z-order", error);
    if (out == NULL) TRY(LAM_ERR_MEMORY);
    TRY(mesh_z_order(m, out, error));
    *order = out;
    out = NULL;
done:
    free(out);
    return status;
}

lam_status formfactors_open_scene(const bench_run *run, size_t lots, mesh *out, char name[64],
                                  lam_error *error) {
    if (run->scene == NULL) {
        snprintf(name, 64, "houses %zux%zu", lots, lots);
        return scene_houses(lots, 1, out, error);
    }
    const char *slash = strrchr(run->scene, '/');
    snprintf(name, 64, "%s", slash != NULL ? slash + 1 : run->scene);
    return scene_file(run->scene, out, error);
}

/* The thesis' table 4.6: cities 1 to 3 of 35,588 elements, on its graphics card of 2016. */
enum { ROWS = 5, CITIES = 3 };
static const struct {
    size_t resolution;
    double density[CITIES], speedup[CITIES], error[CITIES];
} thesis[ROWS] = {{512, {.0048, .0060, .0087}, {1, 1, 1}, {0, 0, 0}},
                  {256, {.0034, .0046, .0069}, {1.8, 1.8, 1.8}, {.0072, .0072, .0076}},
                  {128, {.0022, .0032, .0049}, {2.8, 2.8, 2.7}, {.0610, .0125, .0121}},
                  {64, {.0012, .0019, .0030}, {3.1, 3.1, 3.1}, {.0642, .0360, .0346}},
                  {32, {.0006, .0009, .0015}, {3.2, 3.2, 3.2}, {.1444, .1281, .1279}}};

static const table_column resolution_columns[] = {
    {"scene", NULL, "name of the scene"},
    {"elements", "", "n"},
    {"resolution", "", "pixels along the top of a hemicube"},
    {"seconds", "s", "time of the form factors"},
    {"density", "", "share of F that is not 0"},
    {"speedup", "", "speed over that of the finest hemicube"},
    {"error", "", "|F_finest - F| / |F_finest|, Frobenius"},
    {"density_1", "", "thesis, city 1"},
    {"density_2", "", "thesis, city 2"},
    {"density_3", "", "thesis, city 3"},
    {"speedup_1", "", "thesis, city 1"},
    {"error_1", "", "thesis, city 1"},
    {"error_2", "", "thesis, city 2"},
    {"error_3", "", "thesis, city 3"},
};

double formfactors_distance(const csr *A, const csr *B) {
    double difference = 0, norm = 0;
    for (size_t i = 0; i < A->n; i++) {
        uint64_t p = A->indptr[i], q = B->indptr[i];
        while (p < A->indptr[i + 1] || q < B->indptr[i + 1]) {
            const uint32_t a = p < A->indptr[i + 1] ? A->indices[p] : UINT32_MAX;
            const uint32_t b = q < B->indptr[i + 1] ? B->indices[q] : UINT32_MAX;
            const double x = a <= b ? (double)A->data[p++] : 0, y = b <= a ? (double)B->data[q++] : 0;
            difference += (x - y) * (x - y);
            norm += x * x;
        }
    }
    return norm > 0 ? sqrt(difference / norm) : NAN;
}

static void add_resolution(table *out, const char *name, size_t row, const form_factors *f, double seconds,
                           double finest_seconds, double error) {
    const double n = (double)f->F.n;
    table_text(out, name);
    table_number(out, n);
    table_number(out, (double)f->recipe.resolution);
    table_number(out, seconds);
    table_number(out, (double)f->F.indptr[f->F.n] / (n * n));
    table_number(out, finest_seconds / seconds);
    table_number(out, error);
    for (int city = 0; city < CITIES; city++) table_number(out, thesis[row].density[city]);
    table_number(out, thesis[row].speedup[0]);
    for (int city = 0; city < CITIES; city++) table_number(out, thesis[row].error[city]);
}

lam_status formfactors_resolution(const bench_run *run, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t first = run->scale == BENCH_QUICK ? 3 : 0;
    const size_t lots = run->scale == BENCH_QUICK ? 1 : run->scale == BENCH_FULL ? 6 : 2;
    table out = {.name = "resolution",
                 .title = "Resolution of hemicubes (thesis: table 4.6)",
                 .columns = resolution_columns,
                 .n_columns = sizeof resolution_columns / sizeof *resolution_columns,
                 .printed = true};
    mesh m = {0};
    uint32_t *order = NULL;
    form_factors finest = {.row_sums = NULL}, f = {.row_sums = NULL};
    char name[64];
    double finest_seconds = 0, seconds = 0;
    TRY(formfactors_open_scene(run, lots, &m, name, error));
    TRY(formfactors_order(&m, &order, error));
    for (size_t r = first; r < ROWS; r++) {
        const recipe how = formfactors_hemicube(thesis[r].resolution);
        form_factors *made = r == first ? &finest : &f;
        TRY(formfactors_make_timed(run, &m, order, &how, "resolution of hemicubes", made, &seconds, error));
        if (r == first) finest_seconds = seconds;
        add_resolution(&out, name, r, made, seconds, finest_seconds,
                       r == first ? 0 : formfactors_distance(&finest.F, &f.F));
        form_factors_free(&f);
    }
    TRY(bench_table(run, &out, error));
done:
    form_factors_free(&f);
    form_factors_free(&finest);
    free(order);
    mesh_free(&m);
    table_free(&out);
    return status;
}

static const table_column throughput_columns[] = {
    {"scene", NULL, "name of the scene"},
    {"elements", "", "n"},
    {"rays", "", "from every element"},
    {"threads", "", "threads that cast rays"},
    {"bare", "Mray/s", "Embree alone on the elements, rays in memory; median of the passes"},
    {"facets", "Mray/s", "Embree alone on the facets that the elements lie in, likewise"},
    {"counted", "Mray/s", "rays made, cast and counted into rows; median of the passes"},
    {"whole", "Mray/s", "form_factors_make: hierarchy, counting, merging, repair; median of the passes"},
    {"counted_ratio", "", "counted / bare, median over pairs of alternating passes"},
    {"whole_ratio", "", "whole / bare, likewise"},
    {"facets_ratio", "", "counted / facets, likewise"},
    {"bare_speedup", "", "bare, against one thread"},
    {"counted_speedup", "", "counted, against one thread"},
    {"own_share", "", "rays of the bare loop that met the element they leave"},
};

enum { PASSES_MOST = 9 };

typedef struct ray_scene {
    mesh m;
    uint32_t *order;
    visibility *v, *elements; /* as rays are cast, and one element after the other */
    size_t rays, n_packets;
    ray_packet *packets; /* the rays of an element together, elements in Z-order, as they are counted */
    uint32_t *self;
    char name[64];
} ray_scene;

static void ray_scene_free(ray_scene *s) {
    visibility_destroy(s->v);
    visibility_destroy(s->elements);
    mesh_free(&s->m);
    free(s->order);
    free(s->packets);
    free(s->self);
}

/* Keeps every ray that rays_count casts in memory. */
static lam_status prepare_rays(ray_scene *s, uint64_t seed, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t per_element = s->rays / VISIBILITY_PACKET;
    TRY(formfactors_order(&s->m, &s->order, error));
    TRY(visibility_create(&s->m, &s->v, error));
    TRY(visibility_create_of_elements(&s->m, &s->elements, error));
    s->n_packets = s->m.n * per_element;
    s->packets = memory_allocate(s->n_packets, sizeof *s->packets, "rays", error);
    s->self = memory_allocate(s->n_packets, sizeof *s->self, "rays", error);
    if (s->packets == NULL || s->self == NULL) TRY(LAM_ERR_MEMORY);
#pragma omp parallel for schedule(static)
    for (size_t position = 0; position < s->m.n; position++) {
        element_sampler sampler;
        element_sampler_init(&sampler, &s->m, s->v, s->order[position], seed);
        for (size_t k = 0; k < per_element; k++) {
            const size_t p = position * per_element + k;
            s->self[p] = s->order[position];
            element_sampler_packet(&sampler, (uint32_t)(k * VISIBILITY_PACKET), &s->packets[p]);
        }
    }
done:
    return status;
}

typedef struct pass_times {
    double bare[PASSES_MOST], facets[PASSES_MOST], counted[PASSES_MOST], whole[PASSES_MOST];
} pass_times;

static lam_status one_pass(const bench_run *run, const ray_scene *s, size_t pass, pass_times *times,
                           size_t *own, lam_error *error) {
    lam_status status = LAM_OK;
    const form_factor_options how = {.recipe = formfactors_rays(s->rays, run->seed)};
    packed_rows counts = {0};
    form_factors f = {.row_sums = NULL};
    double *leaving = memory_allocate(s->m.n, sizeof *leaving, "form factors", error);
    double *absorbed = memory_allocate(s->m.n, sizeof *absorbed, "form factors", error);
    if (leaving == NULL || absorbed == NULL) TRY(LAM_ERR_MEMORY);
    TRY(visibility_bare_seconds(s->elements, s->packets, s->self, s->n_packets, &times->bare[pass], own,
                                error));
    TRY(visibility_bare_seconds(s->v, s->packets, s->self, s->n_packets, &times->facets[pass], NULL, error));
    double started = clock_seconds();
    TRY(rays_count(&s->m, s->v, s->order, &how, &counts, leaving, absorbed, error));
    times->counted[pass] = clock_seconds() - started;
    started = clock_seconds();
    TRY(form_factors_make(&s->m, s->order, &how, &f, error));
    times->whole[pass] = clock_seconds() - started;
done:
    packed_rows_free(&counts);
    form_factors_free(&f);
    free(leaving);
    free(absorbed);
    return status;
}

/* Adds one row: medians of the passes for one number of threads. */
static lam_status measure(const bench_run *run, const ray_scene *s, int threads, size_t passes,
                          double alone[2], table *out, lam_error *error) {
    lam_status status = LAM_OK;
    pass_times times;
    double ratio[PASSES_MOST], whole_ratio[PASSES_MOST], facets_ratio[PASSES_MOST];
    size_t own = 0;
    omp_set_num_threads(threads);
    for (size_t pass = 0; pass < passes; pass++) {
        TRY(bench_check(run, error));
        TRY(one_pass(run, s, pass, &times, pass == 0 ? &own : NULL, error));
        ratio[pass] = times.bare[pass] / times.counted[pass];
        whole_ratio[pass] = times.bare[pass] / times.whole[pass];
        facets_ratio[pass] = times.facets[pass] / times.counted[pass];
    }
    const double bare = stats_median(times.bare, passes), counted = stats_median(times.counted, passes);
    const double rays = (double)(s->n_packets * VISIBILITY_PACKET);
    if (threads == 1) alone[0] = bare, alone[1] = counted;
    table_text(out, s->name);
    table_number(out, (double)s->m.n);
    table_number(out, (double)s->rays);
    table_number(out, threads);
    table_number(out, 1e-6 * rays / bare);
    table_number(out, 1e-6 * rays / stats_median(times.facets, passes));
    table_number(out, 1e-6 * rays / counted);
    table_number(out, 1e-6 * rays / stats_median(times.whole, passes));
    table_number(out, stats_median(ratio, passes));
    table_number(out, stats_median(whole_ratio, passes));
    table_number(out, stats_median(facets_ratio, passes));
    table_number(out, alone[0] / bare);
    table_number(out, alone[1] / counted);
    table_number(out, (double)own / rays);
done:
    return status;
}

/* Measures one scene, which it frees, with one thread and with all. */
static lam_status measure_scene(const bench_run *run, ray_scene *s, size_t passes, table *out,
                                lam_error *error) {
    lam_status status = LAM_OK;
    const int threads = omp_get_max_threads();
    double alone[2] = {0};
    TRY(prepare_rays(s, run->seed, error));
    TRY(measure(run, s, 1, passes, alone, out, error));
    if (threads > 1) TRY(measure(run, s, threads, passes, alone, out, error));
done:
    omp_set_num_threads(threads);
    ray_scene_free(s);
    return status;
}

lam_status formfactors_throughput(const bench_run *run, lam_error *error) {
    lam_status status = LAM_OK;
    const bool quick = run->scale == BENCH_QUICK, full = run->scale == BENCH_FULL;
    const size_t passes = quick ? 2 : full ? PASSES_MOST : 5;
    table out = {.name = "throughput",
                 .title = "Throughput: rays per second beside a bare loop over the same rays",
                 .columns = throughput_columns,
                 .n_columns = sizeof throughput_columns / sizeof *throughput_columns,
                 .printed = true};
    ray_scene small = {.rays = quick ? 64 : full ? 4096 : 1024, .name = "cornell"};
    TRY(scene_cornell(quick ? 160 : 2560, &small.m, error));
    TRY(measure_scene(run, &small, passes, &out, error));
    if (!quick) {
        ray_scene large = {.rays = full ? 1024 : 256, .name = "cornell"};
        TRY(scene_cornell(10240, &large.m, error));
        TRY(measure_scene(run, &large, passes, &out, error));
    }
    ray_scene open = {.rays = quick ? 64 : full ? 4096 : 1024};
    TRY(formfactors_open_scene(run, quick ? 2 : 8, &open.m, open.name, error));
    TRY(measure_scene(run, &open, passes, &out, error));
    TRY(bench_table(run, &out, error));
done:
    table_free(&out);
    return status;
}

lam_status bench_formfactors(const bench_run *run, lam_error *error) {
    lam_status status = LAM_OK;
    mesh given = {0};
    /* A scene that cannot be read fails before the first measurement. */
    if (run->scene != NULL) TRY(scene_file(run->scene, &given, error));
    mesh_free(&given);
    TRY(formfactors_closed_forms(run, error));
    TRY(formfactors_of_enclosures(run, error));
    TRY(formfactors_throughput(run, error));
    TRY(formfactors_resolution(run, error));
    TRY(formfactors_error(run, error));
done:
    return status;
}
