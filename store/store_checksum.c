/* Checksums: XXH3 of every MiB of every array, and one XXH3 over all of these. */
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
    size_t size = 0, at = 0;
    for (size_t i = 0; i < sums->count; i++)
        size += strlen(sums->entries[i].name) + 1 + sums->entries[i].n_pieces * sizeof(uint64_t);
    char *all = memory_allocate(size, 1, "checksums", error);
    if (all == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < sums->count; i++) {
        const store_sum *sum = &sums->entries[i];
        size_t name_size = strlen(sum->name) + 1, bytes = sum->n_pieces * sizeof(uint64_t);
        memcpy(all + at, sum->name, name_size);
        memcpy(all + at + name_size, sum->pieces, bytes);
        at += name_size + bytes;
    }
    snprintf(digest, 17, "%016" PRIx64, store_checksum(all, size));
    free(all);
    return LAM_OK;
}

lam_status store_sums_write(store *s, lam_error *error) {
    lam_status status = LAM_OK;
    char digest[17];
    TRY(store_set_integer(s, "/checksum", "piece_bytes", (int64_t)STORE_PIECE, error));
    for (size_t i = 0; i < s->sums.count; i++) {
        char name[STORE_NAME_SIZE];
        const store_sum *sum = &s->sums.entries[i];
        snprintf(name, sizeof name, "/checksum%s", sum->name);
        TRY(store_write_plain(s, name, H5T_STD_U64LE, 1, &sum->n_pieces, sum->pieces, error));
    }
    TRY(sums_digest(&s->sums, digest, error));
    TRY(store_set_text(s, "/checksum", "xxh3", digest, error));
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
    TRY(sums_insert(&s->sums, name + strlen("/checksum"), array->dims[0], pieces, error));
    pieces = NULL;
done:
    free(pieces);
    return status;
}

lam_status store_sums_read(store *s, lam_error *error) {
    lam_status status = LAM_OK;
    char *expected = NULL, digest[17];
    for (size_t i = 0; i < s->index.n_objects; i++) {
        const store_object *object = &s->index.objects[i];
        if (object->kind != OBJECT_GROUP && strncmp(object->name, "/checksum/", 10) == 0)
            TRY(sums_load(s, object->name, error));
    }
    TRY(sums_digest(&s->sums, digest, error));
    TRY(store_get_text(s, "/checksum", "xxh3", &expected, error));
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
    if (data == NULL) {
        scratch = memory_allocate(array->bytes < STORE_PIECE ? array->bytes : STORE_PIECE, 1, name, error);
        if (scratch == NULL) TRY(LAM_ERR_MEMORY);
    }
    for (size_t i = 0; i < sum->n_pieces; i++) {
        size_t start = i * STORE_PIECE, size = piece_size(array->bytes, i);
        char *piece = data == NULL ? scratch : (char *)data + start;
        if (stop_asked(s->stop)) FAIL(error, LAM_ERR_CANCELLED, "%s: not read to its end", s->path);
        TRY(store_data_read(s, name, array->offset + start, piece, size, error));
        if (store_checksum(piece, size) != sum->pieces[i])
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
