#include "solver/formfactor/rays/portal_strength.h"

#include "solver/base/random.h"
#include "solver/base/vector3.h"
#include "solver/formfactor/rays/portal_aim.h"
#include "solver/formfactor/visibility/sample.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Lines through an opening; walks of as many steps into the space on a side of it, of which each casts
 * a packet. */
enum { LINES = 64, WALKS = 16, STEPS = 6 };

/* The share of light that leaves a scene, above which it is open, and that of a space behind an opening,
 * above which rays find the sky by themselves. */
static const double open_scene = .1, open_space = .1;

/* Elements of a first look, and rays of each by the cosine. */
enum { LOOK_ELEMENTS = 256, LOOK_PACKETS = 8 };

/* True where much of the light that all elements emit leaves the scene. */
bool portals_are_in_the_open(const mesh *m, const visibility *v, uint64_t seed) {
    const size_t n = m->n, count = n < LOOK_ELEMENTS ? n : LOOK_ELEMENTS;
    double left[LOOK_ELEMENTS], sum = 0, area = 0;
#pragma omp parallel for schedule(dynamic, 8)
    for (size_t k = 0; k < count; k++) {
        const size_t i = k * n / count;
        element_sampler sampler;
        uint32_t self[VISIBILITY_PACKET];
        left[k] = 0;
        for (int lane = 0; lane < VISIBILITY_PACKET; lane++) self[lane] = (uint32_t)i;
        element_sampler_init(&sampler, m, v, i, seed);
        for (uint32_t p = 0; p < LOOK_PACKETS; p++) {
            ray_packet rays;
            hit_packet hits;
            element_sampler_packet(&sampler, p * VISIBILITY_PACKET, &rays);
            visibility_cast(v, &rays, VISIBILITY_PACKET, self, 0, &hits);
            for (int lane = 0; lane < VISIBILITY_PACKET; lane++)
                left[k] += hits.element[lane] == VISIBILITY_NOTHING;
        }
        left[k] *= m->area[i] / (LOOK_PACKETS * VISIBILITY_PACKET);
    }
    for (size_t k = 0; k < count; k++) {
        sum += left[k];
        area += m->area[k * n / count];
    }
    return sum > open_scene * area;
}

/* Eight lines through points of an opening: rays by the cosine to the side of its normal. */
static void lines_through(const portals *p, const portal_aim *all, const double x[4][VISIBILITY_PACKET],
                          double origin[VISIBILITY_PACKET][3], double direction[VISIBILITY_PACKET][3]) {
    const portal *first = &p->portal[0]; /* all lie in one plane */
    const double length = sqrt(dot3(first->edge[0], first->edge[0]));
    double axis[2][3];
    for (int d = 0; d < 3; d++) axis[0][d] = first->edge[0][d] / length;
    cross3(first->normal, axis[0], axis[1]);
    for (int i = 0; i < VISIBILITY_PACKET; i++) {
        const double away = sqrt(x[0][i]), turn = 2 * M_PI * x[1][i], up = sqrt(fmax(0, 1 - x[0][i]));
        portals_point(p, all, x[2][i], x[3][i], origin[i]);
        for (int d = 0; d < 3; d++)
            direction[i][d] =
                away * (cos(turn) * axis[0][d] + sin(turn) * axis[1][d]) + up * first->normal[d];
    }
}

/* Casts eight rays from origin + shift direction along `along` times direction. */
static void cast(const visibility *v, const double origin[VISIBILITY_PACKET][3],
                 const double direction[VISIBILITY_PACKET][3], const float *shift, float along,
                 const uint32_t self[VISIBILITY_PACKET], hit_packet *hits) {
    ray_packet rays;
    for (int i = 0; i < VISIBILITY_PACKET; i++)
        for (int d = 0; d < 3; d++) {
            rays.direction[d][i] = along * (float)direction[i][d];
            rays.origin[d][i] =
                (float)(origin[i][d] + (shift != NULL ? (double)shift[i] * direction[i][d] : 0));
        }
    visibility_cast(v, &rays, VISIBILITY_PACKET, self, 0, hits);
}

/* A line through an opening along which an element sees the sky: towards it. */
typedef struct sky_line {
    double origin[3], direction[3];
} sky_line;

/* The lines of one side, and some elements at their ends. */
typedef struct seen_through {
    size_t n, n_lines;
    uint32_t element[WALKS];
    sky_line lines[LINES];
} seen_through;

/* Adds, of eight lines, those along which a front on side s sees nothing of the scene beyond the opening:
 * nothing lies on the other side, nor in the opening itself. */
static void add_lines(const visibility *v, const double origin[VISIBILITY_PACKET][3],
                      const double direction[VISIBILITY_PACKET][3], const hit_packet sides[2], int s,
                      seen_through *seen) {
    const float along = s == 0 ? 1 : -1;
    uint32_t self[VISIBILITY_PACKET];
    float shift[VISIBILITY_PACKET];
    bool wanted[VISIBILITY_PACKET];
    unsigned any = 0;
    hit_packet back;
    for (int i = 0; i < VISIBILITY_PACKET; i++) {
        wanted[i] = sides[s].element[i] != VISIBILITY_NOTHING && !sides[s].back[i] &&
                    sides[1 - s].element[i] == VISIBILITY_NOTHING;
        self[i] = wanted[i] ? sides[s].element[i] : VISIBILITY_NOTHING;
        shift[i] = wanted[i] ? along * sides[s].distance[i] : 0;
        any += wanted[i];
    }
    if (any == 0) return;
    cast(v, origin, direction, shift, -along, self, &back);
    for (int i = 0; i < VISIBILITY_PACKET; i++) {
        if (!wanted[i] || back.element[i] != VISIBILITY_NOTHING) continue;
        if (seen->n < WALKS) seen->element[seen->n++] = self[i];
        sky_line *line = &seen->lines[seen->n_lines++];
        for (int d = 0; d < 3; d++) {
            line->origin[d] = origin[i][d];
            line->direction[d] = -(double)along * direction[i][d];
        }
    }
}

/* Casts eight rays from an element; returns one of the elements that they meet, or VISIBILITY_NOTHING. */
static uint32_t step_from(const mesh *m, const visibility *v, uint64_t seed, uint32_t element, size_t walk,
                          int step, size_t *left) {
    element_sampler sampler;
    ray_packet rays;
    hit_packet hits;
    uint32_t self[VISIBILITY_PACKET], met = VISIBILITY_NOTHING;
    for (int i = 0; i < VISIBILITY_PACKET; i++) self[i] = element;
    element_sampler_init(&sampler, m, v, element, seed);
    element_sampler_packet(&sampler, (uint32_t)(VISIBILITY_PACKET * ((size_t)STEPS * walk + (size_t)step)),
                           &rays);
    visibility_cast(v, &rays, VISIBILITY_PACKET, self, 0, &hits);
    for (int i = 0; i < VISIBILITY_PACKET; i++) {
        *left += hits.element[i] == VISIBILITY_NOTHING;
        if (met == VISIBILITY_NOTHING && hits.element[i] != VISIBILITY_NOTHING && !hits.back[i])
            met = hits.element[i];
    }
    return met;
}

/* True where much of the light around some elements leaves the scene. The first step is left out: what sees
 * the sky through an opening sees more of it than the rest of a room does. */
static bool is_open_behind(const mesh *m, const visibility *v, uint64_t seed, const seen_through *seen) {
    size_t left = 0, cast_rays = 0;
    for (size_t k = 0; k < seen->n; k++) {
        size_t first = 0;
        uint32_t at = step_from(m, v, seed, seen->element[k], k, 0, &first);
        for (int step = 1; step < STEPS && at != VISIBILITY_NOTHING; step++) {
            at = step_from(m, v, seed, at, k, step, &left);
            cast_rays += VISIBILITY_PACKET;
        }
    }
    return !((double)left <= open_space * (double)cast_rays) || cast_rays == 0;
}

static lam_status measure_one(const mesh *m, const visibility *v, uint64_t seed, const plane_patch *patches,
                              size_t n, bool of_open, double strength[2], seen_through seen[2],
                              lam_error *error) {
    lam_status status = LAM_OK;
    portals p = {.n = 0};
    pair_sampler points;
    uint32_t nobody[VISIBILITY_PACKET];
    portal *array = memory_allocate(n, sizeof *array, "portals", error);
    if (array == NULL) return LAM_ERR_MEMORY;
    for (size_t k = 0; k < n; k++) array[k] = portal_of(&patches[k], visibility_centre(v));
    TRY(portals_build(array, n, &p, error));
    const portal_aim all = portals_all(&p);
    for (int i = 0; i < VISIBILITY_PACKET; i++) nobody[i] = VISIBILITY_NOTHING;
    pair_sampler_init(&points, seed, m->n, patches->opening);
    for (uint32_t line = 0; line < LINES; line += VISIBILITY_PACKET) {
        double x[4][VISIBILITY_PACKET], origin[VISIBILITY_PACKET][3], direction[VISIBILITY_PACKET][3];
        hit_packet sides[2];
        pair_sampler_packet(&points, line, x);
        lines_through(&p, &all, (const double(*)[VISIBILITY_PACKET])x, origin, direction);
        for (int s = 0; s < 2; s++)
            cast(v, (const double(*)[3])origin, (const double(*)[3])direction, NULL, s == 0 ? 1 : -1, nobody,
                 &sides[s]);
        for (int s = 0; s < 2; s++)
            add_lines(v, (const double(*)[3])origin, (const double(*)[3])direction, sides, s, &seen[s]);
    }
    for (int s = 0; s < 2; s++) {
        if (!of_open && seen[s].n > 0 && is_open_behind(m, v, seed, &seen[s])) seen[s].n_lines = 0;
        strength[s] = (double)seen[s].n_lines / LINES;
    }
done:
    portals_free(&p);
    return status;
}

/* Openings that all lines of another one may pass, at most, and how much larger than that one they may be. */
enum { BESIDE_MOST = 16 };
static const double beside_area = 1.5;

/* Keeps of list those openings that a line passes, too, on either side; the first line begins the list. */
static size_t keep_passed(const portals *all, const sky_line *line, bool first, size_t n, uint32_t *list) {
    uint32_t passed[2 * BESIDE_MOST];
    const double back[3] = {-line->direction[0], -line->direction[1], -line->direction[2]};
    size_t count = portals_passed(all, line->origin, line->direction, BESIDE_MOST, passed), kept = 0;
    count += portals_passed(all, line->origin, back, BESIDE_MOST, passed + count);
    if (first) {
        memcpy(list, passed, (count < BESIDE_MOST ? count : BESIDE_MOST) * sizeof *list);
        return count < BESIDE_MOST ? count : BESIDE_MOST;
    }
    for (size_t k = 0; k < n; k++)
        for (size_t c = 0; c < count; c++)
            if (passed[c] == list[k]) {
                list[kept++] = list[k];
                break;
            }
    return kept;
}

/* True where all lines of an opening pass another one that is not much larger and serves: in a thick wall
 * both of its faces have a hole. */
static bool is_doubled(const portals *all, const double *area, uint32_t opening, const seen_through seen[2],
                       double (*strength)[2]) {
    uint32_t list[BESIDE_MOST];
    size_t n = 0;
    bool first = true;
    for (int s = 0; s < 2; s++)
        for (size_t k = 0; k < seen[s].n_lines && (first || n > 0); k++, first = false)
            n = keep_passed(all, &seen[s].lines[k], first, n, list);
    for (size_t k = 0; k < n; k++)
        if (list[k] != opening && strength[list[k]][0] + strength[list[k]][1] > 0 &&
            area[list[k]] <= beside_area * area[opening])
            return true;
    return false;
}

/* Sets the strengths of openings to 0 that others double. */
static lam_status drop_doubled(const visibility *v, const face_openings *o, const seen_through (*seen)[2],
                               double (*strength)[2], bool *doubled, lam_error *error) {
    lam_status status = LAM_OK;
    portals all = {.n = 0};
    size_t n = 0;
    double *area = memory_allocate(o->n + 1, sizeof *area, "portals", error);
    portal *array = memory_allocate(o->n_patches + 1, sizeof *array, "portals", error);
    if (area == NULL || array == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < o->n_patches; k++) {
        const uint32_t opening = o->patches[k].opening;
        array[n] = portal_of(&o->patches[k], visibility_centre(v));
        area[opening] += array[n].area;
        n += strength[opening][0] + strength[opening][1] > 0;
    }
    status = portals_build(array, n, &all, error);
    array = NULL;
    TRY(status);
    for (uint32_t k = 0; k < o->n; k++)
        if (strength[k][0] + strength[k][1] > 0 && is_doubled(&all, area, k, seen[k], strength)) {
            strength[k][0] = strength[k][1] = 0;
            *doubled = true;
        }
done:
    portals_free(&all);
    free(array);
    free(area);
    return status;
}

lam_status portals_measure(const mesh *m, const visibility *v, uint64_t seed, const face_openings *openings,
                           bool of_open, double (*strength)[2], bool *doubled, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = openings->n;
    size_t *first = memory_allocate(n + 1, sizeof *first, "portals", error);
    seen_through(*seen)[2] = memory_allocate(n + 1, sizeof *seen, "portals", error);
    if (first == NULL || seen == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < openings->n_patches; k++) first[openings->patches[k].opening + 1] = k + 1;
#pragma omp parallel for schedule(dynamic, 1)
    for (size_t o = 0; o < n; o++) {
        lam_error own = {.message = ""};
        const lam_status one = measure_one(m, v, seed, openings->patches + first[o], first[o + 1] - first[o],
                                           of_open, strength[o], seen[o], &own);
        if (one == LAM_OK) continue;
#pragma omp critical(portal_strength)
        {
            status = one;
            *error = own;
        }
    }
    *doubled = false;
    TRY(status);
    TRY(drop_doubled(v, openings, (const seen_through(*)[2])seen, strength, doubled, error));
done:
    free(first);
    free(seen);
    return status;
}
