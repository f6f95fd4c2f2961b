/* Lines of JSON about requests, in the access log, and about changes in the audit log. */
#ifndef LAMBERT_SERVER_HTTP_REQUEST_LOG_H
#define LAMBERT_SERVER_HTTP_REQUEST_LOG_H

#include "server/http/http_request.h"

/* Adds the line of a request that took `ms` milliseconds to the access log, or of a PUT or DELETE to the
 * audit log, where there is one. status 0: the client left before it was answered. Never blocks. */
void request_log(const request *r, unsigned status, double ms);

#endif
