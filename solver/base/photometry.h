/* Light in watts and in lumens: the weights of red, green and blue, the efficacy of white light, and the
 * units that lights are given and answers are told in. The only place of these numbers; knows no scene.
 *
 * A radiometric store counts in W, a photometric one in lm. Its channels are those of white: light that is
 * the same in all of them is white, and its luminance is that number. White light of equal energy makes
 * WHITE_EFFICACY lm of each W in the visible range, as Radiance has it; 683 lm/W is of light of 555 nm alone.
 * Solar radiation, of which a part is visible, has efficacies of its own (perez.h). */
#ifndef LAMBERT_BASE_PHOTOMETRY_H
#define LAMBERT_BASE_PHOTOMETRY_H

#include <stdbool.h>
#include <stddef.h>

#define WHITE_EFFICACY 179.                      /* lm/W, of equal-energy white (Ward, Shakespeare 1998) */
#define LUX_OF_FOOTCANDLE (1. / (.3048 * .3048)) /* lx: 1 fc is 1 lm/ft2 */

/* The luminance of linear Rec. 709 (ITU-R BT.709): that of every scene and answer with three channels. */
#define LUMINANCE_RED .2126
#define LUMINANCE_GREEN .7152
#define LUMINANCE_BLUE .0722
#define LUMINANCE_TEXT "0.2126 R + 0.7152 G + 0.0722 B"
double luminance_of(double red, double green, double blue);

/* The luminance of Radiance's colours, in which its skies come (gendaymtx, genskyvec). */
#define RADIANCE_LUMINANCE_TEXT "0.265 R + 0.670 G + 0.065 B"
double luminance_of_radiance(double red, double green, double blue);

/* The kind of light that lights and answers count: in W, or in lm. */
typedef enum light_kind { LIGHT_RADIOMETRIC, LIGHT_PHOTOMETRIC } light_kind;

/* "W" and "lm", the words of options and stores; the other way false for any other word. */
#define LIGHT_KIND_WORDS "W|lm"
const char *light_kind_word(light_kind kind);
bool light_kind_find(const char *word, light_kind *out);

/* The factor of numbers that were of one kind and become the other. */
double light_kind_factor(light_kind from, light_kind to);

/* The unit that a light is given in: an exitance of the store's kind where it has none. */
typedef enum given_unit { GIVEN_PLAIN, GIVEN_LM, GIVEN_W, GIVEN_CD_M2, GIVEN_LM_M2, GIVEN_W_M2 } given_unit;
#define GIVEN_UNIT_WORDS "lm, W, cd/m2, lm/m2 or W/m2"

/* Finds the unit at the end of a text such as "3600lm", "17,12,4 W" or "500cd/m2" (also m²), and returns the
 * length of its numbers. */
size_t given_unit_split(const char *text, size_t length, given_unit *unit);

/* The kind of light that is given in a unit; `own` where it has none. True where it is the flux of all that
 * emits together. */
light_kind given_unit_kind(given_unit unit, light_kind own);
bool given_unit_is_flux(given_unit unit);

/* The exitance, of kind `to`, of 1 of the unit: M = flux / area, M = pi L; area in m2, above 0 for a flux. */
double given_unit_exitance(given_unit unit, double area, light_kind to);

/* The unit that answers are asked in; ANSWER_PLAIN: that of their light. */
typedef enum answer_unit { ANSWER_PLAIN, ANSWER_LX, ANSWER_KLX, ANSWER_FC, ANSWER_W_M2 } answer_unit;
#define ANSWER_UNIT_WORDS "lx|klx|fc|W/m2"
bool answer_unit_find(const char *word, size_t length, answer_unit *out);

/* The way from the light to the numbers of an answer. Zeroed, it leaves radiometric light as it is. */
typedef struct light_conversion {
    light_kind from;  /* of the light */
    answer_unit unit; /* that is asked for */
    double factor;    /* of every channel; 0 stands for 1 */
    bool luminance;   /* three channels become one, their luminance */
    bool lights;      /* some lights were of the other kind, and were converted too */
    bool efficacies;  /* solar radiation became light by the luminous efficacies of perez.h */
} light_conversion;

/* False where n_channels has no luminance (neither 1 nor 3) and one is asked for. */
bool light_conversion_make(light_kind from, answer_unit unit, size_t n_channels, light_conversion *out);

/* The unit of values: of irradiance "W/m2", "lx", "klx" or "fc"; of what leaves a surface (`exitance`)
 * "W/m2", "lm/m2", "klm/m2" or "lm/ft2". And of their sums over a year, in thousands of hours: "kWh/m2", "klx
 * h" ... */
const char *light_conversion_unit(const light_conversion *c, bool exitance);
const char *light_conversion_year(const light_conversion *c, bool exitance);

/* Puts the conversion of the numbers into text, "179 lm/W; luminance 0.2126 R + ...; 1 fc = 10.7639 lx"; ""
 * where none was. */
#define LIGHT_CONVERSION_TEXT 160
void light_conversion_text(const light_conversion *c, char text[LIGHT_CONVERSION_TEXT]);

#endif
