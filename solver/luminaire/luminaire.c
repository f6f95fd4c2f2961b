/* Intensities and flux of a table of candela. Its function is linear in both angles between the places of the
 * table, and 0 outside. */
#include "solver/luminaire/luminaire_source.h"

#include "solver/base/utf8.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* Degrees by which a direction may lie outside of the table through rounding alone. */
static const double slack = 1e-9;

static double radians(double degrees) {
    return degrees * (M_PI / 180);
}

void luminaire_free(luminaire *l) {
    free(l->planes);
    free(l->angles);
    free(l->candela);
    free(l->tilt.angles);
    free(l->tilt.factors);
    free(l->sets);
    free(l->words);
    *l = (luminaire){0};
}

/* Finds the interval of x and the share of its upper end; false outside of the values. n is at least 2. */
static bool locate(size_t n, const double *values, double x, size_t *at, double *share) {
    size_t low = 0, high = n - 1;
    if (!(x >= values[0] - slack && x <= values[n - 1] + slack)) return false;
    /* Most tables have even steps. */
    const double guess = (x - values[0]) / (values[n - 1] - values[0]) * (double)(n - 1);
    const size_t even = guess > 0 ? (size_t)fmin(guess, (double)(n - 2)) : 0;
    if (values[even] <= x && x < values[even + 1]) low = even, high = even + 1;
    while (high - low > 1) {
        const size_t middle = low + (high - low) / 2;
        if (values[middle] <= x)
            low = middle;
        else
            high = middle;
    }
    *at = low;
    *share = fmin(1, fmax(0, (x - values[low]) / (values[high] - values[low])));
    return true;
}

/* The plane of the table that is the mirror of a plane C, or C itself, within a turn from the first one. */
static double mirrored_plane(const luminaire *l, double C) {
    double c = fmod(C, 360);
    if (c < 0) c += 360;
    if (l->symmetry == SYMMETRY_C0_C180 || l->symmetry == SYMMETRY_QUADRANT) c = c > 180 ? 360 - c : c;
    if (l->symmetry == SYMMETRY_QUADRANT) c = c > 90 ? 180 - c : c;
    if (l->symmetry == SYMMETRY_C90_C270) {
        /* The table is the half from 90 to 270, or that from -90 to 90. */
        const bool lower = c > 90 && c < 270, wants_lower = l->planes[0] > 0;
        if (lower != wants_lower) c = c <= 180 ? 180 - c : 540 - c;
        if (!wants_lower && c >= 270) c -= 360;
    }
    while (c < l->planes[0] - slack) c += 360;
    while (c > l->planes[l->n_planes - 1] + slack && c - 360 >= l->planes[0] - slack) c -= 360;
    return c;
}

/* The angles of the table that a direction has: along the planes, and in them. */
static void table_angles(const luminaire *l, double C, double gamma, double *plane, double *angle) {
    if (l->type == LUMINAIRE_C) {
        *plane = l->symmetry == SYMMETRY_ROTATIONAL ? 0 : mirrored_plane(l, C);
        *angle = gamma;
        return;
    }
    const double x = sin(radians(gamma)) * cos(radians(C)), y = sin(radians(gamma)) * sin(radians(C)),
                 down = cos(radians(gamma));
    const bool is_b =
        l->type == LUMINAIRE_B; /* tan V = x / down, sin H = y; A: tan H = y / down, sin V = x */
    const double turned = atan2(is_b ? x : y, down) * (180 / M_PI),
                 tipped = asin(fmin(1, fmax(-1, is_b ? y : x))) * (180 / M_PI);
    *plane = is_b ? tipped : turned;
    *angle = is_b ? turned : tipped;
    if (l->symmetry == SYMMETRY_C0_C180 || l->symmetry == SYMMETRY_QUADRANT) *plane = fabs(*plane);
    if (l->symmetry == SYMMETRY_C90_C270 || l->symmetry == SYMMETRY_QUADRANT) *angle = fabs(*angle);
}

double luminaire_candela(const luminaire *l, double C, double gamma) {
    double plane = 0, angle = 0, u = 0, v = 0;
    size_t p = 0, a = 0;
    if (!isfinite(C) || !(gamma >= 0 && gamma <= 180)) return 0;
    table_angles(l, C, gamma, &plane, &angle);
    if (!locate(l->n_angles, l->angles, angle, &a, &v)) return 0;
    if (l->n_planes > 1 && !locate(l->n_planes, l->planes, plane, &p, &u)) return 0;
    const double *I = l->candela + p * l->n_angles + a, *J = l->n_planes > 1 ? I + l->n_angles : I;
    return (1 - u) * ((1 - v) * I[0] + v * I[1]) + u * ((1 - v) * J[0] + v * J[1]);
}

/* The weights of both ends of an interval a to b of a polar angle in the integral of f sin: with f linear and
 * s = (sin b - sin a) / (b - a), they are cos a - s and s - cos b. */
static void polar_weights(double a, double b, double *at_a, double *at_b) {
    const double s = (sin(b) - sin(a)) / (b - a);
    *at_a = cos(a) - s;
    *at_b = s - cos(b);
}

/* The weights of both ends of an interval of an angle of the table, degrees: of the integral of its sine,
 * counted from a pole at `pole` degrees, or of 1 where it has none (NAN). */
static void interval_weights(const double *ends, double pole, double *low, double *high) {
    const double a = radians(ends[0]), b = radians(ends[1]);
    *low = *high = (b - a) / 2;
    if (!isnan(pole)) polar_weights(a - radians(pole), b - radians(pole), low, high);
}

double luminaire_lumens(const luminaire *l) {
    enum { BLOCK = 64 }; /* intervals whose weights are found once for all planes */
    const double pole_of_angles = l->type == LUMINAIRE_C   ? 0
                                  : l->type == LUMINAIRE_A ? -90
                                                           : (double)NAN,
                 pole_of_planes = l->type == LUMINAIRE_B ? -90 : (double)NAN;
    double sum = 0, low[BLOCK], high[BLOCK], u[2] = {2 * M_PI, 0}; /* of the one plane that is turned */
    const size_t n_intervals = l->n_planes > 1 ? l->n_planes - 1 : 1,
                 next = l->n_planes > 1 ? l->n_angles : 0;
    for (size_t first = 0; first + 1 < l->n_angles; first += BLOCK) {
        const size_t left = l->n_angles - 1 - first, n = left < BLOCK ? left : BLOCK;
        for (size_t a = 0; a < n; a++)
            interval_weights(l->angles + first + a, pole_of_angles, &low[a], &high[a]);
        for (size_t p = 0; p < n_intervals; p++) {
            const double *I = l->candela + p * l->n_angles + first, *J = I + next;
            if (l->n_planes > 1) interval_weights(l->planes + p, pole_of_planes, &u[0], &u[1]);
            for (size_t a = 0; a < n; a++)
                sum +=
                    u[0] * (low[a] * I[a] + high[a] * I[a + 1]) + u[1] * (low[a] * J[a] + high[a] * J[a + 1]);
        }
    }
    if (l->symmetry == SYMMETRY_QUADRANT) return 4 * sum;
    return l->symmetry == SYMMETRY_C0_C180 || l->symmetry == SYMMETRY_C90_C270 ? 2 * sum : sum;
}

double luminaire_peak(const luminaire *l, double *C, double *gamma) {
    size_t best = 0;
    for (size_t k = 0; k < l->n_planes * l->n_angles; k++)
        if (l->candela[k] > l->candela[best]) best = k;
    const double plane = l->planes[best / l->n_angles], angle = l->angles[best % l->n_angles];
    *gamma = angle;
    *C = fmod(plane + 720, 360);
    if (l->type != LUMINAIRE_C) {
        const double turned = radians(l->type == LUMINAIRE_B ? angle : plane),
                     tipped = radians(l->type == LUMINAIRE_B ? plane : angle);
        const double across = sin(turned) * cos(tipped), along = sin(tipped),
                     down = cos(turned) * cos(tipped);
        const double x = l->type == LUMINAIRE_B ? across : along, y = l->type == LUMINAIRE_B ? along : across;
        *gamma = atan2(hypot(x, y), down) * (180 / M_PI);
        *C = hypot(x, y) < 1e-12 ? 0 : fmod(atan2(y, x) * (180 / M_PI) + 360, 360);
    }
    return l->candela[best];
}

const char *luminaire_find_word(const luminaire *l, const char *key) {
    for (size_t k = 0; k < l->n_words; k++) {
        const char *own = l->words[k].key;
        if (strcasecmp(own + strspn(own, "_"), key) == 0) return l->words[k].text;
    }
    return "";
}

const char *luminaire_format_name(luminaire_format format) {
    static const char *const names[LUMINAIRE_FORMATS] = {
        "LM-63-1986", "LM-63-1991", "LM-63-1995", "LM-63-2002", "LM-63-2019", "EULUMDAT", "formula"};
    return names[format];
}

const char *luminaire_type_name(luminaire_type type) {
    static const char *const names[LUMINAIRE_TYPES] = {"C", "B", "A"};
    return names[type];
}

const char *luminaire_symmetry_name(luminaire_symmetry symmetry) {
    static const char *const names[LUMINAIRE_SYMMETRIES] = {"none", "rotational", "about C0-C180",
                                                            "about C90-C270", "quadrant"};
    return names[symmetry];
}

/* True for a text that ends within its room, and is one line of UTF-8. */
static bool text_is_sound(const char *text, size_t room) {
    const size_t length = strnlen(text, room);
    return length < room && utf8_is_valid(text, length) && strpbrk(text, "\r\n") == NULL;
}

static bool numbers_are_sound(size_t n, const double *values, double least, double most, bool ascend) {
    for (size_t k = 0; k < n; k++)
        if (!(values[k] >= least && values[k] <= most) || (ascend && k > 0 && !(values[k] > values[k - 1])))
            return false;
    return true;
}

/* True where the planes are those that the symmetry needs. */
static bool planes_are_sound(const luminaire *l) {
    const double first = l->planes[0], last = l->planes[l->n_planes - 1];
    if (l->type != LUMINAIRE_C) return l->symmetry != SYMMETRY_ROTATIONAL && l->n_planes > 1;
    if (l->symmetry == SYMMETRY_ROTATIONAL) return l->n_planes == 1;
    if (l->n_planes < 2 || l->angles[0] < 0) return false;
    switch (l->symmetry) {
    case SYMMETRY_C0_C180:
        return first == 0 && last == 180;
    case SYMMETRY_C90_C270:
        return (first == 90 && last == 270) || (first == -90 && last == 90);
    case SYMMETRY_QUADRANT:
        return first == 0 && last == 90;
    default:
        return fabs(last - first - 360) < 1e-6;
    }
}

bool luminaire_is_sound(const luminaire *l) {
    const luminaire_opening *o = &l->opening;
    const double stated[3] = {o->width, o->length, o->height};
    if (l->format >= LUMINAIRE_FORMATS || l->type >= LUMINAIRE_TYPES || l->symmetry >= LUMINAIRE_SYMMETRIES ||
        o->shape >= LUMINAIRE_SHAPES || l->n_planes == 0 || l->n_angles < 2 || l->n_sets == 0 ||
        l->set >= l->n_sets || isinf(l->measured_tilt) || isinf(l->output_ratio))
        return false;
    if (!numbers_are_sound(l->n_planes, l->planes, -360, 720, true) ||
        !numbers_are_sound(l->n_angles, l->angles, -180, 180, true) || !planes_are_sound(l) ||
        !numbers_are_sound(l->n_planes * l->n_angles, l->candela, 0, LUMINAIRE_CANDELA_MOST, false) ||
        !numbers_are_sound(l->tilt.n, l->tilt.angles, 0, 180, true) ||
        !numbers_are_sound(l->tilt.n, l->tilt.factors, 0, 1000, false) ||
        !numbers_are_sound(3, o->size, 0, LUMINAIRE_LENGTH_MOST, false) ||
        !numbers_are_sound(4, o->side, 0, LUMINAIRE_LENGTH_MOST, false) ||
        !numbers_are_sound(3, stated, -LUMINAIRE_LENGTH_MOST, LUMINAIRE_LENGTH_MOST, false))
        return false;
    for (size_t k = 0; k < l->n_sets; k++) {
        const luminaire_lamps *set = &l->sets[k];
        if (!(fabs(set->number) <= LUMINAIRE_CANDELA_MOST) || isinf(set->lumens) || isinf(set->watts) ||
            !text_is_sound(set->type, sizeof set->type) || !text_is_sound(set->colour, sizeof set->colour) ||
            !text_is_sound(set->rendering, sizeof set->rendering))
            return false;
    }
    for (size_t k = 0; k < l->n_words; k++)
        if (!text_is_sound(l->words[k].key, LUMINAIRE_KEY) ||
            !text_is_sound(l->words[k].text, LUMINAIRE_TEXT))
            return false;
    const size_t warned = strnlen(l->warnings.text, LUMINAIRE_WARNINGS);
    return warned < LUMINAIRE_WARNINGS && utf8_is_valid(l->warnings.text, warned);
}
