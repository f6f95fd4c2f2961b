#include "solver/luminaire/polar_curves.h"

#include "solver/base/utf8.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Pixels of the picture, of the largest circle, and of its centre. */
enum { SIDE = 560, RADIUS = 220, CENTRE_X = SIDE / 2, CENTRE_Y = 300, RINGS = 4 };

/* Angles in a list of its own. */
typedef struct angle_list {
    double *values;
    size_t n;
} angle_list;

static lam_status list_steps(double step, double last, angle_list *out, lam_error *error) {
    out->n = (size_t)lround(last / step) + 1;
    out->values = memory_allocate(out->n, sizeof *out->values, "angles", error);
    for (size_t k = 0; out->values != NULL && k < out->n; k++) out->values[k] = (double)k * step;
    return out->values != NULL ? LAM_OK : LAM_ERR_MEMORY;
}

/* The angles of a table of type C; every `step` degrees of other types. */
static lam_status list_gammas(const luminaire *l, double step, angle_list *out, lam_error *error) {
    if (l->type != LUMINAIRE_C) return list_steps(step, 180, out, error);
    out->n = l->n_angles;
    out->values = memory_allocate(out->n, sizeof *out->values, "angles", error);
    if (out->values == NULL) return LAM_ERR_MEMORY;
    memcpy(out->values, l->angles, out->n * sizeof *out->values);
    return LAM_OK;
}

static int compare(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

/* The planes of the table and their mirrors, from 0 to below 360 degrees. */
static lam_status list_planes(const luminaire *l, angle_list *out, lam_error *error) {
    if (l->type != LUMINAIRE_C) return list_steps(15, 345, out, error);
    const bool across = l->symmetry == SYMMETRY_C0_C180 || l->symmetry == SYMMETRY_QUADRANT,
               along = l->symmetry == SYMMETRY_C90_C270 || l->symmetry == SYMMETRY_QUADRANT;
    size_t n = 0, kept = 0;
    out->values = memory_allocate(4 * l->n_planes, sizeof *out->values, "planes", error);
    if (out->values == NULL) return LAM_ERR_MEMORY;
    for (size_t p = 0; p < l->n_planes; p++) {
        const double C = l->planes[p];
        out->values[n++] = C;
        if (across) out->values[n++] = -C;
        if (along) out->values[n++] = 180 - C;
        if (across && along) out->values[n++] = 180 + C;
    }
    for (size_t k = 0; k < n; k++) out->values[k] = fmod(out->values[k] + 720, 360);
    qsort(out->values, n, sizeof *out->values, compare);
    for (size_t k = 0; k < n; k++)
        if (kept == 0 || out->values[k] - out->values[kept - 1] > 1e-9) out->values[kept++] = out->values[k];
    out->n = kept;
    return LAM_OK;
}

lam_status polar_curves_csv(const luminaire *l, FILE *stream, lam_error *error) {
    lam_status status = LAM_OK;
    angle_list gammas = {0}, planes = {0};
    TRY(list_gammas(l, 2.5, &gammas, error));
    TRY(list_planes(l, &planes, error));
    fputs("gamma [degrees]", stream);
    for (size_t p = 0; p < planes.n; p++) fprintf(stream, ",C%.10g [cd]", planes.values[p]);
    fputc('\n', stream);
    for (size_t a = 0; a < gammas.n; a++) {
        fprintf(stream, "%.10g", gammas.values[a]);
        for (size_t p = 0; p < planes.n; p++)
            fprintf(stream, ",%.7g", luminaire_candela(l, planes.values[p], gammas.values[a]));
        fputc('\n', stream);
    }
done:
    free(gammas.values);
    free(planes.values);
    return status;
}

/* A text of an SVG: bytes and characters that XML does not allow become '?'. */
static void write_escaped(const char *text, FILE *stream) {
    const char *end = text + strlen(text);
    for (size_t length; text < end; text += length) {
        const char *name = *text == '&' ? "&amp;" : *text == '<' ? "&lt;" : *text == '>' ? "&gt;" : NULL;
        const size_t valid = utf8_sequence(text, end);
        length = valid > 0 ? valid : 1;
        const bool is_none = valid == 3 && memcmp(text, "\xef\xbf", 2) == 0 && (unsigned char)text[2] >= 0xBE;
        if (name != NULL)
            fputs(name, stream);
        else if (valid == 0 || is_none || (unsigned char)*text < 0x20 || *text == 0x7F)
            fputc('?', stream);
        else
            fwrite(text, 1, length, stream);
    }
}

/* The least of 1, 1.5, 2, 3, 4, 5, 6 and 8 times a power of 10 that is not below a value. */
static double round_up(double value) {
    static const double steps[] = {1, 1.5, 2, 3, 4, 5, 6, 8, 10};
    if (!(value > 0)) return 1;
    const double power = pow(10, floor(log10(value)));
    for (size_t k = 0; k < sizeof steps / sizeof *steps; k++)
        if (value <= steps[k] * power * (1 + 1e-12)) return steps[k] * power;
    return 10 * power;
}

/* The place of an intensity: to the right of the axis for side 1, to the left for -1. */
static void write_place(double share, double gamma, int side, FILE *stream) {
    const double angle = gamma * (M_PI / 180);
    fprintf(stream, "%.2f,%.2f ", CENTRE_X + side * share * RADIUS * sin(angle),
            CENTRE_Y + share * RADIUS * cos(angle));
}

/* The largest intensity of the curves C0-C180 and C90-C270. */
static double most_of_curves(const luminaire *l, const angle_list *gammas) {
    double most = 0;
    for (int C = 0; C < 360; C += 90)
        for (size_t k = 0; k < gammas->n; k++) most = fmax(most, luminaire_candela(l, C, gammas->values[k]));
    return most;
}

/* One curve: the plane to the left, from its last gamma, then the plane to the right. */
static void write_curve(const luminaire *l, const angle_list *gammas, double most, double right,
                        const char *style, FILE *stream) {
    fprintf(stream, "<polyline fill=\"none\" stroke-width=\"2\" %s points=\"", style);
    for (int side = -1; side <= 1; side += 2)
        for (size_t k = 0; k < gammas->n; k++) {
            const double gamma = gammas->values[side < 0 ? gammas->n - 1 - k : k];
            const double I = luminaire_candela(l, side < 0 ? right + 180 : right, gamma);
            write_place(I / most, gamma, side, stream);
        }
    fputs("\"/>\n", stream);
}

/* labels: 1 or -1, the side of the centre, below or above, where the circles have their intensities. */
static void write_grid(double most, int labels, FILE *stream) {
    fputs("<g fill=\"none\" stroke=\"#bbb\">\n", stream);
    for (int k = 1; k <= RINGS; k++)
        fprintf(stream, "<circle cx=\"%d\" cy=\"%d\" r=\"%d\"/>\n", CENTRE_X, CENTRE_Y, RADIUS * k / RINGS);
    for (int gamma = 0; gamma < 360; gamma += 30) {
        fprintf(stream, "<polyline points=\"%d,%d ", CENTRE_X, CENTRE_Y);
        write_place(1, gamma, 1, stream);
        fputs("\"/>\n", stream);
    }
    fputs("</g>\n<g fill=\"#555\" font-size=\"11\" text-anchor=\"middle\">\n", stream);
    for (int k = 1; k <= RINGS; k++)
        fprintf(stream, "<text x=\"%d\" y=\"%d\">%.4g</text>\n", CENTRE_X,
                CENTRE_Y + labels * RADIUS * k / RINGS - 3, most * k / RINGS);
    for (int gamma = 30; gamma <= 150; gamma += 30)
        for (int side = -1; side <= 1; side += 2) {
            const double angle = gamma * (M_PI / 180), r = RADIUS + 18;
            fprintf(stream, "<text x=\"%.1f\" y=\"%.1f\">%d°</text>\n", CENTRE_X + side * r * sin(angle),
                    CENTRE_Y + r * cos(angle) + 4, gamma);
        }
    fputs("</g>\n", stream);
}

lam_status polar_curves_svg(const luminaire *l, const char *title, FILE *stream, lam_error *error) {
    lam_status status = LAM_OK;
    static const char *const styles[2] = {"stroke=\"#c03020\"",
                                          "stroke=\"#2050b0\" stroke-dasharray=\"7 4\""};
    static const char *const names[2] = {"C0-C180", "C90-C270"};
    angle_list gammas = {0};
    double C = 0, gamma = 0;
    const int n_curves = l->symmetry == SYMMETRY_ROTATIONAL ? 1 : 2;
    TRY(list_gammas(l, 1, &gammas, error));
    const double most = round_up(most_of_curves(l, &gammas));
    fprintf(
        stream,
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%d\" "
        "height=\"%d\" viewBox=\"0 0 %d %d\" font-family=\"sans-serif\">\n"
        "<rect width=\"100%%\" height=\"100%%\" fill=\"#fff\"/>\n",
        SIDE, SIDE, SIDE, SIDE);
    fprintf(stream, "<text x=\"%d\" y=\"28\" font-size=\"16\" text-anchor=\"middle\">", CENTRE_X);
    write_escaped(title, stream);
    fputs("</text>\n", stream);
    write_grid(most, luminaire_candela(l, 0, 180) > luminaire_candela(l, 0, 0) ? 1 : -1, stream);
    for (int k = 0; k < n_curves; k++) {
        write_curve(l, &gammas, most, 90 * k, styles[k], stream);
        fprintf(stream,
                "<polyline fill=\"none\" stroke-width=\"2\" %s points=\"%d,%d %d,%d\"/>"
                "<text x=\"%d\" y=\"%d\" font-size=\"12\">%s</text>\n",
                styles[k], 20 + 130 * k, SIDE - 16, 50 + 130 * k, SIDE - 16, 56 + 130 * k, SIDE - 12,
                n_curves == 1 ? "all planes" : names[k]);
    }
    fprintf(
        stream,
        "<text x=\"%d\" y=\"%d\" font-size=\"12\" text-anchor=\"end\">cd; %.5g lm, at most %.5g cd</text>\n"
        "</svg>\n",
        SIDE - 16, SIDE - 12, luminaire_lumens(l), luminaire_peak(l, &C, &gamma));
done:
    free(gammas.values);
    return status;
}
