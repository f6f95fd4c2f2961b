#include "solver/codec/gltf/gltf_surface.h"

#include "solver/codec/json_writer.h"

#include <math.h>

static bool say_numbers(buffer *b, const char *name, size_t count, const double *values) {
    return buffer_append_text(b, name) && json_write_doubles(b, values, count);
}

static double most_of(const double emission[3]) {
    return fmax(emission[0], fmax(emission[1], emission[2]));
}

/* The luminance, which is emission / pi of a diffuse surface, is emissiveFactor, whose largest component is
 * 1, times emissiveStrength. */
static bool say_emission(const double emission[3], buffer *b) {
    const double most = most_of(emission);
    if (!(most > 0)) return true;
    const double factor[3] = {emission[0] / most, emission[1] / most, emission[2] / most};
    return say_numbers(b, ",\"emissiveFactor\":", 3, factor);
}

/* The strength of the emission, and the light on the surface. */
static bool say_extensions(const gltf_surface *s, buffer *b) {
    const double most = most_of(s->emission);
    const bool maps = s->lightmap != NULL;
    if (!(most > 0) && !maps) return true;
    bool good = buffer_append_text(b, ",\"extensions\":{");
    if (most > 0)
        good = good && buffer_append_text(b, "\"KHR_materials_emissive_strength\":{\"emissiveStrength\":") &&
               json_write_double(b, most / M_PI) && buffer_append_text(b, maps ? "}," : "}");
    if (maps)
        good = good &&
               buffer_printf(
                   b, "\"MOZ_lightmap\":{\"index\":%u,\"texCoord\":1,\"intensity\":", s->lightmap_texture) &&
               json_write_double(b, s->lightmap->intensity) && buffer_append_text(b, "}");
    return good && buffer_append_text(b, "}");
}

/* A black surface that shows the light of a map, by TEXCOORD_0, which is all that some programs know. */
static bool say_shining(const gltf_surface *s, buffer *b) {
    const double black[4] = {0, 0, 0, 1 - s->passes};
    return say_numbers(b, ",\"pbrMetallicRoughness\":{\"baseColorFactor\":", 4, black) &&
           buffer_printf(b,
                         ",\"metallicFactor\":0,\"roughnessFactor\":1},\"doubleSided\":false,"
                         "\"emissiveFactor\":[1,1,1],\"emissiveTexture\":{\"index\":%u}",
                         s->lightmap_texture);
}

bool gltf_say_surface(const gltf_surface *s, buffer *b) {
    const double alpha = 1 - s->passes;
    const bool is_pane = s->passes > 0;
    double colour[4] = {1, 1, 1, alpha};
    for (int c = 0; c < 3 && !s->lit; c++)
        colour[c] = s->image >= 0 ? s->factor[c] : alpha > 0 ? fmin(s->reflectance[c] / alpha, 1) : 0;
    if (is_pane && !buffer_append_text(b, ",\"alphaMode\":\"BLEND\"")) return false;
    if (s->lightmap != NULL && s->lightmap->emissive) return say_shining(s, b);
    if (s->lit)
        return (!is_pane || (say_numbers(b, ",\"pbrMetallicRoughness\":{\"baseColorFactor\":", 4, colour) &&
                             buffer_append_text(b, "}"))) &&
               buffer_append_text(b, ",\"extensions\":{\"KHR_materials_unlit\":{}}");
    return say_numbers(b, ",\"pbrMetallicRoughness\":{\"baseColorFactor\":", 4, colour) &&
           (s->image < 0 || buffer_printf(b, ",\"baseColorTexture\":{\"index\":%ld}", s->image)) &&
           buffer_append_text(b, ",\"metallicFactor\":0,\"roughnessFactor\":1},\"doubleSided\":false") &&
           say_emission(s->emission, b) && say_extensions(s, b);
}

bool gltf_say_extensions(bool lit, bool emits, const gltf_lightmap *lightmap, buffer *b) {
    const char *used[3];
    size_t n = 0;
    const bool shining = lightmap != NULL && lightmap->emissive;
    if (lit) used[n++] = "KHR_materials_unlit";
    if (!lit && !shining && emits) used[n++] = "KHR_materials_emissive_strength";
    if (lightmap != NULL && !shining) used[n++] = "MOZ_lightmap";
    if (n == 0) return true;
    bool good = buffer_append_text(b, ",\"extensionsUsed\":[");
    for (size_t k = 0; k < n; k++) good = good && buffer_printf(b, "%s\"%s\"", k > 0 ? "," : "", used[k]);
    return good && buffer_append_text(b, "]");
}

bool gltf_say_lightmap(const gltf_lightmap *l, buffer *b) {
    return buffer_printf(b, ",\"lightmap\":{\"quantity\":\"%s\",\"encoding\":\"%s\",\"unit\":",
                         l->emissive ? "radiosity" : "irradiance", l->emissive ? "sRGB" : "linear") &&
           json_write_text(b, l->unit) && buffer_append_text(b, ",\"white\":") &&
           json_write_double(b, l->white) && buffer_append_text(b, "}");
}
