/* A wall is the segment in which an element that rises above the plane meets normal . x = level. Segments
 * whose angles differ by at most same_direction get their mean angle, weighted by length, and those whose
 * offsets differ by at most 4 same are one line, across . x = offset, whose overlapping parts are joined. */
#include "solver/operator/blocks/plane_walls.h"

#include "solver/base/array_grow.h"
#include "solver/base/vector3.h"
#include "store/status.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Directions that differ by less are one, in radians. */
static const double same_direction = 2e-3;
/* Planes that share a box; planes stand in tree order, so that neighbours lie together. */
enum { PLANES_OF_BOX = 32 };

typedef struct box {
    double low[3], high[3];
} box;

/* A segment before it is joined with others. */
typedef struct segment {
    double angle, along[2][2];
} segment;

struct wall_finder {
    const plane_tree *tree;
    const uint32_t *begins;
    const element_corners *corners;
    double same;
    box *planes, *groups; /* [n_frames], and for PLANES_OF_BOX of them each */
    segment *segments;
    size_t n_segments, segments_room;
    plane_wall *walls;
    size_t n_walls, walls_room;
};

static size_t corner_number(const uint32_t element[4]) {
    return element[3] == UINT32_MAX ? 3 : 4;
}

static void box_add(box *b, const double low[3], const double high[3]) {
    for (int d = 0; d < 3; d++) {
        b->low[d] = fmin(b->low[d], low[d]);
        b->high[d] = fmax(b->high[d], high[d]);
    }
}

static const box nothing = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};

static size_t box_number(const wall_finder *f) {
    return (f->tree->n_frames + PLANES_OF_BOX - 1) / PLANES_OF_BOX;
}

lam_status wall_finder_create(const plane_tree *tree, const uint32_t *begins, const element_corners *corners,
                              double same, wall_finder **out, lam_error *error) {
    lam_status status = LAM_OK;
    wall_finder *f = memory_allocate(1, sizeof *f, "clusters", error);
    if (f == NULL) return LAM_ERR_MEMORY;
    *f = (wall_finder){.tree = tree, .begins = begins, .corners = corners, .same = same};
    f->planes = memory_allocate(tree->n_frames, sizeof *f->planes, "clusters", error);
    f->groups = memory_allocate(box_number(f), sizeof *f->groups, "clusters", error);
    if (f->planes == NULL || f->groups == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t g = 0; g < tree->n_frames; g++) {
        box *group = &f->groups[g / PLANES_OF_BOX];
        f->planes[g] = nothing;
        for (size_t p = begins[g]; p < begins[g + 1]; p++) {
            const uint32_t *element = corners->elements[tree->order[p]];
            for (size_t c = 0; c < corner_number(element); c++)
                box_add(&f->planes[g], corners->vertices[element[c]], corners->vertices[element[c]]);
        }
        if (g % PLANES_OF_BOX == 0) *group = nothing;
        box_add(group, f->planes[g].low, f->planes[g].high);
    }
    *out = f;
    f = NULL;
done:
    wall_finder_destroy(f);
    return status;
}

void wall_finder_destroy(wall_finder *f) {
    if (f == NULL) return;
    free(f->planes);
    free(f->groups);
    free(f->segments);
    free(f->walls);
    free(f);
}

/* A plane in space: normal . x = level. */
typedef struct plane_in_space {
    const plane_frame *frame;
    double normal[3], level;
    box around; /* its corners */
    plane_extent extent;
} plane_in_space;

static void coordinates(const plane_frame *f, const double *point, double at[2]) {
    double offset[3];
    subtract3(point, f->origin, offset);
    for (int axis = 0; axis < 2; axis++) at[axis] = dot3(f->axis[axis], offset);
}

static plane_in_space plane_at(const wall_finder *f, size_t plane) {
    plane_in_space out = {.frame = &f->tree->frames[plane],
                          .around = f->planes[plane],
                          .extent = {{INFINITY, INFINITY}, {-INFINITY, -INFINITY}}};
    cross3(out.frame->axis[0], out.frame->axis[1], out.normal);
    out.level = dot3(out.normal, out.frame->origin);
    for (size_t p = f->begins[plane]; p < f->begins[plane + 1]; p++) {
        const uint32_t *element = f->corners->elements[f->tree->order[p]];
        for (size_t c = 0; c < corner_number(element); c++) {
            double at[2];
            coordinates(out.frame, f->corners->vertices[element[c]], at);
            for (int axis = 0; axis < 2; axis++) {
                out.extent.low[axis] = fmin(out.extent.low[axis], at[axis]);
                out.extent.high[axis] = fmax(out.extent.high[axis], at[axis]);
            }
        }
    }
    return out;
}

/* True where a box may hold a wall: it reaches the plane and its front within its box. */
static bool may_stand_on(const box *b, const plane_in_space *plane, double same) {
    double low = -plane->level, high = -plane->level;
    for (int d = 0; d < 3; d++) {
        if (b->low[d] > plane->around.high[d] + same || b->high[d] < plane->around.low[d] - same)
            return false;
        const double one = plane->normal[d] * b->low[d], other = plane->normal[d] * b->high[d];
        low += fmin(one, other);
        high += fmax(one, other);
    }
    return low <= same && high > same;
}

/* True where the line in which another plane meets this one runs through the rectangle, not along its border:
 * at coordinates (u, v) with a u + b v = c. Of a town's ground, which all houses stand on, no element is then
 * looked at for the walls of a house. */
static bool line_crosses(const plane_in_space *plane, const plane_frame *other, double same) {
    double normal[3], between[3], low = 0, high = 0;
    cross3(other->axis[0], other->axis[1], normal);
    subtract3(other->origin, plane->frame->origin, between);
    const double a = dot3(normal, plane->frame->axis[0]), b = dot3(normal, plane->frame->axis[1]);
    const double c = dot3(normal, between), length = hypot(a, b);
    if (length < same_direction) return true; /* nearly parallel: there is no one line */
    for (int corner = 0; corner < 4; corner++) {
        const double u = corner & 1 ? plane->extent.high[0] : plane->extent.low[0];
        const double v = corner & 2 ? plane->extent.high[1] : plane->extent.low[1];
        const double distance = (a * u + b * v - c) / length;
        low = corner == 0 ? distance : fmin(low, distance);
        high = corner == 0 ? distance : fmax(high, distance);
    }
    return low < -same && high > same;
}

/* Points where the outline of an element meets the plane, at most two for each of its edges; 0 where it has
 * nothing in front. */
static size_t points_on(const wall_finder *f, const uint32_t *element, const plane_in_space *plane,
                        double points[8][3]) {
    const size_t corners = corner_number(element);
    double height[4], most = -INFINITY;
    size_t count = 0;
    for (size_t c = 0; c < corners; c++) {
        height[c] = dot3(plane->normal, f->corners->vertices[element[c]]) - plane->level;
        most = fmax(most, height[c]);
    }
    if (!(most > f->same)) return 0;
    for (size_t c = 0; c < corners; c++) {
        const size_t next = (c + 1) % corners;
        const double *from = f->corners->vertices[element[c]], *to = f->corners->vertices[element[next]];
        if (fabs(height[c]) <= f->same) {
            memcpy(points[count++], from, sizeof points[0]);
        } else if (fabs(height[next]) > f->same && (height[c] > 0) != (height[next] > 0)) {
            const double part = height[c] / (height[c] - height[next]);
            for (int d = 0; d < 3; d++) points[count][d] = from[d] + part * (to[d] - from[d]);
            count++;
        }
    }
    return count;
}

/* True where both ends lie on one border of the rectangle or beyond it, where they part nothing. */
static bool is_border(const segment *s, const plane_extent *e, double same) {
    for (int axis = 0; axis < 2; axis++) {
        const double low = fmin(s->along[0][axis], s->along[1][axis]);
        const double high = fmax(s->along[0][axis], s->along[1][axis]);
        if (high <= e->low[axis] + same || low >= e->high[axis] - same) return true;
    }
    return false;
}

static lam_status add_segment(wall_finder *f, const uint32_t *element, const plane_in_space *plane,
                              lam_error *error) {
    double points[8][3], longest = 0;
    segment made = {.angle = 0};
    const size_t count = points_on(f, element, plane, points);
    for (size_t i = 0; i < count; i++)
        for (size_t j = 0; j < i; j++) {
            double between[3];
            subtract3(points[i], points[j], between);
            const double length = sqrt(dot3(between, between));
            if (length <= longest) continue;
            longest = length;
            coordinates(plane->frame, points[i], made.along[0]);
            coordinates(plane->frame, points[j], made.along[1]);
        }
    if (longest <= f->same || is_border(&made, &plane->extent, f->same)) return LAM_OK;
    /* From -pi/4 on, so that directions along the axes lie far from where angles wrap. */
    made.angle = atan2(made.along[1][1] - made.along[0][1], made.along[1][0] - made.along[0][0]);
    while (made.angle < -.25 * M_PI) made.angle += M_PI;
    while (made.angle >= .75 * M_PI) made.angle -= M_PI;
    if (array_grow(&f->segments, &f->segments_room, f->n_segments + 1, sizeof *f->segments, "clusters",
                   error) != LAM_OK)
        return LAM_ERR_MEMORY;
    f->segments[f->n_segments++] = made;
    return LAM_OK;
}

static int by_angle(const void *left, const void *right) {
    const segment *a = left, *b = right;
    if (a->angle != b->angle) return a->angle < b->angle ? -1 : 1;
    for (int k = 0; k < 4; k++) {
        const double x = a->along[k / 2][k % 2], y = b->along[k / 2][k % 2];
        if (x != y) return x < y ? -1 : 1;
    }
    return 0;
}

static int by_offset(const void *left, const void *right) {
    const plane_wall *a = left, *b = right;
    if (a->offset != b->offset) return a->offset < b->offset ? -1 : 1;
    if (a->begin != b->begin) return a->begin < b->begin ? -1 : 1;
    return (a->end > b->end) - (a->end < b->end);
}

static int by_line(const void *left, const void *right) {
    const plane_wall *a = left, *b = right;
    if (a->line != b->line) return a->line < b->line ? -1 : 1;
    return (a->begin > b->begin) - (a->begin < b->begin);
}

/* Joins segments [first, last) of one direction, sorted by offset where they end, into lines. */
static void join_direction(wall_finder *f, size_t first, size_t last, uint32_t *line) {
    double sum = 0, weight = 0;
    for (size_t s = first; s < last; s++) {
        const double *a = f->segments[s].along[0], *b = f->segments[s].along[1];
        const double length = hypot(b[0] - a[0], b[1] - a[1]);
        sum += length * f->segments[s].angle;
        weight += length;
    }
    const double along[2] = {cos(sum / weight), sin(sum / weight)}, across[2] = {along[1], -along[0]};
    plane_wall *walls = f->walls + f->n_walls;
    for (size_t s = first; s < last; s++) {
        const double *a = f->segments[s].along[0], *b = f->segments[s].along[1];
        const double from = along[0] * a[0] + along[1] * a[1], to = along[0] * b[0] + along[1] * b[1];
        walls[s - first] = (plane_wall){
            .across = {across[0], across[1]},
            .offset = .5 * (across[0] * (a[0] + b[0]) + across[1] * (a[1] + b[1])),
            .begin = fmin(from, to),
            .end = fmax(from, to),
        };
    }
    const size_t count = last - first;
    qsort(walls, count, sizeof *walls, by_offset);
    for (size_t k = 0, start = 0; k < count; k++) {
        if (k > 0 && walls[k].offset - walls[start].offset > 4 * f->same) {
            start = k;
            ++*line;
        }
        walls[k].offset = walls[start].offset;
        walls[k].line = *line;
    }
    ++*line;
    qsort(walls, count, sizeof *walls, by_line);
    size_t kept = 0;
    for (size_t k = 0; k < count; k++) {
        plane_wall *before = &walls[kept > 0 ? kept - 1 : 0];
        if (kept > 0 && before->line == walls[k].line && walls[k].begin <= before->end + f->same) {
            before->end = fmax(before->end, walls[k].end);
        } else {
            walls[kept++] = walls[k];
        }
    }
    f->n_walls += kept;
}

lam_status wall_finder_find(wall_finder *f, size_t plane, plane_wall **walls, size_t *count,
                            lam_error *error) {
    lam_status status = LAM_OK;
    const plane_tree *tree = f->tree;
    const plane_in_space here = plane_at(f, plane);
    uint32_t line = 0;
    f->n_segments = f->n_walls = 0;
    for (size_t g = 0; g < box_number(f); g++) {
        if (!may_stand_on(&f->groups[g], &here, f->same)) continue;
        for (size_t q = g * PLANES_OF_BOX; q < (g + 1) * PLANES_OF_BOX && q < tree->n_frames; q++) {
            if (q == plane || !may_stand_on(&f->planes[q], &here, f->same)) continue;
            if (!line_crosses(&here, &tree->frames[q], f->same)) continue;
            for (size_t p = f->begins[q]; p < f->begins[q + 1]; p++)
                TRY(add_segment(f, f->corners->elements[tree->order[p]], &here, error));
        }
    }
    if (f->n_segments > 0) qsort(f->segments, f->n_segments, sizeof *f->segments, by_angle);
    TRY(array_grow(&f->walls, &f->walls_room, f->n_segments + 1, sizeof *f->walls, "clusters", error));
    for (size_t first = 0, last; first < f->n_segments; first = last) {
        for (last = first + 1; last < f->n_segments; last++)
            if (f->segments[last].angle - f->segments[first].angle > same_direction) break;
        join_direction(f, first, last, &line);
    }
    *walls = f->walls;
    *count = f->n_walls;
done:
    return status;
}

bool plane_wall_chord(const plane_wall *wall, const plane_extent *within, double *begin, double *end) {
    const double along[2] = {-wall->across[1], wall->across[0]};
    double from = -INFINITY, to = INFINITY;
    for (int axis = 0; axis < 2; axis++) {
        const double at = wall->offset * wall->across[axis], step = along[axis];
        if (fabs(step) < 1e-12) {
            if (at < within->low[axis] || at > within->high[axis]) return false;
            continue;
        }
        const double one = (within->low[axis] - at) / step, other = (within->high[axis] - at) / step;
        from = fmax(from, fmin(one, other));
        to = fmin(to, fmax(one, other));
    }
    *begin = from;
    *end = to;
    return from < to;
}

size_t plane_walls_within(plane_wall *walls, size_t count, const plane_extent *within) {
    size_t kept = 0;
    for (size_t k = 0; k < count; k++) {
        double begin, end;
        if (!plane_wall_chord(&walls[k], within, &begin, &end)) continue;
        if (walls[k].begin >= end || walls[k].end <= begin) continue;
        const plane_wall swapped = walls[kept];
        walls[kept++] = walls[k];
        walls[k] = swapped;
    }
    if (kept > 0) qsort(walls, kept, sizeof *walls, by_line);
    return kept;
}
