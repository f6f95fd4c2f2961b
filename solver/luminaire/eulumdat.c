/* Reads EULUMDAT (.ldt): one value a line. Absolute candela = value x conversion factor x lumens of the lamp
 * set / 1000: the values hold the light output ratio already, and lumens are those of all lamps of a set.
 * Length is along y (C90 to C270), width along x (C0 to C180). */
#include "solver/luminaire/luminaire_source.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Lines that have a place of their own. */
enum {
    LINE_ISYM = 3,
    LINE_MC = 4,
    LINE_NG = 6,
    LINE_BODY = 13,
    LINE_OPENING = 16,
    LINE_SIDES = 18,
    LINE_LORL = 23
};

static const char shifted[] = "is a line missing before it, or one too many?";

typedef struct line_reader {
    const luminaire_source *s;
    const char *at, *begin, *end; /* the next line, and the one that was read last */
    size_t number;
} line_reader;

/* A number of the file and its limits. */
typedef struct line_field {
    const char *what;
    double least, most;
    bool whole, above; /* above: more than least */
    bool optional;     /* an empty line is a 0 */
    bool leading;      /* words may stand behind it: "1 x LED" */
    bool shifts;       /* a wrong value is likely that of another line */
    const char *limit; /* in words; NULL: least and most say it */
} line_field;

static size_t bytes_left(const line_reader *r) {
    return r->at < r->s->end ? (size_t)(r->s->end - r->at) : 0;
}

static size_t lines_left(line_reader r) {
    size_t count = 0;
    while (luminaire_source_line(r.s, &r.at, &r.begin, &r.end)) count++;
    return count;
}

static lam_status read_line(line_reader *r, const char *what, lam_error *error) {
    if (!luminaire_source_line(r->s, &r->at, &r->begin, &r->end))
        return status_fail(error, LAM_ERR_FORMAT, "%s: ends after line %zu, before its line %s", r->s->name,
                           r->number, what);
    r->number++;
    luminaire_trim(&r->begin, &r->end);
    return LAM_OK;
}

/* Fails at the line that was read last. */
static lam_status wrong(const line_reader *r, const char *what, const char *limit, lam_error *error) {
    char text[48];
    luminaire_clean(r->begin, r->end, text, sizeof text);
    return status_fail(error, LAM_ERR_FORMAT, "%s: line %zu: %s = %s, %s", r->s->name, r->number, what,
                       text[0] != '\0' ? text : "nothing", limit);
}

/* The number at the begin of a line, with words behind it. */
static bool leading_number(const line_reader *r, double *out) {
    const char *end = r->begin;
    while (end < r->end && (isdigit((unsigned char)*end) || strchr("+-.,", *end) != NULL)) end++;
    return luminaire_number(r->begin, end, true, out);
}

static lam_status read_number(line_reader *r, const line_field *f, double *out, lam_error *error) {
    lam_status status = LAM_OK;
    char limit[LUMINAIRE_LIMIT], advice[160];
    double value = 0;
    TRY(read_line(r, f->what, error));
    const bool empty = r->begin == r->end && f->optional;
    if (!empty && !luminaire_number(r->begin, r->end, true, &value) &&
        !(f->leading && leading_number(r, &value))) {
        snprintf(advice, sizeof advice, "must be one number; %s", shifted);
        TRY(wrong(r, f->what, advice, error));
    }
    if (f->whole && value != floor(value)) TRY(wrong(r, f->what, "must be a whole number", error));
    if (!luminaire_in_limits(value, f->least, f->most, f->above, limit)) {
        snprintf(advice, sizeof advice, "%s%s%s", f->limit != NULL ? f->limit : limit, f->shifts ? "; " : "",
                 f->shifts ? shifted : "");
        TRY(wrong(r, f->what, advice, error));
    }
    *out = value;
done:
    return status;
}

bool eulumdat_is_it(const luminaire_source *s) {
    const char *at = s->text, *begin, *end;
    double value = 0;
    for (int line = 1; line <= LINE_NG; line++) {
        if (!luminaire_source_line(s, &at, &begin, &end)) return false;
        luminaire_trim(&begin, &end);
        if (line == 1 || (line == LINE_MC + 1 && begin == end)) continue; /* a distance may be left out */
        if (!luminaire_number(begin, end, true, &value)) return false;
        if (line <= LINE_MC && (value < 0 || value != floor(value))) return false;
    }
    return true;
}

/* The numbers of lines 2 to 7 that matter. */
typedef struct table_size {
    int symmetry;
    size_t n_planes, n_angles; /* listed */
} table_size;

static lam_status read_size(line_reader *r, table_size *size, lam_error *error) {
    lam_status status = LAM_OK;
    static const line_field
        type = {.what = "type indicator",
                .least = 0,
                .most = 3,
                .whole = true,
                .limit = "must be from 0 to 3"},
        symmetry = {.what = "symmetry indicator",
                    .least = 0,
                    .most = 4,
                    .whole = true,
                    .limit = "must be from 0 to 4"},
        planes = {.what = "number of C-planes", .least = 1, .most = 1e15, .whole = true},
        angles = {.what = "number of intensities of a plane", .least = 2, .most = 1e15, .whole = true},
        step = {.what = "distance of C-planes", .least = 0, .most = 360, .optional = true},
        angle_step = {.what = "distance of intensities", .least = 0, .most = 180, .optional = true};
    double value = 0;
    TRY(read_number(r, &type, &value, error));
    TRY(read_number(r, &symmetry, &value, error));
    size->symmetry = (int)value;
    const char *const limits[] = {NULL, NULL, "an even number", "an even number", "a multiple of 4"};
    TRY(read_number(r, &planes, &value, error));
    size->n_planes = (size_t)value;
    if (size->symmetry >= 2 && size->n_planes % (size->symmetry == 4 ? 4 : 2) != 0)
        FAIL(error, LAM_ERR_FORMAT, "%s: line %zu: number of C-planes = %zu, must be %s for symmetry %d",
             r->s->name, r->number, size->n_planes, limits[size->symmetry], size->symmetry);
    if (value > (double)(bytes_left(r) / 2 + 1))
        TRY(wrong(r, planes.what, "more than the rest of the file can hold", error));
    TRY(read_number(r, &step, &value, error));
    TRY(read_number(r, &angles, &value, error));
    if (value > (double)(bytes_left(r) / 2 + 1))
        TRY(wrong(r, angles.what, "more than the rest of the file can hold", error));
    size->n_angles = (size_t)value;
    TRY(read_number(r, &angle_step, &value, error));
done:
    return status;
}

/* Millimetres of the luminous area: length or diameter, width or 0, and heights of four sides. */
static void find_opening(const double length, const double width, const double *sides,
                         luminaire_opening *out) {
    const double metres = 1e-3, l = length * metres, w = width * metres;
    double height = 0;
    for (int k = 0; k < 4; k++) {
        out->side[k] = sides[k] * metres;
        height = fmax(height, out->side[k]);
    }
    const bool round = w == 0 && l > 0;
    out->width = w;
    out->length = l;
    out->height = height;
    out->size[0] = round ? l : w;
    out->size[1] = l;
    out->size[2] = height;
    if (l == 0 && w == 0)
        out->shape = height > 0 ? OPENING_RECTANGLE : OPENING_POINT;
    else if (round)
        out->shape = height > 0 ? OPENING_CYLINDER : OPENING_DISC;
    else
        out->shape = height > 0 && l > 0 ? OPENING_BOX : OPENING_RECTANGLE;
}

/* Reads lines 13 to 25; *factor is the conversion factor. */
static lam_status read_body(line_reader *r, luminaire *l, double *factor, lam_error *error) {
    lam_status status = LAM_OK;
    const double most = LUMINAIRE_LENGTH_MOST;
    const line_field fields[] = {
        {"length or diameter of the luminaire (mm)", 0, most, .optional = true},
        {"width of the luminaire (mm)", 0, most, .optional = true},
        {"height of the luminaire (mm)", 0, most, .optional = true},
        {"length or diameter of the luminous area (mm)", 0, most, .optional = true},
        {"width of the luminous area (mm)", 0, most, .optional = true},
        {"height of the luminous area at C0 (mm)", 0, most, .optional = true},
        {"height of the luminous area at C90 (mm)", 0, most, .optional = true},
        {"height of the luminous area at C180 (mm)", 0, most, .optional = true},
        {"height of the luminous area at C270 (mm)", 0, most, .optional = true},
        {"downward flux fraction (%)", -1e3, 1e6, .optional = true},
        {"light output ratio (%)", -1e3, 1e6, .optional = true},
        {"conversion factor for intensities", 0, LUMINAIRE_CANDELA_MOST, .above = true, .shifts = true},
        {"tilt during measurement (degrees)", -360, 360, .optional = true}};
    enum { N = sizeof fields / sizeof *fields };
    double v[N] = {0};
    for (int k = 0; k < N; k++) TRY(read_number(r, &fields[k], &v[k], error));
    find_opening(v[LINE_OPENING - LINE_BODY], v[LINE_OPENING + 1 - LINE_BODY], v + (LINE_SIDES - LINE_BODY),
                 &l->opening);
    l->output_ratio = v[LINE_LORL - LINE_BODY] / 100;
    *factor = v[N - 2];
    l->measured_tilt = v[N - 1];
    if (l->measured_tilt != 0)
        luminaire_warn(l, "it was measured at a tilt of %.6g degrees; its table is taken as it is",
                       l->measured_tilt);
done:
    return status;
}

static lam_status read_text(line_reader *r, const char *what, char out[LUMINAIRE_TEXT], lam_error *error) {
    const lam_status status = read_line(r, what, error);
    if (status == LAM_OK) luminaire_clean(r->begin, r->end, out, LUMINAIRE_TEXT);
    return status;
}

static lam_status read_lamp_sets(line_reader *r, luminaire *l, lam_error *error) {
    lam_status status = LAM_OK;
    static const line_field
        sets = {.what = "number of lamp sets",
                .least = 1,
                .most = LUMINAIRE_SETS_MOST,
                .whole = true,
                .shifts = true},
        number = {.what = "number of lamps", .least = -1e6, .most = 1e6, .leading = true},
        lumens = {.what = "lumens of a lamp set",
                  .least = 0,
                  .most = 1e12,
                  .above = true,
                  .limit = "must be above 0; a negative number of lamps tells absolute photometry"},
        watts = {
            .what = "watts of a lamp set", .least = -1e12, .most = 1e12, .optional = true, .leading = true};
    double n = 0;
    TRY(read_number(r, &sets, &n, error));
    /* The shortest lines of a set are one byte each, and its end. */
    if (n * 6 > (double)bytes_left(r))
        TRY(wrong(r, sets.what, "more than the rest of the file can hold", error));
    l->sets = memory_allocate((size_t)n, sizeof *l->sets, r->s->name, error);
    if (l->sets == NULL) TRY(LAM_ERR_MEMORY);
    for (l->n_sets = 0; l->n_sets < (size_t)n; l->n_sets++) {
        luminaire_lamps *set = &l->sets[l->n_sets];
        TRY(read_number(r, &number, &set->number, error));
        TRY(read_text(r, "type of lamps", set->type, error));
        TRY(read_number(r, &lumens, &set->lumens, error));
        TRY(read_text(r, "colour of lamps", set->colour, error));
        TRY(read_text(r, "colour rendering of lamps", set->rendering, error));
        TRY(read_number(r, &watts, &set->watts, error));
        if (r->begin == r->end) set->watts = NAN;
    }
done:
    return status;
}

/* Takes the set that was asked for, or the first. */
static lam_status choose_set(const char *name, const luminaire_options *options, luminaire *l,
                             lam_error *error) {
    if (options->set > l->n_sets)
        return status_fail(error, LAM_ERR_ARGUMENT, "%s: --set %zu: it has %zu lamp set%s", name,
                           options->set, l->n_sets, l->n_sets == 1 ? "" : "s");
    l->set = options->set > 0 ? options->set - 1 : 0;
    l->absolute = l->sets[l->set].number < 0;
    if (options->set == 0 && l->n_sets > 1)
        luminaire_warn(
            l, "it has %zu lamp sets; the first is taken; --set N, or lamp_set in a list, takes another",
            l->n_sets);
    return LAM_OK;
}

/* Reads ascending angles. */
static lam_status read_angles(line_reader *r, const line_field *f, size_t n, double *out, lam_error *error) {
    lam_status status = LAM_OK;
    char limit[96];
    for (size_t k = 0; k < n; k++) {
        TRY(read_number(r, f, &out[k], error));
        if (k == 0 || out[k] > out[k - 1]) continue;
        snprintf(limit, sizeof limit, "must be above %.10g, the one before (%zu of %zu)", out[k - 1], k + 1,
                 n);
        TRY(wrong(r, f->what, limit, error));
    }
done:
    return status;
}

/* The listed planes of which intensities are stored: n many from the index `first` on, where the first plane
 * follows the last. They have to go from one angle to another; NAN: any. */
typedef struct stored_planes {
    size_t first, n;
    double from, to; /* degrees */
} stored_planes;

static stored_planes planes_of(int symmetry, size_t n_listed, const double *listed) {
    stored_planes p = {.n = n_listed, .from = NAN, .to = NAN};
    if (symmetry == 1) p.n = 1;
    if (symmetry >= 2) p = (stored_planes){0, n_listed / 2 + 1, 0, 180};
    if (symmetry == 4) p = (stored_planes){0, n_listed / 4 + 1, 0, 90};
    if (symmetry == 3) {
        p.from = 270, p.to = 90;
        /* 3 n / 4 where the planes are even. */
        while (p.first + 1 < n_listed && listed[p.first] < 270 - 1e-6) p.first++;
    }
    return p;
}

/* Keeps the planes of the symmetry in l->planes. */
static lam_status take_planes(const line_reader *r, const table_size *size, const double *listed,
                              luminaire *l, lam_error *error) {
    lam_status status = LAM_OK;
    const size_t n = size->n_planes;
    const stored_planes p = planes_of(size->symmetry, n, listed);
    static const luminaire_symmetry symmetries[] = {SYMMETRY_NONE, SYMMETRY_ROTATIONAL, SYMMETRY_C0_C180,
                                                    SYMMETRY_C90_C270, SYMMETRY_QUADRANT};
    const double from = listed[p.first % n], to = listed[(p.first + p.n - 1) % n];
    if (p.n > n || (!isnan(p.from) && !(fabs(from - p.from) < 1e-6 && fabs(to - p.to) < 1e-6)))
        FAIL(error, LAM_ERR_FORMAT,
             "%s: line %zu: symmetry %d of %zu C-planes needs the stored ones to go from %g to %g, they go "
             "from %.10g to %.10g",
             r->s->name, (size_t)LINE_ISYM, size->symmetry, n, p.from, p.to, from, to);
    l->symmetry = p.n == 1 ? SYMMETRY_ROTATIONAL : symmetries[size->symmetry];
    for (size_t k = 0; k < p.n; k++) {
        const double C = listed[(p.first + k) % n];
        l->planes[k] = p.first > 0 && p.first + k < n ? C - 360 : C;
    }
    if (!isnan(p.from)) {
        l->planes[0] = p.from > p.to ? p.from - 360 : p.from;
        l->planes[p.n - 1] = p.to;
    }
    l->n_planes = p.n;
    if (l->symmetry == SYMMETRY_NONE && l->planes[p.n - 1] - l->planes[0] > 360 + 1e-6)
        FAIL(error, LAM_ERR_FORMAT, "%s: its C-planes go from %.10g to %.10g, more than one turn", r->s->name,
             l->planes[0], l->planes[p.n - 1]);
done:
    return status;
}

static lam_status read_candela(line_reader *r, luminaire *l, double factor, lam_error *error) {
    lam_status status = LAM_OK;
    const line_field value = {
        .what = "intensity (cd per 1,000 lm)", .least = 0, .most = LUMINAIRE_CANDELA_MOST};
    char limit[128];
    const size_t count = l->n_planes * l->n_angles;
    for (size_t k = 0; k < count; k++) {
        if (bytes_left(r) == 0)
            FAIL(error, LAM_ERR_FORMAT, "%s: ends after line %zu, after %zu of %zu intensities (%zu by %zu)",
                 r->s->name, r->number, k, count, l->n_planes, l->n_angles);
        TRY(read_number(r, &value, &l->candela[k], error));
        l->candela[k] = fabs(l->candela[k]) * factor; /* -0 is 0 */
        if (!(l->candela[k] <= LUMINAIRE_CANDELA_MOST))
            TRY(wrong(r, value.what, "too large with the factors of the file", error));
    }
    if (bytes_left(r) > 0) {
        snprintf(limit, sizeof limit,
                 "must not be there: the symmetry and the numbers of lines 3, 4 and 6 make %zu by %zu",
                 l->n_planes, l->n_angles);
        TRY(read_line(r, "after the last intensity", error));
        TRY(wrong(r, "a line after the last intensity", limit, error));
    }
done:
    return status;
}

static lam_status read_table(line_reader *r, const table_size *size, luminaire *l, double factor,
                             lam_error *error) {
    lam_status status = LAM_OK;
    static const line_field ratio = {.what = "direct ratio", .least = -1e6, .most = 1e6, .optional = true},
                            plane = {.what = "C-plane (degrees)", .least = 0, .most = 360},
                            angle = {.what = "gamma (degrees)", .least = 0, .most = 180};
    double ignored = 0, *listed = NULL;
    for (int k = 0; k < 10; k++) TRY(read_number(r, &ratio, &ignored, error));
    listed = memory_allocate(size->n_planes, sizeof *listed, r->s->name, error);
    if (listed == NULL) TRY(LAM_ERR_MEMORY);
    TRY(read_angles(r, &plane, size->n_planes, listed, error));
    const stored_planes p = planes_of(size->symmetry, size->n_planes, listed);
    if ((double)p.n * (double)size->n_angles > (double)(bytes_left(r) / 2 + 1)) {
        const size_t lines = lines_left(*r);
        FAIL(error, LAM_ERR_FORMAT,
             "%s: ends after line %zu, after %zu of %.10g intensities (%zu by %zu, as lines 3, 4 and 6 say)",
             r->s->name, r->number + lines, lines > size->n_angles ? lines - size->n_angles : 0,
             (double)p.n * (double)size->n_angles, p.n, size->n_angles);
    }
    TRY(luminaire_allocate_table(l, r->s->name, p.n, size->n_angles, error));
    TRY(take_planes(r, size, listed, l, error));
    TRY(read_angles(r, &angle, size->n_angles, l->angles, error));
    TRY(read_candela(r, l, factor, error));
    if (l->symmetry == SYMMETRY_NONE && l->planes[l->n_planes - 1] - l->planes[0] < 360 - 1e-6)
        luminaire_close_turn(l);
done:
    free(listed);
    return status;
}

lam_status eulumdat_read(const luminaire_source *s, const luminaire_options *options, luminaire *l,
                         lam_error *error) {
    lam_status status = LAM_OK;
    static const char *const names[] = {"report", "luminaire", "number", "file", "date"};
    line_reader r = {.s = s, .at = s->text};
    table_size size = {0};
    size_t capacity = 0;
    double factor = 1;
    l->format = EULUMDAT;
    TRY(read_line(&r, "of the company", error));
    TRY(luminaire_add_word(l, &capacity, "company", r.begin, r.end, error));
    TRY(read_size(&r, &size, error));
    for (size_t k = 0; k < sizeof names / sizeof *names; k++) {
        TRY(read_line(&r, names[k], error));
        TRY(luminaire_add_word(l, &capacity, names[k], r.begin, r.end, error));
    }
    TRY(read_body(&r, l, &factor, error));
    TRY(read_lamp_sets(&r, l, error));
    TRY(choose_set(s->name, options, l, error));
    TRY(read_table(&r, &size, l, factor * l->sets[l->set].lumens / 1000, error));
done:
    return status;
}
