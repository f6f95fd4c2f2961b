/* Headers of a store as the process that reads them sends them: an index within the file, or a refusal. The
 * input is a head and the bytes behind it. */
#include "fuzz/fuzz.h"
#include "store/store_private.h"

/* The name and the size of the file that the seeds are about. */
#define NAME "store.h5"
static const uint64_t file_size = (uint64_t)1 << 20;

static void look(const store_index *index) {
    for (size_t i = 0; i < index->n_objects; i++) {
        const store_object *o = &index->objects[i];
        FUZZ_CHECK(o->name[0] == '/' && (i == 0 || strcmp(index->objects[i - 1].name, o->name) < 0));
        if (o->kind == OBJECT_FAULTY) FUZZ_CHECK(o->status != LAM_OK && strlen(o->fault) > 0);
        if (o->kind == OBJECT_ARRAY)
            FUZZ_CHECK(o->array.offset <= file_size && o->array.bytes <= file_size - o->array.offset);
        for (size_t a = 0; a < o->n_attributes; a++) {
            FUZZ_CHECK(store_attribute_find(o, o->attributes[a].name) == &o->attributes[a]);
            if (o->attributes[a].kind == ATTRIBUTE_TEXT)
                FUZZ_CHECK(strlen(o->attributes[a].text) < UINT32_MAX);
        }
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    reply_head head;
    lam_error error = {.message = ""};
    store_index index = {.bytes = NULL};
    if (size < sizeof head) return 0;
    memcpy(&head, data, sizeof head);
    /* A fuzzer seldom guesses a length. */
    if (head.bytes > size - sizeof head && head.bytes <= REPLY_MOST_BYTES) head.bytes = size - sizeof head;
    lam_status status = store_reply_check(&head, NAME, &error);
    if (status == LAM_OK) {
        char *bytes = malloc(head.bytes > 0 ? head.bytes : 1);
        FUZZ_CHECK(bytes != NULL);
        memcpy(bytes, data + sizeof head, head.bytes);
        status = store_reply_read(&head, NAME, file_size, bytes, &index, &error);
    }
    if (status == LAM_OK)
        look(&index);
    else
        FUZZ_CHECK(strncmp(error.message, NAME ": ", strlen(NAME ": ")) == 0 &&
                   strchr(error.message, '\n') == NULL);
    store_index_free(&index);
    return 0;
}
