/* The lights of a scene file that are no faces: points, spots, and light from one direction. Knows neither
 * files nor luminaires. Source: KHR_lights_punctual of glTF, whose law of a spot is
 *     I(t) = I saturate((cos t - cos outer) / max(.001, cos inner - cos outer))^2. */
#ifndef LAMBERT_BASE_PUNCTUAL_LIGHTS_H
#define LAMBERT_BASE_PUNCTUAL_LIGHTS_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* The most lights of a scene, the room of a name, and the largest intensity and factor of a colour. */
enum { PUNCTUAL_MOST = 65536, PUNCTUAL_NAME = 64 };
#define PUNCTUAL_INTENSITY_MOST 1e15
#define PUNCTUAL_COLOUR_MOST 1e6

/* The presets of the angles of a spot, rad, and the limits of its outer one. */
#define PUNCTUAL_INNER 0.
#define PUNCTUAL_OUTER M_PI_4
#define PUNCTUAL_OUTER_LEAST 1e-6
#define PUNCTUAL_OUTER_MOST M_PI_2

/* The least difference of the cosines of both angles. */
#define PUNCTUAL_EDGE .001

typedef enum punctual_kind {
    PUNCTUAL_POINT,
    PUNCTUAL_SPOT,
    PUNCTUAL_DIRECTIONAL,
    PUNCTUAL_KINDS
} punctual_kind;

/* A light in the axes of the scene. */
typedef struct punctual_light {
    char name[PUNCTUAL_NAME]; /* as punctual_name makes it; those of a scene differ */
    punctual_kind kind;
    uint32_t has_range;  /* 1: the file limits its reach, which no light does */
    double at[3];        /* m */
    double direction[3]; /* unit, that in which it shines: the axis of a spot */
    double intensity;    /* cd; of directional light lx, of a plane that faces it */
    double colour[3];    /* factors of linear red, green and blue, which multiply the intensity */
    double inner, outer; /* of a spot: angles from its axis, rad, 0 <= inner <= outer */
} punctual_light;

/* "point", "spot" and "directional"; static. */
const char *punctual_kind_name(punctual_kind kind);

/* A text as the name of a light, as a luminaire may have it, of less than room <= PUNCTUAL_NAME bytes: cut at
 * a whole character, without blanks at its ends, and with '_' for characters that no line has, for '=' and
 * for ','. Empty where nothing is left. */
void punctual_name(const char *text, size_t room, char *out);

/* Makes the direction a unit vector, of a point light, for which it does not matter, one downwards where it
 * has none. False, with *l as it was, where that is not possible, or where the light has a value that cannot
 * be used. */
bool punctual_light_settle(punctual_light *l);

#endif
