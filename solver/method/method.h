/* From form factors to an operator: the offline half. One file per method; methods.c lists them. */
#ifndef LAMBERT_METHOD_METHOD_H
#define LAMBERT_METHOD_METHOD_H

#include "solver/base/progress.h"
#include "solver/linalg/csr.h"
#include "solver/linalg/row_source.h"
#include "solver/method/low_rank/factorizer.h"
#include "solver/operator/operator.h"

/* What is to shine, for the method emitters: numbers of emitter k come k C at a time. */
typedef struct emitter_source {
    size_t s;
    const char *const *names;  /* [s] */
    const float *E;            /* [s][C][n], W/m^2, mesh order */
    size_t n_tiles;            /* of the sky; 0: none */
    const float *L;            /* [s][C][m], radiances of its tiles; NULL: no emitter is of the sky */
    const float *first_bounce; /* [m][n], sr */
} emitter_source;

/* What every method is given. All in mesh order; order[position] = element is the Z-order. */
typedef struct build_problem {
    size_t n;
    size_t n_channels;
    const double *area;       /* [n] */
    const float *reflectance; /* [C][n], in [0, 1) */
    const csr *F;             /* NULL where there is a stream, which hierarchical alone can use */
    row_stream *stream;       /* NULL where there is F */
    const uint32_t *order;    /* [n] */
    double noise;             /* sampling error of S in the 2-norm, about; 0: not known */
    /* Only 2msc and hierarchical need these (hierarchical no surface); NULL elsewhere. */
    const double (*centre)[3];      /* [n] centroids, m */
    const float (*normal)[3];       /* [n] unit */
    const uint32_t *surface;        /* [n] below n: equal where elements are of one surface */
    const emitter_source *emitters; /* NULL: none asked for */
} build_problem;

/* How a sparse inverse makes up for what is left out of it: not; by what one solution with light everywhere
 * misses; by the sum of what was left out, whose own further bounces are forgotten (Aguerre 2016, eq. 4.7).
 */
typedef enum sparse_correction { SPARSE_NONE, SPARSE_DELTA, SPARSE_DISCARDED } sparse_correction;

/* "none", "delta", "discarded"; find: false where the name is none of them. */
const char *sparse_correction_name(sparse_correction correction);
bool sparse_correction_find(const char *name, sparse_correction *correction);

typedef struct build_options {
    const char *method;     /* "auto", "exact", "low-rank", ... */
    const char *factorizer; /* "auto", "hf", ... */
    double epsilon;
    budget budget;              /* of hf */
    int levels;                 /* negative: auto */
    size_t rank;                /* 0: by epsilon; else exactly min(rank, n) columns */
    double coherence, min_area; /* 2msc: smallest coherence, smallest area of a patch, m^2; 0: not given */
    bool proximity;             /* 2msc: elements belong to the nearest patch */
    double threshold;           /* sparse: entries below it are left out; auto: 0 for what suits epsilon */
    sparse_correction correction;
    size_t memory;     /* bytes it may use; 0: no limit */
    bool keep_factors; /* low-rank, 2msc: factored also for one channel */
    bool low_rank;     /* auto: as something was asked for that low rank alone has, nothing hierarchical */
    uint64_t seed;     /* of random sketches */
    const progress *progress;
} build_options;

typedef struct build_report {
    const char *method;     /* as built; static text */
    const char *factorizer; /* or NULL */
    char reason[256];       /* why this method */
    size_t rank;
    int levels;
    factorizer_report factorized;
    truncation_norm norm;         /* of epsilon and of measured_norm_error */
    double epsilon;               /* the bound reached; negative when it has none */
    double measured_norm_error;   /* |S - Q V^T|; negative when not measured */
    double rcond;                 /* of the matrix inverted; 1 when none was */
    double coherence, patch_area; /* 2msc: the smallest of a patch, m^2; negative when there are no patches */
    double threshold;             /* sparse, hierarchical: as reached; 0: neither */
    /* hierarchical, negative elsewhere: |E - (I - R F) B~| / |E| of light all over, the mean of some; |B~ -
     * 1| / |1| of E = 1 - rho s, whose B is 1. By area, of the worst channel. */
    double probe_residual, uniform_error;
    sparse_correction correction;
    double residual; /* emitters: of the worst; negative: no emitters */
    size_t sweeps;   /* emitters: products with F for a block of them, at most */
    double factorize_seconds, invert_seconds;
} build_report;

/* A method: fills op (closed by the caller) and report. Errors: LAM_ERR_NUMERIC, _MEMORY, _CANCELLED. */
typedef struct build_method {
    const char *name;
    lam_status (*build)(const build_problem *problem, const build_options *options, lam_operator **op,
                        build_report *report, lam_error *error);
} build_method;

extern const build_method build_exact;
extern const build_method build_low_rank;
extern const build_method build_two_mesh;
extern const build_method build_sparse;
extern const build_method build_emitters;
extern const build_method build_hierarchical;

/* Builds by options->method ("auto" chooses and says why). LAM_ERR_UNSUPPORTED for a method of the contract
 * that is still to come. */
lam_status build_operator(const build_problem *problem, const build_options *options, lam_operator **op,
                          build_report *report, lam_error *error);

#endif
