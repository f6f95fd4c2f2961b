#include "solver/formfactor/facing.h"

#include "solver/base/random.h"
#include "solver/base/weighted.h"
#include "solver/formfactor/visibility/sample.h"
#include "solver/scene/sides.h"

#include <math.h>
#include <stdlib.h>

/* Packets of the survey. */
enum { SURVEY_PACKETS = 8192 };

/* Packets from each side of a patch: as many as make about a million in all, within these bounds. */
enum { PATCH_PACKETS_LEAST = 8, PATCH_PACKETS_MOST = 128, PATCH_PACKETS_ALL = 1 << 17 };

/* A patch is turned where its back is brighter than its front by more than this share of the rays: less is no
 * reason to doubt the file. */
static const double decided_gain = .2;
/* A ray to a back counts less than one to a front: through the party wall of two houses, whose walls lie in
 * one plane, light seems to go into the neighbour. */
static const double back_weight = .75;
enum { SWEEPS = 16 };

/* before[k + 1] = area of the first k + 1 elements of list, less buried ones; returns their sum. */
static double accumulate(const mesh *m, const uint32_t *list, size_t count, double *before) {
    before[0] = 0;
    for (size_t k = 0; k < count; k++) {
        const size_t i = list == NULL ? k : list[k];
        before[k + 1] = before[k] + (mesh_is_buried(m, i) ? 0 : m->area[i]);
    }
    return before[count];
}

/* Casts a packet from the front of an element, or, turned about its plane, from its back. */
static void cast_from(const mesh *m, const visibility *v, size_t element, bool back, uint64_t seed,
                      hit_packet *hits) {
    element_sampler sampler;
    ray_packet rays;
    uint32_t self[VISIBILITY_PACKET];
    element_sampler_init(&sampler, m, v, element, seed);
    element_sampler_packet(&sampler, 0, &rays);
    if (back) element_sampler_turn(&sampler, &rays);
    for (int i = 0; i < VISIBILITY_PACKET; i++) self[i] = (uint32_t)element;
    visibility_cast(v, &rays, VISIBILITY_PACKET, self, 0, hits);
}

lam_status facing_survey_make(const mesh *m, facing_survey *out, lam_error *error) {
    lam_status status = LAM_OK;
    visibility *v = NULL;
    facing_survey s = {.share = 0};
    double *before = memory_allocate(m->n + 1, sizeof *before, "the survey of sides", error);
    uint32_t *met = memory_allocate(m->n, sizeof *met, "the survey of sides", error);
    s.group_shares = memory_allocate(m->n_groups, sizeof *s.group_shares, "the survey of sides", error);
    if (before == NULL || met == NULL || s.group_shares == NULL) TRY(LAM_ERR_MEMORY);
    TRY(visibility_create(m, &v, error));
    const double area = accumulate(m, NULL, m->n, before);
#pragma omp parallel for schedule(static)
    for (size_t p = 0; p < SURVEY_PACKETS; p++) {
        hit_packet hits;
        cast_from(m, v, weighted_part(before, m->n, ((double)p + .5) / SURVEY_PACKETS * area), false, p,
                  &hits);
        for (int i = 0; i < VISIBILITY_PACKET; i++)
            if (hits.element[i] != VISIBILITY_NOTHING && hits.back[i]) {
#pragma omp atomic
                met[hits.element[i]]++;
            }
    }
    for (size_t i = 0; i < m->n; i++) {
        const double share = met[i] / (double)(SURVEY_PACKETS * VISIBILITY_PACKET);
        s.share += share;
        s.group_shares[m->group[i]] += share;
        s.faces += met[i] > 0;
    }
    *out = s;
    s = (facing_survey){.share = 0};
done:
    visibility_destroy(v);
    facing_survey_free(&s);
    free(before);
    free(met);
    return status;
}

void facing_survey_free(facing_survey *s) {
    free(s->group_shares);
    *s = (facing_survey){.share = 0};
}

/* The views from both sides of every patch: side 2 p is the front that patch p has when its neighbours agree,
 * side 2 p + 1 its back. */
typedef struct side_views {
    size_t n_patches, rays; /* from each side */
    uint32_t *met; /* [2 n_patches][rays]: the side of another patch that a ray meets, or NOTHING_MET */
    bool *turned;  /* [n_patches]: its back is where the light is */
} side_views;

#define NOTHING_MET 0xFFFFFFFFu

static void side_views_free(side_views *w) {
    free(w->met);
    free(w->turned);
}

static lam_status side_views_create(size_t n_patches, side_views *w, lam_error *error) {
    const size_t n = 2 * n_patches;
    size_t packets = PATCH_PACKETS_ALL / n_patches;
    if (packets < PATCH_PACKETS_LEAST) packets = PATCH_PACKETS_LEAST;
    if (packets > PATCH_PACKETS_MOST) packets = PATCH_PACKETS_MOST;
    *w = (side_views){.n_patches = n_patches, .rays = packets * VISIBILITY_PACKET};
    w->met = memory_allocate(n * w->rays, sizeof *w->met, "sides", error);
    w->turned = memory_allocate(n_patches, sizeof *w->turned, "sides", error);
    return w->met != NULL && w->turned != NULL ? LAM_OK : LAM_ERR_MEMORY;
}

/* One patch: its elements list[0 ... count), and work space before[count + 1]. */
typedef struct patch_faces {
    const uint32_t *list;
    size_t count;
    double *before, area;
} patch_faces;

/* Casts the rays of one side. */
static void look(const mesh *m, const visibility *v, const mesh_sides *s, const patch_faces *p, size_t side,
                 side_views *w) {
    uint32_t *met = w->met + side * w->rays;
    for (size_t first = 0; first < w->rays; first += VISIBILITY_PACKET) {
        const double x = ((double)first + .5 * VISIBILITY_PACKET) / (double)w->rays * p->area;
        const uint32_t i = p->list[weighted_part(p->before, p->count, x)];
        hit_packet hits;
        cast_from(m, v, i, (side % 2 == 1) != s->turned[i], first, &hits);
        for (size_t r = 0; r < VISIBILITY_PACKET; r++) {
            const uint32_t e = hits.element[r];
            const bool other = e != VISIBILITY_NOTHING && s->patch[e] != side / 2;
            met[first + r] = other ? 2 * s->patch[e] + (hits.back[r] != s->turned[e]) : NOTHING_MET;
        }
    }
}

/* The share of the rays from a side that meet fronts of other patches, less the weight of those that meet
 * backs. */
static double brightness(const side_views *w, size_t side) {
    double fronts = 0, backs = 0;
    for (size_t r = 0; r < w->rays; r++) {
        const uint32_t met = w->met[side * w->rays + r];
        if (met == NOTHING_MET) continue;
        *((met % 2 == 1) == w->turned[met / 2] ? &fronts : &backs) += 1;
    }
    return (fronts - back_weight * backs) / (double)w->rays;
}

/* The brightness of the side that is the front now, less that of the other. */
static double gain(const side_views *w, size_t patch) {
    const size_t front = 2 * patch + w->turned[patch];
    return brightness(w, front) - brightness(w, front ^ 1);
}

/* A patch and its area. */
typedef struct sized_patch {
    double area;
    size_t patch;
} sized_patch;

static int larger_first(const void *a, const void *b) {
    const sized_patch *p = a, *q = b;
    if (p->area != q->area) return p->area > q->area ? -1 : 1;
    return (p->patch > q->patch) - (p->patch < q->patch);
}

/* Turns one patch after the other to its brighter side, the largest first, until all stand right. Rays are
 * not the same both ways, so that patches could change for ever: sweeps have a limit. */
static lam_status settle(const double *areas, side_views *w, lam_error *error) {
    sized_patch *order = memory_allocate(w->n_patches, sizeof *order, "sides", error);
    if (order == NULL) return LAM_ERR_MEMORY;
    for (size_t p = 0; p < w->n_patches; p++) order[p] = (sized_patch){areas[p], p};
    qsort(order, w->n_patches, sizeof *order, larger_first);
    size_t turned = 1;
    for (int sweep = 0; sweep < SWEEPS && turned > 0; sweep++) {
        turned = 0;
        for (size_t k = 0; k < w->n_patches; k++) {
            const size_t p = order[k].patch;
            if (!(gain(w, p) < -decided_gain)) continue;
            w->turned[p] = !w->turned[p];
            turned++;
        }
    }
    free(order);
    return LAM_OK;
}

/* Casts the rays from both sides of every patch into w->met, and has settle() choose the front of each patch,
 * w->turned. list has the elements patch by patch: those of patch p stand from begin[p] to begin[p + 1]. */
static lam_status look_around(const mesh *m, const mesh_sides *s, const uint32_t *list, const size_t *begin,
                              double *before, side_views *w, const progress *how, lam_error *error) {
    lam_status status = LAM_OK;
    visibility *v = NULL;
    size_t finished = 0;
    bool stop = false;
    double *areas = memory_allocate(s->n_patches, sizeof *areas, "sides", error);
    if (areas == NULL) TRY(LAM_ERR_MEMORY);
    TRY(visibility_create(m, &v, error));
#pragma omp parallel for schedule(dynamic, 16)
    for (size_t p = 0; p < s->n_patches; p++) {
        bool stopped;
#pragma omp atomic read
        stopped = stop;
        if (stopped) continue;
        patch_faces faces = {
            .list = list + begin[p], .count = begin[p + 1] - begin[p], .before = before + begin[p] + p};
        faces.area = accumulate(m, faces.list, faces.count, faces.before);
        areas[p] = faces.area;
        for (size_t side = 2 * p; side < 2 * p + 2; side++) look(m, v, s, &faces, side, w);
        size_t so_far;
#pragma omp atomic capture
        so_far = ++finished;
        if (so_far % 256 != 0) continue;
#pragma omp critical(facing_progress)
        {
            progress_report(how, "sides", (double)so_far / (double)s->n_patches);
            if (progress_cancelled(how)) {
#pragma omp atomic write
                stop = true;
            }
        }
    }
    if (stop) FAIL(error, LAM_ERR_CANCELLED, "cancelled while faces were turned");
    TRY(settle(areas, w, error));
done:
    visibility_destroy(v);
    free(areas);
    return status;
}

lam_status facing_orient(mesh *m, const progress *how, facing_turned *out, lam_error *error) {
    lam_status status = LAM_OK;
    mesh_sides s = {.n_patches = 0};
    facing_turned turned = {0, 0};
    uint32_t *list = NULL;
    size_t *begin = NULL;
    double *before = NULL;
    bool *undecided = NULL;
    side_views w = {.rays = 0};
    TRY(mesh_sides_find(m, &s, error));
    list = memory_allocate(m->n, sizeof *list, "sides", error);
    begin = memory_allocate(s.n_patches + 2, sizeof *begin, "sides", error);
    before = memory_allocate(m->n + s.n_patches, sizeof *before, "sides", error);
    undecided = memory_allocate(s.n_patches, sizeof *undecided, "sides", error);
    if (list == NULL || begin == NULL || before == NULL || undecided == NULL) TRY(LAM_ERR_MEMORY);
    TRY(side_views_create(s.n_patches, &w, error));
    for (size_t i = 0; i < m->n; i++) begin[s.patch[i] + 2]++;
    for (size_t p = 0; p < s.n_patches; p++) begin[p + 2] += begin[p + 1];
    for (uint32_t i = 0; i < m->n; i++) list[begin[s.patch[i] + 1]++] = i;
    TRY(look_around(m, &s, list, begin, before, &w, how, error));
    for (size_t p = 0; p < s.n_patches; p++) undecided[p] = fabs(gain(&w, p)) <= decided_gain;
    for (size_t i = 0; i < m->n; i++) {
        const bool turn = s.turned[i] != w.turned[s.patch[i]];
        turned.undecided += undecided[s.patch[i]];
        turned.turned += turn;
        if (turn) mesh_turn(m, i);
    }
    *out = turned;
done:
    mesh_sides_free(&s);
    free(list);
    free(begin);
    free(before);
    free(undecided);
    side_views_free(&w);
    return status;
}

/* Shares of rays from all fronts that meet anything, and from all backs that meet backs. */
static lam_status survey_sides(const mesh *m, double *of_fronts, double *of_backs, lam_error *error) {
    lam_status status = LAM_OK;
    visibility *v = NULL;
    size_t met[2] = {0, 0};
    double *before = memory_allocate(m->n + 1, sizeof *before, "the survey of sides", error);
    if (before == NULL) TRY(LAM_ERR_MEMORY);
    TRY(visibility_create(m, &v, error));
    const double area = accumulate(m, NULL, m->n, before);
    for (int back = 0; back < 2; back++)
        for (size_t p = 0; p < SURVEY_PACKETS; p++) {
            hit_packet hits;
            const double at = ((double)p + .5) / SURVEY_PACKETS * area;
            cast_from(m, v, weighted_part(before, m->n, at), back == 1, p, &hits);
            for (int i = 0; i < VISIBILITY_PACKET; i++)
                met[back] += hits.element[i] != VISIBILITY_NOTHING && (back == 0 || hits.back[i]);
        }
    *of_fronts = (double)met[0] / (SURVEY_PACKETS * VISIBILITY_PACKET);
    *of_backs = (double)met[1] / (SURVEY_PACKETS * VISIBILITY_PACKET);
done:
    visibility_destroy(v);
    free(before);
    return status;
}

/* A room from outside: the rays of its backs may leave it through windows. Two bodies apart see little of
 * each other, but something. */
static const double outward_backs = .8;

lam_status facing_turn_inward(mesh *m, bool *turned, lam_error *error) {
    lam_status status = LAM_OK;
    double of_fronts, of_backs;
    TRY(survey_sides(m, &of_fronts, &of_backs, error));
    const bool outward = !(of_fronts > 0) && of_backs > outward_backs;
    for (size_t i = 0; i < m->n && outward; i++) mesh_turn(m, i);
    *turned = outward;
done:
    return status;
}
