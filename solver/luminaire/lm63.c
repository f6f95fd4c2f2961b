/* Reads IES LM-63 of 1986, 1991, 1995, 2002 and 2019. Its numbers are one stream after the line TILT=: ends
 * of lines carry no meaning. Absolute candela = value x multiplier x ballast factor, x ballast-lamp
 * photometric factor in 1986 and 1991; later versions reserve that field, and 2019 keeps the file generation
 * type there. The number of lamps and their lumens are no factors. */
#include "solver/luminaire/luminaire_source.h"

#include "solver/base/asset_files.h"
#include "solver/base/file_text.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

static const double feet = .3048;

/* Numbers one after the other. */
typedef struct number_stream {
    const luminaire_source *s;
    const char *at, *word, *word_end;    /* the next place, and the word that was read last */
    const char *first_angle, *first_end; /* of the row of angles that was read last */
} number_stream;

/* A number of the file and its limits. */
typedef struct number_field {
    const char *what;
    double least, most;
    bool whole, above; /* above: more than least */
    const char *limit; /* in words; NULL: least and most say it */
} number_field;

static size_t bytes_left(const number_stream *n) {
    return (size_t)(n->s->end - n->at);
}

static size_t words_left(number_stream n) {
    size_t count = 0;
    while (luminaire_source_word(n.s, &n.at, &n.word, &n.word_end)) count++;
    return count;
}

/* Fails at the word that was read last: "NAME: line 8, column 3: FIELD = VALUE, LIMIT". */
static lam_status wrong(const number_stream *n, const char *what, const char *limit, lam_error *error) {
    char word[48];
    size_t column = 0;
    const size_t line = luminaire_source_place(n->s, n->word, &column);
    luminaire_clean(n->word, n->word_end, word, sizeof word);
    return status_fail(error, LAM_ERR_FORMAT, "%s: line %zu, column %zu: %s = %s, %s", n->s->name, line,
                       column, what, word, limit);
}

static lam_status read_number(number_stream *n, const number_field *f, double *out, lam_error *error) {
    lam_status status = LAM_OK;
    char limit[LUMINAIRE_LIMIT];
    double value = 0;
    if (!luminaire_source_word(n->s, &n->at, &n->word, &n->word_end))
        FAIL(error, LAM_ERR_FORMAT, "%s: ends at line %zu, before the %s", n->s->name,
             luminaire_source_place(n->s, n->s->end, NULL), f->what);
    if (!luminaire_number(n->word, n->word_end, false, &value))
        TRY(wrong(n, f->what, "must be a number with a decimal point", error));
    if (f->whole && value != floor(value)) TRY(wrong(n, f->what, "must be a whole number", error));
    if (!luminaire_in_limits(value, f->least, f->most, f->above, limit))
        TRY(wrong(n, f->what, f->limit != NULL ? f->limit : limit, error));
    *out = value;
done:
    return status;
}

/* Reads ascending angles within the limits of f. */
static lam_status read_angles(number_stream *n, const number_field *f, size_t count, double *out,
                              lam_error *error) {
    lam_status status = LAM_OK;
    char what[96], limit[96];
    for (size_t k = 0; k < count; k++) {
        if (bytes_left(n) == 0)
            FAIL(error, LAM_ERR_FORMAT, "%s: ends at line %zu, after %zu of %zu values of the %s", n->s->name,
                 luminaire_source_place(n->s, n->s->end, NULL), k, count, f->what);
        TRY(read_number(n, f, &out[k], error));
        if (k == 0) n->first_angle = n->word, n->first_end = n->word_end;
        if (k == 0 || out[k] > out[k - 1]) continue;
        snprintf(what, sizeof what, "%s %zu of %zu", f->what, k + 1, count);
        snprintf(limit, sizeof limit, "must be above %.10g, the one before", out[k - 1]);
        TRY(wrong(n, what, limit, error));
    }
done:
    return status;
}

/* The year of the first line: "IESNA:LM-63-2002", "IES:LM-63-2019", "IESNA91"; 0 where it has none. */
static unsigned year_of(const char *begin, const char *end) {
    char line[64];
    luminaire_clean(begin, end, line, sizeof line);
    if (strncasecmp(line, "IES", 3) != 0) return 0;
    const char *digits = strcasestr(line, "LM-63-");
    digits = digits != NULL ? digits + 6 : line + (strncasecmp(line, "IESNA", 5) == 0 ? 5 : 3);
    digits += strspn(digits, ": -");
    const size_t n = strspn(digits, "0123456789");
    const unsigned year = n == 2 || n == 4 ? (unsigned)strtoul(digits, NULL, 10) : 0;
    return n == 2 ? year + (year < 80 ? 2000 : 1900) : year;
}

static luminaire_format format_of_year(unsigned year) {
    return year >= 2019   ? LM63_2019
           : year >= 2002 ? LM63_2002
           : year >= 1995 ? LM63_1995
           : year >= 1991 ? LM63_1991
                          : LM63_1986;
}

bool lm63_is_tilt_line(const char **begin, const char **end) {
    luminaire_trim(begin, end);
    if (*end - *begin < 5 || strncasecmp(*begin, "TILT", 4) != 0) return false;
    const char *c = *begin + 4;
    while (c < *end && isblank((unsigned char)*c)) c++;
    if (c == *end || *c != '=') return false;
    *begin = c + 1;
    luminaire_trim(begin, end);
    return true;
}

bool lm63_is_it(const luminaire_source *s) {
    const char *at = s->text, *begin, *end;
    for (size_t k = 0; luminaire_source_line(s, &at, &begin, &end); k++)
        if ((k == 0 && year_of(begin, end) > 0) || lm63_is_tilt_line(&begin, &end)) return true;
    return false;
}

/* A line before TILT=: [KEYWORD] text, [MORE] text, or text alone. */
static lam_status read_words(luminaire *l, size_t *capacity, const char *begin, const char *end,
                             lam_error *error) {
    char key[LUMINAIRE_KEY] = "", more[LUMINAIRE_TEXT];
    luminaire_trim(&begin, &end);
    if (begin == end) return LAM_OK;
    const char *close = *begin == '[' ? memchr(begin, ']', (size_t)(end - begin)) : NULL;
    if (close != NULL) {
        luminaire_clean(begin + 1, close, key, sizeof key);
        begin = close + 1;
    }
    if (l->n_words == LUMINAIRE_WORDS_MOST) return LAM_OK; /* the word that it belongs to may be left out */
    if (strcasecmp(key, "MORE") != 0 || l->n_words == 0)
        return luminaire_add_word(l, capacity, key, begin, end, error);
    char *text = l->words[l->n_words - 1].text;
    const size_t used = strlen(text);
    /* Cut to fit, at the end of a character. */
    luminaire_clean(begin, end, more, used + 2 < LUMINAIRE_TEXT ? LUMINAIRE_TEXT - used - 1 : 1);
    if (more[0] != '\0') snprintf(text + used, LUMINAIRE_TEXT - used, "%s%s", used > 0 ? " " : "", more);
    return LAM_OK;
}

/* Reads up to and with the line TILT=, whose value is *tilt to *tilt_end. */
static lam_status read_head(const luminaire_source *s, luminaire *l, const char **at, const char **tilt,
                            const char **tilt_end, lam_error *error) {
    lam_status status = LAM_OK;
    size_t capacity = 0;
    unsigned year = 0;
    for (size_t k = 0; luminaire_source_line(s, at, tilt, tilt_end); k++) {
        const char *begin = *tilt, *end = *tilt_end;
        if (lm63_is_tilt_line(tilt, tilt_end)) goto done;
        if (k == 0) {
            year = year_of(begin, end);
            l->format = format_of_year(year);
            if (year != 0 && year != 1986 && year != 1991 && year != 1995 && year != 2002 && year != 2019)
                luminaire_warn(l, "its version is of %u; it is read as %s", year,
                               luminaire_format_name(l->format));
        }
        if (k > 0 || year == 0) TRY(read_words(l, &capacity, begin, end, error));
    }
    status = status_fail(error, LAM_ERR_FORMAT,
                         "%s: has no line TILT=, behind which the numbers of an IES LM-63 stand", s->name);
done:
    return status;
}

/* Geometry, number, angles and factors. */
static lam_status read_tilt_table(number_stream *n, luminaire_tilt *tilt, lam_error *error) {
    lam_status status = LAM_OK;
    const number_field
        geometry = {.what = "lamp to luminaire geometry of TILT", .least = 1, .most = 3, .whole = true},
        count = {.what = "number of tilt angles", .least = 1, .most = LUMINAIRE_BYTES_MOST, .whole = true},
        angle = {.what = "tilt angle", .least = 0, .most = 180},
        factor = {.what = "tilt factor", .least = 0, .most = 1000};
    double value = 0;
    TRY(read_number(n, &geometry, &value, error));
    tilt->geometry = (int)value;
    TRY(read_number(n, &count, &value, error));
    if (value > (double)(bytes_left(n) / 2 + 1))
        TRY(wrong(n, count.what, "more than the rest of the file can hold", error));
    const size_t most = (size_t)value;
    tilt->angles = memory_allocate(most, sizeof *tilt->angles, n->s->name, error);
    tilt->factors = memory_allocate(most, sizeof *tilt->factors, n->s->name, error);
    if (tilt->angles == NULL || tilt->factors == NULL) TRY(LAM_ERR_MEMORY);
    TRY(read_angles(n, &angle, most, tilt->angles, error));
    for (size_t k = 0; k < most; k++) TRY(read_number(n, &factor, &tilt->factors[k], error));
    tilt->n = most;
done:
    return status;
}

/* A file of TILT holds what TILT=INCLUDE has behind it. */
static lam_status read_tilt_file(const luminaire_source *s, const char *assets, const char *file,
                                 luminaire_tilt *tilt, lam_error *error) {
    lam_status status = LAM_OK;
    char path[ASSET_PATH], shown[64], *text = NULL;
    size_t length = 0;
    struct stat about;
    luminaire_source own;
    const size_t line = luminaire_source_place(s, s->end, NULL);
    luminaire_clean(file, file + strlen(file), shown, sizeof shown);
    const asset_place place = asset_find(s->name, assets, file, path);
    if (place == ASSET_SEVERAL)
        FAIL(error, LAM_ERR_FORMAT, "%s: line %zu: TILT=%s may be either of %s", s->name, line, shown, path);
    if (place != ASSET_FOUND)
        FAIL(error, LAM_ERR_FORMAT, "%s: line %zu: TILT=%s %s", s->name, line, shown,
             place == ASSET_OUTSIDE
                 ? "lies outside of the file's folder; --assets with its folder lets it be read"
                 : "is not there: put it beside the file, or name its folder by --assets");
    if (stat(path, &about) != 0 || !S_ISREG(about.st_mode) || about.st_size > (off_t)LUMINAIRE_BYTES_MOST)
        FAIL(error, LAM_ERR_FORMAT, "%s: line %zu: TILT=%s is not a file of at most %zu MiB", s->name, line,
             shown, LUMINAIRE_BYTES_MOST >> 20);
    TRY(file_text(path, &text, &length, error));
    TRY(luminaire_source_open(path, text, length, &own, error));
    number_stream n = {.s = &own, .at = own.text};
    TRY(read_tilt_table(&n, tilt, error));
    if (luminaire_source_word(&own, &n.at, &n.word, &n.word_end))
        TRY(wrong(&n, "a word behind the last tilt factor", "must be the end of the file", error));
done:
    free(text);
    return status;
}

static lam_status read_tilt(number_stream *n, const char *begin, const char *end,
                            const luminaire_options *options, luminaire *l, lam_error *error) {
    char file[ASSET_PATH], shown[64];
    const size_t length = (size_t)(end - begin);
    if (length == 0 || (length == 4 && strncasecmp(begin, "NONE", 4) == 0)) return LAM_OK;
    if (length == 7 && strncasecmp(begin, "INCLUDE", 7) == 0) return read_tilt_table(n, &l->tilt, error);
    luminaire_source head = *n->s; /* whose end is the line of TILT */
    head.end = end;
    snprintf(file, sizeof file, "%.*s", (int)(length < sizeof file ? length : sizeof file - 1), begin);
    luminaire_clean(begin, end, shown, sizeof shown);
    if (l->format == LM63_2019)
        return status_fail(error, LAM_ERR_FORMAT,
                           "%s: line %zu: TILT=%s, must be NONE or INCLUDE in LM-63-2019", n->s->name,
                           luminaire_source_place(&head, end, NULL), shown);
    return read_tilt_file(&head, options->assets, file, &l->tilt, error);
}

/* The ten numbers after the tilt, in their order. */
enum { LAMPS, LUMENS, MULTIPLIER, VERTICALS, HORIZONTALS, TYPE, UNITS, WIDTH, LENGTH, HEIGHT, FIELDS };

/* Reads lamps, counts, opening and factors; *factor is that of all values, v has the ten numbers. */
static lam_status read_description(number_stream *n, luminaire *l, double v[FIELDS], double *factor,
                                   lam_error *error) {
    lam_status status = LAM_OK;
    const bool counts = l->format <= LM63_1991;
    const double any = LUMINAIRE_CANDELA_MOST, size = LUMINAIRE_LENGTH_MOST, most = 1e15;
    static const char dark[] = "must be above 0; at 0 the luminaire is dark";
    const number_field fields[FIELDS] = {
        [LAMPS] = {.what = "number of lamps", .least = -any, .most = any},
        [LUMENS] = {.what = "lumens per lamp", .least = -any, .most = any},
        [MULTIPLIER] = {.what = "candela multiplier", .least = 0, .most = any, .above = true, .limit = dark},
        [VERTICALS] = {.what = "number of vertical angles", .least = 2, .most = most, .whole = true},
        [HORIZONTALS] = {.what = "number of horizontal angles", .least = 1, .most = most, .whole = true},
        [TYPE] = {.what = "photometric type",
                  .least = 1,
                  .most = 3,
                  .whole = true,
                  .limit = "must be 1 (C), 2 (B) or 3 (A)"},
        [UNITS] = {.what = "type of units",
                   .least = 1,
                   .most = 2,
                   .whole = true,
                   .limit = "must be 1 (feet) or 2 (metres)"},
        [WIDTH] = {.what = "width", .least = -size, .most = size},
        [LENGTH] = {.what = "length", .least = -size, .most = size},
        [HEIGHT] = {.what = "height", .least = -size, .most = size}};
    const number_field ballast = {.what = "ballast factor",
                                  .least = 0,
                                  .most = any,
                                  .above = true,
                                  .limit = dark},
                       second = {counts                   ? "ballast-lamp photometric factor"
                                 : l->format == LM63_2019 ? "file generation type"
                                                          : "number after the ballast factor",
                                 counts ? 0 : -any, any, .above = counts},
                       watts = {.what = "input watts", .least = -any, .most = any};
    double own = 1, other = 1;
    for (int k = 0; k < FIELDS; k++) {
        TRY(read_number(n, &fields[k], &v[k], error));
        if ((k == VERTICALS || k == HORIZONTALS) && v[k] > (double)(bytes_left(n) / 2 + 1))
            TRY(wrong(n, fields[k].what, "more than the rest of the file can hold", error));
    }
    TRY(read_number(n, &ballast, &own, error));
    TRY(read_number(n, &second, &other, error));
    if (l->format > LM63_1991 && l->format < LM63_2019 && other != 1)
        luminaire_warn(l, "the number after the ballast factor is %.10g; %s reserves it, and it is not used",
                       other, luminaire_format_name(l->format));
    TRY(read_number(n, &watts, &l->sets[0].watts, error));
    *factor = v[MULTIPLIER] * own * (counts ? other : 1);
    const double stated[3] = {v[WIDTH], v[LENGTH], v[HEIGHT]};
    if (!lm63_opening(l->format, stated, v[UNITS] == 1 ? feet : 1, &l->opening))
        luminaire_warn(l,
                       "no shape of %s has width %.6g, length %.6g and height %.6g; its opening is a point",
                       luminaire_format_name(l->format), v[WIDTH], v[LENGTH], v[HEIGHT]);
    static const luminaire_type types[3] = {LUMINAIRE_C, LUMINAIRE_B, LUMINAIRE_A};
    l->type = types[(int)v[TYPE] - 1];
    l->absolute = v[LUMENS] < 0;
    l->sets[0].number = v[LAMPS];
    l->sets[0].lumens = l->absolute ? NAN : v[LAMPS] * v[LUMENS];
done:
    return status;
}

/* Finds the symmetry of planes of type C; *closes: the plane 360 is missing, and is the first one. The word
 * that was read last is the last plane. */
static lam_status find_symmetry(const number_stream *n, luminaire *l, bool *closes, lam_error *error) {
    lam_status status = LAM_OK;
    const double first = l->planes[0], last = l->planes[l->n_planes - 1];
    *closes = false;
    l->symmetry = l->n_planes == 1             ? SYMMETRY_ROTATIONAL
                  : first == 90 && last == 270 ? SYMMETRY_C90_C270
                  : first != 0                 ? SYMMETRY_NONE
                  : last == 90                 ? SYMMETRY_QUADRANT
                  : last == 180                ? SYMMETRY_C0_C180
                                               : SYMMETRY_NONE;
    if (l->symmetry != SYMMETRY_NONE || (first == 0 && last == 360)) goto done;
    if (first != 0 && first != 90) {
        const number_stream begin = {.s = n->s, .word = n->first_angle, .word_end = n->first_end};
        TRY(wrong(&begin, "the first horizontal angle", "must be 0, or 90 where the last is 270", error));
    }
    const double step = last - l->planes[l->n_planes - 2];
    *closes = first == 0 && fabs(last + step - 360) < 1e-6 * 360;
    if (*closes) goto done;
    TRY(wrong(n, "the last horizontal angle",
              first == 90 ? "must be 270 where the first is 90"
                          : "must be 90, 180, 360, or one step below 360",
              error));
done:
    return status;
}

/* Planes through a horizontal axis, or angles in them, that begin at 0 are mirrored. */
static lam_status find_mirrors(const number_stream *n, luminaire *l, lam_error *error) {
    lam_status status = LAM_OK;
    const double V = l->angles[0], H = l->planes[0];
    if (l->n_planes < 2)
        FAIL(error, LAM_ERR_FORMAT, "%s: 1 horizontal angle, type %s needs at least 2", n->s->name,
             luminaire_type_name(l->type));
    if (V > 0 || H > 0)
        FAIL(error, LAM_ERR_FORMAT, "%s: the %s angles of type %s begin at %.10g, must begin at 0 or below",
             n->s->name, V > 0 ? "vertical" : "horizontal", luminaire_type_name(l->type), V > 0 ? V : H);
    l->symmetry = V == 0 && H == 0 ? SYMMETRY_QUADRANT
                  : V == 0         ? SYMMETRY_C90_C270
                  : H == 0         ? SYMMETRY_C0_C180
                                   : SYMMETRY_NONE;
done:
    return status;
}

static lam_status read_candela(number_stream *n, luminaire *l, double factor, lam_error *error) {
    lam_status status = LAM_OK;
    const number_field value = {.what = "candela value", .least = 0, .most = LUMINAIRE_CANDELA_MOST};
    char left_over[96];
    const size_t count = l->n_planes * l->n_angles;
    for (size_t k = 0; k < count; k++) {
        if (bytes_left(n) == 0)
            FAIL(error, LAM_ERR_FORMAT, "%s: ends at line %zu, after %zu of %zu candela values (%zu by %zu)",
                 n->s->name, luminaire_source_place(n->s, n->s->end, NULL), k, count, l->n_planes,
                 l->n_angles);
        TRY(read_number(n, &value, &l->candela[k], error));
        l->candela[k] = fabs(l->candela[k]) * factor; /* -0 is 0 */
        if (!(l->candela[k] <= LUMINAIRE_CANDELA_MOST))
            TRY(wrong(n, value.what, "too large with the factors of the file", error));
    }
    if (luminaire_source_word(n->s, &n->at, &n->word, &n->word_end)) {
        snprintf(left_over, sizeof left_over, "must not be there: the table has %zu by %zu values",
                 l->n_planes, l->n_angles);
        TRY(wrong(n, "a word after the last candela value", left_over, error));
    }
done:
    return status;
}

static lam_status read_table(number_stream *n, luminaire *l, const double v[FIELDS], double factor,
                             lam_error *error) {
    lam_status status = LAM_OK;
    const bool polar = l->type == LUMINAIRE_C;
    const number_field vertical = {.what = "vertical angle",
                                   .least = polar ? 0 : -90,
                                   .most = polar ? 180 : 90},
                       horizontal = {
                           .what = "horizontal angle", .least = polar ? 0 : -90, .most = polar ? 360 : 90};
    const size_t n_angles = (size_t)v[VERTICALS], n_planes = (size_t)v[HORIZONTALS];
    bool closes = false;
    if (v[VERTICALS] * v[HORIZONTALS] > (double)(bytes_left(n) / 2 + 1)) {
        const size_t words = words_left(*n), angles = n_angles + n_planes;
        FAIL(error, LAM_ERR_FORMAT,
             "%s: ends at line %zu, after %zu of %.10g candela values (%zu by %zu, as the numbers before "
             "line %zu say)",
             n->s->name, luminaire_source_place(n->s, n->s->end, NULL), words > angles ? words - angles : 0,
             v[VERTICALS] * v[HORIZONTALS], n_planes, n_angles,
             luminaire_source_place(n->s, n->at, NULL) + 1);
    }
    TRY(luminaire_allocate_table(l, n->s->name, n_planes, n_angles, error));
    TRY(read_angles(n, &vertical, n_angles, l->angles, error));
    TRY(read_angles(n, &horizontal, n_planes, l->planes, error));
    TRY(polar ? find_symmetry(n, l, &closes, error) : find_mirrors(n, l, error));
    TRY(read_candela(n, l, factor, error));
    if (closes) luminaire_close_turn(l);
done:
    return status;
}

/* The texts that state lamps and their colour, of which no version fixes all. */
static void describe_lamps(luminaire *l) {
    luminaire_lamps *set = &l->sets[0];
    const struct {
        const char *keys[5];
        char *out;
    } texts[] = {{{"LAMP", "LAMPCAT", "LAMPTYPE"}, set->type},
                 {{"CCT", "COLORTEMP", "COLOR", "COLOUR", "LAMPCOLOR"}, set->colour},
                 {{"CRI"}, set->rendering}};
    for (size_t k = 0; k < sizeof texts / sizeof *texts; k++)
        for (int j = 0; j < 5 && texts[k].keys[j] != NULL && texts[k].out[0] == '\0'; j++)
            snprintf(texts[k].out, LUMINAIRE_TEXT, "%s", luminaire_find_word(l, texts[k].keys[j]));
}

/* Asks for the decimal mark where a comma between two digits may be one. */
static void ask_for_decimal_mark(const luminaire_source *s, const char *at, lam_error *error) {
    if (error == NULL) return;
    const size_t used = strlen(error->message);
    for (const char *c = at; (c = memchr(c, ',', (size_t)(s->end - c))) != NULL; c++)
        if (c > at && c + 1 < s->end && isdigit((unsigned char)c[-1]) && isdigit((unsigned char)c[1])) {
            snprintf(error->message + used, sizeof error->message - used,
                     "; commas separate numbers, is one of them a decimal mark?");
            return;
        }
}

lam_status lm63_read(const luminaire_source *s, const luminaire_options *options, luminaire *l,
                     lam_error *error) {
    lam_status status = LAM_OK;
    number_stream n = {.s = s, .at = s->text};
    const char *tilt = NULL, *tilt_end = NULL, *numbers = NULL;
    double v[FIELDS] = {0}, factor = 1;
    if (options->set > 1)
        FAIL(error, LAM_ERR_ARGUMENT, "%s: --set %zu: an IES LM-63 has one lamp set", s->name, options->set);
    l->sets = memory_allocate(1, sizeof *l->sets, s->name, error);
    if (l->sets == NULL) TRY(LAM_ERR_MEMORY);
    l->n_sets = 1;
    TRY(read_head(s, l, &n.at, &tilt, &tilt_end, error));
    describe_lamps(l);
    TRY(read_tilt(&n, tilt, tilt_end, options, l, error));
    numbers = n.at;
    TRY(read_description(&n, l, v, &factor, error));
    TRY(read_table(&n, l, v, factor, error));
done:
    if (status == LAM_ERR_FORMAT && numbers != NULL) ask_for_decimal_mark(s, numbers, error);
    return status;
}
