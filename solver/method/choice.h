/* --method auto: one function weighs all methods for a problem and says why it takes one of them. */
#ifndef LAMBERT_METHOD_CHOICE_H
#define LAMBERT_METHOD_CHOICE_H

#include "solver/method/inverse_rows.h"

/* The cost of an answer is counted in coefficients that it reads: 2 n k of low rank, n^2 of the whole
 * inverse. The column of an entry of a sparse matrix is one more number, and the value that it is multiplied
 * by lies anywhere: such an entry was measured to take the time of CHOICE_SCATTERED coefficients of a dense
 * matrix. */
#define CHOICE_SCATTERED 4.

/* Among methods that are weighed by their cost, that of the least error of groups times a power of the cost
 * is taken: an answer that takes a quarter of the time is worth CHOICE_WORSE times the error. Errors up to
 * CHOICE_WORSE times epsilon are equal. */
#define CHOICE_FASTER 4.
#define CHOICE_WORSE 1.2

/* The grounds on which a method may be taken; the highest claim wins, and among those without a claim errors
 * and costs decide. */
typedef enum choice_claim {
    CLAIM_COST,    /* none: by the cost of an answer */
    CLAIM_USUAL,   /* before F is known: the method of most problems */
    CLAIM_SMALL,   /* the problem is so small that nothing else is worth it */
    CLAIM_OPTIONS, /* an option that was given has a meaning for this method only */
    CLAIM_INPUT    /* the problem has an input that only this method takes */
} choice_claim;

/* The candidacy of one method for a problem. weigh fills it; it begins with an infinite cost. */
typedef struct candidate {
    const build_method *method;
    choice_claim claim;
    double cost; /* INFINITY: it cannot be had, or is not known as nothing depends on it */
    double left; /* share of S in the Frobenius norm that it leaves out beyond epsilon, which the light of
                    single elements lacks; 0: none */
    inverse_rows truth;    /* that errors were measured by; rows NULL: none */
    sampled_errors errors; /* 0: not measured, as it is no estimate, or nothing else could be taken */
    bool certain;          /* cost is no estimate, and the operator has no error beside rounding */
    bool open;             /* F is not known yet, and could show that this method suits it best */
    bool outdone;   /* another candidate keeps the bound for single elements too: cost does not count */
    char found[96]; /* figures estimated from F: "rank estimate 40 at epsilon 0.05"; empty: nothing */
    /* The same as numbers, for `lambert classify --json`, as the member `object` of its document. */
    const char *object;
    size_t n_figures;
    struct choice_figure {
        const char *name;
        double value;
    } figures[4];
    method_values own;  /* the options to build it with: as given, or as was found to suit epsilon */
    lam_operator *op;   /* where its cost is known only after the build; else NULL */
    build_report built; /* of op */
} candidate;

typedef struct decision {
    const build_problem *problem;
    const build_options *options;
    bool thorough;             /* also methods that cannot be taken are weighed, for a report */
    double density;            /* of F; negative before it is known */
    double most;               /* coefficients that memory holds; INFINITY: no limit */
    const build_method *asked; /* method whose own options were given, which the others lack; NULL */
    size_t n_candidates;
    candidate *candidates;
    const candidate *taken;
    char reason[384]; /* without the name of the method */
    bool final;       /* F cannot change it */
} decision;

/* Weighs the methods in the order of the list where options->method is auto, else takes that one. Where the
 * problem has neither F nor stream nor blocks, it decides as far as is possible without them.
 *
 * The cost of the hierarchical operator is known only after its build. Then the decision holds the operator
 * (taken->op), and a caller that takes it over sets op to NULL. Free with decision_free, which closes all
 * others. Cost: that of the hierarchical operator, a hundred rows of sparse inverses, else at most 40
 * products of S with eight vectors and a few dozen with 32. Errors: LAM_ERR_ARGUMENT for an unknown method or
 * one that cannot use a stream or blocks, LAM_ERR_MEMORY, LAM_ERR_NUMERIC, LAM_ERR_CANCELLED. */
lam_status choose_method(const build_problem *problem, const build_options *options, bool thorough,
                         decision *out, lam_error *error);
void decision_free(decision *d);

/* True once a method has a claim, so that costs decide nothing. */
bool decision_claimed(const decision *so_far);

/* The error of groups, at least CHOICE_WORSE times epsilon. */
double candidate_error(const decision *d, const candidate *c);

/* The lowest cost of those that count; INFINITY: none. */
double decision_rival(const decision *so_far);

/* The candidate of a method of this name; NULL: it was not weighed. */
const candidate *decision_find(const decision *d, const char *method);

/* A figure of a candidate that bears this object name; otherwise where nobody reports it. */
double decision_figure(const decision *d, const char *object, const char *name, double otherwise);

void candidate_figure(candidate *c, const char *name, double value);

#endif
