/* The groups of a store: area, and mean irradiance with its stated error while the first group emits 1.
 * Build: cc reduce_one.c $(pkg-config --cflags --libs lambert) -o reduce_one     Use: reduce_one STORE.h5 */
#include <lambert/lambert.h>
#include <stdio.h>
#include <stdlib.h>

int main(int argc, char **argv) {
    lam_error error = {.message = "usage: reduce_one STORE.h5"};
    lam_scene *scene = NULL;
    float *exitance = NULL, *H = NULL;
    double *figures = NULL;
    size_t limited;
    int result = EXIT_FAILURE;

    if (argc != 2 || lam_scene_open(argv[1], &scene, &error) != LAM_OK) goto done;
    const lam_operator *op = lam_scene_operator(scene);
    const size_t n = lam_operator_elements(op), C = lam_operator_channels(op);
    H = calloc(C * n, sizeof *H); /* [C][n], in the order of the elements of the mesh */
    exitance = calloc(C, sizeof *exitance);
    figures = calloc(C * LAM_FIGURES, sizeof *figures);
    if (H == NULL || exitance == NULL || figures == NULL) goto done;
    for (size_t c = 0; c < C; c++) exitance[c] = 1;
    const lam_light light = {.groups = (uint32_t[]){0}, .exitances = exitance, .n_groups = 1};
    if (lam_scene_answer(scene, LAM_IRRADIANCE, 1, &light, H, &limited, &error) != LAM_OK) goto done;
    for (uint32_t g = 0; g < lam_scene_groups(scene); g++) {
        lam_stated of;
        if (lam_scene_reduce(scene, 1, &g, 1, H, figures, &error) != LAM_OK) goto done;
        printf("%s %.9g %.9g", lam_scene_group(scene, g), lam_scene_group_area(scene, g), figures[LAM_MEAN]);
        const lam_status stated = lam_scene_stated(scene, LAM_IRRADIANCE, &light, H, 1, &g, &of, &error);
        if (stated == LAM_OK)
            printf(" %.4g\n", of.stated);
        else if (stated == LAM_ERR_UNSUPPORTED)
            printf(" -\n"); /* the store states no errors */
        else
            goto done;
    }
    result = EXIT_SUCCESS;
done:
    if (result != EXIT_SUCCESS) fprintf(stderr, "%s\n", error.message);
    free(H);
    free(exitance);
    free(figures);
    lam_scene_close(scene);
    return result;
}
