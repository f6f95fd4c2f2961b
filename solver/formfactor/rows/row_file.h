/* Packed rows on a disk: a checksummed file of blocks that is only appended to. A run that was stopped at any
 * moment finds every finished block again. */
#ifndef LAMBERT_FORMFACTOR_ROWS_ROW_FILE_H
#define LAMBERT_FORMFACTOR_ROWS_ROW_FILE_H

#include "solver/formfactor/recipe.h"
#include "solver/formfactor/rows/row_code.h"
#include "solver/formfactor/scratch.h"
#include "solver/formfactor/sky_bounce.h"

typedef struct row_file row_file;

/* The run that the rows of a file belong to; a file of another run is refused. Block b holds the rows of the
 * elements at positions b block_rows ... of an order that follows from the geometry. */
typedef struct row_file_contents {
    char geometry[33]; /* mesh_geometry_hash */
    recipe recipe;
    size_t n, block_rows;
    row_kind kind;
    sky_bounce *sky; /* the bins of each element are kept beside its row; NULL: none */
} row_file_contents;

/* Opens a file of a scratch folder and finds its whole blocks. A block cut short at the end is removed; a
 * block with a wrong checksum counts as missing. order is [n] and must outlive the file. Errors: LAM_ERR_IO;
 * LAM_ERR_ARGUMENT for the file of another run, which is left unchanged. */
lam_status row_file_open(scratch *s, const char *name, const row_file_contents *contents,
                         const uint32_t *order, row_file **out, lam_error *error);
void row_file_close(row_file *f);

bool row_file_has(const row_file *f, size_t block);

/* The number of rows that row_file_open found. */
size_t row_file_kept(const row_file *f);

/* Reads a block for which row_file_has holds: rows, by element, point into data, which the caller frees. */
lam_status row_file_read(const row_file *f, size_t block, packed_row *rows, void **data, lam_error *error);

/* Appends a block: its rows, leaving and absorbed (by element; both may be NULL) and its bins of the sky. One
 * thread at a time. After LAM_ERR_IO (a full disk) the file holds the blocks it held before. Flushed to the
 * disk every few seconds. */
lam_status row_file_append(row_file *f, size_t block, const packed_row *rows, const double *leaving,
                           const double *absorbed, lam_error *error);

/* Maps a file that holds all blocks: rows->rows point into the mapping, which rows then owns. Fills leaving,
 * absorbed, [n], and the bins of the sky. */
lam_status row_file_map(row_file *f, packed_rows *rows, double *leaving, double *absorbed, lam_error *error);

#endif
