/* The shared part of every operator kind, and the table a kind fills in. Private to solver/ and server/. */
#ifndef LAMBERT_OPERATOR_OPERATOR_H
#define LAMBERT_OPERATOR_OPERATOR_H

#include "solver/linalg/panel.h"
#include "store/store.h"

#include <stdatomic.h>
#include <stdint.h>

/* The description of an operator. */
typedef struct operator_description {
    const char *form;      /* "folded", "factored" or NULL */
    const char *precision; /* of its large arrays; NULL: f32, which the kind has no choice about */
    size_t rank;           /* 0 when the kind has none */
    double density;        /* share of n^2 stored; negative when the kind has none */
    size_t bytes;          /* of the arrays a solve reads */
} operator_description;

/* One kind: a const table at the end of its file, listed below, and known by name nowhere else.
 *
 * A kind computes the bounced light P = rho' (M~ - I)/rho E, one row per position, where rho'_i = rho_i, or 1
 * where rho_i = 0 (contract, /operator, last line): B_i = E_i + P_i where rho_i > 0, else E_i, and
 * H_i = P_i / rho'_i. E and P are [n_rhs][C][n] in position order, n_rhs at most OPERATOR_PASS. apply and its
 * adjoint P^T cannot fail, allocate nothing, and give a vector the same bits in any batch; the adjoint may
 * overwrite g. work is aligned to a cache line; work_bytes is 0 when it overflows, and only then.
 *
 * A kind may leave NULL: apply and apply_adjoint, where it answers for its own emitters only
 * (emitters_apply.c); apply_selected, the rows of apply for the n_selected elements selected
 * (operator_position says where they are), P being [n_rhs][C][n_selected] (without it all rows are computed);
 * answer, which is the quantity of E' = E + rho H0 (operator_finish) of each vector, so that an answer in
 * position order is never in memory; answer_selected, beside answer and in place of apply_selected, which
 * writes the same bits of n_selected elements to out [C][n_selected] of each vector, or returns false where
 * whole answers take no longer, and has written none;
 * prepare, which makes all that apply, apply_adjoint, apply_selected and answer read beside what a store's
 * mapping has, once, whatever thread comes first (LAM_ERR_MEMORY, LAM_ERR_DAMAGED); the order too is there
 * from then on alone. work_bytes and describe go without it;
 * set_threads, which passes n_threads on to its arrays;
 * narrow, which makes the operator again with its large arrays in another precision, all of its own; relight,
 * which makes it again under other reflectances, its large arrays those of op; check, which compares the
 * operator with the areas of its mesh and, where they disagree, writes the reason to detail and returns
 * false. */
#define OPERATOR_PASS 16 /* a larger batch is cut into passes */

/* A vector and its answer, [C][n] each, in mesh order, or the answer of elements selected. */
typedef struct operator_vector {
    lam_quantity quantity;
    const float *E, *H0; /* H0 NULL: 0 */
    float *out;
} operator_vector;

typedef struct operator_kind {
    const char *name;
    lam_status (*load)(store *s, size_t n, size_t n_channels, const float *reflectance, lam_operator **op,
                       lam_error *error);
    lam_status (*save)(const lam_operator *op, store *s, lam_error *error);
    size_t (*work_bytes)(const lam_operator *op, size_t n_rhs);
    void (*apply)(const lam_operator *op, size_t n_rhs, const float *E, float *P, void *work);
    void (*apply_adjoint)(const lam_operator *op, size_t n_rhs, float *g, float *w, void *work);
    void (*apply_selected)(const lam_operator *op, size_t n_rhs, const float *E, size_t n_selected,
                           const uint32_t *selected, float *P, void *work);
    void (*answer)(const lam_operator *op, size_t n_rhs, const operator_vector *vectors, void *work);
    bool (*answer_selected)(const lam_operator *op, size_t n_rhs, const operator_vector *vectors,
                            size_t n_selected, const uint32_t *selected, void *work);
    lam_status (*prepare)(const lam_operator *op, lam_error *error);
    void (*set_threads)(lam_operator *op, size_t n_threads);
    lam_status (*narrow)(const lam_operator *op, panel_precision precision, lam_operator **out,
                         lam_error *error);
    lam_status (*relight)(const lam_operator *op, const float *reflectance, atomic_bool *cancelled,
                          lam_operator **out, lam_error *error);
    void (*destroy)(lam_operator *op);
    void (*describe)(const lam_operator *op, operator_description *description);
    bool (*check)(const lam_operator *op, const double *area, char *detail, size_t size);
    /* Bytes of memory that so many bytes of its arrays in a store take once loaded; NULL: as many. */
    uint64_t (*memory)(store *s, uint64_t stored);
    bool whole; /* all n^2 coefficients are stored: density 1 where the store states none */
} operator_kind;

struct lam_operator {
    const operator_kind *kind;
    size_t n;
    size_t n_channels;
    const float *reflectance; /* [C][n], mesh order */
    store_view reflectances;  /* they hold it, mapped or in memory */
    uint32_t *order;          /* [n], position -> element, owned; NULL: mesh order */
    uint32_t *position;       /* [n], element -> position, owned; NULL with order */
    size_t n_threads;         /* of one answer */
};

/* The list of kinds: adding one is a line here. */
#define OPERATOR_KINDS(KIND)                                                                                 \
    KIND(exact)                                                                                              \
    KIND(low_rank)                                                                                           \
    KIND(two_mesh)                                                                                           \
    KIND(sparse)                                                                                             \
    KIND(emitters)                                                                                           \
    KIND(hierarchical)

#define OPERATOR_KIND_DECLARE(name) extern const operator_kind operator_##name;
OPERATOR_KINDS(OPERATOR_KIND_DECLARE)

/* The kind of this name, or NULL. */
const operator_kind *operator_kind_find(const char *name);

/* Bytes of memory that the operator of an open store takes, of this kind and so many bytes of /operator; an
 * unknown kind, which operator_load refuses, counts once. */
uint64_t operator_memory(store *s, const char *kind, uint64_t stored);

/* Makes what the kind's products read, where that is not there yet (prepare). Any thread. */
lam_status operator_prepare(const lam_operator *op, lam_error *error);

/* Fills the shared part of a zeroed operator (copies reflectance, 0 in place of values below FLT_MIN);
 * kind->destroy frees what the kind added. Errors: LAM_ERR_NUMERIC names a reflectance outside [0, 1),
 * LAM_ERR_ARGUMENT, LAM_ERR_MEMORY. */
lam_status operator_init(lam_operator *op, const operator_kind *kind, size_t n, size_t n_channels,
                         const float *reflectance, lam_error *error);

/* Says that position p of the kind's arrays is element order[p] (copied; NULL: mesh order). Before the
 * operator is shared. Errors: LAM_ERR_NUMERIC when order is no permutation of 0 .. n-1, LAM_ERR_MEMORY. */
lam_status operator_set_order(lam_operator *op, const uint32_t *order, lam_error *error);

/* Where an element's row is. */
static inline size_t operator_position(const lam_operator *op, size_t element) {
    return op->position != NULL ? op->position[element] : element;
}

/* The reflectance of channel c at a position, 1 where it is 0: rho' above. */
static inline float operator_reflectance_or_one(const lam_operator *op, size_t c, size_t position) {
    float rho = op->reflectance[c * op->n + (op->order != NULL ? op->order[position] : position)];
    return rho > 0.0f ? rho : 1.0f;
}

/* The first channel whose reflectances [C][n] are those of channel c, bit by bit: c itself where no earlier
 * one is alike. O(nc). */
size_t operator_like_channel(size_t n, const float *reflectance, size_t c);

/* E' = E + rho H0 of an element; H0 may be NULL: 0. */
static inline float operator_light(const float *rho, const float *E, const float *H0, size_t i) {
    return H0 != NULL ? E[i] + rho[i] * H0[i] : E[i];
}

/* One element of the quantity: from E' = E + rho H0, P and H0. */
static inline float operator_finish(lam_quantity quantity, float rho, float lit, float P, float H0) {
    switch (quantity) {
    case LAM_RADIOSITY: /* B = E' + P */
        return rho > 0.0f ? lit + P : lit;
    case LAM_IRRADIANCE: /* H = H0 + P / rho' */
        return (rho > 0.0f ? P / rho : P) + H0;
    case LAM_INDIRECT: /* B - E' */
        return rho > 0.0f ? P : 0.0f;
    }
    return 0.0f;
}

/* Makes op, in f32, again with its large arrays in another precision; the caller frees out with
 * lam_operator_close. Errors: LAM_ERR_UNSUPPORTED for a kind that has no choice, LAM_ERR_MEMORY,
 * LAM_ERR_NUMERIC for a value beyond the precision. */
lam_status operator_narrow(const lam_operator *op, panel_precision precision, lam_operator **out,
                           lam_error *error);

/* True if op keeps factors without reflectance, so that it can be relit. */
bool operator_keeps_factors(const lam_operator *op);

/* Makes op again under other reflectances [C][n] (mesh order): the cores anew, as a builder makes them of the
 * same factors. out shares the large arrays of op, which must outlive it; the caller closes it first.
 * cancelled (NULL: nobody) may be set by another thread.
 * Cost: C times that of core_make. Errors: LAM_ERR_UNSUPPORTED where op keeps no factors, LAM_ERR_NUMERIC (a
 * reflectance outside [0, 1), a core nearly singular), LAM_ERR_CANCELLED, LAM_ERR_MEMORY. */
lam_status operator_relight(const lam_operator *op, const float *reflectance, atomic_bool *cancelled,
                            lam_operator **out, lam_error *error);

/* Loads /operator of an open store (its reflectances from /mesh); the caller frees with lam_operator_close.
 */
lam_status operator_load(store *s, lam_operator **op, lam_error *error);

/* Writes the arrays of /operator with its attributes kind, form, layout; method, epsilon, ... are the
 * builder's to write. */
lam_status operator_save(const lam_operator *op, store *s, lam_error *error);

void operator_describe(const lam_operator *op, operator_description *description);

/* Operators made by a builder. Arrays are taken over (freed with free()), also on an error; reflectance is
 * copied and in mesh order, the rows of the arrays are too unless operator_set_order follows.
 * Errors: LAM_ERR_NUMERIC names an entry that is not finite or a reflectance outside [0, 1), LAM_ERR_MEMORY.
 * exact: P is [C][n][n], row-major, as described above (no identity in it). */
lam_status operator_exact_create(size_t n, size_t n_channels, const float *reflectance, float *P,
                                 lam_operator **op, lam_error *error);
/* folded, grey: P = -Y (V^T E); Y, V are [n][k]. */
lam_status operator_low_rank_create_folded(size_t n, size_t k, const float *reflectance, float *Y, float *V,
                                           lam_operator **op, lam_error *error);
/* factored: H_c = U core_c (V^T E_c); U, V are [n][k], core is [C][k][k]. */
lam_status operator_low_rank_create_factored(size_t n, size_t k, size_t n_channels, const float *reflectance,
                                             float *U, float *V, float *core, lam_operator **op,
                                             lam_error *error);

/* The arrays of a two_mesh operator. */
typedef struct two_mesh_arrays {
    float *left;      /* [n][k]: Y (folded, grey: P = -Y T) or U (factored: H_c = U core_c T_c) */
    uint64_t *begin;  /* [k+1]: T_p is the sum of weight E over rows begin[p] ... begin[p+1]-1 */
    float *weight;    /* [n]; NULL: 1 */
    float *coherence; /* [k], for the record; or NULL */
    float *core;      /* [C][k][k]; NULL: folded */
} two_mesh_arrays;

void two_mesh_arrays_free(two_mesh_arrays *arrays);

/* Takes over what arrays points to, also on an error, and zeroes it. */
lam_status operator_two_mesh_create(size_t n, size_t k, size_t n_channels, const float *reflectance,
                                    two_mesh_arrays *arrays, lam_operator **op, lam_error *error);

#endif
