/* The check of a store's luminaires. */
#include "solver/direct/direct_elements.h"
#include "solver/luminaire/placed_store.h"
#include "solver/operator/luminaire_light.h"
#include "solver/precompute/precompute.h"
#include "solver/scene/glass.h"
#include "solver/verify/verify.h"
#include "store/groups.h"

#include <math.h>
#include <stdlib.h>

/* The light of so many luminaires is found again. */
enum { AGAIN_MOST = 8 };

/* The integral over an element is right to .2 %; twice that of two, and their rounding. */
static const double integral = .005;

/* Differences of more standard errors than this are none of chance. */
static const double certain = 5;

/* A luminaire gives elements no more than its flux: sum A H <= lumens, and a pane passes on a part of what it
 * gets (mesh_row_most). */
static void check_fluxes(const examination *e, const lam_luminaires *l, check *c) {
    const size_t n = e->m.n;
    const double most = mesh_row_most(&e->m);
    for (size_t k = 0; k < lam_luminaires_count(l) && c->verdict == VERDICT_OK; k++) {
        const float *H = luminaires_irradiance(l) + k * n;
        const double lumens = luminaires_shown(l, k).lumens;
        double flux = 0;
        for (size_t i = 0; i < n; i++) flux += e->m.area[i] * (double)H[i];
        if (flux > (1 + integral) * most * lumens)
            check_say(c, VERDICT_BROKEN,
                      "elements receive %.6g lm of luminaire %s, which gives them at most %.6g lm", flux,
                      lam_luminaires_name(l, k), most * lumens);
    }
}

/* The mean square of the difference of two columns over a group, and of the first. */
typedef struct group_difference {
    double area, off2, light2;
} group_difference;

static void compare(const examination *e, const lam_luminaires *l, const placed_luminaires *p, size_t k,
                    const direct_light *again, size_t row, group_difference *of, check *c) {
    const mesh *m = &e->m;
    const float *H = luminaires_irradiance(l) + k * m->n, *other = again->H + row * m->n;
    const double *stated = luminaires_elements_off(l);
    double flux = 0;
    for (size_t g = 0; g < m->n_groups; g++) of[g] = (group_difference){0, 0, 0};
    for (size_t i = 0; i < m->n; i++) {
        const double d = (double)H[i] - (double)other[i];
        group_difference *to = &of[m->group[i]];
        to->area += m->area[i];
        to->off2 += m->area[i] * d * d;
        to->light2 += m->area[i] * (double)H[i] * (double)H[i];
        flux += m->area[i] * (double)H[i];
    }
    for (size_t g = 0; g < m->n_groups && c->verdict == VERDICT_OK; g++) {
        const double noise2 = (stated != NULL ? stated[k * m->n_groups + g] : 0) +
                              (double)again->elements_off[row * m->n_groups + g];
        const double allowed2 =
            certain * certain * noise2 * of[g].area +
            integral * integral * (of[g].light2 + flux * flux / fmax(of[g].area, 1e-300) * 1e-6);
        if (of[g].off2 > allowed2)
            check_say(c, VERDICT_BROKEN,
                      "luminaire %s gives %s other light than its place and table do: off by %.3g of it, "
                      "within %.3g by its stated error",
                      p->luminaires[k].name, m->group_names[g], sqrt(of[g].off2 / fmax(of[g].light2, 1e-300)),
                      sqrt(allowed2 / fmax(of[g].light2, 1e-300)));
    }
}

lam_status verify_luminaires(examination *e, check *c, lam_error *error) {
    lam_status status = LAM_OK;
    lam_luminaires *l = NULL;
    placed_luminaires p = {.n = 0};
    direct_light again = {.n = 0};
    group_difference *of = NULL;
    size_t chosen[AGAIN_MOST], n_chosen;
    if (!e->has_mesh || !store_has(e->s, STORE_LUMINAIRES)) {
        check_say(c, VERDICT_SKIPPED, e->has_mesh ? "there are none" : "no mesh to compare with");
        return LAM_OK;
    }
    const mesh *m = &e->m;
    TRY(luminaires_load(e->s, m->n, m->n_channels, &l, error));
    TRY(placed_load(e->s, m->n_groups, m->group_names, &p, error));
    n_chosen = p.n < AGAIN_MOST ? p.n : AGAIN_MOST;
    for (size_t k = 0; k < n_chosen; k++) chosen[k] = k * p.n / n_chosen;
    check_say(c, VERDICT_OK, "%zu, the light of %zu of them was found again, as stated", p.n, n_chosen);
    if (m->lights != LIGHT_PHOTOMETRIC)
        check_say(c, VERDICT_BROKEN, "there are %zu, but the store counts in W", p.n);
    check_fluxes(e, l, c);
    const direct_options how = {.seed = precompute_seed(0, SEED_VERIFY_LUMINAIRES),
                                .progress = e->progress,
                                .stage = "luminaires",
                                .n_wanted = n_chosen,
                                .wanted = chosen};
    of = memory_allocate(m->n_groups, sizeof *of, "light of luminaires", error);
    if (of == NULL) TRY(LAM_ERR_MEMORY);
    TRY(direct_light_make(m, &p, &how, &again, error));
    for (size_t k = 0; k < n_chosen; k++) compare(e, l, &p, chosen[k], &again, k, of, c);
done:
    lam_luminaires_close(l);
    placed_free(&p);
    direct_light_free(&again);
    free(of);
    return check_failed(c, status, error);
}
