/* The refiner of a scene (lam_refiner) and the form factors that it needs. */
#ifndef LAMBERT_SERVER_SCENE_REFINED_H
#define LAMBERT_SERVER_SCENE_REFINED_H

#include "server/scene/memory_ledger.h"
#include "store/store.h"

#include <pthread.h>

/* Form factors may be many times as large as the operator: they are read when first needed, and then kept.
 * Any thread. */
typedef struct refined refined;

/* Records if the open store s of op keeps form factors, and their size. op and ledger (or NULL) outlive it.
 * Errors: LAM_ERR_MEMORY, those of form_factors_size. */
lam_status refined_create(store *s, const lam_operator *op, memory_ledger *ledger, refined **out,
                          lam_error *error);

/* For a variant: op is another operator for the elements of base. Both outlive it. Errors: LAM_ERR_MEMORY. */
lam_status refined_create_variant(refined *base, const lam_operator *op, refined **out, lam_error *error);

/* The refiner of op, which lives as long as r; NULL if the store keeps no form factors. The first call reads
 * them, takes their memory and computes the bound on the inverse, while others wait. Errors: LAM_ERR_IO (also
 * if the file was replaced), LAM_ERR_MEMORY (also of the ledger), LAM_ERR_DAMAGED, LAM_ERR_FORMAT,
 * LAM_ERR_NUMERIC (nothing can be certified). */
lam_status refined_get(refined *r, const lam_refiner **refiner, lam_error *error);

/* Bytes taken of the ledger. Any thread; does not wait. */
size_t refined_held(refined *r);

/* NULL is allowed. */
void refined_destroy(refined *r);

#endif
