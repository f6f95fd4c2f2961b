/* The items of --annual, and of --occupied. */
#include "solver/light/annual.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Reads sun=X or sun=X,H. */
static lam_status read_sun(const char *item, annual_figure *out, lam_error *error) {
    lam_status status = LAM_OK;
    annual_figure f = {.is_sun = true, .most = -1};
    const char *const text = item + strlen("sun=");
    if (strchr(text, ',') == NULL) {
        TRY(option_number("--annual sun:", text, &f.low, error));
        snprintf(f.name, sizeof f.name, "sun_%g", f.low);
    } else {
        double given[2];
        TRY(option_numbers("--annual sun:", text, 2, true, given, NULL, error));
        f.low = given[0];
        f.most = given[1];
        snprintf(f.name, sizeof f.name, "sun_%g_%g", f.low, f.most);
        if (f.most < 0) FAIL(error, LAM_ERR_ARGUMENT, "--annual %s: hours must be at least 0", item);
    }
    if (f.low < 0)
        FAIL(error, LAM_ERR_ARGUMENT, "--annual %s: must be at least 0, in the unit of the answer", item);
    *out = f;
done:
    return status;
}

lam_status annual_add(annual_options *w, const char *item, lam_error *error) {
    lam_status status = LAM_OK;
    annual_figure f = {.high = INFINITY};
    if (strcmp(item, "sum") == 0) {
        f.is_sum = true;
        snprintf(f.name, sizeof f.name, "sum");
    } else if (strncmp(item, "autonomy=", 9) == 0) {
        TRY(option_number("--annual autonomy:", item + 9, &f.low, error));
        /* At 0 every dark hour would count as autonomous. */
        if (f.low <= 0)
            FAIL(error, LAM_ERR_ARGUMENT, "--annual %s: must be above 0, in the unit of the answer", item);
        snprintf(f.name, sizeof f.name, "autonomy_%g", f.low);
    } else if (strncmp(item, "daylit=", 7) == 0) {
        TRY(option_number("--annual daylit:", item + 7, &f.low, error));
        if (f.low <= 0)
            FAIL(error, LAM_ERR_ARGUMENT, "--annual %s: must be above 0, in the unit of the answer", item);
        f.of_daylight = true;
        snprintf(f.name, sizeof f.name, "daylit_%g", f.low);
    } else if (strncmp(item, "useful=", 7) == 0) {
        double bounds[2];
        TRY(option_numbers("--annual useful:", item + 7, 2, true, bounds, NULL, error));
        f.low = bounds[0];
        f.high = bounds[1];
        if (!(f.low >= 0 && f.low < f.high))
            FAIL(error, LAM_ERR_ARGUMENT, "--annual %s: must be LOW,HIGH with 0 <= LOW < HIGH", item);
        snprintf(f.name, sizeof f.name, "useful_%g_%g", f.low, f.high);
    } else if (strncmp(item, "sun=", 4) == 0) {
        TRY(read_sun(item, &f, error));
    } else {
        FAIL(error, LAM_ERR_ARGUMENT,
             "--annual %s: must be sum, autonomy=X, useful=LOW,HIGH, daylit=X, sun=X or sun=X,HOURS", item);
    }
    for (size_t k = 0; k < w->n_figures; k++)
        if (strcmp(w->figures[k].name, f.name) == 0)
            FAIL(error, LAM_ERR_ARGUMENT, "--annual %s: asked for twice", item);
    if (w->n_figures == ANNUAL_MOST)
        FAIL(error, LAM_ERR_ARGUMENT, "--annual %s: more than %d figures", item, ANNUAL_MOST);
    w->figures[w->n_figures++] = f;
done:
    return status;
}

lam_status annual_parse_occupied(const char *text, annual_options *w, lam_error *error) {
    lam_status status = LAM_OK;
    unsigned from = 0, to = 0;
    int length = 0;
    if (strspn(text, "0123456789-") != strlen(text) || sscanf(text, "%2u-%2u%n", &from, &to, &length) != 2 ||
        text[length] != '\0' || from >= to || to > 24)
        FAIL(error, LAM_ERR_ARGUMENT,
             "--occupied %s: must be FROM-TO, whole hours of the day with 0 <= FROM < TO <= 24", text);
    w->from = from;
    w->to = to;
done:
    return status;
}
