/* The routes of the contract that are still to come. */
#include "server/route/routes.h"

void not_yet(call *in, answer *out) {
    (void)in;
    answer_refuse(out, 501, "not supported yet");
}
