/* Sky matrices of Radiance: every patch finds the tile that lies where it does, and wrong files are refused.
 */
#include "solver/daylight/sky_matrix.h"
#include "support/suite.h"

#include <math.h>
#include <string.h>
#include <unistd.h>

/* A fresh file; the caller unlinks it. */
static FILE *open_file(char path[32]) {
    snprintf(path, 32, "/tmp/test-XXXXXX.mtx");
    const int descriptor = mkstemps(path, 4);
    ck_assert_int_ge(descriptor, 0);
    return fdopen(descriptor, "wb");
}

/* Bright in every direction in its own way. */
static double radiance(double east, double north, double up) {
    return 10 + 4 * east + 2 * north + up;
}

/* The patches as the manual page of gendaymtx and reinhart.cal have them: the ground, rows from the horizon
 * up with azimuths from north by east, the zenith. patch [rows] gets their radiance. */
static size_t patches_of(size_t split, double *patch) {
    static const size_t per_row[7] = {30, 30, 24, 24, 18, 12, 6};
    const double alpha = 90 / (7. * (double)split + .5) * M_PI / 180;
    size_t n = 0;
    patch[n++] = 1000;
    for (size_t row = 0; row < 7 * split; row++) {
        const size_t count = per_row[row / split] * split;
        for (size_t k = 0; k < count; k++) {
            const double up = alpha * ((double)row + .5), turn = 2 * M_PI * (double)k / (double)count;
            patch[n++] = radiance(cos(up) * sin(turn), cos(up) * cos(turn), sin(up));
        }
    }
    patch[n++] = radiance(0, 0, 1);
    return n;
}

/* Column h and component c of a patch: (1 + h + spread c) times its radiance. */
static void write_matrix(FILE *stream, size_t split, const char *format, bool big, size_t columns,
                         size_t components, double spread) {
    double patch[2400];
    const size_t rows = patches_of(split, patch);
    fprintf(stream,
            "#?RADIANCE\ngendaymtx -m %zu a.wea\n\tNROWS= 7\nLATLONG= 1 2\nNROWS=%zu\nNCOLS=%zu\nNCOMP=%zu\n",
            split, rows, columns, components);
    if (strcmp(format, "ascii") != 0) fprintf(stream, "BigEndian=%d\n", big);
    fprintf(stream, "FORMAT=%s\n\n", format);
    for (size_t p = 0; p < rows; p++) {
        for (size_t h = 0; h < columns; h++)
            for (size_t c = 0; c < components; c++) {
                const double value = patch[p] * (1 + (double)h + spread * (double)c);
                const float single = (float)value;
                unsigned char bytes[8];
                const size_t width = format[0] == 'f' ? 4 : 8;
                memcpy(bytes, format[0] == 'f' ? (const void *)&single : (const void *)&value, width);
                if (format[0] == 'a')
                    fprintf(stream, "%.9g%c", value, c + 1 < components ? ' ' : '\n');
                else
                    for (size_t k = 0; k < width; k++) fputc(bytes[big ? width - 1 - k : k], stream);
            }
        if (format[0] == 'a') fputc('\n', stream);
    }
    ck_assert_int_eq(fclose(stream), 0);
}

START_TEST(directions) {
    static const struct {
        size_t split;
        const char *format, *tiles, *name;
        bool big;
        size_t components;
        double spread;
    } all[] = {
        {1, "ascii", NULL, "tregenza", false, 3, 0},
        {1, "float", "reinhart:1", "reinhart:1", false, 3, .25},
        {1, "double", "tregenza", "tregenza", true, 1, 0},
        {2, "float", NULL, "reinhart:2", true, 3, 0},
        {4, "double", "reinhart:4", "reinhart:4", false, 3, .5},
    };
    char path[32];
    lam_error error = {0};
    sky_matrix m = {0};
    enum { COLUMNS = 3 };
    FILE *stream = open_file(path);
    write_matrix(stream, all[_i].split, all[_i].format, all[_i].big, COLUMNS, all[_i].components,
                 all[_i].spread);
    ck_assert_msg(sky_matrix_read(path, all[_i].tiles, NULL, &m, &error) == LAM_OK, "%s", error.message);
    unlink(path);
    ck_assert_str_eq(m.tiling.name, all[_i].name);
    ck_assert_uint_eq(m.tiling.n_tiles, 144 * all[_i].split * all[_i].split + 1);
    ck_assert_uint_eq(m.n, COLUMNS);
    ck_assert_uint_eq(m.n_channels, all[_i].spread > 0 ? 3 : 1);
    for (size_t h = 0; h < COLUMNS; h++)
        for (size_t c = 0; c < m.n_channels; c++)
            for (size_t t = 0; t < m.tiling.n_tiles; t++) {
                const double *d = m.tiling.tiles[t].centre;
                const double right =
                    radiance(d[0], d[1], d[2]) * (1 + (double)h + all[_i].spread * (double)c);
                const double got = (double)m.L[(h * m.n_channels + c) * m.tiling.n_tiles + t];
                ck_assert_msg(fabs(got - right) <= 1e-6 * right, "tile %zu: %g, is %g", t, got, right);
            }
    sky_matrix_free(&m);
}
END_TEST

static void refuse(const char *text, size_t size, const char *tiles, lam_status wanted, const char *says) {
    char path[32];
    lam_error error = {0};
    sky_matrix m = {.n = 77};
    FILE *stream = open_file(path);
    ck_assert_uint_eq(fwrite(text, 1, size, stream), size);
    fclose(stream);
    ck_assert_msg(sky_matrix_read(path, tiles, NULL, &m, &error) == wanted, "%s: %s", says, error.message);
    ck_assert_msg(strstr(error.message, says) != NULL, "\"%s\" lacks \"%s\"", error.message, says);
    ck_assert_msg(strncmp(error.message, "/tmp/test-", 10) == 0, "%s", error.message);
    ck_assert_uint_eq(m.n, 77); /* untouched */
    unlink(path);
}

#define HEAD "#?RADIANCE\nNROWS=146\nNCOLS=1\nNCOMP=1\n"

START_TEST(refused) {
    static const struct {
        const char *text, *says;
    } wrong[] = {
        {"", "does not begin with #?RADIANCE"},
        {"NROWS=146\n", "does not begin with #?RADIANCE; make it without gendaymtx -h"},
        {"#?RADIANCE\nNROWS=146\n", "no empty line ends its header"},
        {"#?RADIANCE\n\n1 2 3\n", "its header lacks NROWS="},
        {"#?RADIANCE\nNROWS=146\n\n", "its header lacks NCOLS="},
        {"#?RADIANCE\nNROWS=146\nNCOLS=1\n\n", "its header lacks NCOMP="},
        {HEAD "\n", "its header lacks FORMAT="},
        {HEAD "FORMAT=32-bit_rle_rgbe\n\n", "FORMAT=32-bit_rle_rgbe, must be ascii, float or double"},
        {"#?RADIANCE\nNROWS=x\n\n", "header has \"NROWS=x\", needs a whole number above 0"},
        {"#?RADIANCE\nNROWS=-146\n\n", "\"NROWS=-146\""},
        {"#?RADIANCE\nNCOLS=0\n\n", "\"NCOLS=0\""},
        {"#?RADIANCE\nNCOLS=1.5\n\n", "\"NCOLS=1.5\""},
        {"#?RADIANCE\nNCOLS=99999999999999999999\n\n", "\"NCOLS=99999999999999999999\""},
        {"#?RADIANCE\nNROWS=146\nNCOLS=1\nNCOMP=20\nFORMAT=ascii\n\n", "NCOMP=20, must be 1 or 3"},
        {"#?RADIANCE\nNROWS=145\nNCOLS=1\nNCOMP=3\nFORMAT=ascii\n\n",
         "145 rows, must be 146 (ground and tregenza) or 144 MF^2 + 2"},
        {"#?RADIANCE\nNROWS=99999999\nNCOLS=1\nNCOMP=3\nFORMAT=ascii\n\n", "99999999 rows, must be"},
        {HEAD "FORMAT=float\n\nabc",
         "holds 3 bytes after its header, 146 rows x 1 columns x 1 components of float "
         "need 584"},
        {"#?RADIANCE\nNROWS=146\nNCOLS=18000000000000000000\nNCOMP=3\nFORMAT=double\n\nabc", "holds 3 bytes"},
        {HEAD "FORMAT=ascii\n\n1 2 3", "holds 5 bytes after its header"},
    };
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++)
        refuse(wrong[i].text, strlen(wrong[i].text), NULL, LAM_ERR_FORMAT, wrong[i].says);
    lam_error error = {0};
    sky_matrix m = {0};
    ck_assert_int_eq(sky_matrix_read("/nonexistent/a.mtx", NULL, NULL, &m, &error), LAM_ERR_IO);
    ck_assert_int_eq(sky_matrix_read("/dev/zero", NULL, NULL, &m, &error), LAM_ERR_IO);
}
END_TEST

/* A good text of one column, and what one wrong word in it says. */
START_TEST(refused_numbers) {
    static const struct {
        size_t row;
        const char *word, *says;
    } wrong[] = {{3, "nan", "row 3, column 0 = nan, must be from 0"},
                 {3, "inf", "row 3, column 0 = inf"},
                 {0, "-1", "row 0, column 0 = -1"},
                 {145, "1e39", "row 145, column 0 = 1e+39"},
                 {145, "x", "row 145, column 0: no number"},
                 {145, "", "row 145, column 0: no number, or the file ends there"},
                 {145, "1 2", "goes on after its 146 rows"},
                 {145, "1 x", "goes on after its 146 rows"}};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        char text[4096];
        size_t length = (size_t)sprintf(text, "%s", HEAD "FORMAT=ascii\n\n");
        for (size_t row = 0; row < 146; row++)
            length += (size_t)sprintf(text + length, "%s\n\n", row == wrong[i].row ? wrong[i].word : "1.5");
        while (text[length - 1] == '\n') length--;
        refuse(text, length, NULL, LAM_ERR_FORMAT, wrong[i].says);
    }
    char text[1024] = HEAD "FORMAT=float\n\n";
    const size_t begin = strlen(text);
    memset(text + begin, 0, 585);
    refuse(text, begin + 583, NULL, LAM_ERR_FORMAT, "holds 583 bytes after its header");
    refuse(text, begin + 585, NULL, LAM_ERR_FORMAT, "holds 585 bytes after its header");
    refuse(text, begin + 584, "grid:12x12", LAM_ERR_ARGUMENT,
           "those of tregenza, --tiles asks for grid:12x12");
    refuse(text, begin + 584, "reinhart:2", LAM_ERR_ARGUMENT, "--tiles asks for reinhart:2");
    const float nan = NAN;
    memcpy(text + begin + 4 * 100, &nan, sizeof nan);
    refuse(text, begin + 584, NULL, LAM_ERR_FORMAT, "row 100, column 0 = nan");
}
END_TEST

START_TEST(names) {
    ck_assert(sky_matrix_is_named("a.mtx") && sky_matrix_is_named("a/b.SMX"));
    ck_assert(!sky_matrix_is_named(".mtx") && !sky_matrix_is_named("a.wea") && !sky_matrix_is_named("mtx"));
}
END_TEST

int main(void) {
    Suite *s = suite_create("sky_matrix");
    TCase *c = tcase_create("all");
    tcase_set_timeout(c, 60);
    tcase_add_loop_test(c, directions, 0, 5);
    tcase_add_test(c, refused);
    tcase_add_test(c, refused_numbers);
    tcase_add_test(c, names);
    suite_add_tcase(s, c);
    return suite_run(s);
}
