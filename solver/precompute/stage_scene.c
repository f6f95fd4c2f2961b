/* The first stage of a precompute: a scene becomes a mesh, with its openings, backs and tiles of the sky. */
#include "solver/base/atomic_file.h"
#include "solver/formfactor/facing.h"
#include "solver/precompute/stages.h"
#include "solver/scene/import/import.h"
#include "solver/scene/size_question.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

bool precompute_takes_as_store(const char *path) {
    static const unsigned char signature[8] = {0x89, 'H', 'D', 'F', '\r', '\n', 0x1a, '\n'};
    unsigned char start[8] = {0};
    char extension[16];
    struct stat about;
    atomic_file_extension(path, extension);
    if (strcmp(extension, "h5") == 0) return true;
    if (stat(path, &about) != 0 || !S_ISREG(about.st_mode)) return false;
    FILE *stream = fopen(path, "rb");
    if (stream == NULL) return false;
    const bool whole = fread(start, 1, sizeof start, stream) == sizeof start;
    fclose(stream);
    return whole && memcmp(start, signature, sizeof start) == 0;
}

static void log_warnings(terminal *t, const char *warnings) {
    while (*warnings != '\0') {
        const size_t length = strcspn(warnings, "\n");
        if (length > 0) terminal_warn(t, "%.*s", (int)length, warnings);
        warnings += length + (warnings[length] == '\n');
    }
}

static void warn_of_coincident(terminal *t, const coincident_report *found) {
    if (found->dropped > 0) terminal_warn(t, "%s", found->dropped_line);
    if (found->cut_line[0] != '\0') terminal_warn(t, "%s", found->cut_line);
    if (found->overlapping > 0) terminal_warn(t, "%s", found->overlap_line);
}

/* Turns faces; the hash of the source stays that of the file. Faces that lay back to back may be twins
 * then. */
static lam_status orient(const precompute_job *job, precompute_scene *scene, lam_error *error) {
    lam_status status = LAM_OK;
    facing_turned turned;
    coincident_report found;
    TRY(facing_orient(&scene->m, &job->progress, &turned, error));
    if (job->options->fix && turned.turned > 0)
        terminal_warn(job->t,
                      "%s: --fix turns %zu of %zu faces to the light; of %zu the side was not decided",
                      job->options->input, turned.turned, scene->m.n, turned.undecided);
    else
        terminal_log(job->t, "%zu of %zu faces turned; for %zu the side was not decided", turned.turned,
                     scene->m.n, turned.undecided);
    TRY(mesh_settle_coincident(&scene->m, job->options->two_sided == SIDES_BOTH, &found, error));
    if (turned.turned > 0) warn_of_coincident(job->t, &found);
done:
    return status;
}

/* Settles which faces get a back, by --two-sided or by the materials, and says what these ask for. */
static lam_status choose_backs(const precompute_job *job, precompute_scene *scene, lam_error *error) {
    const sides_asked asked = job->options->two_sided;
    mesh *const m = &scene->m;
    size_t n = 0;
    if (asked == SIDES_BOTH) return mesh_mark_two_sided(m, error);
    for (size_t i = 0; m->has_back != NULL && i < m->n; i++) n += m->has_back[i];
    if (n == 0) {
        free(m->has_back);
        m->has_back = NULL;
        return LAM_OK;
    }
    terminal_log(job->t,
                 "%zu of %zu faces get a back, as their materials are double-sided; --two-sided=no leaves "
                 "these backs out",
                 n, m->n);
    return LAM_OK;
}

/* Tiles of the sky of a scene. */
static lam_status count_tiles(const precompute_job *job, precompute_scene *scene, lam_error *error) {
    lam_status status = LAM_OK;
    sky_tiling tiling;
    if (job->options->sky == NULL) return LAM_OK;
    TRY(sky_tiling_create(job->options->sky, scene->m.up, &tiling, error));
    scene->sky_tiles = tiling.n_tiles;
    sky_tiling_free(&tiling);
done:
    return status;
}

/* Asks for a unit or an axis that nobody gave and that the scene does not look like, or says that --fix took
 * them. */
static void ask_of_size(const precompute_job *job, const mesh *m, const import_report *report) {
    const precompute_options *o = job->options;
    double low[3], high[3];
    const length_unit *unit = o->unit > 0 || o->fix ? NULL : mesh_likely_unit(m);
    const char up = o->up != NULL || o->fix ? 0 : mesh_likely_up(m);
    mesh_box(m, low, high);
    const double size[3] = {high[0] - low[0], high[1] - low[1], high[2] - low[2]};
    if (unit != NULL)
        terminal_warn(job->t, "%s: %.6g m x %.6g m x %.6g m: is the unit %s? --unit %s", o->input, size[0],
                      size[1], size[2], unit->name, unit->word);
    if (up != 0) terminal_warn(job->t, "%s: does it lie on its side, with %c up? --up %c", o->input, up, up);
    if (report->unit != NULL)
        terminal_warn(job->t, "%s: --fix takes it for %s: %.6g m x %.6g m x %.6g m (--unit m leaves it)",
                      o->input, report->unit->name, size[0], size[1], size[2]);
    if (report->up != 0)
        terminal_warn(job->t, "%s: --fix takes it to lie on its side: %c is up (--up leaves it)", o->input,
                      report->up);
}

/* --fix: a room from outside is turned as a whole; what is left is turned as --orient does. */
static lam_status fix_sides(const precompute_job *job, precompute_scene *scene, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = job->options;
    bool turned = false;
    if (o->two_sided == SIDES_BOTH) return LAM_OK; /* every side is there */
    if (o->sky == NULL) TRY(facing_turn_inward(&scene->m, &turned, error));
    if (turned)
        terminal_warn(job->t, "%s: --fix turns all %zu faces: no face sees another one, and their backs do",
                      o->input, scene->m.n);
    TRY(orient(job, scene, error));
done:
    return status;
}

void scene_take_lights(const precompute_job *job, mesh *m) {
    const char *asked = job->options->lights;
    const light_kind found = m->lights;
    if (asked == NULL || !light_kind_find(asked, &m->lights) || m->lights == found) return;
    terminal_log(job->t, "--lights %s: emission and answers of the store are in %s, with the numbers of %s",
                 asked, m->lights == LIGHT_PHOTOMETRIC ? "lm/m2 and lx" : "W/m2", light_kind_word(found));
}

lam_status stage_load_scene(const precompute_job *job, precompute_scene *scene, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = job->options;
    const import_options how = {.unit = o->unit > 0 ? o->unit : 1,
                                .up = o->up != NULL ? o->up[0] : 0,
                                .guess_unit = o->fix && !(o->unit > 0),
                                .guess_up = o->fix && o->up == NULL,
                                .reflectance = o->reflectance,
                                .two_sided = o->two_sided == SIDES_BOTH,
                                .fronts_only = o->two_sided == SIDES_FRONTS,
                                .format = o->format,
                                .assets = o->assets};
    import_report report = {0};
    TRY(scene_import(o->input, &how, &scene->m, &report, error));
    scene->n_faces = scene->m.n;
    log_warnings(job->t, report.warnings);
    ask_of_size(job, &scene->m, &report);
    if (report.dropped_faces > 0)
        terminal_log(job->t, "%zu face%s of zero area dropped", report.dropped_faces,
                     report.dropped_faces == 1 ? "" : "s");
    if (report.luminous > 0)
        terminal_log(
            job->t,
            "the emission of %zu material%s is luminance in cd/m2, as glTF has it: the exitance is pi "
            "times that, in lm/m2",
            report.luminous, report.luminous == 1 ? "" : "s");
    scene_take_lights(job, &scene->m);
    if (report.clamped > 0)
        terminal_log(job->t, "%zu material%s reflected all light or more, or nearly: set to .9999",
                     report.clamped, report.clamped == 1 ? "" : "s");
    warn_of_coincident(job->t, &report.coincident);
    TRY(scene_take_portals(job, scene, error));
    if (o->fix)
        TRY(fix_sides(job, scene, error));
    else if (o->orient)
        TRY(orient(job, scene, error));
    TRY(scene_find_openings(job, scene, error));
    TRY(choose_backs(job, scene, error));
    TRY(scene_take_glass(job, scene, error));
    TRY(count_tiles(job, scene, error));
    TRY(scene_take_luminaires(job, scene, error));
    TRY(scene_take_sensors(job, scene, error));
done:
    return status;
}
