/* Linear reductions, means and sums alone: their figures by adjoint rows, made and written in steps, so that
 * whoever else wants the thread has it after a millisecond. */
#ifndef LAMBERT_SERVER_ROUTE_LINEAR_FIGURES_H
#define LAMBERT_SERVER_ROUTE_LINEAR_FIGURES_H

#include "server/route/call.h"

typedef struct linear_figures linear_figures;

/* Takes the memory of an answer. Sets in->cost where all rows are known. 422, 503. */
bool linear_figures_begin(call *in, radiosity_request *request, answer_notes *notes, linear_figures **out,
                          problem *why);

/* Goes on for about FIGURES_STEP_MS, or one pass over the operator where rows are missing; *done once the
 * answer is written. 422 for figures that are not finite; 503. */
bool linear_figures_step(call *in, radiosity_request *request, linear_figures *f, batch_workspace *workspace,
                         answer_notes *notes, buffer *b, bool *done, problem *why);

/* f may be NULL. */
void linear_figures_free(linear_figures *f);

#endif
