#include "solver/operator/blocks/importance.h"

#include "store/groups.h"
#include "store/status.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

const double importance_least = 1. / 16;

/* The shares are a multiple of the root mean square r of y by area, no less than these and at most 1. Where y
 * is 1 everywhere, all is read. The less is important, the more the errors of the rest add up in what is
 * read, and the more there is to gain. Chosen by receivers and lamps in an office, three rooms and a Cornell
 * box with blocks (r from .08 to .57): what is read errs .36 to 1.08 times as much as without, but up to 1.28
 * times at a lamp of .2 % of the area, and 1.45 times once (performance-hierarchical.md). The same of z. With
 * receivers and sources both shares are products, as the importance is. */
static const double share_of_mean = 1.5, bounds_least = .4, thresholds_least = .25;
/* The share of bounds of a reference: with bounds_least its blocks take as long as if all were read. It is no
 * more than so many times the share of what it judges, which is less than bounds_least where there are
 * receivers and sources. */
static const double reference_least = .5, reference_times = 1.25;

#define GROUP STORE_IMPORTANCE
#define SOURCES STORE_SOURCES

/* Bounces, and the largest change of the last that counts, over 1. */
enum { BOUNCES_MOST = 64 };
static const double change_least = 1e-3;

void importance_free(importance *i) {
    free(i->read);
    free(i->emits);
    free(i->of);
    free(i->lit);
    *i = (importance){.n = 0};
}

bool importance_is_found(const importance *i) {
    return (i->read == NULL || i->of != NULL) && (i->emits == NULL || i->lit != NULL);
}

/* A scene whose light from some elements is found. */
typedef struct lit_scene {
    const factor_product *F;
    size_t n, n_channels;
    const float *rho;   /* [C][n] */
    const double *area; /* [n] */
} lit_scene;

/* out [n]: the radiosity where `emits` [n] is the emission, between importance_least and 1; NULL where emits
 * is. The shares of io are multiplied by what follows from it. */
static lam_status find_light(const lit_scene *s, const float *emits, float **out, importance *io,
                             lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = s->n;
    double *y = NULL, *light = NULL;
    float *of = NULL;
    double change = 1, square = 0, whole = 0;
    if (emits == NULL) return LAM_OK;
    y = memory_allocate(n, sizeof *y, "importance", error);
    light = memory_allocate(n, sizeof *light, "importance", error);
    of = memory_allocate(n, sizeof *of, "importance", error);
    if (y == NULL || light == NULL || of == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) y[i] = (double)emits[i];
    for (int bounce = 0; bounce < BOUNCES_MOST && change > change_least; bounce++) {
        TRY(s->F->multiply(s->F->context, 1, y, light, error));
        change = 0;
        for (size_t i = 0; i < n; i++) {
            double r = 0;
            for (size_t c = 0; c < s->n_channels; c++) r = fmax(r, (double)s->rho[c * n + i]);
            const double now = (double)emits[i] + r * light[i];
            change = fmax(change, fabs(now - y[i]));
            y[i] = now;
        }
    }
    for (size_t i = 0; i < n; i++) of[i] = (float)fmin(fmax(y[i], importance_least), 1);
    for (size_t i = 0; i < n; i++) {
        square += s->area[i] * (double)of[i] * (double)of[i];
        whole += s->area[i];
    }
    const double share = share_of_mean * sqrt(square / whole);
    io->share_of_bounds *= fmin(fmax(share, bounds_least), 1);
    io->share_of_thresholds *= fmin(fmax(share, thresholds_least), 1);
    *out = of;
    of = NULL;
done:
    free(y);
    free(light);
    free(of);
    return status;
}

lam_status importance_find(const factor_product *F, size_t n_channels, const float *rho, const double *area,
                           importance *io, lam_error *error) {
    lam_status status = LAM_OK;
    const lit_scene scene = {F, io->n, n_channels, rho, area};
    float *of = NULL, *lit = NULL;
    importance shares = {.share_of_bounds = 1, .share_of_thresholds = 1};
    TRY(find_light(&scene, io->read, &of, &shares, error));
    TRY(find_light(&scene, io->emits, &lit, &shares, error));
    io->share_of_bounds = shares.share_of_bounds;
    io->share_of_thresholds = shares.share_of_thresholds;
    io->of = of;
    io->lit = lit;
    of = lit = NULL;
done:
    free(of);
    free(lit);
    return status;
}

/* *out: a copy of x [n], or of its roots; NULL of NULL. */
static lam_status copy(const float *x, size_t n, bool roots, float **out, lam_error *error) {
    if (x == NULL) return LAM_OK;
    *out = memory_allocate(n, sizeof **out, "importance", error);
    if (*out == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < n; k++) (*out)[k] = roots ? sqrtf(x[k]) : x[k];
    return LAM_OK;
}

lam_status importance_even_out(const importance *i, importance *out, lam_error *error) {
    lam_status status = LAM_OK;
    importance made = {.n = i->n,
                       .share_of_bounds = fmin(fmax(i->share_of_bounds, reference_least),
                                               reference_times * i->share_of_bounds),
                       .share_of_thresholds = i->share_of_thresholds,
                       .sensors = i->sensors,
                       .luminaires = i->luminaires};
    TRY(copy(i->read, i->n, false, &made.read, error));
    TRY(copy(i->emits, i->n, false, &made.emits, error));
    TRY(copy(i->of, i->n, true, &made.of, error));
    TRY(copy(i->lit, i->n, true, &made.lit, error));
    *out = made;
    made = (importance){.n = 0};
done:
    importance_free(&made);
    return status;
}

/* The elements where x [n] is above 0, as a dataset of that path, and what x is there. */
static lam_status save_elements(const float *x, size_t n, const char *path, const char *values, store *s,
                                lam_error *error) {
    lam_status status = LAM_OK;
    size_t count = 0;
    uint32_t *elements = memory_allocate(n, sizeof *elements, "importance", error);
    float *weights = memory_allocate(n, sizeof *weights, "importance", error);
    if (elements == NULL || weights == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < n; k++) {
        if (!(x[k] > 0)) continue;
        elements[count] = (uint32_t)k;
        weights[count++] = x[k];
    }
    TRY(store_write(s, path, STORE_U32, 1, (size_t[]){count}, elements, error));
    if (values != NULL) TRY(store_write(s, values, STORE_F32, 1, (size_t[]){count}, weights, error));
done:
    free(elements);
    free(weights);
    return status;
}

lam_status importance_save(const importance *i, const char *option, const char *sources, store *s,
                           lam_error *error) {
    lam_status status = LAM_OK;
    if (i->read != NULL) {
        TRY(save_elements(i->read, i->n, GROUP "/elements", GROUP "/weights", s, error));
        TRY(store_set_text(s, GROUP, "option", option, error));
        if (i->sensors) TRY(store_set_integer(s, GROUP, "sensors", 1, error));
    }
    if (i->emits != NULL) {
        TRY(save_elements(i->emits, i->n, SOURCES "/elements", i->luminaires ? SOURCES "/weights" : NULL, s,
                          error));
        TRY(store_set_text(s, SOURCES, "option", sources, error));
        if (i->luminaires) TRY(store_set_integer(s, SOURCES, "luminaires", 1, error));
    }
done:
    return status;
}

/* out [n]: the weights of the elements of a group of a store, 1 where it has no weights, 0 elsewhere; NULL
 * where it has no such group. */
static lam_status load_elements(store *s, const char *group, bool weighted, size_t n, float **out,
                                lam_error *error) {
    lam_status status = LAM_OK;
    size_t count = SIZE_MAX;
    void *elements = NULL, *weights = NULL;
    float *read = NULL;
    char path[64];
    if (!store_has(s, group)) return LAM_OK;
    snprintf(path, sizeof path, "%s/elements", group);
    TRY(store_read(s, path, STORE_U32, 1, &count, &elements, error));
    snprintf(path, sizeof path, "%s/weights", group);
    if (weighted) TRY(store_read(s, path, STORE_F32, 1, &count, &weights, error));
    read = memory_allocate(n, sizeof *read, "importance", error);
    if (read == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < count; k++) {
        const uint32_t i = ((const uint32_t *)elements)[k];
        const float w = weighted ? ((const float *)weights)[k] : 1;
        if (i >= n)
            FAIL(error, LAM_ERR_FORMAT, "%s: %s/elements[%zu] = %u, must be below %zu", store_path(s), group,
                 k, (unsigned)i, n);
        if (!(w > 0 && w <= 1))
            FAIL(error, LAM_ERR_FORMAT, "%s: %s[%zu] = %g, must be above 0 and at most 1", store_path(s),
                 path, k, (double)w);
        read[i] = w;
    }
    *out = read;
    read = NULL;
done:
    free(elements);
    free(weights);
    free(read);
    return status;
}

lam_status importance_load(store *s, size_t n, importance *out, lam_error *error) {
    lam_status status = LAM_OK;
    importance made = {.n = n};
    *out = (importance){.n = 0};
    TRY(load_elements(s, GROUP, true, n, &made.read, error));
    made.sensors = made.read != NULL && store_has_attribute(s, GROUP, "sensors");
    made.luminaires = store_has(s, SOURCES) && store_has_attribute(s, SOURCES, "luminaires");
    TRY(load_elements(s, SOURCES, made.luminaires, n, &made.emits, error));
    if (made.read == NULL && made.emits == NULL) goto done;
    *out = made;
    made = (importance){.n = 0};
done:
    importance_free(&made);
    return status;
}

/* out [n_clusters + n]: the root mean square of x [n] by element; NULL of NULL. */
static lam_status square_means(const float *x, const double *area, const plane_tree *tree, float **out,
                               lam_error *error) {
    const size_t N = tree->n_clusters;
    if (x == NULL) return LAM_OK;
    double(*sums)[2] = memory_allocate(N, sizeof *sums, "importance", error); /* of A x^2, and of A */
    float *made = memory_allocate(N + tree->n, sizeof *made, "importance", error);
    if (sums == NULL || made == NULL) {
        free(sums);
        free(made);
        return LAM_ERR_MEMORY;
    }
    for (size_t t = 0; t < N; t++) {
        const plane_cluster *c = &tree->clusters[t];
        for (uint32_t p = c->begin; c->leaf && p < c->end; p++) {
            const uint32_t i = tree->order[p];
            sums[t][0] += area[i] * (double)x[i] * (double)x[i];
            sums[t][1] += area[i];
        }
        for (int k = 0; !c->leaf && k < 2; k++) sums[t][k] = sums[c->left][k] + sums[t - 1][k];
        made[t] = (float)sqrt(sums[t][0] / sums[t][1]);
    }
    for (size_t p = 0; p < tree->n; p++) made[N + p] = x[tree->order[p]];
    free(sums);
    *out = made;
    return LAM_OK;
}

lam_status importance_nodes_make(const importance *i, const double *area, const plane_tree *tree,
                                 importance_nodes *out, lam_error *error) {
    lam_status status = LAM_OK;
    importance_nodes made = {.of = NULL};
    TRY(square_means(i->of, area, tree, &made.of, error));
    TRY(square_means(i->lit, area, tree, &made.lit, error));
    *out = made;
    made = (importance_nodes){.of = NULL};
done:
    importance_nodes_free(&made);
    return status;
}

void importance_nodes_free(importance_nodes *nodes) {
    free(nodes->of);
    free(nodes->lit);
    *nodes = (importance_nodes){.of = NULL};
}

static double number_at(const float *x, size_t node) {
    return x != NULL ? (double)x[node] : 1;
}

double importance_between(const importance_nodes *nodes, size_t a, size_t b) {
    const double one = number_at(nodes->of, a) * number_at(nodes->lit, b);
    const double other = number_at(nodes->of, b) * number_at(nodes->lit, a);
    return fmax(one, other);
}

double importance_at(const importance_nodes *nodes, size_t a) {
    return number_at(nodes->of, a) * number_at(nodes->lit, a);
}
