#include "solver/base/clock.h"
#include "solver/bench/formfactors.h"
#include "solver/bench/scenes.h"
#include "solver/bench/stats.h"
#include "solver/formfactor/rays/rays.h"
#include "solver/formfactor/visibility/sample.h"

#include <omp.h>
#include <stdlib.h>

static const table_column columns[] = {
    {"scene", NULL, "which"},
    {"elements", "", "n"},
    {"rays", "", "from every element"},
    {"threads", "", "that cast"},
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

typedef struct prepared {
    mesh m;
    uint32_t *order;
    visibility *v, *elements; /* as rays are cast, and one element after the other */
    size_t rays, n_packets;
    ray_packet *packets; /* the rays of an element together, elements in Z-order, as they are counted */
    uint32_t *self;
    char name[64];
} prepared;

static void prepared_free(prepared *s) {
    visibility_destroy(s->v);
    visibility_destroy(s->elements);
    mesh_free(&s->m);
    free(s->order);
    free(s->packets);
    free(s->self);
}

/* Every ray that rays_count casts, in memory. */
static lam_status prepare_rays(prepared *s, uint64_t seed, lam_error *error) {
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

static lam_status one_pass(const bench_run *run, const prepared *s, size_t pass, pass_times *times,
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

/* Medians of the passes for one number of threads, one row of the table. */
static lam_status measure(const bench_run *run, const prepared *s, int threads, size_t passes,
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

/* Measures one scene, which it takes, with one thread and with all. */
static lam_status measure_scene(const bench_run *run, prepared *s, size_t passes, table *out,
                                lam_error *error) {
    lam_status status = LAM_OK;
    const int threads = omp_get_max_threads();
    double alone[2] = {0};
    TRY(prepare_rays(s, run->seed, error));
    TRY(measure(run, s, 1, passes, alone, out, error));
    if (threads > 1) TRY(measure(run, s, threads, passes, alone, out, error));
done:
    omp_set_num_threads(threads);
    prepared_free(s);
    return status;
}

lam_status formfactors_throughput(const bench_run *run, lam_error *error) {
    lam_status status = LAM_OK;
    const bool quick = run->scale == BENCH_QUICK, full = run->scale == BENCH_FULL;
    const size_t passes = quick ? 2 : full ? PASSES_MOST : 5;
    table out = {.name = "throughput",
                 .title = "Throughput: rays a second beside a bare loop over the same rays",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    prepared small = {.rays = quick ? 64 : full ? 4096 : 1024, .name = "cornell"};
    TRY(scene_cornell(quick ? 160 : 2560, &small.m, error));
    TRY(measure_scene(run, &small, passes, &out, error));
    if (!quick) {
        prepared large = {.rays = full ? 1024 : 256, .name = "cornell"};
        TRY(scene_cornell(10240, &large.m, error));
        TRY(measure_scene(run, &large, passes, &out, error));
    }
    prepared open = {.rays = quick ? 64 : full ? 4096 : 1024};
    TRY(formfactors_open_scene(run, quick ? 2 : 8, &open.m, open.name, error));
    TRY(measure_scene(run, &open, passes, &out, error));
    TRY(bench_table(run, &out, error));
done:
    table_free(&out);
    return status;
}
