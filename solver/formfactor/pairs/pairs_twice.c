#include "solver/formfactor/pairs/pairs_twice.h"

#include "solver/base/random.h"
#include "solver/formfactor/sight/occlusion.h"

#include <math.h>
#include <stdlib.h>

void known_pairs_free(known_pairs *k) {
    pair_rows_free(&k->rows);
    free(k->position);
    k->position = NULL;
}

/* The entry of a pair; NULL: there is none. */
static const float *find_entry(const known_pairs *k, uint32_t i, uint32_t j, uint8_t *state) {
    const pair_block *block;
    size_t at;
    if (!pair_rows_find(&k->rows, k->position[i], k->position[j], &block, &at)) return NULL;
    *state = block->state[at];
    return &block->exchange[at];
}

static bool is_projected_again(uint32_t i, uint32_t j, uint64_t seed) {
    const uint64_t low = i < j ? i : j, high = i < j ? j : i;
    return random_hash(random_hash(seed) ^ random_hash(low << 32 | high)) % PAIRS_AGAIN == 0;
}

int known_pairs_look(const known_pairs *k, uint32_t i, uint32_t j, uint64_t seed, double *g) {
    uint8_t state;
    const float *exchange = find_entry(k, i, j, &state);
    if (exchange == NULL || (state != PAIR_CERTAIN && (state & PAIR_EXACT) == 0)) return PAIR_UNKNOWN;
    if (state == (PAIR_MIXED | PAIR_EXACT) && is_projected_again(i, j, seed)) return PAIR_UNKNOWN;
    if (state != PAIR_CERTAIN) *g = (double)*exchange;
    return state;
}

/* sqrt((2 - q) / q) of a pair that was projected, 1 of any other. */
static double factor_of_noise(const known_pairs *k, uint32_t i, uint32_t j) {
    const double q = 1. / PAIRS_AGAIN;
    uint8_t state;
    return find_entry(k, i, j, &state) != NULL && (state & PAIR_EXACT) != 0 ? sqrt((2 - q) / q) : 1;
}

/* The next entry of either row, at *a and *b; its values are 0 where a row lacks it. False: there is none. */
static bool next_entry(const csr G[2], size_t i, uint64_t at[2], uint32_t *j, float g[2]) {
    const bool left[2] = {at[0] < G[0].indptr[i + 1], at[1] < G[1].indptr[i + 1]};
    if (!left[0] && !left[1]) return false;
    *j = UINT32_MAX;
    for (int h = 0; h < 2; h++)
        if (left[h] && G[h].indices[at[h]] < *j) *j = G[h].indices[at[h]];
    for (int h = 0; h < 2; h++) {
        const bool there = left[h] && G[h].indices[at[h]] == *j;
        g[h] = there ? G[h].data[at[h]++] : 0;
    }
    return true;
}

/* The mean of two samples, and the same disturbed by its noise: both have the entries of both. */
static lam_status combine(const known_pairs *k, const csr samples[2], csr out[2], lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = samples[0].n;
    csr made[2] = {{.n = n}, {.n = n}};
    for (int h = 0; h < 2; h++) {
        made[h].indptr = memory_allocate(n + 1, sizeof *made[h].indptr, "form factor rows", error);
        if (made[h].indptr == NULL) TRY(LAM_ERR_MEMORY);
    }
    for (size_t i = 0; i < n; i++) {
        uint64_t at[2] = {samples[0].indptr[i], samples[1].indptr[i]};
        uint32_t j;
        float g[2];
        made[0].indptr[i + 1] = made[0].indptr[i];
        while (next_entry(samples, i, at, &j, g)) made[0].indptr[i + 1]++;
        made[1].indptr[i + 1] = made[0].indptr[i + 1];
    }
    for (int h = 0; h < 2; h++) TRY(csr_reserve(&made[h], made[h].indptr[n], error));
#pragma omp parallel for schedule(dynamic, 64)
    for (size_t i = 0; i < n; i++) {
        uint64_t at[2] = {samples[0].indptr[i], samples[1].indptr[i]}, to = made[0].indptr[i];
        uint32_t j;
        float g[2];
        for (; next_entry(samples, i, at, &j, g); to++) {
            const double mean = .5 * ((double)g[0] + (double)g[1]), half = .5 * ((double)g[0] - (double)g[1]);
            const double noise = g[0] != g[1] ? factor_of_noise(k, (uint32_t)i, j) * half : 0;
            made[0].indices[to] = made[1].indices[to] = j;
            made[0].data[to] = (float)mean;
            made[1].data[to] = (float)fmax(0, mean + noise);
        }
    }
    for (int h = 0; h < 2; h++) {
        out[h] = made[h];
        made[h] = (csr){.n = 0};
    }
done:
    csr_free(&made[0]);
    csr_free(&made[1]);
    return status;
}

lam_status pairs_exchange_twice(const mesh *m, const visibility *v, const pairs_options *options,
                                uint64_t other_seed, const char *const stages[2], csr G[2],
                                pairs_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    known_pairs known = {.position = NULL};
    csr samples[2] = {{.n = 0}, {.n = 0}};
    pairs_report other;
    pairs_options how = *options;
    how.scratch = NULL;
    /* Half the segments. */
    how.coarser = pow(2, SEGMENTS_POWER);
    how.segments_least /= 2;
    how.segments_most /= 2;
    how.keep = &known;
    how.stage = stages[0];
    TRY(pairs_exchange(m, v, &how, &samples[0], report, NULL, error));
    how.keep = NULL;
    how.known = &known;
    how.seed = other_seed;
    how.stage = stages[1];
    TRY(pairs_exchange(m, v, &how, &samples[1], &other, NULL, error));
    TRY(combine(&known, samples, G, error));
done:
    known_pairs_free(&known);
    csr_free(&samples[0]);
    csr_free(&samples[1]);
    return status;
}
