/* Solving (I - R F) P = R F E' in double with an operator's help, and bounding what is left. P is the
 * indirect light B - E'. Private to refine.c and refine_solve.c.
 *
 * Certificate. A = I - R F has no positive entry off its diagonal; where some w > 0 has v = A w > 0, A^-1 is
 * not negative, and A^-1 b <= max_j(b_j / v_j) w for any b >= 0. w = 1, v = 1 - rho s is the bound of the row
 * sums s. w near A^-1 1, v near 1, makes it the least that can be said of the largest b alone: one bright
 * wall in a dim room no longer counts as if all walls were as bright.
 *
 * With r = A (P - P~), the answer is not P~ but P~ + r, which r pays for: what it lacks is A^-1 R F r. F
 * averages, so that of an r whose peaks are few little is left:
 *     (F |r|)_i <= min(s_i |r|_max, k_i |r|_A),   |r|_A^2 = sum A_j r_j^2,   k_i^2 = sum_j F_ij^2 / A_j
 * by Cauchy and Schwarz, and b_i = rho_i times that. k is large for few elements, those whose row of F is
 * held by few others (where walls meet): where those alone are in the way, F r is computed for them, and b_i
 * is what it is. What rounding may have changed in r is bounded beside it.
 *
 * Compressed form factors. Products are with F~, |F x - F~ x|_i <= delta_i(x) (compressed_factors.h), and F
 * itself is still what all is certified for: of the answer Q = P + r = R F~ (E' + P) what is left is R F (E'
 * + Q) - Q = R F~ r + R (F - F~)(E' + Q),   so   b_i = rho_i (s_i |r|_max + delta_i(r) + delta_i(E' + Q)).
 * The last of these stays, however often r is made smaller.
 */
#ifndef LAMBERT_OPERATOR_REFINE_REFINE_H
#define LAMBERT_OPERATOR_REFINE_REFINE_H

#include "solver/operator/operator.h"
#include "solver/operator/refine/form_factor_rows.h"

/* The unit roundoff of double. */
#define REFINE_U 0x1p-53

/* An element and its rho k / v. */
typedef struct refine_row {
    double mean;
    uint32_t element;
} refine_row;

/* What one channel of an operator needs. */
typedef struct refine_channel {
    const float *rho; /* [n] */
    double *scale;    /* [n], A/rho, 0 where rho is: in this inner product R F is its own transpose */
    double *v;        /* [n], a lower bound on A w */
    refine_row *rows; /* [n], those with the largest mean first */
    double peak;      /* the largest rho s / v */
    double w_most;    /* the largest w */
    double v_least;
} refine_channel;

struct lam_refiner {
    const lam_operator *op;
    lam_operator *helper; /* op with its large arrays in bytes; NULL where op helps more */
    const lam_form_factors *F;
    double roundings; /* of a term of a product with F, plus one, times u */
    double row_most;  /* no row sum is more */
    refine_channel *channels;
};

/* The operator that steps are made with. */
static inline const lam_operator *refiner_help(const lam_refiner *refiner) {
    return refiner->helper != NULL ? refiner->helper : refiner->op;
}

/* Directions that a new one is made orthogonal to. */
enum { REFINE_WINDOW = 6, REFINE_PASSES_MOST = 2000 };

/* One channel of one vector. All scalars bound the vectors of the same name in the maximum norm. */
typedef struct refine_column {
    const refine_channel *channel;
    bool lit_rounded; /* E' is a sum */
    bool done, stuck;
    bool from_dark;    /* P began again, with 0 */
    bool plain;        /* the next direction is r itself */
    size_t passes;     /* products with F */
    size_t n_kept;     /* directions, the oldest overwritten first */
    double error;      /* |r - R F (E' + P) + P|, what rounding made of it */
    double r, P;       /* P: of the answer P + r, once judged */
    double P_first;    /* of the start */
    double least;      /* of E' + P when r was last computed from P, at most 0 */
    double bound;      /* on |P - P~| */
    double at_restart; /* bound when r was last computed from P */
    double kept_norm[REFINE_WINDOW], kept_error[REFINE_WINDOW];
    double kept_z[REFINE_WINDOW], kept_q[REFINE_WINDOW];
} refine_column;

/* Some vectors, column v C + c being channel c of vector v. Each array is [columns][n]. */
typedef struct refinement {
    const lam_refiner *refiner;
    size_t n_vectors, n_columns;
    bool help;    /* of the operator */
    bool weights; /* not to a tolerance, but until r is small enough for w = E' + P */
    double tolerance;
    bool count_sum; /* what rounding makes of E' + the answer must fit into the tolerance too */
    double *lit;    /* E' */
    double *P, *r, *z, *q;
    double *kept_Z, *kept_Q; /* [REFINE_WINDOW][columns][n] */
    double *X, *Y;           /* of a product, [n][CSR_DOUBLES_WIDTH] */
    float *narrow_in, *narrow_out;
    void *work;
    size_t work_bytes;
    refine_column *columns;
    bool *active, *again, *helped; /* [columns] */
    double *scratch;               /* [columns][scratch_stride], of compressed form factors; NULL: rows */
    size_t scratch_stride;
} refinement;

/* Room for so many vectors. Freed by refinement_free. Errors: LAM_ERR_MEMORY. */
lam_status refinement_create(const lam_refiner *refiner, size_t n_vectors, refinement *out, lam_error *error);
void refinement_free(refinement *s);

/* Bytes that it takes for one vector. */
size_t refinement_bytes(const lam_refiner *refiner);

/* The operator's own answer to lit, not below 0, as a first P. */
void refinement_start(refinement *s);

/* From lit (largest value of a column from 1/2 to 1, or all 0) and P: until every column is done or stuck. */
void refinement_solve(refinement *s);

/* Is the column done, or can it not be? Sets its r, P, bound, done and stuck. True where r should be found
 * anew. */
bool refinement_judge(refinement *s, size_t column);

/* A bound on |A^-1 R F r|_max for an r of this maximum norm, no sharper than it takes to be `allowed`. At
 * most an eighth of a product with F. */
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

/* What rounding may make of F x, by element, for an x of this maximum norm. */
static inline double refiner_product_rounding(const lam_refiner *refiner, double x_most) {
    const compressed_factors *c = refiner->F->compressed;
    return (refiner->roundings * refiner->row_most + (c != NULL ? c->rounding : 0)) * x_most;
}

/* delta_i(x) of compressed form factors into what is returned, [n], of the column's scratch, with its
 * largest; `second`: beside another that is there. */
double *refinement_compression(refinement *s, size_t column, bool second, const double *x, double *largest);

/* What rounding makes of lit + P + r, or of P + r. */
double refinement_sum_rounding(const refinement *s, size_t column);

/* P + r of an element of a column: the answer. Light is not negative, so what is below 0 is nearer there. */
static inline double refinement_answer(const refinement *s, size_t column, size_t i) {
    const size_t at = column * s->refiner->op->n + i;
    const double sum = s->P[at] + s->r[at];
    return sum > 0 ? sum : 0;
}

/* Y = F X for those columns of X that are chosen ([n_columns] of flags): [n_columns][n] both. */
void refinement_multiply(refinement *s, const bool *chosen, const double *X, double *Y);

#endif
