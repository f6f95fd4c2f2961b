#include "server/scene/scene_mesh.h"

#include "server/scene/scene_corners.h"
#include "server/scene/scene_store.h"
#include "solver/codec/gltf/gltf.h"
#include "solver/operator/corners/corner_hanging.h"
#include "store/groups.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

struct scene_mesh {
    const scene *of;
    char up;
    size_t n_vertices;
    size_t n_textured, n_textures, image_bytes; /* of gltf_sizes; 0 where no image is shown */
    uint64_t tag;
    kept_forms *forms[MESH_FORMS];
};

static lam_status read_up(store *s, char *up, lam_error *error) {
    lam_status status = LAM_OK;
    char *text = NULL;
    TRY(store_get_text(s, STORE_MESH, "up", &text, error));
    if (strlen(text) != 1 || strchr("xyz", text[0]) == NULL)
        FAIL(error, LAM_ERR_FORMAT, "%s: /mesh attribute up is '%s', must be x, y or z", store_path(s), text);
    *up = text[0];
done:
    free(text);
    return status;
}

static lam_status read_vertices(store *s, size_t *count, lam_error *error) {
    lam_status status = LAM_OK;
    store_type type;
    size_t dims[STORE_MAX_RANK];
    int rank;
    TRY(store_array_info(s, STORE_MESH "/vertices", &type, &rank, dims, error));
    if (type != STORE_F64 || rank != 2 || dims[1] != 3)
        FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/vertices must be [v][3] of f64", store_path(s));
    *count = dims[0];
done:
    return status;
}

/* Images are those of three channels, or the grey ones of one. */
static lam_status read_sizes_of_images(store *s, scene_mesh *made, lam_error *error) {
    lam_status status = LAM_OK;
    store_type type;
    size_t dims[STORE_MAX_RANK];
    int rank;
    const size_t C = made->of->n_channels;
    if ((C != 1 && C != 3) || !store_has(s, STORE_MESH "/surface")) return LAM_OK;
    made->n_textured = made->of->n;
    TRY(store_array_info(s, STORE_MESH "/surface_image", &type, &rank, dims, error));
    made->n_textures = dims[0];
    TRY(store_array_info(s, STORE_MESH "/image_start", &type, &rank, dims, error));
    made->n_textures += dims[0];
    TRY(store_array_info(s, STORE_MESH "/images", &type, &rank, dims, error));
    /* Each begins at a multiple of 4. */
    made->image_bytes = dims[0] + 3 * made->n_textures;
done:
    return status;
}

/* The checksum of the store stands for its arrays; the description for names, and for the reflectances of a
 * variant. */
static lam_status make_tag(scene_mesh *mesh, lam_error *error) {
    char *text = NULL;
    const int length = asprintf(&text, "%s %s %c %s", LAMBERT_VERSION, scene_root(mesh->of)->identity.digest,
                                mesh->up, mesh->of->description);
    if (length < 0) return status_fail(error, LAM_ERR_MEMORY, "not enough memory for the tag of a mesh");
    mesh->tag = store_checksum(text, (size_t)length);
    free(text);
    return LAM_OK;
}

lam_status scene_mesh_create(store *s, const scene *of, scene_mesh **out, lam_error *error) {
    lam_status status = LAM_OK;
    scene_mesh *made = memory_allocate(1, sizeof *made, "the mesh of a scene", error);
    if (made == NULL) return LAM_ERR_MEMORY;
    made->of = of;
    for (mesh_form f = 0; f < MESH_FORMS; f++)
        TRY(kept_forms_create(of->ledger, "the mesh of a scene", &made->forms[f], error));
    if (of->base != NULL) {
        const scene_mesh *base = of->base->mesh;
        made->up = base->up;
        made->n_vertices = base->n_vertices;
        made->n_textured = base->n_textured;
        made->n_textures = base->n_textures;
        made->image_bytes = base->image_bytes;
    } else {
        TRY(read_up(s, &made->up, error));
        TRY(read_vertices(s, &made->n_vertices, error));
        TRY(read_sizes_of_images(s, made, error));
    }
    TRY(make_tag(made, error));
    *out = made;
    made = NULL;
done:
    scene_mesh_destroy(made);
    return status;
}

void scene_mesh_destroy(scene_mesh *mesh) {
    if (mesh == NULL) return;
    for (mesh_form f = 0; f < MESH_FORMS; f++) kept_forms_release(mesh->forms[f]);
    free(mesh);
}

uint64_t scene_mesh_tag(const scene_mesh *mesh, mesh_form form) {
    const uint64_t both[2] = {mesh->tag, form};
    return form == MESH_ELEMENTS ? mesh->tag : store_checksum(both, sizeof both);
}

size_t scene_mesh_vertices(const scene_mesh *mesh) {
    return mesh->n_vertices;
}

kept_forms *scene_mesh_forms(scene_mesh *mesh, mesh_form form) {
    return mesh->forms[form];
}

size_t scene_mesh_held(scene_mesh *mesh) {
    size_t held = 0;
    for (mesh_form f = 0; f < MESH_FORMS; f++) held += kept_forms_held(mesh->forms[f]);
    return held;
}

void scene_mesh_clear(scene_mesh *mesh) {
    for (mesh_form f = 0; f < MESH_FORMS; f++) kept_forms_clear(mesh->forms[f]);
}

/* Corners inside edges, and weights of corners, that an element has at most in the mean: even meshes have
 * none and 16. */
#define INSIDE_OF_ELEMENT INSIDE_MOST
#define WEIGHTS_OF_ELEMENT ((size_t)64)

static size_t sum(size_t a, size_t b) {
    size_t both;
    return __builtin_add_overflow(a, b, &both) ? SIZE_MAX : both;
}

static size_t times(size_t a, size_t b) {
    size_t product;
    return __builtin_mul_overflow(a, b, &product) ? SIZE_MAX : product;
}

static gltf_sizes sizes_of(const scene_mesh *mesh, mesh_form form) {
    const scene *s = mesh->of;
    gltf_sizes sizes = {.n = s->n,
                        .n_vertices = mesh->n_vertices,
                        .n_groups = s->groups.n_groups,
                        .n_textured = mesh->n_textured,
                        .n_textures = mesh->n_textures,
                        .image_bytes = mesh->image_bytes};
    if (form == MESH_CORNERS) sizes.n_textured = sizes.n_textures = sizes.image_bytes = 0;
    sizes.corners = form != MESH_ELEMENTS;
    if (sizes.corners) sizes.n_inside = times(s->n, INSIDE_OF_ELEMENT);
    if (form == MESH_ELEMENTS_CORNERS) sizes.n_weights = times(s->n, WEIGHTS_OF_ELEMENT);
    sizes.n_texts = strlen(s->name);
    for (size_t i = 0; i < s->n; i++) sizes.n_buried += !group_index_counts(&s->groups, i);
    for (size_t g = 0; g < s->groups.n_groups; g++) sizes.n_texts += strlen(s->groups.names[g]);
    return sizes;
}

size_t scene_mesh_bytes_most(const scene_mesh *mesh, mesh_form form) {
    const gltf_sizes sizes = sizes_of(mesh, form);
    return gltf_bytes_most(&sizes);
}

size_t scene_mesh_build_bytes(const scene_mesh *mesh, mesh_form form) {
    const gltf_sizes sizes = sizes_of(mesh, form);
    const size_t corners =
        form == MESH_ELEMENTS ? 0
                              : sum(corner_work_bytes(sizes.n, sizes.n_vertices), times(sizes.n_weights, 12));
    const size_t element = 4 * sizeof(uint32_t) + (3 + mesh->of->n_channels) * sizeof(float);
    const size_t on_element = sizeof(uint32_t) + 8 * sizeof(float), of_texture = 4 * sizeof(uint64_t) * 3;
    const size_t images =
        sum(times(sizes.n_textured, on_element), sum(times(sizes.n_textures, of_texture), sizes.image_bytes));
    const size_t panes = times(sizes.n_groups, sizeof(struct group_glass));
    return sum(
        sum(times(mesh->n_vertices, 3 * sizeof(double)), sum(times(sizes.n, element), sum(images, panes))),
        sum(corners, sum(gltf_bytes_most(&sizes), gltf_work_bytes(&sizes))));
}

/* Arrays of /mesh that a scene does not hold. */
typedef struct arrays {
    void *vertices, *elements, *normal, *emission;
    scene_pictures *pictures;
    scene_glass glass;
} arrays;

static lam_status read_arrays(store *s, const scene_mesh *mesh, mesh_form form, arrays *a, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = mesh->of->n, C = mesh->of->n_channels;
    TRY(store_read(s, STORE_MESH "/vertices", STORE_F64, 2, (size_t[]){mesh->n_vertices, 3}, &a->vertices,
                   error));
    TRY(store_read(s, STORE_MESH "/elements", STORE_U32, 2, (size_t[]){n, 4}, &a->elements, error));
    TRY(store_read(s, STORE_MESH "/normal", STORE_F32, 2, (size_t[]){n, 3}, &a->normal, error));
    TRY(store_read(s, STORE_MESH "/emission", STORE_F32, 2, (size_t[]){C, n}, &a->emission, error));
    if (form != MESH_CORNERS && mesh->n_textured > 0) TRY(scene_pictures_load(s, n, &a->pictures, error));
    TRY(scene_glass_load(s, mesh->of->groups.n_groups, &a->glass, error));
    const uint32_t(*elements)[4] = a->elements;
    for (size_t i = 0; i < n; i++)
        for (int k = 0; k < 4; k++)
            if (elements[i][k] >= mesh->n_vertices && !(k == 3 && elements[i][k] == GLTF_NO_VERTEX))
                FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/elements[%zu][%d] = %u, there are %zu vertices",
                     store_path(s), i, k, elements[i][k], mesh->n_vertices);
    const float *emission = a->emission;
    for (size_t i = 0; i < C * n; i++)
        if (!isfinite(emission[i]))
            FAIL(error, LAM_ERR_FORMAT, "%s: /mesh/emission[%zu][%zu] = %g, must be finite", store_path(s),
                 i / n, i % n, (double)emission[i]);
done:
    return status;
}

/* Takes the images off elements whose reflectance a variant changed: what it gave them is even. */
static void drop_changed(const scene *of, scene_pictures *pictures) {
    const float *before = scene_root(of)->reflectance;
    for (size_t c = 0; c < of->n_channels; c++)
        for (size_t i = 0; i < of->n; i++)
            if (of->reflectance[c * of->n + i] != before[c * of->n + i]) pictures->surface[i] = PICTURE_NONE;
}

/* The corners of the mesh, and their weights. */
typedef struct mesh_corners {
    corner_arrays arrays;
    corner_nodes nodes;
    corner_matrix matrix;
    gltf_corners of;
} mesh_corners;

static lam_status find_corners(store *s, const scene *root, mesh_form form, mesh_corners *c,
                               lam_error *error) {
    lam_status status = LAM_OK;
    const corner_plan *plan;
    TRY(corner_arrays_read(s, root->n, &c->arrays, error));
    const corner_mesh m = corner_arrays_mesh(&c->arrays);
    TRY(corner_nodes_create(&m, &c->nodes, error));
    if (c->nodes.n_nodes > GLTF_ELEMENTS_MOST)
        FAIL(error, LAM_ERR_ARGUMENT, "%zu corners, at most %zu have a number in glTF", c->nodes.n_nodes,
             GLTF_ELEMENTS_MOST);
    c->of = (gltf_corners){.nodes = &c->nodes, .shared = form == MESH_CORNERS};
    if (form == MESH_ELEMENTS_CORNERS) {
        TRY(scene_corners_get(root->corners, &plan, error));
        TRY(corner_plan_expand(plan, times(root->n, WEIGHTS_OF_ELEMENT), &c->matrix, error));
        c->of.matrix = &c->matrix;
    }
done:
    return status;
}

static void mesh_corners_free(mesh_corners *c) {
    corner_arrays_free(&c->arrays);
    corner_nodes_free(&c->nodes);
    corner_matrix_free(&c->matrix);
}

lam_status scene_mesh_build(const scene_mesh *mesh, mesh_form form, buffer *out, lam_error *error) {
    lam_status status = LAM_OK;
    const scene *of = mesh->of, *root = scene_root(of);
    store *s = NULL;
    arrays a = {.vertices = NULL};
    mesh_corners corners = {.nodes = {.n_nodes = 0}};
    lam_error cause;
    TRY(scene_store_open(of, &s, error));
    TRY(read_arrays(s, mesh, form, &a, error));
    if (form != MESH_ELEMENTS) TRY(find_corners(s, root, form, &corners, error));
    if (a.pictures != NULL && of != root) drop_changed(of, a.pictures);
    const gltf_mesh m = {.name = of->name,
                         .kind = lam_operator_kind(of->op),
                         .n_vertices = mesh->n_vertices,
                         .n = of->n,
                         .n_channels = of->n_channels,
                         .vertices = a.vertices,
                         .elements = a.elements,
                         .normal = a.normal,
                         .area = root->area,
                         .reflectance = of->reflectance,
                         .emission = a.emission,
                         .face = root->faces.of.of,
                         .groups = &root->groups,
                         .glass = a.glass.of != NULL ? &a.glass : NULL,
                         .pictures = a.pictures,
                         .corners = form != MESH_ELEMENTS ? &corners.of : NULL,
                         .up = mesh->up};
    status = gltf_write(&m, out, &cause);
    if (status != LAM_OK) FAIL(error, status, "%s: %s", root->path, cause.message);
done:
    store_close(s);
    mesh_corners_free(&corners);
    if (a.pictures != NULL) scene_pictures_free(a.pictures);
    free(a.pictures);
    free(a.vertices);
    free(a.elements);
    free(a.normal);
    free(a.emission);
    free(a.glass.of);
    return status;
}
