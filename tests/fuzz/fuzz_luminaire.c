/* Files of luminaires, and what is asked of those that are read. */
#include "fuzz/fuzz.h"
#include "solver/luminaire/luminaire.h"
#include "solver/luminaire/polar_curves.h"

#include <math.h>

/* Intensities are between 0 and the peak, and a turn changes nothing. */
static void check_intensities(const luminaire *l) {
    double C = 0, gamma = 0;
    const double peak = luminaire_peak(l, &C, &gamma), lumens = luminaire_lumens(l);
    FUZZ_CHECK(peak >= 0 && C >= 0 && C <= 360 && gamma >= 0 && gamma <= 180);
    FUZZ_CHECK(lumens >= -1e-9 * peak && lumens <= 4 * M_PI * peak * (1 + 1e-9));
    for (C = -360; C <= 720; C += 44.9)
        for (gamma = 0; gamma <= 180; gamma += 7.5) {
            const double I = luminaire_candela(l, C, gamma);
            FUZZ_CHECK(I >= 0 && I <= peak * (1 + 1e-9));
        }
}

/* The last byte says which lamp set, and the name's extension. */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    if (size == 0) return 0;
    static const char *const names[] = {"/none/a.ies", "/none/a.ldt", "/none/a"};
    const luminaire_options options = {.set = data[size - 1] / 3 % 4};
    char *text = fuzz_text(data, size - 1), *curves = NULL;
    size_t length = 0;
    luminaire l = {.n_planes = 0};
    lam_error error = {.message = ""};
    if (luminaire_read_text(names[data[size - 1] % 3], text, size - 1, &options, &l, &error) == LAM_OK) {
        FUZZ_CHECK(luminaire_is_sound(&l));
        check_intensities(&l);
        FILE *stream = open_memstream(&curves, &length);
        FUZZ_CHECK(stream != NULL);
        if (l.n_planes * l.n_angles < 2000) {
            FUZZ_CHECK(polar_curves_csv(&l, stream, &error) == LAM_OK);
            FUZZ_CHECK(polar_curves_svg(&l, luminaire_find_word(&l, "luminaire"), stream, &error) == LAM_OK);
        }
        FUZZ_CHECK(fclose(stream) == 0);
        FUZZ_CHECK(length == 0 || (strstr(curves, "nan") == NULL && strstr(curves, "inf") == NULL) ||
                   luminaire_find_word(&l, "luminaire")[0] != '\0');
        free(curves);
    } else {
        FUZZ_CHECK(l.candela == NULL && error.message[0] != '\0' && strchr(error.message, '\n') == NULL);
        FUZZ_CHECK(error.status != LAM_ERR_INTERNAL);
    }
    luminaire_free(&l);
    free(text);
    return 0;
}
