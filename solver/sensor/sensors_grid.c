/* Grids over the main plane of a group, or over a polygon: the rectangle of least area about it, its cells,
 * and those of their middles that lie in it and off its rim. */
#include "solver/base/array_grow.h"
#include "solver/base/nearest.h"
#include "solver/base/vector3.h"
#include "solver/scene/plane.h"
#include "solver/sensor/sensors_parts.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Corners of faces of one plane are this near to it, in radii of what lies in it. */
static const double same_plane = 1e-4;

/* The cosine with the vertical from which on a plane lies flat. */
static const double lies_flat = 1 - 1e-6;

typedef struct plane_of_group {
    double normal[3], offset, area;
} plane_of_group;

/* Rings of corners in a plane, [n], each of them convex or the only one; and the bins of the rectangle about
 * all of them, by which the rings about a point are found. */
typedef struct plane_area {
    double normal[3], u[3], w[3]; /* u x w = normal */
    double offset;                /* of the plane along its normal */
    size_t n, n_corners, capacity;
    size_t *start;       /* [n + 1], corners before each ring */
    double (*corner)[2]; /* [n_corners], along u and w */
    double low[2], size[2];
    size_t bins[2], *bin; /* bin: [bins[0] bins[1] + 1], entries of ring before each */
    uint32_t *ring;
    double slack;
} plane_area;

double sensors_en12464(double longer, double shorter) {
    const double d = longer >= 2 * shorter ? shorter : longer;
    return fmin(.2 * pow(5, log10(d)), 10);
}

static void area_free(plane_area *a) {
    free(a->start);
    free(a->corner);
    free(a->bin);
    free(a->ring);
}

static lam_status find_group(const sensors_reading *r, const sensors_area *area, size_t *out,
                             lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = r->m;
    char advice[256];
    if (m == NULL) FAIL(error, LAM_ERR_ARGUMENT, "%s: over = %.64s needs a scene", area->place, area->group);
    for (size_t g = 0; g < m->n_groups; g++)
        if (strcmp(m->group_names[g], area->group) == 0) {
            *out = g;
            return LAM_OK;
        }
    nearest_advice(area->group, m->n_groups, (const char *const *)m->group_names, advice, sizeof advice);
    FAIL(error, LAM_ERR_ARGUMENT, "%s: over = %.64s, which is no group of the scene: %s", area->place,
         area->group, advice);
done:
    return status;
}

/* True where a front of a group lies in a plane. */
static bool is_in_plane(const mesh *m, size_t j, const plane_of_group *p, double reach) {
    double cosine = 0;
    for (int d = 0; d < 3; d++) cosine += p->normal[d] * (double)m->normal[j][d];
    if (!(cosine > 1 - 1e-4)) return false;
    for (size_t c = 0; c < mesh_corners(m, j); c++)
        if (!(fabs(dot3(m->vertices[m->elements[j][c]], p->normal) - p->offset) <= reach)) return false;
    return true;
}

/* The largest plane of a group that looks up, or else the largest. share: of the group's area in it. */
static bool main_plane(const mesh *m, size_t group, const double up[3], double reach, plane_of_group *out,
                       double *share) {
    enum { PLANES_MOST = 64 };
    plane_of_group planes[PLANES_MOST];
    size_t n = 0;
    double all = 0;
    for (size_t j = 0; j < m->n - m->n_backs; j++) {
        size_t k = 0;
        if (m->group[j] != group) continue;
        all += m->area[j];
        while (k < n && !is_in_plane(m, j, &planes[k], reach)) k++;
        if (k == PLANES_MOST) continue;
        if (k == n) {
            plane_of_group *p = &planes[n++];
            *p = (plane_of_group){.area = 0};
            for (int d = 0; d < 3; d++) p->normal[d] = (double)m->normal[j][d];
            (void)list_normalize(p->normal);
            p->offset = dot3(m->vertices[m->elements[j][0]], p->normal);
        }
        planes[k].area += m->area[j];
    }
    const plane_of_group *best = NULL;
    for (int level = 1; level >= 0 && best == NULL; level--)
        for (size_t k = 0; k < n; k++)
            if ((level == 0 || dot3(planes[k].normal, up) > lies_flat) &&
                (best == NULL || planes[k].area > best->area))
                best = &planes[k];
    if (best == NULL) return false;
    *out = *best;
    *share = best->area / all;
    return true;
}

static lam_status add_corner(plane_area *a, const double at[3], const char *name, lam_error *error) {
    const lam_status status =
        array_grow(&a->corner, &a->capacity, a->n_corners + 1, sizeof *a->corner, name, error);
    if (status != LAM_OK) return status;
    a->corner[a->n_corners][0] = dot3(at, a->u);
    a->corner[a->n_corners++][1] = dot3(at, a->w);
    return LAM_OK;
}

static lam_status take_group(sensors_reading *r, const sensors_area *area, const double up[3], plane_area *a,
                             lam_error *error) {
    lam_status status = LAM_OK;
    const mesh *m = r->m;
    size_t group = 0, capacity = 0;
    plane_of_group plane;
    double centre[3], radius, share;
    TRY(find_group(r, area, &group, error));
    mesh_bounds(m, centre, &radius);
    if (!main_plane(m, group, up, same_plane * radius, &plane, &share))
        FAIL(error, LAM_ERR_ARGUMENT, "%s: over = %.64s, a group without faces", area->place, area->group);
    if (share < .99)
        luminaire_warnings_add(&r->out->warnings,
                               "%s lies over the largest plane of %.64s, which has %.0f %% of its area",
                               area->place, area->group, 100 * share);
    memcpy(a->normal, plane.normal, sizeof a->normal);
    a->offset = plane.offset;
    plane_axes(a->normal, a->u, a->w);
    for (size_t j = 0; j < m->n - m->n_backs; j++) {
        if (m->group[j] != group || !is_in_plane(m, j, &plane, same_plane * radius)) continue;
        TRY(array_grow(&a->start, &capacity, a->n + 2, sizeof *a->start, r->name, error));
        a->start[a->n++] = a->n_corners;
        for (size_t c = 0; c < mesh_corners(m, j); c++)
            TRY(add_corner(a, m->vertices[m->elements[j][c]], r->name, error));
        a->start[a->n] = a->n_corners;
    }
done:
    return status;
}

static lam_status take_polygon(const sensors_reading *r, const sensors_area *area, plane_area *a,
                               lam_error *error) {
    lam_status status = LAM_OK;
    double twice[3] = {0}, extent = 0, farthest = 0;
    for (size_t c = 1; c + 1 < area->n_corners; c++) {
        double one[3], other[3], cross[3];
        subtract3(area->corner[c], area->corner[0], one);
        subtract3(area->corner[c + 1], area->corner[0], other);
        cross3(one, other, cross);
        extent = fmax(extent, sqrt(fmax(dot3(one, one), dot3(other, other))));
        for (int d = 0; d < 3; d++) twice[d] += cross[d];
    }
    if (!(sqrt(dot3(twice, twice)) > 1e-9 * extent * extent) || !list_normalize(twice))
        FAIL(error, LAM_ERR_ARGUMENT, "%s: polygon has no area", area->place);
    memcpy(a->normal, twice, sizeof twice);
    a->offset = dot3(area->corner[0], a->normal);
    for (size_t c = 0; c < area->n_corners; c++)
        farthest = fmax(farthest, fabs(dot3(area->corner[c], a->normal) - a->offset));
    if (farthest > 1e-3 * extent)
        FAIL(error, LAM_ERR_ARGUMENT, "%s: polygon has a corner %.3g m off its plane, must be at most %.3g m",
             area->place, farthest, 1e-3 * extent);
    plane_axes(a->normal, a->u, a->w);
    a->start = memory_allocate(2, sizeof *a->start, r->name, error);
    if (a->start == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t c = 0; c < area->n_corners; c++) TRY(add_corner(a, area->corner[c], r->name, error));
    a->start[1] = a->n_corners;
    a->n = 1;
done:
    return status;
}

static int by_place(const void *a, const void *b) {
    const double *p = a, *q = b;
    if (p[0] != q[0]) return p[0] < q[0] ? -1 : 1;
    return (p[1] > q[1]) - (p[1] < q[1]);
}

/* The convex hull of sorted points, in place of the first of them (Andrew's monotone chain 1979); hull: room
 * for 2 n. Its corners. */
static size_t find_hull(const double (*sorted)[2], size_t n, double (*hull)[2]) {
    size_t count = 0;
    for (int side = 0; side < 2; side++) {
        const size_t least = count + 1;
        for (size_t k = 0; k < n; k++) {
            const double *next = sorted[side == 0 ? k : n - 1 - k];
            while (count > least && plane_turn(hull[count - 2], hull[count - 1], next) <= 0) count--;
            memcpy(hull[count++], next, sizeof *hull);
        }
        count--; /* the first of the other side */
    }
    return count;
}

/* Turns u and w along the sides of the rectangle of least area about all corners; of equal ones that along u
 * as it is. The first axis is the longer. */
static lam_status turn_axes(plane_area *a, const char *name, lam_error *error) {
    static const double clearly = 1 - 1e-6;
    lam_status status = LAM_OK;
    double along[2] = {1, 0}, least = INFINITY, longer = 0, shorter = 0;
    double(*sorted)[2] = memory_allocate(a->n_corners, sizeof *sorted, name, error);
    double(*hull)[2] = memory_allocate(2 * a->n_corners + 2, sizeof *hull, name, error);
    if (sorted == NULL || hull == NULL) TRY(LAM_ERR_MEMORY);
    memcpy(sorted, a->corner, a->n_corners * sizeof *sorted);
    qsort(sorted, a->n_corners, sizeof *sorted, by_place);
    const size_t n = find_hull((const double(*)[2])sorted, a->n_corners, hull);
    for (size_t k = 0; k <= n; k++) {
        double way[2] = {1, 0}, low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
        if (k > 0) {
            const double *from = hull[k - 1], *to = hull[k % n];
            const double length = plane_distance(from, to);
            if (!(length > 0)) continue;
            for (int d = 0; d < 2; d++) way[d] = (to[d] - from[d]) / length;
        }
        for (size_t c = 0; c < n; c++) {
            const double at[2] = {hull[c][0] * way[0] + hull[c][1] * way[1],
                                  hull[c][1] * way[0] - hull[c][0] * way[1]};
            for (int d = 0; d < 2; d++) {
                low[d] = fmin(low[d], at[d]);
                high[d] = fmax(high[d], at[d]);
            }
        }
        const double size[2] = {high[0] - low[0], high[1] - low[1]};
        if (!(size[0] * size[1] < clearly * least)) continue;
        least = size[0] * size[1];
        longer = size[0];
        shorter = size[1];
        memcpy(along, way, sizeof along);
    }
    if (longer < shorter * clearly) {
        const double turned[2] = {-along[1], along[0]};
        memcpy(along, turned, sizeof along);
    }
    double u[3];
    int axis = 0;
    for (int d = 0; d < 3; d++) u[d] = along[0] * a->u[d] + along[1] * a->w[d];
    for (int d = 1; d < 3; d++)
        if (fabs(u[d]) > fabs(u[axis]) + 1e-9) axis = d;
    const double sign = u[axis] < 0 ? -1 : 1; /* along an axis of the scene, not against it */
    for (size_t c = 0; c < a->n_corners; c++) {
        const double x = a->corner[c][0], y = a->corner[c][1];
        a->corner[c][0] = sign * (x * along[0] + y * along[1]);
        a->corner[c][1] = sign * (y * along[0] - x * along[1]);
    }
    for (int d = 0; d < 3; d++) a->u[d] = sign * u[d];
    cross3(a->normal, a->u, a->w);
done:
    free(sorted);
    free(hull);
    return status;
}

static size_t bin_of(const plane_area *a, int d, double x) {
    const double k = floor((x - a->low[d]) / a->size[d] * (double)a->bins[d]);
    return k <= 0 ? 0 : k >= (double)a->bins[d] ? a->bins[d] - 1 : (size_t)k;
}

/* The bins that a ring covers, from and to. */
static void bins_of_ring(const plane_area *a, size_t ring, size_t from[2], size_t to[2]) {
    for (int d = 0; d < 2; d++) {
        double low = INFINITY, high = -INFINITY;
        for (size_t c = a->start[ring]; c < a->start[ring + 1]; c++) {
            low = fmin(low, a->corner[c][d]);
            high = fmax(high, a->corner[c][d]);
        }
        from[d] = bin_of(a, d, low - a->slack);
        to[d] = bin_of(a, d, high + a->slack);
    }
}

/* Puts the rings into bins, some of them per ring. */
static lam_status make_bins(plane_area *a, const char *name, lam_error *error) {
    lam_status status = LAM_OK;
    double high[2] = {-INFINITY, -INFINITY};
    for (int d = 0; d < 2; d++) a->low[d] = INFINITY;
    for (size_t c = 0; c < a->n_corners; c++)
        for (int d = 0; d < 2; d++) {
            a->low[d] = fmin(a->low[d], a->corner[c][d]);
            high[d] = fmax(high[d], a->corner[c][d]);
        }
    for (int d = 0; d < 2; d++) {
        a->size[d] = high[d] - a->low[d];
        a->bins[d] = (size_t)fmin(ceil(sqrt((double)a->n)), 1024);
    }
    a->slack = 1e-7 * fmax(a->size[0], a->size[1]);
    const size_t n_bins = a->bins[0] * a->bins[1];
    a->bin = memory_allocate(n_bins + 1, sizeof *a->bin, name, error);
    if (a->bin == NULL) TRY(LAM_ERR_MEMORY);
    for (int pass = 0; pass < 2; pass++) {
        for (size_t k = 0; k < a->n; k++) {
            size_t from[2], to[2];
            bins_of_ring(a, k, from, to);
            for (size_t y = from[1]; y <= to[1]; y++)
                for (size_t x = from[0]; x <= to[0]; x++) {
                    size_t *bin = &a->bin[y * a->bins[0] + x];
                    if (pass == 0)
                        ++*bin;
                    else
                        a->ring[--*bin] = (uint32_t)k;
                }
        }
        if (pass == 1) break;
        for (size_t b = 1; b <= n_bins; b++) a->bin[b] += a->bin[b - 1];
        a->ring = memory_allocate(a->bin[n_bins], sizeof *a->ring, name, error);
        if (a->ring == NULL) TRY(LAM_ERR_MEMORY);
    }
done:
    return status;
}

/* True within a ring or on its rim: left of all edges of a convex one, else by the number of edges that are
 * crossed on the way to the right. */
static bool is_in_ring(const plane_area *a, size_t ring, const double at[2]) {
    const size_t first = a->start[ring], n = a->start[ring + 1] - first;
    bool inside = false, left = true;
    for (size_t c = 0; c < n; c++) {
        const double *from = a->corner[first + c], *to = a->corner[first + (c + 1) % n];
        left = left && plane_turn(from, to, at) >= -a->slack * plane_distance(from, to);
        if ((from[1] > at[1]) != (to[1] > at[1]) &&
            at[0] < from[0] + (at[1] - from[1]) / (to[1] - from[1]) * (to[0] - from[0]))
            inside = !inside;
    }
    return a->n > 1 ? left : inside;
}

static bool is_in_area(const plane_area *a, const double at[2]) {
    for (int d = 0; d < 2; d++)
        if (!(at[d] >= a->low[d] - a->slack && at[d] <= a->low[d] + a->size[d] + a->slack)) return false;
    const size_t bin = bin_of(a, 1, at[1]) * a->bins[0] + bin_of(a, 0, at[0]);
    for (size_t k = a->bin[bin]; k < a->bin[bin + 1]; k++)
        if (is_in_ring(a, a->ring[k], at)) return true;
    return false;
}

/* True where a point lies in the area and all about it at the distance of the border does. */
static bool is_off_rim(const plane_area *a, const double at[2], double border) {
    enum { AROUND = 16 };
    if (!is_in_area(a, at)) return false;
    for (int k = 0; k < AROUND && border > 0; k++) {
        const double turn = 2 * M_PI * k / AROUND, reach = border * (1 - 1e-6);
        const double there[2] = {at[0] + reach * cos(turn), at[1] + reach * sin(turn)};
        if (!is_in_area(a, there)) return false;
    }
    return true;
}

/* The cells along one side. */
static lam_status count_cells(const sensors_area *area, double side, double spacing, size_t *out,
                              lam_error *error) {
    const double count = fmax(ceil(side / spacing - 1e-9), 1);
    if (!(count <= SENSORS_MOST))
        return status_fail(error, LAM_ERR_ARGUMENT,
                           "%s: spacing = %.4g m over %.4g m makes %.0f columns, must be at most %d",
                           area->place, spacing, side, count, SENSORS_MOST);
    *out = (size_t)count;
    return LAM_OK;
}

/* Lays the cells over the rectangle, less its border. */
static lam_status lay_cells(const sensors_reading *r, const sensors_area *area, const plane_area *a,
                            const double up[3], sensors_cells *out, lam_error *error) {
    lam_status status = LAM_OK;
    double side[2], raised[3];
    size_t all;
    const double level = dot3(a->normal, up);
    const bool flat = fabs(level) > lies_flat;
    for (int d = 0; d < 3; d++) out->normal[d] = flat ? up[d] : a->normal[d];
    for (int d = 0; d < 2; d++) side[d] = a->size[d] - 2 * area->border;
    if (!(side[0] > 0 && side[1] > 0))
        FAIL(error, LAM_ERR_ARGUMENT, "%s: border = %.4g m leaves nothing of %.4g by %.4g m", area->place,
             area->border, a->size[0], a->size[1]);
    const double spacing =
        area->spacing > 0 ? area->spacing : sensors_en12464(fmax(side[0], side[1]), fmin(side[0], side[1]));
    TRY(count_cells(area, side[0], spacing, &out->columns, error));
    TRY(count_cells(area, side[1], spacing, &out->rows, error));
    all = out->rows * out->columns; /* below 2^40 */
    if (all > SENSORS_MOST)
        FAIL(error, LAM_ERR_ARGUMENT, "%s: %zu rows of %zu cells, must be at most %d cells", area->place,
             out->rows, out->columns, SENSORS_MOST);
    out->spacing[0] = side[0] / (double)out->columns;
    out->spacing[1] = side[1] / (double)out->rows;
    out->at = memory_allocate(all, sizeof *out->at, r->name, error);
    out->cell = memory_allocate(all, sizeof *out->cell, r->name, error);
    if (out->at == NULL || out->cell == NULL) TRY(LAM_ERR_MEMORY);
    for (int d = 0; d < 3; d++) raised[d] = a->offset * a->normal[d] + area->height * out->normal[d];
    for (size_t k = 0; k < all; k++) {
        const double at[2] = {a->low[0] + area->border + ((double)(k % out->columns) + .5) * out->spacing[0],
                              a->low[1] + area->border + ((double)(k / out->columns) + .5) * out->spacing[1]};
        if (!is_off_rim(a, at, area->border)) continue;
        for (int d = 0; d < 3; d++) out->at[out->n][d] = raised[d] + at[0] * a->u[d] + at[1] * a->w[d];
        out->cell[out->n++] = (uint32_t)k;
    }
    if (out->n == 0)
        FAIL(error, LAM_ERR_ARGUMENT, "%s: no middle of %zu by %zu cells lies in it: take a smaller spacing",
             area->place, out->rows, out->columns);
done:
    return status;
}

lam_status sensors_cells_find(sensors_reading *r, const sensors_area *area, sensors_cells *out,
                              lam_error *error) {
    lam_status status = LAM_OK;
    plane_area a = {.n = 0};
    double up[3];
    sensors_up(r->up, up);
    if (area->group != NULL)
        TRY(take_group(r, area, up, &a, error));
    else
        TRY(take_polygon(r, area, &a, error));
    TRY(turn_axes(&a, r->name, error));
    TRY(make_bins(&a, r->name, error));
    if (!(a.size[0] > 0 && a.size[1] > 0)) FAIL(error, LAM_ERR_ARGUMENT, "%s: it has no area", area->place);
    TRY(lay_cells(r, area, &a, up, out, error));
done:
    area_free(&a);
    return status;
}
