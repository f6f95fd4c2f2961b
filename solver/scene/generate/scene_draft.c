#include "solver/scene/generate/scene_draft.h"

#include "solver/base/array_grow.h"
#include "solver/base/atomic_file.h"
#include "solver/scene/face_grid.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

void scene_draft_free(scene_draft *d) {
    point_table_free(&d->points);
    free(d->faces);
    free(d->groups);
    *d = (scene_draft){0};
}

lam_status scene_draft_group(scene_draft *d, const char *name, const scene_draft_material *material,
                             lam_error *error) {
    if (array_grow(&d->groups, &d->group_capacity, d->n_groups + 1, sizeof *d->groups, "groups", error) !=
        LAM_OK)
        return LAM_ERR_MEMORY;
    d->groups[d->n_groups++] = (struct scene_draft_group){name, material};
    return LAM_OK;
}

lam_status scene_draft_face(scene_draft *d, const double (*corners)[3], size_t n, lam_error *error) {
    lam_status status = LAM_OK;
    struct scene_draft_face face = {{0, 0, 0, TABLE_NONE}, (uint32_t)(d->n_groups - 1)};
    if (!d->counting) {
        for (size_t k = 0; k < n; k++) TRY(point_table_add(&d->points, corners[k], &face.corners[k], error));
        TRY(array_grow(&d->faces, &d->face_capacity, d->n_faces + 1, sizeof *d->faces, "faces", error));
        d->faces[d->n_faces] = face;
    }
    d->n_faces++;
done:
    return status;
}

lam_status scene_draft_grid(scene_draft *d, const double quad[4][3], size_t na, size_t nb, lam_error *error) {
    lam_status status = LAM_OK;
    for (size_t j = 0; j < nb; j++)
        for (size_t i = 0; i < na; i++) {
            double cell[4][3];
            grid_point(quad, i, na, j, nb, cell[0]);
            grid_point(quad, i + 1, na, j, nb, cell[1]);
            grid_point(quad, i + 1, na, j + 1, nb, cell[2]);
            grid_point(quad, i, na, j + 1, nb, cell[3]);
            TRY(scene_draft_face(d, (const double(*)[3])cell, 4, error));
        }
done:
    return status;
}

static size_t whole_steps(double steps) {
    return steps < 1.5 ? 1 : (size_t)lround(steps);
}

size_t scene_draft_steps_along(const scene_draft *d, double length, double size) {
    return whole_steps(length / (size * (d->stretch > 0 ? d->stretch : 1)));
}

size_t scene_draft_steps_across(const scene_draft *d, double length, double size) {
    return whole_steps(length / size * (d->stretch > 0 ? d->stretch : 1));
}

lam_status scene_draft_cells(scene_draft *d, const double quad[4][3], double size, lam_error *error) {
    const double along = (point_distance(quad[0], quad[1]) + point_distance(quad[3], quad[2])) / 2;
    const double across = (point_distance(quad[0], quad[3]) + point_distance(quad[1], quad[2])) / 2;
    const size_t na = scene_draft_steps_along(d, along, size), nb = scene_draft_steps_across(d, across, size);
    if (!d->counting) return scene_draft_grid(d, quad, na, nb, error);
    d->n_faces += na * nb;
    return LAM_OK;
}

typedef struct near_search {
    const void *plan;
    scene_draft_builder *build;
    const generate_options *options;
    size_t wanted;
    double off, size, stretch; /* the best so far */
} near_search;

/* Counts the faces at one cell size and keeps it when it is the best. */
static lam_status try_cells(near_search *search, double size, double stretch, size_t *n_faces,
                            lam_error *error) {
    scene_draft counted = {.counting = true, .stretch = stretch, .plan = search->plan};
    const lam_status status = search->build(&counted, search->options, size, error);
    const double off = fabs((double)counted.n_faces - (double)search->wanted);
    if (status == LAM_OK && off < search->off)
        search->off = off, search->size = size, search->stretch = stretch;
    *n_faces = counted.n_faces;
    scene_draft_free(&counted);
    return status;
}

lam_status scene_draft_build_near(scene_draft *d, scene_draft_builder *build, const generate_options *options,
                                  size_t wanted, lam_error *error) {
    lam_status status = LAM_OK;
    near_search search = {d->plan, build, options, wanted, HUGE_VAL, 1, 1};
    size_t n = 0;
    double size = 1;
    /* The number of faces is about proportional to 1 / size^2: a few corrections come near, then sizes around
     * are tried until the number is right to a thousandth. */
    for (int round = 0; round < 12 && search.off > 0; round++) {
        TRY(try_cells(&search, size, 1, &n, error));
        size *= fmin(fmax(sqrt((double)n / (double)wanted), 1.0 / 16), 16);
    }
    const double middle = search.size;
    for (int s = 0; s <= 8; s++)
        for (int step = 0; step <= 60 && search.off * 1000 > (double)wanted; step++) {
            const double stretch = 1 + .01 * (s % 2 == 1 ? (s + 1) / 2 : -s / 2);
            size = middle * (1 + .001 * (step % 2 == 1 ? (step + 1) / 2 : -step / 2));
            TRY(try_cells(&search, size, stretch, &n, error));
        }
    d->stretch = search.stretch;
    TRY(build(d, options, search.size, error));
done:
    return status;
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

/* Without zeros at the end. */
static void print_rounded(FILE *file, double x, int decimals) {
    char text[400];
    int length = snprintf(text, sizeof text, "%.*f", decimals, x);
    while (length > 1 && text[length - 1] == '0') length--;
    if (text[length - 1] == '.') length--;
    text[length] = '\0';
    fprintf(file, " %s", strcmp(text, "-0") == 0 ? "0" : text);
}

static void write_mtl(const scene_draft *d, FILE *file, double reflectance) {
    for (size_t g = 0; g < d->n_groups; g++) {
        const scene_draft_material *m = d->groups[g].material;
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

static void write_obj(const scene_draft *d, FILE *file, const char *mtl) {
    fprintf(file, "# metres, z up; faces counter-clockwise seen from their lit side\nmtllib %s\n", mtl);
    for (size_t v = 0; v < d->points.n; v++) {
        fputc('v', file);
        for (int k = 0; k < 3; k++)
            if (d->decimals > 0)
                print_rounded(file, d->points.points[v][k], d->decimals);
            else
                print_number(file, d->points.points[v][k]);
        fputc('\n', file);
    }
    for (size_t i = 0; i < d->n_faces; i++) {
        const struct scene_draft_face *face = &d->faces[i];
        if (i == 0 || face->group != face[-1].group)
            fprintf(file, "o %s\nusemtl %s\n", d->groups[face->group].name,
                    d->groups[face->group].material->name);
        fputc('f', file);
        for (int k = 0; k < 4 && face->corners[k] != TABLE_NONE; k++)
            fprintf(file, " %lu", (unsigned long)face->corners[k] + 1);
        fputc('\n', file);
    }
}

/* True where all bytes are on the disk. */
static bool is_on_disk(FILE *file) {
    return fflush(file) == 0 && !ferror(file) && fsync(fileno(file)) == 0;
}

lam_status scene_draft_write(const scene_draft *d, const char *path, double reflectance, lam_error *error) {
    lam_status status = LAM_OK;
    atomic_file obj = {0}, mtl = {0};
    const size_t length = strlen(path);
    char *mtl_path = memory_allocate(length + 1, 1, path, error);
    if (mtl_path == NULL) return LAM_ERR_MEMORY;
    if (length < 5 || strcasecmp(path + length - 4, ".obj") != 0 || path[length - 5] == '/')
        FAIL(error, LAM_ERR_ARGUMENT, "%s: the name of a generated scene must end in .obj", path);
    snprintf(mtl_path, length + 1, "%.*s.mtl", (int)length - 4, path);
    TRY(atomic_file_open(mtl_path, &mtl, error));
    TRY(atomic_file_open(path, &obj, error));
    const char *slash = strrchr(mtl_path, '/');
    write_mtl(d, mtl.stream, reflectance);
    write_obj(d, obj.stream, slash == NULL ? mtl_path : slash + 1);
    /* Neither file may appear without the other. */
    if (!is_on_disk(mtl.stream) || !is_on_disk(obj.stream))
        FAIL(error, LAM_ERR_IO, "%s: cannot be written: %s", path, strerror(errno));
    TRY(atomic_file_commit(&mtl, error));
    TRY(atomic_file_commit(&obj, error));
done:
    atomic_file_abort(&mtl);
    atomic_file_abort(&obj);
    free(mtl_path);
    return status;
}
