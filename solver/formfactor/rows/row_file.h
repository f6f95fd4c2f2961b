/* Found rows on a disk, a block of them at a time: a file that is only ever appended to, checksummed, in
 * which a run that was stopped at any moment finds every block that it had finished. */
#ifndef LAMBERT_FORMFACTOR_ROWS_ROW_FILE_H
#define LAMBERT_FORMFACTOR_ROWS_ROW_FILE_H

#include "solver/formfactor/recipe.h"
#include "solver/formfactor/rows/row_code.h"
#include "solver/formfactor/scratch.h"
#include "solver/formfactor/sky_bounce.h"

typedef struct row_file row_file;

/* What the rows of a file are of; those of anything else are refused. Block b holds the rows of the elements
 * at positions b block_rows ... of an order that follows from the geometry. */
typedef struct row_file_contents {
    char geometry[33]; /* mesh_geometry_hash */
    recipe recipe;
    size_t n, block_rows;
    row_kind kind;
    sky_bounce *sky; /* what its tiles receive of each row is kept beside it; NULL: none */
} row_file_contents;

/* Opens a file of a scratch folder and finds the whole blocks in it; what is behind them (a block cut short)
 * is dropped, a block whose checksum is wrong counts as missing. order is [n] and must outlive the file.
 * Errors: LAM_ERR_IO; LAM_ERR_ARGUMENT for a file of other contents, which is left as it is. */
lam_status row_file_open(scratch *s, const char *name, const row_file_contents *contents,
                         const uint32_t *order, row_file **out, lam_error *error);
void row_file_close(row_file *f);

bool row_file_has(const row_file *f, size_t block);

/* Rows that row_file_open found. */
size_t row_file_kept(const row_file *f);

/* Reads a block that is there: rows, by element, point into data, which the caller frees. */
lam_status row_file_read(const row_file *f, size_t block, packed_row *rows, void **data, lam_error *error);

/* Appends a block, whose rows (by element), leaving, absorbed (or neither) and bins of the sky are there. One
 * thread at a time. On LAM_ERR_IO (a full disk) the file holds the blocks it held. Flushed to the disk every
 * few seconds.
 */
lam_status row_file_append(row_file *f, size_t block, const packed_row *rows, const double *leaving,
                           const double *absorbed, lam_error *error);

/* When all blocks are there: rows->rows point into a mapping of the file, which rows owns from then on;
 * leaving, absorbed, [n], and the bins of the sky are filled. */
lam_status row_file_map(row_file *f, packed_rows *rows, double *leaving, double *absorbed, lam_error *error);

#endif
