/* The walks over the parts of a head: over its fields, for its faults and its client, and over its query. */
#ifndef LAMBERT_SERVER_HTTP_HEAD_FIELDS_H
#define LAMBERT_SERVER_HTTP_HEAD_FIELDS_H

#include "server/http/http_request.h"

/* Finds who asks (r->peer). False, with the answer made, if readers of this head could differ on where the
 * request ends. O(bytes of the head). */
bool head_check_fields(request *r, const char *version);

/* Fills the query of the call, in the order of the target, escapes %XX resolved once; one that is none, or is
 * of a zero byte, stays as it is. False, with the answer made, when memory is short. O(bytes of the query).
 */
bool head_read_query(request *r);

#endif
