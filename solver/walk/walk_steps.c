#include "solver/walk/walk_steps.h"

#include "solver/base/cosine.h"
#include "solver/base/random.h"
#include "solver/formfactor/visibility/sample.h"

#include <math.h>

/* A walk that has lost so many rays in a row is in a corner that single precision cannot leave: it ends. */
enum { LOST_MOST = 64 };

/* Packets between two looks at the progress. */
enum { PACKETS_AT_ONCE = 4096 };

void walk_cast(const walk_scene *s, const walker *w, size_t n, ray_packet *rays, hit_packet *hits) {
    uint32_t self[VISIBILITY_PACKET];
    for (size_t i = 0; i < VISIBILITY_PACKET; i++) {
        if (i >= n) { /* not cast, but read */
            for (int d = 0; d < 3; d++) rays->origin[d][i] = rays->direction[d][i] = 0;
            self[i] = VISIBILITY_NOTHING;
            continue;
        }
        const double *place = w[i].place;
        element_sampler sampler;
        float origin[3], direction[3];
        element_sampler_init(&sampler, s->m, s->v, w[i].at, 0);
        const element_frame *f = &sampler.frame;
        element_sampler_point(&sampler, (float)place[0], (float)place[1], origin);
        cosine_direction(f->tangent, f->bitangent, f->normal, place[2], place[3], direction);
        for (int d = 0; d < 3; d++) {
            rays->origin[d][i] = origin[d];
            rays->direction[d][i] = direction[d];
        }
        self[i] = w[i].at;
    }
    visibility_cast(s->v, rays, n, self, 0, hits);
}

void walk_draw_place(walker *w) {
    for (int d = 0; d < 4; d++) w->place[d] = random_unit(&w->random);
}

bool walk_survives(const mesh *m, walker *w, uint32_t element) {
    double before = 0, after = 0;
    for (size_t c = 0; c < m->n_channels; c++) {
        before = fmax(before, w->weight[c]);
        w->weight[c] *= (double)m->reflectance[c * m->n + element];
        after = fmax(after, w->weight[c]);
    }
    if (!(random_unit(&w->random) * before < after)) return false;
    for (size_t c = 0; c < m->n_channels; c++) w->weight[c] *= before / after;
    return true;
}

/* Takes a walk to where its ray led; false where it ends. */
static bool advance(const walk_batch *b, walker *w, uint32_t element, bool back) {
    const walk_scene *s = b->scene;
    if (element == VISIBILITY_NOTHING || back || element == w->at) {
        const bool crack = element == VISIBILITY_NOTHING ? s->closed : back ? s->fronts : true;
        if (!crack || ++w->lost == LOST_MOST) return false;
        walk_draw_place(w);
        return true;
    }
    b->arrive(b->context, w, element);
    if (!walk_survives(s->m, w, element)) return false;
    w->at = element;
    w->lost = 0;
    walk_draw_place(w);
    return true;
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
    walker w[VISIBILITY_PACKET];
    ray_packet rays;
    hit_packet hits;
    size_t n = 0, begun = 0;
    if (!go_on(b->run, 0)) return;
    for (size_t packet = 1;; packet++) {
        while (n < VISIBILITY_PACKET && b->start(b->context, &w[n])) {
            w[n++].lost = 0;
            begun++;
        }
        if (n == 0) break;
        walk_cast(b->scene, w, n, &rays, &hits);
        if (b->rays != NULL) *b->rays += (double)n;
        size_t kept = 0;
        for (size_t i = 0; i < n; i++)
            if (advance(b, &w[i], hits.element[i], hits.back[i])) w[kept++] = w[i];
        n = kept;
        if (packet % PACKETS_AT_ONCE == 0) {
            if (!go_on(b->run, begun)) return;
            begun = 0;
        }
    }
    go_on(b->run, begun);
}

void walk_starts_init(walk_starts *s, uint64_t seed, uint64_t key, size_t count) {
    uint64_t state = random_hash(random_hash(seed) ^ random_hash(key + 1));
    *s = (walk_starts){.count = count};
    s->turn = random_unit(&state);
    for (int d = 0; d < 4; d++) s->shift[d] = (uint32_t)(random_next(&state) >> 32);
    s->random = random_next(&state);
}

bool walk_starts_next(walk_starts *s, const double *before, size_t n, walker *w, size_t *k) {
    /* The 4-d Kronecker sequence of the generalised golden ratio (Roberts 2018): frac(phi^-d), phi^5 = phi +
     * 1, in units of 2^-32. */
    static const uint32_t step[4] = {3679390609u, 3152041523u, 2700274807u, 2313257605u};
    if (s->next >= s->count) return false;
    const double x = ((double)s->next + s->turn) / (double)s->count * before[n];
    while (s->cursor + 1 < n && before[s->cursor + 1] <= x) s->cursor++;
    *k = s->cursor;
    for (int d = 0; d < 4; d++)
        w->place[d] = (double)(uint32_t)(s->shift[d] + (uint32_t)s->next * step[d]) * 0x1p-32;
    w->random = random_hash(s->random + s->next);
    s->next++;
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
