#include "solver/scene/import/gltf_amount.h"

#include "solver/base/vector3.h"

#include <math.h>
#include <stdio.h>

enum { TRIANGLES = 4, STRIP = 5, FAN = 6 };

/* Corners of a primitive: those of its indices, or all of its vertices in their order. */
typedef struct corners {
    gltf_values position, index;
    bool indexed;
    size_t n;
    const gltf_transform *placed;
} corners;

/* False where the file has no such corner. */
static bool place_corner(const corners *c, size_t k, double out[3]) {
    const double vertex = c->indexed ? gltf_value(&c->index, k, 0) : (double)k;
    if (!(vertex >= 0 && vertex < (double)c->position.n)) return false;
    for (int d = 0; d < 3; d++) out[d] = c->placed->a[d][3];
    for (size_t i = 0; i < 3; i++) {
        const double x = gltf_value(&c->position, (size_t)vertex, i);
        for (int d = 0; d < 3; d++) out[d] += c->placed->a[d][i] * x;
    }
    return true;
}

/* NAN where a corner is missing. */
static double area_of(const corners *c, unsigned mode) {
    const size_t step = mode == TRIANGLES ? 3 : 1;
    double area = 0;
    for (size_t k = 0; k + 2 < c->n; k += step) {
        double p[3][3], u[3], v[3], normal[3];
        const size_t first = mode == FAN ? 0 : k;
        if (!place_corner(c, first, p[0]) || !place_corner(c, k + 1, p[1]) || !place_corner(c, k + 2, p[2]))
            return NAN;
        subtract3(p[1], p[0], u);
        subtract3(p[2], p[0], v);
        cross3(u, v, normal);
        area += sqrt(dot3(normal, normal)) / 2;
    }
    return area;
}

/* Triangles by the counts of accessors, which compressed meshes have too. */
static double faces_of(const gltf_file *g, const json_t *primitive, unsigned mode) {
    const json_t *index = json_object_get(primitive, "indices");
    if (index == NULL) index = json_object_get(json_object_get(primitive, "attributes"), "POSITION");
    const double n = gltf_number(json_object_get(gltf_entry(g, "accessors", index), "count"), 0);
    const double faces = mode == TRIANGLES ? floor(n / 3) : n - 2;
    return faces > 0 && faces < 1e15 ? faces : 0;
}

gltf_amount gltf_amount_of(gltf_file *g, const json_t *primitive, const gltf_transform *placed) {
    const double given = gltf_number(json_object_get(primitive, "mode"), TRIANGLES);
    const json_t *at = json_object_get(json_object_get(primitive, "attributes"), "POSITION");
    const json_t *indices = json_object_get(primitive, "indices");
    corners c = {.placed = placed, .indexed = indices != NULL};
    if (!(given >= TRIANGLES && given <= FAN)) return (gltf_amount){.faces = 0};
    const unsigned mode = (unsigned)given;
    gltf_amount out = {.faces = faces_of(g, primitive, mode), .area = NAN};
    const bool found =
        gltf_find_values(g, gltf_entry(g, "accessors", at), &c.position) && c.position.width == 3 &&
        (!c.indexed ||
         (gltf_find_values(g, gltf_entry(g, "accessors", indices), &c.index) && c.index.width == 1));
    c.n = c.indexed ? c.index.n : c.position.n;
    if (found) out.area = area_of(&c, mode);
    out.blind = !isfinite(out.area);
    if (out.blind) out.area = 0;
    return out;
}

void gltf_amount_add(gltf_amount *sum, const gltf_amount *more) {
    sum->faces += more->faces;
    sum->area += more->area;
    sum->blind = sum->blind || more->blind;
}

void gltf_amount_text(const gltf_amount *part, const gltf_amount *all, double unit,
                      char text[GLTF_AMOUNT_TEXT]) {
    const double square = unit * unit;
    const int n = snprintf(text, GLTF_AMOUNT_TEXT, "%.0f of %.0f faces", part->faces, all->faces);
    char *end = text + n;
    const size_t left = (size_t)(GLTF_AMOUNT_TEXT - n);
    if (part->blind)
        snprintf(end, left,
                 ", of an area that is not known: their vertices are compressed, sparse or missing");
    else if (unit > 0 && all->blind)
        snprintf(end, left, ", %.4g m2", part->area * square);
    else if (unit > 0)
        snprintf(end, left, ", %.4g of %.4g m2", part->area * square, all->area * square);
    else if (!all->blind && all->area > 0)
        snprintf(end, left, ", %.2g %% of the area", 100 * part->area / all->area);
}
