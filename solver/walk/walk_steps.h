/* The steps of walks, many side by side: rays, ends and Russian roulette. Knows neither targets nor
 * emissions. */
#ifndef LAMBERT_WALK_WALK_STEPS_H
#define LAMBERT_WALK_WALK_STEPS_H

#include "solver/base/random.h"
#include "solver/formfactor/visibility/visibility.h"
#include "solver/walk/walk.h"

/* Walks that take their steps side by side at most, a multiple of VISIBILITY_PACKET. */
enum { WALK_CHANNELS = 3, WALK_STREAM = 256 };

#define WALK_TRIANGLE 0x80000000u

/* An element as walks need it, in one line of a cache. */
typedef struct walk_shape {
    float corner[3], edge[2][3], normal[3]; /* recentred, the corner lifted; a triangle, or a parallelogram */
    float reflectance[WALK_CHANNELS];
    uint32_t facet; /* of the scene, and WALK_TRIANGLE */
} walk_shape;

/* The places that a packet of rays leaves. */
typedef struct walk_places {
    float corner[3][VISIBILITY_PACKET], edge[2][3][VISIBILITY_PACKET], normal[3][VISIBILITY_PACKET];
    float fold[VISIBILITY_PACKET];                                          /* 1/2 for triangles, else 0 */
    float u[VISIBILITY_PACKET], w[VISIBILITY_PACKET], x[VISIBILITY_PACKET]; /* in [0, 1) */
    uint32_t turn[VISIBILITY_PACKET];                                       /* in 2^-32 of a turn */
} walk_places;

/* A quadrilateral that is no parallelogram is the triangle of its shape and that of edge[1] and a third one.
 */
typedef struct walk_halves {
    float share; /* of the area that the first triangle has; 1 for other elements */
    float third[3];
} walk_halves;

struct walk_scene {
    const mesh *m;
    visibility *v;
    walk_shape *shapes;  /* [n] */
    walk_halves *halves; /* [n], or NULL where no element needs them */
    bool closed;         /* rays leave through cracks only */
    bool fronts;         /* rays hit backs through cracks only */
};

/* One walk. */
typedef struct walker {
    uint32_t at;                  /* the element that its next ray leaves */
    uint32_t path;                /* its number among those of the caller */
    unsigned lost;                /* rays through cracks since it came there */
    uint32_t place[4];            /* in 2^-32: two for the point, two for the direction */
    double weight[WALK_CHANNELS]; /* of what it has met; power when it was shot; 0 beyond the channels */
    uint64_t random;              /* its own stream */
} walker;

/* All walks of an estimate, for progress. */
typedef struct walk_run {
    const progress *progress;
    const char *stage;
    double begun, all; /* walks */
    bool stop;
    walk_log *log; /* or NULL */
} walk_run;

/* Walks that share a stream of starts. start sets element, place, weights (0 before) and random of the next
 * walk, or returns false after the last one; arrive is called when walks come to the fronts of elements, or
 * to VISIBILITY_NOTHING where one of them does not. */
typedef struct walk_batch {
    const walk_scene *scene;
    walk_run *run;
    bool (*start)(void *context, walker *w);
    void (*arrive)(void *context, size_t n, const walker *w, const uint32_t *element);
    void *context;
    double *rays; /* counts those that are cast; or NULL */
} walk_batch;

/* Keeps packets of rays that were cast, for measurements. */
void walk_log_add(walk_log *log, size_t n_packets, const ray_packet *rays);

/* Takes all walks of a batch from their start to their end, or until run->stop. */
void walk_batch_go(const walk_batch *b);

/* A new place at random, from the walk's own stream. */
void walk_draw_place(walker *w);

/* Russian roulette at an element: the walk goes on with the probability
 *     q = max_c (rho_c w_c) / max_c w_c,        w_c <- rho_c w_c / q,
 * which leaves the expectation of every channel as it is and the largest weight too. The weights of a walk
 * that ends are never read: a branch for them would be mispredicted half of the time. */
static inline bool walk_survives(const walk_scene *s, walker *w, uint32_t element) {
    const float *reflectance = s->shapes[element].reflectance;
    double before = 0, after = 0, weight[WALK_CHANNELS];
    for (size_t c = 0; c < WALK_CHANNELS; c++) {
        before = w->weight[c] > before ? w->weight[c] : before;
        weight[c] = w->weight[c] * (double)reflectance[c];
        after = weight[c] > after ? weight[c] : after;
    }
    const double scale = before / after;
    for (size_t c = 0; c < WALK_CHANNELS; c++) w->weight[c] = weight[c] * scale;
    return random_unit(&w->random) * before < after;
}

/* Makes the shapes of a scene, freed with it. Errors: LAM_ERR_MEMORY. */
lam_status walk_shapes_create(walk_scene *s, lam_error *error);

/* Lane i: the point and the direction of the numbers that a walker has for them. */
void walk_place_set(walk_places *p, size_t i, const walk_shape *shape, const uint32_t place[4]);

/* The rays that leave n packets of places: origins uniform over shapes, directions cosine-weighted. */
void walk_leave(const walk_places *p, size_t n, ray_packet *rays);

/* Casts the next rays of n walks, at most WALK_STREAM, from their places: packets of rays and of hits. */
void walk_cast(const walk_scene *s, const walker *w, size_t n, ray_packet *rays, hit_packet *hits);

/* The starts of one batch: low-discrepancy places, and strata of what elements are chosen by. */
typedef struct walk_starts {
    size_t next, count;
    double turn;       /* of the strata */
    uint32_t place[4]; /* of the next walk: a point of Sobol's sequence, shifted by random bits */
    uint64_t random;
    size_t cursor;
} walk_starts;

/* key tells the batches of a seed apart. */
void walk_starts_init(walk_starts *s, uint64_t seed, uint64_t key, size_t count);

/* The place and the stream of the next walk, and the index k with before[k] <= x < before[k + 1] for its
 * stratum x of [0, before[n]), n > 0: with the probability (before[k + 1] - before[k]) / before[n]. */
bool walk_starts_next(walk_starts *s, const double *before, size_t n, walker *w, size_t *k);

/* before[k + 1] = sum of share[0 ... k]; returns before[n]. */
double walk_accumulate(size_t n, const double *share, double *before);

/* Checks a problem and allocates its estimates. */
lam_status walk_estimates_create(const walk_scene *s, const walk_problem *problem, walk_estimates *out,
                                 lam_error *error);

/* The mean and its standard error from the means of the batches, batch b at values[b * stride]. */
void walk_batches_join(const double *values, size_t stride, double *mean, double *error);

/* Adds the mean emission of the targets where the quantity is the radiosity. */
void walk_add_emission(const mesh *m, const walk_problem *problem, walk_estimates *e);

/* LAM_ERR_CANCELLED where a run was stopped. */
lam_status walk_run_end(const walk_run *run, lam_error *error);

#endif
