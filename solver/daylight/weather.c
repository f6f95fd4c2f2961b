/* EPW and WEA files are read line by line, and each field is checked against its range (EnergyPlus,
 * "EnergyPlus Weather File (EPW) Data Dictionary"; Radiance, gendaymtx(1)). The header of a WEA gives
 * longitude = -value and time zone = -value / 15. The step and the gaps are those of weather_times.h, missing
 * values those of weather_mend.h. */
#include "solver/daylight/weather_mend.h"

#include <ctype.h>
#include <errno.h>
#include <float.h>
#include <limits.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

/* RADIATION_MOST exceeds the solar constant: a sensor under broken clouds can briefly show more than that. */
#define RADIATION_MOST 3000
#define MISSING_RADIATION 9999
#define MISSING_DEW_POINT 99.9
/* By night a pyranometer is colder above than below, and shows up to this much less than nothing. */
#define OFFSET_MOST 10

/* A text file by lines. */
typedef struct reader {
    const char *path;
    FILE *stream;
    char *line; /* without its end */
    size_t room, number;
} reader;

void weather_free(weather *w) {
    free(w->hours);
    *w = (weather){0};
}

static bool ends_in(const char *path, const char *extension) {
    const size_t length = strlen(path), tail = strlen(extension);
    return length > tail && strcasecmp(path + length - tail, extension) == 0;
}

bool weather_is_named(const char *path) {
    return ends_in(path, ".epw") || ends_in(path, ".wea");
}

static void reader_close(reader *r) {
    free(r->line);
    if (r->stream != NULL) fclose(r->stream);
}

static lam_status reader_open(reader *r, const char *text, size_t length, lam_error *error) {
    lam_status status = LAM_OK;
    struct stat about;
    if (text != NULL) {
        /* The stream only reads, and is opened for nothing else. */
        r->stream = fmemopen((void *)(uintptr_t)text, length, "rb");
        if (r->stream == NULL) FAIL(error, LAM_ERR_FORMAT, "%s: %s", r->path, strerror(errno));
        goto done;
    }
    r->stream = fopen(r->path, "rb");
    if (r->stream == NULL || fstat(fileno(r->stream), &about) != 0)
        FAIL(error, LAM_ERR_IO, "%s: %s", r->path, strerror(errno));
    if (!S_ISREG(about.st_mode)) FAIL(error, LAM_ERR_IO, "%s: not a file", r->path);
done:
    return status;
}

/* Reads the next line, without trailing blanks; *more is false at the end of the file. */
static lam_status reader_next(reader *r, bool *more, lam_error *error) {
    lam_status status = LAM_OK;
    errno = 0;
    const ssize_t length = getline(&r->line, &r->room, r->stream);
    *more = length >= 0;
    if (length < 0) {
        if (ferror(r->stream)) FAIL(error, LAM_ERR_IO, "%s: %s", r->path, strerror(errno));
        if (!feof(r->stream)) FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory for a line", r->path);
        goto done;
    }
    r->number++;
    if (strlen(r->line) != (size_t)length)
        FAIL(error, LAM_ERR_FORMAT, "%s: line %zu holds a zero byte; not a text file", r->path, r->number);
    for (size_t end = (size_t)length; end > 0 && isspace((unsigned char)r->line[end - 1]);)
        r->line[--end] = '\0';
done:
    return status;
}

/* Reads the next line, an error where the file ends; the error names the line by `what`. */
static lam_status reader_need(reader *r, const char *what, lam_error *error) {
    bool more = false;
    const lam_status status = reader_next(r, &more, error);
    if (status != LAM_OK || more) return status;
    return status_fail(error, LAM_ERR_FORMAT, "%s: ends at line %zu, before its line %s", r->path, r->number,
                       what);
}

/* Allocates as many hours as there are lines left. */
static lam_status allocate_hours(reader *r, weather *w, weather_row **rows, lam_error *error) {
    size_t lines = 1;
    const long here = ftell(r->stream);
    for (int c; (c = getc(r->stream)) != EOF;) lines += c == '\n';
    if (here < 0 || ferror(r->stream) || fseek(r->stream, here, SEEK_SET) != 0)
        return status_fail(error, LAM_ERR_IO, "%s: cannot be read: %s", r->path, strerror(errno));
    w->hours = memory_allocate(lines, sizeof *w->hours, r->path, error);
    *rows = memory_allocate(lines, sizeof **rows, r->path, error);
    return w->hours == NULL || *rows == NULL ? LAM_ERR_MEMORY : LAM_OK;
}

/* Reads a field as a finite number from low to high; blanks around it are ignored. */
static lam_status read_number(const reader *r, const char *what, const char *text, double low, double high,
                              double *out, lam_error *error) {
    lam_status status = LAM_OK;
    char *end = NULL;
    while (*text == ' ' || *text == '\t') text++;
    /* strtod reads "inf", "nan" and hexadecimal too. */
    const double value = strtod(text, &end);
    const size_t digits = strspn(text, "+-.0123456789eE");
    while (*end == ' ' || *end == '\t') end++;
    if (digits == 0 || *end != '\0' || strspn(text + digits, " \t") != strlen(text + digits))
        FAIL(error, LAM_ERR_FORMAT, "%s: line %zu: %s is \"%.40s\", must be a number from %g to %g", r->path,
             r->number, what, text, low, high);
    if (!(value >= low && value <= high))
        FAIL(error, LAM_ERR_FORMAT, "%s: line %zu: %s = %.10g, must be from %g to %g", r->path, r->number,
             what, value, low, high);
    *out = value;
done:
    return status;
}

static lam_status read_whole(const reader *r, const char *what, const char *text, int low, int high, int *out,
                             lam_error *error) {
    lam_status status = LAM_OK;
    double value = 0;
    TRY(read_number(r, what, text, low, high, &value, error));
    if (value != floor(value))
        FAIL(error, LAM_ERR_FORMAT, "%s: line %zu: %s = %g, must be a whole number from %d to %d", r->path,
             r->number, what, value, low, high);
    *out = (int)value;
done:
    return status;
}

/* True for the numbers by which files mark what is missing. */
static bool marks_missing(double value) {
    return value >= MISSING_RADIATION || value == -999 || value == -9999;
}

/* Reads a radiation: NAN where it is missing, 0 where it is an offset below 0. */
static lam_status read_radiation(const reader *r, const char *what, const char *text, weather_mended *mended,
                                 double *out, lam_error *error) {
    lam_status status = LAM_OK;
    double value = 0;
    if (read_number(r, what, text, -MISSING_RADIATION, DBL_MAX, &value, NULL) == LAM_OK) {
        if (marks_missing(value)) {
            *out = NAN;
            goto done;
        }
        if (value < 0 && value >= -OFFSET_MOST) {
            mended->below++;
            *out = 0;
            goto done;
        }
    }
    TRY(read_number(r, what, text, 0, RADIATION_MOST, out, error));
done:
    return status;
}

static const int days[12] = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};

static bool is_leap(int year) {
    return (year % 4 == 0 && year % 100 != 0) || year % 400 == 0;
}

static lam_status read_date(const reader *r, const char *month, const char *day, weather_hour *h,
                            lam_error *error) {
    lam_status status = LAM_OK;
    TRY(read_whole(r, "month", month, 1, 12, &h->month, error));
    const int most = days[h->month - 1] + (h->month == 2 && is_leap(h->year));
    TRY(read_whole(r, "day", day, 1, most, &h->day, error));
done:
    return status;
}

/* Splits text at a mark into at most `most` fields; returns how many. */
static size_t cut(char *text, char mark, const char **fields, size_t most) {
    size_t n = 0;
    for (char *at = text; at != NULL && n < most; n++) {
        fields[n] = at;
        at = strchr(at, mark);
        if (at != NULL) *at++ = '\0';
    }
    return n;
}

/* The columns of an EPW that are read, from 0. */
enum { YEAR, MONTH, DAY, HOUR, MINUTE, DEW_POINT = 7, DIRECT = 14, DIFFUSE = 15, ROW_FIELDS };

/* The hour is its beginning. */
static lam_status read_epw_row(reader *r, weather_mended *mended, weather_hour *h, weather_row *row,
                               lam_error *error) {
    lam_status status = LAM_OK;
    const char *fields[ROW_FIELDS];
    int hour = 0, minute = 0;
    const size_t n = cut(r->line, ',', fields, ROW_FIELDS);
    if (n < ROW_FIELDS)
        FAIL(error, LAM_ERR_FORMAT, "%s: line %zu has %zu fields between commas, needs at least %d", r->path,
             r->number, n, ROW_FIELDS);
    TRY(read_whole(r, "year (field 1)", fields[YEAR], 1900, 2100, &h->year, error));
    TRY(read_date(r, fields[MONTH], fields[DAY], h, error));
    TRY(read_whole(r, "hour (field 4)", fields[HOUR], 1, 24, &hour, error));
    h->hour = hour - 1;
    /* It matters only where an hour has several rows. */
    const bool sound = read_whole(r, "minute (field 5)", fields[MINUTE], 0, 60, &minute, NULL) == LAM_OK;
    row->minute = sound ? minute : NAN;
    TRY(read_number(r, "dew point (field 8)", fields[DEW_POINT], -MISSING_RADIATION, DBL_MAX, &h->dew_point,
                    error));
    if (h->dew_point >= MISSING_DEW_POINT || h->dew_point < -MISSING_DEW_POINT) {
        mended->no_dew++;
        h->dew_point = NAN;
    }
    TRY(read_radiation(r, WEATHER_EPW_DIRECT, fields[DIRECT], mended, &h->direct, error));
    TRY(read_radiation(r, WEATHER_EPW_DIFFUSE, fields[DIFFUSE], mended, &h->diffuse, error));
done:
    return status;
}

/* Reads a date of the header: month/day, month/day/year, or the number of a day of 365. */
static lam_status read_stated_date(const reader *r, size_t field, const char *text, weather_date *out,
                                   lam_error *error) {
    lam_status status = LAM_OK;
    weather_date d = {.year = 0};
    int end = 0, number = 0;
    if (sscanf(text, " %4d / %2d / %4d %n", &d.month, &d.day, &d.year, &end) != 3 || text[end] != '\0') {
        d.year = end = 0;
        if (sscanf(text, " %2d / %2d %n", &d.month, &d.day, &end) != 2 || text[end] != '\0') end = 0;
    }
    if (end == 0 && sscanf(text, " %3d %n", &number, &end) == 1 && text[end] == '\0' && number >= 1 &&
        number <= 366) {
        d = (weather_date){.month = 1, .day = number < 366 ? number : 365};
        for (; d.day > days[d.month - 1]; d.month++) d.day -= days[d.month - 1];
    }
    if (d.month < 1 || d.month > 12 || d.day < 1 || d.day > days[d.month - 1] + (d.month == 2))
        FAIL(error, LAM_ERR_FORMAT,
             "%s: line %zu: date of a data period (field %zu) is \"%.40s\", must be "
             "MONTH/DAY",
             r->path, r->number, field + 1, text);
    /* A year of two digits says nothing. */
    if (d.year < 1900) d.year = 0;
    *out = d;
done:
    return status;
}

/* Reads the line DATA PERIODS: number of periods, records an hour, and of each period name, day of the week,
 * first and last day. */
static lam_status read_data_periods(const reader *r, size_t n, const char *const *fields, weather_stated *out,
                                    lam_error *error) {
    lam_status status = LAM_OK;
    int periods = 0, steps = 0;
    weather_stated s = {.line = r->number};
    TRY(read_whole(r, "data periods (field 2)", fields[1], 1, WEATHER_PERIODS, &periods, error));
    TRY(read_whole(r, "records an hour (field 3)", fields[2], 1, 60, &steps, error));
    for (size_t at = 5; s.n < (size_t)periods && at + 1 < n; at += 4) {
        if (fields[at][strspn(fields[at], " \t")] == '\0') break;
        TRY(read_stated_date(r, at, fields[at], &s.from[s.n], error));
        TRY(read_stated_date(r, at + 1, fields[at + 1], &s.to[s.n], error));
        s.n++;
    }
    s.per_hour = (size_t)steps;
    *out = s;
done:
    return status;
}

/* The line that was read, of the first one without a byte order mark. */
static char *line_of(const reader *r) {
    return r->line + (r->number == 1 && strncmp(r->line, "\xEF\xBB\xBF", 3) == 0 ? 3 : 0);
}

static lam_status read_epw_header(reader *r, weather *w, weather_stated *stated, lam_error *error) {
    lam_status status = LAM_OK;
    static const char *const names[8] = {"LOCATION",
                                         "DESIGN CONDITIONS",
                                         "TYPICAL/EXTREME PERIODS",
                                         "GROUND TEMPERATURES",
                                         "HOLIDAYS/DAYLIGHT SAVINGS",
                                         "COMMENTS 1",
                                         "COMMENTS 2",
                                         "DATA PERIODS"};
    enum { FIELDS = 3 + 4 * WEATHER_PERIODS };
    const char *fields[FIELDS];
    for (int k = 0; k < 8; k++) {
        TRY(reader_need(r, names[k], error));
        char *line = line_of(r);
        const size_t n = cut(line, ',', fields, FIELDS);
        if (n == 0 || strcasecmp(fields[0], names[k]) != 0)
            FAIL(error, LAM_ERR_FORMAT, "%s: line %zu begins with \"%.40s\", an EPW has %s there", r->path,
                 r->number, line, names[k]);
        if (k != 0 && k != 7) continue;
        if (n < (k == 0 ? 10 : 3))
            FAIL(error, LAM_ERR_FORMAT, "%s: line %zu: %s has %zu fields, needs %d", r->path, r->number,
                 names[k], n, k == 0 ? 10 : 3);
        if (k == 7) {
            TRY(read_data_periods(r, n, fields, stated, error));
            continue;
        }
        snprintf(w->place, sizeof w->place, "%s", fields[1]);
        TRY(read_number(r, "latitude (field 7)", fields[6], -90, 90, &w->latitude, error));
        TRY(read_number(r, "longitude (field 8)", fields[7], -180, 180, &w->longitude, error));
        TRY(read_number(r, "time zone (field 9)", fields[8], -14, 14, &w->time_zone, error));
        TRY(read_number(r, "elevation (field 10)", fields[9], -1000, 9999.9, &w->elevation, error));
    }
    w->stated_steps = stated->per_hour;
done:
    return status;
}

static lam_status read_wea_row(reader *r, weather_mended *mended, bool *leap, weather_hour *h,
                               lam_error *error) {
    lam_status status = LAM_OK;
    const char *fields[6];
    size_t n = 0;
    char *rest = NULL;
    for (char *word = strtok_r(r->line, " \t", &rest); word != NULL && n < 6;
         word = strtok_r(NULL, " \t", &rest))
        fields[n++] = word;
    if (n != 5)
        FAIL(error, LAM_ERR_FORMAT,
             "%s: line %zu must hold five numbers: month day hour direct-normal diffuse-horizontal", r->path,
             r->number);
    h->year = 2000;
    TRY(read_date(r, fields[0], fields[1], h, error));
    *leap = *leap || (h->month == 2 && h->day == 29);
    TRY(read_number(r, "hour", fields[2], 0, 24, &h->hour, error));
    TRY(read_radiation(r, WEATHER_WEA_DIRECT, fields[3], mended, &h->direct, error));
    TRY(read_radiation(r, WEATHER_WEA_DIFFUSE, fields[4], mended, &h->diffuse, error));
    h->dew_point = NAN;
done:
    return status;
}

/* In a WEA western longitudes are positive, and the time zone is given as a meridian. */
static lam_status read_wea_header(reader *r, weather *w, lam_error *error) {
    lam_status status = LAM_OK;
    static const struct {
        const char *name;
        double low, high;
    } lines[6] = {{"place", 0, 0},
                  {"latitude", -90, 90},
                  {"longitude", -180, 180},
                  {"time_zone", -210, 210},
                  {"site_elevation", -1000, 9999.9},
                  {"weather_data_file_units", 1, 2}};
    double values[6] = {0};
    for (int k = 0; k < 6; k++) {
        TRY(reader_need(r, lines[k].name, error));
        const size_t length = strlen(lines[k].name);
        const char *line = line_of(r);
        if (strncmp(line, lines[k].name, length) != 0 ||
            (line[length] != ' ' && line[length] != '\t' && line[length] != '\0'))
            FAIL(error, LAM_ERR_FORMAT, "%s: line %zu begins with \"%.40s\", a WEA has %s there", r->path,
                 r->number, line, lines[k].name);
        const char *value = line + length;
        while (*value == ' ' || *value == '\t') value++;
        if (k == 0)
            snprintf(w->place, sizeof w->place, "%s", value);
        else
            TRY(read_number(r, lines[k].name, value, lines[k].low, lines[k].high, &values[k], error));
    }
    if (values[5] != 1 && values[5] != 2)
        FAIL(error, LAM_ERR_FORMAT,
             "%s: line %zu: %s = %g, must be 1 (direct light facing the sun) or 2 (on a horizontal plane)",
             r->path, r->number, lines[5].name, values[5]);
    w->latitude = values[1];
    w->longitude = values[2] == 0 ? 0 : -values[2];
    w->time_zone = values[3] == 0 ? 0 : -values[3] / 15;
    w->elevation = values[4];
    w->direct_is_horizontal = values[5] == 2;
done:
    return status;
}

/* Reads all rows; *rows has as many. */
static lam_status read_rows(reader *r, bool epw, weather *w, weather_row **rows, lam_error *error) {
    lam_status status = LAM_OK;
    bool more = true, leap = false;
    TRY(allocate_hours(r, w, rows, error));
    for (;;) {
        TRY(reader_next(r, &more, error));
        if (!more) break;
        if (r->line[0] == '\0') continue;
        (*rows)[w->n].line = r->number;
        TRY(epw ? read_epw_row(r, &w->mended, &w->hours[w->n], &(*rows)[w->n], error)
                : read_wea_row(r, &w->mended, &leap, &w->hours[w->n], error));
        w->n++;
    }
    if (w->n == 0)
        FAIL(error, LAM_ERR_FORMAT, "%s: no hours after its header of %d lines", r->path, epw ? 8 : 6);
    for (size_t i = 0; i < w->n && !epw; i++) w->hours[i].year = leap ? 2000 : 2001;
done:
    return status;
}

/* Reads the text, or the file where that is NULL. */
static lam_status read_either(const char *path, const char *text, size_t length, weather_gaps gaps,
                              weather *out, lam_error *error) {
    lam_status status = LAM_OK;
    reader r = {.path = path};
    weather w = {0};
    weather_row *rows = NULL;
    weather_stated stated = {0};
    const bool epw = ends_in(path, ".epw");
    TRY(reader_open(&r, text, length, error));
    TRY(epw ? read_epw_header(&r, &w, &stated, error) : read_wea_header(&r, &w, error));
    TRY(read_rows(&r, epw, &w, &rows, error));
    weather_times times = {.path = path, .rows = rows, .stated = epw ? &stated : NULL, .w = &w};
    TRY(weather_find_step(&times, error));
    TRY(weather_mend(&times, gaps, &rows, error));
    *out = w;
    w = (weather){0};
done:
    weather_free(&w);
    free(rows);
    reader_close(&r);
    return status;
}

lam_status weather_read(const char *path, weather_gaps gaps, weather *out, lam_error *error) {
    return read_either(path, NULL, 0, gaps, out, error);
}

lam_status weather_read_text(const char *name, const char *text, size_t length, weather_gaps gaps,
                             weather *out, lam_error *error) {
    return read_either(name, text, length, gaps, out, error);
}
