/* A solution on its mesh: PLY (binary, values at the faces) and VTU (cell data, as ParaView reads it). Values
 * at corners stand at points that no two elements share, as neighbours need not agree there. */
#include "solver/codec/request.h"
#include "solver/output/output.h"

#include <endian.h>
#include <string.h>

static void put_float(float value, FILE *stream) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    bits = htole32(bits);
    fwrite(&bits, sizeof bits, 1, stream);
}

static void put_double(double value, FILE *stream) {
    uint64_t bits;
    memcpy(&bits, &value, sizeof bits);
    bits = htole64(bits);
    fwrite(&bits, sizeof bits, 1, stream);
}

/* The vertices of the file: those of the mesh or, with values at corners, one for each corner. */
static size_t count_points(const solution *s) {
    const mesh *m = s->m;
    size_t count = 0;
    if (s->corners == NULL) return m->n_vertices;
    for (size_t i = 0; i < m->n; i++) count += mesh_corners(m, i);
    return count;
}

static void put_vertex(const double at[3], FILE *stream) {
    for (int d = 0; d < 3; d++) put_double(at[d], stream);
}

/* One vertex for each corner, with its values. */
static void put_corners(const solution *s, FILE *stream) {
    const mesh *m = s->m;
    for (size_t i = 0; i < m->n; i++)
        for (size_t k = 0; k < mesh_corners(m, i); k++) {
            put_vertex(m->vertices[m->elements[i][k]], stream);
            for (size_t column = 0; column < s->n_vectors * m->n_channels; column++)
                put_float(s->corners[4 * (column * m->n + i) + k], stream);
        }
}

static void put_columns(const solution *s, FILE *stream) {
    char name[OUTPUT_COLUMN];
    for (size_t v = 0; v < s->n_vectors; v++)
        for (size_t c = 0; c < s->m->n_channels; c++) {
            output_column(s, v, c, name);
            fprintf(stream, "property float %s\n", name);
        }
}

lam_status output_ply(const solution *s, FILE *stream, lam_error *error) {
    (void)error;
    const mesh *m = s->m;
    uint32_t point = 0;
    fprintf(stream, "ply\nformat binary_little_endian 1.0\ncomment %s of %s\n",
            codec_quantity_name(s->quantity), s->scene);
    fprintf(stream, "element vertex %zu\nproperty double x\nproperty double y\nproperty double z\n",
            count_points(s));
    if (s->corners != NULL) put_columns(s, stream);
    fprintf(stream, "element face %zu\nproperty list uchar uint vertex_indices\nproperty uint group\n", m->n);
    put_columns(s, stream);
    fputs("end_header\n", stream);
    for (size_t v = 0; v < m->n_vertices && s->corners == NULL; v++) put_vertex(m->vertices[v], stream);
    if (s->corners != NULL) put_corners(s, stream);
    for (size_t i = 0; i < m->n; i++) {
        fputc((int)mesh_corners(m, i), stream);
        uint32_t numbers[5];
        for (size_t k = 0; k < mesh_corners(m, i); k++)
            numbers[k] = htole32(s->corners != NULL ? point++ : m->elements[i][k]);
        numbers[mesh_corners(m, i)] = htole32(m->group[i]);
        fwrite(numbers, sizeof numbers[0], mesh_corners(m, i) + 1, stream);
        for (size_t k = 0; k < s->n_vectors * m->n_channels; k++)
            put_float((float)output_value(s, k * m->n + i), stream);
    }
    return LAM_OK;
}

/* One text array: format is for one value. */
#define OPEN_ARRAY(type, name, components)                                                                   \
    fprintf(stream, "<DataArray type=\"%s\" Name=\"%s\" NumberOfComponents=\"%d\" format=\"ascii\">\n",      \
            type, name, components)
#define CLOSE_ARRAY() fputs("</DataArray>\n", stream)

static void say_point(const double at[3], FILE *stream) {
    fprintf(stream, "%.17g %.17g %.17g\n", at[0], at[1], at[2]);
}

/* The points of the file and the corners of elements as their numbers. */
static void say_points(const solution *s, FILE *stream) {
    const mesh *m = s->m;
    uint32_t point = 0;
    OPEN_ARRAY("Float64", "Points", 3);
    for (size_t v = 0; v < m->n_vertices && s->corners == NULL; v++) say_point(m->vertices[v], stream);
    for (size_t i = 0; i < m->n && s->corners != NULL; i++)
        for (size_t k = 0; k < mesh_corners(m, i); k++) say_point(m->vertices[m->elements[i][k]], stream);
    CLOSE_ARRAY();
    fputs("</Points>\n<Cells>\n", stream);
    OPEN_ARRAY("UInt32", "connectivity", 1);
    for (size_t i = 0; i < m->n; i++)
        for (size_t k = 0; k < mesh_corners(m, i); k++)
            fprintf(stream, "%u%c", s->corners != NULL ? point++ : m->elements[i][k],
                    k + 1 < mesh_corners(m, i) ? ' ' : '\n');
    CLOSE_ARRAY();
}

static void say_corners(const solution *s, size_t column, FILE *stream) {
    const mesh *m = s->m;
    for (size_t i = 0; i < m->n; i++)
        for (size_t k = 0; k < mesh_corners(m, i); k++)
            fprintf(stream, "%.9g\n", (double)s->corners[4 * (column * m->n + i) + k]);
}

static void say_elements(const solution *s, size_t column, FILE *stream) {
    for (size_t i = 0; i < s->m->n; i++)
        fprintf(stream, "%.9g\n", (double)(float)output_value(s, column * s->m->n + i));
}

/* One array for each vector and channel. */
static void say_columns(const solution *s, void (*say)(const solution *s, size_t column, FILE *stream),
                        FILE *stream) {
    char name[OUTPUT_COLUMN];
    for (size_t v = 0; v < s->n_vectors; v++)
        for (size_t c = 0; c < s->m->n_channels; c++) {
            output_column(s, v, c, name);
            OPEN_ARRAY("Float32", name, 1);
            say(s, v * s->m->n_channels + c, stream);
            CLOSE_ARRAY();
        }
}

lam_status output_vtu(const solution *s, FILE *stream, lam_error *error) {
    (void)error;
    enum { VTK_TRIANGLE = 5, VTK_QUAD = 9 };
    const mesh *m = s->m;
    size_t end = 0;
    fprintf(stream,
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" "
            "byte_order=\"LittleEndian\">\n<UnstructuredGrid>\n<Piece NumberOfPoints=\"%zu\" "
            "NumberOfCells=\"%zu\">\n<Points>\n",
            count_points(s), m->n);
    say_points(s, stream);
    OPEN_ARRAY("UInt64", "offsets", 1);
    for (size_t i = 0; i < m->n; i++) fprintf(stream, "%zu\n", end += mesh_corners(m, i));
    CLOSE_ARRAY();
    OPEN_ARRAY("UInt8", "types", 1);
    for (size_t i = 0; i < m->n; i++)
        fprintf(stream, "%d\n", mesh_corners(m, i) == 3 ? (int)VTK_TRIANGLE : (int)VTK_QUAD);
    CLOSE_ARRAY();
    fputs("</Cells>\n", stream);
    if (s->corners != NULL) {
        fputs("<PointData>\n", stream);
        say_columns(s, say_corners, stream);
        fputs("</PointData>\n", stream);
    }
    fputs("<CellData>\n", stream);
    OPEN_ARRAY("UInt32", "group", 1);
    for (size_t i = 0; i < m->n; i++) fprintf(stream, "%u\n", m->group[i]);
    CLOSE_ARRAY();
    say_columns(s, say_elements, stream);
    fputs("</CellData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n", stream);
    return LAM_OK;
}
