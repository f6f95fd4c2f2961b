/* Suite mesh: the error of answers that are constant on elements, by elements, method and time. */
#include "solver/adapt/adaptive.h"
#include "solver/adapt/mesh_error.h"
#include "solver/base/clock.h"
#include "solver/scene/facet/face_join.h"
#include "tests/bench/suites/mesh_skies.h"
#include "tests/bench/suites/mesh_truths.h"
#include "tests/bench/suites/scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { SIZES = 3, METHODS = 3, FINER_MOST = 7000 };

static const table_column columns[] = {
    {"scene", NULL, "scene"},
    {"light", NULL, "lamps: those of the scene; even: 1 from every element"},
    {"mesh", NULL, "uniform: elements of nearly equal areas; adaptive: of --mesh-error"},
    {"elements", "", "n"},
    {"method", NULL, "converged: the solution of the system itself, in double; else the kind of operator"},
    {"seconds", "s", "processor time of form factors, operator and answer"},
    {"means", "", "error of the means over elements, against a mesh 16 times finer"},
    {"constant", "", "error of B - E as a constant on each element, against the same"},
    {"points", "", "the same against unbiased walks from points"},
    {"bar", "", "standard error of that"},
    {"stated", "", "the error as a store states it, from the answer alone"},
};

/* A scene of the suite, its faces as large as can be; sizes are numbers of elements. */
typedef struct mesh_scene {
    const char *name, *kind; /* kind: of a generated one; NULL: furnished, or a file */
    const char *file;
    size_t sizes[SIZES];
} mesh_scene;

static lam_status open_mesh(const mesh_scene *s, size_t elements, mesh *out, lam_error *error) {
    lam_status status = LAM_OK;
    const generate_options how = {.kind = s->kind, .elements = 1, .reflectance = -1, .seed = 1};
    const mesh_refinement even = {.elements = elements};
    mesh m = {0};
    if (s->file != NULL)
        TRY(scene_file(s->file, &m, error));
    else if (s->kind != NULL)
        TRY(scene_generated(&how, &m, error));
    else
        TRY(scene_furnished(&m, error));
    if (elements > 0) TRY(mesh_refine(&m, &even, error));
    *out = m;
    m = (mesh){0};
done:
    mesh_free(&m);
    return status;
}

/* A mesh with its truths. */
typedef struct measured_mesh {
    const mesh_scene *scene;
    const char *name;
    lowrank_scene s;
    const mesh *finer;  /* 16 times as many elements; NULL: none */
    const double *fine; /* B - E of it; NULL: none */
    const mesh_points *points;
    uint32_t *element; /* at each point */
    float *E;
    size_t first_light;
    double seconds; /* of the form factors, processor time */
} measured_mesh;

/* The errors that a store would state of x = B - E. */
static lam_status state_errors(const bench_run *run, const measured_mesh *m, const double *x,
                               double stated[MESH_LIGHTS], lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *of = &m->s.m;
    const size_t vector = of->n_channels * of->n, first = m->first_light;
    float *B = memory_allocate(MESH_LIGHTS * vector, sizeof *B, "answers", error);
    if (B == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < MESH_LIGHTS * vector; i++) B[i] = m->E[i] + (float)x[i];
    TRY(mesh_error(of, MESH_LIGHTS - first, m->E + first * vector, B + first * vector, first == 0, NULL, NULL,
                   run->seed, run->progress, stated + first, NULL, error));
done:
    free(B);
    return status;
}

static lam_status add_rows(const bench_run *run, const measured_mesh *m, const char *method, double seconds,
                           const double *x, table *out, lam_error *error) {
    static const char *const lights[MESH_LIGHTS] = {"lamps", "even"};
    lam_status status = LAM_OK;
    const mesh *of = &m->s.m;
    const size_t vector = of->n_channels * of->n;
    double stated[MESH_LIGHTS];
    TRY(state_errors(run, m, x, stated, error));
    for (size_t l = m->first_light; l < MESH_LIGHTS; l++) {
        const double *fine = m->fine != NULL ? m->fine + l * MESH_FINER * vector : NULL;
        const mesh_errors e = mesh_compare(of, x + l * vector, m->finer, fine, m->points, m->element, l);
        table_text(out, m->scene->name);
        table_text(out, lights[l]);
        table_text(out, m->name);
        table_number(out, (double)of->n);
        table_text(out, method);
        table_number(out, seconds);
        table_number(out, e.means);
        table_number(out, e.constant);
        table_number(out, e.points);
        table_number(out, e.bar);
        table_number(out, stated[l]);
    }
done:
    return status;
}

/* B - E of the operator that a method builds at its defaults. */
static lam_status answer(const bench_run *run, const measured_mesh *m, const char *method, double *x,
                         lam_error *error) {
    lam_status status = LAM_OK;
    const build_problem problem = lowrank_problem(&m->s);
    build_options how = build_presets(method);
    build_report built;
    lam_operator *op = NULL;
    void *work = NULL;
    const size_t all = MESH_LIGHTS * m->s.m.n_channels * m->s.m.n;
    float *B = memory_allocate(all, sizeof *B, "answers", error);
    if (B == NULL) TRY(LAM_ERR_MEMORY);
    how.seed = run->seed;
    how.progress = run->progress;
    TRY(build_operator(&problem, &how, &op, &built, error));
    const size_t bytes = lam_operator_work_bytes(op, MESH_LIGHTS);
    work = memory_allocate(bytes, 1, "answers", error);
    if (work == NULL) TRY(LAM_ERR_MEMORY);
    TRY(lam_operator_apply(op, MESH_LIGHTS, LAM_INDIRECT, m->E, B, work, bytes, error));
    for (size_t i = 0; i < all; i++) x[i] = (double)B[i];
done:
    free(work);
    free(B);
    lam_operator_close(op);
    return status;
}

static lam_status add_methods(const bench_run *run, const measured_mesh *m, table *out, lam_error *error) {
    static const char *const methods[METHODS] = {"hierarchical", "low-rank", "sparse"};
    lam_status status = LAM_OK;
    double *x = NULL;
    double used = clock_processor_seconds();
    TRY(mesh_converged(run, &m->s, m->E, &x, error));
    TRY(add_rows(run, m, "converged", m->seconds + clock_processor_seconds() - used, x, out, error));
    for (size_t k = 0; k < (run->scale == BENCH_QUICK ? 1 : METHODS); k++) {
        TRY(bench_check(run, error));
        used = clock_processor_seconds();
        TRY(answer(run, m, methods[k], x, error));
        TRY(add_rows(run, m, methods[k], m->seconds + clock_processor_seconds() - used, x, out, error));
    }
done:
    free(x);
    return status;
}

/* B - E of a mesh whose elements are those of another one, each divided into 16. */
static lam_status solve_finer(const bench_run *run, mesh *finer, lowrank_scene *s, double **x,
                              lam_error *error) {
    lam_status status = LAM_OK;
    const recipe how = lowrank_recipe(run, finer->n);
    float *E = NULL;
    size_t first;
    TRY(lowrank_open(run, "the finer mesh", finer, &how, s, error));
    TRY(mesh_lights(&s->m, &E, &first, error));
    TRY(mesh_converged(run, s, E, x, error));
done:
    free(E);
    return status;
}

/* The mesh of a scene, uniform or, with as many elements, adaptive. */
static lam_status make_mesh(const bench_run *run, const mesh_scene *scene, size_t elements, bool adaptive,
                            mesh *out, lam_error *error) {
    /* An error that no mesh of so few elements has. */
    const adaptive_options how = {
        .error = 1e-6, .elements = elements, .seed = run->seed, .progress = run->progress};
    lam_status status = LAM_OK;
    adaptive_report report;
    TRY(open_mesh(scene, adaptive ? 0 : elements, out, error));
    if (adaptive) TRY(faces_join(out, NULL, error));
    if (adaptive) TRY(adaptive_refine(out, &how, &report, error));
done:
    return status;
}

/* Measures a mesh, which it takes over. */
static lam_status add_mesh(const bench_run *run, const mesh_scene *scene, const char *name, mesh *of,
                           const mesh_points *points, table *out, lam_error *error) {
    lam_status status = LAM_OK;
    measured_mesh m = {.scene = scene, .name = name, .points = points};
    lowrank_scene finer = {.name = NULL};
    mesh divided = {0};
    double *fine = NULL;
    TRY(bench_check(run, error));
    if (MESH_FINER * of->n <= FINER_MOST) {
        TRY(mesh_divide(of, &divided, error));
        TRY(solve_finer(run, &divided, &finer, &fine, error));
        m.finer = &finer.m;
        m.fine = fine;
    }
    const recipe how = lowrank_recipe(run, of->n);
    const double used = clock_processor_seconds();
    TRY(lowrank_open(run, scene->name, of, &how, &m.s, error));
    m.seconds = clock_processor_seconds() - used;
    m.element = memory_allocate(points->n, sizeof *m.element, "points", error);
    if (m.element == NULL) TRY(LAM_ERR_MEMORY);
    TRY(mesh_points_locate(points, &m.s.m, m.element, error));
    TRY(mesh_lights(&m.s.m, &m.E, &m.first_light, error));
    TRY(add_methods(run, &m, out, error));
done:
    free(m.E);
    free(m.element);
    free(fine);
    lowrank_scene_free(&m.s);
    lowrank_scene_free(&finer);
    mesh_free(&divided);
    return status;
}

static lam_status add_size(const bench_run *run, const mesh_scene *scene, size_t elements,
                           const mesh_points *points, table *out, lam_error *error) {
    lam_status status = LAM_OK;
    mesh uniform = {0}, adaptive = {0};
    TRY(make_mesh(run, scene, elements, false, &uniform, error));
    const size_t n = uniform.n;
    TRY(add_mesh(run, scene, "uniform", &uniform, points, out, error));
    TRY(make_mesh(run, scene, n, true, &adaptive, error));
    TRY(add_mesh(run, scene, "adaptive", &adaptive, points, out, error));
done:
    mesh_free(&uniform);
    mesh_free(&adaptive);
    return status;
}

static lam_status add_scene(const bench_run *run, const mesh_scene *scene, table *out, lam_error *error) {
    static const size_t n_points[3] = {100, 4000, 16000}, walks[3] = {1024, 16384, 8192};
    lam_status status = LAM_OK;
    mesh_points points = {.n = 0};
    mesh pieces = {0};
    TRY(open_mesh(scene, 0, &pieces, error));
    TRY(mesh_points_walk(run, &pieces, n_points[run->scale], walks[run->scale], &points, error));
    const size_t sizes = run->scale == BENCH_QUICK ? 1 : run->scale == BENCH_DEFAULT ? 2 : SIZES;
    for (size_t k = 0; k < sizes; k++) TRY(add_size(run, scene, scene->sizes[k], &points, out, error));
done:
    mesh_points_free(&points);
    mesh_free(&pieces);
    return status;
}

lam_status bench_mesh(const bench_run *run, lam_error *error) {
    const mesh_scene scenes[] = {
        {.name = "cornell", .kind = "cornell", .sizes = {200, 1600, 4000}},
        {.name = "rooms", .kind = "rooms", .sizes = {400, 1400, 4000}},
        {.name = "furnished", .sizes = {400, 1600, 4000}},
        {.name = "patio", .kind = "patio", .sizes = {1400, 2500, 5600}},
        {.name = "file", .file = run->scene, .sizes = {700, 1400, 4000}},
    };
    lam_status status = LAM_OK;
    table out = {.name = "mesh",
                 .title = "Light that a mesh leaves out: B - E, constant on elements",
                 .columns = columns,
                 .n_columns = sizeof columns / sizeof *columns,
                 .printed = true};
    for (size_t k = 0; k < sizeof scenes / sizeof *scenes; k++) {
        if (run->scale == BENCH_QUICK && k > 0) break;
        if (k + 1 == sizeof scenes / sizeof *scenes && run->scene == NULL) break;
        TRY(add_scene(run, &scenes[k], &out, error));
    }
    TRY(bench_table(run, &out, error));
    TRY(mesh_skies(run, error));
done:
    table_free(&out);
    return status;
}
