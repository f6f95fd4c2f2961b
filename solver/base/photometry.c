#include "solver/base/photometry.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

double luminance_of(double red, double green, double blue) {
    return LUMINANCE_RED * red + LUMINANCE_GREEN * green + LUMINANCE_BLUE * blue;
}

double luminance_of_radiance(double red, double green, double blue) {
    return .265 * red + .670 * green + .065 * blue;
}

static const char *const kinds[] = {[LIGHT_RADIOMETRIC] = "W", [LIGHT_PHOTOMETRIC] = "lm"};

const char *light_kind_word(light_kind kind) {
    return kinds[kind];
}

bool light_kind_find(const char *word, light_kind *out) {
    for (int k = 0; k < 2; k++)
        if (strcmp(word, kinds[k]) == 0) {
            *out = (light_kind)k;
            return true;
        }
    return false;
}

double light_kind_factor(light_kind from, light_kind to) {
    if (from == to) return 1;
    return to == LIGHT_PHOTOMETRIC ? WHITE_EFFICACY : 1 / WHITE_EFFICACY;
}

/* Longer words stand before those that they end with. */
static const struct given_word {
    const char *word;
    given_unit unit;
} given_words[] = {
    {"cd/m2", GIVEN_CD_M2}, {"cd/m\u00b2", GIVEN_CD_M2}, {"lm/m2", GIVEN_LM_M2}, {"lm/m\u00b2", GIVEN_LM_M2},
    {"W/m2", GIVEN_W_M2},   {"W/m\u00b2", GIVEN_W_M2},   {"lm", GIVEN_LM},       {"W", GIVEN_W},
};

size_t given_unit_split(const char *text, size_t length, given_unit *unit) {
    *unit = GIVEN_PLAIN;
    for (size_t k = 0; k < sizeof given_words / sizeof *given_words; k++) {
        const size_t of_word = strlen(given_words[k].word);
        if (length <= of_word || memcmp(text + length - of_word, given_words[k].word, of_word) != 0) continue;
        *unit = given_words[k].unit;
        length -= of_word;
        while (length > 0 && text[length - 1] == ' ') length--;
        break;
    }
    return length;
}

light_kind given_unit_kind(given_unit unit, light_kind own) {
    switch (unit) {
    case GIVEN_LM:
    case GIVEN_CD_M2:
    case GIVEN_LM_M2:
        return LIGHT_PHOTOMETRIC;
    case GIVEN_W:
    case GIVEN_W_M2:
        return LIGHT_RADIOMETRIC;
    default:
        return own;
    }
}

bool given_unit_is_flux(given_unit unit) {
    return unit == GIVEN_LM || unit == GIVEN_W;
}

double given_unit_exitance(given_unit unit, double area, light_kind to) {
    const double factor = light_kind_factor(given_unit_kind(unit, to), to);
    if (given_unit_is_flux(unit)) return factor / area;
    return unit == GIVEN_CD_M2 ? M_PI * factor : factor;
}

/* The units of answers: their kind of light, its units in one of them, and their names. */
static const struct unit_row {
    const char *word;
    light_kind kind;
    double size;
    const char *year, *exitance, *exitance_year;
} units[] = {
    [ANSWER_LX] = {"lx", LIGHT_PHOTOMETRIC, 1, "klx h", "lm/m2", "klm h/m2"},
    [ANSWER_KLX] = {"klx", LIGHT_PHOTOMETRIC, 1000, "Mlx h", "klm/m2", "Mlm h/m2"},
    [ANSWER_FC] = {"fc", LIGHT_PHOTOMETRIC, LUX_OF_FOOTCANDLE, "kfc h", "lm/ft2", "klm h/ft2"},
    [ANSWER_W_M2] = {"W/m2", LIGHT_RADIOMETRIC, 1, "kWh/m2", "W/m2", "kWh/m2"},
};

bool answer_unit_find(const char *word, size_t length, answer_unit *out) {
    for (int k = ANSWER_LX; k <= ANSWER_W_M2; k++)
        if (strlen(units[k].word) == length && memcmp(units[k].word, word, length) == 0) {
            *out = (answer_unit)k;
            return true;
        }
    return false;
}

static const struct unit_row *unit_of(const light_conversion *c) {
    if (c->unit != ANSWER_PLAIN) return &units[c->unit];
    return &units[c->from == LIGHT_PHOTOMETRIC ? ANSWER_LX : ANSWER_W_M2];
}

bool light_conversion_make(light_kind from, answer_unit unit, size_t n_channels, light_conversion *out) {
    light_conversion made = {
        .from = from, .unit = unit, .factor = 1, .lights = out->lights, .efficacies = out->efficacies};
    const struct unit_row *to = unit_of(&made);
    const bool photometric = unit != ANSWER_PLAIN && to->kind == LIGHT_PHOTOMETRIC;
    if (photometric && n_channels != 1 && n_channels != 3) return false;
    made.factor = light_kind_factor(from, to->kind) / to->size;
    made.luminance = photometric && n_channels == 3;
    *out = made;
    return true;
}

const char *light_conversion_unit(const light_conversion *c, bool exitance) {
    const struct unit_row *row = unit_of(c);
    return exitance ? row->exitance : row->word;
}

const char *light_conversion_year(const light_conversion *c, bool exitance) {
    const struct unit_row *row = unit_of(c);
    return exitance ? row->exitance_year : row->year;
}

void light_conversion_text(const light_conversion *c, char text[LIGHT_CONVERSION_TEXT]) {
    const struct unit_row *row = unit_of(c);
    size_t length = 0;
    text[0] = '\0';
    if (c->efficacies)
        length += (size_t)snprintf(text, LIGHT_CONVERSION_TEXT, "luminous efficacies of Perez et al. 1990");
    if (c->lights || row->kind != c->from)
        length += (size_t)snprintf(text + length, LIGHT_CONVERSION_TEXT - length, "%s%g lm/W",
                                   length > 0 ? "; " : "", WHITE_EFFICACY);
    if (c->luminance)
        length += (size_t)snprintf(text + length, LIGHT_CONVERSION_TEXT - length, "%sluminance %s",
                                   length > 0 ? "; " : "", LUMINANCE_TEXT);
    if (row->size != 1)
        snprintf(text + length, LIGHT_CONVERSION_TEXT - length, "%s1 %s = %.6g lx", length > 0 ? "; " : "",
                 row->word, row->size);
}
