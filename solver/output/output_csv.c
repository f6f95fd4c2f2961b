/* A solution as a table: one line an element, or one a figure. Texts are quoted as RFC 4180 says. */
#include "solver/base/csv_text.h"
#include "solver/output/output.h"

#include <math.h>
#include <string.h>

void output_csv_header(const solution *s, const char *first, FILE *stream) {
    char name[OUTPUT_COLUMN];
    fputs(first, stream);
    for (size_t v = 0; v < s->n_vectors; v++)
        for (size_t c = 0; c < s->m->n_channels; c++) {
            const char *unit = output_unit(s, v);
            output_column(s, v, c, name);
            fprintf(stream, unit[0] != '\0' ? ",%s [%s]" : ",%s", name, unit);
        }
    fputs("\n", stream);
}

static void elements(const solution *s, FILE *stream) {
    const mesh *m = s->m;
    output_csv_header(s, "element,group,area", stream);
    for (size_t i = 0; i < m->n; i++) {
        fprintf(stream, "%zu,", i);
        csv_text(m->group_names[m->group[i]], stream);
        fprintf(stream, ",%.9g", m->area[i]);
        for (size_t k = 0; k < s->n_vectors * m->n_channels; k++)
            fprintf(stream, ",%.*g", output_digits(s), output_value(s, k * m->n + i));
        fputs("\n", stream);
    }
}

/* A value that is missing, of a face without an element, is empty. */
static void faces(const solution *s, FILE *stream) {
    const size_t n = output_width(s);
    output_csv_header(s, "face,group,area", stream);
    for (size_t f = 0; f < n; f++) {
        double area;
        const char *group = output_face_group(s, f, &area);
        fprintf(stream, "%zu,", f);
        if (group != NULL) csv_text(group, stream);
        fprintf(stream, ",%.9g", area);
        for (size_t k = 0; k < s->n_vectors * s->m->n_channels; k++) {
            const double value = output_value(s, k * n + f);
            if (isnan(value))
                fputc(',', stream);
            else
                fprintf(stream, ",%.*g", output_digits(s), value);
        }
        fputs("\n", stream);
    }
}

static void figures(const solution *s, FILE *stream) {
    const mesh *m = s->m;
    output_csv_header(s, "group,statistic", stream);
    for (size_t r = 0; r < s->n_reductions; r++) {
        const reduction *of = &s->reductions[r];
        for (size_t k = 0; k < of->request.n_with; k++) {
            csv_text(of->group, stream);
            fprintf(stream, ",%s", reduce_statistic_name(of->request.with[k]));
            for (size_t column = 0; column < s->n_vectors * m->n_channels; column++) {
                const double value = output_figure(s, of, k, column);
                if (isfinite(value))
                    fprintf(stream, ",%.*g", output_digits(s), value);
                else
                    fputc(',', stream);
            }
            fputs("\n", stream);
        }
    }
}

lam_status output_csv(const solution *s, FILE *stream, lam_error *error) {
    (void)error;
    if (s->n_reductions > 0)
        figures(s, stream);
    else if (s->faces != NULL)
        faces(s, stream);
    else
        elements(s, stream);
    return LAM_OK;
}
