#include "server/scene/scene_elements.h"

#include "server/scene/scene_store.h"
#include "solver/operator/groups/mesh_columns.h"
#include "store/groups.h"

#include <pthread.h>
#include <stdio.h>

/* The forms of an answer, and when they were asked for last. */
typedef struct kept_place {
    unsigned which;
    uint64_t asked;
    kept_forms *forms; /* NULL: the place is free */
} kept_place;

struct scene_elements {
    const scene *of;
    uint64_t tag; /* for all that determines the columns */
    char text[SCENE_TAG_MAX];
    pthread_mutex_t lock;
    uint64_t n_asked;
    kept_place kept[ELEMENTS_KEPT];
};

/* As in scene_mesh.c: the checksum of the store stands for its arrays, the description for names, and for the
 * reflectances of a variant. */
static lam_status make_tag(scene_elements *e, lam_error *error) {
    char *text = NULL;
    const int length = asprintf(&text, "elements %s %s %s", LAMBERT_VERSION,
                                scene_root(e->of)->identity.digest, e->of->description);
    if (length < 0) return status_fail(error, LAM_ERR_MEMORY, "not enough memory for the tag of elements");
    e->tag = store_checksum(text, (size_t)length);
    snprintf(e->text, sizeof e->text, "\"%016llx\"", (unsigned long long)e->tag);
    free(text);
    return LAM_OK;
}

lam_status scene_elements_create(const scene *of, scene_elements **out, lam_error *error) {
    lam_status status = LAM_OK;
    scene_elements *made = memory_allocate(1, sizeof *made, "the elements of a scene", error);
    if (made == NULL) return LAM_ERR_MEMORY;
    made->of = of;
    pthread_mutex_init(&made->lock, NULL);
    TRY(make_tag(made, error));
    *out = made;
    made = NULL;
done:
    scene_elements_destroy(made);
    return status;
}

void scene_elements_destroy(scene_elements *e) {
    if (e == NULL) return;
    for (size_t k = 0; k < ELEMENTS_KEPT; k++) kept_forms_release(e->kept[k].forms);
    pthread_mutex_destroy(&e->lock);
    free(e);
}

const char *scene_elements_text(const scene_elements *e) {
    return e->text;
}

uint64_t scene_elements_tag(const scene_elements *e, unsigned which) {
    const uint64_t both[2] = {e->tag, which};
    return store_checksum(both, sizeof both);
}

/* The place of an answer: that which it has, or else one that is free, or the one asked for longest ago. */
static kept_place *find_place(scene_elements *e, unsigned which) {
    kept_place *found = &e->kept[0];
    for (size_t k = 0; k < ELEMENTS_KEPT; k++) {
        kept_place *at = &e->kept[k];
        if (at->forms != NULL && at->which == which) return at;
        if (at->asked < found->asked) found = at;
    }
    return found;
}

kept_forms *scene_elements_forms(scene_elements *e, unsigned which) {
    kept_forms *made = NULL, *dropped = NULL;
    lam_error unused;
    pthread_mutex_lock(&e->lock);
    kept_place *at = find_place(e, which);
    const bool there = at->forms != NULL && at->which == which;
    if (!there && kept_forms_create(e->of->ledger, "the elements of a scene", &made, &unused) == LAM_OK) {
        dropped = at->forms;
        *at = (kept_place){.which = which, .forms = made};
    }
    kept_forms *forms = NULL;
    if (there || made != NULL) {
        at->asked = ++e->n_asked;
        forms = kept_forms_hold(at->forms);
    }
    pthread_mutex_unlock(&e->lock);
    kept_forms_release(dropped);
    return forms;
}

size_t scene_elements_held(scene_elements *e) {
    size_t held = 0;
    if (e == NULL) return 0;
    pthread_mutex_lock(&e->lock);
    for (size_t k = 0; k < ELEMENTS_KEPT; k++) held += kept_forms_held(e->kept[k].forms);
    pthread_mutex_unlock(&e->lock);
    return held;
}

void scene_elements_clear(scene_elements *e) {
    if (e == NULL) return;
    pthread_mutex_lock(&e->lock);
    for (size_t k = 0; k < ELEMENTS_KEPT; k++) kept_forms_clear(e->kept[k].forms);
    pthread_mutex_unlock(&e->lock);
}

size_t scene_elements_read_bytes(const scene_elements *e, unsigned fields) {
    const size_t vectors = 3 * sizeof(float), numbers = sizeof(uint32_t);
    const bool centres = (fields & FIELD_BIT(FIELD_CENTRE)) != 0;
    size_t of_element = centres ? vectors + 4 * sizeof(uint32_t) : 0, of_vertices, bytes;
    if (fields & FIELD_BIT(FIELD_NORMAL)) of_element += vectors;
    if (fields & FIELD_BIT(FIELD_GROUP)) of_element += numbers;
    if (fields & FIELD_BIT(FIELD_FACE)) of_element += numbers;
    const size_t v = centres ? scene_mesh_vertices(e->of->mesh) : 0;
    return size_multiply(v, 3 * sizeof(double), &of_vertices) &&
                   size_multiply(e->of->n, of_element, &bytes) &&
                   !__builtin_add_overflow(bytes, of_vertices, &bytes)
               ? bytes
               : SIZE_MAX;
}

static lam_status read_mesh(const scene *of, unsigned fields, element_columns *out, lam_error *error) {
    lam_status status = LAM_OK;
    store *s = NULL;
    void *normal = NULL;
    TRY(scene_store_open(of, &s, error));
    if (fields & FIELD_BIT(FIELD_CENTRE)) TRY(centres_load(s, of->n, &out->centre, error));
    if (fields & FIELD_BIT(FIELD_NORMAL))
        TRY(store_read(s, STORE_MESH "/normal", STORE_F32, 2, (size_t[]){of->n, 3}, &normal, error));
    out->normal = normal;
done:
    store_close(s);
    return status;
}

/* The group of each element. */
static lam_status list_groups(const scene *of, uint32_t **out, lam_error *error) {
    const group_index *groups = &of->groups;
    *out = memory_allocate(of->n, sizeof **out, "groups of elements", error);
    if (*out == NULL) return LAM_ERR_MEMORY;
    for (size_t g = 0; g < groups->n_groups; g++)
        for (uint32_t at = groups->start[g]; at < groups->start[g + 1]; at++)
            (*out)[groups->elements[at]] = (uint32_t)g;
    return LAM_OK;
}

/* The face of each element, that of its front of a back. */
static lam_status list_faces(const scene *of, int32_t **out, lam_error *error) {
    const uint32_t *face = of->faces.of.of;
    *out = memory_allocate(of->n, sizeof **out, "faces of elements", error);
    if (*out == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < of->n; i++)
        (*out)[i] = face != NULL && face[i] <= INT32_MAX ? (int32_t)face[i] : -1;
    return LAM_OK;
}

lam_status scene_elements_read(const scene_elements *e, unsigned fields, element_columns *out,
                               lam_error *error) {
    lam_status status = LAM_OK;
    const scene *of = e->of;
    *out = (element_columns){.area = fields & FIELD_BIT(FIELD_AREA) ? of->area : NULL,
                             .reflectance = fields & FIELD_BIT(FIELD_REFLECTANCE) ? of->reflectance : NULL};
    if (fields & (FIELD_BIT(FIELD_CENTRE) | FIELD_BIT(FIELD_NORMAL))) TRY(read_mesh(of, fields, out, error));
    if (fields & FIELD_BIT(FIELD_GROUP)) TRY(list_groups(of, &out->group, error));
    if (fields & FIELD_BIT(FIELD_FACE)) TRY(list_faces(of, &out->face, error));
done:
    return status;
}

void element_columns_free(element_columns *columns) {
    free(columns->normal);
    free(columns->centre);
    free(columns->group);
    free(columns->face);
    *columns = (element_columns){.area = NULL};
}
