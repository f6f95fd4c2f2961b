/* Packed rows as plain ones. */
#ifndef LAMBERT_TESTS_FOUND_H
#define LAMBERT_TESTS_FOUND_H

#include "solver/formfactor/rows/row_code.h"
#include "solver/linalg/csr.h"
#include "support/suite.h"

#include <stdlib.h>

/* The caller frees the result with csr_free. */
csr found_unpack(const packed_rows *found);

#endif
