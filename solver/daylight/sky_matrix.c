#include "solver/daylight/sky_matrix.h"

#include <errno.h>
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

#define MAGIC "#?RADIANCE"
#define PER_SPLIT 144 /* patches of Reinhart's sky: 144 MF^2, the zenith and, here, the ground */
#define HEADER_LINES 1000

enum { ASCII, FLOAT, DOUBLE };

/* An open file and its header. */
typedef struct reader {
    const char *path;
    FILE *stream;
    uint64_t size;
    size_t rows, columns, components; /* 0: not read yet */
    int format;                       /* -1: not read yet */
    bool big_endian;
} reader;

void sky_matrix_free(sky_matrix *m) {
    free(m->L);
    sky_tiling_free(&m->tiling);
    *m = (sky_matrix){0};
}

bool sky_matrix_is_named(const char *path) {
    const size_t length = strlen(path);
    return length > 4 &&
           (strcasecmp(path + length - 4, ".mtx") == 0 || strcasecmp(path + length - 4, ".smx") == 0);
}

static lam_status reader_open(reader *r, lam_error *error) {
    lam_status status = LAM_OK;
    struct stat about;
    char start[sizeof MAGIC] = "";
    r->stream = fopen(r->path, "rb");
    if (r->stream == NULL || fstat(fileno(r->stream), &about) != 0)
        FAIL(error, LAM_ERR_IO, "%s: %s", r->path, strerror(errno));
    if (!S_ISREG(about.st_mode)) FAIL(error, LAM_ERR_IO, "%s: not a file", r->path);
    r->size = (uint64_t)about.st_size;
    if (fread(start, 1, sizeof MAGIC - 1, r->stream) != sizeof MAGIC - 1 || strcmp(start, MAGIC) != 0)
        FAIL(error, LAM_ERR_FORMAT, "%s: does not begin with " MAGIC "; make it without gendaymtx -h",
             r->path);
    if (fseek(r->stream, 0, SEEK_SET) != 0) FAIL(error, LAM_ERR_IO, "%s: %s", r->path, strerror(errno));
done:
    return status;
}

/* Reads the size in a line KEY=SIZE of the header. */
static lam_status read_size(const reader *r, const char *line, size_t *out, lam_error *error) {
    const char *digits = strchr(line, '=') + 1;
    char *end = NULL;
    while (*digits == ' ') digits++;
    errno = 0;
    const unsigned long long value = strtoull(digits, &end, 10);
    if (*digits < '0' || *digits > '9' || end[strspn(end, " \r\n")] != '\0' || errno != 0 || value == 0)
        return status_fail(error, LAM_ERR_FORMAT, "%s: header has \"%.*s\", needs a whole number above 0",
                           r->path, (int)fmin(40, (double)strcspn(line, "\r\n")), line);
    *out = value;
    return LAM_OK;
}

static bool is_key(const char *line, const char *key) {
    return strncmp(line, key, strlen(key)) == 0;
}

static lam_status read_line(reader *r, const char *line, lam_error *error) {
    lam_status status = LAM_OK;
    static const char *const formats[] = {"ascii", "float", "double"};
    if (is_key(line, "NROWS=")) TRY(read_size(r, line, &r->rows, error));
    if (is_key(line, "NCOLS=")) TRY(read_size(r, line, &r->columns, error));
    if (is_key(line, "NCOMP=")) TRY(read_size(r, line, &r->components, error));
    if (is_key(line, "BigEndian=")) r->big_endian = line[10] == '1';
    if (is_key(line, "FORMAT=")) {
        const char *name = line + 7;
        const size_t length = strcspn(name, " \r\n");
        for (int k = 0; k < 3; k++)
            if (strlen(formats[k]) == length && strncmp(name, formats[k], length) == 0) r->format = k;
        if (r->format < 0)
            FAIL(error, LAM_ERR_FORMAT, "%s: FORMAT=%.*s, must be ascii, float or double", r->path,
                 length < 40 ? (int)length : 40, name);
    }
done:
    return status;
}

static lam_status read_header(reader *r, lam_error *error) {
    lam_status status = LAM_OK;
    char line[4096];
    bool ended = false, begins = true; /* begins: this is the start of a line, not the rest of a long one */
    for (size_t n = 0; !ended && n < HEADER_LINES && fgets(line, sizeof line, r->stream) != NULL; n++) {
        ended = begins && line[strspn(line, "\r")] == '\n';
        if (begins) TRY(read_line(r, line, error));
        begins = strchr(line, '\n') != NULL;
    }
    if (!ended) FAIL(error, LAM_ERR_FORMAT, "%s: no empty line ends its header", r->path);
    if (r->rows == 0 || r->columns == 0 || r->components == 0 || r->format < 0)
        FAIL(error, LAM_ERR_FORMAT, "%s: its header lacks %s", r->path,
             r->rows == 0         ? "NROWS="
             : r->columns == 0    ? "NCOLS="
             : r->components == 0 ? "NCOMP="
                                  : "FORMAT=");
    if (r->components != 1 && r->components != 3)
        FAIL(error, LAM_ERR_FORMAT, "%s: NCOMP=%zu, must be 1 or 3", r->path, r->components);
done:
    return status;
}

/* Chooses the tiling by the number of rows and checks that it is the one asked for. */
static lam_status choose_tiling(const reader *r, const char *tiles, sky_tiling *out, lam_error *error) {
    lam_status status = LAM_OK;
    char name[SKY_NAME] = "tregenza";
    size_t split = 1;
    while (split < SKY_REINHART_MOST && PER_SPLIT * split * split + 2 < r->rows) split++;
    if (PER_SPLIT * split * split + 2 != r->rows)
        FAIL(error, LAM_ERR_FORMAT,
             "%s: %zu rows, must be 146 (ground and tregenza) or 144 MF^2 + 2 (reinhart:MF, MF to %d)",
             r->path, r->rows, SKY_REINHART_MOST);
    if (split > 1) snprintf(name, sizeof name, "reinhart:%u", (unsigned)split);
    const bool same =
        tiles == NULL || strcmp(tiles, name) == 0 || (split == 1 && strcmp(tiles, "reinhart:1") == 0);
    if (!same)
        FAIL(error, LAM_ERR_ARGUMENT, "%s: its %zu rows are those of %s, --tiles asks for %s", r->path,
             r->rows, name, tiles);
    TRY(sky_tiling_create(tiles != NULL ? tiles : name, 'z', out, error));
done:
    return status;
}

/* tile [rows]: the tile of each patch, n_tiles for the ground. All bands have one height, the zenith cap half
 * of it; the first patch of a band is centred on north, the others follow by east. */
static void place_patches(size_t rows, const sky_tiling *s, uint32_t *tile) {
    static const size_t counts[7] = {30, 30, 24, 24, 18, 12, 6};
    const size_t split = (size_t)lround(sqrt((double)(rows - 2) / PER_SPLIT));
    const double height = M_PI / 2 / ((double)(7 * split) + .5);
    size_t patch = 0;
    float direction[3][SKY_PACKET];
    uint32_t found[SKY_PACKET];
    tile[patch++] = (uint32_t)s->n_tiles;
    for (size_t band = 0; band <= 7 * split; band++) {
        const bool zenith = band == 7 * split;
        const size_t count = zenith ? 1 : counts[band / split] * split;
        const double altitude = zenith ? M_PI / 2 : ((double)band + .5) * height;
        for (size_t k = 0; k < count; k++) {
            const double azimuth = 2 * M_PI * (double)k / (double)count;
            const double local[3] = {cos(altitude) * sin(azimuth), cos(altitude) * cos(azimuth),
                                     sin(altitude)};
            for (int d = 0; d < 3; d++)
                for (int i = 0; i < SKY_PACKET; i++) direction[s->axis[d]][i] = s->sign[d] * (float)local[d];
            sky_tiling_find(s, (const float(*)[SKY_PACKET])direction, found);
            tile[patch++] = found[0];
        }
    }
}

static bool is_blank(int c) {
    return c == ' ' || c == '\t' || c == '\n' || c == '\r';
}

/* The first character that is not a blank, or EOF. */
static int skip_blanks(reader *r) {
    int c = getc_unlocked(r->stream);
    while (is_blank(c)) c = getc_unlocked(r->stream);
    return c;
}

/* Reads the next word of a text, which must be a number. */
static bool next_text(reader *r, double *out) {
    char word[64], *end;
    size_t length = 0;
    int c = skip_blanks(r);
    while (c != EOF && !is_blank(c) && length < sizeof word - 1) {
        word[length++] = (char)c;
        c = getc_unlocked(r->stream);
    }
    word[length] = '\0';
    *out = strtod(word, &end);
    return length > 0 && *end == '\0';
}

static bool next_bytes(reader *r, double *out) {
    unsigned char bytes[8] = {0};
    const size_t width = r->format == FLOAT ? 4 : 8;
    if (fread(bytes, 1, width, r->stream) != width) return false;
    uint64_t bits = 0;
    for (size_t k = 0; k < width; k++) bits = bits << 8 | bytes[r->big_endian ? k : width - 1 - k];
    const uint32_t low = (uint32_t)bits;
    float single;
    memcpy(&single, &low, sizeof single);
    memcpy(out, &bits, sizeof *out);
    if (r->format == FLOAT) *out = (double)single;
    return true;
}

/* Checks that the file is long enough for its rows and columns, before memory is allocated for them. */
static lam_status check_size(const reader *r, size_t *count, lam_error *error) {
    lam_status status = LAM_OK;
    static const size_t widths[] = {[ASCII] = 2, [FLOAT] = 4, [DOUBLE] = 8};
    size_t numbers, bytes = 0;
    const long here = ftell(r->stream);
    const uint64_t left = here < 0 ? 0 : r->size - (uint64_t)here;
    const bool fits = size_multiply(r->rows, r->columns, &numbers) &&
                      size_multiply(numbers, r->components, &numbers) &&
                      size_multiply(numbers, widths[r->format], &bytes);
    /* A number of a text takes at least two bytes, the last one at least one. */
    const uint64_t needed = r->format == ASCII ? bytes - 1 : bytes;
    if (!fits || left < needed || (r->format != ASCII && left != needed))
        FAIL(
            error, LAM_ERR_FORMAT,
            "%s: holds %llu bytes after its header, %zu rows x %zu columns x %zu components of %s need %s%zu",
            r->path, (unsigned long long)left, r->rows, r->columns, r->components,
            r->format == ASCII   ? "text"
            : r->format == FLOAT ? "float"
                                 : "double",
            r->format == ASCII ? "at least " : "", fits ? (size_t)needed : SIZE_MAX);
    *count = numbers;
done:
    return status;
}

/* Reads L [columns][components][n_tiles], row by row. */
static lam_status read_numbers(reader *r, const uint32_t *tile, size_t n_tiles, const progress *steps,
                               float *L, lam_error *error) {
    lam_status status = LAM_OK;
    for (size_t row = 0; row < r->rows; row++) {
        if (progress_cancelled(steps)) FAIL(error, LAM_ERR_CANCELLED, "cancelled");
        progress_report(steps, "matrix", (double)row / (double)r->rows);
        for (size_t k = 0; k < r->columns * r->components; k++) {
            double value = 0;
            if (!(r->format == ASCII ? next_text(r, &value) : next_bytes(r, &value)))
                FAIL(error, LAM_ERR_FORMAT, "%s: row %zu, column %zu: no number, or the file ends there",
                     r->path, row, k / r->components);
            if (!(value >= 0 && value <= (double)FLT_MAX))
                FAIL(error, LAM_ERR_FORMAT, "%s: row %zu, column %zu = %g, must be from 0 to %g", r->path,
                     row, k / r->components, value, (double)FLT_MAX);
            if (tile[row] < n_tiles) L[k * n_tiles + tile[row]] = (float)value;
        }
    }
    if (r->format == ASCII && skip_blanks(r) != EOF)
        FAIL(error, LAM_ERR_FORMAT, "%s: goes on after its %zu rows", r->path, r->rows);
done:
    return status;
}

/* Reduces three components to one channel where they are equal everywhere. */
static void join_components(sky_matrix *m) {
    const size_t width = m->tiling.n_tiles;
    for (size_t h = 0; h < m->n; h++)
        for (size_t t = 0; t < width; t++) {
            const float *at = m->L + h * 3 * width + t;
            if (at[0] != at[width] || at[0] != at[2 * width]) return;
        }
    for (size_t h = 1; h < m->n; h++) memmove(m->L + h * width, m->L + 3 * h * width, width * sizeof *m->L);
    m->n_channels = 1;
}

lam_status sky_matrix_read(const char *path, const char *tiles, const progress *steps, sky_matrix *out,
                           lam_error *error) {
    lam_status status = LAM_OK;
    reader r = {.path = path, .format = -1};
    sky_matrix m = {0};
    uint32_t *tile = NULL;
    size_t count = 0;
    TRY(reader_open(&r, error));
    TRY(read_header(&r, error));
    TRY(choose_tiling(&r, tiles, &m.tiling, error));
    TRY(check_size(&r, &count, error));
    m.n = r.columns;
    m.n_channels = r.components;
    tile = memory_allocate(r.rows, sizeof *tile, path, error);
    m.L = memory_allocate(count, sizeof *m.L, path, error);
    if (tile == NULL || m.L == NULL) TRY(LAM_ERR_MEMORY);
    place_patches(r.rows, &m.tiling, tile);
    TRY(read_numbers(&r, tile, m.tiling.n_tiles, steps, m.L, error));
    if (m.n_channels == 3) join_components(&m);
    *out = m;
    m = (sky_matrix){0};
done:
    free(tile);
    sky_matrix_free(&m);
    if (r.stream != NULL) fclose(r.stream);
    return status;
}
