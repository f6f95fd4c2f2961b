#include "solver/walk/walk_steps.h"

#include "solver/formfactor/visibility/sobol.h"

#include <math.h>
#include <string.h>

/* A walk that has lost so many rays in a row is in a corner that single precision cannot leave: it ends. */
enum { LOST_MOST = 64 };

/* Steps of all walks between two looks at the progress. */
enum { STREAMS_AT_ONCE = 128 };

void walk_draw_place(walker *w) {
    for (int d = 0; d < 4; d += 2) {
        const uint64_t bits = random_next(&w->random);
        w->place[d] = (uint32_t)bits;
        w->place[d + 1] = (uint32_t)(bits >> 32);
    }
}

/* The element that the ray of a walk has led to the front of, else VISIBILITY_NOTHING. */
static uint32_t front_met(const walker *w, const hit_packet *hits, size_t lane) {
    const uint32_t element = hits->element[lane];
    return hits->back[lane] || element == w->at ? VISIBILITY_NOTHING : element;
}

/* True for a walk that leaves its element by another ray, because this one slipped through a crack. */
static bool leaves_again(const walk_scene *s, walker *w, const hit_packet *hits, size_t lane) {
    const bool crack = hits->element[lane] == VISIBILITY_NOTHING ? s->closed
                       : hits->back[lane]                        ? s->fronts
                                                                 : true;
    if (!crack || ++w->lost == LOST_MOST) return false;
    walk_draw_place(w);
    return true;
}

/* Takes n walks to where their rays led; returns how many go on, those in front. */
static size_t advance(const walk_batch *b, size_t n, walker *w, const hit_packet *hits) {
    uint32_t met[WALK_STREAM];
    size_t kept = 0;
    for (size_t i = 0; i < n; i++) {
        met[i] = front_met(&w[i], &hits[i / VISIBILITY_PACKET], i % VISIBILITY_PACKET);
        if (met[i] != VISIBILITY_NOTHING) __builtin_prefetch(&b->scene->shapes[met[i]]);
    }
    b->arrive(b->context, n, w, met);
    for (size_t i = 0; i < n; i++) {
        walker *const of = &w[kept];
        *of = w[i];
        if (met[i] == VISIBILITY_NOTHING) {
            kept += leaves_again(b->scene, of, &hits[i / VISIBILITY_PACKET], i % VISIBILITY_PACKET);
            continue;
        }
        kept += walk_survives(b->scene, of, met[i]);
        of->at = met[i];
        of->lost = 0;
        walk_draw_place(of);
    }
    return kept;
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
    walker w[WALK_STREAM];
    ray_packet rays[WALK_STREAM / VISIBILITY_PACKET];
    hit_packet hits[WALK_STREAM / VISIBILITY_PACKET];
    size_t n = 0, begun = 0;
    if (!go_on(b->run, 0)) return;
    for (size_t stream = 1;; stream++) {
        for (; n < WALK_STREAM; n++, begun++) {
            w[n].lost = 0;
            for (int c = 0; c < WALK_CHANNELS; c++) w[n].weight[c] = 0;
            if (!b->start(b->context, &w[n])) break;
        }
        if (n == 0) break;
        walk_cast(b->scene, w, n, rays, hits);
        walk_log_add(b->run->log, n / VISIBILITY_PACKET, rays);
        if (b->rays != NULL) *b->rays += (double)n;
        n = advance(b, n, w, hits);
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
