/* The walk over the fields of a head that finds its faults and its client. */
#ifndef LAMBERT_SERVER_HTTP_HEAD_FIELDS_H
#define LAMBERT_SERVER_HTTP_HEAD_FIELDS_H

#include "server/http/http_request.h"

/* Finds who asks (r->peer). False, with the answer made, if readers of this head could differ on where the
 * request ends. O(bytes of the head). */
bool head_check_fields(request *r, const char *version);

#endif
