/* Reads scene files in a child process with limits, which sends plain arrays through a pipe. The parent
 * checks all that it receives. */
#include "solver/base/utf8.h"
#include "solver/scene/import/images.h"
#include "solver/scene/import/imported_faces.h"
#include "store/confined.h"

#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>

/* The first bytes that the child sends; points, elements, both name texts, the material values, the cameras
 * and lights, textured faces with their elements, the sizes of images and their pixels follow. */
typedef struct reply_header {
    char magic[8];
    uint64_t status;
    char message[sizeof((lam_error *)0)->message];
    import_warnings warnings;
    uint64_t n_points, n_polygons, n_elements, n_objects, object_bytes, n_materials, material_bytes,
        n_cameras, n_punctual, dropped, latin1, n_faces, n_images;
} reply_header;

static const char reply_magic[8] = "lamsoup";

/* Sends the size of each image, then its pixels. */
static bool send_images(const imported_faces *s) {
    for (size_t k = 0; k < s->n_images; k++) {
        const texture_image *image = &s->images[k];
        const uint64_t size[2] = {image->width, image->height};
        if (!confined_send(CONFINED_REPLY, size, sizeof size) ||
            !confined_send(CONFINED_REPLY, image->pixels, size[0] * size[1] * sizeof *image->pixels))
            return false;
    }
    return true;
}

static void send_reply(lam_status result, const lam_error *error, const imported_faces *s) {
    reply_header header;
    memset(&header, 0, sizeof header);
    memcpy(header.magic, reply_magic, sizeof reply_magic);
    header.status = (uint64_t)result;
    memcpy(header.message, error->message, sizeof header.message);
    if (result != LAM_OK) {
        (void)confined_send(CONFINED_REPLY, &header, sizeof header);
        return;
    }
    header.warnings = s->warnings;
    header.n_points = s->points.n;
    header.n_polygons = s->n_polygons;
    header.n_elements = s->n_elements;
    header.n_objects = s->objects.n;
    header.object_bytes = s->objects.text_bytes;
    header.n_materials = s->materials.n;
    header.material_bytes = s->materials.text_bytes;
    header.n_cameras = s->n_cameras;
    header.n_punctual = s->n_punctual;
    header.dropped = s->dropped;
    header.latin1 = s->latin1;
    header.n_faces = s->n_faces;
    header.n_images = s->n_images;
    const struct {
        const void *data;
        size_t bytes;
    } parts[] = {{&header, sizeof header},
                 {s->points.points, s->points.n * sizeof *s->points.points},
                 {s->elements, s->n_elements * sizeof *s->elements},
                 {s->objects.text, s->objects.text_bytes},
                 {s->materials.text, s->materials.text_bytes},
                 {s->values, s->materials.n * sizeof *s->values},
                 {s->cameras, s->n_cameras * sizeof *s->cameras},
                 {s->punctual, s->n_punctual * sizeof *s->punctual},
                 {s->faces, s->n_faces * sizeof *s->faces},
                 {s->face_elements, s->n_faces * sizeof *s->face_elements}};
    for (size_t k = 0; k < sizeof parts / sizeof *parts; k++)
        if (!confined_send(CONFINED_REPLY, parts[k].data, parts[k].bytes)) return;
    (void)send_images(s);
}

/* The task of the child. */
typedef struct child_work {
    scene_reader *reader;
    const char *path;
    const child_limits *limits;
} child_work;

static void read_in_child(void *context) {
    const child_work *work = context;
    char input[32];
    snprintf(input, sizeof input, "/proc/self/fd/%d", (int)CONFINED_INPUT);
    imported_faces s = {.assets = work->limits->assets,
                        .format = work->limits->format,
                        .unit = work->limits->unit,
                        .source = work->limits->input > 0 ? input : NULL};
    lam_error error = {0};
    lam_status result = work->reader(work->path, &s, &error);
    if (result == LAM_OK) result = imported_faces_split(&s, work->path, &error);
    imported_faces_fit_images(&s);
    if (result == LAM_ERR_MEMORY)
        status_fail(&error, LAM_ERR_MEMORY, "%s: the importer needs more than its %zu MiB of memory",
                    work->path, work->limits->memory_bytes >> 20);
    send_reply(result, &error, &s);
}

/* Reads an array of count values of size bytes from the pipe, or returns NULL; *whole becomes false where the
 * pipe ends.
 */
static void *receive_array(confined *child, uint64_t count, size_t size, bool *whole, lam_error *error) {
    void *data = memory_allocate(count, size, "imported scene", error);
    if (data != NULL && !confined_receive(child, data, count * size)) *whole = false;
    return data;
}

/* Reads the names in a block of bytes; false where they are not exactly n different ones. */
static lam_status names_of_block(const char *block, uint64_t bytes, uint64_t n, name_table *names,
                                 bool *sound, lam_error *error) {
    lam_status status = LAM_OK;
    *sound = bytes == 0 || block[bytes - 1] == '\0';
    for (size_t at = 0; *sound && at < bytes; at += strlen(block + at) + 1) {
        uint32_t index;
        TRY(name_table_add(names, block + at, strlen(block + at), &index, error));
    }
    *sound = *sound && names->n == n;
done:
    return status;
}

static bool elements_are_sound(const imported_faces *s) {
    for (size_t v = 0; v < s->points.n; v++)
        for (int k = 0; k < 3; k++)
            if (!isfinite(s->points.points[v][k])) return false;
    for (size_t i = 0; i < s->n_elements; i++) {
        const struct imported_element *e = &s->elements[i];
        for (int k = 0; k < 4; k++)
            if (e->corners[k] >= s->points.n && !(k == 3 && e->corners[k] == TABLE_NONE)) return false;
        if (e->object >= s->objects.n && e->object != TABLE_NONE) return false;
        if (e->material >= s->materials.n && e->material != TABLE_NONE) return false;
        if (e->polygon >= s->n_polygons) return false;
    }
    return true;
}

static bool cameras_are_sound(imported_faces *s) {
    for (size_t k = 0; k < s->n_cameras; k++) {
        scene_camera *c = &s->cameras[k];
        const size_t length = strnlen(c->name, sizeof c->name);
        if (length == 0 || length == sizeof c->name || !utf8_is_valid(c->name, length)) return false;
        if (!scene_camera_settle(c) || scene_camera_find(k, s->cameras, c->name) != NULL) return false;
    }
    return true;
}

/* *sound becomes false where a light has a value that cannot be used, or the name of one before it. */
static lam_status check_lights(imported_faces *s, bool *sound, lam_error *error) {
    lam_status status = LAM_OK;
    name_table names = {.n = 0};
    for (size_t k = 0; k < s->n_punctual && *sound; k++) {
        punctual_light *l = &s->punctual[k];
        uint32_t index;
        *sound = punctual_light_settle(l);
        if (*sound) TRY(name_table_add(&names, l->name, sizeof l->name, &index, error));
        *sound = *sound && names.n == k + 1;
    }
done:
    name_table_free(&names);
    return status;
}

/* True where textured faces belong to elements and surfaces that exist, and have usable maps. */
static bool faces_are_sound(const imported_faces *s, uint64_t n_images) {
    for (size_t f = 0; f < s->n_faces; f++) {
        const texture_face *face = &s->faces[f];
        if (s->face_elements[f] >= s->n_elements || face->surface >= s->materials.n ||
            (f > 0 && s->face_elements[f] <= s->face_elements[f - 1]) ||
            s->elements[s->face_elements[f]].material != face->surface)
            return false;
        for (int k = 0; k < 3; k++)
            if (!isfinite(face->origin[k])) return false;
        for (int k = 0; k < 4; k++)
            for (int d = 0; d < 3; d++)
                if (!isfinite(face->colour[d][k]) || (d < 2 && !isfinite(face->uv[0][d][k])) ||
                    (d < 2 && !isfinite(face->uv[1][d][k])))
                    return false;
    }
    for (size_t i = 0; i < s->materials.n; i++)
        for (int q = 0; q < TEXTURE_QUANTITIES; q++) {
            const imported_texture *t = &s->values[i].textures[q];
            if (t->image > n_images || (t->image > 0 && s->images[t->image - 1].pixels == NULL) ||
                t->wrap[0] > TEXTURE_CLAMP || t->wrap[1] > TEXTURE_CLAMP)
                return false;
        }
    return true;
}

/* Receives images that have few enough pixels; *sound is false where one has more. */
static lam_status receive_images(confined *child, uint64_t n, imported_faces *s, bool *sound, bool *whole,
                                 lam_error *error) {
    lam_status status = LAM_OK;
    size_t total = 0;
    s->images = memory_allocate(n, sizeof *s->images, "images", error);
    if (s->images == NULL) TRY(LAM_ERR_MEMORY);
    s->image_capacity = n;
    for (s->n_images = 0; *whole && *sound && s->n_images < n; s->n_images++) {
        uint64_t size[2] = {0, 0};
        *whole = confined_receive(child, size, sizeof size);
        *sound = size[0] < UINT32_MAX && size[1] < UINT32_MAX &&
                 size[0] * size[1] <= IMAGES_PIXELS_MOST - total && (size[0] == 0) == (size[1] == 0);
        if (!*whole || !*sound || size[0] == 0) continue;
        total += size[0] * size[1];
        texture_image *image = &s->images[s->n_images];
        image->pixels = receive_array(child, size[0] * size[1], sizeof *image->pixels, whole, error);
        if (image->pixels == NULL) TRY(LAM_ERR_MEMORY);
        image->width = size[0];
        image->height = size[1];
    }
done:
    return status;
}

/* Receives a reply into s; *whole is false where the pipe ended before. */
static lam_status receive_reply(confined *child, const char *path, size_t most_bytes, imported_faces *s,
                                bool *whole, lam_error *error) {
    lam_status status = LAM_OK;
    reply_header header;
    char *objects = NULL, *materials = NULL;
    *whole = confined_receive(child, &header, sizeof header);
    if (!*whole) goto done;
    bool sound = memcmp(header.magic, reply_magic, sizeof reply_magic) == 0;
    header.message[sizeof header.message - 1] = '\0';
    header.warnings.text[sizeof header.warnings.text - 1] = '\0';
    const bool says_why = header.message[0] != '\0' && strpbrk(header.message, "\r\n") == NULL;
    if (sound && says_why && header.status > LAM_OK && header.status <= LAM_ERR_INTERNAL)
        FAIL(error, (lam_status)header.status, "%s", header.message);
    const uint64_t most = most_bytes / 8; /* except for names, no entry is smaller in the pipe */
    sound = sound && header.status == LAM_OK && header.n_points < most && header.n_elements < most &&
            header.n_points < TABLE_NONE && header.n_polygons < most && header.n_polygons < TABLE_NONE &&
            header.n_elements < TABLE_NONE && header.n_elements > 0 && header.object_bytes < most &&
            header.material_bytes < most && header.n_materials < most &&
            header.n_cameras <= SCENE_CAMERAS_MOST && header.n_punctual <= PUNCTUAL_MOST &&
            header.n_faces <= header.n_elements && header.n_images < most;
    if (!sound) FAIL(error, LAM_ERR_INTERNAL, "%s: the importer sent a damaged reply", path);
    s->n_polygons = header.n_polygons;
    s->points.points = receive_array(child, header.n_points, sizeof *s->points.points, whole, error);
    if (s->points.points == NULL) TRY(LAM_ERR_MEMORY);
    s->points.n = s->points.capacity = header.n_points;
    s->elements = receive_array(child, header.n_elements, sizeof *s->elements, whole, error);
    if (s->elements == NULL) TRY(LAM_ERR_MEMORY);
    s->n_elements = s->element_capacity = header.n_elements;
    objects = receive_array(child, header.object_bytes, 1, whole, error);
    if (objects == NULL) TRY(LAM_ERR_MEMORY);
    materials = receive_array(child, header.material_bytes, 1, whole, error);
    if (materials == NULL) TRY(LAM_ERR_MEMORY);
    s->values = receive_array(child, header.n_materials, sizeof *s->values, whole, error);
    if (s->values == NULL) TRY(LAM_ERR_MEMORY);
    s->cameras = receive_array(child, header.n_cameras, sizeof *s->cameras, whole, error);
    if (s->cameras == NULL) TRY(LAM_ERR_MEMORY);
    s->n_cameras = s->camera_capacity = header.n_cameras;
    s->punctual = receive_array(child, header.n_punctual, sizeof *s->punctual, whole, error);
    if (s->punctual == NULL) TRY(LAM_ERR_MEMORY);
    s->n_punctual = s->punctual_capacity = header.n_punctual;
    s->faces = receive_array(child, header.n_faces, sizeof *s->faces, whole, error);
    if (s->faces == NULL) TRY(LAM_ERR_MEMORY);
    s->face_elements = receive_array(child, header.n_faces, sizeof *s->face_elements, whole, error);
    if (s->face_elements == NULL) TRY(LAM_ERR_MEMORY);
    s->n_faces = header.n_faces;
    if (*whole) TRY(receive_images(child, header.n_images, s, &sound, whole, error));
    if (!*whole) goto done;
    bool objects_sound = false, materials_sound = false;
    TRY(names_of_block(objects, header.object_bytes, header.n_objects, &s->objects, &objects_sound, error));
    TRY(names_of_block(materials, header.material_bytes, header.n_materials, &s->materials, &materials_sound,
                       error));
    TRY(check_lights(s, &sound, error));
    if (!sound || !objects_sound || !materials_sound || !elements_are_sound(s) || !cameras_are_sound(s) ||
        !faces_are_sound(s, header.n_images))
        FAIL(error, LAM_ERR_INTERNAL, "%s: the importer sent a damaged reply", path);
    s->warnings = header.warnings;
    s->dropped = header.dropped;
    s->latin1 = header.latin1;
done:
    free(objects);
    free(materials);
    return status;
}

lam_status import_in_child(scene_reader *reader, const char *path, const child_limits *limits,
                           imported_faces *s, lam_error *error) {
    lam_status status = LAM_OK;
    child_work work = {reader, path, limits};
    /* The kernel limits the processor time; the clock only ends a child that sleeps. */
    const confined_limits confined_to = {.cpu_seconds = limits->cpu_seconds,
                                         .all_seconds = 4 * limits->cpu_seconds + 2,
                                         .memory_bytes = limits->memory_bytes,
                                         .filtered = true,
                                         .reads_files = true};
    confined child;
    lam_error ending;
    int wait_status = 0;
    bool whole = false;
    imported_faces received = {0};
    TRY(confined_start(read_in_child, &work, limits->input > 0 ? limits->input : -1, &confined_to, path,
                       &child, error));
    status = receive_reply(&child, path, limits->memory_bytes, &received, &whole, error);
    const lam_status ended = confined_end(&child, whole || status != LAM_OK, path, &wait_status, &ending);
    TRY(status);
    if (ended != LAM_OK) FAIL(error, ended, "%s", ending.message);
    if (!whole) TRY(confined_verdict(&child, &confined_to, wait_status, path, "the importer", error));
    imported_faces_free(s);
    *s = received;
    received = (imported_faces){0};
done:
    imported_faces_free(&received);
    return status;
}
