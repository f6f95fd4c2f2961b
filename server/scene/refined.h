/* Answers refined until they are certified: what that takes of a scene, and the whole of such an answer. */
#ifndef LAMBERT_SERVER_SCENE_REFINED_H
#define LAMBERT_SERVER_SCENE_REFINED_H

#include "server/scene/memory_ledger.h"
#include "store/store.h"

#include <pthread.h>

/* The form factors of a store, which are read when they are first asked for and then kept: they may be many
 * times as large as the operator. Any thread. */
typedef struct refined refined;

/* Notes whether the open store s, op is of, keeps form factors, and how large they are. op, stores and ledger
 * (or NULL) outlive it; whoever opens a store holds stores. Errors: LAM_ERR_MEMORY, those of
 * form_factors_size. */
lam_status refined_create(store *s, const lam_operator *op, pthread_mutex_t *stores, memory_ledger *ledger,
                          refined **out, lam_error *error);

/* Of a variant: op is another operator of base's elements. Both outlive it. Errors: LAM_ERR_MEMORY. */
lam_status refined_create_variant(refined *base, const lam_operator *op, refined **out, lam_error *error);

/* What refines op's answers; *refiner is NULL where the store keeps no form factors, else it lives as long as
 * r. The first call reads them, takes their memory and finds the bound on the inverse; others wait for it.
 * Errors: LAM_ERR_IO (also where the file is another one by now), LAM_ERR_MEMORY (also of the ledger),
 * LAM_ERR_DAMAGED, LAM_ERR_FORMAT, LAM_ERR_NUMERIC (nothing can be certified). */
lam_status refined_get(refined *r, const lam_refiner **refiner, lam_error *error);

/* Bytes taken of the ledger. Any thread, waits for nobody. */
size_t refined_held(refined *r);

/* NULL is allowed. */
void refined_destroy(refined *r);

#endif
