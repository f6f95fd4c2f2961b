#include "solver/adapt/mesh_fit.h"

#include "solver/base/random.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Elements that are looked at in a mesh, and points of all of them together, about. */
enum { LOOKS = 512, LOOK_POINTS = 4608 };

/* Elements of the first even division, the most that it takes where a division by the light can follow, and
 * divisions. An element costs the more the more faces hide others: an atrium of 2,021 faces takes 95 s of
 * processor time with its judge as 15,317 even elements, 62 s as 3,595 by the light, of the same error. */
enum { EVEN_FIRST = 1000, EVEN_MOST = 16000, EVEN_TRIES = 5 };
static const double even_faces = 500;

/* A division aims this far below the error, as the estimate of one is right within some hundredths. */
static const double aim = .93;

/* Points that a division by the light looks at, and the most that its first look at all faces may take. */
enum { LIGHT_POINTS = 300000, LIGHT_FIRST_POINTS = LIGHT_POINTS / 2, LIGHT_POINTS_OF_FACE = 16 };

/* A mesh that was made of the faces. */
typedef struct division {
    mesh m;
    uint32_t *parent; /* [n], the faces */
    mesh_estimate left;
} division;

static void division_free(division *d) {
    mesh_free(&d->m);
    free(d->parent);
    *d = (division){.parent = NULL};
}

/* An element as a cell of its face. */
static mesh_cell cell_of(const mesh *m, size_t i, uint32_t face) {
    mesh_cell c = mesh_cell_of(m, i);
    c.face = face;
    return c;
}

/* Elements k are looked at with the probability W p_k, so that the sum of squares of errors of all is
 *     sum_k e_k^2 / (W p_k),
 * with p_k ~ A rho: where nothing is reflected constants leave nothing. All are, W p_k = 1, where there are
 * no more than LOOKS. */
typedef struct look_list {
    size_t n;
    uint32_t *element; /* [n] */
    double *weight;    /* [n], 1 / (W p) */
} look_list;

static double reflects(const mesh *m, size_t i) {
    double sum = 0;
    for (size_t c = 0; c < m->n_channels; c++) sum += (double)m->reflectance[c * m->n + i];
    return m->area[i] * sum;
}

static lam_status choose_looks(const mesh *m, uint64_t seed, look_list *out, lam_error *error) {
    double all = 0, before = 0;
    uint64_t random = seed;
    out->element = memory_allocate(LOOKS, sizeof *out->element, "a look at a mesh", error);
    out->weight = memory_allocate(LOOKS, sizeof *out->weight, "a look at a mesh", error);
    if (out->element == NULL || out->weight == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < m->n; i++) all += reflects(m, i);
    const double step = all / LOOKS, start = random_unit(&random);
    for (size_t i = 0; i < m->n && m->n <= LOOKS; i++) {
        out->element[out->n] = (uint32_t)i;
        out->weight[out->n++] = 1;
    }
    for (size_t i = 0; i < m->n && m->n > LOOKS && step > 0; i++) {
        const double share = reflects(m, i);
        before += share;
        for (; out->n < LOOKS && ((double)out->n + start) * step < before; out->n++) {
            out->element[out->n] = (uint32_t)i;
            out->weight[out->n] = step / share;
        }
    }
    return LAM_OK;
}

/* Estimates the error of constants on the elements of a mesh. parent: their faces; NULL: they are these. */
static lam_status look_at(const cell_light *light, const mesh *m, const uint32_t *parent,
                          const mesh_fit_options *how, mesh_estimate *out, lam_error *error) {
    lam_status status = LAM_OK;
    look_list looks = {.n = 0};
    const size_t values = cell_light_values(light);
    double sum[COARSE_LIGHTS] = {0};
    float(*off)[COARSE_LIGHTS] = memory_allocate(LOOKS, sizeof *off, "a look at a mesh", error);
    bool failed = false;
    size_t steps = 3;
    if (off == NULL) TRY(LAM_ERR_MEMORY);
    TRY(choose_looks(m, how->seed, &looks, error));
    while (steps < CELL_STEPS_MOST / 2 && looks.n * steps * steps < LOOK_POINTS) steps++;
#pragma omp parallel for schedule(dynamic, 4)
    for (size_t k = 0; k < looks.n; k++) {
        const uint32_t i = looks.element[k];
        const mesh_cell c = cell_of(m, i, parent != NULL ? parent[i] : i);
        cell_points points = {.n = 0};
        lam_error none;
        memset(off[k], 0, sizeof off[k]);
        if (progress_cancelled(how->progress)) continue;
        if (cell_points_reserve(&points, values, 0, steps * steps, &none) == LAM_OK) {
            const uint64_t key = random_hash(random_hash(how->seed) ^ random_hash(k + 1));
            cell_look_at(light, &c, key, steps, &points, off[k]);
        } else {
#pragma omp atomic write
            failed = true;
        }
        cell_points_free(&points);
    }
    if (failed) FAIL(error, LAM_ERR_MEMORY, "a look at a mesh: no memory for %zu points", steps * steps);
    if (progress_cancelled(how->progress)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
    for (size_t k = 0; k < looks.n; k++)
        for (size_t l = 0; l < light->coarse->n_lights; l++) sum[l] += looks.weight[k] * (double)off[k][l];
    *out = mesh_estimate_of(light->coarse, sum);
done:
    free(off);
    free(looks.element);
    free(looks.weight);
    return status;
}

/* Sides of all faces, by area, per face: of n elements of both sides n / sides are fronts. */
static double sides_of(const mesh *m) {
    double area = 0, all = 0;
    for (size_t i = 0; i < m->n; i++) {
        area += m->area[i];
        all += m->has_back != NULL && m->has_back[i] ? 2 * m->area[i] : m->area[i];
    }
    return all / area;
}

static lam_status divide_evenly(const cell_light *light, const mesh *m, double elements,
                                const mesh_fit_options *how, division *out, lam_error *error) {
    lam_status status = LAM_OK;
    const mesh_refinement refinement = {.elements = (size_t)fmax(1, elements / sides_of(m))};
    division_free(out);
    TRY(mesh_refine_into(m, &refinement, &out->m, &out->parent, error));
    TRY(look_at(light, &out->m, out->parent, how, &out->left, error));
done:
    return status;
}

/* Of two meshes that keep no error, that of the light, which has fewer elements, may leave as much more. */
static const double as_good = 1.1;

/* Elements for an error, by the law error ~ n^-p through the last two divisions; p is that of light which
 * changes along shadows, 1/4, at least, and that of light without any, 1/2, at most where noise says more. */
static double elements_for(double wanted, double n0, double e0, double n1, double e1) {
    const double p = fmin(fmax(log(e0 / e1) / log(n1 / n0), .25), .6);
    return n1 * pow(e1 / wanted, 1 / p);
}

/* The smallest even division that keeps the error, of at most `most` elements; *found is false where none
 * does. out holds the last one that was tried, then. */
static lam_status fit_evenly(const cell_light *light, const mesh *m, const mesh_fit_options *how, double e0,
                             double most, division *out, bool *found, lam_error *error) {
    lam_status status = LAM_OK;
    double n0 = (double)m->n, n = fmin(fmax(2 * n0, EVEN_FIRST), most);
    *found = false;
    for (int k = 0; k < EVEN_TRIES && n > n0 && n <= most; k++) {
        TRY(divide_evenly(light, m, n, how, out, error));
        progress_report(how->progress, "mesh", (double)(k + 1) / EVEN_TRIES);
        const double e1 = mesh_estimate_most(&out->left), n1 = (double)out->m.n;
        *found = e1 <= how->error;
        if (*found || n1 <= n0) break;
        /* The first divisions say little of the law: a next one has four times the elements at most. */
        n = fmin(fmax(elements_for(aim * how->error, n0, e0, n1, e1), 1.2 * n1), 4 * n1);
        n0 = n1, e0 = e1;
    }
done:
    return status;
}

static lam_status fit_to_light(const cell_light *light, const mesh_fit_options *how, division *out,
                               bool *reached, lam_error *error) {
    lam_status status = LAM_OK;
    adaptive_report made;
    const adaptive_options by = {.error = aim * how->error,
                                 .rough = true,
                                 .elements = how->elements,
                                 .points = (size_t)(how->effort * LIGHT_POINTS),
                                 .seed = how->seed,
                                 .progress = how->progress};
    TRY(adaptive_refine_by(light, &by, &out->m, &made, error));
    out->left = made.left;
    *reached = mesh_estimate_most(&made.left) <= how->error;
done:
    return status;
}

/* Divides as the error asks for; evenly where a division by the light costs more or leaves as much. */
static lam_status divide(const cell_light *light, const mesh *m, const mesh_fit_options *how, division *out,
                         mesh_fit_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    division even = {.parent = NULL};
    const double e0 = mesh_estimate_most(&report->faces), all = fmax((double)how->elements, (double)m->n);
    const bool by_light = (double)(LIGHT_POINTS_OF_FACE * m->n) <= how->effort * LIGHT_FIRST_POINTS;
    const double even_most = EVEN_MOST * fmin(1, even_faces / (double)m->n);
    report->way = MESH_FIT_EVEN;
    TRY(fit_evenly(light, m, how, e0, by_light ? fmin(even_most, all) : all, &even, &report->reached, error));
    if (!report->reached && by_light) {
        TRY(fit_to_light(light, how, out, &report->reached, error));
        report->way = MESH_FIT_LIGHT;
    }
    if (!report->reached) TRY(divide_evenly(light, m, all, how, &even, error));
    if (report->way == MESH_FIT_LIGHT &&
        (report->reached || mesh_estimate_most(&out->left) <= as_good * mesh_estimate_most(&even.left)))
        goto done;
    report->way = MESH_FIT_EVEN;
    division_free(out);
    *out = even;
    even = (division){.parent = NULL};
done:
    division_free(&even);
    return status;
}

lam_status mesh_fit(mesh *m, const mesh_fit_options *how, mesh_fit_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    light_scene by = {.g = NULL};
    division made = {.parent = NULL};
    mesh_fit_report found = {.way = MESH_FIT_FACES};
    const size_t faces = m->n;
    TRY(light_scene_make(m, &how->from, how->seed, how->progress, &by, error));
    TRY(look_at(&by.light, m, NULL, how, &found.faces, error));
    found.left = found.faces;
    found.reached = mesh_estimate_most(&found.faces) <= how->error;
    if (!found.reached) {
        if (how->cut != NULL) TRY(how->cut(how->cut_of, error));
        if (m->n > faces) { /* they are other faces now */
            light_scene_free(&by);
            TRY(light_scene_make(m, &how->from, how->seed, how->progress, &by, error));
        }
        TRY(divide(&by.light, m, how, &made, &found, error));
        found.left = made.left;
        if (made.m.n > m->n) mesh_replace(m, &made.m);
    }
    *report = found;
done:
    division_free(&made);
    light_scene_free(&by);
    return status;
}
