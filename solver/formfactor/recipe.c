#include "solver/formfactor/recipe.h"
#include "store/groups.h"

#include "solver/formfactor/source.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MIN_AUTO_RAYS = 256, MAX_AUTO_RAYS = 65536 };

static const char *const closure_names[] = {"measured", "closed", "open"};
enum { N_CLOSURES = sizeof closure_names / sizeof closure_names[0] };

const recipe_names recipe_of_form_factors = {STORE_FORM_FACTORS, "method", "seed"};
const recipe_names recipe_of_operator = {STORE_OPERATOR, "form_factors", "ray_seed"};

const char *recipe_name(const recipe *r) {
    return recipe_source(r)->name;
}

lam_status recipe_check(const recipe *r, lam_error *error) {
    if (recipe_can(r, SOURCE_RESOLUTION)) {
        if (r->resolution < HEMICUBE_RESOLUTION_LEAST || r->resolution > HEMICUBE_RESOLUTION_MOST ||
            r->resolution % 2 != 0)
            return status_fail(error, LAM_ERR_ARGUMENT, "--resolution %zu: must be even, from %d to %d",
                               r->resolution, HEMICUBE_RESOLUTION_LEAST, HEMICUBE_RESOLUTION_MOST);
        return LAM_OK;
    }
    if (r->rays < 1 || r->rays > RECIPE_RAYS_MOST)
        return status_fail(error, LAM_ERR_ARGUMENT, "--rays %zu: must be from 1 to %d", r->rays,
                           RECIPE_RAYS_MOST);
    if (recipe_can(r, SOURCE_ACCURACY) && !(r->accuracy > 0 && r->accuracy <= 1))
        return status_fail(error, LAM_ERR_ARGUMENT, "accuracy %g: must be above 0 and at most 1",
                           r->accuracy);
    return LAM_OK;
}

void recipe_describe(const recipe *r, char text[64]) {
    recipe_source(r)->describe(r, text);
}

lam_status recipe_save(const recipe *r, const recipe_names *names, store *s, lam_error *error) {
    lam_status status = LAM_OK;
    const char *const group = names->group;
    TRY(store_set_text(s, group, names->method, recipe_name(r), error));
    TRY(store_set_integer(s, group, "rays", (int64_t)r->rays, error));
    TRY(store_set_integer(s, group, names->seed, (int64_t)r->seed, error));
    if (recipe_can(r, SOURCE_RESOLUTION))
        TRY(store_set_integer(s, group, "resolution", (int64_t)r->resolution, error));
    if (r->accuracy > 0) TRY(store_set_number(s, group, "accuracy", r->accuracy, error));
    TRY(recipe_save_closure(r->closure, group, s, error));
done:
    return status;
}

lam_status recipe_save_closure(scene_closure closure, const char *group, store *s, lam_error *error) {
    if (closure == CLOSURE_MEASURED) return LAM_OK;
    return store_set_text(s, group, "closure", closure_names[closure], error);
}

lam_status recipe_load_closure(store *s, const char *group, scene_closure *out, lam_error *error) {
    lam_status status = LAM_OK;
    char *name = NULL;
    size_t k = 0;
    *out = CLOSURE_MEASURED;
    if (!store_has_attribute(s, group, "closure")) goto done;
    TRY(store_get_text(s, group, "closure", &name, error));
    while (k < N_CLOSURES && strcmp(name, closure_names[k]) != 0) k++;
    if (k == N_CLOSURES)
        FAIL(error, LAM_ERR_FORMAT, "%s: %s attribute closure is '%.20s', must be closed or open",
             store_path(s), group, name);
    *out = (scene_closure)k;
done:
    free(name);
    return status;
}

lam_status recipe_load(store *s, const recipe_names *names, recipe *out, lam_error *error) {
    lam_status status = LAM_OK;
    const char *const group = names->group;
    int64_t rays = 0, resolution = 0, seed = 0;
    char *method = NULL;
    recipe r = {0};
    lam_error why = {0};
    TRY(store_get_text(s, group, names->method, &method, error));
    r.source = source_find(method);
    if (r.source == NULL)
        FAIL(error, LAM_ERR_UNSUPPORTED,
             "%s: %s attribute %s is '%.20s', which is not supported; precompute the scene again, or use the "
             "version of lambert that wrote the store",
             store_path(s), group, names->method, method);
    TRY(store_get_integer(s, group, "rays", &rays, error));
    TRY(store_get_integer(s, group, names->seed, &seed, error));
    if (recipe_can(&r, SOURCE_RESOLUTION)) TRY(store_get_integer(s, group, "resolution", &resolution, error));
    if (recipe_can(&r, SOURCE_ACCURACY)) TRY(store_get_number(s, group, "accuracy", &r.accuracy, error));
    r.rays = rays < 0 ? 0 : (size_t)rays;
    r.resolution = resolution < 0 ? 0 : (size_t)resolution;
    r.seed = (uint64_t)seed;
    TRY(recipe_load_closure(s, group, &r.closure, error));
    if (recipe_check(&r, &why) != LAM_OK)
        FAIL(error, LAM_ERR_FORMAT, "%s: %s: %s", store_path(s), group, why.message);
    *out = r;
done:
    free(method);
    return status;
}

double recipe_tolerance(const recipe *r) {
    /* 1e-5 and 1e-6 at the accuracies of normal and high quality. */
    return fmin(r->accuracy / 7, 1e-4);
}

double recipe_near(const recipe *r) {
    return 1 / (double)r->rays;
}

double recipe_accuracy(const recipe *r) {
    const factor_source *const source = recipe_source(r);
    return source->accuracy != NULL ? source->accuracy(r) : r->accuracy;
}

double recipe_shadow(const recipe *r) {
    /* Measured in a closed Cornell box: single elements, which feel shadows, and lamps then err alike. Finer
     * bounds leave more of the shadows to pairs of elements, whose errors are independent: blocks in patio,
     * atrium, rooms and Cornell box (1,498 to 6,003 elements) take 8 to 20 % less time at equal error with
     * twice the share at a sixteenth of the accuracy. */
    static const double shadow_share = 10. / 3, of_accuracy = 2.4e-4, power = .25;
    return fmin(shadow_share * pow(fmax(of_accuracy / r->accuracy, 1), power) * r->accuracy, 1);
}

size_t recipe_rays_beside_blocks(size_t n) {
    enum { OF_ALL = 1 << 21, LEAST = 8, MOST = 128 };
    const size_t each = (OF_ALL / n + LEAST - 1) / LEAST * LEAST;
    return each < LEAST ? LEAST : each > MOST ? MOST : each;
}

double recipe_coarser(double epsilon) {
    static const double from = .05 / 16;
    return fmax(sqrt(epsilon / from), 1);
}

size_t recipe_auto_rays(double epsilon, double share) {
    /* sqrt(2 / rays) <= share epsilon */
    const double wanted = 2 / (share * epsilon * share * epsilon);
    size_t rays = MIN_AUTO_RAYS;
    while (rays < MAX_AUTO_RAYS && (double)rays < wanted) rays *= 2;
    return rays;
}

double recipe_noise(const recipe *r) {
    /* For independent rays, after merging the two estimates of a pair. A hemicube samples nothing, and of
     * pairs only the partly occluded ones are sampled, far more finely. */
    return recipe_can(r, SOURCE_NOISE) ? sqrt(2 / (double)r->rays) : 0;
}

recipe recipe_of_judge(const recipe *judged, size_t rays_beside_hemicubes, uint64_t seed) {
    recipe r = recipe_source(judged)->judge(judged, rays_beside_hemicubes);
    r.seed = seed;
    r.closure = judged->closure;
    return r;
}
