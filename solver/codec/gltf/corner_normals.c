#include "solver/codec/gltf/corner_normals.h"

#include "solver/base/array_grow.h"
#include "solver/base/union_find.h"
#include "store/status.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Elements that meet at less than 30 degrees are one surface: its cosine. */
static const double surface_cos = 0.86602540378443865;

/* Each corner at a position is compared with at most this many previous ones. */
enum { MANY_CORNERS = 256 };

#define NONE 0xFFFFFFFFu

/* Turns a vector to y up: z up has its north (+y) at -z afterwards, as glTF and a scene of y up have it. */
static void turn(char up, const double from[3], float to[3]) {
    const double x = up == 'x' ? -from[1] : from[0],
                 y = up == 'x'   ? from[0]
                     : up == 'y' ? from[1]
                                 : from[2],
                 z = up == 'z' ? -from[1] : from[2];
    /* -0 becomes 0, so that equal vectors have equal bits. */
    to[0] = (float)x + 0.f;
    to[1] = (float)y + 0.f;
    to[2] = (float)z + 0.f;
}

static lam_status turn_positions(const gltf_mesh *m, float (*position)[3], lam_error *error) {
    lam_status status = LAM_OK;
    for (size_t v = 0; v < m->n_vertices; v++) {
        turn(m->up, m->vertices[v], position[v]);
        for (int d = 0; d < 3; d++)
            if (!isfinite(position[v][d]))
                FAIL(error, LAM_ERR_ARGUMENT, "vertices[%zu] = %g, %g, %g: glTF holds floats", v,
                     m->vertices[v][0], m->vertices[v][1], m->vertices[v][2]);
    }
done:
    return status;
}

static size_t hash(const float position[3], size_t mask) {
    uint32_t bits[3];
    memcpy(bits, position, sizeof bits);
    uint64_t h = bits[0];
    for (int d = 1; d < 3; d++) {
        h = (h ^ (h >> 29)) * 0x9E3779B97F4A7C15u;
        h ^= bits[d];
    }
    h *= 0x9E3779B97F4A7C15u;
    return (size_t)(h ^ (h >> 32)) & mask;
}

/* Finds the first vertex at each position: bits are compared, as those who read the file do. */
static lam_status weld(corner_normals *s, lam_error *error) {
    size_t heads = 16;
    while (heads < 2 * s->m->n_vertices) heads *= 2;
    uint32_t *head = memory_allocate(heads, sizeof *head, "normals", error);
    if (head == NULL) return LAM_ERR_MEMORY;
    memset(head, 0xFF, heads * sizeof *head);
    for (uint32_t v = 0; v < s->m->n_vertices; v++) {
        size_t at = hash(s->position[v], heads - 1);
        while (head[at] != NONE && memcmp(s->position[head[at]], s->position[v], sizeof *s->position) != 0)
            at = (at + 1) & (heads - 1);
        if (head[at] == NONE) head[at] = v;
        s->welded[v] = head[at];
    }
    free(head);
    return LAM_OK;
}

size_t gltf_largest_group(const group_index *groups) {
    size_t largest = 0;
    for (size_t g = 0; g < groups->n_groups; g++) {
        const size_t count = groups->start[g + 1] - groups->start[g];
        if (count > largest) largest = count;
    }
    return largest;
}

lam_status corner_normals_create(const gltf_mesh *m, corner_normals *out, lam_error *error) {
    lam_status status = LAM_OK;
    corner_normals made = {.m = m};
    const size_t largest = gltf_largest_group(m->groups);
    made.position = memory_allocate(m->n_vertices, sizeof *made.position, "positions", error);
    made.welded = memory_allocate(m->n_vertices, sizeof *made.welded, "normals", error);
    made.first = memory_allocate(m->n_vertices, sizeof *made.first, "normals", error);
    made.next = memory_allocate(largest, 4 * sizeof *made.next, "normals", error);
    if (made.position == NULL || made.welded == NULL || made.first == NULL || made.next == NULL)
        TRY(LAM_ERR_MEMORY);
    memset(made.first, 0xFF, m->n_vertices * sizeof *made.first);
    TRY(turn_positions(m, made.position, error));
    TRY(weld(&made, error));
    *out = made;
    made = (corner_normals){0};
done:
    corner_normals_free(&made);
    return status;
}

void corner_normals_free(corner_normals *s) {
    free(s->position);
    free(s->welded);
    free(s->first);
    free(s->next);
    free(s->around);
    free(s->parent);
    free(s->normal);
    *s = (corner_normals){0};
}

static bool normalise(double v[3]) {
    const double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    if (!(length > 1e-30) || !isfinite(length)) return false;
    for (int d = 0; d < 3; d++) v[d] /= length;
    return true;
}

/* The unit normal of an element: that of the store or, where that is none, of its corners (Newell's sum), or
 * any. */
static void unit_normal(const gltf_mesh *m, size_t element, double out[3]) {
    const uint32_t *e = m->elements[element];
    const size_t corners = e[3] == GLTF_NO_VERTEX ? 3 : 4;
    for (int d = 0; d < 3; d++) out[d] = (double)m->normal[element][d];
    if (normalise(out)) return;
    memset(out, 0, 3 * sizeof *out);
    for (size_t k = 0; k < corners; k++) {
        const double *a = m->vertices[e[k]], *b = m->vertices[e[(k + 1) % corners]];
        for (int d = 0; d < 3; d++) {
            const int x = (d + 1) % 3, y = (d + 2) % 3;
            out[d] += (a[x] - b[x]) * (a[y] + b[y]);
        }
    }
    if (normalise(out)) return;
    out[0] = out[1] = 0;
    out[2] = 1;
}

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static const uint32_t *elements_of(const corner_normals *s, size_t g) {
    return s->m->groups->elements + s->m->groups->start[g];
}

/* Sets the normals of the `count` corners of a group that stand at one position, in s->around. */
static void join(corner_normals *s, size_t g, size_t count, float (*normals)[3]) {
    const uint32_t *elements = elements_of(s, g);
    for (size_t i = 0; i < count; i++) {
        unit_normal(s->m, elements[s->around[i] / 4], s->normal[i]);
        s->parent[i] = (uint32_t)i;
    }
    for (size_t i = 0; i < count; i++)
        for (size_t j = i > MANY_CORNERS ? i - MANY_CORNERS : 0; j < i; j++)
            if (dot(s->normal[i], s->normal[j]) > surface_cos)
                (void)union_find_join(s->parent, (uint32_t)i, (uint32_t)j);
    for (size_t i = 0; i < count; i++) {
        if (union_find_root(s->parent, (uint32_t)i) != i) continue; /* its first corner made the mean */
        double sum[3] = {0, 0, 0};
        float turned[3];
        for (size_t j = i; j < count; j++) {
            const double area = s->m->area[elements[s->around[j] / 4]];
            if (union_find_root(s->parent, (uint32_t)j) != i) continue;
            for (int d = 0; d < 3; d++) sum[d] += area * s->normal[j][d];
        }
        /* The normals of a chain of elements may cancel each other. */
        if (!normalise(sum)) memcpy(sum, s->normal[i], sizeof sum);
        turn(s->m->up, sum, turned);
        for (size_t j = i; j < count; j++)
            if (union_find_root(s->parent, (uint32_t)j) == i)
                memcpy(normals[s->around[j]], turned, sizeof turned);
    }
}

/* Collects the corners at a position in ascending order and takes them out of the lists. */
static lam_status take_around(corner_normals *s, uint32_t *first, size_t *count, lam_error *error) {
    lam_status status = LAM_OK;
    size_t n = 0, rooms[2] = {s->room, s->room};
    for (uint32_t at = *first; at != NONE; at = s->next[at]) n++;
    if (n > s->room) {
        TRY(array_grow(&s->around, &rooms[0], n, sizeof *s->around, "normals", error));
        TRY(array_grow(&s->parent, &rooms[1], n, sizeof *s->parent, "normals", error));
        TRY(array_grow(&s->normal, &s->room, n, sizeof *s->normal, "normals", error));
    }
    *count = n;
    for (uint32_t at = *first; at != NONE; at = s->next[at]) s->around[--n] = at;
    *first = NONE;
done:
    return status;
}

lam_status corner_normals_of_group(corner_normals *s, size_t g, float (*normals)[3], lam_error *error) {
    lam_status status = LAM_OK;
    const uint32_t *elements = elements_of(s, g);
    const size_t count = s->m->groups->start[g + 1] - s->m->groups->start[g];
    for (uint32_t j = 0; j < count; j++)
        for (uint32_t k = 0; k < 4; k++) {
            const uint32_t v = s->m->elements[elements[j]][k];
            if (v == GLTF_NO_VERTEX) continue;
            uint32_t *first = &s->first[s->welded[v]];
            s->next[4 * j + k] = *first;
            *first = 4 * j + k;
        }
    for (uint32_t j = 0; j < count; j++)
        for (uint32_t k = 0; k < 4; k++) {
            const uint32_t v = s->m->elements[elements[j]][k];
            size_t around;
            if (v == GLTF_NO_VERTEX || s->first[s->welded[v]] == NONE) continue;
            TRY(take_around(s, &s->first[s->welded[v]], &around, error));
            join(s, g, around, normals);
        }
done:
    return status;
}
