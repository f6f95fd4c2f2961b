/* Two samples of the exchange areas of all pairs that share one projection of the pairs with few occluders:
 * a reference and its noise, at the cost of about one sample. */
#ifndef LAMBERT_FORMFACTOR_PAIRS_PAIRS_TWICE_H
#define LAMBERT_FORMFACTOR_PAIRS_PAIRS_TWICE_H

#include "solver/formfactor/pairs/pair_rows.h"
#include "solver/formfactor/pairs/pairs.h"

/* The pairs of a first sample, by position. A pair with the state CERTAIN or EXACT is settled without
 * segments. Freed by known_pairs_free. */
struct known_pairs {
    pair_rows rows;
    uint32_t *position; /* [n], by element */
};
void known_pairs_free(known_pairs *k);

/* The state of the pair i, j, and its visible exchange area in g, where that is settled without segments;
 * PAIR_UNKNOWN where it is not, or where the pair is among the one in PAIRS_AGAIN that are projected again
 * with this seed. */
enum { PAIRS_AGAIN = 8 };
int known_pairs_look(const known_pairs *k, uint32_t i, uint32_t j, uint64_t seed, double *g);

/* G[0] = (G_1 + G_2) / 2 of two samples by options->seed and other_seed, and G[1] = G[0] + D, D a sample of
 * the noise of G[0], but that none of it is negative; both as pairs_exchange and freed by csr_free.
 *
 * By segments: G_2 has segments of its own, half of the number as G_1, which together are as many as those of
 * one sample. D = (G_1 - G_2) / 2.
 * By projection: G_2 = G_1, but for the share q = 1/8 of those partly hidden, drawn by hash, which are
 * projected again with cells of other nodes. With the variance s^2 of one projection that of G[0] is
 * (1 - q) s^2 + q s^2 / 2 on average, and D = (G_1 - G_2) / 2 sqrt((2 - q) / q) has as much, on these pairs
 * alone, and is independent of G[0].
 * In both alike are what no sample decides (open and hidden by proof, the unoccluded factor at its tolerance)
 * and pairs of clusters whose every segment was blocked: these are at most about the accuracy asked for.
 *
 * report and errors as of pairs_exchange; no scratch folder. stages: names for progress. */
lam_status pairs_exchange_twice(const mesh *m, const visibility *v, const pairs_options *options,
                                uint64_t other_seed, const char *const stages[2], csr G[2],
                                pairs_report *report, lam_error *error);

#endif
