/* Light inside elements: answers on a mesh against those on one 16 times finer, constant on each element or
 * smooth. */
#include "solver/method/reference.h"
#include "solver/render/shade.h"
#include "tests/bench/suites/hierarchical.h"
#include "tests/bench/suites/scenes.h"

#include <math.h>
#include <stdlib.h>

enum { SIZES = 3, FINER = 16 };
static const double reflectance = .6, tolerance = 1e-8;

static const table_column columns[] = {
    {"elements", "", "n"},
    {"finer", "",
     "elements of the finer mesh, of whose irradiance by the scene's light all errors are shares"},
    {"means", "", "error of the means over elements: what form factors between constants leave"},
    {"constant", "", "error of irradiance that is constant on each element"},
    {"smooth", "", "error of smooth irradiance"},
    {"ratio", "", "constant over smooth"},
};

/* Irradiance [n] of the scene's own light, H = (B - E) / rho. */
static lam_status solve(const bench_run *run, const lowrank_scene *s, float **H, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = s->m.n;
    reference *of = NULL;
    double *E = memory_allocate(n, 2 * sizeof *E, "a reference", error), *B = E == NULL ? NULL : E + n;
    float *made = memory_allocate(n, sizeof *made, "a reference", error);
    if (E == NULL || made == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) E[i] = B[i] = (double)s->m.emission[i];
    TRY(reference_create(&s->f.F, s->m.area, s->m.reflectance, REFERENCE_ITERATED, &of, error));
    TRY(reference_solve(of, 1, E, B, tolerance, run->progress, error));
    for (size_t i = 0; i < n; i++) made[i] = (float)((B[i] - E[i]) / (double)s->m.reflectance[i]);
    *H = made;
    made = NULL;
done:
    reference_destroy(of);
    free(made);
    free(E);
    return status;
}

/* sqrt(sum A (x - H)^2 / sum A H^2) over the finer mesh for x of its elements' parents: their mean, their
 * constant, their smooth light. */
static lam_status compare(const mesh *coarse, const float *H, const mesh *fine, const float *fine_H,
                          double out[3], lam_error *error) {
    lam_status status = LAM_OK;
    shade *smooth = NULL;
    smooth_nodes nodes = {0};
    double off[3] = {0}, all = 0;
    TRY(smooth_nodes_create(coarse, &nodes, error));
    TRY(shade_create(coarse, 1, H, NULL, &nodes, &smooth, error));
    for (uint32_t i = 0; i < coarse->n; i++) {
        double mean = 0, area = 0;
        for (size_t j = FINER * (size_t)i; j < FINER * ((size_t)i + 1); j++) {
            const double truth = (double)fine_H[j], A = fine->area[j];
            double at[3];
            float value;
            mesh_centroid(fine, j, at);
            shade_at(smooth, i, at, &value);
            mean += A * truth;
            area += A;
            all += A * truth * truth;
            off[1] += A * ((double)H[i] - truth) * ((double)H[i] - truth);
            off[2] += A * ((double)value - truth) * ((double)value - truth);
        }
        off[0] += area * (mean / area - (double)H[i]) * (mean / area - (double)H[i]);
    }
    for (int k = 0; k < 3; k++) out[k] = sqrt(off[k] / all);
done:
    shade_destroy(smooth);
    smooth_nodes_free(&nodes);
    return status;
}

static lam_status open_box(const bench_run *run, size_t elements, bool finer, lowrank_scene *out,
                           lam_error *error) {
    lam_status status = LAM_OK;
    const generate_options walls = {
        .kind = "cornell", .closed = true, .elements = elements, .reflectance = reflectance, .seed = 1};
    const mesh_refinement twice = {.subdivide_levels = 2};
    mesh m = {0};
    TRY(scene_generated(&walls, &m, error));
    if (finer) TRY(mesh_refine(&m, &twice, error));
    const recipe how = lowrank_recipe(run, m.n);
    TRY(lowrank_open(run, "closed cornell", &m, &how, out, error));
done:
    mesh_free(&m);
    return status;
}

static lam_status add_size(const bench_run *run, size_t elements, table *out, lam_error *error) {
    lam_status status = LAM_OK;
    lowrank_scene coarse = {.name = NULL}, fine = {.name = NULL};
    float *H = NULL, *fine_H = NULL;
    double off[3];
    TRY(bench_check(run, error));
    TRY(open_box(run, elements, false, &coarse, error));
    TRY(open_box(run, elements, true, &fine, error));
    TRY(solve(run, &coarse, &H, error));
    TRY(solve(run, &fine, &fine_H, error));
    TRY(compare(&coarse.m, H, &fine.m, fine_H, off, error));
    table_number(out, (double)coarse.m.n);
    table_number(out, (double)fine.m.n);
    for (int k = 0; k < 3; k++) table_number(out, off[k]);
    table_number(out, off[1] / off[2]);
done:
    free(H);
    free(fine_H);
    lowrank_scene_free(&coarse);
    lowrank_scene_free(&fine);
    return status;
}

lam_status hierarchical_smooth(const bench_run *run, lam_error *error) {
    /* Up to 24,000 finer elements, whose form factors are found pair by pair. */
    static const size_t sizes[3][SIZES] = {{60, 160}, {160, 640}, {160, 640, 1440}};
    lam_status status = LAM_OK;
    table out = {.name = "smooth",
                 .title = "Light inside elements: closed grey Cornell boxes against a mesh 16 times finer",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    for (size_t k = 0; k < SIZES && sizes[run->scale][k] > 0; k++)
        TRY(add_size(run, sizes[run->scale][k], &out, error));
    TRY(bench_table(run, &out, error));
done:
    table_free(&out);
    return status;
}
