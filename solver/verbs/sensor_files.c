#include "solver/verbs/sensor_files.h"

#include "solver/base/atomic_file.h"
#include "solver/operator/sensor_light.h"
#include "solver/verbs/json_print.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* Calls put for each receiver of the sets that has a value; set: its number among those chosen. */
static void each_point(const sensor_choice *c, const solution *s, size_t row,
                       void (*put)(const sensor_choice *c, const solution *s, size_t row, size_t set,
                                   size_t receiver, FILE *stream),
                       FILE *stream) {
    for (size_t k = 0; k < c->n_sets; k++) {
        size_t first, count;
        lam_sensors_set(c->all, c->sets[k], &first, &count);
        for (size_t i = first; i < first + count; i++)
            if (lam_sensors_has_value(c->all, i)) put(c, s, row, k, i, stream);
    }
}

static void put_vector(const double x[3], FILE *stream) {
    fprintf(stream, "%.17g %.17g %.17g\n", x[0], x[1], x[2]);
}

static void put_place(const sensor_choice *c, const solution *s, size_t row, size_t set, size_t receiver,
                      FILE *stream) {
    (void)s, (void)row, (void)set;
    put_vector(sensors_shown(c->all, receiver).at, stream);
}

static void put_axis(const sensor_choice *c, const solution *s, size_t row, size_t set, size_t receiver,
                     FILE *stream) {
    (void)s, (void)row, (void)set;
    put_vector(sensors_shown(c->all, receiver).axis, stream);
}

static void put_set(const sensor_choice *c, const solution *s, size_t row, size_t set, size_t receiver,
                    FILE *stream) {
    (void)c, (void)s, (void)row, (void)receiver;
    fprintf(stream, "%zu\n", set);
}

static void put_value(const sensor_choice *c, const solution *s, size_t row, size_t set, size_t receiver,
                      FILE *stream) {
    (void)set;
    fprintf(stream, "%.9g\n", sensor_value(c, s, row, receiver));
}

static void open_array(const char *type, const char *name, int components, FILE *stream) {
    fprintf(stream, "<DataArray type=\"%s\" Name=\"%s\" NumberOfComponents=\"%d\" format=\"ascii\">\n", type,
            name, components);
}

static void close_array(FILE *stream) {
    fputs("</DataArray>\n", stream);
}

void sensor_points_vtu(const sensor_choice *c, const solution *s, FILE *stream) {
    enum { VTK_VERTEX = 1 };
    size_t n = 0;
    for (size_t k = 0; k < c->n_sets; k++) {
        size_t first, count;
        lam_sensors_set(c->all, c->sets[k], &first, &count);
        for (size_t i = first; i < first + count; i++) n += lam_sensors_has_value(c->all, i) != 0;
    }
    fprintf(stream,
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" "
            "byte_order=\"LittleEndian\">\n<UnstructuredGrid>\n<Piece NumberOfPoints=\"%zu\" "
            "NumberOfCells=\"%zu\">\n<Points>\n",
            n, n);
    open_array("Float64", "Points", 3, stream);
    each_point(c, s, 0, put_place, stream);
    close_array(stream);
    fputs("</Points>\n<Cells>\n", stream);
    open_array("UInt32", "connectivity", 1, stream);
    for (size_t i = 0; i < n; i++) fprintf(stream, "%zu\n", i);
    close_array(stream);
    open_array("UInt64", "offsets", 1, stream);
    for (size_t i = 0; i < n; i++) fprintf(stream, "%zu\n", i + 1);
    close_array(stream);
    open_array("UInt8", "types", 1, stream);
    for (size_t i = 0; i < n; i++) fprintf(stream, "%d\n", (int)VTK_VERTEX);
    close_array(stream);
    fputs("</Cells>\n<PointData>\n", stream);
    open_array("UInt32", "set", 1, stream);
    each_point(c, s, 0, put_set, stream);
    close_array(stream);
    open_array("Float64", "normal", 3, stream);
    each_point(c, s, 0, put_axis, stream);
    close_array(stream);
    for (size_t row = 0; row < s->n_vectors * s->m->n_channels; row++) {
        char name[OUTPUT_COLUMN];
        output_column(s, row / s->m->n_channels, row % s->m->n_channels, name);
        open_array("Float32", name, 1, stream);
        each_point(c, s, row, put_value, stream);
        close_array(stream);
    }
    fputs("</PointData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n", stream);
}

bool sensor_results_named(const char *path) {
    const size_t length = strlen(path);
    return length > 0 && path[length - 1] == '/';
}

lam_status sensor_results_check(const char *path, lam_error *error) {
    lam_status status = LAM_OK;
    struct stat about;
    char *folder = strdup(path);
    if (folder == NULL) FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory for its name", path);
    for (size_t length = strlen(folder); length > 1 && folder[length - 1] == '/';) folder[--length] = '\0';
    if (stat(folder, &about) != 0) {
        if (errno != ENOENT) FAIL(error, LAM_ERR_IO, "%s: cannot be written: %s", path, strerror(errno));
        TRY(atomic_file_check(folder, error));
    } else if (!S_ISDIR(about.st_mode)) {
        FAIL(error, LAM_ERR_IO, "%s: cannot be written: it is a file, and not a folder", path);
    } else if (access(folder, W_OK | X_OK) != 0) {
        FAIL(error, LAM_ERR_IO, "%s: cannot be written: %s; choose another folder", path, strerror(errno));
    }
done:
    free(folder);
    return status;
}

enum { IDENTIFIER = 96 };

/* The name of a set as that of a file, which no set before it has. */
static void identify(const sensor_choice *c, size_t k, char text[IDENTIFIER]) {
    size_t first, count, length = 0, same = 0;
    for (size_t other = 0; other <= k; other++) {
        char made[IDENTIFIER];
        const char *name = lam_sensors_set(c->all, c->sets[k - other], &first, &count);
        size_t i = 0;
        for (; name[i] != '\0' && i < IDENTIFIER - 24; i++) {
            const bool plain = isalnum((unsigned char)name[i]) || strchr("-_.", name[i]) != NULL;
            made[i] = (char)(plain && !(i == 0 && name[i] == '.') ? name[i] : '_');
        }
        made[i] = '\0';
        if (other == 0) {
            memcpy(text, made, i + 1);
            length = i;
        } else {
            same += strcasecmp(made, text) == 0;
        }
    }
    if (same > 0) snprintf(text + length, IDENTIFIER - length, "_%zu", same + 1);
}

/* Opens a file of the folder. */
static lam_status open_in(const char *folder, const char *name, const char *extension, atomic_file *out,
                          lam_error *error) {
    char *path = NULL;
    if (asprintf(&path, "%s%s%s", folder, name, extension) < 0)
        return status_fail(error, LAM_ERR_MEMORY, "%s: not enough memory for its name", folder);
    const lam_status status = atomic_file_open(path, out, error);
    free(path);
    return status;
}

/* A set's values: a row for each receiver, of the vectors that are lit. */
static lam_status put_values(const sensor_choice *c, const solution *s, size_t k, const bool *lit,
                             const char *path, lam_error *error) {
    lam_status status = LAM_OK;
    atomic_file file = {0};
    size_t first, count;
    char name[IDENTIFIER];
    identify(c, k, name);
    TRY(open_in(path, name, s->batch ? ".ill" : ".res", &file, error));
    lam_sensors_set(c->all, c->sets[k], &first, &count);
    for (size_t i = first; i < first + count; i++) {
        const char *before = "";
        for (size_t v = 0; v < s->n_vectors; v++) {
            if (!lit[v]) continue;
            fprintf(file.stream, "%s%.7e", before, sensor_value(c, s, v, i));
            before = "\t";
        }
        fputc('\n', file.stream);
    }
    TRY(atomic_file_commit(&file, error));
done:
    atomic_file_abort(&file);
    return status;
}

static lam_status put_hours(const sensor_choice *c, const solution *s, const bool *lit, const char *path,
                            lam_error *error) {
    lam_status status = LAM_OK;
    atomic_file file = {0};
    TRY(open_in(path, "sun-up-hours", ".txt", &file, error));
    for (size_t v = 0; v < s->n_vectors; v++) {
        const double whole = round(c->begins[v]);
        if (!lit[v]) continue;
        if (fabs(c->begins[v] - whole) < 1e-6)
            fprintf(file.stream, "%.1f\n", whole);
        else
            fprintf(file.stream, "%.10g\n", c->begins[v]);
    }
    TRY(atomic_file_commit(&file, error));
done:
    atomic_file_abort(&file);
    return status;
}

static lam_status put_grids(const sensor_choice *c, const char *path, lam_error *error) {
    lam_status status = LAM_OK;
    atomic_file file = {0};
    json_t *grids = json_array();
    for (size_t k = 0; k < c->n_sets; k++) {
        size_t first, count;
        char identifier[IDENTIFIER];
        const char *name = lam_sensors_set(c->all, c->sets[k], &first, &count);
        identify(c, k, identifier);
        json_array_append_new(grids,
                              json_pack("{s:s, s:s, s:s, s:s, s:I}", "name", name, "identifier", identifier,
                                        "full_id", identifier, "group", "", "count", (json_int_t)count));
    }
    TRY(open_in(path, "grids_info", ".json", &file, error));
    if (json_array_size(grids) != c->n_sets || json_dumpf(grids, file.stream, JSON_INDENT(2)) != 0)
        FAIL(error, LAM_ERR_MEMORY, "%s: not enough memory for its JSON", path);
    TRY(atomic_file_commit(&file, error));
done:
    json_decref(grids);
    atomic_file_abort(&file);
    return status;
}

/* Marks the vectors in which any receiver has light: an hour of night is no column. */
static void find_lit(const sensor_choice *c, const solution *s, bool *lit) {
    for (size_t v = 0; v < s->n_vectors; v++) lit[v] = !s->batch;
    for (size_t k = 0; k < c->n_sets && s->batch; k++) {
        size_t first, count;
        lam_sensors_set(c->all, c->sets[k], &first, &count);
        for (size_t v = 0; v < s->n_vectors; v++)
            for (size_t i = first; i < first + count && !lit[v]; i++) lit[v] = sensor_value(c, s, v, i) > 0;
    }
}

lam_status sensor_results_write(const sensor_choice *c, const solution *s, const char *path,
                                lam_error *error) {
    lam_status status = LAM_OK;
    bool *lit = NULL;
    if (s->m->n_channels > 1)
        FAIL(error, LAM_ERR_ARGUMENT,
             "-o %s: results are of one value for each sensor, and the store has %zu channels: --unit-out "
             "lx gives their luminance",
             path, s->m->n_channels);
    if (s->batch && c->begins == NULL)
        FAIL(error, LAM_ERR_ARGUMENT,
             "-o %s: results of a batch are those of --weather, whose hours are known; write .csv or .npy",
             path);
    lit = memory_allocate(s->n_vectors, sizeof *lit, "results", error);
    if (lit == NULL) TRY(LAM_ERR_MEMORY);
    TRY(sensor_results_check(path, error));
    if (mkdir(path, 0777) != 0 && errno != EEXIST)
        FAIL(error, LAM_ERR_IO, "%s: cannot be made: %s", path, strerror(errno));
    find_lit(c, s, lit);
    for (size_t k = 0; k < c->n_sets; k++) TRY(put_values(c, s, k, lit, path, error));
    if (s->batch) TRY(put_hours(c, s, lit, path, error));
    TRY(put_grids(c, path, error));
done:
    free(lit);
    return status;
}
