#include "solver/codec/gltf/gltf_surface.h"

#include "solver/codec/json_writer.h"

#include <math.h>

static bool say_numbers(buffer *b, const char *name, size_t count, const double *values) {
    return buffer_append_text(b, name) && json_write_doubles(b, values, count);
}

/* The luminance, which is emission / pi of a diffuse surface, is emissiveFactor, whose largest component is
 * 1, times emissiveStrength. */
static bool say_emission(const double emission[3], buffer *b) {
    const double most = fmax(emission[0], fmax(emission[1], emission[2]));
    if (!(most > 0)) return true;
    const double factor[3] = {emission[0] / most, emission[1] / most, emission[2] / most};
    return say_numbers(b, ",\"emissiveFactor\":", 3, factor) &&
           buffer_append_text(
               b, ",\"extensions\":{\"KHR_materials_emissive_strength\":{\"emissiveStrength\":") &&
           json_write_double(b, most / M_PI) && buffer_append_text(b, "}}");
}

bool gltf_say_surface(const gltf_surface *s, buffer *b) {
    const double alpha = 1 - s->passes;
    const bool is_pane = s->passes > 0;
    double colour[4] = {1, 1, 1, alpha};
    for (int c = 0; c < 3 && !s->lit; c++)
        colour[c] = s->image >= 0 ? s->factor[c] : alpha > 0 ? fmin(s->reflectance[c] / alpha, 1) : 0;
    if (is_pane && !buffer_append_text(b, ",\"alphaMode\":\"BLEND\"")) return false;
    if (s->lit)
        return (!is_pane || (say_numbers(b, ",\"pbrMetallicRoughness\":{\"baseColorFactor\":", 4, colour) &&
                             buffer_append_text(b, "}"))) &&
               buffer_append_text(b, ",\"extensions\":{\"KHR_materials_unlit\":{}}");
    return say_numbers(b, ",\"pbrMetallicRoughness\":{\"baseColorFactor\":", 4, colour) &&
           (s->image < 0 || buffer_printf(b, ",\"baseColorTexture\":{\"index\":%ld}", s->image)) &&
           buffer_append_text(b, ",\"metallicFactor\":0,\"roughnessFactor\":1},\"doubleSided\":false") &&
           say_emission(s->emission, b);
}
