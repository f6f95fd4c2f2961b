/* The elements of a scene as columns of numbers, for clients that have not its store, and the answers with
 * them that are kept. Arrays of the mesh that the scene does not hold are read from its store again. Any
 * thread. */
#ifndef LAMBERT_SERVER_SCENE_SCENE_ELEMENTS_H
#define LAMBERT_SERVER_SCENE_SCENE_ELEMENTS_H

#include "server/scene/kept_forms.h"
#include "store/status.h"

typedef struct scene scene;
typedef struct scene_elements scene_elements;

/* In the order of answers. */
typedef enum element_field {
    FIELD_AREA,
    FIELD_NORMAL,
    FIELD_CENTRE,
    FIELD_GROUP,
    FIELD_FACE,
    FIELD_REFLECTANCE,
    ELEMENT_FIELDS
} element_field;

/* Sets of fields. */
#define FIELD_BIT(field) (1u << (field))
#define ALL_FIELDS (FIELD_BIT(ELEMENT_FIELDS) - 1)

/* Columns of n elements in mesh order; those that were not asked for are NULL. */
typedef struct element_columns {
    const double *area;       /* [n], m^2, of the scene */
    float *normal;            /* [n][3], in the scene's axes */
    float *centre;            /* [n][3], area centroids, m, in the same axes */
    uint32_t *group;          /* [n], numbers of groups */
    int32_t *face;            /* [n], of the scene file; -1: none, several, or not known */
    const float *reflectance; /* [C][n], of the scene or the variant */
} element_columns;

/* For a scene that is else complete and outlives it. Errors: LAM_ERR_MEMORY. */
lam_status scene_elements_create(const scene *of, scene_elements **out, lam_error *error);

/* NULL is allowed, here and below. */
void scene_elements_destroy(scene_elements *e);

/* Reads the columns of some fields, freed by element_columns_free, also after an error. The store is opened
 * for normals and centres alone, and must be the one of the scene. O(n). Errors: LAM_ERR_IO (also if the file
 * was replaced), LAM_ERR_DAMAGED, LAM_ERR_FORMAT, LAM_ERR_MEMORY. */
lam_status scene_elements_read(const scene_elements *e, unsigned fields, element_columns *out,
                               lam_error *error);
void element_columns_free(element_columns *columns);

/* Bytes that scene_elements_read takes, at most. */
size_t scene_elements_read_bytes(const scene_elements *e, unsigned fields);

/* The tag of the scene in quotes, as answers have it (Lambert-Scene): another one where any number of the
 * store or its reflectances differs, and the same from one start of the daemon to the next. */
#define SCENE_TAG_MAX 20
const char *scene_elements_text(const scene_elements *e);

/* A number for all that determines an answer, of which `which` tells those of one scene from each other:
 * equal answers may have two, two never have one (but for a collision of 64 bits). It stays the same from one
 * start of the daemon to the next. O(1). */
uint64_t scene_elements_tag(const scene_elements *e, unsigned which);

/* A reference to the forms of an answer, or NULL when memory is short. The ELEMENTS_KEPT answers that were
 * asked for last are kept. */
#define ELEMENTS_KEPT 8
kept_forms *scene_elements_forms(scene_elements *e, unsigned which);

/* Bytes that kept forms have of the ledger; and drops these. */
size_t scene_elements_held(scene_elements *e);
void scene_elements_clear(scene_elements *e);

#endif
