/* Solves a batch of skies in one pass: sky k has radiance k + 1 in every tile, and nothing else emits.
 * Build: cc apply_skies.c $(pkg-config --cflags --libs lambert) -o apply_skies     Use: apply_skies STORE.h5
 */
#include <lambert/lambert.h>
#include <stdio.h>
#include <stdlib.h>

enum { SKIES = 4 };

int main(int argc, char **argv) {
    lam_error error = {.message = "usage: apply_skies STORE.h5, of a store with a sky"};
    lam_operator *op = NULL;
    lam_sky *sky = NULL;
    float *L = NULL, *H0 = NULL, *E = NULL, *B = NULL;
    void *work = NULL;
    int result = EXIT_FAILURE;

    if (argc != 2 || lam_operator_open(argv[1], &op, &error) != LAM_OK) goto done;
    if (lam_sky_open(argv[1], &sky, &error) != LAM_OK || sky == NULL) goto done;
    const size_t n = lam_operator_elements(op), C = lam_operator_channels(op), m = lam_sky_tiles(sky);
    const size_t work_bytes = lam_operator_work_bytes(op, SKIES);
    L = malloc(SKIES * C * m * sizeof *L);   /* [SKIES][C][m], W/(m^2 sr) */
    H0 = malloc(SKIES * C * n * sizeof *H0); /* [SKIES][C][n], direct irradiance from the tiles */
    E = calloc(SKIES * C * n, sizeof *E);
    B = malloc(SKIES * C * n * sizeof *B);
    work = malloc(work_bytes);
    if (L == NULL || H0 == NULL || E == NULL || B == NULL || work == NULL) goto done;
    for (size_t t = 0; t < SKIES * C * m; t++) L[t] = 1 + (float)(t / (C * m));
    lam_sky_irradiance(sky, SKIES * C, L, H0);
    if (lam_operator_apply_lit(op, SKIES, LAM_RADIOSITY, E, H0, B, work, work_bytes, &error) != LAM_OK)
        goto done;
    for (size_t i = 0; i < n; i++) /* the first channel of each sky */
        for (size_t k = 0; k < SKIES; k++)
            printf("%.9g%c", (double)B[k * C * n + i], k + 1 < SKIES ? ' ' : '\n');
    result = EXIT_SUCCESS;
done:
    if (result != EXIT_SUCCESS) fprintf(stderr, "%s\n", error.message);
    free(L);
    free(H0);
    free(E);
    free(B);
    free(work);
    lam_sky_close(sky);
    lam_operator_close(op);
    return result;
}
