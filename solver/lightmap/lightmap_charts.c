#include "solver/lightmap/lightmap_charts.h"

#include "solver/base/vector3.h"
#include "solver/lightmap/plane_parts.h"
#include "solver/lightmap/rectangle_pack.h"
#include "solver/scene/plane.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char what[] = "a lightmap";

void lightmap_charts_free(lightmap_charts *c) {
    free(c->charts);
    free(c->elements);
    free(c->chart_of);
    *c = (lightmap_charts){.n = 0};
}

void lightmap_place(const lightmap_chart *c, const double at[3], double place[2]) {
    const double corner[2] = {(double)c->x, (double)c->y};
    double way[3];
    subtract3(at, c->origin, way);
    for (int k = 0; k < 2; k++) place[k] = corner[k] + dot3(way, c->axis[k]) / c->step[k];
}

void lightmap_point(const lightmap_chart *c, const double place[2], double at[3]) {
    const double corner[2] = {(double)c->x, (double)c->y};
    for (int d = 0; d < 3; d++) {
        at[d] = c->origin[d];
        for (int k = 0; k < 2; k++) at[d] += (place[k] - corner[k]) * c->step[k] * c->axis[k][d];
    }
}

/* Lists the elements by charts. */
static lam_status list_charts(const mesh *m, lightmap_charts *out, lam_error *error) {
    lam_status status = LAM_OK;
    out->chart_of = memory_allocate(m->n, sizeof *out->chart_of, what, error);
    out->elements = memory_allocate(m->n, sizeof *out->elements, what, error);
    if (out->elements == NULL || out->chart_of == NULL) TRY(LAM_ERR_MEMORY);
    TRY(plane_parts_find(m, out->chart_of, &out->n, error));
    out->charts = memory_allocate(out->n, sizeof *out->charts, what, error);
    if (out->charts == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < m->n; i++) out->charts[out->chart_of[i]].count++;
    for (size_t k = 1; k < out->n; k++)
        out->charts[k].first = out->charts[k - 1].first + out->charts[k - 1].count;
    for (size_t k = 0; k < out->n; k++) out->charts[k].count = 0;
    for (uint32_t i = 0; i < m->n; i++) {
        lightmap_chart *c = &out->charts[out->chart_of[i]];
        out->elements[c->first + c->count++] = i;
    }
done:
    return status;
}

/* The directions of edges that a chart may be laid along, [DIRECTIONS], apart by more than a degree. */
enum { DIRECTIONS = 16 };

static size_t find_directions(const mesh *m, const uint32_t *elements, size_t count, const double u[3],
                              const double w[3], double angle[DIRECTIONS]) {
    static const double apart = M_PI / 180;
    size_t n = 0;
    for (size_t k = 0; k < count; k++)
        for (size_t c = 0; c < mesh_corners(m, elements[k]) && n < DIRECTIONS; c++) {
            const uint32_t *corner = m->elements[elements[k]];
            double edge[3];
            bool known = false;
            subtract3(m->vertices[corner[(c + 1) % mesh_corners(m, elements[k])]], m->vertices[corner[c]],
                      edge);
            const double a = atan2(dot3(edge, w), dot3(edge, u));
            for (size_t i = 0; i < n; i++) known = known || fabs(remainder(a - angle[i], M_PI_2)) < apart;
            if (!known) angle[n++] = a;
        }
    return n;
}

/* The rectangle around the elements of a chart, along u and w. */
static void bound(const mesh *m, const uint32_t *elements, size_t count, const double u[3], const double w[3],
                  double low[2], double high[2]) {
    low[0] = low[1] = INFINITY;
    high[0] = high[1] = -INFINITY;
    for (size_t k = 0; k < count; k++)
        for (size_t c = 0; c < mesh_corners(m, elements[k]); c++) {
            const double *at = m->vertices[m->elements[elements[k]][c]], x[2] = {dot3(at, u), dot3(at, w)};
            for (int d = 0; d < 2; d++) {
                low[d] = fmin(low[d], x[d]);
                high[d] = fmax(high[d], x[d]);
            }
        }
}

/* Lays a chart along the edges around which its rectangle is smallest, the longer side along rows; step is
 * its extent then. */
static void lay(const mesh *m, const uint32_t *elements, lightmap_chart *c) {
    double normal[3], u[3], w[3], angle[DIRECTIONS], best = INFINITY;
    const uint32_t *own = elements + c->first;
    for (int d = 0; d < 3; d++) normal[d] = (double)m->normal[own[0]][d];
    plane_axes(normal, u, w);
    const size_t n = find_directions(m, own, c->count, u, w, angle);
    for (size_t k = 0; k < 2 * n; k++) {
        const double a = angle[k / 2] + (double)(k % 2) * M_PI_2;
        double axis[2][3], low[2], high[2];
        for (int d = 0; d < 3; d++) {
            axis[0][d] = cos(a) * u[d] + sin(a) * w[d];
            axis[1][d] = cos(a) * w[d] - sin(a) * u[d];
        }
        bound(m, own, c->count, axis[0], axis[1], low, high);
        const double extent[2] = {high[0] - low[0], high[1] - low[1]};
        if (extent[0] < extent[1] || extent[0] * extent[1] >= best * (1 - 1e-9)) continue;
        best = extent[0] * extent[1];
        const double *at = m->vertices[m->elements[own[0]][0]];
        memcpy(c->axis, axis, sizeof c->axis);
        for (int d = 0; d < 3; d++)
            c->origin[d] =
                at[d] + (low[0] - dot3(at, axis[0])) * axis[0][d] + (low[1] - dot3(at, axis[1])) * axis[1][d];
        for (int d = 0; d < 2; d++) c->step[d] = extent[d];
    }
}

/* Texels along an extent, none longer than texel but for rounding. */
static double texels_along(double extent, double texel) {
    return fmax(ceil(extent / texel * (1 - 1e-9)), 1);
}

/* Texels of all charts, with their borders. */
static double count_texels(const lightmap_charts *c, double texel) {
    double sum = 0;
    for (size_t k = 0; k < c->n; k++)
        sum += (texels_along(c->charts[k].step[0], texel) + 2 * LIGHTMAP_BORDER) *
               (texels_along(c->charts[k].step[1], texel) + 2 * LIGHTMAP_BORDER);
    return sum;
}

/* From a texel of this length on each chart is one. */
static double longest(const lightmap_charts *c) {
    double most = 0;
    for (size_t k = 0; k < c->n; k++) most = fmax(most, fmax(c->charts[k].step[0], c->charts[k].step[1]));
    return most;
}

/* Packs charts of a texel; the map is 0 by 0 where they do not fit. */
static lam_status pack(lightmap_charts *c, double texel, lam_error *error) {
    lam_status status = LAM_OK;
    packed_rectangle *of = NULL;
    c->width = c->height = 0;
    if (count_texels(c, texel) > (double)LIGHTMAP_TEXELS_MOST) return LAM_OK;
    of = memory_allocate(c->n, sizeof *of, what, error);
    if (of == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < c->n; k++)
        of[k] = (packed_rectangle){
            .width = (size_t)texels_along(c->charts[k].step[0], texel) + 2 * LIGHTMAP_BORDER,
            .height = (size_t)texels_along(c->charts[k].step[1], texel) + 2 * LIGHTMAP_BORDER};
    TRY(rectangles_pack(c->n, of, LIGHTMAP_SIDE_MOST, &c->width, &c->height, error));
    for (size_t k = 0; k < c->n && c->width > 0; k++) {
        lightmap_chart *to = &c->charts[k];
        to->x = of[k].x + LIGHTMAP_BORDER;
        to->y = of[k].y + LIGHTMAP_BORDER;
        to->width = of[k].width - 2 * LIGHTMAP_BORDER;
        to->height = of[k].height - 2 * LIGHTMAP_BORDER;
    }
done:
    free(of);
    return status;
}

lam_status lightmap_charts_make(const mesh *m, double texel, lightmap_charts *out, lam_error *error) {
    lam_status status = LAM_OK;
    static const double larger = 1.1;
    lightmap_charts made = {.n = 0};
    double area = 0;
    TRY(list_charts(m, &made, error));
    for (size_t k = 0; k < made.n; k++) lay(m, made.elements, &made.charts[k]);
    for (size_t i = 0; i < m->n; i++) area += m->area[i];
    made.texel = texel > 0 ? texel : .5 * sqrt(area / (double)m->n);
    /* Borders alone may be more than the preset allows. */
    while (texel == 0 && count_texels(&made, made.texel) > (double)LIGHTMAP_TEXELS_PRESET &&
           made.texel < longest(&made)) {
        made.texel *= larger;
        made.enlarged = true;
    }
    TRY(pack(&made, made.texel, error));
    if (made.width == 0) {
        double fits = made.texel;
        while (made.width == 0 && fits < longest(&made)) {
            fits *= larger;
            TRY(pack(&made, fits, error));
        }
        if (made.width == 0)
            FAIL(error, LAM_ERR_ARGUMENT,
                 "a lightmap of %zu charts, one for each plane part of a group, has more than the %zu texels "
                 "that it may have at most; leave --at texels out",
                 made.n, LIGHTMAP_TEXELS_MOST);
        FAIL(error, LAM_ERR_ARGUMENT,
             "--texel %g: %zu charts have more than the %zu texels that a lightmap may have at most; give "
             "%.3g or more",
             made.texel, made.n, LIGHTMAP_TEXELS_MOST, 1.01 * fits);
    }
    for (size_t k = 0; k < made.n; k++) {
        made.charts[k].step[0] /= (double)made.charts[k].width;
        made.charts[k].step[1] /= (double)made.charts[k].height;
    }
    *out = made;
    made = (lightmap_charts){.n = 0};
done:
    lightmap_charts_free(&made);
    return status;
}
