#include "solver/bench/plot.h"

#include <cairo-svg.h>
#include <cairo.h>

#include <math.h>
#include <string.h>

/* The sheet in points, and the room around the axes. */
static const double width = 960, height = 600;
static const double left = 88, right = 24, top = 56, bottom = 68, legend_gap = 18;
static const double text_size = 15, title_size = 18;

/* Colours that people who confuse red and green tell apart (Okabe and Ito 2008), black first. */
static const double colours[][3] = {{0, 0, 0},      {.90, .60, 0}, {.34, .71, .91}, {0, .62, .45},
                                    {0, .45, .70},  {.84, .37, 0}, {.80, .47, .65}, {.45, .45, .45},
                                    {.55, .35, .1}, {.6, .7, 0},   {.4, .2, .6},    {.9, .2, .3}};

/* One axis: values from low to high lie between two places of the sheet; powers: their logarithms do. */
typedef struct axis {
    bool powers;
    double low, high, from, to;
} axis;

static double place(const axis *a, double value) {
    const double v = a->powers ? log10(value) : value;
    return a->from + (v - a->low) / (a->high - a->low) * (a->to - a->from);
}

static bool can_show(const axis *a, double value) {
    return isfinite(value) && (!a->powers || value > 0);
}

static void widen(axis *a, double value) {
    if (!can_show(a, value)) return;
    const double v = a->powers ? log10(value) : value;
    a->low = fmin(a->low, v);
    a->high = fmax(a->high, v);
}

/* The step of a linear axis: 1, 2 or 5 times a power of ten, at most eight of them. */
static double linear_step(const axis *a) {
    const double raw = (a->high - a->low) / 8, power = pow(10, floor(log10(raw)));
    return raw <= power ? power : raw <= 2 * power ? 2 * power : raw <= 5 * power ? 5 * power : 10 * power;
}

/* Rounds the ends outwards, so that ticks stand on them. */
static void settle(axis *a) {
    if (a->powers) {
        /* to a third of a decade: 1, 2, 5 */
        a->low = floor(3 * a->low - .1) / 3;
        a->high = ceil(3 * a->high + .1) / 3;
        if (a->high - a->low < 1) {
            a->low = floor(a->low);
            a->high = ceil(a->high + 1e-9);
        }
        return;
    }
    a->low = fmin(a->low, 0);
    if (a->high <= a->low) a->high = a->low + 1;
    a->high = ceil(a->high / linear_step(a)) * linear_step(a);
}

static bool shows(const axis *x, const axis *y, const plot_series *s, size_t i) {
    return can_show(x, s->x[i]) && can_show(y, s->y[i]);
}

static lam_status find_axes(const plot *p, axis *x, axis *y, lam_error *error) {
    *x = (axis){.powers = p->x_log, .low = INFINITY, .high = -INFINITY};
    *y = (axis){.powers = p->y_log, .low = INFINITY, .high = -INFINITY};
    if (p->n_series > PLOT_SERIES_MOST)
        return status_fail(error, LAM_ERR_ARGUMENT, "plot %s: %zu series, at most %d", p->name, p->n_series,
                           PLOT_SERIES_MOST);
    for (size_t k = 0; k < p->n_series; k++)
        for (size_t i = 0; i < p->series[k].n; i++) {
            const plot_series *s = &p->series[k];
            if (!shows(x, y, s, i)) continue;
            widen(x, s->x[i]);
            widen(y, s->y[i]);
            if (s->low != NULL) widen(y, s->low[i]);
            if (s->high != NULL) widen(y, s->high[i]);
        }
    if (!(x->low <= x->high && y->low <= y->high))
        return status_fail(error, LAM_ERR_ARGUMENT, "plot %s: there is no point to draw", p->name);
    settle(x);
    settle(y);
    return LAM_OK;
}

/* --- text ------------------------------------------------------------------------------------------------
 */

static double text_width(cairo_t *c, const char *text) {
    cairo_text_extents_t extents;
    cairo_text_extents(c, text, &extents);
    return extents.x_advance;
}

/* Text whose baseline ends (align 1), has its middle (.5) or begins (0) at x. */
static void put_text(cairo_t *c, double x, double y, double align, const char *text) {
    cairo_move_to(c, x - align * text_width(c, text), y);
    cairo_show_text(c, text);
}

/* Whether numbers of an axis are written as powers of ten, because some would be long otherwise. */
static bool raises(const axis *a) {
    return a->powers && (a->low < -3.1 || a->high > 4.1);
}

/* A number on an axis, as a power of ten (but 1) or plainly. */
static void put_tick(cairo_t *c, double x, double y, double align, bool raised, double value) {
    char text[32], exponent[16] = "";
    const double power = value > 0 ? log10(value) : 0;
    const double whole = floor(power + 1e-9), digit = round(value / pow(10, whole));
    if (raised) {
        if (digit > 1)
            snprintf(text, sizeof text, "%.0f·10", digit);
        else
            snprintf(text, sizeof text, "10");
        snprintf(exponent, sizeof exponent, "%s%.0f", whole < 0 ? "−" : "", fabs(whole));
    } else {
        snprintf(text, sizeof text, "%.6g", value);
    }
    const double main_width = text_width(c, text);
    cairo_set_font_size(c, .75 * text_size);
    const double all = main_width + (raised ? text_width(c, exponent) : 0);
    cairo_set_font_size(c, text_size);
    put_text(c, x - align * all, y, 0, text);
    if (!raised) return;
    cairo_set_font_size(c, .75 * text_size);
    put_text(c, x - align * all + main_width, y - .4 * text_size, 0, exponent);
    cairo_set_font_size(c, text_size);
}

/* --- axes ------------------------------------------------------------------------------------------------
 */

/* A grid line with or without its number. */
static void put_grid(cairo_t *c, const axis *across, const axis *along, double value, bool strong,
                     bool numbered) {
    const bool vertical = across->from < across->to; /* y runs upwards, against the sheet */
    const double at = place(across, value);
    cairo_set_source_rgb(c, strong ? .80 : .92, strong ? .80 : .92, strong ? .80 : .92);
    cairo_set_line_width(c, 1);
    cairo_move_to(c, vertical ? at : along->from, vertical ? along->from : at);
    cairo_line_to(c, vertical ? at : along->to, vertical ? along->to : at);
    cairo_stroke(c);
    if (!numbered) return;
    cairo_set_source_rgb(c, 0, 0, 0);
    if (vertical)
        put_tick(c, at, along->from + 1.5 * text_size, .5, raises(across) && value != 1, value);
    else
        put_tick(c, along->from - 8, at + .35 * text_size, 1, raises(across) && value != 1, value);
}

static void put_axis(cairo_t *c, const axis *across, const axis *along) {
    const double slack = 1e-9 * (across->high - across->low);
    if (!across->powers) {
        const double step = linear_step(across);
        for (double v = ceil(across->low / step) * step; v <= across->high + slack; v += step)
            put_grid(c, across, along, fabs(v) < slack ? 0 : v, true, true);
        return;
    }
    /* Over many decades only some are numbered, over few also 2 and 5. */
    const double decades = across->high - across->low;
    const int every = (int)ceil(decades / 10);
    for (int e = (int)floor(across->low); e <= (int)ceil(across->high); e++)
        for (int digit = 1; digit < 10; digit++) {
            const double v = digit * pow(10, e);
            if (log10(v) < across->low - slack || log10(v) > across->high + slack) continue;
            const bool numbered = digit == 1 ? e % every == 0 : decades <= 2.5 && (digit == 2 || digit == 5);
            if (digit == 1 || decades <= 6) put_grid(c, across, along, v, digit == 1, numbered);
        }
}

static void put_frame(cairo_t *c, const plot *p, const axis *x, const axis *y) {
    put_axis(c, x, y);
    put_axis(c, y, x);
    cairo_set_source_rgb(c, 0, 0, 0);
    cairo_set_line_width(c, 1.2);
    cairo_rectangle(c, x->from, y->to, x->to - x->from, y->from - y->to);
    cairo_stroke(c);
    put_text(c, (x->from + x->to) / 2, height - .9 * text_size, .5, p->x_label);
    cairo_save(c);
    cairo_translate(c, 1.5 * text_size, (y->from + y->to) / 2);
    cairo_rotate(c, -M_PI / 2);
    put_text(c, 0, 0, .5, p->y_label);
    cairo_restore(c);
    cairo_set_font_size(c, title_size);
    put_text(c, x->from, .6 * top, 0, p->title);
    cairo_set_font_size(c, text_size);
}

/* --- series ----------------------------------------------------------------------------------------------
 */

/* A line without marks is no measurement: grey dashes. */
static void set_colour(cairo_t *c, const plot *p, size_t k) {
    static const double dashes[] = {7, 5}, grey[3] = {.35, .35, .35};
    const bool measured = !p->series[k].unmarked;
    const double *rgb = measured ? colours[k % (sizeof colours / sizeof colours[0])] : grey;
    cairo_set_dash(c, dashes, measured ? 0 : 2, 0);
    cairo_set_source_rgb(c, rgb[0], rgb[1], rgb[2]);
}

static bool is_marked(const plot_series *s) {
    return !s->unmarked && !s->plain;
}

/* A mark of its own for every series: disc, square, triangles, diamond. */
static void put_mark(cairo_t *c, size_t k, double x, double y) {
    const double r = 4.5;
    cairo_new_path(c);
    switch (k % 5) {
    case 0:
        cairo_arc(c, x, y, r, 0, 2 * M_PI);
        break;
    case 1:
        cairo_rectangle(c, x - .9 * r, y - .9 * r, 1.8 * r, 1.8 * r);
        break;
    case 2:
    case 3: {
        const double up = k % 5 == 2 ? -1.2 * r : 1.2 * r;
        cairo_move_to(c, x, y + up);
        cairo_line_to(c, x + 1.1 * r, y - .7 * up);
        cairo_line_to(c, x - 1.1 * r, y - .7 * up);
        cairo_close_path(c);
        break;
    }
    default:
        cairo_move_to(c, x, y - 1.3 * r);
        cairo_line_to(c, x + 1.3 * r, y);
        cairo_line_to(c, x, y + 1.3 * r);
        cairo_line_to(c, x - 1.3 * r, y);
        cairo_close_path(c);
    }
    cairo_fill(c);
}

static void put_series(cairo_t *c, const plot *p, size_t k, const axis *x, const axis *y) {
    const plot_series *s = &p->series[k];
    set_colour(c, p, k);
    cairo_set_line_width(c, 2);
    cairo_new_path(c);
    for (size_t i = 0; i < s->n && s->joined; i++)
        if (shows(x, y, s, i)) cairo_line_to(c, place(x, s->x[i]), place(y, s->y[i]));
    cairo_stroke(c);
    for (size_t i = 0; i < s->n; i++) {
        if (!shows(x, y, s, i)) continue;
        const double px = place(x, s->x[i]), py = place(y, s->y[i]);
        if (s->low != NULL && s->high != NULL && can_show(y, s->low[i]) && can_show(y, s->high[i])) {
            const double ends[2] = {place(y, s->low[i]), place(y, s->high[i])};
            cairo_set_line_width(c, 1.2);
            cairo_move_to(c, px, ends[0]);
            cairo_line_to(c, px, ends[1]);
            for (int e = 0; e < 2; e++) {
                cairo_move_to(c, px - 4, ends[e]);
                cairo_line_to(c, px + 4, ends[e]);
            }
            cairo_stroke(c);
        }
        if (is_marked(s)) put_mark(c, k, px, py);
    }
}

/* A rectangle of the sheet: a mark or a name that nothing may be written over. */
typedef struct area {
    double x, y, width, height; /* of its middle */
} area;

static bool meet(const area *a, const area *b) {
    return 2 * fabs(a->x - b->x) < a->width + b->width && 2 * fabs(a->y - b->y) < a->height + b->height;
}

/* Right of the first point, or left, below or above it: where the sheet is free first. taken holds *n areas
 * and has room for one more. */
static void put_name(cairo_t *c, const plot_series *s, const axis *x, const axis *y, area *taken, size_t *n) {
    const double w = text_width(c, s->label), px = place(x, s->x[0]), py = place(y, s->y[0]);
    const double side = .5 * w + .7 * text_size, up = 1.1 * text_size;
    const double shift[4][2] = {{side, 0}, {-side, 0}, {0, up}, {0, -up}};
    area best = {.width = w, .height = text_size};
    for (size_t k = 0; k < 4; k++) {
        best.x = px + shift[k][0];
        best.y = py + shift[k][1];
        bool free_there = best.x - .5 * w > x->from && best.x + .5 * w < x->to;
        for (size_t t = 0; t < *n; t++) free_there = free_there && !meet(&best, &taken[t]);
        if (free_there) break;
    }
    cairo_set_source_rgb(c, 0, 0, 0);
    put_text(c, best.x, best.y + .35 * text_size, .5, s->label);
    taken[(*n)++] = best;
}

static void put_names(cairo_t *c, const plot *p, const axis *x, const axis *y) {
    area taken[2 * PLOT_SERIES_MOST];
    size_t n = 0, named[PLOT_SERIES_MOST], n_named = 0;
    for (size_t k = 0; k < p->n_series; k++) {
        const plot_series *s = &p->series[k];
        if (!s->named || s->n == 0 || !shows(x, y, s, 0)) continue;
        taken[n++] = (area){place(x, s->x[0]), place(y, s->y[0]), 9, 9};
        named[n_named++] = k;
    }
    for (size_t k = 0; k < n_named; k++) put_name(c, &p->series[named[k]], x, y, taken, &n);
}

static double legend_width(cairo_t *c, const plot *p) {
    double widest = 0;
    for (size_t k = 0; k < p->n_series; k++) widest = fmax(widest, text_width(c, p->series[k].label));
    return widest + 3 * text_size;
}

static void put_legend(cairo_t *c, const plot *p, double x, double y) {
    for (size_t k = 0; k < p->n_series; k++) {
        const double middle = y + (1.6 * (double)k + .5) * text_size;
        set_colour(c, p, k);
        if (p->series[k].joined) {
            cairo_set_line_width(c, 2);
            cairo_move_to(c, x, middle);
            cairo_line_to(c, x + 2 * text_size, middle);
            cairo_stroke(c);
        }
        if (is_marked(&p->series[k])) put_mark(c, k, x + text_size, middle);
        cairo_set_dash(c, NULL, 0, 0);
        cairo_set_source_rgb(c, 0, 0, 0);
        put_text(c, x + 2.6 * text_size, middle + .35 * text_size, 0, p->series[k].label);
    }
}

static lam_status draw(const plot *p, cairo_surface_t *surface, lam_error *error) {
    lam_status status = LAM_OK;
    axis x, y;
    cairo_t *c = cairo_create(surface);
    TRY(find_axes(p, &x, &y, error));
    cairo_set_source_rgb(c, 1, 1, 1);
    cairo_paint(c);
    cairo_select_font_face(c, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(c, text_size);
    const double legend = legend_width(c, p);
    x.from = left;
    x.to = width - right - legend_gap - legend;
    y.from = height - bottom;
    y.to = top;
    put_frame(c, p, &x, &y);
    cairo_save(c);
    cairo_rectangle(c, x.from - 6, y.to - 6, x.to - x.from + 12, y.from - y.to + 12);
    cairo_clip(c);
    for (size_t k = 0; k < p->n_series; k++) put_series(c, p, k, &x, &y);
    put_names(c, p, &x, &y);
    cairo_restore(c);
    put_legend(c, p, x.to + legend_gap, top);
    const cairo_status_t drawn = cairo_status(c);
    if (drawn != CAIRO_STATUS_SUCCESS)
        FAIL(error, LAM_ERR_MEMORY, "plot %s: cairo: %s", p->name, cairo_status_to_string(drawn));
done:
    cairo_destroy(c);
    return status;
}

static cairo_status_t write_bytes(void *stream, const unsigned char *bytes, unsigned length) {
    return fwrite(bytes, 1, length, stream) == length ? CAIRO_STATUS_SUCCESS : CAIRO_STATUS_WRITE_ERROR;
}

/* A failed write is told by the stream itself, which knows the reason. */
static lam_status surface_status(const plot *p, cairo_status_t s, lam_error *error) {
    if (s == CAIRO_STATUS_SUCCESS || s == CAIRO_STATUS_WRITE_ERROR) return LAM_OK;
    return status_fail(error, LAM_ERR_MEMORY, "plot %s: cairo: %s", p->name, cairo_status_to_string(s));
}

lam_status plot_svg(const plot *p, FILE *stream, lam_error *error) {
    lam_status status = LAM_OK;
    cairo_surface_t *surface = cairo_svg_surface_create_for_stream(write_bytes, stream, width, height);
    TRY(surface_status(p, cairo_surface_status(surface), error));
    TRY(draw(p, surface, error));
    cairo_surface_finish(surface);
    TRY(surface_status(p, cairo_surface_status(surface), error));
done:
    cairo_surface_destroy(surface);
    return status;
}

lam_status plot_png(const plot *p, FILE *stream, lam_error *error) {
    lam_status status = LAM_OK;
    cairo_surface_t *surface = cairo_image_surface_create(CAIRO_FORMAT_RGB24, (int)width, (int)height);
    TRY(surface_status(p, cairo_surface_status(surface), error));
    TRY(draw(p, surface, error));
    TRY(surface_status(p, cairo_surface_write_to_png_stream(surface, write_bytes, stream), error));
done:
    cairo_surface_destroy(surface);
    return status;
}
