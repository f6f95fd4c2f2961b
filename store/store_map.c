#include "store/store_map.h"

#include "store/store_private.h"

#include <errno.h>
#include <fcntl.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

/* An array that was given out, with a copy of its checksums, as the table is freed with the store. */
typedef struct map_array {
    char *name;
    uint64_t *pieces; /* [n_pieces] */
    size_t n_pieces;
    size_t offset, bytes;
    store_type type;
    store_check *check; /* NULL: none */
    uint64_t limit;
    const char *words;
} map_array;

struct store_map {
    atomic_size_t references;
    char *path;
    int fd;                  /* of the file, for store_map_changed */
    store_identity identity; /* when the store was opened */
    char *room;              /* reserved range that contains base */
    char *base;
    size_t file_bytes;
    size_t mapped_bytes; /* pages of the file, and one more */
    size_t room_bytes;
    map_array *arrays;
    size_t n_arrays, capacity;
};

/* Size of huge pages: the system uses them where address and offset are both aligned to it. With them a solve
 * of 5 GB runs at memory speed, otherwise at .75 of it. */
#define HUGE_PAGE ((size_t)2 << 20)

static size_t page_size(void) {
    return (size_t)sysconf(_SC_PAGESIZE);
}

lam_status store_map_file(store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t page = page_size();
    store_map *map = memory_allocate(1, sizeof *map, "a mapping", error);
    if (map == NULL) return LAM_ERR_MEMORY;
    atomic_init(&map->references, 1);
    map->room = MAP_FAILED;
    map->identity = s->identity;
    map->fd = fcntl(s->file.fd, F_DUPFD_CLOEXEC, 0);
    if (map->fd < 0) FAIL(error, LAM_ERR_IO, "%s: cannot be mapped: %s", s->path, strerror(errno));
    map->path = strdup(s->path);
    if (map->path == NULL) FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory", s->path);
    if (s->file.size > PTRDIFF_MAX - 2 * page - HUGE_PAGE)
        FAIL(error, LAM_ERR_MEMORY, "%s: %llu bytes are more than can be mapped", s->path,
             (unsigned long long)s->file.size);
    map->file_bytes = (size_t)s->file.size;
    map->mapped_bytes = (map->file_bytes + page - 1) / page * page + page;
    /* Reserves the whole range first, with a page of zeros at its end, which may be read behind the last
     * array. */
    map->room_bytes = map->mapped_bytes + HUGE_PAGE;
    map->room = mmap(NULL, map->room_bytes, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (map->room == MAP_FAILED)
        FAIL(error, LAM_ERR_MEMORY, "%s: no room to map %zu bytes", s->path, map->file_bytes);
    map->base = map->room + (HUGE_PAGE - (uintptr_t)map->room % HUGE_PAGE) % HUGE_PAGE;
    if (map->file_bytes > 0 &&
        mmap(map->base, map->file_bytes, PROT_READ, MAP_SHARED | MAP_FIXED, s->file.fd, 0) == MAP_FAILED)
        FAIL(error, LAM_ERR_IO, "%s: cannot be mapped: %s", s->path, strerror(errno));
    (void)madvise(map->base, map->file_bytes, MADV_HUGEPAGE); /* not every file system supports it */
    store_map_release(s->map);
    s->map = map;
    map = NULL;
done:
    store_map_release(map);
    return status;
}

void store_map_populate(const store_map *map) {
#ifdef MADV_POPULATE_READ /* since Linux 5.14 */
    (void)madvise(map->base, map->file_bytes, MADV_POPULATE_READ);
#else
    (void)map;
#endif
}

store_map *store_map_hold(store_map *map) {
    if (map != NULL) atomic_fetch_add(&map->references, 1);
    return map;
}

void store_map_release(store_map *map) {
    if (map == NULL || atomic_fetch_sub(&map->references, 1) != 1) return;
    if (map->room != MAP_FAILED) munmap(map->room, map->room_bytes);
    if (map->fd >= 0) close(map->fd);
    for (size_t i = 0; i < map->n_arrays; i++) {
        free(map->arrays[i].name);
        free(map->arrays[i].pieces);
    }
    free(map->arrays);
    free(map->path);
    free(map);
}

store_map *store_map_of(const store *s) {
    return s->map;
}

void store_map_range(const store_map *map, const void **begin, size_t *bytes) {
    *begin = map->base;
    *bytes = map->mapped_bytes;
}

const void *store_map_at(const store_map *map, uint64_t offset) {
    return map->base + offset;
}

bool store_map_changed(const store_map *map) {
    struct stat info;
    return fstat(map->fd, &info) != 0 || (uint64_t)info.st_size != map->identity.size ||
           (int64_t)info.st_mtim.tv_sec != map->identity.modified_s ||
           (int64_t)info.st_mtim.tv_nsec != map->identity.modified_ns;
}

static map_array *find_array(const store_map *map, const char *name) {
    for (size_t i = 0; i < map->n_arrays; i++)
        if (strcmp(map->arrays[i].name, name) == 0) return &map->arrays[i];
    return NULL;
}

/* Adds an array to the list, once. */
static lam_status add_array(store_map *map, const char *name, const store_array *array, const store_sum *sum,
                            lam_error *error) {
    lam_status status = LAM_OK;
    map_array made = {.n_pieces = sum->n_pieces,
                      .offset = (size_t)array->offset,
                      .bytes = array->bytes,
                      .type = array->type};
    if (find_array(map, name) != NULL) return LAM_OK;
    if (map->n_arrays == map->capacity) {
        const size_t capacity = 2 * map->capacity + 8;
        map_array *arrays = realloc(map->arrays, capacity * sizeof *arrays);
        if (arrays == NULL) FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory", name);
        map->arrays = arrays;
        map->capacity = capacity;
    }
    made.name = strdup(name);
    if (made.name == NULL) FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory", name);
    made.pieces = memory_allocate(sum->n_pieces, sizeof *made.pieces, name, error);
    if (made.pieces == NULL) TRY(LAM_ERR_MEMORY);
    memcpy(made.pieces, sum->pieces, sum->n_pieces * sizeof *made.pieces);
    map->arrays[map->n_arrays++] = made;
    made = (map_array){.name = NULL};
done:
    free(made.name);
    free(made.pieces);
    return status;
}

lam_status store_read_view(store *s, const char *name, store_type type, int rank, size_t *dims,
                           store_view *view, lam_error *error) {
    lam_status status = LAM_OK;
    const store_array *array = NULL;
    store_view found = {.data = NULL};
    TRY(store_array_find_as(s, name, type, rank, dims, &array, error));
    if (s->map != NULL && array->bytes >= STORE_MAP_LEAST && array->offset % store_type_size(type) == 0) {
        const store_sum *sum = store_sums_find_for(s, name, array, error);
        if (sum == NULL) TRY(LAM_ERR_DAMAGED);
        TRY(add_array(s->map, name, array, sum, error));
        found.map = store_map_hold(s->map);
        found.data = s->map->base + array->offset;
        memcpy(dims, array->dims, (size_t)rank * sizeof *dims);
    } else {
        TRY(store_read(s, name, type, rank, dims, &found.memory, error));
        found.data = found.memory;
    }
    *view = found;
done:
    return status;
}

void store_view_check(const store_view *view, store_check *check, uint64_t limit, const char *words) {
    store_map *map = view->map;
    for (size_t i = 0; map != NULL && i < map->n_arrays; i++) {
        map_array *array = &map->arrays[i];
        if (map->base + array->offset != (const char *)view->data) continue;
        array->check = check;
        array->limit = limit;
        array->words = words;
    }
}

void store_view_free(store_view *view) {
    store_map_release(view->map);
    free(view->memory);
    *view = (store_view){.data = NULL};
}

size_t store_map_bytes(const store_map *map) {
    size_t total = 0;
    for (size_t i = 0; i < map->n_arrays; i++) total += map->arrays[i].bytes;
    return total;
}

static lam_status damaged(const store_map *map, const map_array *array, size_t piece, const char *what,
                          lam_error *error) {
    return status_fail(error, LAM_ERR_DAMAGED, "%s: %s %s in MiB %zu of %zu; make the store again", map->path,
                       array->name, what, piece + 1, array->n_pieces);
}

/* True if every number of an aligned piece is finite: an exponent of ones only means infinity or NaN. A flag
 * as wide as the numbers lets the compiler compare many at once. */
static bool is_finite(store_type type, const void *piece, size_t bytes) {
    uint16_t half = 0;
    uint32_t single = 0;
    uint64_t whole = 0;
    if (type == STORE_F16)
        for (size_t i = 0; i < bytes / 2; i++) half |= (((const uint16_t *)piece)[i] & 0x7c00u) == 0x7c00u;
    if (type == STORE_F32)
        for (size_t i = 0; i < bytes / 4; i++)
            single |= (((const uint32_t *)piece)[i] & 0x7f800000u) == 0x7f800000u;
    if (type == STORE_F64)
        for (size_t i = 0; i < bytes / 8; i++)
            whole |= (((const uint64_t *)piece)[i] & 0x7ff0000000000000u) == 0x7ff0000000000000u;
    return half == 0 && single == 0 && whole == 0;
}

lam_status store_map_verify(const store_map *map, const stop_check *stop, lam_error *error) {
    for (size_t i = 0; i < map->n_arrays; i++) {
        const map_array *array = &map->arrays[i];
        for (size_t p = 0; p < array->n_pieces; p++) {
            const size_t start = p * STORE_PIECE, rest = array->bytes - start,
                         bytes = rest < STORE_PIECE ? rest : STORE_PIECE;
            const char *piece = map->base + array->offset + start;
            if (stop_asked(stop))
                return status_fail(error, LAM_ERR_CANCELLED, "%s: not read to its end", map->path);
            if (store_checksum(piece, bytes) != array->pieces[p])
                return damaged(map, array, p, "is damaged", error);
            if (!is_finite(array->type, piece, bytes))
                return damaged(map, array, p, "has a number that is not finite", error);
            if (array->check != NULL &&
                !array->check(map->base + array->offset, start, start + bytes, array->limit))
                return damaged(map, array, p, array->words, error);
        }
    }
    return LAM_OK;
}

void store_map_name(const store_map *map, size_t offset, const char *what, lam_error *error) {
    for (size_t i = 0; i < map->n_arrays; i++) {
        const map_array *array = &map->arrays[i];
        if (offset < array->offset || offset - array->offset >= array->bytes) continue;
        (void)damaged(map, array, (offset - array->offset) / STORE_PIECE, what, error);
        return;
    }
    (void)status_fail(error, LAM_ERR_DAMAGED, "%s: %s; make the store again", map->path, what);
}
