/* Lists of sensors, JSON, CSV and points of Radiance; those that are read have sound receivers and sets. */
#include "fuzz/fuzz.h"
#include "solver/base/vector3.h"
#include "solver/sensor/sensors.h"

#include <math.h>

/* A floor of two triangles, in two groups. */
static mesh small_scene(void) {
    static double vertices[4][3] = {{0, 0, 0}, {4, 0, 0}, {4, 3, 0}, {0, 3, 0}};
    static uint32_t elements[2][4] = {{0, 1, 2, MESH_NO_VERTEX}, {0, 2, 3, MESH_NO_VERTEX}},
                    group[2] = {0, 1};
    static double area[2] = {6, 6};
    static float normal[2][3] = {{0, 0, 1}, {0, 0, 1}};
    static char floor_name[] = "floor", rest_name[] = "rest";
    static char *names[2] = {floor_name, rest_name};
    return (mesh){.n_vertices = 4,
                  .vertices = vertices,
                  .n = 2,
                  .elements = elements,
                  .area = area,
                  .normal = normal,
                  .group = group,
                  .n_groups = 2,
                  .group_names = names,
                  .up = 'z'};
}

static void check_receiver(const receiver *r) {
    FUZZ_CHECK(r->kind < RECEIVER_KINDS);
    for (int d = 0; d < 3; d++) FUZZ_CHECK(isfinite(r->at[d]));
    FUZZ_CHECK(fabs(dot3(r->axis, r->axis) - (r->kind != RECEIVER_SPHERE)) < 1e-9);
    if (r->kind == RECEIVER_SEMICYLINDER || r->kind >= RECEIVER_HARMONIC)
        FUZZ_CHECK(fabs(dot3(r->look, r->look) - 1) < 1e-9 && fabs(dot3(r->look, r->axis)) < 1e-6);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static const char *const names[] = {"a.json", "a.csv", "a.pts", "a"};
    if (size == 0) return 0;
    const mesh m = small_scene();
    const sensors_options options = {.unit = data[size - 1] & 64 ? .001 : 0,
                                     .up = data[size - 1] & 32 ? 'y' : 0,
                                     .m = data[size - 1] & 16 ? NULL : &m};
    char *text = fuzz_text(data, size - 1);
    lam_error error = {.message = ""};
    sensor_list l = {.n = 0};
    if (sensors_read_text(names[data[size - 1] % 4], text, size - 1, &options, &l, &error) == LAM_OK) {
        size_t first = 0;
        FUZZ_CHECK(l.n > 0 && l.n <= SENSORS_MOST && l.n_sets > 0 && l.n_sets <= SENSOR_SETS_MOST);
        for (size_t k = 0; k < l.n_sets; k++) {
            const sensor_set *s = &l.sets[k];
            FUZZ_CHECK(s->first == first && s->count > 0 && s->kind < SENSOR_SET_KINDS);
            FUZZ_CHECK(s->name[0] != '\0' && memchr(s->name, '\0', SENSOR_NAME) != NULL);
            for (size_t i = first; i < first + s->count && s->rows > 0; i++)
                FUZZ_CHECK(l.cell[i] < s->rows * s->columns);
            for (size_t i = 0; i < s->count && s->kind == SENSOR_PROBES; i++)
                FUZZ_CHECK(l.receivers[first + i].kind == RECEIVER_HARMONIC + i % HARMONICS &&
                           s->count % HARMONICS == 0);
            first += s->count;
        }
        FUZZ_CHECK(first == l.n);
        for (size_t k = 0; k < l.n; k++) check_receiver(&l.receivers[k]);
    } else {
        FUZZ_CHECK(error.message[0] != '\0' && strpbrk(error.message, "\r\n") == NULL && l.n == 0);
    }
    sensors_free(&l);
    free(text);
    return 0;
}
