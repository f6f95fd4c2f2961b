/* GET /v1/openapi.json: the description of all routes, the file server/route/openapi.json. */
#include "server/route/kept_answer.h"
#include "server/route/openapi.h"

lam_status openapi_keep(kept_forms **out, lam_error *error) {
    buffer b = {0};
    if (!buffer_append(&b, openapi_bytes, openapi_length))
        return status_fail(error, LAM_ERR_MEMORY, "not enough memory for the description of the routes");
    return kept_forms_of(&b, NULL, "the description of the routes", out, error);
}

bool keeps_openapi(const call *in, kept_source *from, answer *out) {
    (void)out;
    *from = kept_text(in->service->openapi, "application/json");
    return true;
}
