/* Refines an answer in double until its error is certified against the form factors that the store keeps
 * (lambert precompute --keep-form-factors): every element of the first channel emits 1, tolerance 1e-9.
 * Build: cc refine_one.c $(pkg-config --cflags --libs lambert) -o refine_one     Use: refine_one STORE.h5 */
#include <lambert/lambert.h>
#include <stdio.h>
#include <stdlib.h>

int main(int argc, char **argv) {
    lam_error error = {.message = "usage: refine_one STORE.h5, of a store with form factors"};
    lam_operator *op = NULL;
    lam_form_factors *F = NULL;
    lam_refiner *refiner = NULL;
    double *E = NULL, *B = NULL, certificate;
    size_t iterations;
    int result = EXIT_FAILURE;

    if (argc != 2 || lam_operator_open(argv[1], &op, &error) != LAM_OK) goto done;
    if (lam_form_factors_open(argv[1], &F, &error) != LAM_OK || F == NULL) goto done;
    if (lam_refiner_create(op, F, &refiner, &error) != LAM_OK) goto done;
    const size_t n = lam_operator_elements(op), C = lam_operator_channels(op);
    E = calloc(C * n, sizeof *E);
    B = calloc(C * n, sizeof *B);
    if (E == NULL || B == NULL) goto done;
    for (size_t i = 0; i < n; i++) E[i] = 1;
    if (lam_refine(refiner, 1, LAM_RADIOSITY, E, NULL, NULL, 1e-9, B, &certificate, &iterations, &error) !=
        LAM_OK)
        goto done;
    fprintf(stderr, "no element is off by more than %.3g, after %zu products with F\n", certificate,
            iterations);
    for (size_t i = 0; i < n; i++) printf("%.17g\n", B[i]);
    result = EXIT_SUCCESS;
done:
    if (result != EXIT_SUCCESS) fprintf(stderr, "%s\n", error.message);
    free(E);
    free(B);
    lam_refiner_free(refiner);
    lam_form_factors_close(F);
    lam_operator_close(op);
    return result;
}
