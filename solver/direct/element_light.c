#include "solver/direct/element_light.h"

#include "solver/base/vector3.h"

#include <math.h>
#include <string.h>

/* Two rules of a part agree within this part of its light, or of all light so far times `small_part`. Where
 * the light is smooth the first is wrong by h^2 and the better one by h^4, so that it is within about 1e-4;
 * where a kink or a step crosses a part, the better one is nearer than the other one by a third. */
static const double agreed = 8e-3, small_part = 1. / 16;

/* A part's light below this share of what the peak would give the element matters to nobody. */
static const double dim_part = 1e-6;

/* An element is divided until a part's diameter is at most this angle, seen from the opening, in radians;
 * narrow beams ask for less. */
static const double widest = .17, narrowest = .017;

/* Divisions of an element at most: of wide parts, and after that until two rules agree. */
enum { WIDE_MOST = 12, APART_MOST = 6 };

/* A triangle or a quad in the frame of the luminaire. */
typedef struct part_of_element {
    int n;
    double corner[4][3];
} part_of_element;

typedef struct element_sum {
    const placed_source *source;
    kept_cells *kept;
    double normal[3]; /* in the frame */
    double flux;      /* lm so far */
    double dimmest;   /* lm that matter to nobody */
    double widest;    /* radians */
} element_sum;

static double irradiance(const element_sum *s, const double x[3]) {
    return placed_source_irradiance(s->source, x, s->normal, s->kept);
}

static double triangle_size(const double a[3], const double b[3], const double c[3]) {
    double ab[3], ac[3], across[3];
    subtract3(b, a, ab);
    subtract3(c, a, ac);
    cross3(ab, ac, across);
    return .5 * sqrt(dot3(across, across));
}

/* The light of a part by one place and by three or four, in lm. */
static void triangle_rules(const element_sum *s, const part_of_element *p, double *one, double *more) {
    const double area = triangle_size(p->corner[0], p->corner[1], p->corner[2]);
    double middle[3];
    *more = 0;
    for (int d = 0; d < 3; d++) middle[d] = (p->corner[0][d] + p->corner[1][d] + p->corner[2][d]) / 3;
    for (int k = 0; k < 3; k++) {
        double x[3];
        for (int d = 0; d < 3; d++) x[d] = .5 * (middle[d] + p->corner[k][d]); /* 2/3, 1/6, 1/6 */
        *more += area / 3 * irradiance(s, x);
    }
    *one = area * irradiance(s, middle);
}

static void quad_rules(const element_sum *s, const part_of_element *p, double *one, double *more) {
    static const double offset = .57735026918962576; /* 1 / sqrt 3 */
    *more = 0;
    for (int k = 0; k < 5; k++) {
        const double u = k == 4 ? .5 : .5 + .5 * (k & 1 ? offset : -offset),
                     w = k == 4 ? .5 : .5 + .5 * (k & 2 ? offset : -offset);
        double x[3], along_u[3], along_w[3], area[3];
        for (int d = 0; d < 3; d++) {
            const double a = p->corner[0][d], b = p->corner[1][d], c = p->corner[2][d], e = p->corner[3][d];
            x[d] = (1 - u) * (1 - w) * a + u * (1 - w) * b + u * w * c + (1 - u) * w * e;
            along_u[d] = (1 - w) * (b - a) + w * (c - e);
            along_w[d] = (1 - u) * (e - a) + u * (c - b);
        }
        cross3(along_u, along_w, area);
        const double light = sqrt(dot3(area, area)) * irradiance(s, x);
        if (k == 4)
            *one = light;
        else
            *more += light / 4;
    }
}

/* Fourths of a part, each of its shape. */
static void divide(const part_of_element *p, part_of_element out[4]) {
    double half[4][3], middle[3] = {0};
    for (int k = 0; k < p->n; k++)
        for (int d = 0; d < 3; d++) {
            half[k][d] = .5 * (p->corner[k][d] + p->corner[(k + 1) % p->n][d]);
            middle[d] += p->corner[k][d] / p->n;
        }
    for (int k = 0; k < p->n; k++) {
        const double *before = half[(k + p->n - 1) % p->n];
        out[k].n = p->n;
        memcpy(out[k].corner[0], p->corner[k], sizeof middle);
        memcpy(out[k].corner[1], half[k], sizeof middle);
        memcpy(out[k].corner[2], p->n == 4 ? middle : before, sizeof middle);
        memcpy(out[k].corner[3], before, sizeof middle);
    }
    if (p->n == 4) return;
    out[3].n = 3;
    for (int k = 0; k < 3; k++) memcpy(out[3].corner[k], half[k], sizeof middle);
}

/* True where a part is wide as the opening sees it. */
static bool is_wide(const element_sum *s, const part_of_element *p) {
    const double *size = s->source->opening.size;
    double middle[3] = {0}, radius = 0;
    for (int k = 0; k < p->n; k++)
        for (int d = 0; d < 3; d++) middle[d] += p->corner[k][d] / p->n;
    for (int k = 0; k < p->n; k++) {
        double to[3];
        subtract3(p->corner[k], middle, to);
        radius = fmax(radius, sqrt(dot3(to, to)));
    }
    /* Nearer to an opening than it is long, its light varies over its own extent, and where it does so faster
     * the rules differ. */
    const double extent = fmax(fmax(size[0], size[1]), size[2]),
                 distance = opening_distance(&s->source->opening, middle);
    return 2 * radius > fmax(s->widest * distance, widest * extent);
}

/* True where none of the light goes to a part. */
static bool is_unlit(const element_sum *s, const part_of_element *p) {
    bool unlit = true;
    for (int k = 0; k < p->n; k++) unlit = unlit && placed_source_is_dark(s->source, p->corner[k]);
    return unlit;
}

/* wide, apart: the divisions that are left. */
static double light_of_part(element_sum *s, const part_of_element *p, int wide, int apart) {
    part_of_element fourth[4];
    if (is_unlit(s, p)) return 0;
    if (wide > 0) wide = is_wide(s, p) ? wide - 1 : 0;
    if (wide == 0) {
        double one, more;
        if (p->n == 4)
            quad_rules(s, p, &one, &more);
        else
            triangle_rules(s, p, &one, &more);
        const double off = fabs(more - one);
        if (apart-- == 0 || off <= agreed * more || off <= agreed * small_part * s->flux ||
            off <= s->dimmest) {
            s->flux += more;
            return more;
        }
    }
    double sum = 0;
    divide(p, fourth);
    for (int k = 0; k < 4; k++) sum += light_of_part(s, &fourth[k], wide, apart);
    return sum;
}

bool element_faces_away(const mesh *m, size_t element, const placed_source *s) {
    const float *n = m->normal[element];
    const double normal[3] = {(double)n[0], (double)n[1], (double)n[2]},
                 *at = m->vertices[m->elements[element][0]], *size = s->opening.size;
    double to[3], reach = 0;
    subtract3(s->at, at, to);
    for (int k = 0; k < 3; k++) reach += size[k] / 2 * fabs(dot3(s->frame[k], normal));
    return dot3(to, normal) + reach <= 0;
}

double element_light(const mesh *m, size_t element, const placed_source *s, kept_cells *kept) {
    const float *n = m->normal[element];
    const double normal[3] = {(double)n[0], (double)n[1], (double)n[2]}, area = m->area[element];
    element_sum sum = {.source = s, .kept = kept, .widest = fmin(widest, fmax(narrowest, s->finest))};
    part_of_element whole = {.n = (int)mesh_corners(m, element)};
    double middle[3] = {0};
    if (!(s->peak > 0) || element_faces_away(m, element, s)) return 0;
    placed_source_turn(s, normal, sum.normal);
    for (int k = 0; k < whole.n; k++) {
        placed_source_inwards(s, m->vertices[m->elements[element][k]], whole.corner[k]);
        for (int d = 0; d < 3; d++) middle[d] += whole.corner[k][d] / whole.n;
    }
    const double distance = opening_distance(&s->opening, middle);
    sum.dimmest = dim_part * s->peak * fmin(area / fmax(distance * distance, 1e-12), 2 * M_PI);
    return light_of_part(&sum, &whole, WIDE_MOST, APART_MOST) / area;
}
