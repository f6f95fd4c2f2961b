/* Lines of JSON about requests, in the access log, and about changes in the audit log. */
#ifndef LAMBERT_SERVER_HTTP_REQUEST_LOG_H
#define LAMBERT_SERVER_HTTP_REQUEST_LOG_H

#include "server/http/http_request.h"

/* Adds the line of a request that took `ms` milliseconds to the access log, or of a PUT or DELETE to the
 * audit log, where there is one. status 0: the client left before it was answered. Never blocks. */
void request_log(const request *r, unsigned status, double ms);

/* Adds the line of a head that the HTTP library refused, which never became a request. received: bytes of its
 * connection, 0 if unknown; who: an address, "" if unknown. log may be NULL. */
void request_log_unread(access_log *log, const char *who, unsigned status, const char *reason,
                        size_t received);

#endif
