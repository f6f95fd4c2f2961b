#include "tests/bench/suites/scenes.h"

#include "solver/base/random.h"
#include "solver/scene/import/import.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static lam_status plain_materials(mesh *m, lam_error *error) {
    m->n_channels = 1;
    m->unit = 1;
    m->up = 'z';
    m->group = memory_allocate(m->n, sizeof *m->group, "scene", error);
    m->reflectance = memory_allocate(m->n, sizeof *m->reflectance, "scene", error);
    m->emission = memory_allocate(m->n, sizeof *m->emission, "scene", error);
    if (m->group == NULL || m->reflectance == NULL || m->emission == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < m->n; i++) m->reflectance[i] = .5f;
    return LAM_OK;
}

lam_status scene_of_pieces(const scene_piece *pieces, size_t n, mesh *out, lam_error *error) {
    lam_status status = LAM_OK;
    mesh m = {.n = n};
    m.vertices = memory_allocate(n, 4 * sizeof *m.vertices, "scene", error);
    m.elements = memory_allocate(n, sizeof *m.elements, "scene", error);
    if (m.vertices == NULL || m.elements == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < n; i++) {
        const scene_piece *p = &pieces[i];
        /* corner, + along, + both (not of a triangle), + across */
        for (int k = 0; k < 4; k++) {
            m.elements[i][k] = MESH_NO_VERTEX;
            if (p->triangle && k == 2) continue;
            const int place = p->triangle && k == 3 ? 2 : k;
            for (int d = 0; d < 3; d++)
                m.vertices[m.n_vertices][d] = p->corner[d] + (k == 1 || k == 2 ? p->along[d] : 0) +
                                              (k == 2 || k == 3 ? p->across[d] : 0);
            m.elements[i][place] = (uint32_t)m.n_vertices++;
        }
    }
    TRY(mesh_measure(&m, error));
    TRY(plain_materials(&m, error));
    *out = m;
    m = (mesh){0};
done:
    mesh_free(&m);
    return status;
}

/* A lot is 4 x 4 cells of 1 m; the middle 2 x 2 of them carry a house. */
enum { LOT = 4, STOREYS_MOST = 6, LOT_MOST_PIECES = 12 + 4 + 8 * STOREYS_MOST };

static size_t add_square(scene_piece *pieces, double x, double y, double z, const double along[3],
                         const double across[3]) {
    *pieces = (scene_piece){.corner = {x, y, z}};
    memcpy(pieces->along, along, sizeof pieces->along);
    memcpy(pieces->across, across, sizeof pieces->across);
    return 1;
}

static size_t add_lot(scene_piece *pieces, double x, double y, int storeys) {
    static const double east[3] = {1, 0, 0}, north[3] = {0, 1, 0}, west[3] = {-1, 0, 0},
                        south[3] = {0, -1, 0}, up[3] = {0, 0, 1};
    size_t n = 0;
    for (int i = 0; i < LOT; i++)
        for (int k = 0; k < LOT; k++) {
            const bool house = i > 0 && i < LOT - 1 && k > 0 && k < LOT - 1;
            n += add_square(pieces + n, x + i, y + k, house ? storeys : 0, east, north);
        }
    for (int z = 0; z < storeys; z++)
        for (int k = 0; k < LOT - 2; k++) {
            n += add_square(pieces + n, x + 1 + k, y + 1, z, east, up);             /* faces south */
            n += add_square(pieces + n, x + LOT - 1 - k, y + LOT - 1, z, west, up); /* north */
            n += add_square(pieces + n, x + LOT - 1, y + 1 + k, z, north, up);      /* east */
            n += add_square(pieces + n, x + 1, y + LOT - 1 - k, z, south, up);      /* west */
        }
    return n;
}

lam_status scene_houses(size_t lots, uint64_t seed, mesh *out, lam_error *error) {
    lam_status status = LAM_OK;
    scene_piece *pieces = NULL;
    size_t most, n = 0;
    if (!size_multiply(lots, lots, &most) || !size_multiply(most, LOT_MOST_PIECES, &most))
        FAIL(error, LAM_ERR_MEMORY, "%zu x %zu houses: too many", lots, lots);
    pieces = memory_allocate(most, sizeof *pieces, "scene", error);
    if (pieces == NULL) TRY(LAM_ERR_MEMORY);
    uint64_t state = seed;
    for (size_t i = 0; i < lots; i++)
        for (size_t k = 0; k < lots; k++) {
            const int storeys = 1 + (int)((random_lcg(&state) >> 33) % STOREYS_MOST);
            n += add_lot(pieces + n, (double)(LOT * i), (double)(LOT * k), storeys);
        }
    TRY(scene_of_pieces(pieces, n, out, error));
done:
    free(pieces);
    return status;
}

/* Six parallelograms of a box, fronts outwards or inwards. */
static size_t add_box(scene_piece *pieces, const double low[3], const double high[3], bool inwards) {
    for (size_t k = 0; k < 6; k++) {
        const size_t axis = k / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
        const bool upper = k % 2 == 1;
        scene_piece p = {.triangle = false};
        memcpy(p.corner, low, sizeof p.corner);
        if (upper) p.corner[axis] = high[axis];
        /* u x v points along the axis */
        double *first = upper != inwards ? p.along : p.across,
               *second = upper != inwards ? p.across : p.along;
        first[u] = high[u] - low[u];
        second[v] = high[v] - low[v];
        pieces[k] = p;
    }
    return 6;
}

/* The room's walls, the lamp, and its furniture. The lamp hangs 2 cm below the ceiling, so that nothing
 * touches it; the furniture stands 1 mm apart. */
enum { LEGS = 4, BOXES = 5 + LEGS };
static const double room_boxes[BOXES][2][3] = {
    {{2.4, 1.6, 2.94}, {3.4, 2.6, 2.98}},   {{1.2, 1, .72}, {2.8, 1.9, .76}},
    {{3.4, 3.3, .001}, {5.2, 3.95, 1.9}},   {{4.2, .3, .001}, {5, 1.1, .45}},
    {{4.9, .3, .451}, {5, 1.1, .95}},       {{1.25, 1.05, .001}, {1.3, 1.1, .719}},
    {{1.25, 1.8, .001}, {1.3, 1.85, .719}}, {{2.7, 1.05, .001}, {2.75, 1.1, .719}},
    {{2.7, 1.8, .001}, {2.75, 1.85, .719}}};
static const double room_origin[3] = {0, 0, 0}, room_size[3] = {6, 4, 3};

lam_status scene_furnished(mesh *out, lam_error *error) {
    lam_status status = LAM_OK;
    scene_piece pieces[6 * (1 + BOXES)];
    mesh m = {0};
    size_t n = add_box(pieces, room_origin, room_size, true);
    for (size_t k = 0; k < BOXES; k++) n += add_box(pieces + n, room_boxes[k][0], room_boxes[k][1], false);
    TRY(scene_of_pieces(pieces, n, &m, error));
    for (size_t i = 0; i < n; i++) m.reflectance[i] = i < 6 ? .6f : .4f;
    m.emission[6 + 4] = 100; /* the lower side of the lamp */
    *out = m;
    m = (mesh){0};
done:
    mesh_free(&m);
    return status;
}

lam_status scene_window(mesh *out, lam_error *error) {
    static const double y[4] = {0, 1.25, 2.75, 4}, z[4] = {0, 1, 2.2, 3};
    lam_status status = LAM_OK;
    scene_piece pieces[6 * BOXES + 8];
    mesh m = {0};
    size_t n = add_box(pieces, room_origin, room_size, true);
    const scene_piece last = pieces[n - 1];
    for (size_t k = 1; k < BOXES; k++) n += add_box(pieces + n, room_boxes[k][0], room_boxes[k][1], false);
    /* The wall x = 0 gives its place to another one, and then come eight parts of it about the window. */
    pieces[0] = last;
    pieces[5] = pieces[--n];
    for (size_t i = 0; i < 3; i++)
        for (size_t k = 0; k < 3; k++) {
            if (i == 1 && k == 1) continue;
            pieces[n++] = (scene_piece){.corner = {0, y[i], z[k]},
                                        .along = {0, y[i + 1] - y[i], 0},
                                        .across = {0, 0, z[k + 1] - z[k]}};
        }
    TRY(scene_of_pieces(pieces, n, &m, error));
    for (size_t i = 0; i < n; i++) m.reflectance[i] = .6f;
    *out = m;
    m = (mesh){0};
done:
    mesh_free(&m);
    return status;
}

lam_status scene_file(const char *path, mesh *out, lam_error *error) {
    const import_options how = {.unit = 1, .reflectance = -1};
    import_report report = {0};
    return scene_import(path, &how, out, &report, error);
}

lam_status scene_generated(const generate_options *how, mesh *out, lam_error *error) {
    lam_status status = LAM_OK;
    const char *parent = getenv("TMPDIR");
    char folder[4096], path[4200] = "", materials[4200] = "";
    if (parent == NULL || parent[0] == '\0') parent = "/tmp";
    if ((size_t)snprintf(folder, sizeof folder, "%s/lambert-bench-XXXXXX", parent) >= sizeof folder ||
        mkdtemp(folder) == NULL)
        return status_fail(error, LAM_ERR_IO, "%s: cannot make a folder in it: %s; set TMPDIR", parent,
                           strerror(errno));
    snprintf(path, sizeof path, "%s/scene.obj", folder);
    snprintf(materials, sizeof materials, "%s/scene.mtl", folder);
    TRY(scene_generate(how, path, NULL, error));
    TRY(scene_file(path, out, error));
done:
    unlink(path);
    unlink(materials);
    rmdir(folder);
    return status;
}

lam_status scene_cornell(size_t elements, mesh *out, lam_error *error) {
    const generate_options how = {.kind = "cornell", .elements = elements, .reflectance = -1, .seed = 1};
    return scene_generated(&how, out, error);
}
