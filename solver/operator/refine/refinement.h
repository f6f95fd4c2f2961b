/* Solves (I - R F) P = R F E' in double with an operator as preconditioner, and bounds the error. P = B - E'
 * is the indirect radiosity. Private to refine.c, refine_solve.c and refine_judge.c.
 *
 * Certificate. A = I - R F has no positive entry off its diagonal; where some w > 0 has v = A w > 0, A^-1 is
 * not negative, and A^-1 b <= max_j(b_j / v_j) w for any b >= 0. w = 1, v = 1 - rho s is the bound of the row
 * sums s. With w near A^-1 1 and v near 1 it is the sharpest bound that depends on max b alone: one wall of
 * high reflectance in a dim room no longer counts as if all walls had it.
 *
 * With r = A (P - P~), the answer is P~ + r, which costs nothing more than r, and its error is A^-1 R F r. F
 * averages, so that this is small when r has few peaks:
 *     (F |r|)_i <= min(s_i |r|_max, k_i |r|_A),   |r|_A^2 = sum A_j r_j^2,   k_i^2 = sum_j F_ij^2 / A_j
 * by Cauchy and Schwarz, and b_i = rho_i times that. k is large for few elements, those whose row of F has
 * few large entries (where walls meet). When only those exceed the bound that is allowed, F r is computed for
 * them and b_i is exact. The rounding of r is bounded separately.
 *
 * Blocks. Products are with F itself, but for a rounding that has a bound of its own, and no pair is negative
 * (kept_blocks.h). s and k are upper bounds. A row of F is not multiplied alone. */
#ifndef LAMBERT_OPERATOR_REFINE_REFINEMENT_H
#define LAMBERT_OPERATOR_REFINE_REFINEMENT_H

#include "solver/operator/operator.h"
#include "solver/operator/refine/form_factor_rows.h"
#include "solver/operator/refine/refine_watch.h"

/* The unit roundoff of double. */
#define REFINE_U 0x1p-53

/* An element and its rho k / v. */
typedef struct refine_row {
    double mean;
    uint32_t element;
} refine_row;

/* The bound on A^-1 for one channel of an operator. */
typedef struct refine_channel {
    const float *rho; /* [n] */
    double *scale;    /* [n], A/rho, or 0 where rho = 0: R F is self-adjoint in this inner product */
    double *v;        /* [n], a lower bound on A w */
    refine_row *rows; /* [n], those with the largest mean first */
    double peak;      /* the largest rho s / v */
    double w_most;    /* the largest w */
    double v_least;
} refine_channel;

struct lam_refiner {
    const lam_operator *op;
    lam_operator *helper; /* op with its large arrays in i8; NULL when op is the cheaper preconditioner */
    const lam_form_factors *F;
    double roundings; /* relative rounding of a product with F */
    double row_most;  /* the largest row sum, with its rounding */
    refine_channel *channels;
};

/* The operator that gives directions. */
static inline const lam_operator *refiner_help(const lam_refiner *refiner) {
    return refiner->helper != NULL ? refiner->helper : refiner->op;
}

/* Directions that a new one is made orthogonal to; most products with F. */
enum { REFINE_WINDOW = 6, REFINE_PASSES_MOST = 2000 };

/* One channel of one vector. All scalars bound the vectors of the same name in the maximum norm. */
typedef struct refine_column {
    const refine_channel *channel;
    bool lit_rounded; /* E' is a sum */
    bool done, stuck;
    bool from_dark;    /* P was set to 0 and began again */
    bool plain;        /* the next direction is r itself */
    size_t passes;     /* products with F */
    size_t n_kept;     /* directions, the oldest overwritten first */
    double error;      /* |r - (R F (E' + P) - P)|, by rounding */
    double r, P;       /* P: of the answer P + r, once judged */
    double P_first;    /* P of the start */
    double least;      /* of E' + P when r was last computed from P, at most 0 */
    double bound;      /* on |P - P~| */
    double at_restart; /* the bound when r was last computed from P */
    double kept_norm[REFINE_WINDOW], kept_error[REFINE_WINDOW];
    double kept_z[REFINE_WINDOW], kept_q[REFINE_WINDOW];
} refine_column;

/* Some vectors, column v C + c being channel c of vector v. Each array is [columns][n]. */
typedef struct refinement {
    const lam_refiner *refiner;
    size_t n_vectors, n_columns;
    bool help;    /* the operator gives directions */
    bool weights; /* stop when r is small enough for w = E' + P, instead of at a tolerance */
    double tolerance;
    const refine_watch *watch; /* or NULL */
    bool left;                 /* the watch did not go on */
    bool count_sum;            /* the rounding of E' + P counts against the tolerance */
    double *lit;               /* E' */
    double *P, *r, *z, *q;
    double *kept_Z, *kept_Q; /* [REFINE_WINDOW][columns][n] */
    double *X, *Y;           /* the vectors of a product with rows, [n][CSR_DOUBLES_WIDTH] */
    void *product_work;      /* of one with blocks */
    float *narrow_in, *narrow_out;
    void *work;
    size_t work_bytes;
    refine_column *columns;
    bool *active, *again, *helped; /* [columns] */
} refinement;

/* Allocates room for n_vectors. The caller frees with refinement_free. Errors: LAM_ERR_MEMORY. */
lam_status refinement_create(const lam_refiner *refiner, size_t n_vectors, refinement *out, lam_error *error);
void refinement_free(refinement *s);

/* Bytes of a refinement for one vector. */
size_t refinement_bytes(const lam_refiner *refiner);

/* P = the operator's indirect radiosity for lit, at least 0. */
void refinement_start(refinement *s);

/* Iterates from lit (largest value of a column from 1/2 to 1, or all 0) and P until every column is done or
 * stuck, or the watch does not go on. */
void refinement_solve(refinement *s);

/* Sets r, P, bound, done and stuck of a column. True when r should be computed anew from P. */
bool refinement_judge(refinement *s, size_t column);

/* True where F is there as rows: their products are rounded relative to themselves. */
static inline bool refiner_has_rows(const lam_refiner *refiner) {
    return refiner->F->blocks == NULL;
}

/* A bound on |A^-1 R F r|_max for an r of this maximum norm; it is sharpened only until it is at most
 * `allowed`. Cost: at most an eighth of a product with F. */
double refine_left(const lam_refiner *refiner, const refine_channel *channel, const double *r, double r_most,
                   double allowed);

/* max |x_i| */
static inline double refine_most(size_t n, const double *x) {
    double largest = 0;
    for (size_t i = 0; i < n; i++) {
        const double magnitude = x[i] < 0 ? -x[i] : x[i];
        largest = magnitude > largest ? magnitude : largest;
    }
    return largest;
}

/* A bound on the rounding of (F x)_i for an x of this maximum norm. */
static inline double refiner_product_rounding(const lam_refiner *refiner, double x_most) {
    const lam_form_factors *F = refiner->F;
    const double of_product = F->blocks != NULL ? F->blocks->rounding : 0;
    return (refiner->roundings * refiner->row_most + of_product) * x_most;
}

/* A bound on the rounding of lit + P + r, or of P + r. */
double refinement_sum_rounding(const refinement *s, size_t column);

/* The answer P + r of an element of a column; P is not negative, so that 0 is nearer to it than a negative
 * sum. */
static inline double refinement_answer(const refinement *s, size_t column, size_t i) {
    const size_t at = column * s->refiner->op->n + i;
    const double sum = s->P[at] + s->r[at];
    return sum > 0 ? sum : 0;
}

/* Y = F X for the chosen columns ([n_columns] flags); both are [n_columns][n]. */
void refinement_multiply(refinement *s, const bool *chosen, const double *X, double *Y);

#endif
