/* Bytes of an answer in every form (content coding) that was asked for, each made once and kept within the
 * ledger of --max-memory. Knows no coding but by its number, and not what the bytes are. Any thread. */
#ifndef LAMBERT_SERVER_SCENE_KEPT_FORMS_H
#define LAMBERT_SERVER_SCENE_KEPT_FORMS_H

#include "server/scene/kept_bytes.h"
#include "server/scene/memory_ledger.h"
#include "store/status.h"

#include <stdint.h>

/* Form 0 is the bytes as they are. */
#define KEPT_FORMS 3

typedef struct kept_forms kept_forms;

/* One reference, the caller's, to bytes that are not made yet. ledger (or NULL) outlives it. Errors:
 * LAM_ERR_MEMORY. */
lam_status kept_forms_create(memory_ledger *ledger, const char *of, kept_forms **out, lam_error *error);

/* The same of bytes that are there and stay (taken over, also on an error): they are counted by the caller,
 * the ledger has the other forms alone. O(length). */
lam_status kept_forms_of(buffer *plain, memory_ledger *ledger, const char *of, kept_forms **out,
                         lam_error *error);

/* NULL is allowed, here and below. */
kept_forms *kept_forms_hold(kept_forms *f);
void kept_forms_release(kept_forms *f);

/* The checksum of the bytes of kept_forms_of: equal for equal bytes, from one start of the daemon to the
 * next. */
uint64_t kept_forms_tag(const kept_forms *f);

/* A form that is kept, to be released by the caller, or NULL. */
kept_bytes *kept_forms_find(kept_forms *f, size_t form);

/* Keeps a form that was made: a reference for the caller, or NULL, with nothing taken over, if there is no
 * room. Of two that are made at once the first one stays. */
kept_bytes *kept_forms_keep(kept_forms *f, size_t form, buffer *made);

/* Drops all forms that can be made again; those that are being sent are freed by their last user. */
void kept_forms_clear(kept_forms *f);

/* Bytes that the kept forms have of the ledger. */
size_t kept_forms_held(kept_forms *f);

#endif
