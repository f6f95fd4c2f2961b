#include "support/small_gltf.h"

#include "support/request_text.h"
#include "support/suite.h"

#include <math.h>
#include <string.h>

static void cross(const double a[3], const double b[3], double out[3]) {
    for (int d = 0; d < 3; d++) out[d] = a[(d + 1) % 3] * b[(d + 2) % 3] - a[(d + 2) % 3] * b[(d + 1) % 3];
}

double small_gltf_facing(const double a[3], const double b[3], const double c[3], double out[3]) {
    const double u[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]},
                 v[3] = {c[0] - a[0], c[1] - a[1], c[2] - a[2]};
    cross(u, v, out);
    const double length = sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2]);
    for (int d = 0; d < 3; d++) out[d] /= length;
    return length / 2;
}

void small_gltf_element(small_gltf *s, uint32_t group, uint32_t a, uint32_t b, uint32_t c, uint32_t d) {
    const size_t i = s->m.n++;
    double normal[3], other[3];
    memcpy(s->elements[i], (uint32_t[4]){a, b, c, d}, sizeof s->elements[i]);
    s->group[i] = group;
    s->area[i] = small_gltf_facing(s->vertices[a], s->vertices[b], s->vertices[c], normal);
    if (d != GLTF_NO_VERTEX)
        s->area[i] += small_gltf_facing(s->vertices[a], s->vertices[c], s->vertices[d], other);
    for (int k = 0; k < 3; k++) s->normal[i][k] = (float)normal[k];
}

uint32_t small_gltf_vertex(small_gltf *s, double x, double y, double z) {
    memcpy(s->vertices[s->m.n_vertices], (double[3]){x, y, z}, sizeof s->vertices[0]);
    return (uint32_t)s->m.n_vertices++;
}

const gltf_mesh *small_gltf_finish(small_gltf *s, size_t n_groups, const char *const *names) {
    s->groups = named_groups(s->m.n, s->group, n_groups, names);
    s->m.groups = &s->groups;
    s->m.vertices = (const double(*)[3])s->vertices;
    s->m.elements = (const uint32_t(*)[4])s->elements;
    s->m.normal = (const float(*)[3])s->normal;
    s->m.area = s->area;
    s->m.reflectance = s->reflectance;
    s->m.emission = s->emission;
    if (s->m.n_channels == 0) s->m.n_channels = 1;
    if (s->m.up == 0) s->m.up = 'y';
    if (s->m.name == NULL) s->m.name = "small";
    return &s->m;
}

void gltf_is_vector(const char *at, double x, double y, double z) {
    const double wanted[3] = {x, y, z};
    for (size_t d = 0; d < 3; d++)
        ck_assert_msg((double)gltf_float(at + 4 * d) == (double)(float)wanted[d],
                      "component %zu is %.9g, not %.9g", d, (double)gltf_float(at + 4 * d), wanted[d]);
}

void small_gltf_strip(small_gltf *s, size_t n, const double *steps, const double *lengths, bool shared) {
    double x = 0, z = 0, angle = 0;
    uint32_t ends[2] = {small_gltf_vertex(s, 0, 0, 0), small_gltf_vertex(s, 0, 1, 0)};
    for (size_t k = 0; k < n; k++) {
        angle += steps[k] * 3.14159265358979 / 180;
        const double x0 = x, z0 = z;
        x += lengths[k] * cos(angle);
        z += lengths[k] * sin(angle);
        if (!shared && k > 0) {
            ends[0] = small_gltf_vertex(s, x0, 0, z0);
            ends[1] = small_gltf_vertex(s, x0, 1, z0);
        }
        const uint32_t a = small_gltf_vertex(s, x, 0, z), b = small_gltf_vertex(s, x, 1, z);
        small_gltf_element(s, 0, ends[0], a, b, ends[1]);
        ends[0] = a;
        ends[1] = b;
    }
}
