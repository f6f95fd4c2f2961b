/* lambert verify: checks a store and prints one line for each check. */
#include "solver/base/photometry.h"
#include "solver/scene/mesh_options.h"
#include "solver/verbs/json_print.h"
#include "solver/verbs/verbs.h"
#include "solver/verify/verify.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct fields {
    uint64_t probes, walks;
    const char *assets;
    bool json;
} fields;

#define FIELD(member) offsetof(fields, member)
static const option_row rows[] = {
    {.name = "probes",
     .kind = OPTION_COUNT,
     .offset = FIELD(probes),
     .argument = "P",
     .preset = "16",
     .help = "Single elements that the error is measured again with; 0: no measurement",
     .least = 0,
     .most = 1e6},
    {.name = "walks",
     .kind = OPTION_COUNT,
     .offset = FIELD(walks),
     .argument = "N",
     .preset = "0",
     .help =
         "Random walks for each emission and each element, which the answers for groups and some elements "
         "are compared with; 0: no comparison",
     .least = 0,
     .most = 1e9},
    OPTION_ROW_ASSETS(FIELD(assets)),
    {.name = "json", .kind = OPTION_FLAG, .offset = FIELD(json), .help = "Print the checks as JSON"},
    {0},
};

static const option_command verb = {
    .name = "lambert verify",
    .arguments = "STORE [SCENE]",
    .summary = "Check a store: checksums, invariants, its stated error, and whether SCENE has changed since "
               "the store was "
               "made. The exit status is 1 if anything is broken.",
    .least_arguments = 1,
    .most_arguments = 2,
};

static const struct {
    const char *name;
    verify_check *run;
} checks[] = {
    {"checksums", verify_checksums},
    {"mesh", verify_mesh},
    {"form factors", verify_form_factors},
    {"sky", verify_sky},
    {"luminaires", verify_luminaires},
    {"sensors", verify_sensors},
    {"operator", verify_operator},
    {"linearity", verify_linearity},
    {"energy", verify_energy},
    {"error", verify_error},
    {"walks", verify_walks},
    {"scene", verify_scene},
};
#define N_CHECKS (sizeof checks / sizeof checks[0])

static const char *const words[] = {"ok", "BROKEN", "skipped"};

/* That of the irradiances that are compared. */
static const char *compared_unit(const examination *e) {
    const light_conversion plain = {.from = e->m.lights};
    return light_conversion_unit(&plain, false);
}

/* One line for each emission and group or element: the channel with the largest score. */
static void print_compared(const examination *e) {
    for (size_t k = 0; k < e->n_compared; k += e->m.n_channels) {
        const walk_comparison *w = &e->compared[k];
        char at[32];
        for (size_t c = 1; c < e->m.n_channels; c++)
            if (fabs(e->compared[k + c].score) > fabs(w->score)) w = &e->compared[k + c];
        printf("        %+7.1f  operator %-11.6g walks %-11.6g +- %-8.2g %s  %s under %s%s\n", w->score,
               w->answer, w->mean, w->error, compared_unit(e), walk_comparison_target(w, at), w->emission,
               w->dark ? ", dark" : "");
    }
}

static json_t *compared_json(const examination *e) {
    json_t *list = json_array();
    for (size_t k = 0; k < e->n_compared; k++) {
        const walk_comparison *w = &e->compared[k];
        json_t *one = json_pack("{s:s, s:b, s:I, s:f, s:f, s:f, s:f}", "emission", w->emission, "dark",
                                (int)w->dark, "channel", (json_int_t)w->channel, "operator", w->answer,
                                "walks", w->mean, "standard_error", w->error, "z", w->score);
        if (w->group != NULL)
            json_object_set_new(one, "group", json_string(w->group));
        else
            json_object_set_new(one, "element", json_integer((json_int_t)w->element));
        json_array_append_new(list, one);
    }
    return list;
}

static lam_status print_json(const char *path, const check *done, const examination *e, bool broken,
                             lam_error *error) {
    json_t *list = json_array();
    for (size_t i = 0; i < N_CHECKS; i++)
        json_array_append_new(list, json_pack("{s:s, s:s, s:s}", "name", done[i].name, "result",
                                              words[done[i].verdict], "detail", done[i].detail));
    json_t *root = json_pack("{s:s, s:b, s:o}", "store", path, "ok", !broken, "checks", list);
    if (e->has_mesh) json_object_set_new(root, "lights", json_string(light_kind_word(e->m.lights)));
    if (e->n_compared > 0) {
        json_object_set_new(root, "walks", compared_json(e));
        json_object_set_new(root, "unit", json_string(compared_unit(e)));
    }
    const lam_status status = json_print(path, root, 0, error);
    json_decref(root);
    return status;
}

static lam_status verify(const char *path, const fields *f, examination *e, bool *broken, terminal *t,
                         lam_error *error) {
    lam_status status = LAM_OK;
    check done[N_CHECKS] = {0};
    TRY(store_open(path, &e->s, error));
    for (size_t i = 0; i < N_CHECKS; i++) {
        lam_error one = {0};
        done[i].name = checks[i].name;
        status = checks[i].run(e, &done[i], &one);
        terminal_clear(t);
        if (status != LAM_OK) {
            *error = one;
            goto done;
        }
        TRY(terminal_check(error));
        *broken = *broken || done[i].verdict == VERDICT_BROKEN;
        if (!f->json) {
            printf("%-8s%-14s%s\n", words[done[i].verdict], done[i].name, done[i].detail);
            if (checks[i].run == verify_walks) print_compared(e);
            fflush(stdout);
        }
    }
    if (f->json) TRY(print_json(path, done, e, *broken, error));
done:
    return status;
}

int cmd_verify(int argc, char **argv) {
    fields f = {0};
    option_result given = {0};
    lam_error error = {0};
    terminal term;
    bool broken = false;
    const option_table tables[] = {{NULL, rows, &f}, {0}};
    int code = options_parse(&verb, tables, argc, argv, &given);
    if (code != OPTIONS_GO) return code;
    terminal_open(&term, verb.name, false, false);
    term.nothing = "not every check was made";
    const progress how = terminal_progress(&term);
    examination e = {.scene = given.n_arguments > 1 ? given.arguments[1] : NULL,
                     .assets = f.assets,
                     .probes = f.probes,
                     .walks = f.walks,
                     .progress = &how};
    const lam_status status = verify(given.arguments[0], &f, &e, &broken, &term, &error);
    examination_free(&e);
    if (status != LAM_OK) return terminal_fail(&term, &error);
    if (broken) {
        status_fail(&error, LAM_ERR_DAMAGED, "%s: broken, see the checks above", given.arguments[0]);
        return terminal_fail(&term, &error);
    }
    return 0;
}
