/* Turns the faces that the child read into a mesh: groups, materials, units. */
#include "solver/scene/import/import.h"

#include "solver/base/array_grow.h"
#include "solver/base/utf8.h"
#include "solver/scene/glass.h"
#include "solver/scene/import/images.h"
#include "solver/scene/import/imported_faces.h"
#include "store/confined.h"

#include <errno.h>
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

/* The reflectance of faces without a diffuse colour, or with none beside an image that is not read, and the
 * largest that a file's colour gives: light between two white walls must die out. */
static const double default_reflectance = .5;
static const double largest_reflectance = .9999;

static const char *extension_of(const char *path) {
    const char *slash = strrchr(path, '/'), *dot = strrchr(path, '.');
    return dot == NULL || (slash != NULL && dot < slash) ? "" : dot + 1;
}

static bool is_gltf(const char *path, const import_options *options) {
    const char *format = options->format != NULL ? options->format : extension_of(path);
    return strcasecmp(format, "gltf") == 0 || strcasecmp(format, "glb") == 0;
}

static bool is_input(const char *path) {
    return strcmp(path, "-") == 0;
}

/* Standard input as a file of at most `most` bytes, which can be read again from its begin. *fd: closed by
 * the caller. */
static lam_status keep_input(size_t most, int *fd, lam_error *error) {
    lam_status status = LAM_OK;
    char bytes[65536];
    size_t left = most;
    *fd = memfd_create("scene", MFD_CLOEXEC);
    if (*fd < 0) FAIL(error, LAM_ERR_IO, "standard input: cannot be kept: %s", strerror(errno));
    for (ssize_t n; (n = read(STDIN_FILENO, bytes, sizeof bytes)) != 0;) {
        if (n < 0 && errno == EINTR) continue;
        if (n < 0) FAIL(error, LAM_ERR_IO, "standard input: cannot read: %s", strerror(errno));
        if ((size_t)n > left)
            FAIL(error, LAM_ERR_MEMORY,
                 "standard input: more than the %zu MiB of the importer; write it to a file and leave out "
                 "what is "
                 "not needed",
                 most >> 20);
        left -= (size_t)n;
        if (!confined_send(*fd, bytes, (size_t)n))
            FAIL(error, LAM_ERR_IO, "standard input: cannot be kept: %s", strerror(errno));
    }
done:
    return status;
}

static void stem_of(const char *path, char *out, size_t size) {
    const char *slash = strrchr(path, '/'), *name = slash == NULL ? path : slash + 1;
    const char *dot = strrchr(name, '.');
    size_t length = dot == NULL || dot == name ? strlen(name) : (size_t)(dot - name);
    if (utf8_is_valid(name, length)) {
        snprintf(out, size, "%.*s", (int)(length < size ? length : size - 1), name);
        return;
    }
    if (length > (size - 1) / 2) length = (size - 1) / 2;
    out[utf8_of_latin1(name, length, out)] = '\0';
}

/* True for white and black, which programs write beside an image: they say nothing about the material. */
static bool is_filler(const double v[3]) {
    return (v[0] > largest_reflectance && v[1] > largest_reflectance && v[2] > largest_reflectance) ||
           (v[0] == 0 && v[1] == 0 && v[2] == 0);
}

/* Checks and clamps the values of the materials that faces use, in place. */
static lam_status settle_materials(imported_faces *s, const char *path, const bool *used,
                                   import_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    for (size_t i = 0; i < s->materials.n; i++) {
        imported_material *v = &s->values[i];
        const char *name = name_table_get(&s->materials, i);
        bool clamped = false;
        if (!used[i]) continue;
        if (!(v->transmittance >= 0 && v->transmittance <= 1))
            FAIL(error, LAM_ERR_FORMAT, "%s: material '%s': transmittance %g, must be from 0 to 1", path,
                 name, v->transmittance);
        if (v->transmittance > 0) v->has_diffuse = 1; /* clear, unless it has a colour */
        const imported_texture *image = &v->textures[TEXTURE_REFLECTANCE];
        const bool unread = image->named != 0 && image->image == 0;
        if (unread ? is_filler(v->diffuse) : !v->has_diffuse && image->image == 0) {
            import_warn(&s->warnings, "%s: material '%s' %s; its reflectance is set to %g", path, name,
                        unread       ? "has no colour beside its image"
                        : v->defined ? "has no diffuse colour"
                                     : "is not defined",
                        default_reflectance);
            for (int c = 0; c < 3; c++) v->diffuse[c] = default_reflectance;
        }
        for (int c = 0; c < 3; c++) {
            if (!(v->diffuse[c] >= 0) || !isfinite(v->diffuse[c]))
                FAIL(error, LAM_ERR_FORMAT, "%s: material '%s': diffuse value %g, must be in [0, 1)", path,
                     name, v->diffuse[c]);
            if (!(v->emission[c] >= 0) || !(v->emission[c] < (double)FLT_MAX))
                FAIL(error, LAM_ERR_FORMAT,
                     "%s: material '%s': emission %g, must not be negative and must be finite", path, name,
                     v->emission[c]);
            if (!(v->diffuse[c] > largest_reflectance) || image->image > 0) continue;
            clamped = true;
            v->diffuse[c] = largest_reflectance;
        }
        if (!clamped) continue;
        report->clamped++;
        import_warn(&s->warnings, "%s: material '%s': a diffuse value above %g is clamped to it", path, name,
                    largest_reflectance);
    }
done:
    return status;
}

static bool is_grey(const double v[3]) {
    return (float)v[0] == (float)v[1] && (float)v[1] == (float)v[2];
}

/* True where an image or the colours of a face's corners make channels differ. */
static bool has_colourful_faces(const imported_faces *s) {
    lam_error ignored;
    bool *coloured = memory_allocate(s->n_images, sizeof *coloured, "images", &ignored);
    bool found = coloured == NULL; /* three channels are never wrong */
    for (size_t k = 0; k < s->n_images && !found; k++) coloured[k] = !image_is_grey(&s->images[k]);
    for (size_t f = 0; f < s->n_faces && !found; f++) {
        const texture_face *face = &s->faces[f];
        for (int q = 0; q < TEXTURE_QUANTITIES; q++) {
            const uint32_t image = s->values[face->surface].textures[q].image;
            found = found || (image > 0 && coloured[image - 1]);
        }
        found = found || memcmp(face->colour[0], face->colour[1], sizeof face->colour[0]) != 0 ||
                memcmp(face->colour[1], face->colour[2], sizeof face->colour[0]) != 0;
    }
    free(coloured);
    return found;
}

/* Moves images and maps of faces into the mesh, whose lengths are metres, and takes the means. */
static lam_status lay_textures(imported_faces *s, const char *path, double unit, mesh *m,
                               import_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    if (s->n_faces == 0) return LAM_OK;
    mesh_textures *t = memory_allocate(1, sizeof *t, "textures", error);
    if (t == NULL) return LAM_ERR_MEMORY;
    mesh_textures_hold(m, t);
    t->largest = largest_reflectance;
    t->n_surfaces = s->materials.n;
    t->surfaces = memory_allocate(t->n_surfaces, sizeof *t->surfaces, "textures", error);
    m->textured_face = memory_allocate(m->n, sizeof *m->textured_face, "textures", error);
    if (t->surfaces == NULL || m->textured_face == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < m->n; i++) m->textured_face[i] = TEXTURE_NONE;
    for (size_t f = 0; f < s->n_faces; f++) {
        m->textured_face[s->face_elements[f]] = (uint32_t)f;
        texture_face *face = &s->faces[f];
        for (int k = 0; k < 3; k++) {
            face->origin[k] *= unit;
            for (int d = 0; d < 3; d++) face->colour[d][k] /= (float)unit;
            for (int q = 0; q < TEXTURE_QUANTITIES; q++)
                for (int d = 0; d < 2; d++) face->uv[q][d][k] /= (float)unit;
        }
    }
    for (size_t i = 0; i < t->n_surfaces; i++) {
        const imported_material *v = &s->values[i];
        memcpy(t->surfaces[i].factor[TEXTURE_REFLECTANCE], v->diffuse, sizeof v->diffuse);
        memcpy(t->surfaces[i].factor[TEXTURE_EMISSION], v->emission, sizeof v->emission);
        for (int q = 0; q < TEXTURE_QUANTITIES; q++) {
            const imported_texture *of = &v->textures[q];
            t->surfaces[i].image[q] = of->image == 0 ? TEXTURE_NONE : of->image - 1;
            for (int d = 0; d < 2; d++) t->surfaces[i].wrap[q][d] = (texture_wrap)of->wrap[d];
        }
    }
    t->faces = s->faces, t->n_faces = s->n_faces; /* taken over */
    t->images = s->images, t->n_images = s->n_images;
    s->faces = NULL, s->images = NULL;
    TRY(mesh_textures_apply(m, error));
    for (size_t i = 0; i < t->n_surfaces; i++) {
        if (!t->surfaces[i].clamped) continue;
        report->clamped++;
        import_warn(&s->warnings, "%s: material '%s': a mean reflectance above %g is clamped to it", path,
                    name_table_get(&s->materials, i), largest_reflectance);
    }
done:
    return status;
}

/* Fills reflectance, emission and the number of channels of m. */
static lam_status apply_materials(imported_faces *s, const char *path, const import_options *options, mesh *m,
                                  import_report *report, lam_error *error) {
    lam_status status = LAM_OK;
    size_t unnamed = 0, bare = 0, next = 0;
    bool *used = memory_allocate(s->materials.n, sizeof *used, "materials", error);
    if (used == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < s->n_elements; i++)
        if (s->elements[i].material == TABLE_NONE)
            unnamed++;
        else
            used[s->elements[i].material] = true;
    const bool overridden = options->reflectance >= 0;
    for (size_t i = 0; overridden && i < s->materials.n; i++) {
        s->values[i].has_diffuse = 1;
        s->values[i].textures[TEXTURE_REFLECTANCE] = (imported_texture){.image = 0};
        for (int c = 0; c < 3; c++) s->values[i].diffuse[c] = options->reflectance;
    }
    for (size_t f = 0; overridden && f < s->n_faces; f++)
        for (int c = 0; c < 3; c++)
            memcpy(s->faces[f].colour[c], (const float[4]){0, 0, 0, 1}, sizeof s->faces[f].colour[c]);
    if (unnamed > 0 && !overridden)
        import_warn(&s->warnings, "%s: %zu faces have no material; their reflectance is set to %g", path,
                    unnamed, default_reflectance);
    TRY(settle_materials(s, path, used, report, error));
    for (size_t i = 0; is_gltf(path, options) && i < s->materials.n; i++)
        report->luminous += used[i] && fmax(fmax(s->values[i].emission[0], s->values[i].emission[1]),
                                            s->values[i].emission[2]) > 0;
    m->n_channels = 1;
    for (size_t i = 0; i < s->materials.n; i++)
        if (used[i] && (!is_grey(s->values[i].diffuse) || !is_grey(s->values[i].emission))) m->n_channels = 3;
    if (has_colourful_faces(s)) m->n_channels = 3;
    m->reflectance = memory_allocate(m->n * m->n_channels, sizeof *m->reflectance, "reflectances", error);
    m->emission = memory_allocate(m->n * m->n_channels, sizeof *m->emission, "emissions", error);
    if (m->reflectance == NULL || m->emission == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < m->n; i++) {
        const uint32_t material = s->elements[i].material;
        const imported_material *v = material == TABLE_NONE ? NULL : &s->values[material];
        const bool has_image = v != NULL && (v->textures[0].image > 0 || v->textures[1].image > 0);
        const bool skinned = next < s->n_faces && s->face_elements[next] == i;
        const bool no_colour = v == NULL || (has_image && !skinned && is_filler(v->diffuse));
        next += skinned;
        bare += has_image && !skinned;
        for (size_t c = 0; c < m->n_channels; c++) {
            m->emission[c * m->n + i] = v == NULL ? 0.f : (float)v->emission[c];
            m->reflectance[c * m->n + i] =
                (float)(v != NULL && !no_colour ? fmin(v->diffuse[c], largest_reflectance)
                        : overridden            ? options->reflectance
                                                : default_reflectance);
        }
    }
    if (bare > 0)
        import_warn(
            &s->warnings,
            "%s: %zu faces of materials with images have no texture coordinates; plain colours take the "
            "images' place",
            path, bare);
done:
    free(used);
    return status;
}

/* Makes panes of the groups all of whose faces let the same part of the light pass. */
static lam_status find_panes(imported_faces *s, const char *path, mesh *m, lam_error *error) {
    lam_status status = LAM_OK;
    static const double unseen = -1, mixed = -2;
    size_t n_mixed = 0;
    double *passes = memory_allocate(m->n_groups, sizeof *passes, "panes", error);
    if (passes == NULL) return LAM_ERR_MEMORY;
    for (size_t g = 0; g < m->n_groups; g++) passes[g] = unseen;
    for (size_t i = 0; i < m->n; i++) {
        const uint32_t material = s->elements[i].material;
        const double T = material != TABLE_NONE ? s->values[material].transmittance : 0;
        double *const of = &passes[m->group[i]];
        *of = *of == unseen || *of == T ? T : mixed;
    }
    for (size_t g = 0; g < m->n_groups; g++) {
        const struct group_glass glass = {.transmittance = passes[g], .faces = 1};
        n_mixed += passes[g] == mixed;
        if (passes[g] > 0) TRY(mesh_set_glass(m, g, &glass, error));
    }
    if (n_mixed > 0)
        import_warn(&s->warnings,
                    "%s: %zu group%s panes and other faces under one name and pass%s no light; --glass "
                    "GROUP=T makes all faces of a group panes",
                    path, n_mixed, n_mixed == 1 ? " has" : "s have", n_mixed == 1 ? "es" : "");
done:
    free(passes);
    return status;
}

/* Marks the faces whose materials are on both of their sides. */
static lam_status mark_backs(const imported_faces *s, mesh *m, lam_error *error) {
    bool any = false;
    bool *has_back = memory_allocate(m->n, sizeof *has_back, "two-sided faces", error);
    if (has_back == NULL) return LAM_ERR_MEMORY;
    for (size_t i = 0; i < m->n; i++) {
        const uint32_t material = s->elements[i].material;
        has_back[i] = material != TABLE_NONE && s->values[material].two_sided != 0;
        any = any || has_back[i];
    }
    if (any) m->has_back = has_back;
    if (!any) free(has_back);
    return LAM_OK;
}

/* Names every element's group by the contract: the object's name, `object.material` where an object has
 * several materials, the material's without an object, the scene's without either. Equal names are one group.
 */
static lam_status name_groups(const imported_faces *s, mesh *m, lam_error *error) {
    lam_status status = LAM_OK;
    name_table names = {0};
    char *joined = NULL;
    size_t joined_capacity = 0;
    const uint32_t several = TABLE_NONE - 1, unseen = TABLE_NONE - 2; /* no material has these indices */
    uint32_t *only = memory_allocate(s->objects.n, sizeof *only, "groups", error);
    m->group = memory_allocate(m->n, sizeof *m->group, "groups", error);
    if (only == NULL || m->group == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t o = 0; o < s->objects.n; o++) only[o] = unseen;
    for (size_t i = 0; i < m->n; i++) {
        const struct imported_element *e = &s->elements[i];
        if (e->object == TABLE_NONE) continue;
        if (only[e->object] == unseen)
            only[e->object] = e->material;
        else if (only[e->object] != e->material)
            only[e->object] = several;
    }
    for (size_t i = 0; i < m->n; i++) {
        const struct imported_element *e = &s->elements[i];
        const char *material =
            e->material == TABLE_NONE ? "default" : name_table_get(&s->materials, e->material);
        const char *name = e->object != TABLE_NONE     ? name_table_get(&s->objects, e->object)
                           : e->material != TABLE_NONE ? material
                                                       : m->name;
        if (e->object != TABLE_NONE && only[e->object] == several) {
            const size_t length = strlen(name) + 1 + strlen(material) + 1;
            TRY(array_grow(&joined, &joined_capacity, length, 1, "groups", error));
            snprintf(joined, length, "%s.%s", name, material);
            name = joined;
        }
        TRY(name_table_add(&names, name, strlen(name), &m->group[i], error));
    }
    m->n_groups = names.n;
    m->group_names = name_table_block(&names, error);
    if (m->group_names == NULL) TRY(LAM_ERR_MEMORY);
done:
    free(only);
    free(joined);
    name_table_free(&names);
    return status;
}

/* Rays are traced in single precision: the products of lengths that they meet leave its range in scenes of
 * other sizes, and light leaves through the walls of a room of 1e-15 or 1e20 m. */
static const double size_least = 1e-12, size_most = 1e15;

static lam_status check_size(const mesh *m, const char *path, double unit, lam_error *error) {
    double centre[3], radius;
    mesh_bounds(m, centre, &radius);
    const double size = 2 * radius;
    if (size >= size_least && size <= size_most) return LAM_OK;
    return status_fail(
        error, LAM_ERR_ARGUMENT,
        "%s: the scene is %.3g m across with --unit %g, must be from %g to %g m: give another --unit", path,
        size, unit, size_least, size_most);
}

static lam_status copy_geometry(imported_faces *s, const char *path, double unit, mesh *m, lam_error *error) {
    lam_status status = LAM_OK;
    m->n = s->n_elements;
    m->elements = memory_allocate(m->n, sizeof *m->elements, "elements", error);
    if (m->elements == NULL) TRY(LAM_ERR_MEMORY);
    m->faces.n_faces = s->n_polygons;
    m->faces.of = memory_allocate(m->n, sizeof *m->faces.of, "elements", error);
    if (m->faces.of == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t i = 0; i < m->n; i++) {
        memcpy(m->elements[i], s->elements[i].corners, sizeof *m->elements);
        m->faces.of[i] = s->elements[i].polygon;
    }
    m->n_vertices = s->points.n;
    m->vertices = s->points.points; /* taken over */
    s->points.points = NULL;
    for (size_t v = 0; v < m->n_vertices; v++)
        for (int k = 0; k < 3; k++) {
            m->vertices[v][k] *= unit;
            if (!(fabs(m->vertices[v][k]) < 1e30))
                FAIL(error, LAM_ERR_ARGUMENT, "%s: vertex %zu: coordinate %g m with --unit %g is too large",
                     path, v, m->vertices[v][k], unit);
        }
    TRY(check_size(m, path, unit, error));
    TRY(mesh_measure(m, error));
done:
    return status;
}

/* Takes the unit that a scene in metres is probably in; *unit stays where metres are as likely. */
static lam_status guess_unit(mesh *m, const char *path, double *unit, const length_unit **guessed,
                             lam_error *error) {
    lam_status status = LAM_OK;
    *guessed = mesh_likely_unit(m);
    if (*guessed == NULL) return LAM_OK;
    *unit = (*guessed)->metres;
    for (size_t v = 0; v < m->n_vertices; v++)
        for (int k = 0; k < 3; k++) m->vertices[v][k] *= *unit;
    TRY(check_size(m, path, *unit, error));
    TRY(mesh_measure(m, error));
done:
    return status;
}

/* Cameras in metres. One that --unit moves too far is left out, as a vertex there would be refused. */
static void take_cameras(imported_faces *s, double unit, mesh *m) {
    m->cameras = s->cameras;
    s->cameras = NULL;
    for (size_t k = 0; k < s->n_cameras; k++) {
        scene_camera c = m->cameras[k];
        for (int d = 0; d < 3; d++) c.eye[d] *= unit;
        if (scene_camera_settle(&c)) m->cameras[m->n_cameras++] = c;
    }
}

/* Lights in metres, by the limit of vertices. */
static lam_status take_lights(imported_faces *s, const char *path, double unit, mesh *m, lam_error *error) {
    lam_status status = LAM_OK;
    for (size_t k = 0; k < s->n_punctual; k++) {
        punctual_light *l = &s->punctual[k];
        for (int d = 0; d < 3; d++) l->at[d] *= unit;
        if (!punctual_light_settle(l))
            FAIL(error, LAM_ERR_ARGUMENT, "%s: light '%s': a coordinate with --unit %g is too large", path,
                 l->name, unit);
    }
    m->punctual = s->punctual;
    m->n_punctual = s->n_punctual;
    s->punctual = NULL;
done:
    return status;
}

/* Formats in single precision lose the shape of a small scene far from the origin; the text of an OBJ does
 * not. */
static void warn_of_lost_precision(imported_faces *s, const char *path, const mesh *m) {
    double centre[3], radius, farthest = 0;
    mesh_bounds(m, centre, &radius);
    for (int k = 0; k < 3; k++) farthest = fmax(farthest, fabs(centre[k]));
    if (farthest * 0x1p-23 > 1e-4 * 2 * radius)
        import_warn(
            &s->warnings,
            "%s: coordinates near %g m are kept to %.2g m in single precision; move the scene to the origin",
            path, farthest, farthest * 0x1p-23);
}

static lam_status check_options(const import_options *options, lam_error *error) {
    lam_status status = LAM_OK;
    struct stat about;
    if (!(options->unit > 0) || !isfinite(options->unit))
        FAIL(error, LAM_ERR_ARGUMENT, "unit = %g metres, must be positive", options->unit);
    if (options->up != 0 && options->up != 'x' && options->up != 'y' && options->up != 'z')
        FAIL(error, LAM_ERR_ARGUMENT, "up = '%c', must be x, y or z", options->up);
    if (isnan(options->reflectance) || (options->reflectance >= 0 && (float)options->reflectance >= 1))
        FAIL(error, LAM_ERR_ARGUMENT, "reflectance = %g, must be below 1", options->reflectance);
    if (options->assets != NULL && (stat(options->assets, &about) != 0 || !S_ISDIR(about.st_mode)))
        FAIL(error, LAM_ERR_ARGUMENT, "assets = '%s', must be a folder that can be read", options->assets);
done:
    return status;
}

lam_status scene_import(const char *path, const import_options *options, mesh *m, import_report *report,
                        lam_error *error) {
    lam_status status = LAM_OK;
    imported_faces s = {0};
    mesh made = {0};
    import_report found = {0};
    double unit = options->unit;
    const bool is_obj =
        strcasecmp(options->format != NULL ? options->format : extension_of(path), "obj") == 0;
    child_limits limits = {
        .cpu_seconds = options->cpu_seconds > 0 ? options->cpu_seconds : 120,
        .memory_bytes = options->memory_bytes > 0 ? options->memory_bytes : (size_t)8 << 30,
        .assets = options->assets,
        .format = options->format,
        .unit = options->guess_unit ? 0 : options->unit,
    };
    TRY(check_options(options, error));
    if (is_input(path) && options->format == NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "standard input has no extension: give its format, " IMPORT_FORMATS);
    if (is_input(path)) TRY(keep_input(limits.memory_bytes / 2, &limits.input, error));
    TRY(import_in_child(is_obj ? obj_read : assimp_read, path, &limits, &s, error));
    stem_of(is_input(path) ? "stdin" : path, made.name, sizeof made.name);
    made.up = options->up != 0 ? options->up : is_gltf(path, options) ? 'y' : 'z';
    TRY(copy_geometry(&s, path, unit, &made, error));
    if (options->guess_unit) TRY(guess_unit(&made, path, &unit, &found.unit, error));
    made.unit = unit;
    take_cameras(&s, unit, &made);
    TRY(take_lights(&s, path, unit, &made, error));
    TRY(name_groups(&s, &made, error));
    TRY(apply_materials(&s, path, options, &made, &found, error));
    TRY(lay_textures(&s, path, unit, &made, &found, error));
    TRY(find_panes(&s, path, &made, error));
    if (!options->fronts_only) TRY(mark_backs(&s, &made, error));
    if (options->guess_up) found.up = mesh_likely_up(&made);
    if (found.up != 0) made.up = found.up;
    if (!is_obj) warn_of_lost_precision(&s, path, &made);
    coincident_find_rounding(&made);
    TRY(mesh_settle_coincident(&made, options->two_sided, &found.coincident, error));
    mesh_geometry_hash(&made, made.source_hash);
    found.dropped_faces = s.dropped;
    if (is_gltf(path, options) && found.luminous + s.n_punctual > 0) made.lights = LIGHT_PHOTOMETRIC;
    if (s.latin1 > 0)
        import_warn(&s.warnings, "%s: %zu name%s not UTF-8, read as Latin-1", path, s.latin1,
                    s.latin1 == 1 ? " is" : "s are");
    if (s.warnings.omitted > 0)
        snprintf(found.warnings, sizeof found.warnings, "%.*s\n%llu more warnings",
                 (int)sizeof found.warnings - 64, s.warnings.text, (unsigned long long)s.warnings.omitted);
    else
        snprintf(found.warnings, sizeof found.warnings, "%s", s.warnings.text);
    *m = made;
    made = (mesh){0};
    if (report != NULL) *report = found;
done:
    if (limits.input > 0) close(limits.input);
    mesh_free(&made);
    imported_faces_free(&s);
    return status;
}
