/* From faces to elements, as the options of the mesh say. */
#include "solver/adapt/mesh_fit.h"
#include "solver/base/scene/scene_backs.h"
#include "solver/formfactor/buried.h"
#include "solver/precompute/black_scene.h"
#include "solver/precompute/mesh_luminaires.h"
#include "solver/precompute/plan.h"
#include "solver/precompute/stages.h"
#include "solver/scene/facet/face_join.h"
#include "solver/scene/glass.h"
#include "solver/scene/import/picture_files.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Elements that --mesh-error makes at most, unless --elements gives their number. */
enum { ADAPTIVE_ELEMENTS = 40000 };

/* The elements that a mesh of an error is thought to have before it is divided. */
enum { COARSE_ADVICE = 5000 };

static lam_status join_faces(const precompute_job *job, precompute_scene *scene, faces_before *before,
                             lam_error *error) {
    const size_t faces = scene->m.n;
    const lam_status status = faces_join(&scene->m, before, error);
    if (status == LAM_OK && scene->m.n < faces)
        terminal_log(job->t, "%zu faces are left of %zu, as those of one material in one plane are joined",
                     scene->m.n, faces);
    return status;
}

/* With the backs that are still to be made. */
static size_t elements_to_be(const mesh *m) {
    size_t n = m->n;
    for (size_t i = 0; m->has_back != NULL && i < m->n; i++) n += m->has_back[i];
    return n;
}

/* "0.021 of the light of lamps, 0.04 of light that all elements emit" */
enum { LEFT_BYTES = 160 };
static void describe_left(const mesh_estimate *e, char text[LEFT_BYTES]) {
    size_t length = 0;
    if (e->has_lamps) length += (size_t)snprintf(text, LEFT_BYTES, "%.3g of the light of lamps, ", e->lamps);
    if (e->has_groups)
        length +=
            (size_t)snprintf(text + length, LEFT_BYTES - length, "%.3g of the light of groups, ", e->groups);
    if (e->has_sky)
        length +=
            (size_t)snprintf(text + length, LEFT_BYTES - length, "%.3g of that of an even sky, ", e->sky);
    snprintf(text + length, LEFT_BYTES - length, "%.3g of light that all elements emit", e->even);
}

/* Divides the mesh where light changes, says what that leaves, and warns where it is more than was asked for.
 */
static lam_status refine_by_error(const precompute_job *job, precompute_scene *scene,
                                  const gather_direct *direct, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = job->options;
    const coarse_sky sky = {.ground_albedo = o->ground_albedo, .openings = scene->openings};
    const adaptive_options how = {.error = o->mesh_error,
                                  .elements = o->elements > 0 ? o->elements : ADAPTIVE_ELEMENTS,
                                  .from = {.sky = o->sky != NULL ? &sky : NULL, .direct = direct},
                                  .seed = precompute_seed(o->seed, SEED_MESH),
                                  .progress = &job->progress};
    adaptive_report made;
    char left[LEFT_BYTES];
    TRY(adaptive_refine(&scene->m, &how, &made, error));
    describe_left(&made.left, left);
    terminal_log(job->t, "constants on elements leave %s", left);
    if (!made.reached)
        terminal_warn(job->t,
                      "--mesh-error %g is not kept with %zu elements: they leave %.3g; --elements takes more "
                      "than %zu",
                      o->mesh_error, elements_to_be(&scene->m), mesh_estimate_most(&made.left), how.elements);
done:
    return status;
}

/* By preset constants leave this error, and there are at most ADAPTIVE_ELEMENTS elements, or a quarter more
 * than faces; fewer where --time is less than these seconds. */
static const double fit_error = .05, fit_seconds = 30, fit_of_face = 1.25;

static bool is_fitted(const precompute_options *o) {
    return !o->from_store && o->mesh == MESH_OF_LIGHT && o->max_edge == 0 && o->elements == 0 &&
           o->mesh_error == 0;
}

/* The cuts along walls that come before a mesh by preset is divided. */
typedef struct walls_to_cut {
    const precompute_job *job;
    precompute_scene *scene;
    double edge;
    size_t most;
} walls_to_cut;

static lam_status cut_at_walls(void *of, lam_error *error) {
    const walls_to_cut *w = of;
    return scene_cut_at_walls(w->job, w->scene, w->edge, w->most, error);
}

/* The mesh by preset, with a line on what was divided and why. */
static lam_status fit_to_light(const precompute_job *job, precompute_scene *scene,
                               const gather_direct *direct, double edge, bool *divided, lam_error *error) {
    static const char *const ways[] = {"stay as they are", "are divided evenly",
                                       "are divided where light changes"};
    lam_status status = LAM_OK;
    const precompute_options *o = job->options;
    const size_t faces = elements_to_be(&scene->m);
    const coarse_sky sky = {.ground_albedo = o->ground_albedo, .openings = scene->openings};
    const double share = o->time > 0 ? fmin(1, o->time / fit_seconds) : 1;
    walls_to_cut walls = {.job = job, .scene = scene, .edge = edge, .most = SIZE_MAX};
    const mesh_fit_options how = {.error = fit_error,
                                  .elements =
                                      (size_t)(share * fmax(ADAPTIVE_ELEMENTS, fit_of_face * (double)faces)),
                                  .effort = share,
                                  .from = {.sky = o->sky != NULL ? &sky : NULL, .direct = direct},
                                  .cut = cut_at_walls,
                                  .cut_of = &walls,
                                  .seed = precompute_seed(o->seed, SEED_MESH),
                                  .progress = &job->progress};
    mesh_fit_report made;
    char before[LEFT_BYTES], left[LEFT_BYTES];
    const double bytes = coarse_light_bytes(faces);
    *divided = false;
    if (bytes > job->memory) {
        terminal_warn(
            job->t,
            "%zu faces stay as they are: the solution by which they are divided takes about %.0f MB, "
            "and --memory allows %.0f MB; give --elements, or more of it",
            faces, 1e-6 * bytes, 1e-6 * job->memory);
        return LAM_OK;
    }
    TRY(mesh_fit(&scene->m, &how, &made, error));
    *divided = made.way != MESH_FIT_FACES;
    describe_left(&made.faces, before);
    describe_left(&made.left, left);
    if (made.way == MESH_FIT_FACES)
        terminal_log(job->t, "%zu faces %s: constants on them leave %s", faces, ways[made.way], before);
    else
        terminal_log(job->t, "%zu faces %s, as constants on them leave %s; %zu elements leave %s", faces,
                     ways[made.way], before, elements_to_be(&scene->m), left);
    if (!made.reached)
        terminal_log(job->t, "%.2g is not reached with %zu elements; --elements or --mesh-error takes more",
                     fit_error, elements_to_be(&scene->m));
done:
    return status;
}

/* The fronts of a mesh that shall have some elements, backs included, where they are divided by area. */
static size_t fronts_of(const mesh *m, size_t elements) {
    double area = 0, all = 0;
    if (m->has_back == NULL) return elements;
    for (size_t i = 0; i < m->n; i++) {
        area += m->area[i];
        all += m->has_back[i] ? 2 * m->area[i] : m->area[i];
    }
    return (size_t)ceil((double)elements * (area / all));
}

/* Names a group of backs that could not be called after its fronts. */
static void log_renamed(const precompute_job *job, const precompute_scene *scene) {
    const mesh *m = &scene->m;
    size_t n_renamed = 0, first = 0, n_own = 0; /* groups of fronts */
    for (size_t i = 0; i < m->n - m->n_backs; i++)
        if (m->group[i] >= n_own) n_own = m->group[i] + (size_t)1;
    for (size_t g = n_own; g < m->n_groups; g++) {
        const char *at = strrchr(m->group_names[g], '.');
        if (at != NULL && strcmp(at, SCENE_BACK) == 0) continue;
        if (n_renamed++ == 0) first = g;
    }
    if (n_renamed > 0)
        terminal_warn(job->t,
                      "%zu group%s of backs cannot have the name of %s fronts with " SCENE_BACK
                      ", which another group has; the first is called '%.60s'",
                      n_renamed, n_renamed == 1 ? "" : "s", n_renamed == 1 ? "its" : "their",
                      m->group_names[first]);
}

/* About the edge of the elements that the options ask for, metres; 0: faces stay as they are. Nobody knows
 * yet how many elements it takes to keep an error. */
static double edge_to_be(const mesh *m, const precompute_options *o) {
    const bool by_error = (o->mesh_error > 0 || is_fitted(o)) && o->elements == 0;
    const size_t elements = by_error ? COARSE_ADVICE : fronts_of(m, o->elements);
    double area = 0;
    for (size_t i = 0; i < m->n; i++) area += m->area[i];
    if (o->max_edge > 0) return o->max_edge;
    return by_error || elements > m->n ? sqrt(area / (double)elements) : 0;
}

lam_status scene_find_buried(const precompute_job *job, precompute_scene *scene, lam_error *error) {
    lam_status status = LAM_OK;
    size_t n;
    TRY(buried_find(&scene->m, &n, error));
    if (n > 0)
        terminal_log(job->t, "%zu element%s between a body and the face that it stands on, without light", n,
                     n == 1 ? " lies" : "s lie");
done:
    return status;
}

lam_status scene_refine(const precompute_job *job, precompute_scene *scene, lam_error *error) {
    lam_status status = LAM_OK;
    const precompute_options *o = job->options;
    const double edge = edge_to_be(&scene->m, o);
    const bool black = black_scene_lighten(&scene->m);
    bool divided = true;
    faces_before before = {.n = 0};
    mesh_luminaires luminaires = {.sampler = NULL};
    const size_t most = o->elements > 0 ? fronts_of(&scene->m, o->elements) : SIZE_MAX;
    /* --elements counts both sides. */
    const mesh_refinement refinement = {
        .max_edge = o->max_edge, .elements = o->mesh_error > 0 ? 0 : fronts_of(&scene->m, o->elements)};
    if (o->mesh_error > 0) TRY(join_faces(job, scene, &before, error));
    if (edge > 0 && !is_fitted(o)) TRY(scene_cut_at_walls(job, scene, edge, most, error));
    if (refinement.max_edge > 0 || refinement.elements > 0) TRY(mesh_refine(&scene->m, &refinement, error));
    if (o->mesh_error > 0 || is_fitted(o)) TRY(mesh_luminaires_make(scene, &luminaires, error));
    const gather_direct *const direct = mesh_luminaires_light(&luminaires);
    if (o->mesh_error > 0) TRY(refine_by_error(job, scene, direct, error));
    if (is_fitted(o)) TRY(fit_to_light(job, scene, direct, edge, &divided, error));
    if (edge > 0 && divided) TRY(scene_log_under_walls(job, scene, edge, error));
    TRY(faces_part(&scene->m, &before, error));
    TRY(mesh_make_backs(&scene->m, error));
    log_renamed(job, scene);
    TRY(mesh_keep_pictures(&scene->m, error)); /* every element has its means */
    TRY(scene_find_buried(job, scene, error));
done:
    faces_before_free(&before);
    mesh_luminaires_free(&luminaires);
    if (black) black_scene_darken(&scene->m);
    return status;
}

/* Above this share of the area in one element, a mesh that was not divided is called coarse. */
static const double coarse_share = .02;

/* Logs what shows a wrong axis or unit, or a mesh too coarse to show light. */
void scene_log_mesh(const precompute_job *job, const precompute_scene *scene) {
    const mesh *m = &scene->m;
    const precompute_options *o = job->options;
    const char axes[] = {'x', 'y', 'z'};
    double low[3], high[3], size[3] = {0, 0, 0}, height = 0, area = 0, largest = 0;
    size_t n_wide = 0;
    mesh_box(m, low, high);
    for (int k = 0; k < 3; k++)
        if (axes[k] == m->up)
            height = high[k] - low[k];
        else
            size[n_wide++] = high[k] - low[k];
    for (size_t i = 0; i < m->n; i++) {
        area += m->area[i];
        largest = fmax(largest, m->area[i]);
    }
    terminal_log(job->t, "%zu elements in %zu groups, %zu channel%s%s", m->n, m->n_groups, m->n_channels,
                 m->n_channels == 1 ? "" : "s", m->two_sided ? ", two-sided" : "");
    terminal_log(job->t, "%.4g m x %.4g m, %.4g m high, %c up; --up and --unit set axis and unit", size[0],
                 size[1], height, m->up);
    if (o->mesh == MESH_OF_FACES && !o->from_store && largest > coarse_share * area)
        terminal_log(job->t,
                     "one element has %.0f %% of the area, and light does not vary across an element: "
                     "without --mesh faces they are divided",
                     100 * largest / area);
}

/* About how many elements there will be; never fewer than now. */
static double elements_after(const mesh *m, const precompute_options *o) {
    double n = (double)m->n, area = 0;
    if (o->max_edge > 0) {
        for (size_t i = 0; i < m->n; i++) area += m->area[i];
        n = fmax(n, area / (o->max_edge * o->max_edge));
    }
    size_t backs = 0;
    for (size_t i = 0; m->has_back != NULL && i < m->n; i++) backs += m->has_back[i];
    n *= 1 + (double)backs / (double)m->n;
    /* With --mesh-error they are the most, and nobody knows yet how many it takes. */
    return o->mesh_error > 0 ? n : fmax(n, (double)o->elements);
}

lam_status stage_prepare_mesh(const precompute_job *job, precompute_scene *scene, precompute_plan *plan,
                              lam_error *error) {
    lam_status status = LAM_OK;
    TRY(plan_check_mesh(job, scene, elements_after(&scene->m, job->options), plan, error));
    TRY(scene_refine(job, scene, error));
    scene->order = memory_allocate(scene->m.n, sizeof *scene->order, "the order of the elements", error);
    if (scene->order == NULL) TRY(LAM_ERR_MEMORY);
    TRY(mesh_z_order(&scene->m, scene->order, error));
    mesh_limit_panes(&scene->m);
    TRY(scene_read_importance(job, plan, scene, error));
done:
    return status;
}
