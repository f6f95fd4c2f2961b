#include "server/scene/kept_forms.h"

#include "store/store.h"

#include <pthread.h>
#include <string.h>

struct kept_forms {
    atomic_size_t references;
    memory_ledger *ledger;
    uint64_t tag;
    bool stays; /* form 0 was there from the start */
    pthread_mutex_t lock;
    kept_bytes *forms[KEPT_FORMS];
};

static void give_back(void *ledger, size_t bytes) {
    memory_ledger_give_back(ledger, bytes);
}

lam_status kept_forms_create(memory_ledger *ledger, const char *of, kept_forms **out, lam_error *error) {
    kept_forms *f = memory_allocate(1, sizeof *f, of, error);
    if (f == NULL) return LAM_ERR_MEMORY;
    atomic_init(&f->references, 1);
    f->ledger = ledger;
    pthread_mutex_init(&f->lock, NULL);
    *out = f;
    return LAM_OK;
}

lam_status kept_forms_of(buffer *plain, memory_ledger *ledger, const char *of, kept_forms **out,
                         lam_error *error) {
    lam_status status = LAM_OK;
    kept_forms *f = NULL;
    TRY(kept_forms_create(ledger, of, &f, error));
    f->stays = true;
    f->tag = store_checksum(plain->bytes, plain->length);
    f->forms[0] = kept_bytes_create(plain, give_back, NULL, 0);
    if (f->forms[0] == NULL) FAIL(error, LAM_ERR_MEMORY, "not enough memory for %s", of);
    *out = f;
    f = NULL;
done:
    buffer_free(plain);
    kept_forms_release(f);
    return status;
}

kept_forms *kept_forms_hold(kept_forms *f) {
    if (f != NULL) atomic_fetch_add(&f->references, 1);
    return f;
}

void kept_forms_release(kept_forms *f) {
    if (f == NULL || atomic_fetch_sub(&f->references, 1) != 1) return;
    for (size_t form = 0; form < KEPT_FORMS; form++) kept_bytes_release(f->forms[form]);
    pthread_mutex_destroy(&f->lock);
    free(f);
}

uint64_t kept_forms_tag(const kept_forms *f) {
    return f->tag;
}

kept_bytes *kept_forms_find(kept_forms *f, size_t form) {
    pthread_mutex_lock(&f->lock);
    kept_bytes *found = kept_bytes_hold(f->forms[form]);
    pthread_mutex_unlock(&f->lock);
    return found;
}

kept_bytes *kept_forms_keep(kept_forms *f, size_t form, buffer *made) {
    const size_t bytes = made->capacity;
    if (!memory_ledger_take(f->ledger, bytes)) return NULL;
    kept_bytes *kept = kept_bytes_create(made, give_back, f->ledger, bytes), *dropped = NULL;
    if (kept == NULL) {
        memory_ledger_give_back(f->ledger, bytes);
        return NULL;
    }
    pthread_mutex_lock(&f->lock);
    if (f->forms[form] == NULL) {
        f->forms[form] = kept;
    } else {
        dropped = kept;
        kept = f->forms[form];
    }
    (void)kept_bytes_hold(kept);
    pthread_mutex_unlock(&f->lock);
    kept_bytes_release(dropped);
    return kept;
}

void kept_forms_clear(kept_forms *f) {
    kept_bytes *gone[KEPT_FORMS] = {NULL};
    if (f == NULL) return;
    pthread_mutex_lock(&f->lock);
    for (size_t form = f->stays ? 1 : 0; form < KEPT_FORMS; form++) {
        gone[form] = f->forms[form];
        f->forms[form] = NULL;
    }
    pthread_mutex_unlock(&f->lock);
    for (size_t form = 0; form < KEPT_FORMS; form++) kept_bytes_release(gone[form]);
}

size_t kept_forms_held(kept_forms *f) {
    size_t held = 0;
    if (f == NULL) return 0;
    pthread_mutex_lock(&f->lock);
    for (size_t form = 0; form < KEPT_FORMS; form++)
        held += f->forms[form] != NULL ? f->forms[form]->taken : 0;
    pthread_mutex_unlock(&f->lock);
    return held;
}
