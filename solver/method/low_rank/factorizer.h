/* S ~ Q V^T by any of the factorizers: their common interface and their list. */
#ifndef LAMBERT_METHOD_LOW_RANK_FACTORIZER_H
#define LAMBERT_METHOD_LOW_RANK_FACTORIZER_H

#include "solver/base/progress.h"
#include "solver/method/low_rank/budget.h"
#include "solver/method/low_rank/tsvd.h"

/* The options of --method low-rank. */
typedef struct low_rank_options {
    const char *factorizer; /* "auto" or the name of one */
    double epsilon, alpha;
    uint64_t levels; /* OPTION_AUTO */
    uint64_t rank;   /* 0: by epsilon; else exactly min(rank, n) columns */
    bool keep_factors;
} low_rank_options;

typedef struct factorizer_options {
    double epsilon; /* |S - Q V^T|_2 <= epsilon (in the Frobenius norm where the budget says so) */
    size_t rank;    /* > 0: exactly min(rank, n) columns, whatever the error */
    budget budget;  /* of HF; parts of 0: those forecast to be fastest */
    int levels;     /* of HF; negative: the number forecast to be fastest */
    int iterations; /* of RSI; negative: its default */
    double noise;   /* estimated sampling error of S in the 2-norm; 0: unknown */
    size_t memory;  /* bytes beside S; 0: no limit */
    uint64_t seed;  /* of random sketches */
    const progress *progress;
} factorizer_options;

typedef struct factorizer_report {
    const char *name;
    int levels;                                 /* of HF, else 0 */
    double left[BUDGET_LEVELS_MOST + 1];        /* error bound of a node, by level */
    double compression[BUDGET_LEVELS_MOST + 1]; /* rho_l: columns kept over columns given, by level */
    double passes;                              /* number of times that all columns of S were read */
} factorizer_report;

/* One factorizer. out has rows of Q and V in positions, out->n = out->m = n, V orthonormal. Errors:
 * LAM_ERR_MEMORY, LAM_ERR_NUMERIC, LAM_ERR_CANCELLED, those of the source. */
typedef struct factorizer {
    const char *name;
    lam_status (*factorize)(const scaled_matrix *S, const factorizer_options *options, tall_factors *out,
                            factorizer_report *report, lam_error *error);
} factorizer;

/* Hierarchical factorization (Aguerre 2016, algorithm 4; Aguerre and Fernández 2016). One pass, and at most a
 * third of one for samples. */
extern const factorizer factorizer_hf;
/* All eigenvectors of S: the best approximation of any rank. One pass, O(n^3). */
extern const factorizer factorizer_svd;
/* Randomized subspace iteration (Aguerre 2016, algorithm 2; Halko et al. 2011). 2 + iterations passes or
 * more. */
extern const factorizer factorizer_rsi;
/* Sub-Gaussian randomized SVD (Aguerre 2016, algorithm 3; Aizenbud and Averbuch 2016). 2 passes or more. */
extern const factorizer factorizer_sgrsvd;

/* Factorizes S by the factorizer of this name; "auto" is hf, the fastest at a given bound. Errors:
 * LAM_ERR_ARGUMENT for another name, those of the factorizer. */
lam_status factorize(const char *name, const scaled_matrix *S, const factorizer_options *options,
                     tall_factors *out, factorizer_report *report, lam_error *error);

/* True for "auto" and the name of a factorizer. */
bool factorizer_exists(const char *name);

#endif
