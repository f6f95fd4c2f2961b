#include "solver/base/scene/punctual_lights.h"

#include "solver/base/utf8.h"
#include "solver/base/vector3.h"

#include <string.h>

const char *punctual_kind_name(punctual_kind kind) {
    static const char *const names[PUNCTUAL_KINDS] = {"point", "spot", "directional"};
    return names[kind];
}

static bool is_blank(char c) {
    return c == ' ' || (c >= '\t' && c <= '\r');
}

void punctual_name(const char *text, size_t room, char *out) {
    size_t n = 0;
    while (is_blank(*text)) text++;
    for (const char *end = text + strlen(text); text < end;) {
        const size_t sequence = utf8_sequence(text, end), length = sequence > 0 ? sequence : 1;
        const bool kept = sequence > 0 && *text != '=' && *text != ',' && !utf8_is_unfit(text, sequence);
        if (n + (kept ? length : 1) >= room) break;
        if (kept)
            memcpy(out + n, text, length);
        else
            out[n] = '_';
        n += kept ? length : 1;
        text += length;
    }
    while (n > 0 && is_blank(out[n - 1])) n--;
    out[n] = '\0';
}

static bool name_is_sound(const char name[PUNCTUAL_NAME]) {
    char made[PUNCTUAL_NAME];
    if (name[0] == '\0' || memchr(name, '\0', PUNCTUAL_NAME) == NULL) return false;
    punctual_name(name, sizeof made, made);
    return strcmp(name, made) == 0;
}

/* Divides by the largest component first, so that no square overflows or vanishes. */
static bool make_unit(double v[3]) {
    const double most = fmax(fmax(fabs(v[0]), fabs(v[1])), fabs(v[2]));
    for (int d = 0; d < 3; d++)
        if (!isfinite(v[d])) return false;
    if (!(most > 0)) return false;
    for (int d = 0; d < 3; d++) v[d] /= most;
    const double length = sqrt(dot3(v, v));
    for (int d = 0; d < 3; d++) v[d] /= length;
    return true;
}

bool punctual_light_settle(punctual_light *l) {
    punctual_light made = *l;
    const bool is_spot = made.kind == PUNCTUAL_SPOT;
    if ((unsigned)made.kind >= PUNCTUAL_KINDS || made.has_range > 1 || !name_is_sound(made.name))
        return false;
    if (!(made.intensity >= 0 && made.intensity <= PUNCTUAL_INTENSITY_MOST)) return false;
    for (int d = 0; d < 3; d++)
        if (!(fabs(made.at[d]) < 1e30) || !(made.colour[d] >= 0 && made.colour[d] <= PUNCTUAL_COLOUR_MOST))
            return false;
    if (is_spot && !(made.inner >= 0 && made.inner <= made.outer && made.outer >= PUNCTUAL_OUTER_LEAST &&
                     made.outer <= PUNCTUAL_OUTER_MOST))
        return false;
    if (!make_unit(made.direction)) {
        if (made.kind != PUNCTUAL_POINT) return false;
        memcpy(made.direction, (const double[3]){0, 0, -1}, sizeof made.direction);
    }
    *l = made;
    return true;
}
