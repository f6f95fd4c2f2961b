/* GET /v1/openapi.json: the description of all routes, the file server/route/openapi.json. GET
 * /deploy/docs/api.md: the manual that the types of problems lead to. */
#include "server/route/document_bytes.h"
#include "server/route/kept_answer.h"

static lam_status keep(const unsigned char *bytes, size_t length, const char *what, kept_forms **out,
                       lam_error *error) {
    buffer b = {0};
    if (!buffer_append(&b, bytes, length))
        return status_fail(error, LAM_ERR_MEMORY, "not enough memory for %s", what);
    return kept_forms_of(&b, NULL, what, out, error);
}

lam_status openapi_keep(kept_forms **out, lam_error *error) {
    return keep(openapi_bytes, openapi_length, "the description of the routes", out, error);
}

lam_status manual_keep(kept_forms **out, lam_error *error) {
    return keep(manual_bytes, manual_length, "the manual of the routes", out, error);
}

bool keeps_openapi(const call *in, kept_source *from, answer *out) {
    (void)out;
    *from = kept_text(in->service->openapi, "application/json");
    return true;
}

bool keeps_manual(const call *in, kept_source *from, answer *out) {
    (void)out;
    *from = kept_text(in->service->manual, "text/plain; charset=utf-8");
    return true;
}
