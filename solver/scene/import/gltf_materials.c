/* Materials of a glTF with their images. Runs in the child. */
#include "solver/base/photometry.h"
#include "solver/scene/import/gltf_file.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* True for extensions without which positions, faces and plain colours are read right. */
static bool is_readable(const char *extension) {
    static const char *const beginnings[] = {"KHR_materials_",
                                             "KHR_texture_",
                                             "EXT_texture_",
                                             "MSFT_texture_",
                                             "KHR_lights_",
                                             "KHR_xmp",
                                             "KHR_draco_mesh_compression",
                                             "KHR_mesh_quantization",
                                             GLTF_INSTANCES};
    if (strcmp(extension, GLTF_MESHOPT) == 0) return gltf_reads_meshopt();
    for (size_t i = 0; i < sizeof beginnings / sizeof *beginnings; i++)
        if (strncmp(extension, beginnings[i], strlen(beginnings[i])) == 0) return true;
    return false;
}

/* Reads an image of the file: from a URI, or from a view of a buffer. */
static lam_status read_image(gltf_file *g, const json_t *source, uint32_t *out, lam_error *error) {
    lam_status status = LAM_OK;
    const json_t *image = gltf_entry(g, "images", source);
    const char *uri = json_string_value(json_object_get(image, "uri"));
    const char *name = json_string_value(json_object_get(image, "name"));
    char key[32], label[256], file[ASSET_PATH], *owned = NULL;
    lam_error ignored;
    snprintf(key, sizeof key, "*%lld", image == NULL ? -1 : (long long)json_integer_value(source));
    snprintf(label, sizeof label, "%.200s", name != NULL ? name : key + 1);
    if (uri != NULL && strncmp(uri, "data:", 5) == 0) {
        size_t length = 0;
        owned = gltf_data_of_uri(uri, &length, &ignored);
        TRY(owned == NULL
                ? imported_faces_lack_image(g->s, g->path, key, label, "its data URI is not base64", error)
                : imported_faces_add_image(g->s, g->path, key, label, owned, length, out, error));
    } else if (uri != NULL) {
        gltf_decode_uri(uri, file);
        TRY(imported_faces_find_image(g->s, g->path, file, out, error));
    } else {
        const json_t *view = gltf_entry(g, "bufferViews", json_object_get(image, "bufferView"));
        const gltf_buffer b = gltf_read_buffer(g, json_object_get(view, "buffer"), &ignored);
        const double from = gltf_number(json_object_get(view, "byteOffset"), 0);
        const double length = gltf_number(json_object_get(view, "byteLength"), -1);
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
    const double value = gltf_number(json_object_get(sampler, name), 10497);
    return value == 33071 ? TEXTURE_CLAMP : value == 33648 ? TEXTURE_MIRROR : TEXTURE_REPEAT;
}

/* KHR_texture_transform: scaled, then turned counter-clockwise where v runs downwards, then moved. */
static void read_transform(const json_t *info, imported_texture *t) {
    const json_t *given = gltf_extension(info, "KHR_texture_transform");
    const json_t *offset = json_object_get(given, "offset"), *scale = json_object_get(given, "scale");
    const double angle = gltf_number(json_object_get(given, "rotation"), 0), c = cos(angle), s = sin(angle);
    const double x = gltf_number(json_array_get(scale, 0), 1), y = gltf_number(json_array_get(scale, 1), 1);
    const double rows[2][3] = {{c * x, s * y, gltf_number(json_array_get(offset, 0), 0)},
                               {-s * x, c * y, gltf_number(json_array_get(offset, 1), 0)}};
    memcpy(t->transform, rows, sizeof rows);
    const json_t *set = json_object_get(given, "texCoord");
    if (!json_is_integer(set)) set = json_object_get(info, "texCoord");
    t->coordinates[0] = (uint32_t)json_integer_value(set);
}

/* Reads the image that a textureInfo names; nothing where info is NULL. */
static lam_status read_texture(gltf_file *g, const json_t *info, imported_texture *out, lam_error *error) {
    lam_status status = LAM_OK;
    const json_t *texture = gltf_entry(g, "textures", json_object_get(info, "index"));
    const json_t *sampler = gltf_entry(g, "samplers", json_object_get(texture, "sampler"));
    const json_t *source = json_object_get(texture, "source");
    if (info == NULL) return LAM_OK;
    *out = (imported_texture){.named = 1, .wrap = {wrap_of(sampler, "wrapS"), wrap_of(sampler, "wrapT")}};
    read_transform(info, out);
    if (source == NULL) source = json_object_get(gltf_extension(texture, "EXT_texture_webp"), "source");
    if (source == NULL) source = json_object_get(gltf_extension(texture, "KHR_texture_basisu"), "source");
    TRY(read_image(g, source, &out->image, error));
done:
    return status;
}

static double gltf_share(const json_t *value, double otherwise) {
    return fmin(fmax(gltf_number(value, otherwise), 0), 1);
}

/* The part of light that passes: of a material that is blended, 1 - alpha; and of the rest what is
 * transmitted, coloured by the base colour, of which this is the luminance. */
static void read_transmittance(const json_t *m, gltf_material *out) {
    const json_t *colour = json_object_get(json_object_get(m, "pbrMetallicRoughness"), "baseColorFactor");
    const json_t *clear = gltf_extension(m, "KHR_materials_transmission");
    const char *mode = json_string_value(json_object_get(m, "alphaMode"));
    const bool blended = mode != NULL && strcmp(mode, "BLEND") == 0;
    const double factor = gltf_share(json_object_get(clear, "transmissionFactor"), 0);
    const double alpha = blended ? gltf_share(json_array_get(colour, 3), 1) : 1;
    const double luminance =
        luminance_of(gltf_share(json_array_get(colour, 0), 1), gltf_share(json_array_get(colour, 1), 1),
                     gltf_share(json_array_get(colour, 2), 1));
    out->diffuse = alpha * (1 - factor);
    out->transmittance = fmin(1 - alpha + alpha * factor * luminance, 1);
}

static lam_status read_material(gltf_file *g, const json_t *m, gltf_material *out, lam_error *error) {
    lam_status status = LAM_OK;
    const json_t *base = json_object_get(json_object_get(m, "pbrMetallicRoughness"), "baseColorTexture");
    const json_t *glossy = gltf_extension(m, "KHR_materials_pbrSpecularGlossiness");
    const json_t *strong = gltf_extension(m, "KHR_materials_emissive_strength");
    if (json_object_get(glossy, "diffuseTexture") != NULL) base = json_object_get(glossy, "diffuseTexture");
    const char *name = json_string_value(json_object_get(m, "name"));
    if (name != NULL && name[0] != '\0' && (out->name = strdup(name)) == NULL)
        FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory for its materials", g->path);
    out->two_sided = json_is_true(json_object_get(m, "doubleSided"));
    out->strength = gltf_number(json_object_get(strong, "emissiveStrength"), 1);
    read_transmittance(m, out);
    TRY(read_texture(g, base, &out->textures[TEXTURE_REFLECTANCE], error));
    TRY(read_texture(g, json_object_get(m, "emissiveTexture"), &out->textures[TEXTURE_EMISSION], error));
done:
    return status;
}

void gltf_materials_free(size_t n, gltf_material *materials) {
    for (size_t i = 0; materials != NULL && i < n; i++) free(materials[i].name);
    free(materials);
}

lam_status gltf_read_materials(const char *path, const char *bytes, size_t length, imported_faces *s,
                               gltf_material **out, size_t *n, lam_error *error) {
    lam_status status = LAM_OK;
    gltf_file g = {.path = path, .s = s};
    gltf_material *made = NULL;
    size_t n_made = 0;
    json_t *name;
    size_t i;
    gltf_parse(&g, bytes, length);
    json_array_foreach(json_object_get(g.root, "extensionsRequired"), i, name) {
        const char *extension = json_string_value(name);
        if (extension != NULL && !is_readable(extension))
            FAIL(error, LAM_ERR_FORMAT,
                 "%s: it requires the extension '%.60s', which is not read%s; export it without", path,
                 extension,
                 strcmp(extension, GLTF_MESHOPT) == 0 ? " by a build without libmeshoptimizer" : "");
    }
    const json_t *materials = json_object_get(g.root, "materials");
    const size_t n_materials = json_array_size(materials);
    TRY(gltf_hold_buffers(&g, error));
    made = memory_allocate(n_materials, sizeof *made, "materials", error);
    if (made == NULL) TRY(LAM_ERR_MEMORY);
    n_made = n_materials;
    for (i = 0; i < n_materials; i++) TRY(read_material(&g, json_array_get(materials, i), &made[i], error));
    *out = made;
    *n = n_materials;
    made = NULL;
done:
    gltf_close(&g);
    gltf_materials_free(n_made, made);
    return status;
}
