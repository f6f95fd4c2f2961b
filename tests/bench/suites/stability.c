/* Suite stability: transport problems that are numerically hard, and the errors of operators on them. */
#include "tests/bench/suites/stability.h"
#include "solver/formfactor/formfactor.h"
#include "solver/formfactor/source.h"
#include "solver/method/reference.h"
#include "solver/scene/surfaces.h"
#include "tests/bench/suites/bench.h"
#include "tests/bench/suites/scenes.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { DIVISIONS = 5, FLAT = 64, SPHERE = 60, PROBES = 4 };

void stability_free(stability_problem *p) {
    free(p->area);
    free(p->reflectance);
    free(p->order);
    free(p->centre);
    free(p->normal);
    free(p->surface);
    csr_free(&p->F);
    *p = (stability_problem){0};
}

static lam_status allocate(stability_problem *p, size_t n, size_t entries, lam_error *error) {
    p->n = n;
    p->area = memory_allocate(n, sizeof *p->area, "problem", error);
    p->reflectance = memory_allocate(n, sizeof *p->reflectance, "problem", error);
    p->order = memory_allocate(n, sizeof *p->order, "problem", error);
    p->F.n = n;
    p->F.indptr = memory_allocate(n + 1, sizeof *p->F.indptr, "problem", error);
    p->F.indices = memory_allocate(entries, sizeof *p->F.indices, "problem", error);
    p->F.data = memory_allocate(entries, sizeof *p->F.data, "problem", error);
    if (p->area == NULL || p->reflectance == NULL || p->order == NULL || p->F.indptr == NULL ||
        p->F.indices == NULL || p->F.data == NULL)
        return LAM_ERR_MEMORY;
    for (size_t i = 0; i < n; i++) p->order[i] = (uint32_t)i;
    return LAM_OK;
}

/* A cube seen from inside, each face of DIVISIONS x DIVISIONS elements. */
static lam_status cube_mesh(mesh *m, lam_error *error) {
    static const double faces[6][3][3] = {
        {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}},
        {{0, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{1, 0, 0}, {0, 0, 1}, {0, 1, 0}},
        {{0, 0, 0}, {0, 0, 1}, {1, 0, 0}}, {{0, 1, 0}, {1, 0, 0}, {0, 0, 1}}};
    scene_piece pieces[6 * DIVISIONS * DIVISIONS];
    size_t n = 0;
    for (int f = 0; f < 6; f++)
        for (int i = 0; i < DIVISIONS; i++)
            for (int k = 0; k < DIVISIONS; k++, n++)
                for (int d = 0; d < 3; d++) {
                    pieces[n].triangle = false;
                    pieces[n].along[d] = faces[f][1][d] / DIVISIONS;
                    pieces[n].across[d] = faces[f][2][d] / DIVISIONS;
                    pieces[n].corner[d] = faces[f][0][d] + i * pieces[n].along[d] + k * pieces[n].across[d];
                }
    return scene_of_pieces(pieces, n, m, error);
}

/* The geometry of copies of a mesh: element i is element i modulo m->n of it. */
static lam_status take_geometry(const mesh *m, stability_problem *p, lam_error *error) {
    lam_status status = LAM_OK;
    size_t n_surfaces = 0;
    p->centre = memory_allocate(p->n, sizeof *p->centre, "problem", error);
    p->normal = memory_allocate(p->n, sizeof *p->normal, "problem", error);
    p->surface = memory_allocate(p->n, sizeof *p->surface, "problem", error);
    if (p->centre == NULL || p->normal == NULL || p->surface == NULL) TRY(LAM_ERR_MEMORY);
    TRY(mesh_surfaces(m, p->surface, &n_surfaces, error));
    for (size_t i = 0; i < p->n; i++) {
        mesh_centroid(m, i, p->centre[i]);
        memcpy(p->normal[i], m->normal[i], sizeof p->normal[i]);
    }
done:
    return status;
}

static lam_status make_room(double rho, stability_problem *p, lam_error *error) {
    lam_status status = LAM_OK;
    mesh m = {0};
    form_factors f = {.row_sums = NULL};
    uint32_t *order = NULL;
    TRY(cube_mesh(&m, error));
    order = memory_allocate(m.n, sizeof *order, "problem", error);
    if (order == NULL) TRY(LAM_ERR_MEMORY);
    TRY(mesh_z_order(&m, order, error));
    const form_factor_options how = {
        .recipe = {.source = &source_pairs, .rays = 256, .accuracy = 7e-5, .seed = 1},
        .stage = "form factors"};
    TRY(form_factors_make(&m, order, &how, &f, error));
    TRY(allocate(p, m.n, 1, error));
    memcpy(p->area, m.area, m.n * sizeof *p->area);
    memcpy(p->order, order, m.n * sizeof *order);
    for (size_t i = 0; i < m.n; i++) p->reflectance[i] = (float)rho;
    csr_free(&p->F);
    p->F = f.F;
    f.F = (csr){0};
    p->closed = true;
    TRY(take_geometry(&m, p, error));
done:
    form_factors_free(&f);
    free(order);
    mesh_free(&m);
    return status;
}

/* Every element twice, each half of the other's area. */
static lam_status make_twins(double rho, stability_problem *p, lam_error *error) {
    lam_status status = LAM_OK;
    stability_problem one = {0};
    TRY(make_room(rho, &one, error));
    const size_t n = one.n;
    TRY(allocate(p, 2 * n, 4 * one.F.indptr[n], error));
    uint64_t at = 0;
    for (size_t i = 0; i < 2 * n; i++) {
        p->area[i] = one.area[i % n] / 2;
        p->reflectance[i] = (float)rho;
        for (int half = 0; half < 2; half++)
            for (uint64_t e = one.F.indptr[i % n]; e < one.F.indptr[i % n + 1]; e++, at++) {
                p->F.indices[at] = one.F.indices[e] + (half ? (uint32_t)n : 0);
                p->F.data[at] = one.F.data[e] / 2;
            }
        p->F.indptr[i + 1] = at;
    }
    p->closed = true;
done:
    stability_free(&one);
    return status;
}

/* The inside of a sphere, F_ij = A_j / A, with areas over eight decades. */
static lam_status make_areas(double rho, stability_problem *p, lam_error *error) {
    double all = 0;
    const lam_status status = allocate(p, SPHERE, SPHERE * SPHERE, error);
    if (status != LAM_OK) return status;
    for (size_t i = 0; i < SPHERE; i++)
        all += p->area[i] = pow(10, 8. * (double)((i * 37) % SPHERE) / SPHERE - 4);
    for (size_t i = 0; i < SPHERE; i++) {
        p->reflectance[i] = (float)rho;
        p->F.indptr[i + 1] = (i + 1) * SPHERE;
        for (size_t j = 0; j < SPHERE; j++) {
            p->F.indices[i * SPHERE + j] = (uint32_t)j;
            p->F.data[i * SPHERE + j] = (float)(p->area[j] / all);
        }
    }
    p->closed = true;
    return LAM_OK;
}

/* A scene in which no element sees another. */
static lam_status make_blind(size_t n, double rho, stability_problem *p, lam_error *error) {
    const lam_status status = allocate(p, n, 1, error);
    for (size_t i = 0; status == LAM_OK && i < n; i++) {
        p->area[i] = 1;
        p->reflectance[i] = (float)rho;
    }
    return status;
}

lam_status stability_make(int which, double rho, stability_problem *out, lam_error *error) {
    static const char *const names[STABILITY_PROBLEMS] = {
        "closed room", "black room",          "half black room",         "one element",
        "flat",        "every element twice", "areas over eight decades"};
    lam_status status = LAM_OK;
    stability_problem p = {0};
    switch (which) {
    case STABILITY_ONE:
        TRY(make_blind(1, rho, &p, error));
        break;
    case STABILITY_FLAT:
        TRY(make_blind(FLAT, rho, &p, error));
        break;
    case STABILITY_TWINS:
        TRY(make_twins(rho, &p, error));
        break;
    case STABILITY_AREAS:
        TRY(make_areas(rho, &p, error));
        break;
    case STABILITY_BLACK:
        TRY(make_room(0, &p, error));
        break;
    default:
        TRY(make_room(rho, &p, error));
        break;
    }
    for (size_t i = 0; which == STABILITY_HALF_BLACK && i < p.n; i += 2) p.reflectance[i] = 0;
    p.name = names[which];
    *out = p;
    p = (stability_problem){0};
done:
    stability_free(&p);
    return status;
}

/* Emissions and answers, [PROBES][n]: one bright element, every third element, all elements, and twice the
 * first plus the second. */
typedef struct probation {
    const stability_problem *p;
    lam_operator *op;
    float *E, *B, *H;
    double *exact;
} probation;

static void set_probes(const stability_problem *p, float *E) {
    for (size_t i = 0; i < p->n; i++) {
        E[i] = i == p->n / 2 ? 1 : 0;
        E[p->n + i] = i % 3 == 0 ? 1 : 0;
        E[2 * p->n + i] = 1;
        E[3 * p->n + i] = 2 * E[i] + E[p->n + i];
    }
}

static bool is_emitters(const stability_way *way) {
    return strcmp(way->method, "emitters") == 0;
}

bool stability_can(const stability_problem *p, const stability_way *way) {
    static const char *const of_meshes[] = {"2msc", "hierarchical"};
    for (size_t k = 0; k < sizeof of_meshes / sizeof *of_meshes; k++)
        if (strcmp(way->method, of_meshes[k]) == 0) return p->centre != NULL;
    return true;
}

/* The first three probes are the emitters of an operator of few, and the fourth is 2, 1 and 0 of them. */
static const char *const emitter_names[PROBES - 1] = {"one", "third", "all"};
static const float emitter_weights[PROBES][PROBES - 1] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {2, 1, 0}};

static lam_status answer(probation *q, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t bytes = lam_operator_work_bytes(q->op, PROBES);
    const bool few = lam_operator_emitters(q->op) > 0;
    void *work = memory_allocate(bytes, 1, "probation", error);
    if (work == NULL) return LAM_ERR_MEMORY;
    for (int k = 0; k < 2; k++) {
        const lam_quantity quantity = k == 0 ? LAM_RADIOSITY : LAM_IRRADIANCE;
        float *out = k == 0 ? q->B : q->H;
        if (few)
            TRY(lam_operator_apply_emitters(q->op, PROBES, quantity, emitter_weights[0], 0, NULL, out, work,
                                            bytes, error));
        else
            TRY(lam_operator_apply(q->op, PROBES, quantity, q->E, out, work, bytes, error));
    }
done:
    free(work);
    return status;
}

static lam_status solve_exactly(probation *q, lam_error *error) {
    lam_status status = LAM_OK;
    const stability_problem *p = q->p;
    reference *r = NULL;
    double *E = memory_allocate(PROBES * p->n, sizeof *E, "probation", error);
    if (E == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < PROBES * p->n; k++) E[k] = q->exact[k] = (double)q->E[k];
    TRY(reference_create(&p->F, p->area, p->reflectance, REFERENCE_DENSE, &r, error));
    TRY(reference_solve(r, PROBES, E, q->exact, 1e-12, NULL, error));
done:
    reference_destroy(r);
    free(E);
    return status;
}

static void judge_probe(const probation *q, size_t k, stability_result *out) {
    const stability_problem *p = q->p;
    const float *E = q->E + k * p->n, *B = q->B + k * p->n, *H = q->H + k * p->n;
    double wrong = 0, all = 0, bounced = 0, least = 0, most = 0, emitted = 0, kept = 0;
    for (size_t i = 0; i < p->n; i++) {
        const double b = (double)B[i], e = (double)E[i], x = q->exact[k * p->n + i], a = p->area[i];
        out->finite = out->finite && isfinite(b) && isfinite(H[i]);
        wrong += a * (b - x) * (b - x);
        all += a * x * x;
        bounced += a * (x - e) * (x - e);
        least = fmin(least, b);
        most = fmax(most, b);
        emitted += a * e;
        kept += a * (1 - (double)p->reflectance[i]) * (double)H[i];
    }
    out->relative = fmax(out->relative, sqrt(wrong / all));
    if (bounced > 0) out->indirect = fmax(out->indirect, sqrt(wrong / bounced));
    if (most > 0) out->negative = fmax(out->negative, -least / most);
    if (p->closed) out->energy = fmax(out->energy, fabs(emitted - kept) / emitted);
}

static void judge_linearity(const probation *q, stability_result *out) {
    const size_t n = q->p->n;
    double off = 0, all = 0;
    for (size_t i = 0; i < n; i++) {
        const double sum = (double)q->B[3 * n + i], parts = 2 * (double)q->B[i] + (double)q->B[n + i];
        off += (sum - parts) * (sum - parts);
        all += sum * sum;
    }
    out->linearity = all > 0 ? sqrt(off / all) : 0;
}

/* diag(A / rho) M is symmetric, or diag(A) (M - I) / rho, which black elements have too: <g, A H_e> = <e, A
 * H_g> of the first two probes. */
static void judge_reciprocity(const probation *q, stability_result *out) {
    const size_t n = q->p->n;
    double one = 0, two = 0;
    for (size_t i = 0; i < n; i++) {
        one += (double)q->E[n + i] * q->p->area[i] * (double)q->H[i];
        two += (double)q->E[i] * q->p->area[i] * (double)q->H[n + i];
    }
    const double larger = fmax(fabs(one), fabs(two));
    out->reciprocity = larger > 0 ? fabs(one - two) / larger : 0;
}

lam_status stability_try(const stability_problem *p, const stability_way *way, stability_result *out,
                         lam_error *error) {
    lam_status status = LAM_OK;
    lam_error why = {0};
    build_report built;
    build_options how = build_presets(way->method);
    probation q = {.p = p};
    *out = (stability_result){.finite = true};
    q.E = memory_allocate(PROBES * p->n, sizeof *q.E, "probation", error);
    if (q.E == NULL) TRY(LAM_ERR_MEMORY);
    set_probes(p, q.E);
    const emitter_source emitters = {.s = PROBES - 1, .names = emitter_names, .E = q.E};
    const build_problem problem = {.n = p->n,
                                   .n_channels = 1,
                                   .area = p->area,
                                   .reflectance = p->reflectance,
                                   .F = &p->F,
                                   .order = p->order,
                                   .centre = (const double(*)[3])p->centre,
                                   .normal = (const float(*)[3])p->normal,
                                   .surface = p->surface,
                                   .emitters = is_emitters(way) ? &emitters : NULL};
    if (way->factorizer != NULL) TRY(build_set(&how, "factorizer", way->factorizer, error));
    if (way->epsilon > 0) TRY(build_set_number(&how, "epsilon", way->epsilon, error));
    if (way->rank > 0) TRY(build_set_number(&how, "rank", (double)way->rank, error));
    out->status = build_operator(&problem, &how, &q.op, &built, &why);
    if (out->status == LAM_ERR_MEMORY) FAIL(error, LAM_ERR_MEMORY, "%s", why.message);
    snprintf(out->message, sizeof out->message, "%s", why.message);
    if (out->status != LAM_OK) goto done;
    q.B = memory_allocate(PROBES * p->n, sizeof *q.B, "probation", error);
    q.H = memory_allocate(PROBES * p->n, sizeof *q.H, "probation", error);
    q.exact = memory_allocate(PROBES * p->n, sizeof *q.exact, "probation", error);
    if (q.B == NULL || q.H == NULL || q.exact == NULL) TRY(LAM_ERR_MEMORY);
    TRY(answer(&q, error));
    TRY(solve_exactly(&q, error));
    for (size_t k = 0; k < 3; k++) judge_probe(&q, k, out);
    judge_linearity(&q, out);
    judge_reciprocity(&q, out);
    out->rank = (size_t)report_get(&built, "rank", 0);
    out->rcond = report_get(&built, "rcond", 1);
    out->norm = report_get(&built, "measured_norm_error", 0);
    out->bound = report_get(&built, "relative_bound", 0);
done:
    lam_operator_close(q.op);
    free(q.E);
    free(q.B);
    free(q.H);
    free(q.exact);
    return status;
}

static const table_column stability_columns[] = {
    {"problem", NULL, "name of the problem"},
    {"rho", "", "largest reflectance"},
    {"method", NULL, "method and factorizer"},
    {"epsilon", "", "epsilon asked for"},
    {"rank_asked", "", "0: by epsilon"},
    {"rank", "", "k"},
    {"norm", "", "|S - Q V^T|_2"},
    {"rcond", "", "reciprocal condition number of the matrix inverted"},
    {"relative", "", "largest |B~ - B|/|B| over the probes"},
    {"bound", "", "norm / (1 - max rho); 0: none is known"},
    {"indirect", "", "largest |B~ - B|/|B - E|"},
    {"negative", "", "most negative radiosity over the largest"},
    {"energy", "", "relative error of the power balance in closed scenes"},
    {"linearity", "", "relative"},
    {"reciprocity", "", "relative"},
    {"outcome", NULL, "done, or the reason of the refusal"},
};

static lam_status add_result(const bench_run *run, const stability_problem *p, double rho,
                             const stability_way *way, table *out, lam_error *error) {
    lam_status status = LAM_OK;
    stability_result r;
    char method[64];
    TRY(bench_check(run, error));
    TRY(stability_try(p, way, &r, error));
    snprintf(method, sizeof method, "%s%s%s", way->method, way->factorizer != NULL ? " " : "",
             way->factorizer != NULL ? way->factorizer : "");
    table_text(out, p->name);
    table_number(out, rho);
    table_text(out, method);
    table_number(out, way->epsilon);
    table_number(out, (double)way->rank);
    table_number(out, (double)r.rank);
    table_number(out, r.norm);
    table_number(out, r.rcond);
    table_number(out, r.relative);
    table_number(out, r.bound);
    table_number(out, r.indirect);
    table_number(out, r.negative);
    table_number(out, r.energy);
    table_number(out, r.linearity);
    table_number(out, r.reciprocity);
    table_text(out, r.status != LAM_OK ? r.message : r.finite ? "done" : "NOT FINITE");
done:
    return status;
}

lam_status bench_stability(const bench_run *run, lam_error *error) {
    static const double rhos[] = {.5, .9, .99, .999, .9999};
    static const stability_way ways[] = {
        {"exact", "auto", .05, 0},        {"low-rank", "hf", .05, 0},     {"low-rank", "hf", .001, 0},
        {"low-rank", "svd", .05, 0},      {"low-rank", "rsi", .05, 0},    {"low-rank", "sgrsvd", .05, 0},
        {"low-rank", "hf", .05, 1},       {"low-rank", "svd", .05, 1},    {"low-rank", "rsi", .05, 1},
        {"low-rank", "sgrsvd", .05, 1},   {"low-rank", "hf", .05, 999},   {"low-rank", "rsi", .05, 999},
        {"low-rank", "sgrsvd", .05, 999}, {"2msc", NULL, 0, 0},           {"sparse", NULL, 0, 0},
        {"emitters", NULL, 0, 0},         {"hierarchical", NULL, .05, 0}, {"hierarchical", NULL, .003, 0}};
    lam_status status = LAM_OK;
    stability_problem p = {0};
    table out = {.name = "operators",
                 .title = "Operators of numerically hard problems",
                 .columns = stability_columns,
                 .n_columns = sizeof stability_columns / sizeof *stability_columns,
                 .printed = true};
    for (int which = 0; which < STABILITY_PROBLEMS; which++)
        for (size_t k = 0; k < sizeof rhos / sizeof *rhos; k++) {
            if (run->scale == BENCH_QUICK && k % 2 == 1) continue;
            TRY(stability_make(which, rhos[k], &p, error));
            for (size_t w = 0; w < sizeof ways / sizeof *ways; w++) {
                if (!stability_can(&p, &ways[w])) continue;
                TRY(add_result(run, &p, which == STABILITY_BLACK ? 0 : rhos[k], &ways[w], &out, error));
            }
            stability_free(&p);
            if (which == STABILITY_BLACK) break;
        }
    TRY(bench_table(run, &out, error));
done:
    stability_free(&p);
    table_free(&out);
    return status;
}
