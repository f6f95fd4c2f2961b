/* Reads glTF, PLY, STL and the other formats of libassimp: the only file that knows libassimp. Runs in the
 * child. */
#include "solver/base/array_grow.h"
#include "solver/base/asset_files.h"
#include "solver/base/file_text.h"
#include "solver/scene/import/imported_faces.h"

#include <assimp/cfileio.h>
#include <assimp/cimport.h>
#include <assimp/config.h>
#include <assimp/material.h>
#include <assimp/scene.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

typedef struct assimp_state {
    const struct aiScene *scene;
    imported_faces *s;
    const char *path;
    bool gltf;
    uint32_t *materials;           /* library's index -> ours, or TABLE_NONE */
    gltf_material *gltf_materials; /* of a glTF, in the file's order */
    size_t n_gltf_materials;
    uint32_t *corners;
    imported_corner *skin;
    size_t corner_capacity, skin_capacity;
    size_t colourless; /* faces without a material, whose corners have colours */
} assimp_state;

typedef struct affine {
    double a[3][4];
} affine;

static affine affine_of(const struct aiMatrix4x4 *t) {
    return (affine){
        {{t->a1, t->a2, t->a3, t->a4}, {t->b1, t->b2, t->b3, t->b4}, {t->c1, t->c2, t->c3, t->c4}}};
}

static affine affine_product(const affine *x, const affine *y) {
    affine out;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++)
            out.a[i][j] = x->a[i][0] * y->a[0][j] + x->a[i][1] * y->a[1][j] + x->a[i][2] * y->a[2][j] +
                          (j == 3 ? x->a[i][3] : 0);
    return out;
}

static bool is_mirrored(const affine *t) {
    const double(*a)[4] = t->a;
    return a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) -
               a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0]) +
               a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0]) <
           0;
}

static bool colour_of(const struct aiMaterial *m, const char *key, double out[3]) {
    struct aiColor4D c;
    if (aiGetMaterialColor(m, key, 0, 0, &c) != aiReturn_SUCCESS) return false;
    out[0] = c.r, out[1] = c.g, out[2] = c.b;
    return true;
}

static const char colour_base[] = "$clr.base", colour_diffuse[] = "$clr.diffuse",
                  colour_emissive[] = "$clr.emissive";

/* True for the material that the library adds for faces without one: it has the library's default name, or
 * none; in a glTF, whose materials may be nameless, it is the last one. */
static bool is_made_up(const assimp_state *a, unsigned index, const char *name) {
    if (strcmp(name, AI_DEFAULT_MATERIAL_NAME) == 0) return true;
    return name[0] == '\0' && (!a->gltf || index + 1 == a->scene->mNumMaterials);
}

/* Images are read of glTF and OBJ alone. */
static void tell_images(assimp_state *a, const struct aiMaterial *m, const char *name,
                        imported_material *fresh) {
    static const enum aiTextureType types[] = {aiTextureType_DIFFUSE, aiTextureType_BASE_COLOR,
                                               aiTextureType_EMISSIVE};
    unsigned found = 0;
    for (size_t k = 0; k < sizeof types / sizeof *types; k++)
        found += aiGetMaterialTextureCount(m, types[k]) > 0;
    if (found == 0) return;
    fresh->textures[TEXTURE_REFLECTANCE].named = 1;
    import_warn(&a->s->warnings,
                "%s: the images of material '%s' are not read in this format; plain colours take "
                "their place",
                a->path, name);
}

/* The material of a glTF that the library tells by its number in the file, or NULL. */
static const gltf_material *gltf_material_of(const assimp_state *a, const char *name) {
    const size_t length = sizeof GLTF_NUMBER - 1;
    if (a->n_gltf_materials == 0 || strncmp(name, GLTF_NUMBER, length) != 0) return NULL;
    const size_t number = strtoul(name + length, NULL, 10);
    return number < a->n_gltf_materials ? &a->gltf_materials[number] : NULL;
}

static lam_status read_material(assimp_state *a, unsigned index, lam_error *error) {
    lam_status status = LAM_OK;
    const struct aiMaterial *m = a->scene->mMaterials[index];
    struct aiString given = {0};
    char name[sizeof given.data + 32];
    aiGetMaterialString(m, AI_MATKEY_NAME, &given);
    const gltf_material *own = gltf_material_of(a, given.data);
    snprintf(name, sizeof name, "%.*s", (int)sizeof given.data - 1,
             own == NULL         ? given.data
             : own->name == NULL ? ""
                                 : own->name);
    a->materials[index] = TABLE_NONE;
    if (is_made_up(a, index, name)) return LAM_OK;
    if (name[0] == '\0') snprintf(name, sizeof name, "material-%u", index);
    TRY(imported_faces_add_material(a->s, name, strlen(name), &a->materials[index], error));
    imported_material *v = &a->s->values[a->materials[index]];
    imported_material fresh = {.defined = 1};
    fresh.has_diffuse =
        colour_of(m, colour_base, fresh.diffuse) || colour_of(m, colour_diffuse, fresh.diffuse);
    colour_of(m, colour_emissive, fresh.emission);
    double scale = 1, diffuse = 1;
    if (own != NULL) {
        diffuse = own->diffuse;
        scale = M_PI * own->strength; /* of a luminance L, a diffuse surface sends out pi L */
        fresh.two_sided = own->two_sided;
        fresh.transmittance = own->transmittance;
        memcpy(fresh.textures, own->textures, sizeof fresh.textures);
    }
    for (int c = 0; c < 3; c++) fresh.emission[c] *= scale;
    for (int c = 0; c < 3; c++) fresh.diffuse[c] *= diffuse;
    if (!a->gltf) tell_images(a, m, name, &fresh);
    if (v->defined && memcmp(v, &fresh, sizeof fresh) != 0) { /* two materials of one name */
        const size_t length = strlen(name);
        snprintf(name + length, sizeof name - length, "-%u", index);
        TRY(imported_faces_add_material(a->s, name, strlen(name), &a->materials[index], error));
        v = &a->s->values[a->materials[index]];
    }
    *v = fresh;
done:
    return status;
}

/* A node's name in the file, or "": the library invents some, such as <STL_BINARY>, or nodes[3] in a glTF. */
static lam_status name_of_node(assimp_state *a, const struct aiNode *node, uint32_t *object,
                               lam_error *error) {
    const char *name = node->mName.data;
    unsigned number;
    int end = 0;
    *object = TABLE_NONE;
    if (name[0] == '\0' || name[0] == '<') return LAM_OK;
    if (a->gltf && sscanf(name, "nodes[%u]%n", &number, &end) == 1 && end > 0 && name[end] == '\0')
        return LAM_OK;
    return imported_faces_add_object(a->s, name, strlen(name), object, error);
}

/* True where a mesh has colours that are not all white. */
static bool has_colours(const struct aiMesh *m) {
    const struct aiColor4D *c = m->mColors[0];
    for (unsigned v = 0; c != NULL && v < m->mNumVertices; v++)
        if (c[v].r != 1 || c[v].g != 1 || c[v].b != 1) return true;
    return false;
}

/* True where the faces of a glTF's mesh get a skin: for images with coordinates, and for colours. */
static bool has_skin(assimp_state *a, const struct aiMesh *m, uint32_t material, bool colours) {
    if (!a->gltf) return false;
    if (material == TABLE_NONE) {
        if (colours) a->colourless += m->mNumFaces;
        return false;
    }
    bool wanted = colours;
    for (int q = 0; q < TEXTURE_QUANTITIES; q++) {
        const imported_texture *t = &a->s->values[material].textures[q];
        if (t->image == 0) continue;
        if (t->coordinates[0] >= AI_MAX_NUMBER_OF_TEXTURECOORDS ||
            m->mTextureCoords[t->coordinates[0]] == NULL)
            return false;
        wanted = true;
    }
    return wanted;
}

/* The corner of a skin at a vertex; the library counts v from below. */
static imported_corner skin_corner(const assimp_state *a, const struct aiMesh *m, uint32_t material,
                                   bool colours, unsigned vertex) {
    imported_corner out = {.colour = {1, 1, 1}};
    for (int q = 0; q < TEXTURE_QUANTITIES; q++) {
        const imported_texture *t = &a->s->values[material].textures[q];
        if (t->image == 0) continue;
        const struct aiVector3D *uv = &m->mTextureCoords[t->coordinates[0]][vertex];
        out.uv[q][0] = uv->x;
        out.uv[q][1] = 1 - (double)uv->y;
    }
    if (colours) {
        const struct aiColor4D *c = &m->mColors[0][vertex];
        out.colour[0] = c->r, out.colour[1] = c->g, out.colour[2] = c->b;
    }
    return out;
}

static lam_status read_mesh(assimp_state *a, const struct aiMesh *m, const affine *t, uint32_t object,
                            lam_error *error) {
    lam_status status = LAM_OK;
    const size_t base = a->s->n_vertices;
    const bool mirrored = is_mirrored(t); /* turns faces inside out, unless they are read backwards */
    if (base + m->mNumVertices >= TABLE_NONE)
        FAIL(error, LAM_ERR_FORMAT, "%s: more than %u vertices", a->path, TABLE_NONE - 1);
    for (unsigned v = 0; v < m->mNumVertices; v++) {
        const double p[3] = {m->mVertices[v].x, m->mVertices[v].y, m->mVertices[v].z};
        double world[3];
        for (int k = 0; k < 3; k++)
            world[k] = t->a[k][0] * p[0] + t->a[k][1] * p[1] + t->a[k][2] * p[2] + t->a[k][3];
        TRY(imported_faces_add_vertex(a->s, world, error));
    }
    const uint32_t material =
        m->mMaterialIndex < a->scene->mNumMaterials ? a->materials[m->mMaterialIndex] : TABLE_NONE;
    const bool colours = a->gltf && has_colours(m), skinned = has_skin(a, m, material, colours);
    for (unsigned f = 0; f < m->mNumFaces; f++) {
        const unsigned n = m->mFaces[f].mNumIndices;
        if (n < 3) continue; /* a point or a line */
        TRY(array_grow(&a->corners, &a->corner_capacity, n, sizeof *a->corners, "face corners", error));
        if (skinned) TRY(array_grow(&a->skin, &a->skin_capacity, n, sizeof *a->skin, "face corners", error));
        for (unsigned k = 0; k < n; k++) {
            const unsigned corner = m->mFaces[f].mIndices[mirrored ? n - 1 - k : k];
            if (corner >= m->mNumVertices)
                FAIL(error, LAM_ERR_FORMAT, "%s: face %u of mesh '%.100s' refers to vertex %u, there are %u",
                     a->path, f, m->mName.data, corner, m->mNumVertices);
            a->corners[k] = (uint32_t)(base + corner);
            if (skinned) a->skin[k] = skin_corner(a, m, material, colours, corner);
        }
        TRY(imported_faces_add_polygon(a->s, a->corners, n, object, material, 0, error));
        if (skinned) TRY(imported_faces_add_skin(a->s, a->skin, error));
    }
done:
    return status;
}

static lam_status read_node(assimp_state *a, const struct aiNode *node, const affine *parent,
                            lam_error *error) {
    lam_status status = LAM_OK;
    const affine own = affine_of(&node->mTransformation), t = affine_product(parent, &own);
    uint32_t object = TABLE_NONE;
    if (node->mNumMeshes > 0) TRY(name_of_node(a, node, &object, error));
    for (unsigned i = 0; i < node->mNumMeshes; i++)
        if (node->mMeshes[i] < a->scene->mNumMeshes)
            TRY(read_mesh(a, a->scene->mMeshes[node->mMeshes[i]], &t, object, error));
    for (unsigned i = 0; i < node->mNumChildren; i++) TRY(read_node(a, node->mChildren[i], &t, error));
done:
    return status;
}

/* A file in memory, as the library reads it: the scene itself, or one that the scene names. */
typedef struct open_file {
    struct aiFile calls;
    const char *bytes;
    char *owned; /* the bytes of a file that the scene names */
    size_t length, at;
} open_file;

/* The files that the library may open. */
typedef struct scene_files {
    const char *path, *assets, *bytes;
    size_t length;
    const gltf_numbers *unpacked, *numbers; /* the files GLTF_UNPACKED and GLTF_NUMBERS */
    char outside[256];                      /* the file refused first, or empty */
} scene_files;

static size_t read_file(struct aiFile *calls, char *out, size_t size, size_t count) {
    open_file *f = (open_file *)calls->UserData;
    if (size == 0) return 0;
    const size_t left = (f->length - f->at) / size, n = count < left ? count : left;
    memcpy(out, f->bytes + f->at, n * size);
    f->at += n * size;
    return n;
}

static size_t write_nothing(struct aiFile *calls, const char *bytes, size_t size, size_t count) {
    (void)calls, (void)bytes, (void)size, (void)count;
    return 0;
}

static size_t tell_file(struct aiFile *calls) {
    return ((const open_file *)calls->UserData)->at;
}

static size_t file_size(struct aiFile *calls) {
    return ((const open_file *)calls->UserData)->length;
}

static aiReturn seek_file(struct aiFile *calls, size_t offset, enum aiOrigin origin) {
    open_file *f = (open_file *)calls->UserData;
    const size_t base = origin == aiOrigin_SET ? 0 : origin == aiOrigin_CUR ? f->at : f->length;
    const size_t to = base + offset; /* an offset back from the end wraps round to it */
    if (to > f->length) return aiReturn_FAILURE;
    f->at = to;
    return aiReturn_SUCCESS;
}

static void flush_nothing(struct aiFile *calls) {
    (void)calls;
}

static void close_file(struct aiFileIO *io, struct aiFile *calls) {
    open_file *f = (open_file *)calls->UserData;
    (void)io;
    free(f->owned);
    free(f);
}

static struct aiFile *open_for_library(struct aiFileIO *io, const char *name, const char *mode) {
    scene_files *files = (scene_files *)io->UserData;
    lam_error ignored = {0};
    char full[ASSET_PATH];
    const char *slash = strrchr(files->path, '/');
    const size_t folder = slash == NULL ? 0 : (size_t)(slash - files->path) + 1;
    if (mode[0] != 'r') return NULL;
    open_file *f = memory_allocate(1, sizeof *f, name, &ignored);
    if (f == NULL) return NULL;
    f->calls = (struct aiFile){.ReadProc = read_file,
                               .WriteProc = write_nothing,
                               .TellProc = tell_file,
                               .FileSizeProc = file_size,
                               .SeekProc = seek_file,
                               .FlushProc = flush_nothing,
                               .UserData = (char *)f};
    f->bytes = files->bytes;
    f->length = files->length;
    if (strcmp(name, files->path) == 0) return &f->calls;
    if (strncmp(name, files->path, folder) == 0) name += folder; /* the library has put it before */
    const gltf_numbers *made = strcmp(name, GLTF_NUMBERS) == 0    ? files->numbers
                               : strcmp(name, GLTF_UNPACKED) == 0 ? files->unpacked
                                                                  : NULL;
    if (made != NULL && made->length > 0) {
        f->bytes = made->bytes;
        f->length = made->length;
        return &f->calls;
    }
    const asset_place place = asset_find(files->path, files->assets, name, full);
    if (place == ASSET_FOUND && file_text(full, &f->owned, &f->length, &ignored) == LAM_OK) {
        f->bytes = f->owned;
        return &f->calls;
    }
    if (place == ASSET_OUTSIDE && files->outside[0] == '\0')
        snprintf(files->outside, sizeof files->outside, "%s", name);
    free(f);
    return NULL;
}

static const struct aiScene *import_scene(scene_files *files) {
    struct aiFileIO io = {.OpenProc = open_for_library, .CloseProc = close_file, .UserData = (char *)files};
    struct aiPropertyStore *properties = aiCreatePropertyStore();
    if (properties == NULL) return NULL;
    aiSetImportPropertyInteger(properties, AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, 1);
    /* No post-processing: it joins, reorders and triangulates. */
    const struct aiScene *scene = aiImportFileExWithProperties(files->path, 0, &io, properties);
    aiReleasePropertyStore(properties);
    return scene;
}

lam_status assimp_read(const char *path, imported_faces *s, lam_error *error) {
    lam_status status = LAM_OK;
    const char *dot = strrchr(path, '.'), *format = s->format != NULL ? s->format
                                                    : dot != NULL     ? dot + 1
                                                                      : "";
    assimp_state a = {.s = s, .path = path};
    char name[ASSET_PATH]; /* which tells the library the format */
    char *bytes = NULL, *padded = NULL, *rewritten = NULL;
    size_t length = 0, padded_length = 0, rewritten_length = 0;
    gltf_numbers unpacked = {.length = 0}, numbers = {.length = 0};
    a.gltf = strcasecmp(format, "gltf") == 0 || strcasecmp(format, "glb") == 0;
    snprintf(name, sizeof name, "%.*s%s%s", ASSET_PATH - 32, path, s->format != NULL ? "." : "",
             s->format != NULL ? s->format : "");
    TRY(file_text(s->source != NULL ? s->source : path, &bytes, &length, error));
    if (a.gltf) TRY(glb_padded(bytes, length, &padded, &padded_length, error));
    if (a.gltf)
        TRY(gltf_read_materials(path, bytes, length, s, &a.gltf_materials, &a.n_gltf_materials, error));
    if (a.gltf) TRY(gltf_read_lights(path, bytes, length, s, error));
    TRY(ply_check_head(path, bytes, length, error));
    if (strcasecmp(format, "stl") == 0) TRY(stl_normalised(bytes, length, &padded, &padded_length, error));
    scene_files files = {.path = name,
                         .assets = s->assets,
                         .unpacked = &unpacked,
                         .numbers = &numbers,
                         .bytes = padded != NULL ? padded : bytes,
                         .length = padded_length > 0 ? padded_length : length};
    if (a.gltf)
        TRY(gltf_rewrite(path, files.bytes, files.length, s, &rewritten, &rewritten_length, &unpacked,
                         &numbers, error));
    if (rewritten != NULL) files.bytes = rewritten, files.length = rewritten_length;
    a.scene = import_scene(&files);
    if (files.outside[0] != '\0')
        FAIL(error, LAM_ERR_FORMAT,
             "%s: it names the file '%s', which lies outside the scene's folder; --assets with its folder "
             "lets it "
             "be read",
             path, files.outside);
    if (a.scene == NULL)
        FAIL(error, LAM_ERR_FORMAT,
             "%s: not a scene that can be read (OBJ, glTF, GLB, PLY, STL, OFF): %.300s", path,
             aiGetErrorString());
    a.materials = memory_allocate(a.scene->mNumMaterials, sizeof *a.materials, "materials", error);
    if (a.materials == NULL) TRY(LAM_ERR_MEMORY);
    for (unsigned i = 0; i < a.scene->mNumMaterials; i++) TRY(read_material(&a, i, error));
    const affine unit = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
    if (a.scene->mRootNode != NULL) TRY(read_node(&a, a.scene->mRootNode, &unit, error));
    if (a.gltf) TRY(gltf_read_cameras(path, bytes, length, s, error));
    if (a.colourless > 0)
        import_warn(&s->warnings, "%s: the colours of %zu faces without a material are left out", path,
                    a.colourless);
done:
    if (a.scene != NULL) aiReleaseImport(a.scene);
    free(a.materials);
    free(a.corners);
    free(a.skin);
    gltf_materials_free(a.n_gltf_materials, a.gltf_materials);
    free(bytes);
    free(padded);
    free(rewritten);
    free(unpacked.bytes);
    free(numbers.bytes);
    return status;
}
