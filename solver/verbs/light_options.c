#include "solver/verbs/light_options.h"

#include "solver/base/photometry.h"
#include "solver/operator/emitters.h"
#include "solver/operator/luminaire_light.h"
#include "solver/operator/operator.h"
#include "solver/operator/refine/form_factor_rows.h"
#include "solver/operator/sky_light.h"
#include "store/groups.h"

#include <omp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define FIELD(member) offsetof(light_options, member)
const option_row light_rows[] = {
    {.name = "emit",
     .kind = OPTION_LIST,
     .offset = FIELD(emit),
     .argument = "GROUP=V[,V,V][UNIT]",
     .help = "A group emits V, one number or one per channel; 'desk*': all whose names begin so; may be "
             "repeated. 3600lm, 40W: the flux of all of it together; 500cd/m2, 100lm/m2, 12W/m2; a number "
             "alone is the exitance in the unit of the store (`lambert info`)"},
    {.name = "emission",
     .kind = OPTION_TEXT,
     .offset = FIELD(emission),
     .argument = "FILE.npy|.json",
     .help = "One emission from a file, or a batch of them for solve"},
    {.name = "dim",
     .kind = OPTION_LIST,
     .offset = FIELD(dim),
     .argument = "NAME=V[,V,V]",
     .help = "A luminaire, or a group of them, gives V of its light, one number or one per channel; the "
             "others are dark. Alone or beside the other light; may be repeated. Without any light all "
             "luminaires are as dim as their list says"},
    {.name = "sky",
     .kind = OPTION_TEXT,
     .offset = FIELD(sky),
     .argument = "NAME|FILE.npy|.mtx|.smx|.epw|.wea",
     .help =
         "even, overcast, clear or turbidity:T (of Linke, 1 to 20): a sky by name. Or radiances of the tiles "
         "of the sky, W/(m2 sr): [m], [C][m], or a batch of them for solve; alone "
         "or added to the other light. solve also takes what `lambert sky` reads: a matrix of Radiance on "
         "the tiles of the store, and weather, as --weather does. A store of one channel takes coloured "
         "skies, [b][3][m], by their luminance"},
    {.name = "unit-out",
     .kind = OPTION_CHOICE,
     .offset = FIELD(unit),
     .argument = "UNIT",
     .choices = ANSWER_UNIT_WORDS,
     .otherwise = "that of the light",
     .help = "Unit of the answer. W become lm by 179 lm/W, weather and skies with a sun as by --photometric; "
             "three channels become lx by their luminance. Of radiosity and indirect light the same per area "
             "that they leave: lm/m2, klm/m2, lm/ft2"},
    {0},
};

const char *light_named_sky(const light_options *options) {
    return options->sky != NULL && named_sky_is(options->sky) ? options->sky : NULL;
}

/* --unit-out */
static answer_unit unit_asked(const light_options *options) {
    answer_unit unit = ANSWER_PLAIN;
    if (options->unit != NULL) answer_unit_find(options->unit, strlen(options->unit), &unit);
    return unit;
}

lam_status light_check(light_options *options, lam_error *error) {
    lam_status status = LAM_OK;
    const answer_unit unit = unit_asked(options);
    const bool solar = options->weather || light_named_sky(options) != NULL;
    if (solar && unit != ANSWER_PLAIN && unit != ANSWER_W_M2) options->at.photometric = true;
    TRY(sky_options_check(&options->at, light_named_sky(options), options->weather, options->sky != NULL,
                          error));
    if (options->emit.count > 0 && options->emission != NULL)
        FAIL(error, LAM_ERR_ARGUMENT, "give --emit or --emission, not both");
    TRY(emission_check_items(&options->emit, error));
    TRY(emission_check_dims(&options->dim, error));
done:
    return status;
}

lam_status light_open(store *s, const mesh *m, const light_options *options, bool other, lit_store *out,
                      lam_error *error) {
    lam_status status = LAM_OK;
    char *tiling = NULL;
    form_factor_storage how;
    const char *const named = light_named_sky(options);
    const emission_options given = {.items = &options->emit,
                                    .dims = &options->dim,
                                    .path = options->emission,
                                    .frames = options->frames,
                                    .sky = named != NULL ? NULL : options->sky,
                                    .photometric = options->at.photometric,
                                    .signs = options->signs,
                                    .other = other || named != NULL};
    TRY(emission_scene_create(m, &out->scene, error));
    TRY(sky_load(s, m->n, &out->sky, error));
    TRY(luminaires_load(s, m->n, m->n_channels, &out->luminaires, error));
    TRY(operator_load(s, &out->op, error));
    /* A store whose form factors cannot be read is refused whole, as lambertd does. */
    if (store_has(s, STORE_FORM_FACTORS)) TRY(form_factors_storage(s, &how, error));
    TRY(emission_scene_sources(&out->scene, out->op, out->sky, out->luminaires, error));
    if (out->sky != NULL) TRY(store_get_text(s, STORE_SKY, "tiling", &tiling, error));
    if (tiling != NULL) snprintf(out->scene.tiling, sizeof out->scene.tiling, "%s", tiling);
    TRY(emission_choose(&out->scene, &given, &out->light, &out->own, error));
    if (named != NULL) {
        TRY(named_light_add(&options->at, named, s, m, out->op, out->sky, &out->light, &out->sun, out->said,
                            error));
        light_units_meet_sky(&out->light, &out->scene, sky_options_kind(&options->at, named, m->lights));
    }
    const emitters *few = operator_emitters_of(out->op);
    if (out->own && few != NULL && few->a.direct != NULL)
        FAIL(error, LAM_ERR_ARGUMENT,
             "%s answers for positions of a light that is no part of the scene: give --emit %.60s=1, or "
             "several",
             store_path(s), few->a.names[0]);
    lam_operator_set_threads(out->op, (size_t)omp_get_max_threads());
    const group_index *groups = &out->scene.groups;
    out->limiter = limiter_of(m->n, groups->n_groups, groups->start, groups->elements, m->area);
    out->light.limiter = &out->limiter;
done:
    free(tiling);
    return status;
}

void light_close(lit_store *lit) {
    emission_scene_free(&lit->scene);
    emission_free(&lit->light);
    sunlight_free(&lit->sun);
    lam_operator_close(lit->op);
    lam_sky_close(lit->sky);
    lam_luminaires_close(lit->luminaires);
}

lam_status light_convert(const light_options *options, sunlight *sun, sun_way *way, lit_store *lit,
                         lam_error *error) {
    return light_units_convert(&lit->light, &lit->scene, unit_asked(options), sun, way, &lit->told, error);
}

void light_log(const lit_store *lit, terminal *t) {
    char by[LIGHT_CONVERSION_TEXT];
    light_conversion_text(&lit->told, by);
    if (by[0] != '\0') terminal_log(t, "converted by %s", by);
    if (lit->said[0] != '\0') terminal_log(t, "%s", lit->said);
    if (lit->light.by_luminance)
        terminal_log(t,
                     "the store is grey: the coloured sky lights it by its luminance, %s, as Radiance has it",
                     RADIANCE_LUMINANCE_TEXT);
}

void light_log_limited(size_t n_vectors, const size_t *limited, terminal *t) {
    size_t all = 0;
    for (size_t v = 0; v < n_vectors; v++) all += limited[v];
    if (all > 0)
        terminal_log(t, "%zu value%s below zero raised to zero, means of groups kept; --linear leaves them",
                     all, all == 1 ? " was" : "s were");
}
