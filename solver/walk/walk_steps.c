#include "solver/walk/walk_steps.h"

#include "solver/formfactor/visibility/sobol.h"

#include <math.h>
#include <string.h>

/* Steps of all walks between two looks at the progress. */
enum { STREAMS_AT_ONCE = 128 };

void walk_draw_place(walker *w) {
    for (int d = 0; d < 4; d += 2) {
        const uint64_t bits = random_next(&w->random);
        w->place[d] = (uint32_t)bits;
        w->place[d + 1] = (uint32_t)(bits >> 32);
    }
}

void walk_stream_set(walk_stream *s, size_t i, const walker *w) {
    s->at[i] = w->at;
    s->path[i] = w->path;
    s->lost[i] = 0;
    s->random[i] = w->random;
    for (int d = 0; d < 4; d++) s->place[d][i] = w->place[d];
    for (int c = 0; c < WALK_CHANNELS; c++) s->weight[c][i] = w->weight[c];
}

static void move_walk(walk_stream *s, size_t from, size_t to) {
    s->at[to] = s->at[from];
    s->path[to] = s->path[from];
    s->lost[to] = s->lost[from];
    s->random[to] = s->random[from];
    for (int d = 0; d < 4; d++) s->place[d][to] = s->place[d][from];
    for (int c = 0; c < WALK_CHANNELS; c++) s->weight[c][to] = s->weight[c][from];
}

/* Fills the free places of a stream of n with walks that start, and closes the gaps that remain; returns the
 * new n. The places are in ascending order. */
static size_t refill(const walk_batch *b, walk_stream *w, size_t n, size_t n_free, const uint32_t *place,
                     size_t *begun) {
    walker fresh[WALK_STREAM];
    for (size_t k = 0; k < n_free; k++) fresh[k] = (walker){.weight = {0}};
    const size_t started = b->start(b->context, n_free, fresh);
    for (size_t k = 0; k < started; k++) walk_stream_set(w, place[k], &fresh[k]);
    *begun += started;
    /* The last place is a gap itself, or that of a walk. */
    for (size_t k = n_free; k-- > started;)
        if (place[k] != --n) move_walk(w, n, place[k]);
    return n;
}

/* Element 0 in place of VISIBILITY_NOTHING, without a branch, which would be mispredicted. */
static inline size_t element_or_first(uint32_t element) {
    return element & (uint32_t)-(int)(element != VISIBILITY_NOTHING);
}

/* Takes n walks to what they have met. Walks that end leave free places, in ascending order; returns how
 * many. */
static size_t advance(const walk_scene *s, walk_stream *w, size_t n, const uint32_t *met,
                      const uint32_t *again, uint32_t *place) {
    float reflectance[WALK_CHANNELS][WALK_STREAM];
    uint32_t alive[WALK_STREAM];
    size_t n_free = 0;
    for (size_t i = 0; i < n; i++) {
        const walk_colour *colour = &s->reflectance[element_or_first(met[i])];
        for (int c = 0; c < WALK_CHANNELS; c++) reflectance[c][i] = colour->of[c];
    }
    walk_stream_survive(w, n, met, again, reflectance, alive);
    for (size_t i = 0; i < n; i++) {
        place[n_free] = (uint32_t)i;
        n_free += 1 - alive[i];
    }
    return n_free;
}

/* Counts walks that have begun; false where the run has to stop. */
static bool go_on(walk_run *run, size_t begun) {
    bool stop;
#pragma omp critical(walk_progress)
    {
        run->begun += (double)begun;
        progress_report(run->progress, run->stage, run->begun / run->all);
        run->stop = run->stop || progress_cancelled(run->progress);
        stop = run->stop;
    }
    return !stop;
}

void walk_batch_go(const walk_batch *b) {
    walk_stream w;
    ray_packet rays[WALK_STREAM / VISIBILITY_PACKET];
    hit_packet hits[WALK_STREAM / VISIBILITY_PACKET];
    uint32_t met[WALK_STREAM], again[WALK_STREAM], place[WALK_STREAM];
    size_t n = WALK_STREAM, n_free = WALK_STREAM, begun = 0;
    if (!go_on(b->run, 0)) return;
    for (uint32_t i = 0; i < WALK_STREAM; i++) place[i] = i;
    for (size_t stream = 1;; stream++) {
        n = refill(b, &w, n, n_free, place, &begun);
        if (n == 0) break;
        walk_cast(b->scene, &w, n, rays, hits);
        walk_log_add(b->run->log, n / VISIBILITY_PACKET, rays);
        if (b->rays != NULL) *b->rays += (double)n;
        walk_stream_meet(b->scene, &w, n, hits, met, again);
        for (size_t i = 0; i < n; i++) {
            const size_t at = element_or_first(met[i]);
            __builtin_prefetch(&b->scene->reflectance[at]);
            __builtin_prefetch(&b->scene->shapes[at]);
        }
        b->arrive(b->context, n, &w, met);
        n_free = advance(b->scene, &w, n, met, again, place);
        if (stream % STREAMS_AT_ONCE == 0) {
            if (!go_on(b->run, begun)) return;
            begun = 0;
        }
    }
    go_on(b->run, begun);
}

/* The first two dimensions of the sequence, which are more even in pairs than the others, for the direction.
 */
static const int start_dimension[4] = {2, 3, 0, 1};

void walk_starts_init(walk_starts *s, uint64_t seed, uint64_t key, size_t count) {
    uint64_t state = random_hash(random_hash(seed) ^ random_hash(key + 1));
    *s = (walk_starts){.count = count};
    s->turn = random_unit(&state);
    for (int d = 0; d < 4; d++) s->place[d] = (uint32_t)(random_next(&state) >> 32);
    s->random = random_next(&state);
}

bool walk_starts_next(walk_starts *s, const double *before, size_t n, walker *w, size_t *k) {
    if (s->next >= s->count) return false;
    const double x = ((double)s->next + s->turn) / (double)s->count * before[n];
    while (s->cursor + 1 < n && before[s->cursor + 1] <= x) s->cursor++;
    *k = s->cursor;
    memcpy(w->place, s->place, sizeof w->place);
    w->random = random_hash(s->random + s->next);
    s->next++;
    /* The order of Gray codes: one bit of the index changes at each step (Antonov and Saleev 1979). */
    const int bit = __builtin_ctz((uint32_t)s->next | 1u << (SOBOL_BITS - 1));
    for (int d = 0; d < 4; d++) s->place[d] ^= sobol_direction[start_dimension[d]][bit];
    return true;
}

double walk_accumulate(size_t n, const double *share, double *before) {
    before[0] = 0;
    for (size_t k = 0; k < n; k++) before[k + 1] = before[k] + share[k];
    return before[n];
}

void walk_batches_join(const double *values, size_t stride, double *mean, double *error) {
    double sum = 0, squares = 0;
    for (size_t b = 0; b < WALK_BATCHES; b++) sum += values[b * stride];
    *mean = sum / WALK_BATCHES;
    for (size_t b = 0; b < WALK_BATCHES; b++)
        squares += (values[b * stride] - *mean) * (values[b * stride] - *mean);
    *error = sqrt(squares / (WALK_BATCHES * (WALK_BATCHES - 1)));
}

lam_status walk_run_end(const walk_run *run, lam_error *error) {
    return run->stop ? status_fail(error, LAM_ERR_CANCELLED, "cancelled") : LAM_OK;
}
