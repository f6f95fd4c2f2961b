#include "solver/direct/luminaire_sight.h"

#include "solver/base/nearest.h"
#include "solver/base/scene/scene_backs.h"
#include "solver/base/vector3.h"
#include "solver/formfactor/visibility/pane_path.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Millimetres by which exporters round the heights of ceilings and luminaires apart. */
static const double covered = 5e-3;

/* The cosine from which a face looks as the opening does. */
static const double same_way = .999;

/* A hit that is nearer to the end of a segment than this part of it is at the end. */
static const double near_part = 1e-4;

lam_status group_boxes_make(const mesh *m, double (**out)[2][3], lam_error *error) {
    double(*boxes)[2][3] = memory_allocate(m->n_groups, sizeof *boxes, "boxes of groups", error);
    if (boxes == NULL) return LAM_ERR_MEMORY;
    for (size_t g = 0; g < m->n_groups; g++)
        for (int d = 0; d < 3; d++) boxes[g][0][d] = INFINITY, boxes[g][1][d] = -INFINITY;
    for (size_t i = 0; i < m->n; i++)
        for (size_t c = 0; c < mesh_corners(m, i); c++)
            for (int d = 0; d < 3; d++) {
                const double at = m->vertices[m->elements[i][c]][d];
                double(*box)[3] = boxes[m->group[i]];
                box[0][d] = fmin(box[0][d], at);
                box[1][d] = fmax(box[1][d], at);
            }
    *out = boxes;
    return LAM_OK;
}

/* The longest edges of a housing, along the axes of the scene. */
static void housing_most(const placed_luminaire *l, const double size[3], double most[3]) {
    const double *const frame[3] = {l->x, l->y, l->z}, largest = fmax(fmax(size[0], size[1]), size[2]);
    for (int d = 0; d < 3; d++) {
        double extent = 0;
        for (int k = 0; k < 3; k++) extent += size[k] * fabs(frame[k][d]);
        most[d] = fmax(fmax(3 * extent, largest), IGNORED_LEAST);
    }
}

/* True for a group that wraps the opening. */
static bool wraps(const double box[2][3], const placed_luminaire *l, const double most[3]) {
    for (int d = 0; d < 3; d++)
        if (!(l->at[d] >= box[0][d] - covered && l->at[d] <= box[1][d] + covered) ||
            box[1][d] - box[0][d] > most[d])
            return false;
    return true;
}

/* The place of a group in names, or n_groups. */
static size_t group_of_name(const mesh *m, const char *name, size_t length) {
    size_t g = 0;
    while (g < m->n_groups &&
           !(strncmp(m->group_names[g], name, length) == 0 && m->group_names[g][length] == '\0'))
        g++;
    return g;
}

/* Marks the backs of marked groups too. */
static void mark_backs(const mesh *m, bool *marked) {
    const size_t end = strlen(SCENE_BACK);
    for (size_t g = 0; g < m->n_groups; g++) {
        const char *name = m->group_names[g], *dot = strrchr(name, '.');
        if (dot == NULL || strncmp(dot, SCENE_BACK, end) != 0 || (dot[end] != '\0' && dot[end] != '-'))
            continue;
        const size_t front = group_of_name(m, name, (size_t)(dot - name));
        if (front < m->n_groups && marked[front]) marked[g] = true;
    }
}

lam_status ignored_groups_find(const mesh *m, const double (*boxes)[2][3], const placed_luminaires *list,
                               const placed_luminaire *l, ignored_groups *out, lam_error *error) {
    lam_status status = LAM_OK;
    opening_faces opening;
    ignored_groups found = {.n = 0};
    bool *marked = memory_allocate(m->n_groups, sizeof *marked, "ignored groups", error);
    if (marked == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < l->n_ignored; k++) {
        const char *name = list->ignored[l->ignored + k].text;
        const size_t g = group_of_name(m, name, strlen(name));
        if (g == m->n_groups) {
            char advice[256];
            nearest_advice(name, m->n_groups, (const char *const *)m->group_names, advice, sizeof advice);
            FAIL(error, LAM_ERR_ARGUMENT, "luminaire %s: ignore = %s, which is no group of the scene; %s",
                 l->name, name, advice);
        }
        marked[g] = true;
    }
    opening_faces_set(&list->files[l->file].photometry.opening, l->is_point, INFINITY, &opening);
    double most[3];
    housing_most(l, opening.size, most);
    bool any = false;
    for (size_t g = 0; g < m->n_groups; g++) {
        marked[g] = marked[g] || wraps(boxes[g], l, most);
        any = any || marked[g];
    }
    if (any) mark_backs(m, marked);
    for (size_t g = 0; g < m->n_groups; g++) found.n += marked[g];
    found.groups = memory_allocate(found.n, sizeof *found.groups, "ignored groups", error);
    if (found.groups == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t g = 0, k = 0; g < m->n_groups; g++)
        if (marked[g]) found.groups[k++] = (uint32_t)g;
    *out = found;
done:
    free(marked);
    return status;
}

/* Copies the elements of the groups that are not ignored. */
static lam_status keep_elements(const mesh *m, const ignored_groups *ignored, luminaire_sight *s,
                                lam_error *error) {
    lam_status status = LAM_OK;
    mesh *kept = &s->kept;
    bool *out = memory_allocate(m->n_groups, sizeof *out, "a scene without groups", error);
    s->place = memory_allocate(m->n, sizeof *s->place, "a scene without groups", error);
    kept->elements = memory_allocate(m->n, sizeof *kept->elements, "a scene without groups", error);
    kept->area = memory_allocate(m->n, sizeof *kept->area, "a scene without groups", error);
    kept->normal = memory_allocate(m->n, sizeof *kept->normal, "a scene without groups", error);
    kept->group = memory_allocate(m->n, sizeof *kept->group, "a scene without groups", error);
    if (out == NULL || s->place == NULL || kept->elements == NULL || kept->area == NULL ||
        kept->normal == NULL || kept->group == NULL)
        TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < ignored->n; k++) out[ignored->groups[k]] = true;
    for (size_t i = 0; i < m->n; i++) {
        s->place[i] = VISIBILITY_NOTHING;
        if (out[m->group[i]]) continue;
        s->place[i] = (uint32_t)kept->n;
        memcpy(kept->elements[kept->n], m->elements[i], sizeof *kept->elements);
        memcpy(kept->normal[kept->n], m->normal[i], sizeof *kept->normal);
        kept->area[kept->n] = m->area[i];
        kept->group[kept->n++] = m->group[i];
        kept->n_backs += i >= m->n - m->n_backs;
    }
done:
    free(out);
    return status;
}

lam_status luminaire_sight_make(const mesh *m, const ignored_groups *ignored, luminaire_sight *out,
                                lam_error *error) {
    lam_status status = LAM_OK;
    *out = (luminaire_sight){.m = m};
    /* Vertices and glass are those of the scene. */
    out->kept = (mesh){.n_vertices = m->n_vertices,
                       .vertices = m->vertices,
                       .n_groups = m->n_groups,
                       .group_names = m->group_names,
                       .n_channels = m->n_channels,
                       .n_glass = m->n_glass,
                       .glass = m->glass,
                       .glass_by_angle = m->glass_by_angle,
                       .two_sided = m->two_sided,
                       .unit = m->unit,
                       .rounding = m->rounding,
                       .up = m->up};
    if (ignored->n == 0)
        TRY(visibility_create(m, &out->v, error));
    else {
        TRY(keep_elements(m, ignored, out, error));
        if (out->kept.n > 0) TRY(visibility_create(&out->kept, &out->v, error));
    }
done:
    if (status != LAM_OK) luminaire_sight_free(out);
    return status;
}

void luminaire_sight_free(luminaire_sight *s) {
    visibility_destroy(s->v);
    free(s->place);
    free(s->kept.elements);
    free(s->kept.area);
    free(s->kept.normal);
    free(s->kept.group);
    *s = (luminaire_sight){.m = NULL};
}

/* The mesh that visibility was made of. */
static const mesh *seen_mesh(const luminaire_sight *s) {
    return s->place != NULL ? &s->kept : s->m;
}

void luminaire_sight_recentre(const luminaire_sight *s, const double point[3], float recentred[3]) {
    for (int d = 0; d < 3; d++) recentred[d] = (float)point[d];
    if (s->v != NULL) visibility_recentre(s->v, point, recentred);
}

/* True where the luminaire sends more light upwards than downwards, in its frame. */
static bool shines_upwards(const placed_source *source) {
    enum { STEPS = 36 };
    double up = 0;
    for (int i = 0; i < STEPS; i++)
        for (int j = 0; j < STEPS; j++) {
            const double z = -1 + (2 * i + 1.) / STEPS, C = 2 * M_PI * (j + .5) / STEPS,
                         across = sqrt(1 - z * z);
            const double direction[3] = {across * cos(C), across * sin(C), z};
            up += z > 0 ? placed_source_intensity(source, direction)
                        : -placed_source_intensity(source, direction);
        }
    return up > 0;
}

/* The axis of the frame along which an opening lies flat: the one of its least extent. */
static int axis_across(const opening_faces *o) {
    int across = 2;
    for (int d = 0; d < 2; d++)
        if (o->size[d] < o->size[across]) across = d;
    return across;
}

/* The distance by which a face that looks as the opening does lies before a place of it; 0: none does. */
static double cover_of(const luminaire_sight *s, const double place[3], const double way[3]) {
    static const uint32_t self = VISIBILITY_NOTHING;
    const mesh *m = seen_mesh(s);
    double begin[3], deepest = 0, from = -covered;
    for (int layer = 0; layer < 4; layer++) {
        ray_packet ray = {.origin = {{0}}};
        hit_packet hit;
        float origin[3];
        double cosine = 0;
        for (int d = 0; d < 3; d++) begin[d] = place[d] + from * way[d];
        luminaire_sight_recentre(s, begin, origin);
        for (int d = 0; d < 3; d++) {
            ray.origin[d][0] = origin[d];
            ray.direction[d][0] = (float)way[d];
        }
        visibility_cast(s->v, &ray, 1, &self, 0, &hit);
        if (hit.element[0] == VISIBILITY_NOTHING) break;
        const double at = from + (double)hit.distance[0];
        if (at > covered) break;
        for (int d = 0; d < 3; d++) cosine += (double)m->normal[hit.element[0]][d] * way[d];
        if (cosine > same_way || (m->two_sided && cosine < -same_way)) deepest = fmax(deepest, at);
        from = at + 4 * visibility_rounding(s->v);
    }
    return deepest;
}

void luminaire_sight_settle(const luminaire_sight *s, const placed_source *source, double moved[3]) {
    static const double places[5][2] = {{0, 0}, {-.45, -.45}, {.45, -.45}, {.45, .45}, {-.45, .45}};
    const opening_faces *o = &source->opening;
    const int across = axis_across(o);
    const double sign = across == 2 && !shines_upwards(source) ? -1 : 1;
    double way[3], deepest = 0;
    for (int d = 0; d < 3; d++) moved[d] = 0;
    if (s->v == NULL) return;
    for (int d = 0; d < 3; d++) way[d] = sign * source->frame[across][d];
    for (int k = 0; k < 5; k++) {
        double own[3] = {0}, place[3];
        for (int j = 0; j < 2; j++) {
            const int d = (across + 1 + j) % 3;
            own[d] = places[k][j] * o->size[d];
        }
        own[across] = sign * o->size[across] / 2;
        placed_source_outwards(source, own, place);
        deepest = fmax(deepest, cover_of(s, place, way));
        if (o->n_faces == 0) break;
    }
    /* Above the plane by more than rounding. */
    const double clear = deepest + 4 * visibility_rounding(s->v);
    for (int d = 0; d < 3; d++) moved[d] = clear * way[d];
}

/* The share of a segment at which its end begins. */
static double end_of(const luminaire_sight *s, const ray_packet *segments, size_t i) {
    double square = 0;
    for (int d = 0; d < 3; d++)
        square += (double)segments->direction[d][i] * (double)segments->direction[d][i];
    return square > 0 ? fmax(0, 1 - near_part - 4 * visibility_rounding(s->v) / sqrt(square)) : 0;
}

/* Points that nobody says to lie on a face may do so nevertheless: a segment begins where rounding ends. */
static void begin_later(const luminaire_sight *s, ray_packet *segments, size_t i) {
    double square = 0;
    for (int d = 0; d < 3; d++)
        square += (double)segments->direction[d][i] * (double)segments->direction[d][i];
    const float part = square > 0 ? (float)fmin(.5, 4 * visibility_rounding(s->v) / sqrt(square)) : 0;
    for (int d = 0; d < 3; d++) {
        segments->origin[d][i] += part * segments->direction[d][i];
        segments->direction[d][i] *= 1 - part;
    }
}

/* Segments that begin above their elements, and above all that rises from their planes, and end before the
 * opening. */
static void clear_ends(const luminaire_sight *s, const size_t *element, size_t n, ray_packet *segments) {
    const double rounding = visibility_rounding(s->v);
    for (size_t i = 0; i < n; i++) {
        const float end = (float)end_of(s, segments, i);
        for (int d = 0; d < 3; d++) segments->direction[d][i] *= end;
        if (element[i] == SIGHT_OPEN) continue;
        const uint32_t own = s->place != NULL ? s->place[element[i]] : (uint32_t)element[i];
        const double height = 2 * rounding + (own != VISIBILITY_NOTHING ? visibility_rise(s->v, own) : 0);
        for (int d = 0; d < 3; d++) {
            const float up = (float)height * s->m->normal[element[i]][d];
            segments->origin[d][i] += up;
            segments->direction[d][i] -= up;
        }
    }
}

/* The light that panes pass of the segments that are blocked. */
static void pass_panes(const luminaire_sight *s, const ray_packet *segments, size_t n, const size_t *element,
                       unsigned blocked, double passed[VISIBILITY_PACKET]) {
    ray_packet cast = {.origin = {{0}}};
    hit_packet hits;
    uint32_t self[VISIBILITY_PACKET];
    size_t lane[VISIBILITY_PACKET], count = 0;
    double end[VISIBILITY_PACKET], weight[VISIBILITY_PACKET];
    for (size_t i = 0; i < n; i++) {
        if (!(blocked >> i & 1)) continue;
        for (int d = 0; d < 3; d++) {
            cast.origin[d][count] = segments->origin[d][i];
            cast.direction[d][count] = segments->direction[d][i];
        }
        end[count] = end_of(s, segments, i);
        weight[count] = 1;
        self[count] = element[i] == SIGHT_OPEN ? VISIBILITY_NOTHING
                      : s->place != NULL       ? s->place[element[i]]
                                               : (uint32_t)element[i];
        lane[count++] = i;
    }
    if (count == 0) return;
    visibility_cast(s->v, &cast, count, self, VISIBILITY_TOGETHER, &hits);
    pane_path_reach(s->v, seen_mesh(s), &cast, count, &hits, end, weight);
    for (size_t k = 0; k < count; k++) passed[lane[k]] = weight[k];
}

void luminaire_sight_passed(const luminaire_sight *s, const ray_packet *segments, size_t n,
                            const size_t *element, double passed[VISIBILITY_PACKET]) {
    ray_packet begun = *segments;
    for (size_t i = 0; i < n; i++) passed[i] = 1;
    if (s->v == NULL) return;
    for (size_t i = 0; i < n; i++)
        if (element[i] == SIGHT_OPEN) begin_later(s, &begun, i);
    ray_packet cast = begun;
    clear_ends(s, element, n, &cast);
    const unsigned blocked = visibility_between(s->v, &cast, n);
    for (size_t i = 0; i < n; i++) passed[i] = blocked >> i & 1 ? 0 : 1;
    if (s->m->glass != NULL) pass_panes(s, &begun, n, element, blocked, passed);
}

double luminaire_sight_near(const luminaire_sight *s, const placed_source *source, const double moved[3],
                            double metres) {
    enum { DIRECTIONS = 4096 };
    double near = 0, all = 0;
    if (s->v == NULL) return 0;
    for (size_t first = 0; first < DIRECTIONS; first += VISIBILITY_PACKET) {
        static const uint32_t self[VISIBILITY_PACKET] = {
            VISIBILITY_NOTHING, VISIBILITY_NOTHING, VISIBILITY_NOTHING, VISIBILITY_NOTHING,
            VISIBILITY_NOTHING, VISIBILITY_NOTHING, VISIBILITY_NOTHING, VISIBILITY_NOTHING};
        double weight[VISIBILITY_PACKET];
        ray_packet rays;
        hit_packet hits;
        for (size_t i = 0; i < VISIBILITY_PACKET; i++) {
            /* A spiral of equal solid angles, from places of the opening in turn. */
            const double k = (double)(first + i), z = 1 - (2 * k + 1) / DIRECTIONS,
                         C = 2 * M_PI * k * .6180339887498949, across = sqrt(1 - z * z);
            const double u = fmod(k * .7548776662466927, 1), w = fmod(k * .5698402909980532, 1);
            const double own[3] = {across * cos(C), across * sin(C), z};
            opening_cell cell;
            double place[3];
            float origin[3];
            opening_place(&source->opening, u, w, &cell);
            weight[i] = opening_part(&source->opening, &cell, own) * placed_source_intensity(source, own);
            placed_source_outwards(source, cell.at, place);
            for (int d = 0; d < 3; d++) {
                const double way = own[0] * source->frame[0][d] + own[1] * source->frame[1][d] +
                                   own[2] * source->frame[2][d];
                place[d] += moved[d] + 4 * visibility_rounding(s->v) * way; /* it may lie in a face */
                rays.direction[d][i] = (float)way;
            }
            luminaire_sight_recentre(s, place, origin);
            for (int d = 0; d < 3; d++) rays.origin[d][i] = origin[d];
        }
        visibility_cast(s->v, &rays, VISIBILITY_PACKET, self, 0, &hits);
        for (size_t i = 0; i < VISIBILITY_PACKET; i++) {
            all += weight[i];
            if (hits.element[i] != VISIBILITY_NOTHING && (double)hits.distance[i] < metres) near += weight[i];
        }
    }
    return all > 0 ? near / all : 0;
}
