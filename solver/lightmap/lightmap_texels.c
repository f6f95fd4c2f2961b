#include "solver/lightmap/lightmap_texels.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A convex polygon of a quad and the four sides of a texel. */
enum { CORNERS_MOST = 8 };

typedef struct outline {
    size_t n;
    double corner[CORNERS_MOST][2];
} outline;

/* A texel while elements are taken one by one. */
typedef struct covered_texel {
    double area;    /* in texels */
    double largest; /* the part of one element; 2 where its centre is covered */
    double place[2];
    uint32_t element;
} covered_texel;

/* Cuts off what lies below (sign 1) or above (-1) a limit along an axis (Sutherland and Hodgman 1974). */
static void cut(outline *p, int axis, double limit, double sign) {
    outline left = {.n = 0};
    for (size_t k = 0; k < p->n; k++) {
        const double *a = p->corner[k], *b = p->corner[(k + 1) % p->n];
        const double height = sign * (a[axis] - limit), next = sign * (b[axis] - limit);
        if (height >= 0 && left.n < CORNERS_MOST) memcpy(left.corner[left.n++], a, sizeof *left.corner);
        if ((height < 0) != (next < 0) && left.n < CORNERS_MOST) {
            const double share = height / (height - next);
            for (int d = 0; d < 2; d++) left.corner[left.n][d] = a[d] + share * (b[d] - a[d]);
            left.corner[left.n++][axis] = limit;
        }
    }
    *p = left;
}

/* The area, positive in either sense, and the centroid. */
static double measure(const outline *p, double centroid[2]) {
    double twice = 0, sum[2] = {0, 0};
    for (size_t k = 1; k + 1 < p->n; k++) {
        const double *a = p->corner[0], *b = p->corner[k], *c = p->corner[k + 1];
        const double turn = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        twice += turn;
        for (int d = 0; d < 2; d++) sum[d] += turn * (a[d] + b[d] + c[d]) / 3;
    }
    for (int d = 0; d < 2; d++) centroid[d] = fabs(twice) > 0 ? sum[d] / twice : p->corner[0][d];
    return .5 * fabs(twice);
}

/* True where a point lies in a convex outline, or on its rim but for rounding. */
static bool holds(const outline *p, const double at[2]) {
    static const double rounding = 1e-9;
    double least = INFINITY, most = -INFINITY;
    for (size_t k = 0; k < p->n; k++) {
        const double *a = p->corner[k], *b = p->corner[(k + 1) % p->n];
        const double turn = (b[0] - a[0]) * (at[1] - a[1]) - (b[1] - a[1]) * (at[0] - a[0]);
        least = fmin(least, turn);
        most = fmax(most, turn);
    }
    return least >= -rounding || most <= rounding;
}

static void cover(const outline *whole, uint32_t element, const lightmap_chart *c, size_t width,
                  covered_texel *texels) {
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    const size_t first[2] = {c->x, c->y}, count[2] = {c->width, c->height};
    size_t from[2], to[2];
    for (size_t k = 0; k < whole->n; k++)
        for (int d = 0; d < 2; d++) {
            low[d] = fmin(low[d], whole->corner[k][d]);
            high[d] = fmax(high[d], whole->corner[k][d]);
        }
    for (int d = 0; d < 2; d++) {
        const double least = (double)first[d], most = (double)(first[d] + count[d] - 1);
        from[d] = (size_t)fmin(fmax(floor(low[d]), least), most);
        to[d] = (size_t)fmin(fmax(floor(high[d]), least), most);
    }
    for (size_t y = from[1]; y <= to[1]; y++)
        for (size_t x = from[0]; x <= to[0]; x++) {
            const double centre[2] = {(double)x + .5, (double)y + .5};
            covered_texel *t = &texels[y * width + x];
            outline part = *whole;
            double centroid[2];
            cut(&part, 0, (double)x, 1);
            cut(&part, 0, (double)x + 1, -1);
            cut(&part, 1, (double)y, 1);
            cut(&part, 1, (double)y + 1, -1);
            if (part.n < 3) continue;
            const double area = measure(&part, centroid);
            const bool middle = holds(whole, centre);
            const double size = middle ? 2 : area;
            t->area += area;
            if (!(size > t->largest)) continue;
            t->largest = size;
            t->element = element;
            memcpy(t->place, middle ? centre : centroid, sizeof t->place);
        }
}

lam_status lightmap_texels_find(const mesh *m, const lightmap_charts *c, lightmap_texels *out,
                                lam_error *error) {
    lam_status status = LAM_OK;
    const size_t all = c->width * c->height;
    size_t n = 0;
    lightmap_texel *made = NULL;
    covered_texel *texels = memory_allocate(all, sizeof *texels, "a lightmap", error);
    if (texels == NULL) TRY(LAM_ERR_MEMORY);
    for (uint32_t i = 0; i < m->n; i++) {
        const lightmap_chart *chart = &c->charts[c->chart_of[i]];
        outline whole = {.n = mesh_corners(m, i)};
        if (mesh_is_buried(m, i)) continue;
        for (size_t k = 0; k < whole.n; k++)
            lightmap_place(chart, m->vertices[m->elements[i][k]], whole.corner[k]);
        cover(&whole, i, chart, c->width, texels);
    }
    for (size_t k = 0; k < all; k++) n += texels[k].largest > 0;
    made = memory_allocate(n, sizeof *made, "a lightmap", error);
    if (made == NULL) TRY(LAM_ERR_MEMORY);
    n = 0;
    for (size_t k = 0; k < all; k++) {
        if (!(texels[k].largest > 0)) continue;
        const lightmap_chart *chart = &c->charts[c->chart_of[texels[k].element]];
        lightmap_texel *to = &made[n++];
        *to = (lightmap_texel){.pixel = (uint32_t)k,
                               .element = texels[k].element,
                               .area = texels[k].area * chart->step[0] * chart->step[1]};
        lightmap_point(chart, texels[k].place, to->at);
    }
    *out = (lightmap_texels){n, made};
    made = NULL;
done:
    free(made);
    free(texels);
    return status;
}
