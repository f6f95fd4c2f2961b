/* The steps of walks, many side by side: rays, ends and Russian roulette. Knows neither targets nor
 * emissions. */
#ifndef LAMBERT_WALK_WALK_STEPS_H
#define LAMBERT_WALK_WALK_STEPS_H

#include "solver/base/random.h"
#include "solver/base/scene/scene_glass.h"
#include "solver/formfactor/visibility/visibility.h"
#include "solver/walk/walk.h"

/* Walks that take their steps side by side at most, a multiple of VISIBILITY_PACKET. */
enum { WALK_CHANNELS = 3, WALK_STREAM = 128 };

/* Parts of the facet of a shape: that of a light that is no part of the scene is WALK_NO_FACET. */
#define WALK_TRIANGLE 0x80000000u
#define WALK_NO_FACET 0x7FFFFFFFu

/* An element as walks need it, in one line of a cache: 16 numbers of 4 bytes, which kernels read as such. A
 * triangle or a parallelogram spanned by two edges; or a quadrilateral that is none, which is the triangle of
 * these edges and that of edge[1] and the third. */
typedef struct walk_shape {
    float corner[3], edge[2][3], normal[3]; /* recentred, the corner lifted */
    float third[3];                         /* 0 for others */
    uint32_t facet;                         /* of the scene, and WALK_TRIANGLE */
} walk_shape;

/* The numbers of an element that decide where a walk ends, which then reads no shape. */
typedef struct walk_colour {
    float of[WALK_CHANNELS + 1]; /* reflectance; the last one is free */
} walk_colour;

struct walk_scene {
    const mesh *m;
    visibility *v;
    walk_shape *shapes;       /* [n] */
    float *share;             /* [n]: of the area that the first triangle of a shape has; 1 for all but
                               * quadrilaterals that are no parallelograms */
    walk_colour *reflectance; /* [n] */
    bool closed;              /* rays leave through cracks only */
    bool fronts;              /* rays hit backs through cracks only */
};

/* One walk that starts. */
typedef struct walker {
    uint32_t at;                  /* the element that its first ray leaves */
    uint32_t path;                /* its number among those of the caller */
    uint32_t place[4];            /* in 2^-32: two for the point, two for the direction */
    double weight[WALK_CHANNELS]; /* of what it has met; power when it was shot; 0 beyond the channels */
    uint64_t random;              /* its own stream */
} walker;

/* Walks on their way, one array for each number, so that vector registers take many of them. */
typedef struct walk_stream {
    uint32_t at[WALK_STREAM], path[WALK_STREAM], place[4][WALK_STREAM]; /* as of a walker */
    uint32_t lost[WALK_STREAM]; /* rays through cracks since it came there */
    double weight[WALK_CHANNELS][WALK_STREAM];
    uint64_t random[WALK_STREAM];
} walk_stream;

/* All walks of an estimate, for progress. */
typedef struct walk_run {
    const progress *progress;
    const char *stage;
    double begun, all; /* walks */
    bool stop;
    walk_log *log; /* or NULL */
} walk_run;

/* Walks that share a stream of starts. start sets all of the next n walkers, or fewer after the last one, and
 * returns how many; weights are 0 before. arrive is called when walks come to the fronts of elements, or to
 * VISIBILITY_NOTHING where one of them does not. */
typedef struct walk_batch {
    const walk_scene *scene;
    walk_run *run;
    size_t (*start)(void *context, size_t n, walker *w);
    void (*arrive)(void *context, size_t n, const walk_stream *w, const uint32_t *element);
    void *context;
    double *rays; /* counts those that are cast; or NULL */
} walk_batch;

/* Keeps packets of rays that were cast, for measurements. */
void walk_log_add(walk_log *log, size_t n_packets, const ray_packet *rays);

/* Takes all walks of a batch from their start to their end, or until run->stop. */
void walk_batch_go(const walk_batch *b);

/* A new place at random, from the walk's own stream. */
void walk_draw_place(walker *w);

/* Puts a walk that starts into a place of a stream. */
void walk_stream_set(walk_stream *s, size_t i, const walker *w);

/* Russian roulette at an element: the walk goes on with the probability
 *     q = max_c (rho_c w_c) / max_c w_c,        w_c <- rho_c w_c / q,
 * which leaves the expectation of every channel as it is and the largest weight too. The weights of a walk
 * that ends are never read: a branch for them would be mispredicted half of the time. */
static inline bool walk_survives(const walk_scene *s, walker *w, uint32_t element) {
    const float *reflectance = s->reflectance[element].of;
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

/* The largest weight of a walk, over that at its start: each pane on its way makes it 1 + T times as large,
 * of which one is taken to be there. Few walks meet more, and the bound is for estimates of few visits. */
static inline double walk_heaviest(const mesh *m) {
    double most = 0;
    for (size_t g = 0; g < m->n_glass; g++)
        most = m->glass[g].transmittance > most ? m->glass[g].transmittance : most;
    return 1 + most;
}

/* Makes the shapes of a scene, freed with it. Errors: LAM_ERR_MEMORY. */
lam_status walk_shapes_create(walk_scene *s, lam_error *error);

/* The rays that leave shapes [n] with the shares [n] of their first triangles from places [4][WALK_STREAM], n
 * rounded up to packets: origins uniform over shapes, directions cosine-weighted. facet[i] is that of the
 * shape, or VISIBILITY_NOTHING. */
void walk_leave(size_t n, const walk_shape *const *shape, const float *share,
                const uint32_t (*place)[WALK_STREAM], ray_packet *rays, uint32_t *facet);

/* Casts the next rays of the first n walks of a stream from their places: packets of rays and of hits. Walks
 * beyond the n are overwritten and meet nothing. */
void walk_cast(const walk_scene *s, walk_stream *w, size_t n, ray_packet *rays, hit_packet *hits);

/* A walk that has lost so many rays in a row is in a corner that single precision cannot leave: it ends. */
enum { WALK_LOST_MOST = 64 };

/* Sets the elements to whose fronts the rays of n walks have led, else VISIBILITY_NOTHING; again[i] is 1 for
 * a walk that leaves its element, but no light, by another ray, because this one slipped through a crack,
 * else 0. met and again are [WALK_STREAM]. */
void walk_stream_meet(const walk_scene *s, const walk_stream *w, size_t n, const hit_packet *hits,
                      uint32_t *met, uint32_t *again);

/* Takes n walks to what they have met: Russian roulette (walk_survives) by the reflectances there
 * [WALK_CHANNELS][WALK_STREAM], and new places for those that go on; alive[i] is 1 for these, else 0. */
void walk_stream_survive(walk_stream *s, size_t n, const uint32_t *met, const uint32_t *again,
                         const float (*reflectance)[WALK_STREAM], uint32_t *alive);

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
