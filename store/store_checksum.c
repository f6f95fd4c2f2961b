/* Checksums: XXH3 of every MiB of every array, and one XXH3 over all of these. */
#include "store/groups.h"
#include "store/store_private.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <xxhash.h>

uint64_t store_checksum(const void *data, size_t bytes) {
    return XXH3_64bits(data, bytes);
}

static size_t count_pieces(size_t bytes) {
    return bytes / STORE_PIECE + (bytes % STORE_PIECE != 0);
}

static size_t piece_size(size_t bytes, size_t piece) {
    size_t rest = bytes - piece * STORE_PIECE;
    return rest < STORE_PIECE ? rest : STORE_PIECE;
}

void store_sums_free(store_sums *sums) {
    for (size_t i = 0; i < sums->count; i++) {
        free(sums->entries[i].name);
        free(sums->entries[i].pieces);
    }
    free(sums->entries);
    *sums = (store_sums){0};
}

/* The index of name in the table, or where it would be inserted. */
static size_t sums_place(const store_sums *sums, const char *name) {
    size_t low = 0, high = sums->count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        if (strcmp(sums->entries[middle].name, name) < 0)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

const store_sum *store_sums_find(const store_sums *sums, const char *name) {
    size_t at = sums_place(sums, name);
    return at < sums->count && strcmp(sums->entries[at].name, name) == 0 ? &sums->entries[at] : NULL;
}

/* Takes pieces over on success. */
static lam_status sums_insert(store_sums *sums, const char *name, size_t n_pieces, uint64_t *pieces,
                              lam_error *error) {
    size_t at = sums_place(sums, name), size = strlen(name) + 1;
    if (sums->count == sums->capacity) {
        size_t capacity = 2 * sums->capacity + 16;
        store_sum *entries = memory_allocate(capacity, sizeof *entries, "checksums", error);
        if (entries == NULL) return LAM_ERR_MEMORY;
        if (sums->count > 0) memcpy(entries, sums->entries, sums->count * sizeof *entries);
        free(sums->entries);
        sums->entries = entries;
        sums->capacity = capacity;
    }
    char *copy = memory_allocate(size, 1, "checksums", error);
    if (copy == NULL) return LAM_ERR_MEMORY;
    memcpy(copy, name, size);
    memmove(sums->entries + at + 1, sums->entries + at, (sums->count - at) * sizeof *sums->entries);
    sums->entries[at] = (store_sum){copy, n_pieces, pieces};
    sums->count++;
    return LAM_OK;
}

lam_status store_sums_add(store_sums *sums, const char *name, const void *data, size_t bytes,
                          lam_error *error) {
    size_t n_pieces = count_pieces(bytes);
    uint64_t *pieces = memory_allocate(n_pieces, sizeof *pieces, name, error);
    if (pieces == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < n_pieces; i++)
        pieces[i] = store_checksum((const char *)data + i * STORE_PIECE, piece_size(bytes, i));
    lam_status status = sums_insert(sums, name, n_pieces, pieces, error);
    if (status != LAM_OK) free(pieces);
    return status;
}

/* XXH3 over, for each entry in order, its name with the NUL and its pieces; as 16 hex digits and a NUL. */
static lam_status sums_digest(const store_sums *sums, char digest[17], lam_error *error) {
    XXH3_state_t *all = XXH3_createState();
    bool good = all != NULL && XXH3_64bits_reset(all) == XXH_OK;
    for (size_t i = 0; i < sums->count && good; i++) {
        const store_sum *sum = &sums->entries[i];
        good = XXH3_64bits_update(all, sum->name, strlen(sum->name) + 1) == XXH_OK &&
               XXH3_64bits_update(all, sum->pieces, sum->n_pieces * sizeof(uint64_t)) == XXH_OK;
    }
    if (good) snprintf(digest, 17, "%016" PRIx64, (uint64_t)XXH3_64bits_digest(all));
    XXH3_freeState(all);
    return good ? LAM_OK : status_fail(error, LAM_ERR_MEMORY, "not enough memory for checksums");
}

lam_status store_sums_write(store *s, lam_error *error) {
    lam_status status = LAM_OK;
    char digest[17];
    TRY(store_set_integer(s, STORE_CHECKSUM, "piece_bytes", (int64_t)STORE_PIECE, error));
    for (size_t i = 0; i < s->sums.count; i++) {
        char name[STORE_NAME_SIZE];
        const store_sum *sum = &s->sums.entries[i];
        snprintf(name, sizeof name, "/checksum%s", sum->name);
        TRY(store_write_plain(s, name, H5T_STD_U64LE, 1, &sum->n_pieces, sum->pieces, error));
    }
    TRY(sums_digest(&s->sums, digest, error));
    TRY(store_set_text(s, STORE_CHECKSUM, "xxh3", digest, error));
done:
    return status;
}

/* Reads the dataset of this name, below /checksum, into the table. */
static lam_status sums_load(store *s, const char *name, lam_error *error) {
    lam_status status = LAM_OK;
    const store_array *array = NULL;
    uint64_t *pieces = NULL;
    TRY(store_array_find(s, name, &array, error));
    if (array->is_text || array->type != STORE_U64 || array->rank != 1)
        FAIL(error, LAM_ERR_FORMAT, "%s: %s is not a list of checksums", s->path, name);
    pieces = memory_allocate(array->bytes, 1, name, error);
    if (pieces == NULL) TRY(LAM_ERR_MEMORY);
    TRY(store_data_read(s, name, array->offset, pieces, array->bytes, error));
    TRY(sums_insert(&s->sums, name + strlen(STORE_CHECKSUM), array->dims[0], pieces, error));
    pieces = NULL;
done:
    free(pieces);
    return status;
}

/* Bytes of checksums of arrays whose size is not known, as they are of a kind that no store has. */
#define SUMS_UNKNOWN_MOST ((uint64_t)1 << 20)

/* Compares the sizes of all checksums, by the index alone, with those of the arrays that they are of: these
 * share no bytes of the file, so that all checksums together have 8 bytes for a MiB of the file and for an
 * array. Only then is it worth the memory to read them. */
static lam_status check_sizes(const store *s, lam_error *error) {
    lam_status status = LAM_OK;
    uint64_t total = 0, unknown = 0;
    for (size_t i = 0; i < s->index.n_objects; i++) {
        const store_object *sums = &s->index.objects[i];
        if (sums->kind != OBJECT_ARRAY || strncmp(sums->name, STORE_CHECKSUM "/", 10) != 0) continue;
        const char *name = sums->name + strlen(STORE_CHECKSUM);
        const store_object *of = store_find(s, name);
        if (of == NULL || of->kind == OBJECT_GROUP)
            FAIL(error, LAM_ERR_FORMAT, "%s: %s is of no array of the store; make the store again", s->path,
                 sums->name);
        if (of->kind == OBJECT_ARRAY && sums->array.bytes != count_pieces(of->array.bytes) * sizeof(uint64_t))
            FAIL(error, LAM_ERR_DAMAGED, "%s: %s has no checksum of its size; make the store again", s->path,
                 name);
        if (of->kind == OBJECT_FAULTY) unknown += sums->array.bytes;
        total += sums->array.bytes;
        if (unknown > SUMS_UNKNOWN_MOST)
            FAIL(error, LAM_ERR_FORMAT,
                 "%s: %s has %zu bytes for an array that cannot be read; make the store again", s->path,
                 sums->name, sums->array.bytes);
    }
    if (total > s->memory)
        FAIL(error, LAM_ERR_MEMORY, "%s: its checksums take %llu bytes, %llu are left; allow it more memory",
             s->path, (unsigned long long)total, (unsigned long long)s->memory);
done:
    return status;
}

lam_status store_sums_read(store *s, lam_error *error) {
    lam_status status = LAM_OK;
    char *expected = NULL, digest[17];
    TRY(check_sizes(s, error));
    for (size_t i = 0; i < s->index.n_objects; i++) {
        const store_object *object = &s->index.objects[i];
        if (object->kind != OBJECT_GROUP && strncmp(object->name, STORE_CHECKSUM "/", 10) == 0)
            TRY(sums_load(s, object->name, error));
    }
    TRY(sums_digest(&s->sums, digest, error));
    TRY(store_get_text(s, STORE_CHECKSUM, "xxh3", &expected, error));
    if (strcmp(digest, expected) != 0)
        FAIL(error, LAM_ERR_DAMAGED, "%s: /checksum is damaged; make the store again", s->path);
    memcpy(s->identity.digest, digest, sizeof digest);
done:
    free(expected);
    return status;
}

const store_sum *store_sums_find_for(const store *s, const char *name, const store_array *array,
                                     lam_error *error) {
    const store_sum *sum = store_sums_find(&s->sums, name);
    if (sum != NULL && sum->n_pieces == count_pieces(array->bytes)) return sum;
    (void)status_fail(error, LAM_ERR_DAMAGED, "%s: %s has no checksum of its size; make the store again",
                      s->path, name);
    return NULL;
}

lam_status store_data_read(store *s, const char *name, uint64_t offset, void *data, size_t bytes,
                           lam_error *error) {
    if (store_file_read(&s->file, offset, data, bytes)) return LAM_OK;
    return status_fail(error, LAM_ERR_IO, "%s: cannot read %s: %s", s->path, name, strerror(s->file.error));
}

lam_status store_array_load(store *s, const char *name, const store_array *array, void *data,
                            lam_error *error) {
    lam_status status = LAM_OK;
    char *scratch = NULL;
    const store_sum *sum = store_sums_find_for(s, name, array, error);
    if (sum == NULL) TRY(LAM_ERR_DAMAGED);
    const char *mapped = data == NULL && s->map != NULL ? store_map_at(s->map, array->offset) : NULL;
    if (data == NULL && mapped == NULL) {
        scratch = memory_allocate(array->bytes < STORE_PIECE ? array->bytes : STORE_PIECE, 1, name, error);
        if (scratch == NULL) TRY(LAM_ERR_MEMORY);
    }
    for (size_t i = 0; i < sum->n_pieces; i++) {
        size_t start = i * STORE_PIECE, size = piece_size(array->bytes, i);
        char *piece = data == NULL ? scratch : (char *)data + start;
        if (stop_asked(s->stop)) FAIL(error, LAM_ERR_CANCELLED, "%s: not read to its end", s->path);
        if (mapped == NULL) TRY(store_data_read(s, name, array->offset + start, piece, size, error));
        if (store_checksum(mapped != NULL ? mapped + start : piece, size) != sum->pieces[i])
            FAIL(error, LAM_ERR_DAMAGED, "%s: %s is damaged in MiB %zu of %zu; make the store again", s->path,
                 name, i + 1, sum->n_pieces);
    }
done:
    free(scratch);
    return status;
}

/* True if a dataset lies below a group, whose path has `length` letters; "/" counts as 0. */
static bool is_below(const char *name, const char *group, size_t length) {
    return strncmp(name, group, length) == 0 && name[length] == '/';
}

lam_status store_verify(store *s, lam_error *error) {
    return store_verify_group(s, "/", error);
}

lam_status store_verify_group(store *s, const char *group, lam_error *error) {
    lam_status status = LAM_OK;
    const store_array *array = NULL;
    const size_t length = strcmp(group, "/") == 0 ? 0 : strlen(group);
    /* Every array is in the table: store_open has checked that. */
    for (size_t i = 0; i < s->sums.count; i++) {
        const char *name = s->sums.entries[i].name;
        if (!is_below(name, group, length)) continue;
        TRY(store_array_find(s, name, &array, error));
        TRY(store_array_load(s, name, array, NULL, error));
    }
done:
    return status;
}

lam_status store_group_bytes(store *s, const char *group, uint64_t *bytes, lam_error *error) {
    lam_status status = LAM_OK;
    const store_array *array = NULL;
    uint64_t total = 0;
    const size_t length = strcmp(group, "/") == 0 ? 0 : strlen(group);
    if (store_find(s, group) == NULL) FAIL(error, LAM_ERR_FORMAT, "%s: has no %s", s->path, group);
    for (size_t i = 0; i < s->sums.count; i++) {
        const char *name = s->sums.entries[i].name;
        if (!is_below(name, group, length)) continue;
        TRY(store_array_find(s, name, &array, error));
        total += array->bytes;
    }
    *bytes = total;
done:
    return status;
}

uint64_t store_array_bytes(const store *s, const char *name) {
    const store_object *object = store_find(s, name);
    return object != NULL && object->kind == OBJECT_ARRAY ? object->array.bytes : 0;
}

uint64_t store_texts_memory(const store *s, const char *name) {
    const store_object *object = store_find(s, name);
    if (object == NULL || object->kind != OBJECT_ARRAY) return 0;
    /* Each has its pointer and its NUL. */
    return object->array.bytes + (uint64_t)object->array.dims[0] * (sizeof(char *) + 1);
}
