#include "server/scene/refined.h"

#include "solver/operator/refine/form_factor_rows.h"
#include "store/groups.h"
#include "store/status.h"

#include <stdlib.h>
#include <string.h>

struct refined {
    const lam_operator *op;
    refined *base;        /* of a variant: the one with the form factors; NULL: this one */
    pthread_mutex_t lock; /* of F and refiner */
    char *path;           /* NULL: no form factors are kept */
    char *checksum;       /* of the file that op was read from */
    memory_ledger *ledger;
    size_t bytes, most_bytes; /* of F in memory, and while it is read */
    atomic_size_t held;       /* of the ledger */
    lam_form_factors *F;
    lam_refiner *refiner; /* NULL until needed */
    size_t helper_bytes;  /* of the refiner beside F, at most */
};

/* The refiner keeps the operator in one byte a number, and scales. */
static size_t helper_bytes_of(const lam_operator *op) {
    return lam_operator_bytes(op) / 3;
}

static lam_status read_checksum(store *s, char **checksum, lam_error *error) {
    return store_get_text(s, STORE_CHECKSUM, "xxh3", checksum, error);
}

lam_status refined_create(store *s, const lam_operator *op, memory_ledger *ledger, refined **out,
                          lam_error *error) {
    lam_status status = LAM_OK;
    refined *made = memory_allocate(1, sizeof *made, store_path(s), error);
    if (made == NULL) return LAM_ERR_MEMORY;
    made->op = op;
    made->ledger = ledger;
    made->helper_bytes = helper_bytes_of(op);
    pthread_mutex_init(&made->lock, NULL);
    if (store_has(s, STORE_FORM_FACTORS)) {
        TRY(read_checksum(s, &made->checksum, error));
        TRY(form_factors_size(s, &made->bytes, &made->most_bytes, error));
        made->path = strdup(store_path(s));
        if (made->path == NULL) FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory", store_path(s));
    }
    *out = made;
    made = NULL;
done:
    refined_destroy(made);
    return status;
}

lam_status refined_create_variant(refined *base, const lam_operator *op, refined **out, lam_error *error) {
    refined *made = memory_allocate(1, sizeof *made, "a variant", error);
    if (made == NULL) return LAM_ERR_MEMORY;
    made->op = op;
    made->base = base;
    made->ledger = base->ledger;
    made->helper_bytes = helper_bytes_of(op);
    pthread_mutex_init(&made->lock, NULL);
    *out = made;
    return LAM_OK;
}

void refined_destroy(refined *r) {
    if (r == NULL) return;
    lam_refiner_free(r->refiner);
    memory_ledger_give_back(r->ledger, atomic_load(&r->held));
    lam_form_factors_close(r->F);
    pthread_mutex_destroy(&r->lock);
    free(r->path);
    free(r->checksum);
    free(r);
}

/* Checks that the file is still the one that the scene was read from. */
static lam_status read_form_factors(refined *r, lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL;
    char *checksum = NULL;
    TRY(store_open(r->path, &s, error));
    TRY(read_checksum(s, &checksum, error));
    if (strcmp(checksum, r->checksum) != 0)
        FAIL(error, LAM_ERR_IO, "%s: the store is another one than was read; read it again (SIGHUP)",
             r->path);
    TRY(form_factors_open(s, &r->F, error));
    if (r->F == NULL) FAIL(error, LAM_ERR_DAMAGED, "%s: its form factors are gone", r->path);
done:
    store_close(s);
    free(checksum);
    return status;
}

/* The same within the memory that the ledger has. */
static lam_status take_form_factors(refined *r, lam_error *error) {
    lam_status status = LAM_OK;
    if (!memory_ledger_take(r->ledger, r->most_bytes))
        return status_fail(error, LAM_ERR_MEMORY,
                           "%s: its form factors take %zu bytes to read, more than --max-memory leaves",
                           r->path, r->most_bytes);
    status = read_form_factors(r, error);
    if (status == LAM_OK) atomic_fetch_add(&r->held, r->bytes);
    memory_ledger_give_back(r->ledger, status == LAM_OK ? r->most_bytes - r->bytes : r->most_bytes);
    return status;
}

/* *F is NULL if the store keeps none. */
static lam_status get_form_factors(refined *r, const lam_form_factors **F, lam_error *error) {
    lam_status status = LAM_OK;
    pthread_mutex_lock(&r->lock);
    if (r->F == NULL && r->path != NULL) TRY(take_form_factors(r, error));
    *F = r->F;
done:
    pthread_mutex_unlock(&r->lock);
    return status;
}

static lam_status take_refiner(refined *r, const lam_form_factors *F, lam_error *error) {
    if (!memory_ledger_take(r->ledger, r->helper_bytes))
        return status_fail(error, LAM_ERR_MEMORY, "refining takes %zu bytes more than --max-memory leaves",
                           r->helper_bytes);
    const lam_status status = lam_refiner_create(r->op, F, &r->refiner, error);
    if (status != LAM_OK)
        memory_ledger_give_back(r->ledger, r->helper_bytes);
    else
        atomic_fetch_add(&r->held, r->helper_bytes);
    return status;
}

lam_status refined_get(refined *r, const lam_refiner **refiner, lam_error *error) {
    lam_status status = LAM_OK;
    const lam_form_factors *F = NULL;
    *refiner = NULL;
    TRY(get_form_factors(r->base != NULL ? r->base : r, &F, error));
    if (F == NULL) return LAM_OK;
    pthread_mutex_lock(&r->lock);
    if (r->refiner == NULL) status = take_refiner(r, F, error);
    *refiner = r->refiner;
    pthread_mutex_unlock(&r->lock);
done:
    return status;
}

size_t refined_held(refined *r) {
    return atomic_load(&r->held);
}
