/* GET /v1/openapi.json: the description of all routes, the file server/route/openapi.json. */
#include "server/route/openapi.h"
#include "server/route/routes.h"

void get_openapi(call *in, answer *out) {
    buffer b = {0};
    (void)in;
    answer_json(out, &b, buffer_append(&b, openapi_bytes, openapi_length));
    out->cacheable = out->status == 200;
}
