#include "solver/scene/tables.h"

#include "solver/base/array_grow.h"

#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

/* Doubles the slots; hash_of(table, i) gives the hash of entry i < n. */
static lam_status slots_grow(table_slots *slots, size_t n, uint64_t (*hash_of)(const void *table, size_t i),
                             const void *table, lam_error *error) {
    size_t wanted = slots->n_slots == 0 ? 256 : slots->n_slots * 2;
    uint32_t *fresh = memory_allocate(wanted, sizeof *fresh, "scene table", error);
    if (fresh == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < n; i++) {
        size_t slot = hash_of(table, i) & (wanted - 1);
        while (fresh[slot] != 0) slot = (slot + 1) & (wanted - 1);
        fresh[slot] = (uint32_t)(i + 1);
    }
    free(slots->slots);
    slots->slots = fresh;
    slots->n_slots = wanted;
    return LAM_OK;
}

/* More entries than this would make an index look like TABLE_NONE or MESH_NO_VERTEX. */
static const size_t most_entries = 0xFFFFFFF0u;

static uint64_t name_hash(const void *table, size_t i) {
    const name_table *t = table;
    const char *name = t->text + t->start[i];
    return XXH3_64bits(name, strlen(name));
}

/* The slot that holds name, or the free one where it belongs. */
static size_t name_slot(const name_table *t, const char *name, size_t length) {
    size_t slot = XXH3_64bits(name, length) & (t->slots.n_slots - 1);
    for (; t->slots.slots[slot] != 0; slot = (slot + 1) & (t->slots.n_slots - 1)) {
        const char *there = t->text + t->start[t->slots.slots[slot] - 1];
        if (strlen(there) == length && memcmp(there, name, length) == 0) break;
    }
    return slot;
}

lam_status name_table_add(name_table *t, const char *name, size_t length, uint32_t *index, lam_error *error) {
    lam_status status = LAM_OK;
    length = strnlen(name, length);
    if ((t->n + 1) * 2 > t->slots.n_slots) TRY(slots_grow(&t->slots, t->n, name_hash, t, error));
    size_t slot = name_slot(t, name, length);
    if (t->slots.slots[slot] == 0) {
        if (t->n >= most_entries) FAIL(error, LAM_ERR_MEMORY, "scene: more than %zu names", most_entries);
        TRY(array_grow(&t->start, &t->start_capacity, t->n + 1, sizeof *t->start, "names", error));
        TRY(array_grow(&t->text, &t->text_capacity, t->text_bytes + length + 1, 1, "names", error));
        t->start[t->n] = t->text_bytes;
        memcpy(t->text + t->text_bytes, name, length);
        t->text[t->text_bytes + length] = '\0';
        t->text_bytes += length + 1;
        t->slots.slots[slot] = (uint32_t)++t->n;
    }
    *index = t->slots.slots[slot] - 1;
done:
    return status;
}

const char *name_table_get(const name_table *t, size_t index) {
    return t->text + t->start[index];
}

void name_table_free(name_table *t) {
    free(t->start);
    free(t->text);
    free(t->slots.slots);
    *t = (name_table){0};
}

char **name_table_block(const name_table *t, lam_error *error) {
    char **block = memory_allocate(1, t->n * sizeof *block + t->text_bytes, "group names", error);
    if (block == NULL) return NULL;
    char *text = (char *)(block + t->n);
    if (t->text_bytes > 0) memcpy(text, t->text, t->text_bytes);
    for (size_t i = 0; i < t->n; i++) block[i] = text + t->start[i];
    return block;
}

static uint64_t point_hash(const void *table, size_t i) {
    const point_table *t = table;
    return XXH3_64bits(t->points[i], sizeof t->points[i]);
}

lam_status point_table_add(point_table *t, const double point[3], uint32_t *index, lam_error *error) {
    lam_status status = LAM_OK;
    const double p[3] = {point[0] + 0.0, point[1] + 0.0, point[2] + 0.0}; /* turns -0 into 0 */
    if ((t->n + 1) * 2 > t->slots.n_slots) TRY(slots_grow(&t->slots, t->n, point_hash, t, error));
    size_t slot = XXH3_64bits(p, sizeof p) & (t->slots.n_slots - 1);
    while (t->slots.slots[slot] != 0 && memcmp(t->points[t->slots.slots[slot] - 1], p, sizeof p) != 0)
        slot = (slot + 1) & (t->slots.n_slots - 1);
    if (t->slots.slots[slot] == 0) {
        if (t->n >= most_entries) FAIL(error, LAM_ERR_MEMORY, "mesh: more than %zu vertices", most_entries);
        TRY(array_grow(&t->points, &t->capacity, t->n + 1, sizeof *t->points, "vertices", error));
        memcpy(t->points[t->n], p, sizeof p);
        t->slots.slots[slot] = (uint32_t)++t->n;
    }
    *index = t->slots.slots[slot] - 1;
done:
    return status;
}

void point_table_free(point_table *t) {
    free(t->points);
    free(t->slots.slots);
    *t = (point_table){0};
}

lam_status points_weld(size_t n, const double (*points)[3], uint32_t *place, lam_error *error) {
    lam_status status = LAM_OK;
    point_table table = {.n = 0};
    uint32_t *first = memory_allocate(n, sizeof *first, "vertices", error); /* of each entry of the table */
    if (first == NULL) return LAM_ERR_MEMORY;
    for (uint32_t v = 0; v < n; v++) {
        const size_t before = table.n;
        uint32_t entry = 0;
        TRY(point_table_add(&table, points[v], &entry, error));
        if (table.n > before) first[entry] = v;
        place[v] = first[entry];
    }
done:
    point_table_free(&table);
    free(first);
    return status;
}
