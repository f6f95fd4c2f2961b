#include "solver/formfactor/visibility/sun_rays.h"

#include "solver/formfactor/visibility/pane_path.h"
#include "solver/formfactor/visibility/sample.h"

#include <math.h>
#include <stdlib.h>

/* An element of which the sun reaches a part is looked at by so many times as many points, from so many on.
 * Fewer miss too many of the small parts: then parts that are found would weigh too little beside them. */
enum { FINER = 8, FINER_FROM = 16 };

struct sun_rays {
    const mesh *m;
    visibility *v;
    size_t n_points, n_wanted;
    uint64_t seed;
    uint32_t *wanted;   /* [n_wanted] */
    float (*points)[3]; /* [n_wanted][n_points], recentred */
};

void sun_rays_free(sun_rays *s) {
    if (s == NULL) return;
    visibility_destroy(s->v);
    free(s->wanted);
    free(s->points);
    free(s);
}

/* Point k of n, a Kronecker lattice: in strip k along u, at multiples of the golden section along w. */
static void place(const element_sampler *area, const double turn[4], size_t k, size_t n, float point[3]) {
    const double u = ((double)k + turn[0]) / (double)n;
    double w = turn[1] + (double)k * .6180339887498949;
    w -= floor(w);
    element_sampler_point(area, (float)u, (float)w, point);
}

/* The lattice of an element, and the shift of it. */
static void begin_lattice(const sun_rays *s, uint32_t element, element_sampler *area, double turn[4]) {
    pair_sampler dice;
    element_sampler_init(area, s->m, s->v, element, s->seed);
    pair_sampler_init(&dice, s->seed, element, element);
    pair_sampler_place(&dice, 0, turn);
}

lam_status sun_rays_create(const mesh *m, size_t n_points, uint64_t seed, size_t n_wanted,
                           const uint32_t *wanted, sun_rays **out, lam_error *error) {
    lam_status status = LAM_OK;
    size_t count;
    sun_rays *s = memory_allocate(1, sizeof *s, "rays to the sun", error);
    if (s == NULL) return LAM_ERR_MEMORY;
    s->m = m;
    s->n_points = n_points;
    s->seed = seed;
    s->n_wanted = wanted != NULL ? n_wanted : m->n;
    if (!size_multiply(s->n_wanted, n_points, &count))
        FAIL(error, LAM_ERR_MEMORY, "rays to the sun: too many points");
    s->wanted = memory_allocate(s->n_wanted, sizeof *s->wanted, "rays to the sun", error);
    s->points = memory_allocate(count, sizeof *s->points, "rays to the sun", error);
    if (s->wanted == NULL || s->points == NULL) TRY(LAM_ERR_MEMORY);
    TRY(visibility_create(m, &s->v, error));
    for (size_t i = 0; i < s->n_wanted; i++) {
        s->wanted[i] = wanted != NULL ? wanted[i] : (uint32_t)i;
        element_sampler area;
        double turn[4];
        begin_lattice(s, s->wanted[i], &area, turn);
        for (size_t k = 0; k < n_points; k++) place(&area, turn, k, n_points, s->points[i * n_points + k]);
    }
    *out = s;
    s = NULL;
done:
    sun_rays_free(s);
    return status;
}

/* The rays of a packet that is being filled. */
typedef struct waiting {
    size_t n;
    ray_packet rays;
    uint32_t self[VISIBILITY_PACKET];
} waiting;

static void cast(const sun_rays *s, waiting *w, const float share[], float *seen) {
    hit_packet hits;
    double passed[VISIBILITY_PACKET] = {1, 1, 1, 1, 1, 1, 1, 1};
    visibility_cast(s->v, &w->rays, w->n, w->self, 0, &hits);
    pane_path_follow(s->v, s->m, &w->rays, w->n, &hits, passed, NULL);
    for (size_t k = 0; k < w->n; k++)
        if (hits.element[k] == VISIBILITY_NOTHING) seen[w->self[k]] += (float)passed[k] * share[k];
    w->n = 0;
}

static double facing_of(const sun_rays *s, uint32_t element, const double direction[3]) {
    const float *normal = s->m->normal[element];
    return (double)normal[0] * direction[0] + (double)normal[1] * direction[1] +
           (double)normal[2] * direction[2];
}

/* Adds a ray of an element, whose share of the light it is. */
static void add_ray(const sun_rays *s, waiting *w, const float point[3], const double direction[3],
                    uint32_t element, double share, float shares[], float *seen) {
    for (int d = 0; d < 3; d++) {
        w->rays.origin[d][w->n] = point[d];
        w->rays.direction[d][w->n] = (float)direction[d];
    }
    shares[w->n] = (float)share;
    w->self[w->n++] = element;
    if (w->n == VISIBILITY_PACKET) cast(s, w, shares, seen);
}

/* Casts the rays of the wanted elements first ... end - 1 in one direction. */
static void cast_block(const sun_rays *s, size_t first, size_t end, const double direction[3], float *seen) {
    waiting w = {.n = 0};
    float shares[VISIBILITY_PACKET];
    const size_t n = s->n_points, finer = FINER * n;
    for (size_t i = first; i < end; i++) {
        const uint32_t element = s->wanted[i];
        const double facing = facing_of(s, element, direction);
        seen[element] = 0;
        for (size_t k = 0; facing > 0 && k < n; k++)
            add_ray(s, &w, s->points[i * n + k], direction, element, facing / (double)n, shares, seen);
    }
    if (w.n > 0) cast(s, &w, shares, seen);
    for (size_t i = first; i < end && n >= FINER_FROM; i++) {
        const uint32_t element = s->wanted[i];
        const double facing = facing_of(s, element, direction), one = facing / (double)n;
        /* Sums of shares are rounded. */
        if (facing <= 0 || (double)seen[element] < .5 * one || (double)seen[element] > facing - .5 * one)
            continue;
        element_sampler area;
        double turn[4];
        begin_lattice(s, element, &area, turn);
        seen[element] = 0;
        for (size_t k = 0; k < finer; k++) {
            float point[3];
            place(&area, turn, k, finer, point);
            add_ray(s, &w, point, direction, element, facing / (double)finer, shares, seen);
        }
    }
    if (w.n > 0) cast(s, &w, shares, seen);
}

void sun_rays_cast(const sun_rays *s, size_t n_directions, const double (*direction)[3], float *const *seen) {
    enum { TOGETHER = 256 }; /* elements whose rays share packets, independently of threads */
    const size_t n_blocks = (s->n_wanted + TOGETHER - 1) / TOGETHER;
#pragma omp parallel for collapse(2) schedule(dynamic, 1)
    for (size_t block = 0; block < n_blocks; block++)
        for (size_t k = 0; k < n_directions; k++) {
            const size_t first = block * TOGETHER;
            const size_t end = first + TOGETHER < s->n_wanted ? first + TOGETHER : s->n_wanted;
            cast_block(s, first, end, direction[k], seen[k]);
        }
}
