/* Applies a store's operator to one lighting: every element of the first channel emits 1.
 * Build: cc apply_one.c $(pkg-config --cflags --libs lambert) -o apply_one     Use: apply_one STORE.h5 */
#include <lambert/lambert.h>
#include <stdio.h>
#include <stdlib.h>

int main(int argc, char **argv) {
    lam_error error = {.message = "usage: apply_one STORE.h5"};
    lam_operator *op = NULL;
    float *E = NULL, *B = NULL;
    void *work = NULL;
    int result = EXIT_FAILURE;

    if (argc != 2 || lam_operator_open(argv[1], &op, &error) != LAM_OK) goto done;
    const size_t n = lam_operator_elements(op), C = lam_operator_channels(op);
    const size_t work_bytes = lam_operator_work_bytes(op, 1);
    E = calloc(C * n, sizeof *E); /* [C][n], in the order of the elements of the mesh */
    B = calloc(C * n, sizeof *B);
    work = malloc(work_bytes);
    if (E == NULL || B == NULL || work == NULL) goto done;
    for (size_t i = 0; i < n; i++) E[i] = 1;
    if (lam_operator_apply(op, 1, LAM_RADIOSITY, E, B, work, work_bytes, &error) != LAM_OK) goto done;
    for (size_t i = 0; i < n; i++) printf("%.9g\n", (double)B[i]);
    result = EXIT_SUCCESS;
done:
    if (result != EXIT_SUCCESS) fprintf(stderr, "%s\n", error.message);
    free(E);
    free(B);
    free(work);
    lam_operator_close(op);
    return result;
}
