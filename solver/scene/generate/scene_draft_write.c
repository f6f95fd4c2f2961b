/* A draft as OBJ and MTL files, written aside and renamed. */
#include "solver/scene/generate/scene_draft.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

/* A file that is not yet under its name. */
typedef struct aside {
    char *path, *partial;
    FILE *file;
} aside;

static lam_status aside_open(aside *a, const char *path, size_t stem, const char *extension,
                             lam_error *error) {
    lam_status status = LAM_OK;
    const char *slash = strrchr(path, '/');
    const size_t folder = slash == NULL ? 0 : (size_t)(slash - path) + 1;
    const size_t size = strlen(path) + 64;
    a->path = memory_allocate(size, 1, path, error);
    a->partial = memory_allocate(size, 1, path, error);
    if (a->path == NULL || a->partial == NULL) TRY(LAM_ERR_MEMORY);
    snprintf(a->path, size, "%.*s%s", (int)stem, path, extension);
    snprintf(a->partial, size, "%.*s.%s.partial-%ld", (int)folder, path, a->path + folder, (long)getpid());
    const int fd = open(a->partial, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (fd >= 0) a->file = fdopen(fd, "w");
    if (a->file == NULL) {
        const int reason = errno;
        if (fd >= 0) close(fd), unlink(a->partial);
        FAIL(error, LAM_ERR_IO, "%s: cannot write: %s", a->path, strerror(reason));
    }
done:
    return status;
}

/* Everything on the disk, still aside. */
static lam_status aside_finish(aside *a, lam_error *error) {
    const bool failed = fflush(a->file) != 0 || ferror(a->file) || fsync(fileno(a->file)) != 0;
    const int reason = errno;
    return failed ? status_fail(error, LAM_ERR_IO, "%s: cannot write: %s", a->path, strerror(reason))
                  : LAM_OK;
}

static lam_status aside_rename(aside *a, lam_error *error) {
    if (rename(a->partial, a->path) != 0)
        return status_fail(error, LAM_ERR_IO, "%s: cannot rename: %s", a->path, strerror(errno));
    a->partial[0] = '\0';
    return LAM_OK;
}

/* Closes; what was not renamed is removed. */
static void aside_close(aside *a) {
    if (a->file != NULL) {
        fclose(a->file);
        if (a->partial[0] != '\0') unlink(a->partial);
    }
    free(a->path);
    free(a->partial);
}

/* The shortest decimal that reads back as the same double. */
static void print_number(FILE *file, double x) {
    char text[40];
    for (int digits = 6; digits <= 17; digits++) {
        snprintf(text, sizeof text, "%.*g", digits, x);
        if (strtod(text, NULL) == x) break;
    }
    fprintf(file, " %s", text);
}

static void write_mtl(const draft *d, FILE *file, double reflectance) {
    for (size_t g = 0; g < d->n_groups; g++) {
        const draft_material *m = d->groups[g].material;
        size_t first = 0;
        while (d->groups[first].material != m) first++;
        if (first < g) continue;
        const double grey = (m->emission[0] + m->emission[1] + m->emission[2]) / 3;
        fprintf(file, "newmtl %s\nKd", m->name);
        for (int c = 0; c < 3; c++) print_number(file, reflectance >= 0 ? reflectance : m->diffuse[c]);
        fprintf(file, "\nKe");
        for (int c = 0; c < 3; c++) print_number(file, reflectance >= 0 ? grey : m->emission[c]);
        fprintf(file, "\n");
    }
}

static void write_obj(const draft *d, FILE *file, const char *mtl) {
    fprintf(file, "# metres, z up; faces counter-clockwise seen from their lit side\nmtllib %s\n", mtl);
    for (size_t v = 0; v < d->points.n; v++) {
        fputc('v', file);
        for (int k = 0; k < 3; k++) print_number(file, d->points.points[v][k]);
        fputc('\n', file);
    }
    for (size_t i = 0; i < d->n_faces; i++) {
        const struct draft_face *face = &d->faces[i];
        if (i == 0 || face->group != face[-1].group)
            fprintf(file, "o %s\nusemtl %s\n", d->groups[face->group].name,
                    d->groups[face->group].material->name);
        fputc('f', file);
        for (int k = 0; k < 4 && face->corners[k] != TABLE_NONE; k++)
            fprintf(file, " %lu", (unsigned long)face->corners[k] + 1);
        fputc('\n', file);
    }
}

lam_status draft_write(const draft *d, const char *path, double reflectance, lam_error *error) {
    lam_status status = LAM_OK;
    aside obj = {0}, mtl = {0};
    const size_t length = strlen(path);
    if (length < 5 || strcasecmp(path + length - 4, ".obj") != 0 || path[length - 5] == '/')
        FAIL(error, LAM_ERR_ARGUMENT, "%s: the name of a generated scene must end in .obj", path);
    TRY(aside_open(&mtl, path, length - 4, ".mtl", error));
    TRY(aside_open(&obj, path, length - 4, path + length - 4, error));
    const char *slash = strrchr(mtl.path, '/');
    write_mtl(d, mtl.file, reflectance);
    write_obj(d, obj.file, slash == NULL ? mtl.path : slash + 1);
    TRY(aside_finish(&mtl, error));
    TRY(aside_finish(&obj, error));
    TRY(aside_rename(&mtl, error));
    TRY(aside_rename(&obj, error));
done:
    aside_close(&mtl);
    aside_close(&obj);
    return status;
}
