/* The limits of pages in browsers: the checks of Host, Origin and Sec-Fetch-Site, and the
 * answers to pages of --allow-origin (Fetch standard, CORS protocol). */
#ifndef LAMBERT_SERVER_HTTP_BROWSER_H
#define LAMBERT_SERVER_HTTP_BROWSER_H

#include "server/http/http_request.h"

/* Checks who is asked and which page asks; target is that of the request line. The route was looked for, as
 * /healthz and /readyz tell nothing that a page could want, and those who probe them know no name. False with
 * the answer made: 403, or 204 to the preflight of a page that is allowed. */
bool browser_check(request *r, const char *target);

/* Adds the headers that concern browsers to the answer of r. */
bool browser_add_headers(const request *r, struct MHD_Response *response);

#endif
