/* Materials of a glTF with their images: the only file that knows the format's JSON. Runs in the child. */
#include "solver/base/file_text.h"
#include "solver/scene/import/imported_faces.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct gltf_buffer {
    const char *bytes;
    char *owned;
    size_t length;
} gltf_buffer;

typedef struct gltf_file {
    const char *path;
    imported_faces *s;
    json_t *root;
    const char *chunk; /* the binary one of a GLB, or NULL */
    size_t chunk_length, n_buffers;
    gltf_buffer *buffers; /* those read so far */
} gltf_file;

/* True for extensions without which positions, faces and plain colours are read right. */
static bool is_readable(const char *extension) {
    static const char *const beginnings[] = {"KHR_materials_",
                                             "KHR_texture_",
                                             "EXT_texture_",
                                             "MSFT_texture_",
                                             "KHR_lights_",
                                             "KHR_xmp",
                                             "KHR_draco_mesh_compression"};
    for (size_t i = 0; i < sizeof beginnings / sizeof *beginnings; i++)
        if (strncmp(extension, beginnings[i], strlen(beginnings[i])) == 0) return true;
    return false;
}

/* Extensions that are read, or have a line of their own where they matter. */
static bool is_read(const char *extension) {
    static const char *const names[] = {"KHR_texture_transform",
                                        "KHR_materials_emissive_strength",
                                        "KHR_materials_pbrSpecularGlossiness",
                                        "KHR_draco_mesh_compression",
                                        "KHR_lights_punctual",
                                        "KHR_texture_basisu",
                                        "EXT_texture_webp"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (strcmp(extension, names[i]) == 0) return true;
    return strncmp(extension, "KHR_xmp", 7) == 0;
}

static uint32_t little_endian(const char *bytes) {
    const unsigned char *b = (const unsigned char *)bytes;
    return b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
}

/* Parses the JSON and finds the binary chunk; root is NULL where the file is broken. */
static void parse_file(gltf_file *g, const char *bytes, size_t length) {
    if (length >= 20 && memcmp(bytes, "glTF", 4) == 0) { /* a GLB, whose first chunk is the JSON */
        const size_t size = little_endian(bytes + 12);
        if (memcmp(bytes + 16, "JSON", 4) != 0 || size > length - 20) return;
        const char *next = bytes + 20 + size;
        const size_t left = length - 20 - size;
        if (left >= 8 && memcmp(next + 4, "BIN", 4) == 0) {
            g->chunk = next + 8;
            g->chunk_length = little_endian(next) < left - 8 ? little_endian(next) : left - 8;
        }
        bytes += 20;
        length = size;
    }
    g->root = json_loadb(bytes, length, 0, NULL);
}

static const json_t *entry_of(const gltf_file *g, const char *array, const json_t *index) {
    if (!json_is_integer(index) || json_integer_value(index) < 0) return NULL;
    return json_array_get(json_object_get(g->root, array), (size_t)json_integer_value(index));
}

static const json_t *extension_of(const json_t *owner, const char *name) {
    return json_object_get(json_object_get(owner, "extensions"), name);
}

static double number_of(const json_t *value, double otherwise) {
    return json_is_number(value) ? json_number_value(value) : otherwise;
}

static int base64_digit(char c) {
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const char *at = c == '\0' ? NULL : strchr(digits, c);
    return at == NULL ? -1 : (int)(at - digits);
}

/* The bytes of a data URI, freed by the caller; NULL where it has none in base64. */
static char *data_of_uri(const char *uri, size_t *length, lam_error *error) {
    const char *comma = strchr(uri, ',');
    uint32_t bits = 0;
    int n_bits = 0;
    *length = 0;
    if (comma == NULL || comma - uri < 7 || strncmp(comma - 7, ";base64", 7) != 0) return NULL;
    char *out = memory_allocate(strlen(comma) / 4 + 1, 3, "data URI", error);
    for (const char *c = comma + 1; out != NULL && *c != '\0' && *c != '='; c++) {
        const int digit = base64_digit(*c);
        if (digit < 0) {
            free(out);
            return NULL;
        }
        bits = bits << 6 | (uint32_t)digit;
        n_bits += 6;
        if (n_bits < 8) continue;
        n_bits -= 8;
        out[(*length)++] = (char)(bits >> n_bits & 255);
    }
    return out;
}

/* Undoes %20 and the like; longer names are cut, and not found then. */
static void decode_uri(const char *uri, char out[ASSET_PATH]) {
    size_t n = 0;
    for (const char *c = uri; *c != '\0' && n + 1 < ASSET_PATH; c++) {
        unsigned code;
        if (c[0] == '%' && sscanf(c + 1, "%2x", &code) == 1 && code != 0 && c[1] != '\0' && c[2] != '\0') {
            out[n++] = (char)code;
            c += 2;
        } else
            out[n++] = *c;
    }
    out[n] = '\0';
}

/* The bytes of a buffer, read once; bytes is NULL where there are none. */
static gltf_buffer read_buffer(gltf_file *g, const json_t *index, lam_error *error) {
    const json_t *buffer = entry_of(g, "buffers", index);
    char name[ASSET_PATH], full[ASSET_PATH];
    if (buffer == NULL) return (gltf_buffer){.bytes = NULL};
    gltf_buffer *b = &g->buffers[json_integer_value(index)];
    const char *uri = json_string_value(json_object_get(buffer, "uri"));
    if (b->bytes != NULL) return *b;
    if (uri == NULL) {
        *b = (gltf_buffer){.bytes = g->chunk, .length = g->chunk_length};
    } else if (strncmp(uri, "data:", 5) == 0) {
        b->owned = data_of_uri(uri, &b->length, error);
    } else {
        decode_uri(uri, name);
        if (asset_find(g->path, g->s->assets, name, full) == ASSET_FOUND &&
            file_text(full, &b->owned, &b->length, error) != LAM_OK)
            b->owned = NULL;
    }
    if (uri != NULL) b->bytes = b->owned;
    return *b;
}

/* Reads an image of the file: from a URI, or from a view of a buffer. */
static lam_status read_image(gltf_file *g, const json_t *source, uint32_t *out, lam_error *error) {
    lam_status status = LAM_OK;
    const json_t *image = entry_of(g, "images", source);
    const char *uri = json_string_value(json_object_get(image, "uri"));
    const char *name = json_string_value(json_object_get(image, "name"));
    char key[32], label[256], file[ASSET_PATH], *owned = NULL;
    lam_error ignored;
    snprintf(key, sizeof key, "*%lld", image == NULL ? -1 : (long long)json_integer_value(source));
    snprintf(label, sizeof label, "%.200s", name != NULL ? name : key + 1);
    if (uri != NULL && strncmp(uri, "data:", 5) == 0) {
        size_t length = 0;
        owned = data_of_uri(uri, &length, &ignored);
        TRY(owned == NULL
                ? imported_faces_lack_image(g->s, g->path, key, label, "its data URI is not base64", error)
                : imported_faces_add_image(g->s, g->path, key, label, owned, length, out, error));
    } else if (uri != NULL) {
        decode_uri(uri, file);
        TRY(imported_faces_find_image(g->s, g->path, file, out, error));
    } else {
        const json_t *view = entry_of(g, "bufferViews", json_object_get(image, "bufferView"));
        const gltf_buffer b = read_buffer(g, json_object_get(view, "buffer"), &ignored);
        const double from = number_of(json_object_get(view, "byteOffset"), 0);
        const double length = number_of(json_object_get(view, "byteLength"), -1);
        const bool inside = b.bytes != NULL && from >= 0 && length >= 0 && from + length <= (double)b.length;
        TRY(inside ? imported_faces_add_image(g->s, g->path, key, label, b.bytes + (size_t)from,
                                              (size_t)length, out, error)
                   : imported_faces_lack_image(g->s, g->path, key, label,
                                               "the file has no bytes for it where it says", error));
    }
done:
    free(owned);
    return status;
}

static uint32_t wrap_of(const json_t *sampler, const char *name) {
    const double value = number_of(json_object_get(sampler, name), 10497);
    return value == 33071 ? TEXTURE_CLAMP : value == 33648 ? TEXTURE_MIRROR : TEXTURE_REPEAT;
}

/* KHR_texture_transform: scaled, then turned counter-clockwise where v runs downwards, then moved. */
static void read_transform(const json_t *info, imported_texture *t) {
    const json_t *given = extension_of(info, "KHR_texture_transform");
    const json_t *offset = json_object_get(given, "offset"), *scale = json_object_get(given, "scale");
    const double angle = number_of(json_object_get(given, "rotation"), 0), c = cos(angle), s = sin(angle);
    const double x = number_of(json_array_get(scale, 0), 1), y = number_of(json_array_get(scale, 1), 1);
    const double rows[2][3] = {{c * x, s * y, number_of(json_array_get(offset, 0), 0)},
                               {-s * x, c * y, number_of(json_array_get(offset, 1), 0)}};
    memcpy(t->transform, rows, sizeof rows);
    const json_t *set = json_object_get(given, "texCoord");
    if (!json_is_integer(set)) set = json_object_get(info, "texCoord");
    t->coordinates[0] = (uint32_t)json_integer_value(set);
}

/* Reads the image that a textureInfo names; nothing where info is NULL. */
static lam_status read_texture(gltf_file *g, const json_t *info, imported_texture *out, lam_error *error) {
    lam_status status = LAM_OK;
    const json_t *texture = entry_of(g, "textures", json_object_get(info, "index"));
    const json_t *sampler = entry_of(g, "samplers", json_object_get(texture, "sampler"));
    const json_t *source = json_object_get(texture, "source");
    if (info == NULL) return LAM_OK;
    *out = (imported_texture){.named = 1, .wrap = {wrap_of(sampler, "wrapS"), wrap_of(sampler, "wrapT")}};
    read_transform(info, out);
    if (source == NULL) source = json_object_get(extension_of(texture, "EXT_texture_webp"), "source");
    if (source == NULL) source = json_object_get(extension_of(texture, "KHR_texture_basisu"), "source");
    TRY(read_image(g, source, &out->image, error));
done:
    return status;
}

static lam_status read_material(gltf_file *g, const json_t *m, gltf_material *out, lam_error *error) {
    lam_status status = LAM_OK;
    const json_t *base = json_object_get(json_object_get(m, "pbrMetallicRoughness"), "baseColorTexture");
    const json_t *glossy = extension_of(m, "KHR_materials_pbrSpecularGlossiness");
    const json_t *strong = extension_of(m, "KHR_materials_emissive_strength");
    if (json_object_get(glossy, "diffuseTexture") != NULL) base = json_object_get(glossy, "diffuseTexture");
    out->strength = number_of(json_object_get(strong, "emissiveStrength"), 1);
    TRY(read_texture(g, base, &out->textures[TEXTURE_REFLECTANCE], error));
    TRY(read_texture(g, json_object_get(m, "emissiveTexture"), &out->textures[TEXTURE_EMISSION], error));
done:
    return status;
}

/* Leaves out the images of materials whose coordinates are integers somewhere: the library takes their bytes
 * for floating point numbers. */
static void leave_out_integers(const gltf_file *g, size_t n, gltf_material *materials) {
    size_t i, k, found = 0;
    json_t *m, *primitive;
    json_array_foreach(json_object_get(g->root, "meshes"), i, m)
        json_array_foreach(json_object_get(m, "primitives"), k, primitive) {
        const json_t *index = json_object_get(primitive, "material");
        if (!json_is_integer(index) || json_integer_value(index) < 0 ||
            (size_t)json_integer_value(index) >= n)
            continue;
        gltf_material *of = &materials[json_integer_value(index)];
        for (int q = 0; q < TEXTURE_QUANTITIES; q++) {
            char name[32];
            snprintf(name, sizeof name, "TEXCOORD_%u", of->textures[q].coordinates[0]);
            const json_t *at = json_object_get(json_object_get(primitive, "attributes"), name);
            const json_t *accessor = entry_of(g, "accessors", at);
            const double type = number_of(json_object_get(accessor, "componentType"), 5126);
            if (of->textures[q].image == 0 || type == 5126) continue;
            of->textures[q].image = 0;
            found++;
        }
    }
    if (found > 0)
        import_warn(
            &g->s->warnings,
            "%s: %zu images have texture coordinates that are not floating point and are not read; plain "
            "colours take their place",
            g->path, found);
}

/* One line for each kind of thing that is left out. */
static void tell_left_out(const gltf_file *g) {
    import_warnings *w = &g->s->warnings;
    const json_t *lights = json_object_get(extension_of(g->root, "KHR_lights_punctual"), "lights");
    size_t i, bumps = 0, alphas = 0, metals = 0, written = 0;
    json_t *m, *name;
    char list[512] = "";
    json_array_foreach(json_object_get(g->root, "materials"), i, m) {
        const json_t *pbr = json_object_get(m, "pbrMetallicRoughness");
        const char *mode = json_string_value(json_object_get(m, "alphaMode"));
        bumps +=
            json_object_get(m, "normalTexture") != NULL || json_object_get(m, "occlusionTexture") != NULL;
        alphas += mode != NULL && strcmp(mode, "OPAQUE") != 0;
        metals += number_of(json_object_get(pbr, "metallicFactor"), 0) > 0 ||
                  json_object_get(pbr, "metallicRoughnessTexture") != NULL;
    }
    if (json_array_size(lights) > 0)
        import_warn(w, "%s: its %zu lights (KHR_lights_punctual) are not supported; only faces emit", g->path,
                    json_array_size(lights));
    if (alphas > 0)
        import_warn(w, "%s: the alpha of %zu materials (MASK, BLEND) is left out; they are opaque", g->path,
                    alphas);
    if (bumps > 0)
        import_warn(w, "%s: normal and occlusion maps of %zu materials are left out", g->path, bumps);
    if (metals > 0)
        import_warn(w,
                    "%s: %zu materials are metallic or may be; they are diffuse here, of their base colour",
                    g->path, metals);
    json_array_foreach(json_object_get(g->root, "extensionsUsed"), i, name) {
        const char *extension = json_string_value(name);
        if (extension == NULL || is_read(extension) || written + 64 > sizeof list) continue;
        written += (size_t)snprintf(list + written, sizeof list - written, "%s%.60s", written > 0 ? ", " : "",
                                    extension);
    }
    if (written > 0) import_warn(w, "%s: these extensions are left out: %s", g->path, list);
}

lam_status gltf_read_materials(const char *path, const char *bytes, size_t length, imported_faces *s,
                               gltf_material **out, size_t *n, lam_error *error) {
    lam_status status = LAM_OK;
    gltf_file g = {.path = path, .s = s};
    gltf_material *made = NULL;
    json_t *name;
    size_t i;
    parse_file(&g, bytes, length);
    json_array_foreach(json_object_get(g.root, "extensionsRequired"), i, name) {
        const char *extension = json_string_value(name);
        if (extension != NULL && !is_readable(extension))
            FAIL(error, LAM_ERR_FORMAT,
                 "%s: it requires the extension '%.60s', which is not read; export it without", path,
                 extension);
    }
    const json_t *materials = json_object_get(g.root, "materials");
    const size_t n_materials = json_array_size(materials);
    g.n_buffers = json_array_size(json_object_get(g.root, "buffers"));
    g.buffers = memory_allocate(g.n_buffers, sizeof *g.buffers, "buffers", error);
    made = memory_allocate(n_materials, sizeof *made, "materials", error);
    if (g.buffers == NULL || made == NULL) TRY(LAM_ERR_MEMORY);
    for (i = 0; i < n_materials; i++) TRY(read_material(&g, json_array_get(materials, i), &made[i], error));
    leave_out_integers(&g, n_materials, made);
    tell_left_out(&g);
    *out = made;
    *n = n_materials;
    made = NULL;
done:
    for (i = 0; g.buffers != NULL && i < g.n_buffers; i++) free(g.buffers[i].owned);
    free(g.buffers);
    free(made);
    json_decref(g.root);
    return status;
}
