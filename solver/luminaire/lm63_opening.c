/* Luminous openings of LM-63: the signs of width, length and height say the shape, in each version in another
 * way. Width is along y (C90 to C270), length along x (C0 to C180). */
#include "solver/luminaire/luminaire_source.h"

#include <math.h>
#include <string.h>

enum { OF_1986 = 1, OF_1995 = 2, OF_2002 = 4, ANY = 7 };

/* The signs, '+', '-', '0', and '.' for + or 0, of width, length and height. round: sizes of 0 are those of
 * the others; equal: for negative numbers that are the same size, and unlike for those that are not. */
static const struct shape_row {
    unsigned versions;
    char signs[4];
    luminaire_shape equal, unlike;
    bool round;
} rows[] = {
    {ANY, "000", OPENING_POINT, OPENING_POINT, false},
    {ANY, "..0", OPENING_RECTANGLE, OPENING_RECTANGLE, false},
    {ANY, "+++", OPENING_BOX, OPENING_BOX, false},
    {ANY, "..+", OPENING_RECTANGLE, OPENING_RECTANGLE, false}, /* upright: one side is 0 */
    {ANY, "-00", OPENING_DISC, OPENING_DISC, true},
    {ANY, "0-0", OPENING_DISC, OPENING_DISC, true},
    {ANY, "-0+", OPENING_CYLINDER, OPENING_CYLINDER, true},
    {ANY, "0-+", OPENING_CYLINDER, OPENING_CYLINDER, true},
    {OF_1986 | OF_1995, "-+0", OPENING_ELLIPSE, OPENING_ELLIPSE, false},
    {OF_1986 | OF_1995, "+-0", OPENING_ELLIPSE, OPENING_ELLIPSE, false},
    {OF_1986, "-++", OPENING_ELLIPSOID, OPENING_ELLIPSOID, false},
    {OF_1995, "-++", OPENING_CYLINDER, OPENING_CYLINDER, false},
    {OF_1995, "+-+", OPENING_CYLINDER, OPENING_CYLINDER, false},
    {OF_1995, "-+-", OPENING_ELLIPSOID, OPENING_ELLIPSOID, false},
    {OF_1995, "+--", OPENING_ELLIPSOID, OPENING_ELLIPSOID, false},
    {OF_1995, "-0-", OPENING_SPHERE, OPENING_ELLIPSOID, true},
    {OF_1995, "0+-", OPENING_CYLINDER_X, OPENING_CYLINDER_X, true},
    {OF_1995, "+0-", OPENING_CYLINDER_Y, OPENING_CYLINDER_Y, true},
    /* These are of 2002; no older version has them, but files of its number do. */
    {ANY, "--0", OPENING_DISC, OPENING_ELLIPSE, false},
    {ANY, "--+", OPENING_CYLINDER, OPENING_CYLINDER, false},
    {ANY, "---", OPENING_SPHERE, OPENING_ELLIPSOID, false},
    {OF_2002, "+--", OPENING_CYLINDER_Y, OPENING_CYLINDER_Y, false},
    {OF_2002, "-+-", OPENING_CYLINDER_X, OPENING_CYLINDER_X, false},
    {OF_2002, "0--", OPENING_UPRIGHT_DISC, OPENING_UPRIGHT_DISC, false},
    {OF_2002, "-0-", OPENING_UPRIGHT_DISC, OPENING_UPRIGHT_DISC, false},
};

static bool has_signs(const char *signs, const double v[3]) {
    for (int k = 0; k < 3; k++) {
        const char sign = v[k] > 0 ? '+' : v[k] < 0 ? '-' : '0';
        if (signs[k] != sign && !(signs[k] == '.' && sign != '-')) return false;
    }
    return true;
}

/* True where all negative numbers are the same size. */
static bool is_equal(const double v[3]) {
    double least = INFINITY, most = 0;
    for (int k = 0; k < 3; k++) {
        if (v[k] >= 0) continue;
        least = fmin(least, -v[k]);
        most = fmax(most, -v[k]);
    }
    return most - least <= 1e-6 * most;
}

bool lm63_opening(luminaire_format version, const double stated[3], double metres, luminaire_opening *out) {
    const unsigned of = version <= LM63_1991 ? OF_1986 : version == LM63_1995 ? OF_1995 : OF_2002;
    double v[3];
    for (int k = 0; k < 3; k++) v[k] = stated[k] * metres;
    *out = (luminaire_opening){.width = v[0], .length = v[1], .height = v[2]};
    for (size_t k = 0; k < sizeof rows / sizeof *rows; k++) {
        if ((rows[k].versions & of) == 0 || !has_signs(rows[k].signs, v)) continue;
        double size[3] = {fabs(v[1]), fabs(v[0]), fabs(v[2])};
        out->shape = is_equal(v) ? rows[k].equal : rows[k].unlike;
        /* The number that is 0 is that of the one that is negative: a diameter. */
        const double diameter = v[0] < 0 ? size[1] : v[1] < 0 ? size[0] : size[2];
        for (int d = 0; d < 3 && rows[k].round; d++)
            if (size[d] == 0 && !(d == 2 && stated[2] == 0)) size[d] = diameter;
        memcpy(out->size, size, sizeof size);
        for (int d = 0; d < 4 && size[2] > 0; d++) out->side[d] = size[2];
        return true;
    }
    return false;
}
