/* The cluster tree is built in four steps: elements are sorted into planes by normal and offset; a plane is
 * parted at the wall of the largest (covered share of its line) sqrt(elements of the smaller side / all); the
 * parts are halved along their longer side to leaves; planes are joined in the order of plane_order.h. */
#include "solver/operator/blocks/plane_tree.h"

#include "solver/base/array_sort.h"
#include "solver/base/union_find.h"
#include "solver/base/vector3.h"
#include "solver/operator/blocks/plane_order.h"
#include "solver/operator/blocks/plane_walls.h"
#include "store/status.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Elements of one plane: normals differ by at most this in each coordinate, offsets by this share of the
 * extent of the scene. */
static const double same_normal = 2e-3, same_plane = 1e-4;
/* A gap counts as wide if it is at least this share of the widest one near the middle of a cluster. */
static const double wide_gap = .6;
/* A wall parts a cluster where it covers at least this share of its line within the cluster, and leaves at
 * least this share of the elements on either side. */
static const double least_wall = .25, least_side = 1. / 32;

/* Planes of fewer elements are not parted by walls: their clusters are small. */
enum { PARTED_LEAST = 24 };

typedef struct key {
    double value;
    uint32_t element;
} key;

typedef struct maker {
    const double (*centre)[3];
    const float (*normal)[3];
    const uint32_t *part; /* [n], or NULL */
    size_t leaf_most;
    double extent;
    key *keys;           /* [n] */
    uint32_t *group_end; /* [n_groups], where in the order groups end */
    size_t n_groups;
    plane_tree *tree;
    plane_wall *walls; /* on the plane that is parted */
} maker;

void plane_tree_free(plane_tree *tree) {
    free(tree->order);
    free(tree->clusters);
    free(tree->frames);
    *tree = (plane_tree){.n = 0};
}

static int by_value(const void *left, const void *right) {
    const key *a = left, *b = right;
    if (a->value != b->value) return a->value < b->value ? -1 : 1;
    return a->element < b->element ? -1 : a->element > b->element;
}

static void sort_by_keys(maker *k, size_t begin, size_t end) {
    array_sort(k->keys + begin, end - begin, sizeof *k->keys, by_value);
    for (size_t p = begin; p < end; p++) k->tree->order[p] = k->keys[p].element;
}

static void mean_normal(const maker *k, size_t begin, size_t end, double mean[3]) {
    mean[0] = mean[1] = mean[2] = 0;
    for (size_t p = begin; p < end; p++)
        for (int d = 0; d < 3; d++) mean[d] += (double)k->normal[k->tree->order[p]][d];
    const double length = sqrt(dot3(mean, mean));
    for (int d = 0; d < 3; d++) mean[d] = length > 0 ? mean[d] / length : d == 2;
}

/* True where all normals differ from their mean by at most this in each coordinate. */
static bool are_alike(const maker *k, size_t begin, size_t end, double most) {
    double mean[3];
    mean_normal(k, begin, end, mean);
    for (size_t p = begin; p < end; p++)
        for (int d = 0; d < 3; d++)
            if (fabs((double)k->normal[k->tree->order[p]][d] - mean[d]) > most) return false;
    return true;
}

/* False for elements whose normals drift in small steps, as those of a sphere do. */
static bool is_plane(const maker *k, size_t begin, size_t end) {
    double mean[3], low = INFINITY, high = -INFINITY;
    if (!are_alike(k, begin, end, 2 * same_normal)) return false;
    mean_normal(k, begin, end, mean);
    for (size_t p = begin; p < end; p++) {
        const double at = dot3(mean, k->centre[k->tree->order[p]]);
        low = fmin(low, at);
        high = fmax(high, at);
    }
    return high - low <= 4 * same_plane * k->extent;
}

enum { PLANE_KEYS = 4 };
/* Where normals of many directions make one chain of small steps, ever smaller steps are taken, each this
 * share of the one before, down to this: then elements of one plane, which differ by rounding alone, are
 * still found. */
static const double finer_step = .25, finest_step = 1e-3;

/* Splits a range into planes: sorted by the three coordinates of the normal in turn, then by the offset, it
 * is cut wherever the key jumps by more than `step` of what may differ. Unlike normals are taken apart by
 * finer steps first: offsets along the mean of them say nothing of planes. */
static void split_planes(maker *k, size_t begin, size_t end, int level, double step) {
    const bool unlike = level == 3 && !are_alike(k, begin, end, 2 * step * same_normal);
    if (level == PLANE_KEYS && is_plane(k, begin, end)) {
        k->group_end[k->n_groups++] = (uint32_t)end;
        return;
    }
    if (level == PLANE_KEYS || unlike) {
        if (step > finest_step) {
            split_planes(k, begin, end, 0, finer_step * step);
        } else {
            for (size_t p = begin; p < end; p++) k->group_end[k->n_groups++] = (uint32_t)(p + 1);
        }
        return;
    }
    double mean[3];
    if (level == 3) mean_normal(k, begin, end, mean);
    for (size_t p = begin; p < end; p++) {
        const uint32_t i = k->tree->order[p];
        k->keys[p] = (key){level < 3 ? (double)k->normal[i][level] : dot3(mean, k->centre[i]), i};
    }
    sort_by_keys(k, begin, end);
    const double leap = step * (level < 3 ? same_normal : same_plane * k->extent);
    /* The recursion overwrites keys [first, last), which are not read again. */
    for (size_t first = begin; first < end;) {
        size_t last = first + 1;
        while (last < end && k->keys[last].value - k->keys[last - 1].value <= leap) last++;
        split_planes(k, first, last, level + 1, step);
        first = last;
    }
}

/* Splits planes by the parts of the scene that their elements belong to. */
static lam_status split_by_parts(maker *k, lam_error *error) {
    const size_t n_planes = k->n_groups;
    uint32_t *plane_end = memory_allocate(n_planes, sizeof *plane_end, "clusters", error);
    if (plane_end == NULL) return LAM_ERR_MEMORY;
    memcpy(plane_end, k->group_end, n_planes * sizeof *plane_end);
    k->n_groups = 0;
    for (size_t g = 0, begin = 0; g < n_planes; begin = plane_end[g++]) {
        const size_t end = plane_end[g];
        for (size_t p = begin; p < end; p++) {
            const uint32_t i = k->tree->order[p];
            k->keys[p] = (key){(double)k->part[i], i};
        }
        sort_by_keys(k, begin, end);
        for (size_t p = begin + 1; p <= end; p++)
            if (p == end || k->part[k->tree->order[p]] != k->part[k->tree->order[p - 1]])
                k->group_end[k->n_groups++] = (uint32_t)p;
    }
    free(plane_end);
    return LAM_OK;
}

static uint32_t add_cluster(maker *k, plane_cluster made) {
    const size_t at = k->tree->n_clusters++;
    k->tree->clusters[at] = made;
    return (uint32_t)at;
}

/* The cut of a range sorted by value: the wide gap nearest to its middle. */
static size_t cut_of(const key *keys, size_t begin, size_t end) {
    const size_t count = end - begin, middle = begin + count / 2, slack = count / 4;
    double widest = 0;
    size_t best = middle;
    for (size_t p = middle - slack; p <= middle + slack; p++)
        if (p > begin && p < end) widest = fmax(widest, keys[p].value - keys[p - 1].value);
    for (size_t step = 0; step <= slack; step++)
        for (int side = 0; side < 2; side++) {
            best = side == 0 ? middle - step : middle + step;
            if (best <= begin || best >= end) continue;
            if (keys[best].value - keys[best - 1].value >= wide_gap * widest) return best;
        }
    return middle;
}

static double on_axis(const maker *k, const plane_frame *f, int axis, uint32_t i) {
    const double offset[3] = {k->centre[i][0] - f->origin[0], k->centre[i][1] - f->origin[1],
                              k->centre[i][2] - f->origin[2]};
    return dot3(f->axis[axis], offset);
}

static void sort_on_axis(maker *k, const plane_frame *f, int axis, size_t begin, size_t end) {
    for (size_t p = begin; p < end; p++) {
        const uint32_t i = k->tree->order[p];
        k->keys[p] = (key){on_axis(k, f, axis, i), i};
    }
    sort_by_keys(k, begin, end);
}

static plane_extent extent_of(const maker *k, const plane_frame *f, size_t begin, size_t end) {
    plane_extent e = {{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
    for (size_t p = begin; p < end; p++)
        for (int axis = 0; axis < 2; axis++) {
            const double at = on_axis(k, f, axis, k->tree->order[p]);
            e.low[axis] = fmin(e.low[axis], at);
            e.high[axis] = fmax(e.high[axis], at);
        }
    return e;
}

/* Sorts the elements of a leaf row by row with a tolerance, so that congruent leaves get the same matrix in
 * spite of rounding. */
static void sort_leaf(maker *k, const plane_frame *f, size_t begin, size_t end) {
    uint32_t *order = k->tree->order;
    const double same = 1e-7 * k->extent;
    for (size_t p = begin + 1; p < end; p++)
        for (size_t q = p; q > begin; q--) {
            const double rows = on_axis(k, f, 1, order[q]) - on_axis(k, f, 1, order[q - 1]);
            const double along = on_axis(k, f, 0, order[q]) - on_axis(k, f, 0, order[q - 1]);
            if (rows > same || (rows >= -same && along >= 0)) break;
            const uint32_t swapped = order[q];
            order[q] = order[q - 1];
            order[q - 1] = swapped;
        }
}

static double beyond(const maker *k, const plane_frame *f, const plane_wall *wall, uint32_t i) {
    return wall->across[0] * on_axis(k, f, 0, i) + wall->across[1] * on_axis(k, f, 1, i) - wall->offset;
}

/* Sorts a range of elements by their distance from a wall; returns the first one beyond it. */
static size_t sort_by_wall(maker *k, const plane_frame *f, const plane_wall *wall, size_t begin, size_t end) {
    size_t cut = begin;
    for (size_t p = begin; p < end; p++) {
        const uint32_t i = k->tree->order[p];
        k->keys[p] = (key){beyond(k, f, wall, i), i};
        cut += k->keys[p].value < 0;
    }
    sort_by_keys(k, begin, end);
    return cut;
}

/* Where a line of walls, of which `covered` within a cluster is wall, parts it: the share of the wall times
 * the root of the smaller side's share of the elements; 0 where it parts nothing. */
static double worth_of_wall(const maker *k, const plane_frame *f, const plane_wall *wall, double covered,
                            size_t begin, size_t end, const plane_extent *e) {
    double from, to;
    size_t less = 0;
    if (!plane_wall_chord(wall, e, &from, &to) || covered < least_wall * (to - from)) return 0;
    for (size_t p = begin; p < end; p++) less += beyond(k, f, wall, k->tree->order[p]) < 0;
    const size_t count = end - begin, smaller = less < count - less ? less : count - less;
    if ((double)smaller < least_side * (double)count) return 0;
    return covered / (to - from) * sqrt((double)smaller / (double)count);
}

/* The wall that parts a cluster best, of walls [*n_walls] on its plane, of which those within the cluster
 * come first, *n_walls of them; NULL: none does. */
static const plane_wall *best_wall(const maker *k, const plane_frame *f, size_t begin, size_t end,
                                   const plane_extent *e, size_t *n_walls) {
    const plane_wall *best = NULL;
    double most = 0;
    *n_walls = plane_walls_within(k->walls, *n_walls, e);
    for (size_t first = 0, last; first < *n_walls; first = last) {
        double covered = 0;
        for (last = first; last < *n_walls && k->walls[last].line == k->walls[first].line; last++) {
            double from, to;
            if (!plane_wall_chord(&k->walls[last], e, &from, &to)) continue;
            covered += fmax(0, fmin(to, k->walls[last].end) - fmax(from, k->walls[last].begin));
        }
        const double worth = worth_of_wall(k, f, &k->walls[first], covered, begin, end, e);
        if (worth <= most) continue;
        most = worth;
        best = &k->walls[first];
    }
    return best;
}

/* Parts a range of a plane into rooms, on which the first n_walls walls may stand, and notes where they end.
 */
static void part_range(maker *k, const plane_frame *f, size_t begin, size_t end, size_t n_walls) {
    const plane_wall *wall = NULL;
    if (end - begin >= PARTED_LEAST) {
        const plane_extent e = extent_of(k, f, begin, end);
        wall = best_wall(k, f, begin, end, &e, &n_walls);
    }
    if (wall == NULL) {
        k->group_end[k->n_groups++] = (uint32_t)end;
        return;
    }
    const size_t cut = sort_by_wall(k, f, wall, begin, end);
    part_range(k, f, begin, cut, n_walls);
    part_range(k, f, cut, end, n_walls);
}

/* Clusters of a plane or a part of it; returns the topmost. */
static uint32_t split_plane(maker *k, uint32_t frame, size_t begin, size_t end) {
    const plane_frame *f = &k->tree->frames[frame];
    plane_cluster made = {.begin = (uint32_t)begin, .end = (uint32_t)end, .frame = frame};
    if (end - begin <= k->leaf_most) {
        made.leaf = true;
        sort_leaf(k, f, begin, end);
        return add_cluster(k, made);
    }
    const plane_extent e = extent_of(k, f, begin, end);
    sort_on_axis(k, f, e.high[1] - e.low[1] > 1.0001 * (e.high[0] - e.low[0]), begin, end);
    const size_t cut = cut_of(k->keys, begin, end);
    made.left = split_plane(k, frame, begin, cut);
    (void)split_plane(k, frame, cut, end);
    return add_cluster(k, made);
}

/* Axis 0 is the coordinate axis most nearly in the plane, projected into it; axis 1 is normal x axis 0. */
static void set_frame(maker *k, size_t begin, size_t end, plane_frame *f) {
    double normal[3], along[3] = {0, 0, 0};
    int flattest = 0;
    mean_normal(k, begin, end, normal);
    for (int d = 1; d < 3; d++)
        if (fabs(normal[d]) < fabs(normal[flattest]) - 1e-6) flattest = d;
    along[flattest] = 1;
    const double away = dot3(normal, along);
    for (int d = 0; d < 3; d++) f->axis[0][d] = along[d] - away * normal[d];
    const double length = sqrt(dot3(f->axis[0], f->axis[0]));
    for (int d = 0; d < 3; d++) f->axis[0][d] /= length;
    for (int d = 0; d < 3; d++)
        f->axis[1][d] =
            normal[(d + 1) % 3] * f->axis[0][(d + 2) % 3] - normal[(d + 2) % 3] * f->axis[0][(d + 1) % 3];
    for (int d = 0; d < 3; d++) f->origin[d] = 0;
    for (size_t p = begin; p < end; p++)
        for (int d = 0; d < 3; d++) f->origin[d] += k->centre[k->tree->order[p]][d] / (double)(end - begin);
}

static uint32_t part_of(const maker *k, size_t position) {
    return k->part != NULL ? k->part[k->tree->order[position]] : 0;
}

/* The clusters of each plane, numbered from 0, from cluster 2 begins[g] on; counts [n_groups] gets their
 * number. */
static void split_all(const maker *k, const uint32_t *begins, uint32_t *counts) {
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t g = 0; g < k->n_groups; g++) {
        plane_tree part = *k->tree;
        maker own = *k;
        part.clusters += 2 * (size_t)begins[g];
        part.n_clusters = 0;
        own.tree = &part;
        (void)split_plane(&own, (uint32_t)g, begins[g], begins[g + 1]);
        counts[g] = (uint32_t)part.n_clusters;
    }
}

/* Moves the clusters of a plane to the end of those that are in place; returns the topmost. A plane of c
 * elements has 2 c - 1 clusters at most, so that they move to the front. */
static uint32_t take_plane(maker *k, size_t g, const uint32_t *begins, const uint32_t *counts) {
    const uint32_t first = (uint32_t)k->tree->n_clusters;
    const plane_cluster *from = k->tree->clusters + 2 * (size_t)begins[g];
    for (uint32_t t = 0; t < counts[g]; t++) {
        plane_cluster moved = from[t];
        if (!moved.leaf) moved.left += first;
        (void)add_cluster(k, moved);
    }
    return first + counts[g] - 1;
}

/* The clusters of planes [first, last), halved as by order_planes; returns the topmost. */
static uint32_t join_planes(maker *k, const uint32_t *begins, const uint32_t *counts, size_t first,
                            size_t last) {
    if (last - first == 1) return take_plane(k, first, begins, counts);
    const size_t middle = first + (last - first) / 2;
    plane_cluster made = {.begin = begins[first], .end = begins[last], .frame = PLANE_ABOVE};
    made.left = join_planes(k, begins, counts, first, middle);
    (void)join_planes(k, begins, counts, middle, last);
    return add_cluster(k, made);
}

/* The parts whose planes begin at ends[first] and end at ends[last], halved; returns the topmost cluster. */
static uint32_t join_parts(maker *k, const uint32_t *begins, const uint32_t *counts, const uint32_t *ends,
                           size_t first, size_t last) {
    if (last - first == 1) return join_planes(k, begins, counts, ends[first], ends[last]);
    const size_t middle = first + (last - first) / 2;
    plane_cluster made = {
        .begin = begins[ends[first]], .end = begins[ends[last]], .apart = true, .frame = PLANE_ABOVE};
    made.left = join_parts(k, begins, counts, ends, first, middle);
    (void)join_parts(k, begins, counts, ends, middle, last);
    return add_cluster(k, made);
}

/* Joins all planes. */
static lam_status join_all(maker *k, const uint32_t *begins, const uint32_t *counts, lam_error *error) {
    size_t n_parts = 0;
    uint32_t *ends = memory_allocate(k->n_groups + 1, sizeof *ends, "clusters", error); /* ends[0] = 0 */
    if (ends == NULL) return LAM_ERR_MEMORY;
    for (size_t g = 1; g <= k->n_groups; g++)
        if (g == k->n_groups || part_of(k, begins[g]) != part_of(k, begins[g - 1]))
            ends[++n_parts] = (uint32_t)g;
    (void)join_parts(k, begins, counts, ends, 0, n_parts);
    free(ends);
    return LAM_OK;
}

/* Brings planes and their elements into tree order; begins [n_groups + 1] gets the first position of each. */
static lam_status place_planes(maker *k, uint32_t *begins, lam_error *error) {
    lam_status status = LAM_OK;
    plane_tree *tree = k->tree;
    plane_place *planes = memory_allocate(k->n_groups, sizeof *planes, "clusters", error);
    uint32_t *order = memory_allocate(tree->n, sizeof *order, "clusters", error);
    if (planes == NULL || order == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t g = 0, begin = 0; g < k->n_groups; g++) {
        plane_place *place = &planes[g];
        *place = (plane_place){.begin = (uint32_t)begin, .end = k->group_end[g], .part = part_of(k, begin)};
        for (size_t p = begin; p < place->end; p++)
            for (int d = 0; d < 3; d++) {
                const double share = 1 / (double)(place->end - begin);
                place->at[d] += share * k->centre[tree->order[p]][d];
                place->at[3 + d] += share * (double)k->normal[tree->order[p]][d];
            }
        begin = place->end;
    }
    plane_order(planes, k->n_groups);
    size_t used = 0;
    for (size_t g = 0; g < k->n_groups; g++) {
        const size_t count = planes[g].end - planes[g].begin;
        begins[g] = (uint32_t)used;
        memcpy(order + used, tree->order + planes[g].begin, count * sizeof *order);
        used += count;
    }
    begins[k->n_groups] = (uint32_t)used;
    memcpy(tree->order, order, tree->n * sizeof *order);
done:
    free(planes);
    free(order);
    return status;
}

/* Frames of the planes, which are brought into tree order; *begins as by place_planes. */
static lam_status make_frames(maker *k, uint32_t **begins, lam_error *error) {
    lam_status status = LAM_OK;
    plane_tree *tree = k->tree;
    free(*begins);
    free(tree->frames);
    *begins = memory_allocate(k->n_groups + 1, sizeof **begins, "clusters", error);
    tree->frames = memory_allocate(k->n_groups, sizeof *tree->frames, "clusters", error);
    if (*begins == NULL || tree->frames == NULL) TRY(LAM_ERR_MEMORY);
    tree->n_frames = k->n_groups;
    TRY(place_planes(k, *begins, error));
    for (size_t g = 0; g < k->n_groups; g++) set_frame(k, (*begins)[g], (*begins)[g + 1], &tree->frames[g]);
done:
    return status;
}

/* Parts planes where walls stand on them: the groups are rooms of planes then. */
static lam_status part_planes(maker *k, const uint32_t *begins, const element_corners *corners,
                              lam_error *error) {
    lam_status status = LAM_OK;
    wall_finder *finder = NULL;
    const plane_tree *tree = k->tree;
    TRY(wall_finder_create(tree, begins, corners, same_plane * k->extent, &finder, error));
    k->n_groups = 0;
    for (size_t g = 0; g < tree->n_frames; g++) {
        size_t n_walls = 0;
        if (begins[g + 1] - begins[g] >= PARTED_LEAST)
            TRY(wall_finder_find(finder, g, &k->walls, &n_walls, error));
        part_range(k, &tree->frames[g], begins[g], begins[g + 1], n_walls);
    }
done:
    wall_finder_destroy(finder);
    return status;
}

lam_status plane_tree_make(size_t n, const double (*centre)[3], const float (*normal)[3],
                           const element_corners *corners, const uint32_t *part, size_t leaf_most,
                           plane_tree *out, lam_error *error) {
    lam_status status = LAM_OK;
    plane_tree tree = {.n = n};
    maker k = {.centre = centre, .normal = normal, .part = part, .leaf_most = leaf_most, .tree = &tree};
    uint32_t *begins = NULL, *counts = NULL;
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY};
    tree.order = memory_allocate(n, sizeof *tree.order, "clusters", error);
    tree.clusters = memory_allocate(2 * n, sizeof *tree.clusters, "clusters", error);
    k.keys = memory_allocate(n, sizeof *k.keys, "clusters", error);
    k.group_end = memory_allocate(n, sizeof *k.group_end, "clusters", error);
    if (tree.order == NULL || tree.clusters == NULL || k.keys == NULL || k.group_end == NULL)
        TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) {
        tree.order[i] = (uint32_t)i;
        for (int d = 0; d < 3; d++) {
            low[d] = fmin(low[d], centre[i][d]);
            high[d] = fmax(high[d], centre[i][d]);
        }
    }
    for (int d = 0; d < 3; d++) k.extent = fmax(k.extent, high[d] - low[d]);
    split_planes(&k, 0, n, 0, 1);
    if (part != NULL) TRY(split_by_parts(&k, error));
    TRY(make_frames(&k, &begins, error));
    if (corners != NULL) {
        TRY(part_planes(&k, begins, corners, error));
        if (k.n_groups > tree.n_frames) TRY(make_frames(&k, &begins, error));
    }
    counts = memory_allocate(k.n_groups, sizeof *counts, "clusters", error);
    if (counts == NULL) TRY(LAM_ERR_MEMORY);
    split_all(&k, begins, counts);
    TRY(join_all(&k, begins, counts, error));
    for (size_t i = 0; part != NULL && i < n; i++) tree.n_alone += part[i] == UNION_FIND_ALONE;
    *out = tree;
    tree = (plane_tree){.n = 0};
done:
    free(k.keys);
    free(k.group_end);
    free(begins);
    free(counts);
    plane_tree_free(&tree);
    return status;
}
