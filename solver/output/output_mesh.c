/* A solution on its mesh: PLY (binary, values at the faces) and VTU (cell data, as ParaView reads it). */
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

lam_status output_ply(const solution *s, FILE *stream, lam_error *error) {
    (void)error;
    const mesh *m = s->m;
    char name[OUTPUT_COLUMN];
    fprintf(stream, "ply\nformat binary_little_endian 1.0\ncomment %s of %s\n",
            codec_quantity_name(s->quantity), s->scene);
    fprintf(stream, "element vertex %zu\nproperty double x\nproperty double y\nproperty double z\n",
            m->n_vertices);
    fprintf(stream, "element face %zu\nproperty list uchar uint vertex_indices\nproperty uint group\n", m->n);
    for (size_t v = 0; v < s->n_vectors; v++)
        for (size_t c = 0; c < m->n_channels; c++) {
            output_column(s, v, c, name);
            fprintf(stream, "property float %s\n", name);
        }
    fputs("end_header\n", stream);
    for (size_t v = 0; v < m->n_vertices; v++)
        for (int k = 0; k < 3; k++) put_double(m->vertices[v][k], stream);
    for (size_t i = 0; i < m->n; i++) {
        fputc((int)mesh_corners(m, i), stream);
        uint32_t numbers[5];
        for (size_t k = 0; k < mesh_corners(m, i); k++) numbers[k] = htole32(m->elements[i][k]);
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

lam_status output_vtu(const solution *s, FILE *stream, lam_error *error) {
    (void)error;
    enum { VTK_TRIANGLE = 5, VTK_QUAD = 9 };
    const mesh *m = s->m;
    char name[OUTPUT_COLUMN];
    size_t end = 0;
    fprintf(stream,
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" "
            "byte_order=\"LittleEndian\">\n<UnstructuredGrid>\n<Piece NumberOfPoints=\"%zu\" "
            "NumberOfCells=\"%zu\">\n<Points>\n",
            m->n_vertices, m->n);
    OPEN_ARRAY("Float64", "Points", 3);
    for (size_t v = 0; v < m->n_vertices; v++)
        fprintf(stream, "%.17g %.17g %.17g\n", m->vertices[v][0], m->vertices[v][1], m->vertices[v][2]);
    CLOSE_ARRAY();
    fputs("</Points>\n<Cells>\n", stream);
    OPEN_ARRAY("UInt32", "connectivity", 1);
    for (size_t i = 0; i < m->n; i++)
        for (size_t k = 0; k < mesh_corners(m, i); k++)
            fprintf(stream, "%u%c", m->elements[i][k], k + 1 < mesh_corners(m, i) ? ' ' : '\n');
    CLOSE_ARRAY();
    OPEN_ARRAY("UInt64", "offsets", 1);
    for (size_t i = 0; i < m->n; i++) fprintf(stream, "%zu\n", end += mesh_corners(m, i));
    CLOSE_ARRAY();
    OPEN_ARRAY("UInt8", "types", 1);
    for (size_t i = 0; i < m->n; i++)
        fprintf(stream, "%d\n", mesh_corners(m, i) == 3 ? (int)VTK_TRIANGLE : (int)VTK_QUAD);
    CLOSE_ARRAY();
    fputs("</Cells>\n<CellData>\n", stream);
    OPEN_ARRAY("UInt32", "group", 1);
    for (size_t i = 0; i < m->n; i++) fprintf(stream, "%u\n", m->group[i]);
    CLOSE_ARRAY();
    for (size_t v = 0; v < s->n_vectors; v++)
        for (size_t c = 0; c < m->n_channels; c++) {
            const size_t column = v * m->n_channels + c;
            output_column(s, v, c, name);
            OPEN_ARRAY("Float32", name, 1);
            for (size_t i = 0; i < m->n; i++)
                fprintf(stream, "%.9g\n", (double)(float)output_value(s, column * m->n + i));
            CLOSE_ARRAY();
        }
    fputs("</CellData>\n</Piece>\n</UnstructuredGrid>\n</VTKFile>\n", stream);
    return LAM_OK;
}
