#include "server/scene/scene_memory.h"

#include "solver/codec/face_means.h"
#include "solver/codec/sensor_names.h"
#include "solver/operator/operator.h"
#include "store/groups.h"
#include "store/status.h"

#include <stdbool.h>
#include <stdlib.h>

/* The bytes below a group; 0: there is none. */
static lam_status bytes_below(store *s, const char *group, uint64_t *bytes, lam_error *error) {
    *bytes = 0;
    return store_has(s, group) ? store_group_bytes(s, group, bytes, error) : LAM_OK;
}

/* Parts of faces in elements of several. */
static uint64_t face_parts(const store *s) {
    return store_array_bytes(s, STORE_MESH "/face_part_area") / sizeof(double);
}

/* Marks of buried elements. */
static uint64_t buried_memory(const store *s) {
    const bool any = store_array_bytes(s, STORE_MESH "/buried") > 0;
    return any ? store_array_bytes(s, STORE_MESH "/group") / sizeof(uint32_t) * sizeof(bool) : 0;
}

/* The bytes that a scene has of /mesh: areas, reflectances, groups with their names, areas and an index
 * of these, one of faces, and marks of buried elements. */
static uint64_t mesh_memory(const store *s) {
    const uint64_t n = store_array_bytes(s, STORE_MESH "/face") / sizeof(uint32_t),
                   n_faces = store_array_bytes(s, STORE_MESH "/face_area") / sizeof(double);
    const uint64_t names = store_texts_memory(s, STORE_MESH "/group_names");
    return buried_memory(s) + store_array_bytes(s, STORE_MESH "/area") +
           store_array_bytes(s, STORE_MESH "/reflectance") + store_array_bytes(s, STORE_MESH "/group") +
           face_index_bytes(n, n_faces, face_parts(s)) + names +
           names / (sizeof(char *) + 1) * (2 * sizeof(uint32_t) + sizeof(double));
}

/* The names of luminaires and of their groups, twice, and an index of both. */
static uint64_t luminaire_names_memory(const store *s) {
    return 4 * (store_texts_memory(s, STORE_LUMINAIRES "/names") +
                store_texts_memory(s, STORE_LUMINAIRES "/group_names"));
}

/* The index of sets of sensors, whose names are held twice. */
static uint64_t sensor_names_memory(const store *s) {
    return 3 * store_texts_memory(s, STORE_SENSORS "/names") +
           sensor_names_bytes(store_array_bytes(s, STORE_SENSORS "/flags") / sizeof(uint32_t));
}

lam_status scene_memory_passing(store *s, uint64_t *memory, lam_error *error) {
    lam_status status = LAM_OK;
    uint64_t receivers, sources;
    /* Emission is read after groups are freed. */
    const uint64_t group = store_array_bytes(s, STORE_MESH "/group"),
                   emission = store_array_bytes(s, STORE_MESH "/emission");
    const uint64_t buried = buried_memory(s) > 0
                                ? buried_memory(s) + store_array_bytes(s, STORE_MESH "/buried") +
                                      store_array_bytes(s, STORE_MESH "/area")
                                : 0;
    TRY(bytes_below(s, STORE_IMPORTANCE, &receivers, error));
    TRY(bytes_below(s, STORE_SOURCES, &sources, error));
    *memory = (group > emission ? group : emission) + store_texts_memory(s, STORE_MESH "/group_names") +
              16 * face_parts(s) + buried + receivers + sources;
done:
    return status;
}

lam_status scene_memory_of(store *s, uint64_t *memory, uint64_t *operator_bytes, lam_error *error) {
    lam_status status = LAM_OK;
    char *kind = NULL;
    uint64_t sky, luminaires, sensors, errors;
    TRY(store_group_bytes(s, STORE_OPERATOR, operator_bytes, error));
    TRY(bytes_below(s, STORE_SKY, &sky, error));
    TRY(bytes_below(s, STORE_LUMINAIRES, &luminaires, error));
    TRY(bytes_below(s, STORE_SENSORS, &sensors, error));
    TRY(bytes_below(s, STORE_ERROR, &errors, error));
    TRY(store_get_text(s, STORE_OPERATOR, "kind", &kind, error));
    *memory = operator_memory(s, kind, *operator_bytes) + sky + luminaires + luminaire_names_memory(s) +
              sensors + sensor_names_memory(s) + errors + mesh_memory(s);
done:
    free(kind);
    return status;
}
