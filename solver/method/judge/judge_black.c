#include "solver/method/judge/judge_black.h"

#include <stdlib.h>

lam_status judge_black_find(judge_input *input, lam_error *error) {
    lam_status status = LAM_OK;
    const build_problem *p = input->problem;
    const size_t n = p->n, n_groups = input->group != NULL ? input->n_groups : 1;
    bool *black = memory_allocate(n, sizeof *black, "black elements", error);
    bool *reflects = memory_allocate(n_groups, sizeof *reflects, "black groups", error);
    size_t count = 0;
    input->black = NULL;
    input->all_black = input->black_read = false;
    if (black == NULL || reflects == NULL) TRY(LAM_ERR_MEMORY);
    for (size_t k = 0; k < n * p->n_channels; k++)
        if (p->reflectance[k] > 0) reflects[input->group != NULL ? input->group[k % n] : 0] = true;
    for (size_t i = 0; i < n; i++) {
        black[i] = !reflects[input->group != NULL ? input->group[i] : 0];
        count += black[i];
    }
    if (count == 0) goto done;
    input->all_black = input->black_read = count == n;
    if (input->read != NULL) input->black_read = true;
    for (size_t i = 0; input->read != NULL && i < n; i++)
        if (input->read[i] > 0 && !black[i]) input->black_read = false;
    input->black = black;
    black = NULL;
done:
    free(black);
    free(reflects);
    return status;
}

void judge_black_free(judge_input *input) {
    free(input->black);
    input->black = NULL;
}
