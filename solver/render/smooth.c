#include "solver/render/smooth.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Where so many elements meet, each is compared with this many that follow it. */
enum { MOST_AROUND = 64 };
/* Share of the trace that is added to the diagonal of the normal equations, so that neighbours in one line
 * give a gradient along it. */
static const double ridge = 1e-9;
/* The most that a gradient may change R_i within the element, in steps to its neighbours. */
static const double steps_most = 2;

/* The normal equations of the gradients, in axes u, v of each element's plane. */
typedef struct gradients {
    double (*centre)[3], (*u)[3], (*v)[3]; /* [n] */
    double (*normal)[3];                   /* [n]: sums of du du, du dv, dv dv, each over d^2 */
    double (*slope)[2];                    /* [n][C]: sums of du dR, dv dR over d^2; then the gradient */
    double *step;                          /* [n][C]: the largest |dR| */
} gradients;

typedef struct smoothing {
    const smooth_nodes *nodes;
    const mesh *m;
    size_t n_channels;
    float *rest;             /* [C][n]: the values without E */
    uint32_t *from, *around; /* elements at a node: around[from[j]] ... around[from[j + 1] - 1] */
    gradients g;
    double *at_node; /* [n_nodes][C] */
} smoothing;

static void smoothing_free(smoothing *s) {
    free(s->rest);
    free(s->from);
    free(s->around);
    free(s->g.centre);
    free(s->g.u);
    free(s->g.v);
    free(s->g.normal);
    free(s->g.slope);
    free(s->g.step);
    free(s->at_node);
}

static lam_status allocate(smoothing *s, size_t n, lam_error *error) {
    const size_t n_nodes = s->nodes->n_nodes, C = s->n_channels;
    const char *const what = "smoothing";
    s->rest = memory_allocate(n, C * sizeof *s->rest, what, error);
    s->from = memory_allocate(n_nodes + 2, sizeof *s->from, what, error);
    s->around = memory_allocate(4 * n + n_nodes, sizeof *s->around, what, error);
    s->g.centre = memory_allocate(n, sizeof *s->g.centre, what, error);
    s->g.u = memory_allocate(n, sizeof *s->g.u, what, error);
    s->g.v = memory_allocate(n, sizeof *s->g.v, what, error);
    s->g.normal = memory_allocate(n, sizeof *s->g.normal, what, error);
    s->g.slope = memory_allocate(n, C * sizeof *s->g.slope, what, error);
    s->g.step = memory_allocate(n, C * sizeof *s->g.step, what, error);
    s->at_node = memory_allocate(n_nodes, C * sizeof *s->at_node, what, error);
    if (s->rest == NULL || s->from == NULL || s->around == NULL || s->g.centre == NULL || s->g.u == NULL ||
        s->g.v == NULL || s->g.normal == NULL || s->g.slope == NULL || s->g.step == NULL ||
        s->at_node == NULL)
        return LAM_ERR_MEMORY;
    return LAM_OK;
}

/* Lists the elements at each node: those with a corner there, and the one in whose edge it lies. */
static void list_around(smoothing *s) {
    const smooth_nodes *nodes = s->nodes;
    const mesh *m = s->m;
    uint32_t *const from = s->from + 1; /* counts first; then places, which end as the next node's first */
    for (size_t i = 0; i < m->n; i++)
        for (size_t k = 0; k < mesh_corners(m, i); k++) from[nodes->corner[i][k] + 1]++;
    for (size_t j = 0; j < nodes->n_nodes; j++) from[j + 1] += nodes->ties[j].length > 0;
    for (size_t j = 0; j < nodes->n_nodes; j++) from[j + 1] += from[j];
    for (uint32_t i = 0; i < m->n; i++)
        for (size_t k = 0; k < mesh_corners(m, i); k++) s->around[from[nodes->corner[i][k]]++] = i;
    for (size_t j = 0; j < nodes->n_nodes; j++)
        if (nodes->ties[j].length > 0) s->around[from[j]++] = nodes->ties[j].element;
}

static void set_axes(const mesh *m, gradients *g) {
    for (size_t i = 0; i < m->n; i++) {
        const float *normal = m->normal[i];
        const double *a = m->vertices[m->elements[i][0]], *b = m->vertices[m->elements[i][1]];
        double *u = g->u[i], *v = g->v[i], length = 0;
        mesh_centroid(m, i, g->centre[i]);
        for (int d = 0; d < 3; d++) length += (b[d] - a[d]) * (b[d] - a[d]);
        for (int d = 0; d < 3; d++) u[d] = length > 0 ? (b[d] - a[d]) / sqrt(length) : 0;
        for (int d = 0; d < 3; d++) {
            const int e = (d + 1) % 3, f = (d + 2) % 3;
            v[d] = (double)normal[e] * u[f] - (double)normal[f] * u[e];
        }
    }
}

/* The place of a point in the axes of an element. */
static void place_in(const gradients *g, size_t i, const double point[3], double out[2]) {
    out[0] = out[1] = 0;
    for (int d = 0; d < 3; d++) {
        const double apart = point[d] - g->centre[i][d];
        out[0] += apart * g->u[i][d];
        out[1] += apart * g->v[i][d];
    }
}

/* Adds a neighbour to the normal equations of an element. One that shares two nodes counts twice. */
static void add_neighbour(smoothing *s, size_t i, size_t j) {
    gradients *g = &s->g;
    const size_t n = s->m->n;
    double d[2];
    place_in(g, i, g->centre[j], d);
    const double square = d[0] * d[0] + d[1] * d[1];
    if (i == j || !(square > 0)) return;
    g->normal[i][0] += d[0] * d[0] / square;
    g->normal[i][1] += d[0] * d[1] / square;
    g->normal[i][2] += d[1] * d[1] / square;
    for (size_t c = 0; c < s->n_channels; c++) {
        const double step = (double)s->rest[c * n + j] - (double)s->rest[c * n + i];
        double *slope = g->slope[i * s->n_channels + c], *most = &g->step[i * s->n_channels + c];
        slope[0] += d[0] * step / square;
        slope[1] += d[1] * step / square;
        *most = fmax(*most, fabs(step));
    }
}

static void solve_gradients(smoothing *s) {
    gradients *g = &s->g;
    const mesh *m = s->m;
    for (size_t i = 0; i < m->n; i++) {
        const double *N = g->normal[i], trace = N[0] + N[2];
        const double a = N[0] + ridge * trace, b = N[1], c = N[2] + ridge * trace, det = a * c - b * b;
        for (size_t channel = 0; channel < s->n_channels; channel++) {
            double *slope = g->slope[i * s->n_channels + channel], most = 0;
            const double right[2] = {slope[0], slope[1]};
            slope[0] = det > 0 ? (c * right[0] - b * right[1]) / det : 0;
            slope[1] = det > 0 ? (a * right[1] - b * right[0]) / det : 0;
            for (size_t k = 0; k < mesh_corners(m, i); k++) {
                double at[2];
                place_in(g, i, m->vertices[m->elements[i][k]], at);
                most = fmax(most, fabs(slope[0] * at[0] + slope[1] * at[1]));
            }
            const double allowed = steps_most * g->step[i * s->n_channels + channel];
            for (int d = 0; d < 2 && most > allowed; d++) slope[d] *= allowed / most;
        }
    }
}

static void find_gradients(smoothing *s) {
    for (size_t j = 0; j < s->nodes->n_nodes; j++)
        for (uint32_t p = s->from[j]; p < s->from[j + 1]; p++)
            for (uint32_t q = p + 1; q < s->from[j + 1] && q <= p + MOST_AROUND; q++) {
                add_neighbour(s, s->around[p], s->around[q]);
                add_neighbour(s, s->around[q], s->around[p]);
            }
    solve_gradients(s);
}

/* The angle of an element at a corner: weights by it do not depend on how a surface is cut into triangles. */
static double corner_angle(const mesh *m, size_t element, size_t k) {
    const size_t count = mesh_corners(m, element);
    const double *here = m->vertices[m->elements[element][k]];
    const double *after = m->vertices[m->elements[element][(k + 1) % count]];
    const double *before = m->vertices[m->elements[element][(k + count - 1) % count]];
    double product = 0, one = 0, other = 0;
    for (int d = 0; d < 3; d++) {
        product += (after[d] - here[d]) * (before[d] - here[d]);
        one += (after[d] - here[d]) * (after[d] - here[d]);
        other += (before[d] - here[d]) * (before[d] - here[d]);
    }
    const double lengths = sqrt(one * other);
    return lengths > 0 ? acos(fmax(-1, fmin(1, product / lengths))) : 0;
}

/* The mean at each node of the lines that end there. */
static lam_status average(smoothing *s, lam_error *error) {
    const mesh *m = s->m;
    const size_t C = s->n_channels, n_nodes = s->nodes->n_nodes;
    double *weights = memory_allocate(n_nodes, sizeof *weights, "smoothing", error);
    if (weights == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < m->n; i++)
        for (size_t k = 0; k < mesh_corners(m, i); k++) {
            const uint32_t node = s->nodes->corner[i][k];
            const double weight = corner_angle(m, i, k) + 1e-9;
            double at[2];
            place_in(&s->g, i, m->vertices[m->elements[i][k]], at);
            weights[node] += weight;
            for (size_t c = 0; c < C; c++) {
                const double *slope = s->g.slope[i * C + c];
                const double line = (double)s->rest[c * m->n + i] + slope[0] * at[0] + slope[1] * at[1];
                s->at_node[node * C + c] += weight * line;
            }
        }
    for (size_t j = 0; j < n_nodes; j++)
        for (size_t c = 0; c < C; c++) s->at_node[j * C + c] = fmax(0, s->at_node[j * C + c] / weights[j]);
    free(weights);
    return LAM_OK;
}

/* Gives nodes in edges the values of these. The ends of an edge may be in edges themselves, even in a cycle;
 * the passes then converge, because each value is a mean of others. */
static void tie(smoothing *s) {
    const size_t C = s->n_channels;
    double change = 1, largest = 0;
    for (int pass = 0; pass < 64 && change > 1e-6 * largest; pass++) {
        change = 0;
        for (size_t j = 0; j < s->nodes->n_nodes; j++) {
            const smooth_tie *t = &s->nodes->ties[j];
            if (!(t->length > 0)) continue;
            for (size_t c = 0; c < C; c++) {
                double *here = &s->at_node[j * C + c];
                const double value = (1 - t->t) * s->at_node[t->a * C + c] + t->t * s->at_node[t->b * C + c];
                change = fmax(change, fabs(value - *here));
                largest = fmax(largest, fabs(value));
                *here = value;
            }
        }
    }
}

lam_status smooth_corners(const smooth_nodes *nodes, const mesh *m, size_t n_channels, const float *values,
                          const float *E, float *corners, lam_error *error) {
    lam_status status = LAM_OK;
    smoothing s = {.nodes = nodes, .m = m, .n_channels = n_channels};
    TRY(allocate(&s, m->n, error));
    for (size_t k = 0; k < n_channels * m->n; k++) s.rest[k] = values[k] - (E != NULL ? E[k] : 0);
    list_around(&s);
    set_axes(m, &s.g);
    find_gradients(&s);
    TRY(average(&s, error));
    tie(&s);
    for (size_t c = 0; c < n_channels; c++)
        for (size_t i = 0; i < m->n; i++) {
            float *out = corners + 4 * (c * m->n + i);
            out[3] = NAN;
            for (size_t k = 0; k < mesh_corners(m, i); k++)
                out[k] = (float)(s.at_node[nodes->corner[i][k] * n_channels + c]) +
                         (E != NULL ? E[c * m->n + i] : 0);
        }
done:
    smoothing_free(&s);
    return status;
}

void smooth_weights(const double (*corners)[3], size_t n_corners, const double normal[3],
                    const double point[3], double *weights) {
    double spoke[4][3], radius[4], cross[4], dot[4], tangent[4], total = 0;
    assert(n_corners == 3 || n_corners == 4);
    for (size_t i = 0; i < n_corners; i++) {
        double height = 0;
        weights[i] = 0;
        for (int d = 0; d < 3; d++) height += (corners[i][d] - point[d]) * normal[d];
        for (int d = 0; d < 3; d++) spoke[i][d] = corners[i][d] - point[d] - height * normal[d];
        radius[i] = sqrt(spoke[i][0] * spoke[i][0] + spoke[i][1] * spoke[i][1] + spoke[i][2] * spoke[i][2]);
    }
    for (size_t i = 0; i < n_corners; i++) {
        const double *a = spoke[i], *b = spoke[(i + 1) % n_corners];
        if (!(radius[i] > 0)) {
            weights[i] = 1;
            return;
        }
        cross[i] = (a[1] * b[2] - a[2] * b[1]) * normal[0] + (a[2] * b[0] - a[0] * b[2]) * normal[1] +
                   (a[0] * b[1] - a[1] * b[0]) * normal[2];
        dot[i] = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    }
    for (size_t i = 0; i < n_corners; i++) {
        const size_t j = (i + 1) % n_corners;
        /* Within rounding of this edge: linear between its ends. */
        if (fabs(cross[i]) <= 1e-12 * radius[i] * radius[j] && dot[i] < 0) {
            for (size_t k = 0; k < n_corners; k++) weights[k] = 0;
            weights[i] = radius[j] / (radius[i] + radius[j]);
            weights[j] = 1 - weights[i];
            return;
        }
        /* tan of half the angle between the spokes, without cancellation */
        tangent[i] = dot[i] < 0 ? (radius[i] * radius[j] - dot[i]) / cross[i]
                                : cross[i] / (radius[i] * radius[j] + dot[i]);
    }
    for (size_t i = 0; i < n_corners; i++) {
        weights[i] = (tangent[(i + n_corners - 1) % n_corners] + tangent[i]) / radius[i];
        total += weights[i];
    }
    for (size_t i = 0; i < n_corners; i++) weights[i] /= total;
}
