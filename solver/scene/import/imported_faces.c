/* Fills imported faces and splits polygons into elements, with the maps of images on them. */
#include "solver/scene/import/imported_faces.h"

#include "solver/base/array_grow.h"
#include "solver/base/utf8.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

void import_warn(import_warnings *w, const char *format, ...) {
    const size_t used = strlen(w->text), room = sizeof w->text - used;
    va_list arguments;
    if (w->omitted > 0 || room < 3) { /* a line that follows an omitted one is omitted too */
        w->omitted++;
        return;
    }
    char *line = w->text + used;
    const size_t gap = used > 0 ? 1 : 0;
    va_start(arguments, format);
    const int length = vsnprintf(line + gap, room - gap, format, arguments);
    va_end(arguments);
    if (length < 0 || (size_t)length >= room - gap) {
        *line = '\0';
        w->omitted++;
        return;
    }
    if (gap == 1) *line = '\n';
    for (line += gap; *line != '\0'; line++)
        if ((unsigned char)*line < 0x20 || *line == 0x7f) *line = '?';
}

void imported_faces_free(imported_faces *s) {
    free(s->vertices);
    free(s->corners);
    free(s->polygons);
    free(s->elements);
    free(s->values);
    free(s->cameras);
    free(s->punctual);
    free(s->skins);
    free(s->skin_corners);
    free(s->faces);
    free(s->face_elements);
    for (size_t k = 0; s->images != NULL && k < s->n_images; k++) free(s->images[k].pixels);
    free(s->images);
    name_table_free(&s->image_keys);
    point_table_free(&s->points);
    name_table_free(&s->objects);
    name_table_free(&s->materials);
    *s = (imported_faces){0};
}

lam_status imported_faces_add_vertex(imported_faces *s, const double vertex[3], lam_error *error) {
    if (array_grow(&s->vertices, &s->vertex_capacity, s->n_vertices + 1, sizeof *s->vertices, "vertices",
                   error) != LAM_OK)
        return LAM_ERR_MEMORY;
    memcpy(s->vertices[s->n_vertices++], vertex, sizeof *s->vertices);
    return LAM_OK;
}

lam_status imported_faces_add_polygon(imported_faces *s, const uint32_t *corners, size_t n, uint32_t object,
                                      uint32_t material, uint32_t line, lam_error *error) {
    if (array_grow(&s->corners, &s->corner_capacity, s->n_corners + n, sizeof *s->corners, "face corners",
                   error) != LAM_OK)
        return LAM_ERR_MEMORY;
    if (array_grow(&s->polygons, &s->polygon_capacity, s->n_polygons + 1, sizeof *s->polygons, "faces",
                   error) != LAM_OK)
        return LAM_ERR_MEMORY;
    memcpy(s->corners + s->n_corners, corners, n * sizeof *corners);
    s->polygons[s->n_polygons++] =
        (struct imported_polygon){s->n_corners, (uint32_t)n, object, material, line};
    s->n_corners += n;
    return LAM_OK;
}

/* Adds a name to one of the tables as UTF-8. */
static lam_status add_name(imported_faces *s, name_table *names, const char *name, size_t length,
                           uint32_t *index, lam_error *error) {
    lam_status status = LAM_OK;
    char *text = NULL;
    if (utf8_is_valid(name, length)) return name_table_add(names, name, length, index, error);
    text = memory_allocate(length, 2, "a name", error);
    if (text == NULL) return LAM_ERR_MEMORY;
    const size_t before = names->n;
    TRY(name_table_add(names, text, utf8_of_latin1(name, length, text), index, error));
    s->latin1 += names->n > before;
done:
    free(text);
    return status;
}

lam_status imported_faces_add_object(imported_faces *s, const char *name, size_t length, uint32_t *index,
                                     lam_error *error) {
    return add_name(s, &s->objects, name, length, index, error);
}

lam_status imported_faces_add_material(imported_faces *s, const char *name, size_t length, uint32_t *index,
                                       lam_error *error) {
    const size_t before = s->materials.n;
    lam_status status = add_name(s, &s->materials, name, length, index, error);
    if (status != LAM_OK || s->materials.n == before) return status;
    if (array_grow(&s->values, &s->value_capacity, s->materials.n, sizeof *s->values, "materials", error) !=
        LAM_OK)
        return LAM_ERR_MEMORY;
    s->values[*index] = (imported_material){0};
    return LAM_OK;
}

/* The longest beginning of a name of at most most bytes that is whole in UTF-8. */
static size_t whole_length(const char *name, size_t most) {
    size_t length = strlen(name);
    if (length <= most) return length;
    for (length = most; length > 0 && ((unsigned char)name[length] & 0xC0u) == 0x80u;) length--;
    return length;
}

lam_status imported_faces_add_camera(imported_faces *s, const char *path, const scene_camera *camera,
                                     lam_error *error) {
    lam_status status = LAM_OK;
    scene_camera made = *camera;
    if (!scene_camera_settle(&made) || s->n_cameras == SCENE_CAMERAS_MOST) {
        import_warn(&s->warnings, "%s: the camera '%s' is left out: %s", path, camera->name,
                    s->n_cameras == SCENE_CAMERAS_MOST ? "there are too many"
                                                       : "its place or field of view is not usable");
        goto done;
    }
    for (unsigned k = 2; scene_camera_find(s->n_cameras, s->cameras, made.name) != NULL; k++) {
        const size_t length = whole_length(camera->name, sizeof made.name - 12);
        snprintf(made.name, sizeof made.name, "%.*s-%u", (int)length, camera->name, k);
    }
    TRY(array_grow(&s->cameras, &s->camera_capacity, s->n_cameras + 1, sizeof *s->cameras, "cameras", error));
    s->cameras[s->n_cameras++] = made;
done:
    return status;
}

lam_status imported_faces_add_skin(imported_faces *s, const imported_corner *corners, lam_error *error) {
    const size_t polygon = s->n_polygons - 1, n = s->polygons[polygon].n_corners;
    if (array_grow(&s->skins, &s->skin_capacity, s->n_skins + 1, sizeof *s->skins, "faces", error) != LAM_OK)
        return LAM_ERR_MEMORY;
    if (array_grow(&s->skin_corners, &s->skin_corner_capacity, s->n_skin_corners + n, sizeof *s->skin_corners,
                   "face corners", error) != LAM_OK)
        return LAM_ERR_MEMORY;
    memcpy(s->skin_corners + s->n_skin_corners, corners, n * sizeof *corners);
    s->skins[s->n_skins++] = (struct imported_skin){polygon, s->n_skin_corners};
    s->n_skin_corners += n;
    return LAM_OK;
}

/* The corner of a polygon at a vertex. A polygon that visits it twice may have another there. */
static const imported_corner *skin_corner(const imported_faces *s, const struct imported_polygon *polygon,
                                          const struct imported_skin *skin, uint32_t vertex) {
    size_t c = 0;
    while (c + 1 < polygon->n_corners && s->corners[polygon->first + c] != vertex) c++;
    return &s->skin_corners[skin->first + c];
}

/* The place and the skin of a piece's corners, with coordinates of images. */
typedef struct skinned_piece {
    size_t n;
    double p[4][3];
    imported_corner corners[4];
} skinned_piece;

static skinned_piece skin_piece(const imported_faces *s, const struct imported_polygon *polygon,
                                const struct imported_skin *skin, const uint32_t piece[4]) {
    skinned_piece out = {.n = piece[3] == TABLE_NONE ? 3 : 4};
    for (size_t k = 0; k < out.n; k++) {
        memcpy(out.p[k], s->vertices[piece[k]], sizeof out.p[k]);
        out.corners[k] = *skin_corner(s, polygon, skin, piece[k]);
        for (int q = 0; q < TEXTURE_QUANTITIES; q++) {
            const double u = out.corners[k].uv[q][0], v = out.corners[k].uv[q][1];
            const double(*t)[3] = (const double(*)[3])s->values[polygon->material].textures[q].transform;
            for (int d = 0; d < 2; d++) out.corners[k].uv[q][d] = t[d][0] * u + t[d][1] * v + t[d][2];
        }
    }
    return out;
}

/* The affine maps of a piece that was just added as an element. */
static lam_status add_face(imported_faces *s, const skinned_piece *piece, uint32_t material,
                           lam_error *error) {
    lam_status status = LAM_OK;
    const imported_corner *c = piece->corners;
    const double(*p)[3] = (const double(*)[3])piece->p;
    texture_face face = {.surface = material};
    const size_t stride = sizeof *c / sizeof(double);
    memcpy(face.origin, p[0], sizeof face.origin);
    for (int q = 0; q < TEXTURE_QUANTITIES; q++)
        for (int d = 0; d < 2; d++) texture_affine(piece->n, p, &c->uv[q][d], stride, face.uv[q][d]);
    for (int d = 0; d < 3; d++) texture_affine(piece->n, p, &c->colour[d], stride, face.colour[d]);
    TRY(array_grow(&s->faces, &s->face_capacity, s->n_faces + 1, sizeof *s->faces, "faces", error));
    TRY(array_grow(&s->face_elements, &s->face_element_capacity, s->n_faces + 1, sizeof *s->face_elements,
                   "faces", error));
    s->face_elements[s->n_faces] = (uint32_t)(s->n_elements - 1);
    s->faces[s->n_faces++] = face;
done:
    return status;
}

static bool is_affine(const skinned_piece *piece) {
    const imported_corner *c = piece->corners;
    const size_t stride = sizeof *c / sizeof(double);
    for (size_t k = 0; k < stride; k++)
        if (!texture_is_affine((const double(*)[3])piece->p, (const double *)c + k, stride)) return false;
    return true;
}

/* skin: of the polygon, or NULL. A quad on which an image is bent becomes two triangles. */
static lam_status add_element(imported_faces *s, const uint32_t piece[4],
                              const struct imported_polygon *polygon, const struct imported_skin *skin,
                              lam_error *error) {
    lam_status status = LAM_OK;
    struct imported_element element = {
        {0, 0, 0, TABLE_NONE}, polygon->object, polygon->material, (uint32_t)(polygon - s->polygons)};
    skinned_piece skinned = {.n = 0};
    if (skin != NULL) skinned = skin_piece(s, polygon, skin, piece);
    if (skinned.n == 4 && !is_affine(&skinned)) {
        const uint32_t halves[2][4] = {{piece[0], piece[1], piece[2], TABLE_NONE},
                                       {piece[0], piece[2], piece[3], TABLE_NONE}};
        for (int h = 0; h < 2; h++) TRY(add_element(s, halves[h], polygon, skin, error));
        return LAM_OK;
    }
    for (int k = 0; k < 4 && piece[k] != TABLE_NONE; k++)
        TRY(point_table_add(&s->points, s->vertices[piece[k]], &element.corners[k], error));
    TRY(array_grow(&s->elements, &s->element_capacity, s->n_elements + 1, sizeof *s->elements, "elements",
                   error));
    s->elements[s->n_elements++] = element;
    if (skin != NULL) TRY(add_face(s, &skinned, polygon->material, error));
done:
    return status;
}

/* Checks indices, coordinates and emptiness for every format; extent is the diagonal of the box around used
 * vertices. */
static lam_status check_polygons(const imported_faces *s, const char *path, double *extent,
                                 lam_error *error) {
    lam_status status = LAM_OK;
    double low[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    for (size_t v = 0; v < s->n_vertices; v++)
        for (int k = 0; k < 3; k++)
            if (!(fabs(s->vertices[v][k]) < 1e30)) /* the square of a larger coordinate would overflow */
                FAIL(error, LAM_ERR_FORMAT, "%s: vertex %zu: coordinate %g is not a usable number", path, v,
                     s->vertices[v][k]);
    for (size_t i = 0; i < s->n_polygons; i++) {
        const struct imported_polygon *polygon = &s->polygons[i];
        for (size_t c = 0; c < polygon->n_corners; c++) {
            const uint32_t v = s->corners[polygon->first + c];
            if (v >= s->n_vertices && polygon->line > 0)
                FAIL(error, LAM_ERR_FORMAT, "%s:%u: face refers to vertex %zu, there are %zu", path,
                     polygon->line, (size_t)v + 1, s->n_vertices);
            if (v >= s->n_vertices)
                FAIL(error, LAM_ERR_FORMAT, "%s: face %zu refers to vertex %u, there are %zu", path, i, v,
                     s->n_vertices);
            for (int k = 0; k < 3; k++) {
                low[k] = fmin(low[k], s->vertices[v][k]);
                high[k] = fmax(high[k], s->vertices[v][k]);
            }
        }
    }
    if (s->n_polygons == 0)
        FAIL(error, LAM_ERR_FORMAT,
             "%s: the scene is empty: it has no faces; check that the file is of the format that its "
             "extension "
             "names and that its surfaces were exported",
             path);
    *extent = sqrt((high[0] - low[0]) * (high[0] - low[0]) + (high[1] - low[1]) * (high[1] - low[1]) +
                   (high[2] - low[2]) * (high[2] - low[2]));
done:
    return status;
}

/* A polygon of more than four corners, and its corner that comes first in a total order of points. */
typedef struct wide_polygon {
    XXH64_hash_t hash; /* of its corners from there on */
    size_t polygon;
    uint32_t start;
} wide_polygon;

static int by_hash(const void *a, const void *b) {
    const wide_polygon *p = a, *q = b;
    if (p->hash != q->hash) return p->hash < q->hash ? -1 : 1;
    return (p->polygon > q->polygon) - (p->polygon < q->polygon);
}

static const double *corner_of(const imported_faces *s, const wide_polygon *w, size_t k) {
    const struct imported_polygon *polygon = &s->polygons[w->polygon];
    return s->vertices[s->corners[polygon->first + (w->start + k) % polygon->n_corners]];
}

static wide_polygon wide_of(const imported_faces *s, size_t polygon) {
    wide_polygon w = {.polygon = polygon}, other = w;
    const size_t n = s->polygons[polygon].n_corners;
    for (other.start = 1; other.start < n; other.start++) {
        const double *p = corner_of(s, &other, 0), *q = corner_of(s, &w, 0);
        int d = 0;
        while (d < 2 && p[d] == q[d]) d++;
        if (p[d] < q[d]) w.start = other.start;
    }
    for (size_t k = 0; k < n; k++)
        w.hash = XXH3_64bits_withSeed(corner_of(s, &w, k), sizeof *s->vertices, w.hash);
    return w;
}

static bool are_twins(const imported_faces *s, const wide_polygon *a, const wide_polygon *b) {
    const size_t n = s->polygons[a->polygon].n_corners;
    if (a->hash != b->hash || s->polygons[b->polygon].n_corners != n) return false;
    for (size_t k = 0; k < n; k++)
        if (memcmp(corner_of(s, a, k), corner_of(s, b, k), sizeof *s->vertices) != 0) return false;
    return true;
}

/* A polygon that is written twice is cut into the same pieces, which are then found to be equal: it begins
 * with the corner that its twin before it begins with. O(n log n) of polygons of more than four corners. */
static lam_status align_twins(imported_faces *s, lam_error *error) {
    lam_status status = LAM_OK;
    wide_polygon *wide = NULL;
    uint32_t *turned = NULL;
    size_t n = 0, room = 0, turned_room = 0;
    for (size_t i = 0; i < s->n_polygons && s->n_skins == 0; i++) {
        if (s->polygons[i].n_corners <= 4) continue;
        TRY(array_grow(&wide, &room, n + 1, sizeof *wide, "faces", error));
        wide[n++] = wide_of(s, i);
    }
    if (n > 1) qsort(wide, n, sizeof *wide, by_hash);
    for (size_t k = 1; k < n; k++) {
        if (!are_twins(s, &wide[k - 1], &wide[k])) continue;
        const size_t corners = s->polygons[wide[k].polygon].n_corners;
        uint32_t *of = s->corners + s->polygons[wide[k].polygon].first;
        TRY(array_grow(&turned, &turned_room, corners, sizeof *turned, "face corners", error));
        for (size_t c = 0; c < corners; c++)
            turned[c] = of[(c + wide[k].start + corners - wide[k - 1].start) % corners];
        memcpy(of, turned, corners * sizeof *of);
        wide[k].start = wide[k - 1].start;
    }
done:
    free(wide);
    free(turned);
    return status;
}

lam_status imported_faces_split(imported_faces *s, const char *path, lam_error *error) {
    lam_status status = LAM_OK;
    polygon_split_scratch scratch = {0};
    double extent = 0;
    size_t next = 0; /* skin */
    TRY(check_polygons(s, path, &extent, error));
    TRY(align_twins(s, error));
    for (size_t i = 0; i < s->n_polygons; i++) {
        const struct imported_polygon *polygon = &s->polygons[i];
        TRY(polygon_split((const double(*)[3])s->vertices, s->corners + polygon->first, polygon->n_corners,
                          1e-14 * extent * extent, false, &scratch, error));
        const bool has_skin = next < s->n_skins && s->skins[next].polygon == i;
        const struct imported_skin *skin = has_skin ? &s->skins[next++] : NULL;
        if (scratch.n_pieces == 0) s->dropped++;
        for (size_t p = 0; p < scratch.n_pieces; p++)
            TRY(add_element(s, scratch.pieces[p], polygon, skin, error));
    }
    if (s->n_elements == 0)
        FAIL(error, LAM_ERR_FORMAT, "%s: the scene is empty: none of its %zu faces has an area", path,
             s->n_polygons);
done:
    polygon_split_scratch_free(&scratch);
    return status;
}
