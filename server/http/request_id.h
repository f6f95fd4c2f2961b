/* Names of requests: in the access log, in X-Request-Id. */
#ifndef LAMBERT_SERVER_HTTP_REQUEST_ID_H
#define LAMBERT_SERVER_HTTP_REQUEST_ID_H

#include <stdint.h>

#define REQUEST_ID_MAX 64

/* Something else at every start, so that ids of different runs differ. */
uint64_t request_id_seed(void);

/* The client's own id where it has 1 to REQUEST_ID_MAX letters, digits and any of -_.:+/=; else (or NULL) one
 * of the seed and the count. */
void request_id_choose(const char *own, uint64_t seed, uint64_t count, char id[REQUEST_ID_MAX + 1]);

#endif
